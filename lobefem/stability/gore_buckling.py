"""Critical pressures by harmonic along the inflated path of one sector.

The symmetric equilibrium of one gore is followed from a start pressure up. At each pressure the lowest
eigenvalue lambda_n of each wanted harmonic is found from that gore (`lobefem.stability.gore_modes`); where it
changes its sign between two pressures, its zero is found from values between them, at states that all
harmonics share. A mode may lose stability or regain it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace

from lobefem import checks
from lobefem.display import Summarized, Summary, number
from lobefem.equilibrium.state import Equilibrium
from lobefem.errors import InputError
from lobefem.fem.balloon import Balloon
from lobefem.frozen import Frozen
from lobefem.stability.gore_modes import GoreSector
from lobefem.stability.gore_path import Crossing, Eigenvalues, GorePath, Keep
from lobefem.stability.mode_records import Mode
from lobefem.stability.modes import find_modes
from lobefem.typing import Comm

from mpi4py import MPI

__all__ = ["Crossing", "GorePressures", "critical_pressures"]


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
        state: where stability is lost first; None where it is not, or there was none to lose.
        mode: the critical mode there, of one sector; None without one.
        point: "limit point" where all gores breathe alike in it, else "bifurcation"; None without one.
    """

    harmonics: tuple[int, ...]
    visited: tuple[float, ...]
    eigenvalues: tuple[tuple[float, ...], ...] = field(repr=False)
    crossings: tuple[Crossing, ...]
    searched_to: float
    ended: str | None
    state: Equilibrium | None = field(default=None, repr=False)
    mode: Mode | None = field(default=None, repr=False)
    point: str | None = None

    @property
    def pressures(self) -> tuple[float | None, ...]:
        """p_cr(n): the first pressure at which n loses stability [Pa].

        0 where n is unstable on the whole path, None where it is stable up to `searched_to`, be it from the
        pressure on at which it gains stability.
        """
        return tuple(self[n] for n in self.harmonics)

    @property
    def stable(self) -> tuple[tuple[float, float], ...]:
        """The stretches of the path on which all harmonics are stable, each from and to a pressure [Pa]."""
        unstable = {n for n, value in zip(self.harmonics, self.eigenvalues[0], strict=True) if value <= 0}
        begin, found = self.visited[0], []
        for crossing in self.crossings:
            if not unstable:
                found.append((begin, crossing.pressure))
            (unstable.add if crossing.lost else unstable.discard)(crossing.harmonic)
            begin = crossing.pressure
        if not unstable:
            found.append((begin, self.searched_to))
        return tuple(found)

    @property
    def loss(self) -> Crossing | None:
        """The crossing at which the balloon, stable in all harmonics before, is so no more; None without."""
        stable = self.stable
        if not stable:
            return None
        return next((c for c in self.crossings if c.lost and c.pressure == stable[0][1]), None)

    @property
    def pressure(self) -> float | None:
        """The pressure of `loss` [Pa]; 0 where no state was stable, None where stability is not lost."""
        if not self.stable:
            return 0.0
        return None if self.loss is None else self.loss.pressure

    @property
    def harmonic(self) -> int | None:
        """The harmonic of `pressure`; where no state was stable the most unstable one of the first state."""
        if self.pressure == 0.0:
            return min(self.harmonics, key=lambda n: self.chart(n)[0])
        return None if self.loss is None else self.loss.harmonic

    def chart(self, harmonic: int) -> tuple[float, ...]:
        """lambda_n(p) at the pressures of the path [Pa/m]."""
        at = self._index(harmonic)
        return tuple(row[at] for row in self.eigenvalues)

    def __getitem__(self, harmonic: int) -> float | None:
        first = self.eigenvalues[0][self._index(harmonic)]
        own = [c for c in self.crossings if c.harmonic == harmonic]
        return next((c.pressure for c in own if c.lost), None if own or first > 0 else 0.0)

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
        if self.stable and self.stable[0][0] > self.visited[0]:
            title = f"stable from {number(self.stable[0][0], 'Pa')} to {self.searched_to:g} Pa"
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
    first: bool = False,
    comm: Comm | None = None,
    known: Eigenvalues | None = None,
    keep: Keep | None = None,
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
            path starts lower, at a sixtieth at last; where there is none, higher.
        growth: largest factor from pressure to pressure, above 1.
        rtol: to which share of itself a critical pressure is found.
        first: end the path where stability has been lost first, or where no state of it is stable.
        comm: the ranks that share the work; all by default.
        known: eigenvalues of an earlier run by pressure and harmonic, which are not computed again.
        keep: called on all ranks with each state and all eigenvalues so far.
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
    begin = checks.positive("start", up_to / 20 if start is None else start, "Pa")
    begin = begin if given is None else given.pressure
    if not 0 < begin < up_to:
        raise InputError(f"the search from {begin:g} Pa to {up_to:g} Pa is impossible; start below its end")
    if not growth > 1 or not 0 < rtol < 1:
        raise InputError(f"growth = {growth} must be above 1 and rtol = {rtol} between 0 and 1")
    ranks = MPI.COMM_WORLD if comm is None else comm
    path = GorePath(gore, sector, wanted, ranks, up_to, known=known, keep=keep, progress=progress)
    if given is None:
        path.begin(begin)
    else:
        path.add(given)
    ended = path.climb(growth, first)
    path.look_between()
    found = GorePressures(
        wanted,
        tuple(one.state.pressure for one in path.points),
        tuple(one.values for one in path.points),
        path.crossings(rtol),
        path.points[-1].state.pressure,
        ended,
    )
    loss = found.loss
    if loss is None:
        return found
    state = path.state_at(loss.pressure)
    mode = find_modes(state, 1, harmonics=[loss.harmonic])[0]
    alike = loss.harmonic == 0 and mode.kind != "twist"
    return replace(found, state=state, mode=mode, point="limit point" if alike else "bifurcation")
