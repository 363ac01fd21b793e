"""Cells turned to one sense, outwards where the film encloses a volume. NumPy and SciPy only."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from lobefem.errors import InputError
from lobefem.typing import Array, Integers

__all__ = ["CORNERS", "turned"]

# a cell's corners in turn, by the number of its nodes
CORNERS = {3: [0, 1, 2], 4: [0, 1, 3, 2], 6: [0, 1, 2], 9: [0, 1, 3, 2]}


def turned(corners: Integers, points: Array, rims: Sequence[Integers] = ()) -> npt.NDArray[np.bool_]:
    """Cells to reverse so that neighbours agree and normals point out of what the film encloses.

    Film with free edges beside the rims encloses nothing: there the sense of most of its cells is kept.

    Args:
        corners: of each cell in turn (cells, 3 or 4).
        points: nodes (nodes, 3) [m].
        rims: ends of the edges of each rim that a plate closes, (k, 2) each.

    Raises:
        InputError: an edge of three cells, or a film with one side only.
    """
    from scipy import sparse  # slow to import, and lobefem's own meshes do without
    from scipy.sparse.csgraph import breadth_first_order, connected_components

    count, sides = corners.shape
    directed = np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1).reshape(-1, 2)
    cell = np.repeat(np.arange(count), sides)
    keys = np.sort(directed, axis=1) @ [len(points), 1]
    order = np.argsort(keys, kind="stable")
    _, first, times = np.unique(keys[order], return_index=True, return_counts=True)
    if (times > 2).any():
        a, b = directed[order[first[times > 2][0]]]
        middle = ", ".join(f"{v:.4g}" for v in (points[a] + points[b]) / 2)
        raise InputError(
            f"{(times > 2).sum()} edges of the mesh belong to more than two cells, one of them at "
            f"({middle}); keep the film's own cells alone"
        )
    one, two = order[first[times == 2]], order[first[times == 2] + 1]
    odd = directed[one, 0] == directed[two, 0]  # neighbours of opposite senses
    graph = sparse.csr_array((np.ones(2 * len(one)), _both(cell[one], cell[two])), shape=(count, count))
    pieces, piece = connected_components(graph, directed=False)
    pair = {(int(i), int(j)): bool(o) for i, j, o in zip(cell[one], cell[two], odd, strict=True)}
    back = np.zeros(count, dtype=bool)
    for k in range(pieces):
        start = int(np.argmax(piece == k))
        sequence, before = breadth_first_order(graph, start, directed=False)
        for i in sequence[1:].tolist():
            j = int(before[i])
            back[i] = back[j] ^ (pair[i, j] if (i, j) in pair else pair[j, i])
    if (back[cell[one]] ^ back[cell[two]] ^ odd).any():
        raise InputError("the film has one side only, like a Moebius band, so that gas cannot press on it")
    free = order[first[times == 1]]
    closed = {key: number for number, rim in enumerate(rims) for key in _keys(rim, len(points))}
    for k in range(pieces):
        mine = piece == k
        loose = free[mine[cell[free]]]
        rim_of = np.array([closed.get(key, -1) for key in keys[loose].tolist()], dtype=int)
        if (rim_of < 0).any():
            flip = back[mine].sum() > mine.sum() / 2
        else:
            flip = _volume(corners[mine], points, back[mine], directed[loose], rim_of, back[cell[loose]]) < 0
        back[mine] ^= flip
    return back


def _both(i: Integers, j: Integers) -> tuple[Integers, Integers]:
    return np.concatenate([i, j]), np.concatenate([j, i])


def _keys(edges: Integers, count: int) -> list[int]:
    return [int(key) for key in np.sort(edges, axis=1) @ [count, 1]]


def _volume(
    corners: Integers,
    points: Array,
    back: npt.NDArray[np.bool_],
    free: Integers,
    rim_of: Integers,
    free_back: npt.NDArray[np.bool_],
) -> float:
    """Volume within cells and rims, by triangles [m^3]; each rim is closed by a fan about its middle."""
    middle = points[corners].mean(axis=(0, 1))
    x = points[corners] - middle
    fans = sum(
        np.einsum("ni,ni->n", x[:, 0], np.cross(x[:, k], x[:, k + 1])) for k in range(1, corners.shape[1] - 1)
    )
    volume = float((np.where(back, -1.0, 1.0) * fans).sum())
    ends = points[free] - middle
    for rim in np.unique(rim_of):
        own = rim_of == rim
        sign = np.where(free_back[own], 1.0, -1.0)  # a cap runs against its neighbour's edge
        a, b = ends[own, 0], ends[own, 1]
        volume += float((sign * (np.cross(a, b) @ ends[own].mean(axis=(0, 1)))).sum())
    return volume / 6
