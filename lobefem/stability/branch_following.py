"""Eigenvalues followed from pressure to pressure by what their modes look like.

The k-th lowest eigenvalue is no curve: where two cross, the order swaps and the modes do not. So each
mode goes on as the one most like it: likeness is the modal assurance criterion (a.M b)^2 of modes of
length 1 (Allemang 2003), M the mass. (Nearly) equal eigenvalues leave the vectors in their eigenspace
undetermined, so there the likeness is that to the whole space, |P a|^2, the squared cosine of the
angle between them, and what goes on is the space's own basis turned to the former vectors.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from lobefem.frozen import Frozen
from lobefem.typing import Array

if TYPE_CHECKING:
    from lobefem.stability.mode_records import Modes

__all__ = ["Branch", "follow", "unclear"]

# an angle of 45 degrees: modes of a symmetric tangent are orthogonal, so no two can claim one
_LEAST = 0.5


@dataclass(frozen=True)
class Branch(Frozen):
    """One eigenvalue followed over the pressure; of those equal all along, such as a pair's, one.

    Attributes:
        kind: "sway", "twist", "global", "local" or "rigid rotation", as of `Mode`; that of most of its modes.
        harmonic: n, likewise.
        rank: 0 for the lowest branch of its kind and harmonic where it begins, and so on; those over
            less than half of the pressures come last.
        pressures: ascending, shape (points,) [Pa].
        values: real parts of lambda, shape (points,) [Pa/m with unit mass, N/m with nodal mass].
        members: at each pressure the indices in `Modes` of its modes; none if not made from `Modes`.
        mac: the least |P a|^2 from one pressure to the next.
    """

    kind: str
    harmonic: int
    rank: int
    pressures: Array
    values: Array
    members: tuple[tuple[int, ...], ...] = ()
    mac: float = 1.0

    @property
    def name(self) -> str:
        """Such as "sway, n = 1"; "(2)" marks the second one of its kind."""
        return f"{self.kind}, n = {self.harmonic}" + (f" ({self.rank + 1})" if self.rank else "")


@dataclass
class _Track:
    """One mode on its way."""

    pressures: list[float] = field(default_factory=list)
    members: list[int] = field(default_factory=list)
    values: list[complex] = field(default_factory=list)
    looks: list[tuple[str, int]] = field(default_factory=list)
    mac: float = 1.0


def follow(sweep: Sequence[Modes]) -> list[Branch]:
    """Sort the modes at some pressures into branches, by likeness.

    A branch begins and ends where its mode enters and leaves the computed lowest ones. It may cross
    others. Two that avoid each other swap their characters: steps finer than that show it as two
    curves that bend, coarser ones as a crossing.

    Args:
        sweep: the lowest modes of one balloon at some pressures, in any order.

    Collective.
    """
    tracks: list[_Track] = []
    active: list[_Track] = []
    vectors: Array = np.zeros((0, 0))
    for modes in sorted(sweep, key=lambda m: m.state.pressure):
        spaces = _spaces(modes)
        found: list[tuple[_Track, Array]] = []
        taken = _match(modes, vectors, spaces)
        for k, space in enumerate(spaces):
            before = [(i, mac) for i, (at, mac) in taken.items() if at == k]
            basis, continued = _turned(modes, space, vectors[:, [i for i, _ in before]])
            ways = [active[i] for i, _ in before]
            for way, (_, mac) in zip(ways, before, strict=True):
                way.mac = min(way.mac, mac)
            new = [_Track() for _ in range(basis.shape[1] - continued)]
            tracks += new
            share = _inner(modes, space.fields, basis) ** 2
            for member, way_at in _assigned(share):
                _put([*ways, *new][way_at], modes, space.members[member])
            found += zip([*ways, *new], basis.T, strict=True)
        active = [track for track, _ in found]
        vectors = np.array([vector for _, vector in found]).T
    return _branches(tracks)


def unclear(first: Modes, second: Modes) -> bool:
    """True if a mode went on into several, so that a smaller step would tell more.

    That is one which the second modes hold (by more than 0.8), but none of their eigenspaces alone
    (by 0.6). Collective.
    """
    mac = _mac(second, _normed(first, _fields(first)), _spaces(second))
    if not mac.size:
        return False
    return bool(((mac.max(axis=1) < 0.6) & (mac.sum(axis=1) > 0.8)).any())


# --- the geometry of modes ----------------------------------------------------------------------
@dataclass(frozen=True)
class _Space(Frozen):
    """An eigenspace: indices of its modes, those as columns of length 1, and an orthonormal basis."""

    members: tuple[int, ...]
    fields: Array
    basis: Array


def _fields(modes: Modes) -> Array:
    """Nodal displacements that this rank owns, one column a mode; of conjugates x + i y, x and y."""
    owned = 3 * modes.state.balloon.V.dofmap.index_map.size_local
    columns = [m.displacement if m.value.imag >= 0 else m.displacement_imag for m in modes.modes]
    return np.array([column.ravel()[:owned] for column in columns]).T


def _inner(modes: Modes, a: Array, b: Array) -> Array:
    """a^T M b with the mass of the modes. Collective."""
    balloon = modes.state.balloon
    weighted = b.copy()
    if modes.mass == "unit":
        M = balloon.mass_matrix()
        x, y = M.createVecs()
        for column in weighted.T:
            x.array[:] = column
            M.mult(x, y)
            column[:] = y.array_r
    return balloon.comm.allreduce(a.T @ weighted)


def _normed(modes: Modes, fields: Array) -> Array:
    return fields / np.sqrt(np.diag(_inner(modes, fields, fields)))


def _spaces(modes: Modes) -> list[_Space]:
    """Eigenspaces of values that are equal to a thousandth, conjugate ones taken together. Collective."""
    fields = _normed(modes, _fields(modes))
    values = modes.values
    floor = 1e-6 * np.abs(values).max(initial=0.0)
    groups: list[list[int]] = []
    for i, value in enumerate(values):
        # sorted by real part: an equal one is in one of the last groups
        for group in groups[-3:]:
            other = values[group[-1]]
            distance = abs(complex(other.real, abs(other.imag)) - complex(value.real, abs(value.imag)))
            if distance <= 1e-3 * abs(value) + floor:
                group.append(i)
                break
        else:
            groups.append([i])
    result = []
    for group in groups:
        columns = fields[:, group]
        power, turn = np.linalg.eigh(_inner(modes, columns, columns))
        # the orthonormal basis nearest to the modes
        basis = columns @ (turn / np.sqrt(power)) @ turn.T
        result.append(_Space(tuple(group), columns, basis))
    return result


def _mac(modes: Modes, vectors: Array, spaces: Sequence[_Space]) -> Array:
    """|P a|^2 of each vector (rows) in each space (columns). Collective."""
    if not vectors.shape[1]:
        return np.zeros((0, len(spaces)))
    components = _inner(modes, np.hstack([s.basis for s in spaces]), vectors) ** 2
    starts = np.cumsum([0] + [len(s.members) for s in spaces[:-1]])
    return np.add.reduceat(components, starts, axis=0).T


def _assigned(share: Array) -> list[tuple[int, int]]:
    """Pairs of rows and columns, each at most once, with the largest sum."""
    from scipy.optimize import linear_sum_assignment  # slow to import

    rows, columns = linear_sum_assignment(share, maximize=True)
    return [(int(i), int(j)) for i, j in zip(rows, columns, strict=True)]


def _match(modes: Modes, vectors: Array, spaces: Sequence[_Space]) -> dict[int, tuple[int, float]]:
    """Space and likeness of each former vector that goes on; a space takes as many as it has modes."""
    mac = _mac(modes, vectors, spaces)
    places = np.repeat(np.arange(len(spaces)), [len(s.members) for s in spaces])
    pairs = {i: (int(places[j]), float(mac[i, places[j]])) for i, j in _assigned(mac[:, places])}
    return {i: pair for i, pair in pairs.items() if pair[1] >= _LEAST}


def _turned(modes: Modes, space: _Space, former: Array) -> tuple[Array, int]:
    """The space's basis turned to the former vectors as far as those go, and their number. Collective."""
    count = former.shape[1]
    if not count:
        return space.basis, 0
    left, _, right = np.linalg.svd(_inner(modes, space.basis, former))
    onto = np.hstack([left[:, :count] @ right, left[:, count:]])
    return space.basis @ onto, count


# --- from modes on their way to branches --------------------------------------------------------
def _put(track: _Track, modes: Modes, member: int) -> None:
    mode = modes[member]
    track.pressures.append(modes.state.pressure)
    track.members.append(member)
    track.values.append(mode.value)
    track.looks.append((mode.kind, mode.harmonic))


def _branches(tracks: Sequence[_Track]) -> list[Branch]:
    """Tracks of equal values made one, named and ranked."""
    scale = max((abs(v) for t in tracks for v in t.values), default=0.0)
    groups: list[list[_Track]] = []
    # the longest first: at the end of the window a pair may have lost its other one
    for track in sorted(tracks, key=lambda t: -len(t.pressures)):
        for group in groups:
            if _equal(group[0], track, 1e-6 * scale):
                group.append(track)
                break
        else:
            groups.append([track])
    longest = max((len(t.pressures) for t in tracks), default=0)
    groups.sort(key=lambda g: (2 * len(g[0].pressures) < longest, g[0].pressures[0], g[0].values[0].real))
    ranks: Counter[Any] = Counter()
    result = []
    for group in groups:
        first = group[0]
        (kind, harmonic), _ = Counter(sorted(first.looks)).most_common(1)[0]
        at: dict[float, list[int]] = {p: [] for p in first.pressures}
        for track in group:
            for pressure, member in zip(track.pressures, track.members, strict=True):
                at[pressure].append(member)
        result.append(
            Branch(
                kind,
                harmonic,
                ranks[kind, harmonic],
                np.array(first.pressures),
                np.array([v.real for v in first.values]),
                tuple(tuple(sorted(members)) for members in at.values()),
                min(track.mac for track in group),
            )
        )
        ranks[kind, harmonic] += 1
    return sorted(result, key=lambda b: (b.kind, b.harmonic, b.rank))


def _equal(whole: _Track, part: _Track, floor: float) -> bool:
    """True if a track has the values of another one at all of its pressures."""
    values = dict(zip(whole.pressures, whole.values, strict=True))
    return all(
        p in values and abs(values[p].real - v.real) <= floor + 1e-5 * abs(v.real)
        for p, v in zip(part.pressures, part.values, strict=True)
    )
