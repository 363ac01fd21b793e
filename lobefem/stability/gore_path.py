"""The inflated path of one sector with the lowest eigenvalue of each harmonic at its states.

States are the same on every rank; the harmonics of a state are dealt out to the ranks. What an earlier run
has found is not computed again: the path itself is deterministic, so that a run that goes on comes to the
same pressures.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.state import Equilibrium
from lobefem.errors import ConvergenceError
from lobefem.fem.balloon import Balloon
from lobefem.fem.functionals import stiffness_scale
from lobefem.fem.rigid_motions import free_to_rotate, is_turn
from lobefem.files import on_all, share_of
from lobefem.progress import Progress, said
from lobefem.stability.gore_modes import GorePencil, GoreSector
from lobefem.typing import Comm, ComplexArray

__all__ = ["Crossing", "Eigenvalues", "GorePath", "Keep", "PathPoint"]

# lowest eigenvalue [Pa/m] by pressure [Pa] and harmonic
Eigenvalues = Mapping[float, Mapping[int, float]]

Keep = Callable[[Equilibrium, Eigenvalues], None]

# shares of the start pressure at which a first state is looked for, and then a stable one
_HIGHER, _LOWER = (2.0, 4.0, 8.0), (0.25, 0.06, 0.015)

_PATIENCE = 3  # states that are ever more unstable, after which none that is stable is expected

_MOST = 60  # evaluations between two states; a bisection takes about 15


class Crossing(NamedTuple):
    """A pressure at which the lowest eigenvalue of a harmonic changes its sign.

    Attributes:
        pressure: p [Pa].
        harmonic: n.
        lost: True where stability is lost with rising pressure, False where it is regained.
    """

    pressure: float
    harmonic: int
    lost: bool


class PathPoint(NamedTuple):
    """A state of the path with the lowest eigenvalue of each harmonic."""

    state: Equilibrium
    values: tuple[float, ...]


class GorePath:
    """States of one sector by ascending pressure, and their eigenvalues.

    Args:
        gore: the sector with free cuts.
        balloon: of the sector.
        harmonics: n, ascending.
        comm: the ranks that share the harmonics.
        up_to: where the path ends at last [Pa].
        known: eigenvalues of an earlier run.
        keep: called on all ranks with each state and all eigenvalues so far.
        progress: called with a line of text at each state.

    Attributes:
        points: by ascending pressure.
    """

    def __init__(
        self,
        gore: GoreSector,
        balloon: Balloon,
        harmonics: tuple[int, ...],
        comm: Comm,
        up_to: float,
        *,
        known: Eigenvalues | None = None,
        keep: Keep | None = None,
        progress: Progress | None = None,
    ) -> None:
        self._gore, self._balloon, self._harmonics = gore, balloon, harmonics
        self._comm, self._progress, self._up_to, self._keep = comm, progress, up_to, keep
        self._known = {p: dict(row) for p, row in (known or {}).items()}
        self._starts: dict[int, ComplexArray] = {}
        self.points: list[PathPoint] = []

    # --- eigenvalues ----------------------------------------------------------------------------
    def _values(self, state: Equilibrium, harmonics: Sequence[int]) -> dict[int, float]:
        """Lowest eigenvalues of some harmonics at a state, on this rank."""
        if not harmonics:
            return {}
        state.restore()
        scale = 1e-2 * stiffness_scale(self._balloon, state.pressure)
        pencil = GorePencil(self._gore, self._balloon, "unit", scale, self._starts)
        return {n: self._lowest(pencil, state, n) for n in harmonics}

    def _lowest(self, pencil: GorePencil, state: Equilibrium, harmonic: int) -> float:
        """The lowest eigenvalue of a harmonic, that of a rotation which the supports leave free left out."""
        turns = harmonic == 1 and free_to_rotate(self._balloon)
        modes = pencil.lowest(harmonic, 1 + turns)
        for mode in modes if turns else ():
            field = self._gore.displacement(pencil.own, mode.vector)
            if not is_turn(self._balloon, state.displacement, field.real):
                return mode.value
        return modes[0].value

    def values(self, state: Equilibrium, harmonics: Sequence[int]) -> dict[int, float]:
        """Lowest eigenvalues of some harmonics at a state, dealt out to the ranks. Collective."""
        row = self._known.setdefault(state.pressure, {})
        missing = [n for n in harmonics if n not in row]
        if missing:
            parts = on_all(self._comm, lambda: self._values(state, share_of(missing, self._comm)))
            for part in parts:
                row |= part
            if self._keep is not None:
                self._keep(state, self._known)
        return {n: row[n] for n in harmonics}

    # --- the path -------------------------------------------------------------------------------
    def add(self, state: Equilibrium) -> None:
        """A further state, with its eigenvalues. Collective."""
        found = self.values(state, self._harmonics)
        at = sum(one.state.pressure < state.pressure for one in self.points)
        self.points.insert(at, PathPoint(state, tuple(found.values())))
        if self._progress is not None:
            lowest = min(found, key=lambda n: found[n])
            line = f"{state.pressure:.6g} Pa: lowest eigenvalue {found[lowest]:.4g} Pa/m at n = {lowest}"
            self._progress(said(line, state.pressure / self._up_to))

    def begin(self, pressure: float) -> None:
        """Start at a pressure, or lower where some harmonic is unstable there. Collective.

        Where none of the lower ones is stable, at the last one that has an equilibrium; where the pressure
        has none, for the film's weight, say, at a higher one.

        Raises:
            ConvergenceError: neither has one.
        """
        higher = [pressure, *(factor * pressure for factor in _HIGHER if factor * pressure < self._up_to)]
        for p in higher:
            try:
                self.add(inflate(self._balloon, p))
                break
            except ConvergenceError:
                if p == higher[-1]:
                    raise
        for factor in _LOWER:
            if min(self.points[0].values) > 0 or self.points[0].state.pressure > pressure:
                return
            try:
                state = inflate(self._balloon, factor * pressure)
            except ConvergenceError:
                return
            self.points.clear()
            self.add(state)

    def state_at(self, pressure: float) -> Equilibrium:
        """The state at a pressure between those of the path, from the nearest lower one."""
        below = [one.state for one in self.points if one.state.pressure <= pressure]
        start = below[-1] if below else self.points[0].state
        return start if start.pressure == pressure else inflate(self._balloon, pressure, start=start)

    def climb(self, growth: float, first: bool) -> str | None:
        """Follow the path up; why it ended early, or None. Collective.

        Args:
            growth: largest factor from pressure to pressure.
            first: stop where stability has been lost for the first time, or where there never was any and
                there is ever less of it.
        """
        begin = self.points[0].state.pressure
        steps = max(math.ceil(math.log(self._up_to / begin) / math.log(growth)), 1)
        for k in range(1, steps + 1):
            pressure = self._up_to if k == steps else begin * (self._up_to / begin) ** (k / steps)
            try:
                state = self.state_at(pressure)
            except ConvergenceError as error:
                last = error.state
                if last is not None and last.pressure > self.points[-1].state.pressure:
                    self.add(last)
                return f"no equilibrium found above {self.points[-1].state.pressure:.6g} Pa"
            self.add(state)
            before, here = self.points[-2:]
            if first and (min(before.values) > 0 >= min(here.values) or self._hopeless()):
                return None
        return None

    def _hopeless(self) -> bool:
        """True if no state was stable, and the last ones ever less so over their pressure."""
        if len(self.points) <= _PATIENCE or any(min(one.values) > 0 for one in self.points):
            return False
        last = [min(one.values) / one.state.pressure for one in self.points[-_PATIENCE - 1 :]]
        return all(b < a for a, b in pairwise(last))

    def look_between(self) -> None:
        """Add states where a harmonic's value, of one sign at three pressures, has another one between.

        Collective.
        """
        wanted = set()
        for before, here, after in zip(self.points, self.points[1:], self.points[2:], strict=False):
            x = [math.log(one.state.pressure / here.state.pressure) for one in (before, here, after)]
            for a, b, c in zip(before.values, here.values, after.values, strict=True):
                # the parabola b + slope x + bend x^2
                left, right = (a - b) / x[0], (c - b) / x[2]
                bend = (right - left) / (x[2] - x[0])
                slope = left - bend * x[0]
                at = -slope / (2 * bend) if bend else math.inf
                alike = (a > 0) == (b > 0) == (c > 0)
                if alike and x[0] < at < x[2] and (b + slope * at / 2) * b < 0.25 * b * b:
                    wanted.add(here.state.pressure * math.exp(at))
        for pressure in sorted(wanted):
            if all(abs(one.state.pressure / pressure - 1) > 1e-3 for one in self.points):
                self.add(self.state_at(pressure))

    # --- crossings ------------------------------------------------------------------------------
    def crossings(self, rtol: float) -> tuple[Crossing, ...]:
        """All changes of sign, by ascending pressure. Collective."""
        found: list[Crossing] = []
        for low, high in pairwise(tuple(self.points)):
            ends = zip(self._harmonics, low.values, high.values, strict=True)
            lost = {n: a > 0 for n, a, b in ends if (a > 0) != (b > 0)}
            zeros = self._zeros(low, high, tuple(lost), rtol)
            found += [Crossing(p, n, lost[n]) for n, p in zeros.items()]
        return tuple(sorted(found))

    def _zeros(
        self, low: PathPoint, high: PathPoint, harmonics: tuple[int, ...], rtol: float
    ) -> dict[int, float]:
        """The zero of each harmonic between two states. Collective.

        All harmonics share the states in between: the next one is where the zero of the least certain one is
        expected. A zero is certain where a line and a cubic through the values agree.
        """
        a, b = low.state.pressure, high.state.pressure
        at = [self._harmonics.index(n) for n in harmonics]
        known = {n: {a: low.values[k], b: high.values[k]} for n, k in zip(harmonics, at, strict=True)}
        zeros: dict[int, float] = {}
        for turn in range(_MOST):
            doubts = {}
            for n in harmonics:
                if n not in zeros:
                    zero, doubt, width = _zero(known[n])
                    if min(doubt, width) < rtol * a / 2:
                        zeros[n] = zero
                    else:
                        doubts[n] = doubt, zero
            if not doubts:
                break
            worst = max(doubts, key=lambda n: doubts[n])
            left, right = _bracket(known[worst])
            pressure = (left + right) / 2 if turn % 4 == 3 else doubts[worst][1]
            for n, value in self.values(self.state_at(pressure), list(doubts)).items():
                known[n][pressure] = value
        return {n: zeros[n] if n in zeros else sum(_bracket(known[n])) / 2 for n in harmonics}


def _bracket(known: Mapping[float, float]) -> tuple[float, float]:
    """The two neighbouring pressures between which a value changes its sign."""
    p = sorted(known)
    return next((a, b) for a, b in pairwise(p) if (known[a] > 0) != (known[b] > 0))


def _zero(known: Mapping[float, float]) -> tuple[float, float, float]:
    """Expected zero of a value, the distance of a line's zero from it, and the bracket's width."""
    from scipy.interpolate import BarycentricInterpolator  # slow to import
    from scipy.optimize import brentq

    a, b = _bracket(known)
    line = a - known[a] * (b - a) / (known[b] - known[a])
    others = sorted((p for p in known if p not in (a, b)), key=lambda p: abs(p - line))[:2]
    if not others or known[b] == 0:
        return line, b - a, 0.0 if known[b] == 0 else b - a
    x = np.array([a, b, *others])
    curve = BarycentricInterpolator(x / a, np.array([known[p] for p in x]))
    zero = a * float(brentq(lambda p: float(curve(p)), 1.0, b / a))
    return zero, abs(zero - line), b - a
