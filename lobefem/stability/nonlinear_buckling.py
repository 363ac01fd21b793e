"""Stability along a path of states: `trace` follows the modes, `critical_point` finds where it is lost.

The path is the held isotensoid ("ideal") or the true equilibrium at each pressure, found from the one
before ("inflated"). `lobefem.stability.linear_buckling` has the ideal path's critical pressure by a linear
pencil; here the tangent depends on the pressure in any way, and the path itself may end, at a limit point.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from lobefem.display import Summarized, Summary, number
from lobefem.equilibrium.inflation import Progress, inflate
from lobefem.equilibrium.solver_options import NewtonOptions
from lobefem.equilibrium.state import Checkpoint, Equilibrium, ideal_state
from lobefem.errors import ConvergenceError, EigenError, InputError
from lobefem.fem.balloon import Balloon
from lobefem.stability.branch_following import follow
from lobefem.stability.mode_records import Mode, Modes
from lobefem.stability.path_rates import jumped, load_share, rayleigh, without_turns
from lobefem.stability.tracing import _check_state, _state
from lobefem.typing import StateKind
from lobefem.units import pascals

__all__ = ["SEARCH_END", "CriticalPoint", "critical_point"]

SEARCH_END = 2e4  # [Pa]; films of some tens of micrometres have torn there

# share of the load in a critical mode that makes a limit point; that of a bifurcation is round-off,
# or a share that the mesh breaks the symmetry by
_LIMIT_POINT = 1e-2

# shares of a pressure that is thought to be critical at which a stable state is looked for in turn, and the
# first step from it
_BELOW, _FIRST_STEP = (0.97, 0.9, 0.75, 0.5, 0.25), 0.06


@dataclass(frozen=True, repr=False)
class CriticalPoint(Summarized):
    """The first loss of stability along a path.

    Attributes:
        pressure: p [Pa]; inf where the path is stable up to the limit.
        mode: the critical mode, computed at `state`; None without one.
        point: "limit point" where `projection` is above 0.01, "bifurcation" else; None without one.
        projection: share of the load f = dr/dp in the critical mode, |z.f|/(|z| |f|), z the left null
            vector (the mode itself where the tangent is symmetric), lengths by mass: |z|^2 = z.Bz and
            |f|^2 = f.B^-1 f. It depends neither on the mesh nor on the units of the plates' rotations.
        state: that of the bracket's unstable end; the last one at a limit point or without any.
        bracket: a stable pressure and one that is unstable or has no equilibrium nearby [Pa].
        visited: (pressure [Pa], lowest real part of lambda) in the order in which they were found.
        divisions: (along a lobe, around) of the mesh, None on an unstructured one.
    """

    pressure: float
    mode: Mode | None
    point: str | None
    projection: float | None
    state: Equilibrium = field(repr=False)
    bracket: tuple[float, float]
    visited: tuple[tuple[float, float], ...]
    divisions: tuple[int, int] | None

    def _summary(self) -> Summary:
        rows = [("pressures visited", str(len(self.visited)))]
        if self.mode is not None:
            rows.insert(0, ("mode", f"{self.mode.kind}, n = {self.mode.harmonic}"))
            rows.insert(1, ("point", f"{self.point}, load's share {self.projection:.1e}"))
        if self.divisions is not None:
            rows.append(("mesh", "{} x {} divisions".format(*self.divisions)))
        if self.mode is None:
            return Summary(f"no instability found up to {pascals(self.state.pressure)}", tuple(rows))
        return Summary(f"unstable from {number(self.pressure, 'Pa')}", tuple(rows))


def critical_point(
    balloon: Balloon,
    *,
    limit: float = SEARCH_END,
    start: float = 1.0,
    near: float | None = None,
    state: StateKind = "inflated",
    rtol: float = 1e-3,
    growth: float = 1.3,
    resume: Checkpoint | None = None,
    keep: Callable[[Equilibrium, dict[str, Any]], None] | None = None,
    progress: Progress | None = None,
) -> CriticalPoint:
    """The first pressure along a path at which stability is lost.

    From a stable state at `start` the pressure grows by a factor until the lowest eigenvalue (of the
    smallest real part; its sign is proved by inertia) is negative. The zero of that mode's eigenvalue
    is then found by Brent's method. A step that fails, or jumps far beyond the path's tangent to another
    equilibrium, is halved. Where the smallest one fails too, the path ends: stability is lost there if
    the square of an eigenvalue goes to zero in proportion to the pressure, as at a fold. A mesh that
    breaks the symmetry turns a bifurcation into such an end, too, with a small `projection`, or into a
    path that turns aside and stays stable.

    Stable means positive real parts. Complex values, which only the `film` load on moving plates makes,
    would without damping flutter even so; that is not looked for.

    Args:
        balloon: prestressed for the ideal state.
        limit: pressure at which to give up [Pa]; of the sign of `start`, negative for pressure from
            outside.
        start: pressure of the first state [Pa]; a balloon that is unstable there is looked for at a tenth of
            it, a hundredth and a thousandth.
        near: a pressure near which stability is lost [Pa], of a coarser mesh for example. The path then
            begins at a stable state just below it, if there is one, which is several times quicker than from
            `start`; that the balloon is stable all the way there is taken for granted.
        state: "inflated" or "ideal".
        rtol: relative width of the bracket.
        growth: factor from pressure to pressure, above 1.
        resume: what `keep` was last given in a run that was stopped; `start` does not matter then.
        keep: called on all ranks with each stable state of the path, with notes to go on from.
        progress: called with a line of text now and then.

    Raises:
        InputError: an argument that cannot be used, or an unstable start.
        ConvergenceError: the path ends although no eigenvalue goes to zero; its `state` is the last one.
        EigenError: the modes of a state could not be computed; its `state` is that one.

    Collective.
    """
    _check_state(balloon, state)
    if not (math.isfinite(start) and math.isfinite(limit) and 0 < start / (limit or math.inf) < 1):
        raise InputError(
            f"the search from {start} Pa to {limit} Pa is impossible; both must have the same sign, and "
            "the limit be further from 0"
        )
    if not growth > 1 or not 0 < rtol < 1:
        raise InputError(f"growth = {growth} must be above 1 and rtol = {rtol} between 0 and 1")
    if near is not None and not (math.isfinite(near) and near / start > 0):
        raise InputError(f"near = {near} Pa must be a pressure of the sign of start = {start:g} Pa")
    notes: Mapping[str, Any] = {} if resume is None else resume.notes
    path = _Path(balloon, state, rtol, progress, notes.get("visited", ()))
    found: Modes | None = None
    if near is not None and resume is None:
        near = min(near, limit, key=abs)
        found, high = path.below(near)
        if found is not None and high is not None:
            return path.crossing(found, high)
        notes = notes if found is None else {"step": _FIRST_STEP * abs(near)}
    low = _stable_start(path, start, resume) if found is None else found
    step, smooth = float(notes.get("step", math.inf)), bool(notes.get("smooth", True))
    while low.state.pressure != limit:
        if keep is not None:
            keep(low.state, {"visited": path.visited, "step": step, "smooth": smooth})
        p = low.state.pressure
        target = p + math.copysign(min(step, (growth - 1) * abs(p)), p)
        target = min(target, limit, key=abs)
        reached = path.advance(low, target)
        if reached is None:
            if abs(target - p) <= rtol * abs(p):
                return path.fold(low, target)
            step, smooth = abs(target - p) / 2, False
            continue
        if not reached.stable:
            return path.crossing(low, reached)
        # a failure may be the solver's own, of a step too long
        low, step, smooth = reached, step * (2 if smooth else 1), True
    p = low.state.pressure
    return CriticalPoint(
        math.inf, None, None, None, low.state, (p, math.inf), path.visited, balloon.surface.divisions
    )


def _stable_start(path: _Path, start: float, resume: Checkpoint | None) -> Modes:
    """The modes of the first state of a path, at a lower pressure where there is none stable. Collective."""
    if resume is not None:
        start = resume.pressure
    low = path.modes(_state(path.balloon, path.state, start, resume, path.progress))
    for _ in range(3 if resume is None else 0):
        if low.stable:
            break
        start /= 10
        path.visited = ()
        low = path.modes(_state(path.balloon, path.state, start, None, path.progress))
    if not low.stable:
        raise InputError(
            f"the balloon is unstable already at {start:g} Pa (lambda = {low[0].value.real:.3g}): there "
            "is no stable state to start from; look at its modes there"
        )
    return low


class _Path:
    """States of a balloon one after the other, with their lowest modes."""

    def __init__(
        self,
        balloon: Balloon,
        state: StateKind,
        rtol: float,
        progress: Progress | None,
        visited: Sequence[tuple[float, float]] = (),
    ) -> None:
        self.balloon, self.state, self.rtol, self.progress = balloon, state, rtol, progress
        # the last one of an earlier run is looked at again
        self.visited = tuple((float(p), float(value)) for p, value in visited[:-1])

    def modes(self, state: Equilibrium) -> Modes:
        """The lowest pair of a state, turns that its supports leave apart. Collective."""
        modes = _own_modes(state, 2)
        self.visited += ((state.pressure, modes[0].value.real),)
        if self.progress is not None:
            self.progress(f"{state.pressure:.6g} Pa: lowest lambda {modes[0].value.real:.4g}")
        return modes

    def below(self, near: float) -> tuple[Modes | None, Modes | None]:
        """Modes of a stable state below a pressure, and of an unstable one between, if any. Collective."""
        high = None
        # beyond a limit point a state is found all right, but not on this path
        lower = self._direct(_BELOW[-1] * near) if self.state == "inflated" else None
        for share in _BELOW:
            try:
                state = self._direct(share * near)
            except ConvergenceError:
                continue
            if lower is not None and jumped(lower, state):
                continue
            modes = self.modes(state)
            if modes.stable:
                return modes, high
            high = modes
        return None, None

    def _direct(self, pressure: float) -> Equilibrium:
        """The state at a pressure, from no other on this mesh. Collective."""
        if self.state == "ideal":
            return ideal_state(self.balloon, pressure)
        return inflate(self.balloon, pressure, nested=True, progress=self.progress)

    def advance(self, low: Modes, target: float) -> Modes | None:
        """The modes at a pressure, one step on; None if the path does not lead there. Collective."""
        if self.state == "ideal":
            return self.modes(ideal_state(self.balloon, target))
        try:
            state = inflate(
                self.balloon,
                target,
                start=low.state,
                options=NewtonOptions(min_step=1.0),
                progress=self.progress,
            )
        except ConvergenceError:
            return None
        return None if jumped(low.state, state) else self.modes(state)

    def crossing(self, low: Modes, high: Modes) -> CriticalPoint:
        """The zero of the lowest eigenvalue between a stable and an unstable state. Collective."""
        known = {m.state.pressure: m for m in (low, high)}
        critical = high

        def value(p: float) -> float:
            """Of the critical branch: the lowest eigenvalue, or the critical mode's Rayleigh quotient.

            Where the state is stable the lowest may be that of another branch.
            """
            nonlocal critical
            if p not in known:
                below = max((k for k, m in known.items() if m.stable), key=abs)
                known[p] = self.modes(_state(self.balloon, self.state, p, known[below].state, self.progress))
            modes = known[p]
            lowest = modes[0].value.real
            if lowest < 0:
                critical = modes
                return lowest
            return max(lowest, rayleigh(modes.state, critical[0].displacement))

        from scipy.optimize import brentq  # slow to import, and seldom needed

        a, b = low.state.pressure, high.state.pressure
        brentq(value, a, b, xtol=1e-12 * abs(a), rtol=self.rtol / 4)
        a = max((p for p, m in known.items() if m.stable), key=abs)
        b = min((p for p, m in known.items() if not m.stable), key=abs)
        # Brent's own result is one of the last bracket's ends; its secant is nearer
        down, up = value(b), value(a)
        return self._record(a + (b - a) * up / (up - down), known[b], known[b][0], (a, b))

    def fold(self, low: Modes, end: float) -> CriticalPoint:
        """Kind of the point at which stability is lost at the end of a path. Collective."""
        p, reach = low.state.pressure, 5 * self.rtol * abs(low.state.pressure)
        before = _state(self.balloon, self.state, p * (1 - 3 * self.rtol), low.state, self.progress)
        # the critical mode need not be the lowest one yet
        near, last = (_own_modes(state, 8) for state in (before, low.state))
        found: list[tuple[float, Mode]] = []
        for branch in follow([near, last]):
            if len(branch.pressures) == 2:
                first, second = (branch.values[branch.pressures == q][0] ** 2 for q in (before.pressure, p))
                if first > second:
                    away = second / (first - second) * (p - before.pressure)
                    found.append((p + away, last[branch.members[-1 if p > 0 else 0][0]]))
        found.sort(key=lambda f: abs(f[0] - p))
        if not found or abs(found[0][0] - p) > reach:
            raise ConvergenceError(
                f"the path of equilibria ends near {p:.6g} Pa, but not at a limit point: the lowest "
                f"eigenvalue was {near[0].value.real:.4g} at {before.pressure:.6g} Pa and is "
                f"{last[0].value.real:.4g}; try slack_stiffness >= 1e-4 or a finer mesh",
                state=low.state,
                pressure=end,
                reason="path of equilibria ends",
            )
        zero, mode = found[0]
        return self._record(sorted((p, zero, end))[1], low, mode, (p, end))

    def _record(
        self, pressure: float, modes: Modes, mode: Mode, bracket: tuple[float, float]
    ) -> CriticalPoint:
        share = load_share(modes, mode)
        point = "limit point" if share > _LIMIT_POINT else "bifurcation"
        divisions = self.balloon.surface.divisions
        return CriticalPoint(pressure, mode, point, share, modes.state, bracket, self.visited, divisions)


def _own_modes(state: Equilibrium, count: int) -> Modes:
    """The lowest modes of a state, which an error hands on where they fail. Collective."""
    try:
        return without_turns(state, count)
    except EigenError as error:
        error.state = state
        raise
