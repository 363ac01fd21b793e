"""One sector against the full model (docs/theory/harmonics.md)."""

from dataclasses import replace
from functools import partial

import builders
import numpy as np
import pytest
import scipy.linalg

from lobefem.equilibrium.form_finding import find_form
from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.solver_options import NewtonOptions
from lobefem.equilibrium.state import ideal_state
from lobefem.errors import InputError
from lobefem.fem.balloon import Balloon
from lobefem.fem.rigid_motions import num_turns
from lobefem.geometry.natural_shape import NaturalShape
from lobefem.geometry.stacks import cylinder, lobed_cylinder
from lobefem.linalg import dolfinx_compat  # noqa: F401
from lobefem.model.cables import Cables, Hoops
from lobefem.model.end_plates import EndPlates
from lobefem.model.film import Isotropic
from lobefem.model.fixed_wrinkles import FixedWrinkles
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.kinematics import revolved_frame
from lobefem.model.supports import Fixed
from lobefem.model.tension_field import TensionField
from lobefem.stability.cyclic import Sector
from lobefem.stability.harmonic_buckling import harmonic_pressures
from lobefem.stability.linear_buckling import critical_pressure
from lobefem.stability.modes import find_modes

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
    "quadratic quadrilaterals": {
        "lobes": 1,
        "divisions": (3, 7),
        "cell": "quadrilateral",
        "order": 2,
        "load": "film",
        "film": Isotropic(),
    },
    "pinned": {"lobes": 1, "divisions": (4, 8), "load": "closed", "film": Isotropic(), "support": "pinned"},
}


build = partial(builders.stack, EA=1e6, prestressed=True)


@pytest.mark.parametrize("case", CASES)
def test_all_harmonics_together_are_the_full_model(case):
    balloon = build(**CASES[case])
    state = ideal_state(balloon, 1000.0)
    sector = Sector(balloon)
    assert sector.balloon.surface.copies == balloon.surface.cyclic_order
    sector.balloon.set_loads(1000.0, 1000.0)
    q = sector.balloon.map.create_vector()
    K, B = sector.balloon.tangent(q), sector.balloon.mass(q)
    found = []
    for n in range(sector.order // 2 + 1):
        assert (sector.num_plates(n) > 0) == (n < 2)  # plates enter n = 0 and n = 1 only
        K_n, B_n = (sector.reduce(A, n).toarray() for A in (K, B))
        turn = sector.rotation(q, B_n, n)
        if turn is not None:  # left out with what is not orthogonal to it
            basis = scipy.linalg.null_space((B_n @ turn).conj()[None, :])
            K_n, B_n = (basis.conj().T @ A @ basis for A in (K_n, B_n))
        values = scipy.linalg.eigvals(K_n, B_n)
        found += [values] if n == 0 or 2 * n == sector.order else [values, values.conj()]
    found = np.concatenate(found)
    assert found.size == balloon.map.size - num_turns(balloon)
    own = np.array([mode.value for mode in find_modes(state, 12).modes if not mode.rigid])
    for value in own:
        assert np.abs(found - value).min() <= 1e-8 * abs(value)
    # a pair is there twice
    lowest = np.sort(found.real)[: len(own)]
    assert np.allclose(lowest, own.real, rtol=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("mass", ["unit", "nodal"])
@pytest.mark.parametrize("case", CASES)
def test_modes_by_harmonics_are_those_of_the_full_model(case, mass):
    balloon = build(**CASES[case])
    state = ideal_state(balloon, 1000.0)
    full = find_modes(state, 9, mass=mass)
    split = find_modes(state, 9, mass=mass, harmonics=Sector(balloon).harmonics)
    assert len(split) == len(full)
    assert np.allclose(split.values, full.values, rtol=1e-8)
    assert [m.kind for m in split.modes] == [m.kind for m in full.modes]
    assert max(m.residual for m in split.modes) < 1e-8
    assert split.symmetric == full.symmetric
    B = balloon.mass(state.restore(), mass)
    assert B.getSize()[0] == balloon.map.size


@pytest.mark.slow
def test_modes_of_an_inflated_state_by_harmonics():
    balloon = build(film=TensionField(), load="film", divisions=(6, 10), prestressed=False)
    state = inflate(balloon, 500.0)
    full = find_modes(state, 7)
    split = find_modes(state, 7, harmonics=range(6))
    assert np.allclose(split.values, full.values, rtol=1e-8)
    alone = find_modes(state, 2, harmonics=3)
    assert {m.harmonic for m in alone.modes} == {3}
    assert alone.values[0] == pytest.approx(alone.values[1])


def test_a_formed_lobe_has_its_harmonics_too():
    form = find_form(cylinder(2.0, 4.19, (8, 12)), 20.0)
    surface = form.surface(2, (6, 10))
    parts = [GasPressure("film"), Hoops(), EndPlates()]
    balloon = Balloon(surface, FixedWrinkles(), parts, prestressed=True)
    full, split = critical_pressure(balloon, full=True), critical_pressure(balloon)
    assert split.pressure == pytest.approx(full.pressure, rel=1e-8)


@pytest.mark.parametrize("load", ["closed", "film"])
def test_an_elastic_bar_holds_a_sectors_share_of_a_formed_lobes_pull(load):
    surface = lobed_cylinder(1, (4, 8), shape=NaturalShape.between_rims(2.0, 4.19, 0.3), cell="quadrilateral")
    parts = [GasPressure(load), EndPlates(bar=2.15e9)]
    balloon = Balloon(surface, Isotropic(), parts, prestressed=True)
    assert abs(surface.shape.axial_excess) > 1.0
    state = ideal_state(balloon, 1000.0)
    full, split = find_modes(state, 6), find_modes(state, 6, harmonics=range(5))
    np.testing.assert_allclose(split.values, full.values, rtol=1e-8)


def test_what_one_sector_holds_alone_is_of_no_single_harmonic():
    surface = lobed_cylinder(1, (4, 8), cell="quadrilateral")
    parts = [GasPressure("closed"), Hoops(EA=1e6), EndPlates()]
    free = Balloon(surface, Isotropic(), parts, prestressed=True)
    limit = critical_pressure(free).pressure
    shape = surface.shape
    for angle in (0.0, np.pi):
        place = np.array([shape.R0 * np.cos(angle), 0.0, shape.height / 2])
        tether = Fixed(lambda x, place=place: np.linalg.norm(x.T - place, axis=1) < 1e-6)
        tethered = Balloon(surface, Isotropic(), [*parts, tether], prestressed=True)
        with pytest.raises(InputError, match="needs all sectors held alike; leave harmonics out"):
            find_modes(ideal_state(tethered, 1000.0), 2, harmonics=range(5))
        found = critical_pressure(tethered)
        assert found.pressure == pytest.approx(critical_pressure(tethered, full=True).pressure, rel=1e-12)
        assert found.pressure >= limit * (1 - 1e-9)


@pytest.mark.parametrize("moved", ["one node", "one node of a rim", "whole rings"])
def test_a_surface_that_was_moved_by_hand_has_no_equal_sectors(moved):
    surface = lobed_cylinder(1, (4, 8))
    x, shape = surface.mesh.geometry.x, surface.shape
    where = np.isclose(x[:, 2], 0.0 if "rim" in moved else shape.half_height)
    if moved != "whole rings":
        where &= np.isclose(np.arctan2(x[:, 1], x[:, 0]), 0.0)
    x[where, :2] *= 1.01
    parts = [GasPressure("film"), EndPlates()]
    balloon = Balloon(surface, Isotropic(), parts, prestressed=True)
    count = 8 if moved == "whole rings" else 1
    text = f"^a single harmonic needs equal sectors of the shape as drawn, and {count} nodes lie elsewhere"
    with pytest.raises(InputError, match=text):
        find_modes(ideal_state(balloon, 100.0), 2, harmonics=[2])
    found = critical_pressure(balloon)
    assert found.pressure == pytest.approx(critical_pressure(balloon, full=True).pressure, rel=1e-12)
    modes = find_modes(ideal_state(balloon, 100.0), 8)  # not those of a cyclic shape, which come in pairs
    assert not modes.symmetric


def test_cords_on_edges_of_ones_own_are_of_no_single_harmonic():
    """A sector is meshed anew, without the edges that a user has named."""
    surface = lobed_cylinder(2, (4, 8))
    own = replace(surface, groups=surface.groups | {"tendon_1": surface.groups["seam_1"]})
    parts = [GasPressure("closed"), EndPlates(), Cables(EA=1e6, on=("tendon_*",))]
    balloon = Balloon(own, Isotropic(), parts, prestressed=True)
    with pytest.raises(InputError, match=r"cables on tendon_\* lie on edges that one sector lacks"):
        find_modes(ideal_state(balloon, 100.0), 2, harmonics=[2])
    found = critical_pressure(balloon)
    assert found.pressure == pytest.approx(critical_pressure(balloon, full=True).pressure, rel=1e-9)


@pytest.mark.serial
@pytest.mark.slow
def test_harmonics_that_a_sector_cannot_tell_apart_are_told_by_their_shape():
    """Quadratic cells have two nodes a sector on each ring: n and N - n have the same phase."""
    surface = lobed_cylinder(1, (12, 24), order=2)
    parts = [GasPressure("film"), EndPlates(support="fixed")]
    balloon = Balloon(surface, FixedWrinkles(), parts, prestressed=True)
    chart = harmonic_pressures(balloon)
    assert chart.harmonics == tuple(range(25))
    full = critical_pressure(balloon, full=True)
    assert chart.pressure == pytest.approx(full.pressure, rel=1e-8)
    assert chart.lowest == full.mode.harmonic
    assert chart[6] == pytest.approx(2746.36, rel=0.02)  # the continuum's
    for n in (6, 15):
        assert critical_pressure(balloon, harmonic=n).mode.harmonic == n


def test_harmonics_of_quadratic_cells_are_double_but_for_the_first_and_the_last():
    """Eight sectors with two nodes each on a ring: n = 4 is half of the sectors, n = 8 half of the nodes."""
    sector = Sector(build(film=Isotropic(), lobes=1, divisions=(3, 8), order=2))
    assert (sector.order, sector.columns, sector.harmonics) == (8, 2, range(9))
    assert [sector.copies(n) for n in range(9)] == [1, 2, 2, 2, 2, 2, 2, 2, 1]
    linear = Sector(build(film=Isotropic(), lobes=1, divisions=(3, 8)))
    assert [linear.copies(n) for n in linear.harmonics] == [1, 2, 2, 2, 1]


@pytest.mark.parametrize("n", range(9))
def test_share_of_a_harmonic_in_a_wave_on_quadratic_cells(n):
    """Of n and -n together: all of a wave's own, nothing of that which the sectors cannot tell from it."""
    sector = Sector(build(film=Isotropic(), lobes=1, divisions=(3, 8), order=2))
    x = sector.balloon.X[np.unique(sector.balloon.map.free // 3)]
    angle = np.mod(np.arctan2(x[:, 1], x[:, 0]) + 1e-9, 2 * np.pi) - 1e-9
    near = angle < 2 * np.pi / 8 - 1e-6
    # slots lie row by row, as the sector's nodes by height and angle do
    rows = np.lexsort((np.round(angle[near], 6), np.round(x[near, 2], 6)))
    angle = angle[near][rows]
    wave = np.exp(1j * n * angle)
    alias = np.exp(1j * (n - 8) * angle)
    for field, share in ((wave, 1.0), (alias, 1.0 if n == 4 else 0.0)):
        vector = np.repeat(field, 3)
        assert vector.size == 3 * sector.num_slots
        assert sector.share(vector, n) == pytest.approx(share, abs=1e-12)
    if n == 4:  # a standing wave is half of each
        assert sector.share(np.repeat(np.cos(n * angle), 3).astype(complex), n) == pytest.approx(1)
        mixed = wave.conj() + 2 * np.exp(1j * 12 * angle)
        assert sector.share(np.repeat(mixed, 3), n) == pytest.approx(1)


@pytest.mark.parametrize(("off", "refused"), [(1e-3, True), (3e-6, True), (1e-8, False)])
def test_an_inflated_state_without_the_symmetry_is_refused(off, refused):
    """Newton's method leaves 1e-8 of the motion; what is more is a state of its own."""
    balloon = build(film=Isotropic(), lobes=1, prestressed=False)
    state = inflate(balloon, 1000.0, options=NewtonOptions(rtol=1e-12))
    if balloon.comm.rank == 0:
        unknowns = state.unknowns.copy()
        unknowns[0] += off * state.max_displacement
        state = replace(state, unknowns=unknowns)
    if refused:
        with pytest.raises(InputError, match="the state differs from sector to sector by"):
            find_modes(state, 2, harmonics=[2])
    else:
        assert {m.harmonic for m in find_modes(state, 2, harmonics=[2]).modes} == {2}


def test_a_state_without_the_symmetry_is_refused():
    balloon = build(lobes=1)
    state = ideal_state(balloon, 1000.0)
    rank = balloon.comm.rank
    moved = state.unknowns.copy()
    if moved.size:
        moved[0] += 0.01 * (rank == 0)
    state = replace(state, unknowns=moved)
    with pytest.raises(InputError, match="the state differs from sector to sector by"):
        find_modes(state, 2, harmonics=[2])


def test_a_vector_of_one_harmonic_is_one_of_the_full_model():
    balloon = build(**CASES["stack, film, alternating"])
    q = ideal_state(balloon, 1000.0).restore()
    K, B = balloon.tangent(q), balloon.mass(q)
    sector = Sector(balloon)
    sector.balloon.set_loads(1000.0, 1000.0)
    own = sector.balloon.map.create_vector()
    K_s, B_s = sector.balloon.tangent(own), sector.balloon.mass(own)
    for n in (0, 1, 2):
        values, vectors = scipy.linalg.eig(sector.reduce(K_s, n).toarray(), sector.reduce(B_s, n).toarray())
        k = int(np.argmin(values.real))
        x, y = sector.expand(balloon, vectors[:, k], n)
        K_x, K_y, B_x, B_y = (v.duplicate() for v in (x, x, x, x))
        for A, v, out in ((K, x, K_x), (K, y, K_y), (B, x, B_x), (B, y, B_y)):
            A.mult(v, out)
        norm = np.hypot(K_x.norm(), K_y.norm())
        a, b = values[k].real, values[k].imag
        K_x.axpy(-a, B_x)
        K_x.axpy(b, B_y)
        K_y.axpy(-a, B_y)
        K_y.axpy(-b, B_x)
        assert np.hypot(K_x.norm(), K_y.norm()) < 1e-7 * norm


@pytest.mark.slow
def test_critical_pressure_of_a_harmonic_is_that_of_the_full_model():
    balloon = build(lobes=1, divisions=(12, 20), load="film", film=FixedWrinkles())
    full = critical_pressure(balloon, full=True)
    every = critical_pressure(balloon)
    assert np.allclose(every.pressures, full.pressures, rtol=1e-8)
    assert len(every.pressures) == 2
    assert every.mode.harmonic == full.mode.harmonic
    one = critical_pressure(balloon, harmonic=full.mode.harmonic)
    assert one.pressure == pytest.approx(full.pressure, rel=1e-8)
    assert one.mode.harmonic == full.mode.harmonic
    assert one.mode.kind == full.mode.kind
    assert one.mode.residual < 1e-8
    others = [critical_pressure(balloon, harmonic=n).pressure for n in range(2, 11)]
    assert min(others) == pytest.approx(full.pressure, rel=1e-8)
    # global modes gain stiffness with the pressure
    assert critical_pressure(balloon, harmonic=0).pressure == np.inf
    assert critical_pressure(balloon, harmonic=1).pressure > 1e5


@pytest.mark.serial
@pytest.mark.parametrize(("n", "continuum"), [(2, 33817.0), (3, 12935.0)])
def test_low_harmonics_converge_to_the_continuum(n, continuum):
    """docs/theory/continuum.md: one lobe, rims held, Fourier in theta; the order is 4 in the cell size."""
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
    with pytest.raises(InputError, match="harmonic = 5: a mesh of 8 equal sectors has harmonics 0 to 4"):
        find_modes(ideal_state(balloon, 10.0), harmonics=[2, 5])
    with pytest.raises(InputError, match="no harmonics are given"):
        find_modes(ideal_state(balloon, 10.0), harmonics=[])
    for bad in (2.0, [2.5], "2", [True]):
        with pytest.raises(InputError, match=r"^a harmonic is .*; give an integer, 0 or more$"):
            find_modes(ideal_state(balloon, 10.0), harmonics=bad)
    with pytest.raises(InputError, match=r"^a harmonic is 2.5; give an integer, 0 or more$"):
        critical_pressure(balloon, harmonic=2.5)
    with pytest.raises(InputError, match="leave out full=True"):
        critical_pressure(balloon, harmonic=2, full=True)
    free = lobed_cylinder(1, layout="unstructured", size=2.0)
    parts = [EndPlates(support="fixed")]
    with pytest.raises(InputError, match="needs a cyclic mesh; use mesh layout 'structured'"):
        critical_pressure(Balloon(free, Isotropic(), parts, prestressed=True), harmonic=2)
    with pytest.raises(InputError, match="an unstructured mesh has no equal sectors"):
        lobed_cylinder(1, layout="unstructured", size=2.0, sector=True)
    surface = lobed_cylinder(1, (4, 8))
    held = Balloon(surface, Isotropic(), [Fixed("rim_bottom", (2,)), Fixed("rim_top")], prestressed=True)
    with pytest.raises(InputError, match="free or held in all components"):
        critical_pressure(held, harmonic=2)
    frame = revolved_frame(surface.mesh, surface.axis)
    framed = Balloon(surface, Isotropic(), parts, prestressed=True, frame=frame)
    with pytest.raises(InputError, match="leave frame, pattern and layers out"):
        critical_pressure(framed, harmonic=2)


def test_one_sector_is_no_whole_balloon():
    sector = Balloon(lobed_cylinder(1, (4, 8), sector=True), FixedWrinkles(), [EndPlates()], prestressed=True)
    for use in (
        lambda: ideal_state(sector, 5.0),
        lambda: critical_pressure(sector),
    ):
        with pytest.raises(InputError, match="one sector of a balloon; mesh the whole surface"):
            use()
