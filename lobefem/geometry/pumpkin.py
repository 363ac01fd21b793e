"""Surfaces of pumpkin balloons, all gores or one of them, on a structured grid.

Tendon k lies at the azimuth 2 pi (k - 1)/N, gore k between it and the next one; the axis is the z axis. One
gore has two tendons, of which the second one is the first of the next gore. Every gore is the first one
rotated, and its grid is its own mirror image.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from lobefem import checks
from lobefem.errors import InputError
from lobefem.frozen import Frozen
from lobefem.geometry import distribute
from lobefem.geometry.gore import Gore
from lobefem.geometry.surface import Surface
from lobefem.log import logger
from lobefem.profiling import timed
from lobefem.typing import Array, Comm, Integers

from dolfinx import fem
from mpi4py import MPI

__all__ = ["GoreGrid", "PumpkinRecipe", "gore_grid"]

_NADIR, _APEX, _TENDON = 1, 2, 10


@dataclass(frozen=True)
class GoreGrid(Frozen):
    """Nodes and cells of one gore in its own coordinates.

    Attributes:
        s: arc length of each node along the tendon [m] (n,).
        xi: place of each node across, -1 to 1 (n,).
        cells: nodes in DOLFINx's order (m, nodes per cell), normals outwards.
        rows, columns: nodes along and across, mid-side ones included; node (i, j) has the number i columns +
        j.
    """

    s: Array
    xi: Array
    cells: Integers
    rows: int
    columns: int


def gore_grid(length: float, divisions: tuple[int, int], cell: str, order: int, grading: float) -> GoreGrid:
    """The grid of one gore.

    Args:
        length: of the tendon [m].
        divisions: rows and columns of cells; an even number of columns for triangles, whose diagonals are
            mirrored about the gore's middle.
        cell: "triangle" or "quadrilateral".
        order: 1 or 2.
        grading: how much closer rows are at the fittings, 0 (even) to 0.95.
    """
    rows, columns = order * divisions[0] + 1, order * divisions[1] + 1
    x = np.linspace(-1.0, 1.0, rows)
    s = length * (1 + (1 - grading) * x + grading * np.sin(np.pi * x / 2)) / 2
    xi = np.linspace(-1.0, 1.0, columns)
    i = np.repeat(order * np.arange(divisions[0]), divisions[1])
    j = np.tile(order * np.arange(divisions[1]), divisions[0])

    def node(di: int, dj: int) -> Integers:
        """Nodes at half steps from the corners of all cells."""
        return (i + di * order // 2) * columns + j + dj * order // 2

    a, b, c, d = node(0, 0), node(0, 2), node(2, 0), node(2, 2)
    if cell == "quadrilateral":
        nodes = [a, b, c, d]
        if order == 2:
            nodes += [node(0, 1), node(1, 0), node(1, 2), node(2, 1), node(1, 1)]
        cells = np.stack(nodes, axis=1)
    else:
        left = j < order * divisions[1] // 2
        middle = node(1, 1)
        first = np.where(left[:, None], np.stack([a, b, d], axis=1), np.stack([a, b, c], axis=1))
        second = np.where(left[:, None], np.stack([a, d, c], axis=1), np.stack([b, d, c], axis=1))
        if order == 2:
            bottom, west, east, top = node(0, 1), node(1, 0), node(1, 2), node(2, 1)
            first = np.hstack(
                [
                    first,
                    np.where(
                        left[:, None],
                        np.stack([east, middle, bottom], 1),
                        np.stack([middle, west, bottom], 1),
                    ),
                ]
            )
            second = np.hstack(
                [
                    second,
                    np.where(
                        left[:, None], np.stack([top, west, middle], 1), np.stack([top, middle, east], 1)
                    ),
                ]
            )
        cells = np.stack([first, second], axis=1).reshape(2 * len(i), -1)
    return GoreGrid(np.repeat(s, columns), np.tile(xi, rows), cells, rows, columns)


@dataclass(frozen=True)
class PumpkinRecipe:
    """From what a pumpkin's surface is made.

    Args:
        gore: its shape.
        divisions: rows and columns of cells of a gore, at least (4, 2).
        cell: "triangle" or "quadrilateral".
        order: degree of the geometry, 1 or 2.
        grading: how much closer rows are at the fittings, 0 (even) to 0.95.
        full: True for all gores, False for one.

    Raises:
        InputError: an argument that cannot be used.
    """

    gore: Gore
    divisions: tuple[int, int] = (48, 8)
    cell: str = "quadrilateral"
    order: int = 2
    grading: float = 0.0
    full: bool = False

    def __post_init__(self) -> None:
        checks.one_of("cell", self.cell, ("triangle", "quadrilateral"))
        if checks.integer("the geometry's order", self.order, 1) > 2:
            raise InputError(f"the geometry's order is {self.order}; give 1 or 2")
        rows, columns = checks.integers("a number of divisions", self.divisions, 1)
        if rows < 4 or columns < 2 or (self.cell == "triangle" and columns % 2):
            raise InputError(
                f"divisions = {rows} x {columns} of a gore: give 4 rows and 2 columns at least, and an even "
                "number of columns for triangles"
            )
        if not 0 <= self.grading <= 0.95:
            raise InputError(f"grading = {self.grading} must lie in [0, 0.95]")

    @property
    def grid(self) -> GoreGrid:
        """Nodes and cells of one gore."""
        return gore_grid(self.gore.curve.arc_length, self.divisions, self.cell, self.order, self.grading)

    @timed("mesh")
    def surface(self, comm: Comm = MPI.COMM_WORLD) -> Surface:
        """Mesh one gore, whole on every rank, or all of them. Collective.

        The groups are gore_1, ..., tendon_1, ..., nadir and apex (also rim_bottom and rim_top).

        Args:
            comm: MPI communicator of all gores.
        """
        grid, count, full = self.grid, self.gore.count, self.full
        comm = comm if full else MPI.COMM_SELF
        mine, gores = comm.rank == 0, count if full else 1
        x, cells = _assembled(self.gore, grid, full) if mine else (None, None)
        mesh = distribute.distribute_mesh(comm, self.cell, self.order, x, cells)
        mesh.name = "film"
        lines, values = _edges(grid, gores, self.order, full)
        groups = {f"gore_{k}": (2, k) for k in range(1, gores + 1)}
        groups |= {f"tendon_{k + 1}": (1, _TENDON + k + 1) for k in range(gores if full else 2)}
        groups |= dict.fromkeys(("nadir", "rim_bottom"), (1, _NADIR))
        groups |= dict.fromkeys(("apex", "rim_top"), (1, _APEX))
        num_nodes = comm.bcast(None if x is None else len(x))
        logger.info("meshed %d gore(s): %d nodes", gores, num_nodes)
        return Surface(
            mesh=mesh,
            lobes=distribute.lobe_tags(mesh, np.arange(gores + 1) * len(grid.cells)),
            edges=distribute.edge_tags(mesh, lines, values, num_nodes),
            groups=groups,
            axis=np.array([0.0, 0.0, 1.0]),
            origin=np.zeros(3),
            cyclic_order=count,
            num_lobes=gores,
            copies=1 if full else count,
            recipe=self,
        )

    def pattern(self, surface: Surface) -> Any:
        """Coordinates of the flat gores as a function of a surface's mesh [m], each gore with its own.

        Args:
            surface: made by this recipe.
        """
        flat = self.gore.pattern(self.grid.s, self.grid.xi)
        return self._on_gores(surface, flat, "pattern")

    def widening(self, surface: Surface, growth: Callable[[Array], Array]) -> Any:
        """The change of `pattern` as the flat gores grow wider: a direction for a derivative by it [m].

        Args:
            surface: made by this recipe.
            growth: of the half-width [m] at shares of the tendon's length, 0 at the bottom (n,).
        """
        grid = self.grid
        shares: Any = grid.s / self.gore.curve.arc_length
        wider: Any = np.asarray(growth(shares), dtype=np.float64)
        if wider.shape != grid.s.shape or not np.isfinite(wider).all():
            raise InputError(
                f"growth returns {wider.shape} for {grid.s.shape} shares of a gore; return a finite "
                "number of metres for each"
            )
        return self._on_gores(surface, np.stack([0 * wider, wider * grid.xi], axis=1), "widening")

    def _on_gores(self, surface: Surface, flat: Array, name: str) -> Any:
        """A function on each gore from its values at the nodes of one (n, 2)."""
        mesh, grid = surface.mesh, self.grid
        V = fem.functionspace(mesh, ("DG", self.order, (2,)))
        pattern = fem.Function(V, name=name)
        # cells keep the order of their nodes, which is that of the element's degrees of freedom
        cells = np.asarray(mesh.topology.original_cell_index) % len(grid.cells)
        nodes = grid.cells[cells]
        pattern.x.array.reshape(-1, 2)[V.dofmap.list.ravel()] = flat[nodes].reshape(-1, 2)
        return pattern


def _assembled(gore: Gore, grid: GoreGrid, closed: bool) -> tuple[Array, Integers]:
    """Nodes (n, 3) and cells of one gore, or of all; neighbours share the nodes of their tendon."""
    x, gores = gore.position(grid.s, grid.xi), gore.count
    if not closed:
        return x, grid.cells
    width = grid.columns - 1  # of a gore without its far tendon
    number = np.arange(grid.rows)[:, None] * (gores * width) + np.arange(grid.columns)
    cells = []
    places = np.empty((grid.rows * gores * width, 3))
    for k in range(gores):
        own = np.where(
            np.arange(grid.columns) < width, number + k * width, number - width + ((k + 1) % gores) * width
        )
        angle = 2 * math.pi * k / gores
        c, s = math.cos(angle), math.sin(angle)
        turned = x @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        places[own[:, :width].ravel()] = turned.reshape(grid.rows, grid.columns, 3)[:, :width].reshape(-1, 3)
        cells.append(own.ravel()[grid.cells])
    return places, np.concatenate(cells)


def _edges(grid: GoreGrid, gores: int, order: int, closed: bool) -> tuple[list[Integers], list[int]]:
    """Ends of the edges of fittings and tendons, with a value for each line."""
    width = gores * (grid.columns - 1) if closed else grid.columns
    i, j = order * np.arange((grid.rows - 1) // order + 1), np.arange(0, width + (1 if closed else 0), order)
    ring = np.column_stack([j[:-1], j[1:] % width])
    lines, values = [ring, ring + i[-1] * width], [_NADIR, _APEX]
    step = grid.columns - 1
    for k in range(gores if closed else 2):
        nodes = i * width + k * step
        lines.append(np.column_stack([nodes[:-1], nodes[1:]]))
        values.append(_TENDON + 1 + k)
    return lines, values
