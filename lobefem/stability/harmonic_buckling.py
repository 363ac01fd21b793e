"""Critical pressures harmonic by harmonic: K_n(p) = K_m + p K_g from one sector of the held geometry.

The lowest of each harmonic, p_crit(n), tells what the lowest of all hides: low harmonics converge under
refinement, and which n is critical.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

from lobefem import checks
from lobefem.display import Summarized, Summary, number
from lobefem.equilibrium.state import require_drawn
from lobefem.errors import EigenError, InputError
from lobefem.fem.balloon import Balloon
from lobefem.files import on_all
from lobefem.frozen import Frozen
from lobefem.linalg.banded import HERMITIAN, Band, as_scipy, asymmetry, lowest, most_negative
from lobefem.model.film import require_one_tangent
from lobefem.progress import said
from lobefem.stability.cyclic import Sector, own_pairs
from lobefem.stability.mode_kinds import kind_of
from lobefem.typing import Comm, ComplexArray, Sparse

from mpi4py import MPI

__all__ = [
    "FixedShapePencil",
    "HarmonicPressures",
    "OneHarmonic",
    "Row",
    "fixed_shape_pencil",
    "harmonic_pressures",
    "pressure_limit",
    "require_prestress",
    "sector_pencil",
    "solve_harmonics",
    "stable_below",
]

LINEAR = (0.0, 1e5)  # [Pa]; the second keeps the round-off of K_m's 1e9 N/m out of their difference

Row = tuple[float, str, float]  # critical pressure [Pa], kind of the mode, residual


@dataclass(frozen=True, repr=False)
class HarmonicPressures(Summarized):
    """The critical pressures of each harmonic of a held ideal geometry.

    Attributes:
        harmonics: n, ascending.
        pressures: p_crit(n) [Pa]: inf where no pressure makes it unstable, 0 where any does.
        kinds: of the critical modes, "" without one.
        residuals: ||K_m phi + p K_g phi||/||K_m phi||, nan without a mode.
        divisions: (along a lobe, around) of the mesh.
        lobes: number of lobes.
    """

    harmonics: tuple[int, ...]
    pressures: tuple[float, ...]
    kinds: tuple[str, ...]
    residuals: tuple[float, ...] = field(repr=False)
    divisions: tuple[int, int]
    lobes: int

    def _summary(self) -> Summary:
        rows = tuple(
            (f"n = {n}", "never unstable" if math.isinf(p) else number(p, "Pa"), kind)
            for n, p, kind in zip(self.harmonics, self.pressures, self.kinds, strict=True)
        )
        mesh = "{} x {} divisions".format(*self.divisions)
        title = f"lowest {number(self.pressure, 'Pa')} at n = {self.lowest}, {mesh}"
        if math.isinf(self.pressure):
            title = f"never unstable, {mesh}"
        return Summary(title, rows, ("harmonic", "critical pressure", "kind"))

    @property
    def lowest(self) -> int:
        """The harmonic with the lowest critical pressure."""
        return self.harmonics[int(np.argmin(self.pressures))]

    @property
    def pressure(self) -> float:
        """The lowest critical pressure [Pa]."""
        return min(self.pressures)

    def __getitem__(self, harmonic: int) -> float:
        return self.pressures[self.harmonics.index(harmonic)]


@dataclass(frozen=True)
class OneHarmonic(Frozen):
    """The critical pressures of one harmonic, ascending [Pa], and the first one's q_n."""

    pressures: tuple[float, ...]
    vector: ComplexArray | None = field(repr=False)
    residual: float


def harmonic_pressures(
    balloon: Balloon,
    harmonics: int | Iterable[int] | None = None,
    *,
    comm: Comm | None = None,
    at: tuple[float, float] = LINEAR,
    known: Mapping[int, Row] = MappingProxyType({}),
    keep: Callable[[dict[int, Row]], None] | None = None,
    progress: Callable[[str], None] | None = None,
) -> HarmonicPressures:
    """The critical pressure of each harmonic, dealt out to the ranks. Collective.

    Args:
        balloon: prestressed, on a structured surface or on one sector of it (`sector=True`).
        harmonics: which one or which ones; by default all that the mesh has, 0 to N/2.
        comm: the ranks that share the work (default: the whole balloon's, all of them for a sector).
        at: pressures of the two tangents that make the pencil [Pa].
        known: rows of an earlier run, by harmonic, that are not to be found again.
        keep: called on all ranks with the new rows, as soon as each rank has found one.
        progress: called with a line of text for each harmonic of this rank.

    Raises:
        InputError: the balloon is not prestressed, or its mesh has no such harmonics.
        EigenError: a harmonic's problem did not converge.
    """
    asked = () if harmonics is None else checks.integers("a harmonic", harmonics, 0)
    require_prestress(balloon)
    sector = Sector(balloon)
    chosen = tuple(sector.harmonics) if harmonics is None else asked
    if comm is None:
        comm = MPI.COMM_WORLD if balloon.surface.copies != 1 else balloon.comm
    rows = {n: row for n, row in known.items() if n in chosen}

    def found(new: dict[int, OneHarmonic]) -> None:
        kinds = {
            n: "" if one.vector is None else kind_of(sector.balloon, sector.displacement(one.vector, n), n)
            for n, one in new.items()
        }
        rows.update({n: (one.pressures[0], kinds[n], one.residual) for n, one in new.items()})
        if keep is not None:
            keep({n: rows[n] for n in new})

    rest = tuple(n for n in chosen if n not in rows)
    if rest or not chosen:
        solve_harmonics(sector, rest, 1, comm=comm, at=at, each=found, progress=progress)
    pressures, kinds, residuals = zip(*(rows[n] for n in chosen), strict=True)
    surface = balloon.surface
    assert surface.divisions is not None  # it has sectors
    return HarmonicPressures(chosen, pressures, kinds, residuals, surface.divisions, surface.num_lobes)


def solve_harmonics(
    sector: Sector,
    harmonics: Sequence[int],
    count: int,
    *,
    comm: Comm,
    at: tuple[float, float] = LINEAR,
    each: Callable[[dict[int, OneHarmonic]], None] | None = None,
    progress: Callable[[str], None] | None = None,
) -> dict[int, OneHarmonic]:
    """The lowest critical pressures of each harmonic, dealt out to the ranks. Collective over `comm`.

    Args:
        sector: of a prestressed balloon.
        harmonics: n.
        count: how many of each.
        comm: the ranks.
        at: pressures of the two tangents that make the pencil [Pa].
        each: called on all ranks with what they have found, one harmonic a rank.
        progress: called with a line of text for each harmonic of this rank.

    Raises:
        InputError: no harmonics, or one that the mesh does not have.
        EigenError: a harmonic's problem did not converge.
    """
    if not harmonics:
        raise InputError("no harmonics are given; leave them out for all")
    for n in harmonics:
        sector.check(n)
    pencil = sector_pencil(sector, at)
    table: dict[int, OneHarmonic] = {}
    hint = None
    for first in range(0, len(harmonics), comm.size):
        mine = harmonics[first + comm.rank : first + comm.rank + 1]
        if progress is not None and mine:
            progress(said(f"critical pressure of harmonic {mine[0]}", first / len(harmonics)))

        def solve(mine: Sequence[int] = mine, hint: float | None = hint) -> dict[int, OneHarmonic]:
            return {n: FixedShapePencil(sector, n, pencil).solve(count, hint) for n in mine}

        components = on_all(comm, solve)
        for one in components[comm.rank].values():  # its neighbour's is not far
            hint = one.pressures[0] if math.isfinite(one.pressures[0]) else None
        new = {n: one for part in components for n, one in part.items()}
        table |= new
        if each is not None:
            each(new)
    return table


def sector_pencil(sector: Sector, at: tuple[float, float] = LINEAR) -> tuple[Any, Any, Any]:
    """K_m, K_g and the mass of the sector's film and its share of the plates, as SciPy matrices."""
    balloon = sector.balloon
    K_m, K_g = fixed_shape_pencil(balloon, *at)
    return as_scipy(K_m), as_scipy(K_g), as_scipy(balloon.mass(balloon.map.create_vector()))


class FixedShapePencil:
    """K_n(p) = K_m + p K_g of one harmonic.

    Args:
        sector: of a prestressed balloon.
        harmonic: n.
        pencil: `sector_pencil`, where it is at hand.

    Raises:
        InputError: n out of range.
    """

    def __init__(self, sector: Sector, harmonic: int, pencil: tuple[Any, Any, Any] | None = None) -> None:
        matrices = sector_pencil(sector) if pencil is None else pencil
        self.K_m, self.K_g, self.M = (sector.reduce(A, harmonic) for A in matrices)
        self._sector, self._harmonic = sector, harmonic
        self.limit = pressure_limit(sector.balloon)
        self.hermitian = asymmetry(self.K_g) < HERMITIAN
        self._scale = 1e-3 / math.sqrt(sector.balloon.reference_area)  # Pa/m per Pa
        self._rotation = sector.rotation(sector.balloon.map.create_vector(), self.M, harmonic)
        # of the constraint that leaves the rotation out
        self._c: ComplexArray | None = None if self._rotation is None else self.M @ self._rotation
        self._tilt = 3 * sector.num_slots  # the bottom plate's, where there is one
        if self.hermitian:
            rest = [self._rest(A) for A in (self.K_m, self.K_g)]
            self.band = Band(abs(rest[0]) + abs(rest[1]))
            self._bands = self.band.pack(rest[0]), self.band.pack(rest[1])

    def _rest(self, A: Sparse) -> Any:
        """A without the row and column of the tilt, where the balloon turns freely."""
        if self._c is None:
            return A
        keep = np.delete(np.arange(A.shape[0]), self._tilt)
        return A[keep][:, keep]

    def _solver(self, p: float) -> Callable[[ComplexArray], ComplexArray] | None:
        """A solver with K_n(p); None where it is not positive definite.

        Where the balloon turns freely K_n is all but singular, and what counts are the motions with
        c^H x = 0. There K_n without the tilt's row is factorised, and tilt and constraint are a border of
        two: with one of the border's Schur complement's eigenvalues negative, the constraint's own, K_n is
        definite on those motions.
        """
        solve = self.band.factor(self._bands[0] + p * self._bands[1])
        if self._c is None or solve is None:
            return solve
        t = self._tilt
        column = (self.K_m[:, [t]] + p * self.K_g[:, [t]]).toarray().ravel()
        border = np.stack([np.delete(column, t), np.delete(self._c, t)], axis=1)
        corner = np.array([[column[t].real, self._c[t]], [self._c[t].conj(), 0.0]])
        moved = solve(border)
        schur = corner - border.conj().T @ moved
        if np.linalg.det(schur).real >= 0:
            return None

        inverse = solve  # which is there, for a closure

        def constrained(b: ComplexArray) -> ComplexArray:
            x = inverse(np.delete(b, t, axis=0))
            at_t = np.zeros((2, *b.shape[1:]), dtype=complex)
            at_t[0] = b[t]
            ends = np.linalg.solve(schur, at_t - border.conj().T @ x)
            return np.insert(x - moved @ ends, t, ends[0], axis=0)

        return constrained

    def _lowest(self, p: float) -> tuple[float, ComplexArray]:
        """The lowest real part of lambda at a pressure, with its vector; of one not Hermitian."""
        K = self.K_m + p * self.K_g
        values, vectors = self._own(
            lambda count: lowest(K, self.M, count, self._scale * p, False, self._c)[:2], 1
        )
        return float(values[0].real), vectors[:, 0]

    def _own(self, find: Callable[[int], tuple[Any, Any]], count: int) -> tuple[Any, Any]:
        """The first eigenpairs that are mostly of this harmonic (see `Sector.share`)."""
        size = self.K_m.shape[0] - (self._c is not None)
        return own_pairs(self._sector, self._harmonic, find, count, size)

    def solve(self, count: int = 1, hint: float | None = None) -> OneHarmonic:
        """The lowest critical pressures; of a pencil that is not Hermitian the lowest one.

        There, with `film` load on moving plates and n = 1, eigenvalues are complex, and the balloon is
        stable while the lowest real part is positive.

        Args:
            count: how many to look for.
            hint: a guess of the lowest one [Pa].

        Raises:
            EigenError: nothing found where one was proved to be.
        """
        if not self.hermitian:
            return self._of_real_parts()
        p0 = stable_below(lambda p: self._solver(p) is not None, self.limit, hint)
        if p0 in (0.0, math.inf):
            return OneHarmonic((p0,), None, math.nan)
        solve = self._solver(p0)
        assert solve is not None
        K_0 = self.K_m + p0 * self.K_g
        values, vectors = self._own(lambda k: most_negative(self.K_g, K_0, solve, k, self._c), count)
        keep = values < -1 / (self.limit - p0)
        if not keep.any():
            # it lies beyond the limit, or is of another harmonic that the sector cannot tell apart
            if values[0] < 0 or self._sector.columns > 1:
                return OneHarmonic((math.inf,), None, math.nan)
            raise EigenError(f"no critical pressure found near {p0:.6g} Pa, where one was proved to be")
        pressures = tuple(float(p) for p in p0 - 1 / values[keep])
        return self._record(pressures, vectors[:, keep][:, 0])

    def _of_real_parts(self) -> OneHarmonic:
        p0 = stable_below(lambda p: self._lowest(p)[0] > 0, self.limit)
        if p0 in (0.0, math.inf):
            return OneHarmonic((p0,), None, math.nan)
        from scipy.optimize import brentq  # slow to import, and seldom needed

        p: float = brentq(lambda p: self._lowest(p)[0], p0, 1.1 * p0, rtol=1e-12)
        if p > self.limit:
            return OneHarmonic((math.inf,), None, math.nan)
        return self._record((p,), self._lowest(p)[1])

    def _record(self, pressures: tuple[float, ...], x: ComplexArray) -> OneHarmonic:
        """With the residual ||K phi - lambda B phi||/||K_m phi||; lambda is 0 or imaginary."""
        elastic = self.K_m @ x
        K_x, M_x = elastic + pressures[0] * (self.K_g @ x), self.M @ x
        value = 0.0 if self.hermitian else 1j * (np.vdot(x, K_x) / np.vdot(x, M_x)).imag
        rest = K_x - value * M_x
        if self._c is not None:
            rest -= self._c * np.vdot(self._rotation, rest)
        error = np.linalg.norm(rest) / np.linalg.norm(elastic)
        return OneHarmonic(pressures, x, float(error))


def require_prestress(balloon: Balloon) -> None:
    """Refuse a balloon without built-in stress, or whose supports move it, by an InputError."""
    require_drawn(balloon)
    if not balloon.prestressed:
        raise InputError("critical_pressure needs a prestressed balloon; pass prestressed=True")


def pressure_limit(balloon: Balloon) -> float:
    """A pressure [Pa] beyond all reason: N_phi = 10 E t at the equator, a film strain of 1000 %."""
    shape: Any = balloon.surface.lobe
    return 10 * balloon.film.Et / float(shape.meridional_resultant(1.0, shape.R0))


def stable_below(stable: Callable[[float], bool], limit: float, hint: float | None = None) -> float:
    """A pressure [Pa], within a tenth of the lowest critical one, at which the balloon is stable.

    Args:
        stable: whether it is at a pressure, by inertia.
        limit: pressure at which to give up [Pa].
        hint: a guess of the critical pressure [Pa].

    Returns:
        the pressure; 0 where none down to a billionth of the limit is stable, inf where `limit` is. The
        lowest critical one then lies between the pressure and `limit`.
    """
    starts = [*((0.93 * hint, 0.2 * hint) if hint else ()), 1e-6 * limit, 1e-9 * limit]
    low = next((p for p in starts if stable(p)), 0.0)
    if low == 0.0:
        return 0.0
    step = 1.1 if hint and low == starts[0] else 4.0
    high = min(step * low, limit)
    while stable(high):
        if high == limit:
            return math.inf
        low, high = high, min(4 * high, limit)
    while high > 1.1 * low:
        middle = math.sqrt(low * high)
        low, high = (middle, high) if stable(middle) else (low, middle)
    return low if low < limit else math.inf


def fixed_shape_pencil(balloon: Balloon, low: float = 0.0, high: float = 1e5) -> tuple[Any, Any]:
    """K_m and K_g of K(p) = K_m + p K_g at the reference shape, its stress proportional to p.

    Args:
        balloon: with built-in stress.
        low: pressure [Pa] of one of the two tangents that it is made from; 0 is 1 Pa for film that has none
            at rest.
        high: that of the other. Where K is linear in p they do not matter; a high one keeps the
            round-off of K_m's 1e9 N/m out of the difference.

    Raises:
        InputError: film with two tangents, or with hoop slack and one that is not linear in the pressure.

    Collective.
    """
    require_one_tangent(balloon.film, balloon.hoop_slack)
    if balloon.film.turns and balloon.hoop_slack and not low:
        raise InputError(
            f"hoop slack {balloon.hoop_slack:g} makes the stiffness of {type(balloon.film).__name__} film "
            "not linear in the pressure; use slack_critical_pressure of lobefem.stability.one_sided, a "
            "harmonic at a time"
        )
    if not low and not balloon.film.has_tangent_at_rest:
        low = 1.0
    q = balloon.map.create_vector()
    balloon.set_loads(low, low)
    K_m = balloon.tangent(q).copy()
    balloon.set_loads(high, high)
    K_g = balloon.tangent(q).copy()
    K_g.axpy(-1.0, K_m)
    K_g.scale(1 / (high - low))
    if low:
        K_m.axpy(-low, K_g)
    return K_m, K_g
