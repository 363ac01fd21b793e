"""`distort`: what each distortion imposes, there and back, increments, and what cannot be imposed."""

import dataclasses
import math
from functools import partial

import builders
import numpy as np
import pytest
from states import nodes, unknowns

from lobefem.equilibrium.displacement_control import distort, release_start
from lobefem.equilibrium.distortions import Bend, Tip, Twist, Wave
from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.solver_options import RAMP, NewtonOptions
from lobefem.errors import ConvergenceError, InputError
from lobefem.fem.balloon import Balloon
from lobefem.fem.functionals import largest, mid_hoop_displacement
from lobefem.geometry.stacks import cylinder
from lobefem.model.end_plates import EndPlates, PlateLoad
from lobefem.model.film import Isotropic
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.tension_field import TensionField
from lobefem.stability.modes import find_modes

from mpi4py import MPI

SMALL = [Tip(0.02), Bend(1.0), Twist(0.5), Wave(2, 0.01)]
NAMES = ["tip", "bend", "twist", "wave"]
TIGHT = dataclasses.replace(RAMP, rtol=1e-11)


stack = partial(builders.stack, lobes=3, divisions=(2, 5), EA=2e5)


@pytest.fixture
def start(comm):
    """Two lobes at 50 Pa: isotropic film, whose one equilibrium every route must find."""
    return inflate(stack(comm, lobes=2, divisions=(4, 8), EA=2e8), 50.0, options=NewtonOptions(rtol=1e-12))


# --- what is imposed ---------------------------------------------------------------------------


def ring(state, group):
    """Positions of an edge group's nodes, on every rank."""
    balloon = state.balloon
    at = balloon.edge_nodes(group)
    at = at[at < balloon.V.dofmap.index_map.size_local]
    return np.vstack(balloon.comm.allgather(nodes(balloon)[at] + state.displacement[at]))


@pytest.mark.parametrize("support", ["clamped", "pinned"])
def test_bent_hoops_are_circles_normal_to_an_arc_over_the_bar(comm, support):
    start = inflate(stack(comm, lobes=4, divisions=(2, 6), support=support), 50.0)
    psi = math.radians(10.0)
    state = distort(start, Bend(10.0), steps=2).state
    length = start.balloon.motion.length
    centres, normals = [], []
    for name in ("rim_bottom", "seam_1", "seam_2", "seam_3", "rim_top"):
        x = ring(state, name)
        centre = x.mean(axis=0)
        np.testing.assert_allclose(np.linalg.norm(x - centre, axis=1), 2.0, rtol=1e-12)
        _, sizes, axes = np.linalg.svd(x - centre)
        assert sizes[2] < 1e-12
        centres.append(centre)
        normals.append(axes[2] * np.sign(axes[2, 2]))
    centres, normals = np.array(centres), np.array(normals)
    assert np.linalg.norm(centres[4] - centres[0]) == pytest.approx(length, rel=1e-12)
    chords = np.linalg.norm(np.diff(centres, axis=0), axis=1)
    radius = length / (2 * math.sin(psi))
    np.testing.assert_allclose(chords, 2 * radius * math.sin(psi / 4), rtol=1e-12)
    turns = np.arccos(np.einsum("ij,ij->i", normals[1:], normals[:-1]))
    np.testing.assert_allclose(turns, psi / 2, rtol=1e-9)
    if support == "clamped":
        np.testing.assert_allclose(normals[0], [0, 0, 1], rtol=0, atol=1e-12)
    else:
        np.testing.assert_allclose(centres[4], [0, 0, length], rtol=0, atol=1e-11)
        assert mid_hoop_displacement(state.balloon, state.displacement) == pytest.approx(
            radius * (1 - math.cos(psi)), rel=1e-12
        )


def test_wave_of_the_equators(comm):
    start = inflate(stack(comm, lobes=2, divisions=(4, 8)), 50.0)
    state = distort(start, Wave(2, 0.05), steps=2).state
    balloon = state.balloon
    x, height = nodes(balloon), balloon.surface.shape.height
    radius, angle = np.hypot(x[:, 0], x[:, 1]), np.arctan2(x[:, 1], x[:, 0])
    outwards = (state.displacement[:, :2] * x[:, :2]).sum(axis=1) / radius
    on = np.abs(np.abs(x[:, 2] - height) - height / 2) < 1e-9
    owned = np.arange(len(x)) < balloon.V.dofmap.index_map.size_local
    assert comm.allreduce(int((on & owned).sum())) == 16
    expected = 0.05 * np.cos(2 * angle) - 0.05**2 * 9 / (16 * radius)
    np.testing.assert_allclose(outwards[on], expected[on], rtol=0, atol=1e-14)
    seam = balloon.edge_nodes("seam_1")
    assert largest(balloon, state.displacement[seam]) > 1e-6  # the hoop is free


def test_an_equator_under_a_wave_keeps_its_length():
    """To second order: closed polygons of many nodes, moved to where they slide without strain."""
    amplitude, angle = 0.05, np.linspace(0, 2 * np.pi, 400, endpoint=False)
    for n in (1, 2, 3, 5):
        shrink = (n**2 - 1) ** 2 / (4 * n**2 * 2.0)
        stretched = []
        for a in (amplitude, amplitude / 2):
            outwards = a * np.cos(n * angle) - a**2 * shrink
            # what slides sideways in the second order has no mean and moves no length
            z = (2.0 + outwards - 1j * a / n * np.sin(n * angle)) * np.exp(1j * angle)
            stretched.append(np.abs(np.roll(z, -1) - z).sum() / (400 * 4.0 * np.sin(np.pi / 400)) - 1)
        assert abs(stretched[0]) < 0.05 * (n * amplitude / 2) ** 2
        assert abs(stretched[1]) < abs(stretched[0]) / 6 + 1e-7  # less than a second order


@pytest.mark.parametrize("distortion", SMALL, ids=NAMES)
def test_there_and_back_again(start, distortion):
    there = distort(start, distortion, steps=2, options=TIGHT)
    assert there.state.max_displacement > start.max_displacement + 0.5 * 1e-3
    assert [i.parameter for i in there.history] == pytest.approx(
        [0.0, distortion.parameter / 2, distortion.parameter]
    )
    zero = dataclasses.replace(distortion, **{dataclasses.fields(distortion)[-1].name: 0.0})
    back = distort(there.state, zero, steps=2, options=TIGHT)
    first, last = there.history[0], back.history[-1]
    assert last.reaction == pytest.approx(first.reaction, abs=1e-6 * abs(there.reaction))
    assert last.volume == pytest.approx(first.volume, rel=1e-11)
    assert back.history[1].reaction == pytest.approx(there.history[1].reaction, rel=1e-6)
    # a bend holds the hoops at their reference size: the free balloon is found after its release
    free = inflate(start.balloon, 50.0, start=release_start(back.state), options=NewtonOptions(rtol=1e-12))
    assert largest(start.balloon, free.displacement - start.displacement) < 1e-8


@pytest.mark.parametrize("distortion", SMALL, ids=NAMES)
def test_work_is_the_energy_gained(start, distortion):
    """And the reaction its rate along the ramp (closed pressure, which has a potential)."""
    ramp = distort(start, distortion, steps=8, options=TIGHT)
    p = start.pressure
    energy = np.array([i.strain_energy - p * i.volume for i in ramp.history])
    reaction = np.array([i.reaction for i in ramp.history])
    s = np.array([i.parameter for i in ramp.history])
    slopes = np.gradient(energy, s, edge_order=2)
    np.testing.assert_allclose(reaction[1:-1], slopes[1:-1], rtol=0, atol=0.02 * np.abs(reaction).max())
    assert ramp.history[-1].work == pytest.approx(energy[-1] - energy[0], rel=0.02)
    assert ramp.reaction == reaction[-1]
    assert max(i.residual for i in ramp.history) < 1e-9


def test_small_tip_force_is_the_tangents(start):
    """F/delta = 1/(e . K^-1 e), K the free balloon's tangent and e the top centre's motion along x."""
    balloon = start.balloon
    q = start.restore()
    K = balloon.tangent(q).copy()
    e = unknowns(balloon, np.zeros_like(start.displacement))
    _, dw, _ = balloon.map.plate_parameters(balloon.map.parameters(q))
    with e as array:
        if array.size > balloon.map.free.size:
            array[balloon.map.free.size :] = dw[6]
    from petsc4py import PETSc

    ksp = PETSc.KSP().create(balloon.comm)
    ksp.setOperators(K)
    ksp.setType("preonly")
    ksp.getPC().setType("lu")
    ksp.getPC().setFactorSolverType("mumps")
    x = e.duplicate()
    ksp.solve(e, x)
    stiffness = 1 / e.dot(x)
    ramp = distort(start, Tip(1e-5), steps=1, options=dataclasses.replace(RAMP, rtol=1e-12))
    slope = (ramp.history[1].reaction - ramp.history[0].reaction) / 1e-5
    assert slope == pytest.approx(stiffness, rel=1e-4)
    assert stiffness > 0


def test_a_softer_balloon_under_a_constraint_is_stiffer(start):
    """Modes under a constraint: one freedom less, so no eigenvalue is lower (Cauchy, Rayleigh)."""
    free = find_modes(start, 4).values.real
    held = distort(start, Tip(0.0), steps=1)
    led = find_modes(held.state, 3)
    assert led.symmetric
    assert led.stable
    assert (led.values.real > free[:3] * (1 - 1e-6)).all()
    assert (led.values.real < free[1:] * (1 + 1e-6)).all()
    assert led.values.real[0] > 1.5 * free[0] or led.values.real[1] > 1.5 * free[1]


# --- increments --------------------------------------------------------------------------------


@pytest.mark.slow
def test_each_step_is_handed_on_and_can_be_gone_on_from(start):
    seen = []
    whole = distort(
        start,
        Tip(0.04),
        steps=4,
        options=TIGHT,
        on_step=lambda *step: seen.append(step),
    )
    assert tuple(record for record, _ in seen) == whole.history
    assert [state.parameter for _, state in seen] == pytest.approx([0, 0.01, 0.02, 0.03, 0.04])
    record, state = seen[2]
    state.restore()
    np.testing.assert_array_equal(start.balloon.u.x.array.reshape(-1, 3), state.displacement)
    # from the state itself, and from what a file keeps of it
    kept = release_start(state)
    assert kept.balloon is start.balloon
    assert not kept.converged
    assert kept.relative_residual > 1e-4
    np.testing.assert_allclose(kept.displacement, state.displacement, rtol=0, atol=1e-14)
    for again in (
        distort(state, Tip(0.04), steps=2, options=TIGHT),
        distort(
            kept,
            Tip(0.04),
            begin=record.parameter,
            steps=2,
            options=TIGHT,
        ),
    ):
        assert again.history[0].reaction == pytest.approx(record.reaction, rel=1e-6)
        assert again.reaction == pytest.approx(whole.reaction, rel=1e-7)


@pytest.mark.slow
def test_increments_that_fail_are_halved_and_then_crossed_by_damped_motion(start):
    """Two Newton iterations do for a small increment only; where the damped motion ends is the same."""
    said = []
    ramp = distort(
        start, Tip(1.0), steps=2, options=NewtonOptions(max_iterations=2, min_step=1e-4), progress=said.append
    )
    assert len(ramp.history) > 3
    assert ramp.history[-1].parameter == 1.0
    assert any("damped motion, settled" in line for line in said)
    whole = distort(start, Tip(1.0), steps=4)
    assert ramp.reaction == pytest.approx(whole.reaction, rel=1e-6)
    # on one branch no energy is lost, whatever the motion took of what its start had put in
    assert ramp.history[-1].damping == pytest.approx(0, abs=1e-3 * ramp.history[-1].work)


@pytest.mark.serial
@pytest.mark.slow
def test_film_buckles_without_gas_pressure_too(comm):
    """A damped motion has an end, and what it takes is what the work leaves of the energy gained."""
    surface = cylinder(1.0, 2.0, (4, 10), comm=comm)
    parts = [GasPressure("closed"), EndPlates(bar=False), PlateLoad((0.0, 0.0, 20.0))]
    balloon = Balloon(surface, Isotropic(E=1e7), parts)
    said, states = [], []
    ramp = distort(
        inflate(balloon, 0.0),
        Tip(0.3),
        steps=3,
        progress=said.append,
        on_step=lambda _, state: states.append(state),
    )
    assert any("damped motion, settled" in line for line in said), said
    end = ramp.history[-1]
    assert end.parameter == 0.3
    energies = []
    for state in (states[0], states[-1]):
        w = state.balloon.map.plate_parameters(state.balloon.map.parameters(state.vector()))[0]
        energies.append(state.strain_energy - state.balloon.plate_forces.dead_work(w))
    assert 0 < end.damping < 0.1 * end.work
    assert end.work - end.damping == pytest.approx(energies[1] - energies[0], rel=0.05)


def test_a_failed_ramp_returns_the_last_equilibrium(start):
    """Both what goes on and where it stopped are said in degrees, the unit in which a twist is given."""
    said = []
    with pytest.raises(
        ConvergenceError, match=r"^the twist stopped at .* degrees of 120 degrees \(.*more steps"
    ) as failed:
        distort(
            start,
            Twist(120.0),
            steps=2,
            options=NewtonOptions(max_iterations=2, min_step=0.2),
            progress=said.append,
        )
    assert any(line.startswith("twist 60 degrees: ") for line in said), said
    state, data = failed.value.state, failed.value.data
    assert data["parameter"] == state.parameter == data["history"][-1].parameter
    q = state.restore()
    r = q.duplicate()
    state.balloon.residual(q, r)
    assert r.norm() < 1e-6


def test_round_off_of_stiff_hoops_counts_as_converged(comm):
    """A hoop of the paper's steel, moved by decimetres, cannot be in balance to 1e-14."""
    start = inflate(stack(comm, lobes=2, divisions=(4, 8), EA=2.15e9), 5.0)
    ramp = distort(start, Tip(1.0), steps=5, options=dataclasses.replace(RAMP, rtol=1e-14))
    assert ramp.state.converged
    assert 1e-14 < ramp.state.relative_residual < 1e-7


@pytest.mark.slow
def test_the_serial_answer(comm):
    def run(one):
        start = inflate(stack(one, TensionField(slack_stiffness=1e-4), lobes=2, divisions=(4, 8)), 50.0)
        return [distort(start, d, steps=2, options=TIGHT).history[-1] for d in (*SMALL, Bend(0.5))]

    for here, alone in zip(run(comm), run(MPI.COMM_SELF), strict=True):
        assert here.reaction == pytest.approx(alone.reaction, rel=1e-6)
        assert here.volume == pytest.approx(alone.volume, rel=1e-10)
        assert here.mid_hoop_displacement == pytest.approx(alone.mid_hoop_displacement, rel=1e-6, abs=1e-9)


def test_middle_of_an_odd_number_of_lobes(comm):
    for divisions, lobes in (((2, 5), 3), ((3, 5), 1), ((2, 5), 2)):
        start = inflate(stack(comm, lobes=lobes, divisions=divisions), 10.0)
        moved = dataclasses.replace(start, displacement=start.displacement + np.array([0.3, 0.1, 0.0]))
        off = mid_hoop_displacement(start.balloon, start.displacement)
        assert mid_hoop_displacement(moved.balloon, moved.displacement) == pytest.approx(0.3 + off, rel=1e-12)
        assert abs(off) < 1e-3


# --- what cannot be imposed --------------------------------------------------------------------


def test_errors(comm, start):
    for make, text in (
        (lambda: Tip(math.nan), r"^the tip's displacement is nan; give a finite number \[m\]$"),
        (lambda: Bend(90.0), r"^the bend's half-angle is 90.0 degrees; give less than 90$"),
        (lambda: Twist("far"), r"^the twist is 'far'; give a number \[degrees\]$"),
        (lambda: Wave(-1, 0.1), r"^the wave's n is -1; give 0 or more$"),
        (lambda: distort(start, Tip(9.0)), r"is 9.0 m; give less than the bar's 8.37\d* m$"),
        (
            lambda: distort(start, Wave(5, 0.1)),
            r"amplitude=0.1\) is too short for 8 divisions .* try 20 of them$",
        ),
        (lambda: distort(start, Tip(0.1), steps=0), r"^steps is 0; give 1 or more$"),
        (lambda: release_start(start), r"^the state is under no distortion; there is nothing to release$"),
        (
            lambda: distort(distort(start, Wave(2, 0.0)).state, Wave(3, 0.1)),
            r"^the balloon is under a wave of n = 2; release it before Wave\(n=3, amplitude=0.1\)$",
        ),
        (
            lambda: Wave(2, 0.1).check(stack(comm, lobes=1, divisions=(3, 5))),
            "needs nodes on the lobes' equators; use a struct",
        ),
        (
            lambda: Tip(0.1).check(stack(comm, support="fixed")),
            r"^Tip\(displacement=0.1\) needs a top plate that",
        ),
        (
            lambda: Bend(1.0).check(Balloon(cylinder(comm=comm, divisions=(2, 4)), Isotropic())),
            "with EndPlates$",
        ),
    ):
        with pytest.raises(InputError, match=text):
            make()


@pytest.mark.parametrize("first", [0.0, -1.0])
def test_increments_that_lead_nowhere_are_refused(start, first):
    with pytest.raises(InputError, match="give a positive number"):
        distort(start, Tip(0.1), first=first)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"min_step": 0.0}, "min_step is 0.0; give a positive number"),
        ({"rtol": math.nan}, "rtol is nan; give a finite number"),
        ({"max_iterations": 0}, "max_iterations is 0; give 1 or more"),
    ],
)
def test_settings_of_newtons_method_that_lead_nowhere_are_refused(wrong, words):
    with pytest.raises(InputError, match=words):
        NewtonOptions(**wrong)
