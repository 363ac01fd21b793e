"""The whole film on rank 0, and how to look at it: what the figures are drawn from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from lobefem.frozen import Frozen
from lobefem.geometry.axis import across
from lobefem.typing import Array, Integers

if TYPE_CHECKING:
    from lobefem.fem.balloon import Balloon

__all__ = ["FilmMesh", "around", "facing", "film_mesh", "gather", "normals", "outline", "polygons"]


@dataclass(frozen=True)
class FilmMesh(Frozen):
    """The whole film on one rank.

    Attributes:
        x: node positions (nodes, 3), from a point on the axis [m].
        faces: corner nodes of each cell, in order around it (cells, 3 or 4).
        grid: node numbers (rings, around) of a structured mesh, from the bottom and by angle; None
            for an unstructured one.
        axis: unit vector of the balloon's axis (3,).
        fields: the nodal fields that were gathered, each (nodes, 3).
    """

    x: Array
    faces: Integers
    grid: Integers | None
    axis: Array
    fields: tuple[Array, ...]

    @property
    def height(self) -> float:
        """From rim to rim [m]."""
        return float(np.ptp(self.x @ self.axis))

    @property
    def diameter(self) -> float:
        """Twice the largest distance from the axis [m]."""
        e1, e2 = across(self.axis)
        return 2 * float(np.hypot(self.x @ e1, self.x @ e2).max())


def gather(balloon: Balloon, *fields: Array) -> FilmMesh | None:
    """Nodes, cells and nodal fields of all ranks on rank 0, None elsewhere. Collective.

    Args:
        balloon: whose film it is.
        *fields: nodal displacements of this rank (nodes, 3), as kept by states and modes.
    """
    from lobefem.geometry import gather  # what is read from files is drawn without DOLFINx

    nodal = {str(k): gather.at_nodes(balloon.V, field) for k, field in enumerate(fields)}
    whole = gather.gather(balloon.mesh, nodal, {})
    if whole is None:
        return None
    axis = balloon.axis
    return film_mesh(
        whole.x - axis.origin, whole.cells, axis.direction, around(balloon), *whole.nodal.values()
    )


def around(balloon: Balloon) -> int:
    """Nodes around the axis of a structured mesh, 0 of an unstructured one."""
    divisions = balloon.surface.divisions
    return 0 if divisions is None else divisions[1] * balloon.order


def film_mesh(x: Array, cells: Integers, axis: npt.ArrayLike, around: int, *fields: Array) -> FilmMesh:
    """A skin of arrays in any order of nodes.

    Args:
        x: node positions (nodes, 3), from a point on the axis [m].
        cells: nodes of each cell, corners first and in order around it (cells, 3, 4, 6 or 9).
        axis: unit vector (3,).
        around: nodes around the axis of a structured mesh, 0 of an unstructured one.
        *fields: nodal fields, each (nodes, 3).
    """
    axis = np.asarray(axis, dtype=float)
    corners = 3 if cells.shape[1] in (3, 6) else 4
    grid = _grid(x, axis, around) if around else None
    return FilmMesh(x, cells[:, :corners], grid, axis, fields)


def _grid(x: Array, axis: Array, around: int) -> Integers:
    """Node numbers (rings, around) of a structured mesh, which has nodes at equal angles."""
    e1, e2 = across(axis)
    angle = np.arctan2(x @ e2, x @ e1) * around / (2 * np.pi)
    sector = np.round(angle - angle.min()).astype(np.int64) % around
    return np.lexsort((sector, np.round(x @ axis, 6))).reshape(-1, around)


def facing(film_mesh: FilmMesh, field: Array) -> tuple[Array, Array]:
    """The frame across the axis whose first vector is the direction in which the axis moves most.

    Which of a pair's sways the eigensolver returns is arbitrary; so all are seen alike.
    """
    e1, e2 = across(film_mesh.axis)
    if film_mesh.grid is None:
        return e1, e2
    mean = field[film_mesh.grid].mean(axis=1)
    lateral = np.stack([mean @ e1, mean @ e2], axis=1)
    if np.abs(lateral).max() < 0.02 * np.linalg.norm(field, axis=1).max():
        return e1, e2
    c, s = np.linalg.svd(lateral, full_matrices=False)[2][0]
    e1, e2 = c * e1 + s * e2, -s * e1 + c * e2
    largest = mean[np.abs(mean @ e1).argmax()] @ e1
    return (e1, e2) if largest > 0 else (-e1, -e2)


def polygons(film_mesh: FilmMesh, step: int) -> list[Integers]:
    """Polygons to fill: arrays (faces, corners) of blocks of the grid and the two plates, or the cells.

    Args:
        film_mesh: the film.
        step: cells along each side of a block.
    """
    if film_mesh.grid is None:
        return [film_mesh.faces]
    rings, around = film_mesh.grid.shape
    step = step if (rings - 1) % step == 0 and around % step == 0 else 1
    i, j = np.meshgrid(np.arange(0, rings - 1, step), np.arange(0, around, step), indexing="ij")
    walk = [(0, k) for k in range(step)] + [(k, step) for k in range(step)]
    walk += [(step, step - k) for k in range(step)] + [(step - k, 0) for k in range(step)]
    faces = [film_mesh.grid[i + a, (j + b) % around].ravel() for a, b in walk]
    return [np.stack(faces, axis=1), film_mesh.grid[-1:], film_mesh.grid[:1, ::-1]]


def normals(x: Array) -> Array:
    """Unit normals of polygons (faces, corners, 3), from their vector areas."""
    area = np.cross(x, np.roll(x, -1, axis=1)).sum(axis=1)
    return area / np.maximum(np.linalg.norm(area, axis=1, keepdims=True), 1e-300)


def outline(film_mesh: FilmMesh) -> tuple[Array, Array]:
    """Heights and radii of the undeformed shape, a surface of revolution, from bottom to top [m]."""
    e1, e2 = across(film_mesh.axis)
    z, r = film_mesh.x @ film_mesh.axis, np.hypot(film_mesh.x @ e1, film_mesh.x @ e2)
    if film_mesh.grid is not None:
        return z[film_mesh.grid[:, 0]], r[film_mesh.grid[:, 0]]
    bins = np.clip(((z - z.min()) / np.ptp(z) * 60).astype(int), 0, 59)
    used = np.unique(bins)
    return (
        np.array([z[bins == k].mean() for k in used]),
        np.array([r[bins == k].max() for k in used]),
    )
