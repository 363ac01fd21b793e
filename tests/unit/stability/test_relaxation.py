"""`release` and its damped motion: where it ends, what it says, and what its ledger holds."""

import math
from itertools import pairwise

import builders
import numpy as np
import pytest
from states import nodes, unknowns

from lobefem.equilibrium.displacement_control import distort
from lobefem.equilibrium.distortions import Tip
from lobefem.equilibrium.energy_ledger import Ledger
from lobefem.equilibrium.gradient_flow import GradientFlow, damping_scale
from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.solver_options import FlowOptions
from lobefem.equilibrium.state import State
from lobefem.errors import InputError
from lobefem.fem.balloon import Balloon
from lobefem.fem.rigid_motions import distance_of
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.model.cables import Hoops
from lobefem.model.end_plates import EndPlates, PlateLoad
from lobefem.model.film import Isotropic
from lobefem.model.fixed_wrinkles import FixedWrinkles
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.tension_field import TensionField
from lobefem.stability.linear_buckling import critical_pressure
from lobefem.stability.modes import find_modes
from lobefem.stability.relaxation import DISTORTED, NO_EQUILIBRIUM, RETURNED, release

from mpi4py import MPI


def stack(comm, load="closed", support="clamped", film=None, pressure=5.0, **mesh):
    """A prestressed balloon and its equilibrium."""
    film = film or TensionField()
    balloon = builders.stack(comm, film, load, support=support, prestressed=True, **mesh)
    return balloon, inflate(balloon, pressure)


def swayed(balloon, degrees, pressure=5.0):
    """The whole film sheared sideways, the axis leaning by an angle, the top plate with it."""
    motion, x = balloon.motion, nodes(balloon)
    height = x[:, 2] - motion.centres[0][2]
    lean = math.radians(degrees)
    displacement = np.zeros_like(x)
    displacement[:, 0] = math.sin(lean) * height
    displacement[:, 2] = (math.cos(lean) - 1) * height
    y = np.zeros(motion.size)
    # about +y, which takes +z to +x
    k = motion.names.index("bar_tilt_1")
    y[k : k + 2] = motion.tilts([0, lean, 0])
    q = unknowns(balloon, displacement, y)
    return State(balloon, pressure, pressure, q.array.copy())


@pytest.mark.slow
@pytest.mark.parametrize("load", ["closed", "film"])
def test_a_stable_balloon_returns(comm, load):
    balloon, rest = stack(comm, load)
    found = release(swayed(balloon, 1.0), undistorted=rest)
    assert found.outcome == RETURNED
    assert found.end == "settled"
    assert found.state.converged
    assert found.lowest > 0
    assert found.lowest == pytest.approx(find_modes(rest, 1)[0].value.real, rel=1e-5)
    assert found.distance < 1e-6
    assert found.rotation == 0
    assert found.moved < 1e-4
    first, *_, last = found.history
    assert first.number == first.time == 0
    assert first.top[0] == pytest.approx(balloon.motion.length * math.sin(math.radians(1)), rel=1e-9)
    assert first.middle[0] == pytest.approx(first.top[0] / 2, rel=1e-6)
    np.testing.assert_allclose(last.top, rest.restore() and balloon.w[6:9], atol=1e-4)
    assert last.volume == pytest.approx(rest.volume, rel=1e-9)
    assert last.relative_residual < 1e-6 < first.relative_residual
    assert [r.number for r in found.history] == list(range(len(found.history)))
    assert all(b.time == pytest.approx(a.time + b.step) for a, b in pairwise(found.history))


@pytest.mark.slow
def test_the_ledger_closes_and_nothing_but_damping_takes_energy(comm):
    balloon, rest = stack(comm)
    found = release(swayed(balloon, 1.0), undistorted=rest, options=FlowOptions(tolerance=2e-4))
    ledger, first = found.ledger, found.history[0]
    assert ledger.error < 1e-2
    assert ledger.constraint == ledger.contact == 0
    assert ledger.strain == pytest.approx(rest.strain_energy - first.strain_energy, rel=1e-6)
    assert ledger.pressure == pytest.approx(5.0 * (rest.volume - first.volume), rel=1e-6)
    # implicit Euler damps by itself: what it counts lacks a share that falls with the steps
    assert 0.7 * ledger.damping < ledger.euler < ledger.damping
    potential = [r.strain_energy - 5.0 * r.volume for r in found.history]
    assert all(b < a for a, b in pairwise(potential) if a - potential[-1] > 1e-6)
    assert all(a.ledger.damping <= b.ledger.damping for a, b in pairwise(found.history))


@pytest.mark.slow
def test_film_load_works_on_the_plates_centres(comm):
    """p dV is not all the work of a `film` load: without the plates' share the ledger stays open."""
    balloon, rest = stack(comm, "film")
    found = release(swayed(balloon, 2.0), undistorted=rest, options=FlowOptions(tolerance=2e-4), count=1)
    assert found.ledger.error < 1e-2
    volume = 5.0 * (found.history[-1].volume - found.history[0].volume)
    assert abs(found.ledger.pressure - volume) > 0.0


def test_a_dead_load_works_too_and_is_no_contact(comm):
    surface = lobed_cylinder(2, (4, 8), comm=comm)
    parts = [GasPressure("closed"), Hoops(), EndPlates(bar=2.15e6)]
    without = Balloon(surface, TensionField(), parts, prestressed=True)
    balloon = Balloon(surface, TensionField(), [*parts, PlateLoad((0.0, 3.0, -20.0))], prestressed=True)
    rest = inflate(balloon, 5.0)
    start = State(balloon, 5.0, 5.0, inflate(without, 5.0).unknowns)
    found = release(start, undistorted=rest, options=FlowOptions(tolerance=2e-4), count=1)
    assert found.outcome == RETURNED
    assert found.ledger.error < 1e-2
    assert found.ledger.contact == 0
    assert all(record.contact_energy == 0 for record in found.history)
    first, last = found.history[0].top, found.history[-1].top
    work = 3.0 * (last[1] - first[1]) - 20.0 * (last[2] - first[2])
    assert found.ledger.constraint == pytest.approx(work, rel=1e-9)
    assert abs(work) > 1e-3


def test_a_pinned_balloon_returns_up_to_a_turn(comm):
    balloon, rest = stack(comm, "film", "pinned")
    found = release(swayed(balloon, 1.0), undistorted=rest)
    assert found.outcome == RETURNED
    assert found.distance < 1e-5
    assert 1e-3 < found.rotation < math.radians(1)
    # two turns cost nothing and are no sign of instability
    assert len(found.modes) >= 6
    assert np.abs(found.modes.values[:2]).max() < 1e-6 < found.lowest


@pytest.mark.slow
@pytest.mark.serial
def test_damping_changes_the_time_and_nothing_else(comm):
    """The paper's question about STABILIZE: a tenth and a hundredth of the damping."""
    balloon, rest = stack(comm, lobes=1)
    assert damping_scale(balloon) == pytest.approx(5.0 / math.sqrt(balloon.reference_area))  # times a second
    start = swayed(balloon, 0.5)
    runs = [
        release(start, undistorted=rest, options=FlowOptions(damping=c), count=1) for c in (1.0, 0.1, 0.01)
    ]
    assert [run.outcome for run in runs] == [RETURNED] * 3
    for run, share in zip(runs, (1.0, 0.1, 0.01), strict=True):
        assert run.damping == pytest.approx(share * damping_scale(balloon))
        np.testing.assert_allclose(run.state.displacement, runs[0].state.displacement, atol=1e-9)
        times = [r.time / share for r in run.history[:20]]
        np.testing.assert_allclose(times, [r.time for r in runs[0].history[:20]], rtol=1e-4)
        volumes = [r.volume for r in run.history[:20]]
        np.testing.assert_allclose(volumes, [r.volume for r in runs[0].history[:20]], rtol=1e-9)


def test_what_only_damping_holds_is_no_equilibrium(comm):
    """Stopped early the balloon is still where it was put, as with too much STABILIZE."""
    balloon, rest = stack(comm)
    found = release(
        swayed(balloon, 1.0), undistorted=rest, options=FlowOptions(damping=1e3, end_time=1.0), count=1
    )
    assert found.end == "end of time"
    assert found.history[-1].time == pytest.approx(1.0)
    assert found.history[-1].top[0] > 0.1
    assert found.outcome == NO_EQUILIBRIUM
    assert found.moved > 0.1
    assert "without damping" in found.reason


def test_an_unstable_equilibrium_is_named_so(comm):
    surface = lobed_cylinder(1, (6, 24), comm=comm)
    balloon = Balloon(surface, FixedWrinkles(), [GasPressure(), EndPlates(support="fixed")], prestressed=True)
    beyond = inflate(balloon, 1.5 * critical_pressure(balloon).pressure)
    found = release(beyond, undistorted=beyond)
    assert found.outcome == NO_EQUILIBRIUM
    assert found.lowest < 0
    assert "unstable" in found.reason
    assert len(found.history) == 1  # it was at rest from the start


def test_another_stable_shape_is_distorted(comm):
    """Against another shape's record the same rest is a distorted one."""
    balloon, rest = stack(comm, divisions=(4, 6))
    other = inflate(balloon, 500.0, prestress=5.0)
    found = release(rest, undistorted=other, count=1)
    assert found.outcome == DISTORTED
    assert found.distance > 1e-3


def test_a_mode_decays_at_its_eigenvalue_over_the_damping(comm):
    balloon, rest = stack(comm, support="fixed", film=Isotropic(), lobes=1)
    mode = find_modes(rest, 1)[0]
    size = 1e-5
    q = unknowns(balloon, rest.displacement + size * mode.displacement)
    start = State(balloon, 5.0, 5.0, q.array.copy())
    B, shape = balloon.mass(q), unknowns(balloon, mode.displacement)
    dual = shape.duplicate()
    B.mult(shape, dual)
    times, amplitudes, scale = [], [], dual.dot(shape)

    def keep(record, before):
        q = before.vector()
        q.axpy(-1.0, rest.vector())
        times.append(record.time - record.step)
        amplitudes.append(dual.dot(q) / scale)

    found = release(
        start, undistorted=rest, options=FlowOptions(tolerance=1e-9, settled=1e-8), on_step=keep, count=1
    )
    exact = size * np.exp(-mode.value.real / found.damping * np.array(times))
    np.testing.assert_allclose(amplitudes, exact, atol=0.02 * size)
    assert min(amplitudes) < 0.1 * size
    energy = mode.value.real * scale * size**2 / 2
    assert found.ledger.damping == pytest.approx(energy, rel=1e-2)


def test_a_release_has_the_loads_of_its_start(comm):
    """Whatever was done with the balloon since."""
    balloon, rest = stack(comm, lobes=1, divisions=(4, 6))
    start = swayed(balloon, 0.2)
    inflate(balloon, 60.0)
    found = release(start, undistorted=rest, count=1)
    assert found.history[-1].volume == pytest.approx(rest.volume, rel=1e-8)
    assert (found.state.pressure, found.state.prestress) == (5.0, 5.0)
    assert found.distance < 1e-6


def test_the_shape_to_return_to_has_the_starts_built_in_stress(comm):
    balloon, _ = stack(comm, lobes=1, divisions=(4, 6))
    held = inflate(balloon, 50.0, prestress=5.0)
    found = release(State(balloon, 50.0, 5.0, held.unknowns), count=1)
    assert found.outcome == RETURNED
    assert found.distance < 1e-6
    assert (found.state.pressure, found.state.prestress) == (50.0, 5.0)


class Killed(KeyboardInterrupt):
    """A run that ends at any moment."""


@pytest.mark.slow
@pytest.mark.parametrize("steps", [0, 1, 7])
def test_a_killed_run_goes_on_through_the_same_steps(comm, steps):
    balloon, rest = stack(comm, "film", "pinned", divisions=(4, 6))
    start = swayed(balloon, 0.5)
    whole = release(start, undistorted=rest, count=1)
    kept = []

    def keep(record, before):
        kept.append((record, before))
        if record.number == steps:
            raise Killed

    with pytest.raises(Killed):
        release(start, undistorted=rest, on_step=keep, count=1)
    history, before = [record for record, _ in kept], kept[-1][1]
    resumed = release(before, undistorted=rest, history=history, count=1)
    assert resumed.outcome == whole.outcome
    assert len(resumed.history) == len(whole.history)
    scales = [run.history[-1].residual / run.history[-1].relative_residual for run in (whole, resumed)]
    assert scales[1] == pytest.approx(scales[0], rel=1e-14)
    # but for the tilt, which no force sets: round-off does, and is another one where memory lies elsewhere
    ends = resumed.state.displacement, whole.state.displacement
    distance, tilt = distance_of(balloon, *ends)
    assert distance < 1e-6
    assert tilt < 1e-4
    assert resumed.ledger.damping == pytest.approx(whole.ledger.damping, rel=1e-6)
    assert resumed.history[-1].iterations == whole.history[-1].iterations


@pytest.mark.slow
def test_ranks_agree_with_one(comm):
    runs = []
    for group in (comm, MPI.COMM_SELF):
        balloon, rest = stack(group, "film", divisions=(4, 6))
        runs.append(release(swayed(balloon, 0.5), undistorted=rest, count=1))
    many, one = runs
    assert many.outcome == one.outcome
    assert many.lowest == pytest.approx(one.lowest, rel=1e-6)
    for a, b in zip(many.history[:15], one.history[:15], strict=True):
        assert a.volume == pytest.approx(b.volume, rel=1e-9)
        assert a.time == pytest.approx(b.time, rel=1e-3)
    assert many.ledger.damping == pytest.approx(one.ledger.damping, rel=1e-3)


def test_a_ledger_tells_what_is_missing():
    ledger = Ledger(strain=3.0, contact=1.0, pressure=-2.0, constraint=10.0, damping=3.9)
    assert ledger.closure == pytest.approx(0.1)
    assert ledger.error == pytest.approx(0.01)
    assert Ledger().error == 0


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"damping": 0.0}, "damping is 0.0; give a positive number"),
        ({"tolerance": -1.0}, "tolerance is -1.0"),
        ({"settled": math.nan}, "settled is nan"),
        ({"max_steps": 0}, "max_steps is 0"),
        ({"end_time": 0.0}, "end_time is 0.0"),
    ],
)
def test_numbers_out_of_range_are_refused(change, text):
    with pytest.raises(InputError, match=text):
        FlowOptions(**change)


def test_a_release_needs_a_gas_pressure(comm):
    balloon, rest = stack(comm, divisions=(4, 6))
    empty = State(balloon, 0.0, 0.0, rest.unknowns)
    with pytest.raises(InputError, match="needs a gas pressure"):
        release(empty)


@pytest.mark.slow
@pytest.mark.serial
def test_solving_each_step_roughly_leads_the_same_way(comm):
    balloon, rest = stack(comm)
    start = swayed(balloon, 2.0)
    rough = release(start, undistorted=rest, options=FlowOptions(tolerance=1e-4), count=1)
    exact = release(start, undistorted=rest, options=FlowOptions(tolerance=1e-4, close=1e-6), count=1)
    assert rough.outcome == exact.outcome == RETURNED
    assert rough.history[-1].iterations < exact.history[-1].iterations
    sways = [(np.array([r.time for r in a.history]), [r.top[0] for r in a.history]) for a in (rough, exact)]
    times = np.geomspace(1e-3, exact.history[-1].time, 50)
    ways = [np.interp(times, *sway) for sway in sways]
    np.testing.assert_allclose(*ways, atol=2e-2 * ways[0][0])
    assert rough.ledger.damping == pytest.approx(exact.ledger.damping, rel=1e-2)


@pytest.mark.slow
def test_round_off_of_stiff_hoops_does_not_end_a_motion(comm):
    """Hoops a thousand times the paper's, moved by decimetres, cannot be balanced to 1e-8 of the load."""
    surface = lobed_cylinder(2, (4, 8), comm=comm)
    parts = [GasPressure("closed"), Hoops(EA=2e12), EndPlates()]
    rest = inflate(Balloon(surface, TensionField(slack_stiffness=1e-4), parts, prestressed=True), 5.0)
    pushed = distort(rest, Tip(0.8), steps=5).state
    assert pushed.relative_residual > 1e-7
    balloon, q = pushed.balloon, pushed.restore()
    balloon.prescribed.parameter = 0.81
    size = math.sqrt(balloon.reference_area)
    flow = GradientFlow(
        balloon, q, damping=damping_scale(balloon), tolerance=3e-4 * size, settled=1e-8, ledger=Ledger()
    )
    try:
        assert flow.run() == "settled"
        assert flow.ts.getStepRejections() < 5
    finally:
        flow.destroy()


@pytest.mark.serial
def test_forces_that_fade_slowly_do_the_work_that_damping_does_otherwise(comm):
    """Abaqus turns a removed boundary condition into its force and lets that fade over the step."""
    balloon, rest = stack(comm, lobes=1)
    start = swayed(balloon, 0.5)
    at_once, faded = (
        release(
            start, undistorted=rest, options=FlowOptions(damping=0.01, fade=fade, tolerance=2e-4), count=1
        )
        for fade in (None, 1.0)
    )
    assert {at_once.outcome, faded.outcome} == {RETURNED}
    for found in (at_once, faded):
        assert found.ledger.error < 1e-2
        np.testing.assert_allclose(found.state.displacement, rest.displacement, atol=1e-6)
    assert at_once.ledger.constraint == 0
    # near to equilibrium throughout, they take nearly all that the gas gives
    assert faded.ledger.constraint == pytest.approx(-at_once.ledger.damping, rel=0.2)
    assert faded.ledger.damping < 0.2 * at_once.ledger.damping
    assert faded.history[-1].time >= 1.0
    assert faded.history[1].relative_residual < 1e-2 * at_once.history[1].relative_residual
    with pytest.raises(InputError, match="cannot be resumed"):
        release(start, undistorted=rest, options=FlowOptions(fade=1.0), history=faded.history)
    with pytest.raises(InputError, match="fade is 0; give a positive number"):
        release(start, undistorted=rest, options=FlowOptions(fade=0))
