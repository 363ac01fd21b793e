"""Critical pressures by harmonic along the inflated path of one sector.

The symmetric equilibrium of one gore is followed from a start pressure up. At each pressure the lowest
eigenvalue lambda_n of each wanted harmonic is found from that gore (`lobefem.stability.gore_modes`); where it
changes its sign between two pressures, its zero is found by Brent's method. A mode may lose stability or
regain it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from lobefem import checks
from lobefem.display import Summarized, Summary, number
from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.state import Equilibrium
from lobefem.errors import ConvergenceError, InputError
from lobefem.fem.balloon import Balloon
from lobefem.fem.functionals import stiffness_scale
from lobefem.fem.rigid_motions import free_to_rotate, is_turn
from lobefem.files import on_all
from lobefem.frozen import Frozen
from lobefem.progress import said
from lobefem.stability.gore_modes import GorePencil, GoreSector
from lobefem.stability.mode_records import Mode
from lobefem.stability.modes import find_modes
from lobefem.typing import ComplexArray

from mpi4py import MPI

__all__ = ["Crossing", "GorePressures", "critical_pressures"]

_LOWER = (1.0, 0.25, 0.06, 0.015)  # shares of the start pressure at which a stable state is looked for


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


@dataclass(frozen=True, repr=False)
class GorePressures(Frozen, Summarized):
    """Critical pressures by harmonic along the inflated path of one sector.

    Attributes:
        harmonics: n, ascending.
        visited: pressures of the path, ascending [Pa].
        eigenvalues: lowest lambda_n at each of them, by harmonic, (pressures, harmonics) [Pa/m].
        crossings: all changes of sign, by ascending pressure.
        searched_to: highest pressure of the path [Pa].
        ended: why the path ended before the pressure that was asked for; None where it did not.
        state: at the first loss; None without one, or where it was unstable from the start.
        mode: the critical mode there, of one sector; None without one.
        point: "limit point" where all gores breathe alike in it, else "bifurcation"; None without one.
    """

    harmonics: tuple[int, ...]
    visited: tuple[float, ...]
    eigenvalues: tuple[tuple[float, ...], ...] = field(repr=False)
    crossings: tuple[Crossing, ...]
    searched_to: float
    ended: str | None
    state: Equilibrium | None = field(repr=False)
    mode: Mode | None = field(repr=False)
    point: str | None

    @property
    def pressures(self) -> tuple[float | None, ...]:
        """p_cr(n): the first pressure at which n loses stability [Pa].

        0 where the first state of the path is unstable already, None where there is none up to `searched_to`.
        """
        return tuple(self[n] for n in self.harmonics)

    @property
    def pressure(self) -> float | None:
        """The lowest of them [Pa]; None where no harmonic becomes unstable."""
        return min((p for p in self.pressures if p is not None), default=None)

    @property
    def harmonic(self) -> int | None:
        """The harmonic of the lowest one; of those that are unstable from the start the most unstable one."""
        first = self.pressure
        if first is None:
            return None
        found = [n for n in self.harmonics if self[n] == first]
        return min(found, key=lambda n: self.chart(n)[0])

    def chart(self, harmonic: int) -> tuple[float, ...]:
        """lambda_n(p) at the pressures of the path [Pa/m]."""
        at = self._index(harmonic)
        return tuple(row[at] for row in self.eigenvalues)

    def __getitem__(self, harmonic: int) -> float | None:
        if self.eigenvalues[0][self._index(harmonic)] <= 0:
            return 0.0
        return next((c.pressure for c in self.crossings if c.harmonic == harmonic and c.lost), None)

    def _index(self, harmonic: int) -> int:
        if harmonic not in self.harmonics:
            raise InputError(f"harmonic {harmonic} was not looked at; choose from {self.harmonics}")
        return self.harmonics.index(harmonic)

    def _summary(self) -> Summary:
        rows = [
            (f"n = {c.harmonic}", number(c.pressure, "Pa"), "lost" if c.lost else "regained")
            for c in self.crossings
        ]
        if self.ended is not None:
            rows.append(("path", self.ended, ""))
        title = f"stable up to {self.searched_to:g} Pa"
        if self.pressure == 0.0:
            title = f"unstable from {self.visited[0]:g} Pa or less at n = {self.harmonic}"
        elif self.pressure is not None:
            title = f"unstable from {number(self.pressure, 'Pa')} at n = {self.harmonic}"
        return Summary(title, tuple(rows), ("harmonic", "pressure", "stability"))


def critical_pressures(
    balloon: Balloon | Equilibrium,
    harmonics: int | Iterable[int] | None = None,
    *,
    up_to: float,
    start: float | None = None,
    growth: float = 1.3,
    rtol: float = 1e-3,
    comm: Any = None,
    progress: Callable[[str], None] | None = None,
) -> GorePressures:
    """The pressures at which harmonics lose or regain stability on the inflated path of one sector.

    The pressure grows by a factor from state to state. Between two of them one change of sign of a harmonic
    is seen, and of two one that a parabola through three neighbouring values shows.

    Args:
        balloon: of one sector, or a state of it at which the path starts.
        harmonics: n, from 0 to N/2; all by default.
        up_to: pressure at which the search ends [Pa].
        start: pressure of the first state [Pa], a twentieth of `up_to` by default. Where it is unstable the
            path starts lower, at a sixtieth at last.
        growth: largest factor from pressure to pressure, above 1.
        rtol: to which share of itself a critical pressure is found.
        comm: the ranks that share the work; all by default.
        progress: called with a line of text at each pressure.

    Raises:
        InputError: a whole balloon, a harmonic or a pressure that cannot be used, or a stiffness that is not
            symmetric.
        ConvergenceError: no first state was found.
        EigenError: the eigenvalues of a state were not found.

    Collective.
    """
    given = balloon if isinstance(balloon, Equilibrium) else None
    sector = balloon.balloon if isinstance(balloon, Equilibrium) else balloon
    checks.having("balloon", sector, "reference_area", "a Balloon of one sector, or a state of it")
    gore = GoreSector(sector)
    chosen = gore.harmonics if harmonics is None else checks.integers("a harmonic", harmonics, 0)
    wanted = tuple(sorted(set(chosen)))
    if not wanted:
        raise InputError("no harmonics are given; leave them out for all")
    for n in wanted:
        gore.check(n)
    checks.positive("up_to", up_to, "Pa")
    first = checks.positive("start", up_to / 20 if start is None else start, "Pa")
    first = first if given is None else given.pressure
    if not 0 < first < up_to:
        raise InputError(f"the search from {first:g} Pa to {up_to:g} Pa is impossible; start below its end")
    if not growth > 1 or not 0 < rtol < 1:
        raise InputError(f"growth = {growth} must be above 1 and rtol = {rtol} between 0 and 1")
    path = _Path(gore, sector, wanted, MPI.COMM_WORLD if comm is None else comm, progress, up_to)
    for share in _LOWER if given is None else (1.0,):
        path.points.clear()
        path.add(inflate(sector, share * first) if given is None else given)
        if min(path.points[0].values) > 0:
            break
    ended = path.climb(growth)
    path.look_between()
    crossings = path.crossings(rtol)
    losses = [c for c in crossings if c.lost]
    state = mode = point = None
    if losses and min(path.points[0].values) > 0:
        state = path.state_at(losses[0].pressure)
        mode = find_modes(state, 1, harmonics=[losses[0].harmonic])[0]
        alike = losses[0].harmonic == 0 and mode.kind != "twist"
        point = "limit point" if alike else "bifurcation"
    return GorePressures(
        wanted,
        tuple(one.state.pressure for one in path.points),
        tuple(one.values for one in path.points),
        crossings,
        path.points[-1].state.pressure,
        ended,
        state,
        mode,
        point,
    )


class _Point(NamedTuple):
    """A state of the path with the lowest eigenvalue of each harmonic."""

    state: Equilibrium
    values: tuple[float, ...]


class _Path:
    """States of one sector by ascending pressure, the same on every rank, and their eigenvalues."""

    def __init__(
        self,
        gore: GoreSector,
        balloon: Balloon,
        harmonics: tuple[int, ...],
        comm: Any,
        progress: Callable[[str], None] | None,
        up_to: float,
    ) -> None:
        self._gore, self._balloon, self._harmonics = gore, balloon, harmonics
        self._comm, self._progress, self._up_to = comm, progress, up_to
        self._starts: dict[int, ComplexArray] = {}
        self.points: list[_Point] = []

    def _values(self, state: Equilibrium, harmonics: Sequence[int]) -> dict[int, float]:
        """Lowest eigenvalues of some harmonics at a state."""
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

    def add(self, state: Equilibrium) -> None:
        """A further state, with its eigenvalues, dealt out to the ranks. Collective."""
        mine = self._harmonics[self._comm.rank :: self._comm.size]
        parts = on_all(self._comm, lambda: self._values(state, mine))
        found = {n: value for part in parts for n, value in part.items()}
        values = tuple(found[n] for n in self._harmonics)
        at = sum(one.state.pressure < state.pressure for one in self.points)
        self.points.insert(at, _Point(state, values))
        if self._progress is not None:
            lowest = min(found, key=lambda n: found[n])
            line = f"{state.pressure:.6g} Pa: lowest eigenvalue {found[lowest]:.4g} Pa/m at n = {lowest}"
            self._progress(said(line, state.pressure / self._up_to))

    def state_at(self, pressure: float) -> Equilibrium:
        """The state at a pressure between those of the path, from the nearest lower one."""
        below = [one.state for one in self.points if one.state.pressure <= pressure]
        start = below[-1] if below else self.points[0].state
        return start if start.pressure == pressure else inflate(self._balloon, pressure, start=start)

    def climb(self, growth: float) -> str | None:
        """Follow the path up; why it ended early, or None. Collective."""
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
        return None

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

    def crossings(self, rtol: float) -> tuple[Crossing, ...]:
        """All changes of sign, by ascending pressure, dealt out to the ranks. Collective."""
        brackets = [
            (low, high, n, low.values[k], high.values[k])
            for low, high in zip(self.points, self.points[1:], strict=False)
            for k, n in enumerate(self._harmonics)
            if (low.values[k] > 0) != (high.values[k] > 0)
        ]

        def solve() -> list[Crossing]:
            from scipy.optimize import brentq  # slow to import

            found = []
            for low, high, n, at_low, at_high in brackets[self._comm.rank :: self._comm.size]:
                known = {low.state.pressure: at_low, high.state.pressure: at_high}

                def value(p: float, n: int = n, known: dict[float, float] = known) -> float:
                    if p not in known:
                        known[p] = self._values(self.state_at(p), [n])[n]
                    return known[p]

                ends = low.state.pressure, high.state.pressure
                p = float(brentq(value, *ends, xtol=rtol * ends[0] / 2, rtol=1e-15))
                found.append(Crossing(p, n, at_low > 0))
            return found

        parts = on_all(self._comm, solve)
        return tuple(sorted(crossing for part in parts for crossing in part))
