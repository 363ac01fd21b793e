"""`release`: does a displaced balloon return when it is let go (paper sec. 6)?

Damped motion until the forces balance, then Newton's method without damping, then the lowest
eigenvalue of the tangent: the outcome is said on that evidence only.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from lobefem import checks
from lobefem.display import Summarized, Summary, number
from lobefem.equilibrium.energy_ledger import Ledger
from lobefem.equilibrium.gradient_flow import GradientFlow, Record, damping_scale
from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.solver_options import FLOW, FlowOptions, NewtonOptions
from lobefem.equilibrium.state import Equilibrium, State
from lobefem.errors import ConvergenceError, EigenError, InputError
from lobefem.fem.functionals import largest
from lobefem.fem.rigid_motions import distance_of, num_turns
from lobefem.log import logger
from lobefem.model.film import require_energy
from lobefem.outcomes import UNKNOWN
from lobefem.stability.mode_records import NEUTRAL, Modes
from lobefem.stability.modes import find_modes
from lobefem.typing import Array

__all__ = ["DISTORTED", "NO_EQUILIBRIUM", "RETURNED", "Released", "release"]

RETURNED = "returned"

DISTORTED = "distorted and stable"

NO_EQUILIBRIUM = "not an equilibrium"

# shapes closer than this share of sqrt(film area) are the same
_SAME = 1e-4


@dataclass(frozen=True, repr=False)
class Released(Summarized):
    """The result of a release.

    Attributes:
        outcome: "returned" (stable, the undistorted shape up to a rigid motion that the supports
            allow), "distorted and stable", "not an equilibrium" (none found without damping, another than
            the one the damped motion ended at, or an unstable one), or "at rest, stability unknown" (the
            eigensolver failed).
        reason: the evidence in one sentence.
        state: the equilibrium found without damping, None without one.
        modes: its lowest modes, None where they could not be computed.
        lowest: lowest real part of an eigenvalue, rigid rotations left out [Pa/m].
        distance: largest distance of a node from the undistorted shape, after the best rigid motion [m].
        rotation: of that rigid motion [rad].
        moved: largest displacement of a node between the damped motion's end and `state` [m].
        end: why the damped motion ended.
        damping: its c [Pa s/m].
        history: a record of the start and of each step.
        rejected: steps that were taken again with a smaller length.
    """

    outcome: str
    reason: str
    state: Equilibrium | None = field(repr=False)
    modes: Modes | None = field(repr=False)
    lowest: float | None
    distance: float
    rotation: float
    moved: float
    end: str
    damping: float
    history: tuple[Record, ...] = field(repr=False)
    rejected: int

    def _summary(self) -> Summary:
        rows = (
            ("evidence", self.reason),
            ("lowest eigenvalue", number(self.lowest, "Pa/m")),
            ("distance from the undistorted shape", number(self.distance, "m", 3)),
            ("steps", f"{len(self.history) - 1}, {self.history[-1].time:.3g} s"),
            ("energy not accounted for", f"{100 * self.ledger.error:.2g} %"),
        )
        return Summary(self.outcome, rows)

    @property
    def ledger(self) -> Ledger:
        """Energy balance of the damped motion and of the distortion before it."""
        return self.history[-1].ledger


def release(
    start: State,
    *,
    undistorted: Equilibrium | None = None,
    options: FlowOptions = FLOW,
    ledger: Ledger | None = None,
    history: Sequence[Record] = (),
    count: int = 4,
    on_step: Callable[[Record, State], None] | None = None,
    progress: Callable[[str], None] | None = None,
) -> Released:
    """Let a displaced balloon go, under the pressure that it has, and say where it comes to rest.

    The damped motion c B dq/dt + r(q) = 0 (see `lobefem.equilibrium.gradient_flow`) has no inertia, so that
    its path does not depend on c: a tenth of the damping makes it ten times as fast. What damping can do is
    hold a balloon that has no equilibrium where it is until `end_time`, and that is found out without it.

    A run that was stopped goes on from what `on_step` was last given, through the same steps:
    `release(before, history=records)`.

    Args:
        start: loads and unknowns to start from; any temporary constraint is gone.
        undistorted: the equilibrium to return to; by default that from the shape as designed.
        options: of the damped motion.
        ledger: of the imposed distortion, to go on from.
        history: records of the run to go on with.
        count: modes to compute.
        on_step: called on all ranks with each accepted step's record and the state it began at.
        progress: called with a line of text now and then.

    Raises:
        InputError: a number out of its range, a start without pressure, or a run to go on with whose
            forces fade.

    Collective.
    """
    checks.having("start", start, "balloon", "a state, from inflate or distort")
    checks.having("options", options, "damping", "FlowOptions(...)")
    balloon = start.balloon
    _check(start)
    if options.fade is not None and history:
        raise InputError("a release whose forces fade cannot be resumed; start it afresh")
    say = progress or (lambda text: None)
    if undistorted is None:
        undistorted = inflate(balloon, start.pressure, prestress=start.prestress)
    size = math.sqrt(balloon.reference_area)
    # the scales of load and damping: of a sealed gas at rest, as a run that is resumed has them too
    scale = start.pressure if balloon.gas is None else undistorted.pressure
    balloon.set_loads(scale, start.prestress)
    q = start.vector()

    def report(record: Record, unknowns: Array) -> None:
        # how much is left nothing tells: the residual rests for most of the steps, and falls at the end
        say(
            f"release {record.time:.3g} s, step {record.number}: |r| = {record.relative_residual:.1e} of the "
            f"load, V = {record.volume:.6g} m^3"
        )
        if on_step is not None:
            on_step(record, State(balloon, start.pressure, start.prestress, unknowns))

    c = options.damping * damping_scale(balloon)
    flow = GradientFlow(
        balloon,
        q,
        damping=c,
        tolerance=options.tolerance * size,
        settled=options.settled,
        close=options.close,
        ledger=ledger or Ledger(),
        fade=options.fade,
        on_step=report,
    )
    try:
        end = flow.run(history, options.max_steps, options.end_time)
        records, rejected = tuple(flow.history), flow.ts.getStepRejections()
    finally:
        flow.destroy()
    last = State(balloon, start.pressure, start.prestress, q.array_r.copy())
    say("release: equilibrium without damping")
    state, why = _undamped(last)
    modes = lowest = None
    distance = rotation = moved = math.nan
    rest = last if state is None else state
    distance, rotation = distance_of(balloon, undistorted.displacement, rest.displacement)
    if state is not None:
        moved = largest(balloon, state.displacement - last.displacement)
        say("release: lowest eigenvalues")
        try:
            modes = find_modes(state, count + num_turns(balloon))
            lowest = modes.lowest
        except EigenError as error:
            why = str(error)
    outcome, reason = _judge(end, records[-1], why, lowest, distance, rotation, moved, size, start.pressure)
    logger.info("release: %s (%s)", outcome, reason)
    return Released(
        outcome=outcome,
        reason=reason,
        state=state,
        modes=modes,
        lowest=lowest,
        distance=distance,
        rotation=rotation,
        moved=moved,
        end=end,
        damping=c,
        history=records,
        rejected=rejected,
    )


def _check(start: State) -> None:
    if not (math.isfinite(start.pressure) and start.pressure):
        raise InputError(f"a release needs a gas pressure; the start has {start.pressure} Pa")
    require_energy(start.balloon.film)


def _undamped(last: State) -> tuple[Equilibrium | None, str]:
    """The equilibrium at the damped motion's end by Newton's method, or why there is none. Collective."""
    start: Any = last
    try:
        # one step: the pressure does not change, so that a smaller one would be the same
        return inflate(
            last.balloon,
            last.pressure,
            prestress=last.prestress,
            start=start,
            options=NewtonOptions(min_step=1.0),
        ), ""
    except ConvergenceError as error:
        return None, f"{error.data['reason']}, |r| = {error.data['residual']:.1e}"


_TURNED = 1e-6  # [rad]


def _judge(
    end: str,
    last: Record,
    why: str,
    lowest: float | None,
    distance: float,
    rotation: float,
    moved: float,
    size: float,
    pressure: float,
) -> tuple[str, str]:
    """The outcome and its evidence in a sentence."""
    motion = f"the damped motion ended ({end}) with |r| = {last.relative_residual:.1e} of the load"
    if math.isnan(moved):
        return NO_EQUILIBRIUM, f"{motion}, and without damping Newton's method found no equilibrium: {why}"
    if moved > 10 * _SAME * size:
        return (
            NO_EQUILIBRIUM,
            f"{motion}; without damping the balloon is at rest only {moved:.2g} m from there",
        )
    if lowest is None:
        return UNKNOWN, f"at rest without damping, but the lowest eigenvalue is not known: {why}"
    if lowest <= NEUTRAL * abs(pressure) / size:
        return (
            NO_EQUILIBRIUM,
            f"{motion}; at rest without damping, but unstable: lowest eigenvalue {lowest:.3g} Pa/m",
        )
    evidence = (
        f"at rest without damping, lowest eigenvalue {lowest:.3g} Pa/m, "
        f"{distance:.1e} m from the undistorted shape"
    )
    if rotation > _TURNED:
        evidence += f", turned as a whole by {math.degrees(rotation):.2g} degrees, which its supports let it"
    return (RETURNED if distance <= _SAME * size else DISTORTED), evidence
