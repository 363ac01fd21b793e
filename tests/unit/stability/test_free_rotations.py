"""Rigid rotations that a pinned support leaves: their eigenvalue decides nothing, however large its error."""

from dataclasses import replace

import numpy as np
import pytest

from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.solver_options import NewtonOptions
from lobefem.equilibrium.state import ideal_state
from lobefem.fem.balloon import Balloon
from lobefem.fem.functionals import displacement_of
from lobefem.fem.rigid_motions import is_turn
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.model.cables import Hoops
from lobefem.model.end_plates import EndPlates, PlateLoad
from lobefem.model.film import Isotropic
from lobefem.model.fixed_wrinkles import FixedWrinkles
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.supports import Fixed
from lobefem.model.tension_field import TensionField
from lobefem.stability import one_sided, tracing
from lobefem.stability.free_rotations import FreeRotations
from lobefem.stability.harmonic_buckling import harmonic_pressures
from lobefem.stability.linear_buckling import critical_pressure
from lobefem.stability.modes import find_modes
from lobefem.viz.verdict import verdict


def balloon(comm, support="pinned", load="closed", film=None, lobes=1, divisions=(6, 12), order=2, more=()):
    surface = lobed_cylinder(lobes, divisions, order=order, comm=comm)
    parts = [GasPressure(load), Hoops(), EndPlates(support), *more]
    return Balloon(surface, film or FixedWrinkles(), parts, prestressed=True)


@pytest.mark.parametrize("full", [False, True], ids=["harmonics", "full"])
def test_critical_pressure_of_a_pinned_lobe_of_curved_triangles(comm, full):
    """The gas in a closed balloon does not care how its bottom plate is held."""
    pinned = critical_pressure(balloon(comm, divisions=(8, 12)), full=full)
    assert pinned.pressure == pytest.approx(4977.95, rel=1e-6)
    assert pinned.mode.harmonic == 6
    assert pinned.mode.residual < 1e-9
    clamped = critical_pressure(balloon(comm, "clamped", divisions=(8, 12)), full=full)
    assert pinned.pressures[0] == pytest.approx(clamped.pressures[0], rel=1e-9)


@pytest.mark.parametrize("load", ["closed", "film"])
def test_charts_of_pinned_stacks_are_those_of_clamped_ones(comm, load):
    """Those of n = 1 but for the discretisation of the ideal state's balance."""
    charts = [
        harmonic_pressures(balloon(comm, support, load, lobes=2, divisions=(6, 8)), range(4))
        for support in ("pinned", "clamped")
    ]
    pinned, clamped = (np.array(chart.pressures) for chart in charts)
    np.testing.assert_allclose(pinned[[0, 2, 3]], clamped[[0, 2, 3]], rtol=1e-9)
    assert pinned[1] == pytest.approx(clamped[1], rel=3e-3)
    assert max(charts[0].residuals) < 1e-9


def test_critical_pressure_of_n_1_is_that_at_which_its_modes_lose_stability(comm):
    b = balloon(comm, lobes=2, divisions=(4, 4))
    critical = critical_pressure(b, harmonic=1).pressure
    for share, stable in ((0.999, True), (1.001, False)):
        modes = find_modes(ideal_state(b, share * critical), 1, harmonics=1)
        assert modes.stable is stable


@pytest.mark.parametrize("load", ["closed", "film"])
@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("mass", ["unit", "nodal"])
def test_modes_of_the_full_model_and_of_single_harmonics_know_rotations(comm, load, order, mass):
    b = balloon(comm, load=load, order=order, lobes=2, divisions=(4, 8))
    state = ideal_state(b, 1000.0)
    every, single = find_modes(state, 8, mass=mass), find_modes(state, 8, mass=mass, harmonics=[0, 1])
    for modes in (every, single):
        turns = [m for m in modes.modes if m.rigid]
        assert [m.kind for m in turns] == ["rigid rotation"] * 2
        assert [m.harmonic for m in turns] == [1, 1]
        assert modes.stable
        assert modes.lowest > 0
        assert max(m.residual for m in modes.modes) < 1e-6
    assert every.num_negative == (0 if load == "closed" else None)
    sways = [[m.value for m in modes.modes if m.kind == "sway"][:2] for modes in (every, single)]
    np.testing.assert_allclose(*sways, rtol=1e-6)
    turned = [[m.value for m in modes.modes if m.rigid] for modes in (every, single)]
    np.testing.assert_allclose(*turned, rtol=1e-5, atol=1e-6 * abs(sways[0][0]))


def test_a_rotation_of_negative_eigenvalue_is_no_instability(comm):
    """Discretisation makes it -1e-5 p on this mesh; the lowest own mode is 2552 Pa/m."""
    modes = find_modes(ideal_state(balloon(comm, film=Isotropic(), divisions=(8, 12)), 1000.0), 1)
    assert [m.rigid for m in modes.modes] == [True, True, False]
    assert modes[0].value.real < -1e-3
    assert modes.stable
    assert modes.num_negative == 0
    assert modes.lowest == pytest.approx(2552.53, rel=1e-3)


def test_bounds_of_a_tension_field_leave_rotations_out(comm):
    pinned, clamped = (
        one_sided.one_sided_charts(balloon(comm, support, film=TensionField(), divisions=(4, 8)), range(3))
        for support in ("pinned", "clamped")
    )
    for one, other in zip(pinned, clamped, strict=True):
        np.testing.assert_allclose(one.pressures, other.pressures, rtol=1e-2)
        assert min(one.pressures) > 0
    sides = one_sided.one_sided_modes(balloon(comm, film=TensionField(), divisions=(4, 8)), 100.0, 3)
    assert sides.bounds == (sides.wrinkled.lowest, sides.mean.lowest)
    assert sides.bounds[0] > 1.0 > abs(sides.wrinkled[0].value.real)


def test_branches_of_single_harmonics_leave_rotations_out(comm):
    b = balloon(comm, lobes=2, divisions=(4, 8))
    (lowest, _) = tracing.branches(b, [500.0, 1000.0], count=2, harmonics=1)
    own = find_modes(ideal_state(b, 1000.0), 3, harmonics=1)
    assert lowest.values[-1] == pytest.approx(own.lowest, rel=1e-6)


@pytest.mark.parametrize("load", ["closed", "film"])
def test_rotations_of_a_tilted_equilibrium_cost_nothing(comm, load):
    """Of a stack that lies 0.3 rad aside, whose bottom plate's two tilts are no rotations about x and y."""
    b = balloon(comm, load=load, film=Isotropic(), lobes=2, divisions=(4, 6), order=1)
    state = inflate(b, 1000.0, options=NewtonOptions(rtol=1e-11))
    q = state.vector()
    turn = FreeRotations(b, q, b.mass(q)).vectors[0]
    q.axpy(0.3 / np.abs(b.map.parameters(turn)[:2]).max(), turn)
    with q as array:
        start = array.copy()
    tilted = inflate(b, 1000.0, start=replace(state, unknowns=start), options=NewtonOptions(rtol=1e-11))
    q = tilted.restore()
    assert np.linalg.norm(b.map.parameters(q)[:2]) > 0.1
    rotations = FreeRotations(b, q, b.mass(q))
    K, force = b.tangent(q), q.duplicate()
    for t in rotations.vectors:
        K.mult(t, force)
        assert force.norm() < 1e-8 * K.norm() * t.norm()
        assert is_turn(b, tilted.displacement, displacement_of(b, q, t))
    modes = find_modes(tilted, 4)
    assert [m.rigid for m in modes.modes] == [True, True, False, False]
    assert modes.stable
    assert np.abs(modes.values[:2]).max() < 1e-6 * modes.lowest


def test_what_resists_a_tilt_makes_it_a_mode_like_others(comm):
    """A dead push on the top plate tips a pinned stack over, a pull holds it upright."""
    for force, stable in ((-50.0, False), (50.0, True)):
        b = balloon(
            comm, film=Isotropic(), lobes=2, divisions=(4, 6), order=1, more=[PlateLoad((0, 0, force))]
        )
        modes = find_modes(inflate(b, 1000.0), 2)
        assert modes.stable is stable
        assert not any(m.rigid for m in modes.modes)
    held = balloon(comm, order=1, divisions=(4, 6), more=[Fixed(lambda x: np.abs(x[2] - x[2].mean()) < 1e-3)])
    q = held.map.create_vector()
    assert len(FreeRotations(held, q, held.mass(q))) == 0


def test_verdicts_do_not_speak_of_rotations():
    turn = {"kind": "rigid rotation", "harmonic": 1, "real": -2.0, "imag": 0.0}
    local = {"kind": "local", "harmonic": 4, "real": -1.0, "imag": 0.0}
    entry = {"pressure": 100.0, "stable": False, "modes": [turn, turn, local]}
    (first, *_) = verdict({"command": "modes", "pressures": [entry], "film": "isotropic"})
    assert "the film buckles locally (4 waves around)" in first
