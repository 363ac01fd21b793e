"""A mesh in surface coordinates: nodes put on the exact surface, cells cut, turned and ordered.

The coordinates of a stack are t, the arc length along the meridian from the bottom rim [m], and
theta, the azimuth [rad]. Whatever Gmsh's spacing was, here the nodes of a structured mesh get
their exact stations, those of an unstructured one their foot on the surface; mid-side nodes are
the mid-points in (t, theta). Serial NumPy: it runs on the rank that ran Gmsh, or, for a grid, on each
rank for its own rows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lobefem.errors import SolveError
from lobefem.frozen import Frozen
from lobefem.geometry.gmsh import Meridian, RawMesh
from lobefem.typing import Array, Integers

__all__ = [
    "SurfaceGrid",
    "grid",
    "place",
    "sector_of",
    "structured_grid",
    "unstructured_grid",
    "with_midpoints",
]

# Edges of a cell in DOLFINx's order, as pairs of its vertices
_EDGES = {3: ((1, 2), (0, 2), (0, 1)), 4: ((0, 1), (0, 2), (1, 3), (2, 3))}


@dataclass(frozen=True)
class SurfaceGrid(Frozen):
    """Nodes and cells in surface coordinates: all of a surface's, or those of some rows of a grid.

    Args:
        t: arc length of each node from the bottom rim [m], shape (n,).
        theta: azimuth of each node [rad], shape (n,).
        cells: nodes in DOLFINx's order, shape (m, nodes per cell), those of a lobe in a row and
            every cell's normal pointing outwards.
        first_cell: first cell of each lobe of the surface, and the number of its cells, (lobes + 1,).
        rings: vertices of the edges of the bottom rim, each seam and the top rim, shape (k, 2).
    """

    t: Array
    theta: Array
    cells: Integers
    first_cell: Integers
    rings: list[Integers]


def structured_grid(
    raw: RawMesh,
    shape: Meridian,
    divisions: tuple[int, int],
    diagonals: str | None,
    grading: float = 0.0,
) -> SurfaceGrid:
    """The `grid` that Gmsh's quadrilaterals are, by row i and column j.

    Raises:
        SolveError: they are not.
    """
    M, N = divisions
    lobes = len(raw.rings) - 1
    rows = lobes * M
    t, theta = _on_surface(raw, shape, steps=1)  # the nearest row and column are all that counts
    row, column = t * M / shape.arc_length, theta * N / (2.0 * np.pi)
    i, j = np.rint(row).astype(np.int64), np.rint(column).astype(np.int64)
    off = max(np.abs(row - i).max(), np.abs(column - j).max())
    # lower left corner of each of Gmsh's cells; columns are counted modulo N
    ci, cj = i[raw.cells], j[raw.cells] % N
    left = (cj[:, 0] + np.min((cj - cj[:, :1] + 1) % N - 1, axis=1)) % N
    found = ci.min(axis=1) * N + left
    if (
        off > 0.25
        or not np.array_equal(np.sort(found), np.arange(rows * N))
        or not np.array_equal(found // (M * N), raw.lobes)
    ):
        raise SolveError(
            f"Gmsh's structured mesh is not the grid of {rows} x {N} cells that was asked for "
            f"(nodes up to {off:.2g} steps off); try other divisions"
        )
    return grid(shape, lobes, divisions, diagonals, grading)


def grid(
    shape: Meridian,
    lobes: int,
    divisions: tuple[int, int],
    diagonals: str | None,
    grading: float = 0.0,
    share: int = 0,
    of: int = 1,
) -> SurfaceGrid:
    """A structured net, or the rows of one of several equal shares.

    Node (i, j) of N columns has the number i N + j and lies at t = i arc_length / M, theta =
    2 pi j / N exactly; with a grading g the rows of each lobe are at (1 - g) x + g sin(pi x/2) in the
    place of x, -1 to 1 over the lobe. With A = (i, j), B = (i, j+1), C = (i+1, j+1), D = (i+1, j) the
    triangles are (A, B, C), (A, C, D), and where `diagonals` is 'alternating' and i + j is odd they are
    (A, B, D), (B, C, D); with None the cells stay quadrilaterals.

    Args:
        shape: one lobe.
        lobes: their number.
        divisions: (M, N), rows of cells in a lobe and columns.
        diagonals: 'same', 'alternating' or None.
        grading: g, 0 for even rows.
        share: which one, from 0; the last one has the top row of nodes besides.
        of: number of shares.
    """
    M, N = divisions
    rows = lobes * M
    first, end = rows * share // of, rows * (share + 1) // of
    i, j = (index.ravel() for index in np.indices((end - first, N)))
    i += first
    right = (j + 1) % N
    A, B, C, D = i * N + j, i * N + right, (i + 1) * N + right, (i + 1) * N + j
    if diagonals is None:
        cells = np.column_stack((A, B, D, C))
    else:
        cells = np.column_stack((A, B, C, A, C, D))
        if diagonals == "alternating":
            odd = (i + j) % 2 == 1
            cells[odd] = np.column_stack((A, B, D, B, C, D))[odd]
        cells = cells.reshape(-1, 3)
    ring = np.column_stack((np.arange(N), (np.arange(N) + 1) % N))
    of_nodes = np.arange(first, end + (share == of - 1))
    along = of_nodes / M
    if grading:
        lobe = np.minimum(of_nodes // M, lobes - 1)
        x = 2 * (along - lobe) - 1
        along = lobe + (1 + (1 - grading) * x + grading * np.sin(np.pi / 2 * x)) / 2
    return SurfaceGrid(
        t=np.repeat(shape.arc_length * along, N),
        theta=np.tile(2.0 * np.pi * np.arange(N) / N, len(of_nodes)),
        cells=cells,
        first_cell=np.arange(lobes + 1) * (M * N * (1 if diagonals is None else 2)),
        rings=[ring + k * M * N for k in range(lobes + 1)],
    )


def sector_of(surface_grid: SurfaceGrid, columns: int, width: int, sectors: int) -> SurfaceGrid:
    """The first sector of a structured net, drawn together to its share of a whole turn.

    Gmsh's turn has few columns of cells, for all are alike; here the first `width` of them become one of
    `sectors` equal parts.

    Args:
        surface_grid: a structured net, linear.
        columns: its columns of cells.
        width: columns of cells in a sector.
        sectors: parts of a whole turn.
    """
    rows = len(surface_grid.t) // columns
    per_lobe = np.diff(surface_grid.first_cell)
    per_cell = int(per_lobe.sum()) // ((rows - 1) * columns)  # two triangles for a quadrilateral
    kept = (np.arange(len(surface_grid.cells)) // per_cell) % columns < width
    number = np.full(len(surface_grid.t), -1, dtype=np.int64)
    nodes = np.flatnonzero(np.arange(len(surface_grid.t)) % columns <= width)
    number[nodes] = np.arange(len(nodes))
    return SurfaceGrid(
        t=surface_grid.t[nodes],
        theta=surface_grid.theta[nodes] * (columns / (width * sectors)),
        cells=number[surface_grid.cells[kept]],
        first_cell=surface_grid.first_cell * width // columns,
        rings=[number[ring[:width]] for ring in surface_grid.rings],
    )


def unstructured_grid(raw: RawMesh, shape: Meridian) -> SurfaceGrid:
    """Turn Gmsh's cells outwards and sort them by lobe; the numbers of the nodes stay."""
    t, theta = _on_surface(raw, shape)
    for k, ring in enumerate(raw.rings):
        t[ring] = k * shape.arc_length
    order = np.argsort(raw.lobes, kind="stable")
    cells = raw.cells[order]
    x = place(shape, len(raw.rings) - 1, t, theta)[cells]
    normal = np.cross(x[:, 1] - x[:, 0], x[:, -1] - x[:, 0])
    inwards = np.einsum("ci,ci->c", normal[:, :2], x[:, :, :2].mean(axis=1)) < 0.0
    cells[inwards] = cells[inwards][:, ::-1]
    _check_closed(cells, raw.rings)
    if cells.shape[1] == 4:
        cells = cells[:, [0, 1, 3, 2]]  # DOLFINx numbers the corners row by row
    lobes = np.arange(len(raw.rings))
    return SurfaceGrid(t, theta, cells, np.searchsorted(raw.lobes[order], lobes), raw.rings)


def with_midpoints(surface_grid: SurfaceGrid) -> SurfaceGrid:
    """Add the nodes of quadratic cells, at mid-points in (t, theta): they lie on the surface.

    The vertices keep their numbers, then come the nodes of edges and, for quadrilaterals, of
    cells. An isoparametric cell then interpolates the exact surface to third order.
    """
    corners = surface_grid.cells.shape[1]
    pairs = np.array(_EDGES[corners])
    edges, edge_of = np.unique(
        np.sort(surface_grid.cells[:, pairs].reshape(-1, 2), axis=1) @ [len(surface_grid.t), 1],
        return_inverse=True,
    )
    ends = np.column_stack(np.divmod(edges, len(surface_grid.t)))
    groups = [ends]
    cells = [surface_grid.cells, len(surface_grid.t) + edge_of.reshape(-1, len(pairs))]
    if corners == 4:
        groups.append(surface_grid.cells)
        cells.append(len(surface_grid.t) + len(ends) + np.arange(len(surface_grid.cells))[:, None])
    t, theta = [surface_grid.t], [surface_grid.theta]
    for nodes in groups:
        t.append(surface_grid.t[nodes].mean(axis=1))
        start = surface_grid.theta[nodes[:, :1]]
        turn = np.remainder(surface_grid.theta[nodes] - start + np.pi, 2.0 * np.pi) - np.pi
        theta.append(start[:, 0] + turn.mean(axis=1))
    return SurfaceGrid(
        t=np.concatenate(t),
        theta=np.concatenate(theta),
        cells=np.concatenate(cells, axis=1),
        first_cell=surface_grid.first_cell,
        rings=surface_grid.rings,
    )


def place(shape: Meridian, lobes: int, t: Array, theta: Array) -> Array:
    """Positions [m], shape (n, 3), of surface coordinates; exact circles at seams and rims."""
    arc = shape.arc_length
    rows, row = np.unique(t, return_inverse=True)  # of a grid all nodes of a row have the same
    lobe = np.clip(np.floor(rows / arc), 0, lobes - 1)
    s = np.clip(rows - (lobe + 0.5) * arc, -0.5 * arc, 0.5 * arc)
    R, z = shape.radius(s), (lobe + 0.5) * shape.height + shape.z(s)
    ring = np.rint(rows / arc)
    on_ring = np.abs(rows - ring * arc) < 1e-12 * arc * (1.0 + ring)
    R[on_ring], z[on_ring] = shape.edge_radius, ring[on_ring] * shape.height
    return np.column_stack((R[row] * np.cos(theta), R[row] * np.sin(theta), z[row]))


def _on_surface(raw: RawMesh, shape: Meridian, steps: int = 6) -> tuple[Array, Array]:
    """Surface coordinates of the foot of each of Gmsh's points."""
    x, y, height = raw.points.T
    lobe = np.clip(np.floor(height / shape.height), 0, len(raw.rings) - 2)
    R, z = np.hypot(x, y), height - (lobe + 0.5) * shape.height
    half = 0.5 * shape.arc_length
    table = shape.stations(256)
    s = np.interp(z, shape.z(table), table)
    for _ in range(steps):  # Gauss-Newton: the points are within the spline's error of the surface
        radial, axial = shape.slope(s)
        s = np.clip(s + (R - shape.radius(s)) * radial + (z - shape.z(s)) * axial, -half, half)
    distance = np.hypot(R - shape.radius(s), z - shape.z(s)).max()
    if distance > 1e-4 * shape.edge_radius:
        raise SolveError(f"Gmsh put a node {distance:.2g} m off the surface; try another mesh")
    return s + (lobe + 0.5) * shape.arc_length, np.remainder(np.arctan2(y, x), 2.0 * np.pi)


def _check_closed(cells: Integers, rings: list[Integers]) -> None:
    """Refuse a mesh with gaps: only rim edges may belong to one cell, seam edges to two."""
    stride = [int(cells.max()) + 1, 1]
    following = np.roll(cells, -1, axis=1)
    directed = np.stack((cells, following), axis=-1).reshape(-1, 2)
    edges, counts = np.unique(np.sort(directed, axis=1) @ stride, return_counts=True)
    rims = np.sort(np.concatenate((rings[0], rings[-1])), axis=1) @ stride
    seams = np.sort(np.concatenate([np.empty((0, 2), np.int64), *rings[1:-1]]), axis=1) @ stride
    turned = np.unique(directed @ stride)  # neighbours run along a common edge in opposite senses
    if (
        counts.max() > 2
        or not np.array_equal(edges[counts == 1], np.unique(rims))
        or not np.all(np.isin(seams, edges[counts == 2]))
        or len(turned) != len(directed)
    ):
        raise SolveError("Gmsh's mesh has gaps or folds; try another size or layout='structured'")
