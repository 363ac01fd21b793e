"""One sector against the full model (physics: harmonic reduction)."""

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse

from lobefem import _dolfinx  # noqa: F401
from lobefem.balloon import Balloon, Held
from lobefem.cables import Hoops
from lobefem.critical import critical_pressure
from lobefem.cyclic import CyclicReduction
from lobefem.equilibrium import ideal_state
from lobefem.errors import InputError
from lobefem.films import FixedWrinkles, Isotropic
from lobefem.loads import GasPressure
from lobefem.plates import EndPlates
from lobefem.stability import find_modes
from lobefem.surface import lobed_cylinder


def dense(matrix):
    pointers, columns, values = matrix.getValuesCSR()
    return scipy.sparse.csr_matrix((values, columns, pointers), shape=matrix.getSize()).toarray()


CASES = {
    "single, film": {"lobes": 1, "divisions": (6, 9), "load": "film", "film": FixedWrinkles()},
    "stack, closed, quadratic": {
        "lobes": 2,
        "divisions": (3, 8),
        "order": 2,
        "load": "closed",
        "film": FixedWrinkles(),
    },
    "stack, film, alternating": {
        "lobes": 2,
        "divisions": (4, 12),
        "diagonals": "alternating",
        "load": "film",
        "film": Isotropic(),
    },
    "quadrilaterals, elastic bar": {
        "lobes": 1,
        "divisions": (4, 8),
        "cell": "quadrilateral",
        "load": "closed",
        "film": Isotropic(),
        "bar": 2.15e9,
    },
    "pinned": {"lobes": 1, "divisions": (4, 8), "load": "closed", "film": Isotropic(), "support": "pinned"},
}


def build(lobes, divisions, load, film, bar=True, support="clamped", **mesh):
    surface = lobed_cylinder(lobes, divisions, **mesh)
    parts = [GasPressure(load), Hoops(EA=1e6), EndPlates(bar=bar, support=support)]
    return Balloon(surface, film, parts, prestressed=True)


@pytest.mark.parametrize("case", CASES)
def test_all_harmonics_together_are_the_full_model(case):
    balloon = build(**CASES[case])
    state = ideal_state(balloon, 1000.0)
    q = state.activate()
    K, B = balloon.tangent(q), balloon.mass(q)
    reduction = CyclicReduction(balloon)
    found = []
    for n in range(reduction.order // 2 + 1):
        K_n, plates = reduction.reduce(K, n)
        B_n, _ = reduction.reduce(B, n)
        assert (plates > 0) == (n < 2)  # plates enter n = 0 and n = 1 only
        found.append(scipy.linalg.eigvals(dense(K_n), dense(B_n)))
    found = np.concatenate(found)
    assert found.size == balloon.map.size
    full = find_modes(state, 12)
    for value in full.values:
        assert np.abs(found - value).min() <= 1e-8 * abs(value)
    # a pair is there twice
    lowest = np.sort(found.real)[: len(full)]
    assert np.allclose(lowest, full.values.real[: len(lowest)], rtol=1e-7)


def test_a_vector_of_one_harmonic_is_one_of_the_full_model():
    balloon = build(**CASES["stack, film, alternating"])
    q = ideal_state(balloon, 1000.0).activate()
    K, B = balloon.tangent(q), balloon.mass(q)
    reduction = CyclicReduction(balloon)
    for n in (0, 1, 2):
        K_n, plates = reduction.reduce(K, n)
        B_n, _ = reduction.reduce(B, n)
        values, vectors = scipy.linalg.eig(dense(K_n), dense(B_n))
        real = np.flatnonzero(np.abs(values.imag) < 1e-9 * np.abs(values))
        k = real[np.argmin(values[real].real)]
        x, _ = reduction.expand(vectors[:, k].real, n, plates)
        Kx, Bx = x.duplicate(), x.duplicate()
        K.mult(x, Kx)
        B.mult(x, Bx)
        norm = Kx.norm()
        Kx.axpy(-values[k].real, Bx)
        assert Kx.norm() < 1e-7 * norm


def test_critical_pressure_of_a_harmonic_is_that_of_the_full_model():
    balloon = build(lobes=1, divisions=(12, 20), load="film", film=FixedWrinkles())
    full = critical_pressure(balloon)
    one = critical_pressure(balloon, harmonic=full.mode.harmonic)
    assert one.pressure == pytest.approx(full.pressure, rel=1e-8)
    assert one.mode.harmonic == full.mode.harmonic
    assert one.mode.residual < 1e-8
    others = [critical_pressure(balloon, harmonic=n).pressure for n in range(2, 11)]
    assert min(others) == pytest.approx(full.pressure, rel=1e-8)
    # global modes gain stiffness with the pressure
    assert critical_pressure(balloon, harmonic=0).pressure == np.inf
    assert critical_pressure(balloon, harmonic=1).pressure == np.inf


@pytest.mark.parametrize(("n", "continuum"), [(2, 33817.0), (3, 12935.0)])
def test_low_harmonics_converge_to_the_continuum(n, continuum):
    """Physics, sec. 5: one lobe, rims held, Fourier in theta; the order is 4 in the cell size."""
    errors = []
    for divisions in ((9, 12), (18, 24)):
        surface = lobed_cylinder(1, divisions, order=2)
        parts = [GasPressure("closed"), EndPlates(support="fixed")]
        balloon = Balloon(surface, FixedWrinkles(), parts, prestressed=True)
        errors.append(critical_pressure(balloon, harmonic=n).pressure / continuum - 1)
    assert abs(errors[1]) < 3e-3
    assert np.log2(errors[0] / errors[1]) > 3


def test_what_cannot_be_reduced_is_refused():
    balloon = build(lobes=1, divisions=(4, 8), load="closed", film=Isotropic())
    with pytest.raises(InputError, match="harmonic = 5: a mesh of 8 equal sectors has harmonics 0 to 4"):
        critical_pressure(balloon, harmonic=5)
    free = lobed_cylinder(1, layout="unstructured", size=2.0)
    parts = [EndPlates(support="fixed")]
    with pytest.raises(InputError, match="needs a cyclic mesh; use mesh layout 'structured'"):
        critical_pressure(Balloon(free, Isotropic(), parts, prestressed=True), harmonic=2)
    surface = lobed_cylinder(1, (4, 8))
    held = Balloon(surface, Isotropic(), [Held("rim_bottom", (2,)), Held("rim_top")], prestressed=True)
    with pytest.raises(InputError, match="free or held in all components"):
        critical_pressure(held, harmonic=2)
