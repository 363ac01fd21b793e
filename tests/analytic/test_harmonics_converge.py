"""Critical pressures of single harmonics converge to those without a mesh, which share no code with them.

One lobe of the paper's design, rims held, fixed wrinkles. The package's value belongs to a mesh; as it is
refined it tends to that of `fourier.py` with the square of the cell size for linear elements, and nearly
its fourth power for quadratic ones.

Quadratic cells have two nodes around in each sector, so their harmonic n also holds N - n, N + n, ..., and
these are unstable at almost no pressure. Quadrilaterals keep them apart. The skew diagonals of
triangles mix them in where their critical pressures come near: n = 3, 5 and 6 then approach from changing
sides (within 0.04 %, 0.04 % and 2 % on 24 x 48), without a rate. They have one for n = 2 and 4.
"""

import numpy as np
import pytest
from builders import stack
from fourier import Lobe

from lobefem.model.film import Isotropic
from lobefem.model.fixed_wrinkles import FixedWrinkles
from lobefem.stability.harmonic_buckling import harmonic_pressures

pytestmark = pytest.mark.serial

# the digits of degree 40, which all of degree 16 share but for 1e-9
PRESSURES = {2: 33817.341, 3: 12934.602, 4: 6818.192, 5: 4156.158, 6: 2746.357}


def errors_of(comm, meshes, harmonics, order, cell, film=None, law="fixed"):
    """Relative errors, rows meshes, columns harmonics; of one sector of each mesh, which has them all."""
    exact = np.array([Lobe(n).critical_pressure(law) for n in harmonics])
    mesh = {"lobes": 1, "order": order, "cell": cell, "sector": True, "support": "fixed", "prestressed": True}
    balloons = [stack(comm, film or FixedWrinkles(), "film", divisions=m, **mesh) for m in meshes]
    return np.array([harmonic_pressures(b, harmonics).pressures for b in balloons]) / exact - 1


def check_rates(errors, meshes, least):
    sizes = np.array([1 / around for _, around in meshes])
    rates = np.diff(np.log(np.abs(errors)), axis=0) / np.diff(np.log(sizes))[:, None]
    assert (rates > least).all(), f"rates\n{rates}\nof relative errors\n{errors}"


@pytest.mark.parametrize("n", PRESSURES)
def test_the_continuum_value_converges_faster_than_any_power(n):
    by_degree = [Lobe(n, degree).critical_pressure() for degree in (8, 12, 16, 24, 40)]
    errors = np.abs(np.array(by_degree[:-1]) / by_degree[-1] - 1)
    assert errors[0] < 2e-4
    assert errors[1] < 1e-6
    assert (errors[2:] < 1e-9).all(), errors
    assert by_degree[-1] == pytest.approx(PRESSURES[n], abs=1e-3)
    assert Lobe(n).at_any_pressure() > 0.2


@pytest.mark.parametrize("n", [7, 8, 12, 20])
def test_from_seven_waves_on_fixed_wrinkles_are_unstable_at_any_pressure(n):
    lobe = Lobe(n)
    assert lobe.critical_pressure(low=1e-3) == 0.0
    for pressure in np.logspace(-3, 6, 19):
        assert lobe.lowest("fixed", pressure) < 0
    # a motion that strains no meridian has K(p)/p < 0 at every p, however small: the reason
    values = [Lobe(n, degree).at_any_pressure() for degree in (12, 18)]
    assert max(values) < -0.1
    assert values[0] == pytest.approx(values[1], rel=1e-3)


def test_the_isotropic_film_is_stable_far_longer():
    pressures = [Lobe(n).critical_pressure("isotropic") for n in range(2, 13)]
    assert np.argmin(pressures) + 2 == 7
    assert min(pressures) == pytest.approx(226997.826, abs=1e-3)


def test_linear_triangles_converge_with_the_square_of_their_size(comm):
    meshes = [(18, 36), (24, 48), (36, 72)]
    errors = errors_of(comm, meshes, list(PRESSURES), 1, "triangle")
    check_rates(errors, meshes, 1.8)
    assert errors[-1].max() < 0.2
    assert errors.min() > 0  # from above


def test_quadratic_quadrilaterals_converge_with_nearly_the_fourth_power(comm):
    meshes = [(12, 24), (16, 32), (24, 48)]
    errors = errors_of(comm, meshes, list(PRESSURES), 2, "quadrilateral")
    check_rates(errors, meshes, 3.0)
    assert np.abs(errors[-1]).max() < 6e-4


def test_quadratic_triangles_converge_where_no_other_harmonic_mixes_in(comm):
    meshes = [(12, 24), (18, 36), (24, 48)]
    errors = errors_of(comm, meshes, [2, 4], 2, "triangle")
    check_rates(errors, meshes, 3.0)
    assert np.abs(errors[-1]).max() < 2e-3


def test_the_isotropic_film_converges_too(comm):
    meshes = [(8, 16), (12, 24), (16, 32)]
    errors = errors_of(comm, meshes, [2, 3, 7], 2, "quadrilateral", Isotropic(), "isotropic")
    check_rates(errors, meshes, 3.0)
