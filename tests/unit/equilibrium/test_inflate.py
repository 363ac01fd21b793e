"""`inflate` and `ideal_state`: what they promise, keep and refuse."""

import dataclasses
import math
from functools import partial

import builders
import numpy as np
import pytest

from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.solver_options import FlowOptions, NewtonOptions
from lobefem.equilibrium.state import ideal_state
from lobefem.errors import ConvergenceError, InputError
from lobefem.fem import rigid_motions
from lobefem.linalg import petsc
from lobefem.model.film import Isotropic
from lobefem.model.fixed_wrinkles import FixedWrinkles
from lobefem.model.tension_field import TensionField

from petsc4py import PETSc

stack = partial(builders.stack, lobes=4)


def residual_norm(state):
    q = state.restore()
    r = q.duplicate()
    state.balloon.residual(q, r)
    return r.norm()


def test_the_largest_displacement_leaves_out_the_tilt_that_a_pinned_support_leaves_free(comm):
    """No force sets it: what a state has of it is round-off over a stiffness of zero."""
    turn, angle = np.array([[0.0, 0, 1], [0, 0, 0], [-1, 0, 0]]), 1e-3  # about y
    turn = np.eye(3) + math.sin(angle) * turn + (1 - math.cos(angle)) * turn @ turn
    found = {}
    for support in ("pinned", "clamped"):
        state = inflate(stack(comm, support=support), 5.0)
        balloon = state.balloon
        x = balloon.V.tabulate_dof_coordinates()[: len(state.displacement)]
        centre = balloon.motion.centres[0]
        tilted = (x + state.displacement - centre) @ turn.T + centre - x
        found[support] = rigid_motions.largest_of_state(balloon, tilted) / state.max_displacement
    assert found["pinned"] == pytest.approx(1, rel=1e-9)
    assert found["clamped"] > 10  # there it is no free motion


@pytest.mark.parametrize("load", ["closed", "film"])
@pytest.mark.parametrize("film", [Isotropic(), TensionField()], ids=["isotropic", "tension-field"])
def test_the_record_tells_what_the_state_is(comm, film, load):
    balloon = stack(comm, film, load)
    state = inflate(balloon, 5.0)
    assert state.converged
    assert state.reason.startswith("converged")
    assert (state.pressure, state.prestress, state.steps) == (5.0, 0.0, (5.0,))
    assert 1 <= state.iterations <= 10
    assert state.relative_residual < 1e-8
    assert state.num_dofs == 3 * 8 * 17
    areas = state.taut_area + state.wrinkled_area + state.slack_area
    assert areas == pytest.approx(balloon.reference_area, rel=1e-12)
    assert len(state.hoop_tension) == 3
    assert state.bar_force is not None
    assert residual_norm(state) == pytest.approx(state.residual, rel=1e-6, abs=1e-12)
    # the strain energy is quadratic and the film all but inextensible: half of the pressure's work
    work = 5.0 * (state.volume - balloon.reference_volume)
    if load == "closed":
        assert state.strain_energy == pytest.approx(work / 2, rel=1e-2)


def test_clapeyron_on_a_stiff_film(comm):
    """Small displacements, closed load: strain energy = p dV/2, to the order of the strain."""
    state = inflate(stack(comm, Isotropic(E=3.5e11)), 1.0)
    work = state.volume - state.balloon.reference_volume
    assert state.strain_energy == pytest.approx(work / 2, rel=1e-4)


def test_a_state_keeps_its_own_copies(comm):
    balloon = stack(comm)
    low = inflate(balloon, 2.0)
    unknowns, displacement = low.unknowns.copy(), low.displacement.copy()
    high = inflate(balloon, 20.0, start=low)
    assert high.max_displacement > low.max_displacement
    np.testing.assert_array_equal(low.unknowns, unknowns)
    np.testing.assert_array_equal(low.displacement, displacement)
    with pytest.raises(dataclasses.FrozenInstanceError):
        low.pressure = 3.0
    low.restore()
    assert balloon.pressure.value == 2.0
    np.testing.assert_array_equal(balloon.u.x.array.reshape(-1, 3), displacement)


def test_start_makes_no_difference_to_the_equilibrium(comm):
    balloon = stack(comm, TensionField())
    once = inflate(balloon, 20.0, options=NewtonOptions(rtol=1e-11))
    twice = inflate(balloon, 20.0, start=inflate(balloon, 5.0), options=NewtonOptions(rtol=1e-11))
    np.testing.assert_allclose(once.displacement, twice.displacement, rtol=0, atol=1e-9)
    assert twice.steps == (20.0,)


def test_a_tangent_is_kept_while_it_serves(comm, monkeypatch):
    def counted(*given, **options):
        tangents.append(given)
        return tangent(*given, **options)

    balloon, tangents = stack(comm), []
    tangent = balloon.tangent
    monkeypatch.setattr(balloon, "tangent", counted)
    kept = inflate(balloon, 5.0, options=NewtonOptions(keep_above=0))
    assert len(tangents) < kept.iterations
    tangents.clear()
    renewed = inflate(balloon, 5.0, options=NewtonOptions(keep_tangent=False))
    assert len(tangents) == renewed.iterations <= kept.iterations
    assert kept.volume == pytest.approx(renewed.volume, rel=1e-10)


def test_zero_pressure_is_the_reference_state(comm):
    state = inflate(stack(comm), 0.0)
    assert state.converged
    assert state.max_displacement == 0
    assert state.volume == state.balloon.reference_volume


def test_prestress_follows_the_pressure_or_stays_as_told(comm):
    balloon = stack(comm, FixedWrinkles(), prestressed=True)
    assert inflate(balloon, 5.0).prestress == 5.0
    held = inflate(balloon, 5.0, prestress=4.0)
    assert held.prestress == 4.0
    # the film stretches for what the prestress lacks
    assert held.volume > inflate(balloon, 5.0).volume


def test_ideal_state_holds_the_geometry(comm):
    balloon = stack(comm, FixedWrinkles(), prestressed=True)
    one, two = ideal_state(balloon, 100.0), ideal_state(balloon, 200.0)
    assert one.max_displacement == two.max_displacement == 0
    assert one.reason == "held geometry"
    assert one.iterations == 0
    np.testing.assert_allclose(two.hoop_tension, 2 * np.array(one.hoop_tension), rtol=1e-12)
    assert two.strain_energy == pytest.approx(4 * one.strain_energy, rel=1e-12)
    assert two.relative_residual == pytest.approx(one.relative_residual, rel=1e-9)


def test_a_failed_inflation_returns_the_last_converged_state(comm):
    """One Newton iteration a step is not enough for the whole, but is for nothing at all."""
    balloon = stack(comm, TensionField())
    low = inflate(balloon, 5.0)
    before = low.unknowns.copy()
    with pytest.raises(ConvergenceError) as failed:
        inflate(balloon, 1e5, start=low, options=NewtonOptions(max_iterations=1, min_step=0.1, rtol=1e-13))
    text = str(failed.value)
    assert text.startswith("inflate stopped at 5 Pa of 100000 Pa (too many iterations, |r| = ")
    assert "try " in text
    assert failed.value.exit_code == 3
    assert failed.value.data["reason"] == "too many iterations"
    np.testing.assert_array_equal(low.unknowns, before)
    assert residual_norm(low) == pytest.approx(low.residual, rel=1e-6, abs=1e-12)


def test_pressure_steps_reach_what_one_solve_does_not(comm):
    """A limit on iterations too small for the whole pressure is met by steps, told to `progress`."""
    balloon = stack(comm, Isotropic())
    needed = inflate(balloon, 2e4).iterations
    assert needed > 3
    lines = []
    stepped = inflate(balloon, 2e4, options=NewtonOptions(max_iterations=needed - 1), progress=lines.append)
    assert len(stepped.steps) > 1
    assert stepped.steps[-1] == 2e4
    assert list(stepped.steps) == sorted(stepped.steps)
    assert stepped.volume == pytest.approx(inflate(balloon, 2e4).volume, rel=1e-9)
    assert any("too many iterations" in line for line in lines)
    assert lines[-1].startswith("inflate 20000 Pa: converged")


def test_options_do_not_leak(comm):
    before = PETSc.Options().getAll()
    inflate(stack(comm), 5.0)
    assert PETSc.Options().getAll() == before


def test_users_options_reach_snes(comm):
    """-lobefem_inflate_snes_max_it 1 makes it stop, until the option is taken away."""
    balloon = stack(comm)
    options = PETSc.Options("lobefem_inflate_")
    options["snes_max_it"] = 1
    try:
        with pytest.raises(ConvergenceError, match="too many iterations"):
            inflate(balloon, 5e4, options=NewtonOptions(min_step=0.6))
    finally:
        options.delValue("snes_max_it")
    assert inflate(balloon, 5.0).converged


@pytest.mark.parametrize(
    ("load", "solver"),
    [
        # crude compression, which GMRES mends
        ("closed", {"mat_mumps_cntl_7": 1e-2}),
        ("film", {"mat_mumps_cntl_7": 1e-2}),
        ("closed", {"ksp_type": "cg", "ksp_max_it": 2000, "pc_type": "gamg", "mg_levels_pc_type": "jacobi"}),
    ],
    ids=["compressed-closed", "compressed-film", "multigrid"],
)
def test_other_linear_solvers_lead_to_the_same_state(comm, load, solver):
    with petsc.options("lobefem_inflate_", solver):
        other = inflate(stack(comm, load=load), 5.0, options=NewtonOptions(compress_above=0))
    direct = inflate(stack(comm, load=load), 5.0)
    assert other.volume == pytest.approx(direct.volume, rel=1e-9)
    difference = np.abs(other.displacement - direct.displacement).max(initial=0.0)
    assert comm.allreduce(float(difference)) < 1e-6


@pytest.mark.parametrize("bad", [math.nan, math.inf, "5 Pa", None])
def test_bad_pressures(comm, bad):
    balloon = stack(comm, FixedWrinkles(), prestressed=True)
    for verb in (inflate, ideal_state):
        with pytest.raises(InputError, match=r"^pressure is .*; give a .*number \[Pa\]$"):
            verb(balloon, bad)


@pytest.mark.parametrize("wrong", [{"rtol": 1e-6}, FlowOptions(), None])
def test_options_of_another_kind(comm, wrong):
    with pytest.raises(InputError, match=r"^options is .*; give NewtonOptions\(\.\.\.\)$"):
        inflate(stack(comm), 5.0, options=wrong)


def test_prestress_needs_a_prestressed_balloon(comm):
    balloon = stack(comm)
    with pytest.raises(InputError, match=r"^the ideal state needs a prestressed balloon; pass pre"):
        ideal_state(balloon, 5.0)
    with pytest.raises(InputError, match=r"^prestress = 4.0 Pa needs a balloon with prestressed=True"):
        inflate(balloon, 5.0, prestress=4.0)
