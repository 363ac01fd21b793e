"""From coarse to fine: a balloon on a mesh half as fine, and its displacement taken over to the finer one.

The equilibrium on the coarser mesh is a start for Newton's method on the finer one from which, on any
mesh, a few steps lead to the answer; it costs about a quarter. Structured meshes nest: nodes lie on a
grid of stations along the meridian and azimuths, and every other one is a node of the coarser mesh.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from lobefem.fem.balloon import Balloon
from lobefem.geometry import grid
from lobefem.geometry.stacks import coarser
from lobefem.typing import Array, Integers, Vec

from petsc4py import PETSc

__all__ = ["coarser_balloon", "interpolate"]

# weights of four coarse nodes in a row: at the second one, half-way to the third, half-way from the first
# one of a lobe to its second
_SAME = np.array([0.0, 1.0, 0.0, 0.0])

_MIDDLE = np.array([-1.0, 9.0, 9.0, -1.0]) / 16

_FIRST = np.array([3.0, 6.0, -1.0, 0.0]) / 8

_WORTH = 4000  # nodes of a mesh above which a coarser one saves time

_PER_RANK = 1000  # nodes on a rank below which a coarser mesh does not


def coarser_balloon(balloon: Balloon, above: int | None = None) -> Balloon | None:
    """The same balloon with half the divisions both ways; None where that cannot be had or saves nothing.

    Contact, guides, and what is bound to the mesh (a frame of the user's, say) are for one mesh only.

    Args:
        balloon: on the finer mesh.
        above: nodes above which a coarser mesh saves time; by default some thousands, more on many ranks.

    Collective.
    """
    nodes = balloon.V.dofmap.index_map.size_global
    bound = (
        balloon.specification.bound_to_mesh or balloon.contact is not None or balloon.prescribed is not None
    )
    if bound or nodes <= (max(_WORTH, _PER_RANK * balloon.comm.size) if above is None else above):
        return None
    surface = coarser(balloon.surface, balloon.axis)
    return balloon.remeshed(surface) if surface is not None else None


def interpolate(coarse: Balloon, q: Vec, balloon: Balloon) -> Any:
    """The unknowns of a balloon from those of `coarser_balloon`. Collective.

    Displacements between the coarse nodes are cubic in the radial, hoop and axial components, lobe by
    lobe, for the meridian is bent at a seam; plates move as they do there. Each rank gets the coarse nodes
    about its own.

    Args:
        coarse: the coarser balloon.
        q: its unknowns.
        balloon: the finer one, its displacement is overwritten.
    """
    coarse.set_unknowns(q)
    row, column, around = _places(coarse)
    fine_row, fine_column, _ = _places(balloon)
    cells = coarse.order * _divisions(coarse)[0]
    rows, row_weights = _within_lobe(fine_row, cells)
    columns, column_weights = _around(fine_column, around)
    at = (rows[:, :, None] * around + columns[:, None, :]).reshape(-1, 16)
    count = (coarse.surface.num_lobes * cells + 1) * around
    wanted = np.zeros(count, dtype=bool)
    wanted[at] = True
    needed = np.flatnonzero(wanted)
    values = _collect(coarse, row * around + column, needed, count)
    # radial, hoop and axial components, each at its own node's azimuth
    basis = balloon.axis.basis
    values = _turned(values @ basis.T, -2 * np.pi / around * (needed % around))
    weights = (row_weights[:, :, None] * column_weights[:, None, :]).reshape(-1, 16)
    local = np.cumsum(wanted) - 1
    found: Array = np.zeros((len(at), 3))
    for k in range(16):  # all at once take more memory and time
        found += weights[:, k, None] * values[local[at[:, k]]]
    found = _turned(found, np.pi / around * fine_column) @ basis
    balloon.u.x.array[: balloon.map.owned] = found.ravel()
    balloon.u.x.scatter_forward()
    w, _, _ = coarse.map.plate_parameters(coarse.map.parameters(q))
    return balloon.map.unknowns(balloon.u, w)


def _turned(vectors: Array, angle: npt.NDArray[np.floating[Any]]) -> Array:
    """Vectors (n, 3) turned about the third axis by angles (n,) [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = vectors.T
    return np.stack([c * x - s * y, s * x + c * y, z], axis=-1)


def _collect(coarse: Balloon, places: Integers, needed: Integers, count: int) -> Array:
    """Displacements (n, 3) of nodes by their place in the grid, from the ranks that own them. Collective."""
    field: Any = PETSc.Vec().createMPI(3 * count, bsize=3, comm=coarse.comm)
    field.setValuesBlocked(places.astype(PETSc.IntType), coarse.u.x.array[: coarse.map.owned])
    field.assemble()
    found = PETSc.Vec().createSeq(3 * len(needed), bsize=3)
    chosen: Any = PETSc.IS()
    chosen.createBlock(3, needed.astype(PETSc.IntType), comm=PETSc.COMM_SELF)
    scatter: Any = PETSc.Scatter()
    scatter.create(field, chosen, found, None)
    scatter.scatter(field, found)
    for made in (scatter, chosen, field):
        made.destroy()
    return found.array_r.reshape(-1, 3)


def _divisions(balloon: Balloon) -> tuple[int, int]:
    """Divisions of the grid."""
    divisions = balloon.surface.divisions
    assert divisions is not None  # of a surface that has a coarser one
    return divisions


def _heights(balloon: Balloon) -> Array:
    """Heights of the grid's rows [m]."""
    surface = balloon.surface
    along = balloon.order * _divisions(balloon)[0]
    shape = surface.shape
    assert shape is not None  # of a surface that has a coarser one
    t = np.asarray(shape.arc_length / along * np.arange(surface.num_lobes * along + 1), dtype=np.float64)
    return grid.place(shape, surface.num_lobes, t, np.zeros_like(t))[:, 2]


def _places(balloon: Balloon) -> tuple[Integers, Integers, int]:
    """Row and column in the grid of each node that this rank owns, and the grid's columns."""
    heights = _heights(balloon)
    angle, height, _, _ = balloon.axis.cylindrical(balloon.X[: balloon.map.owned // 3])
    around = balloon.order * _divisions(balloon)[1]
    row = np.searchsorted((heights[1:] + heights[:-1]) / 2, height)
    column = np.rint(angle * around / (2 * np.pi)).astype(np.int64) % around
    return row, column, around


def _around(J: Integers, around: int) -> tuple[Integers, Array]:
    """Four columns of the coarse grid, which close upon themselves, and their weights for fine ones J."""
    columns = (J[:, None] // 2 + np.array([-1, 0, 1, 2])) % around
    return columns, np.where(J[:, None] % 2, _MIDDLE, _SAME)


def _within_lobe(I: Integers, cells: int) -> tuple[Integers, Array]:  # noqa: E741
    """Four rows of the coarse grid, of one lobe, and their weights for fine rows I.

    Args:
        I: fine rows.
        cells: rows of cells of a lobe in the coarse grid, at least 3.
    """
    lobe = np.maximum(I - 1, 0) // (2 * cells)
    i = I - 2 * cells * lobe
    weights = np.where(i[:, None] % 2, _MIDDLE, _SAME)
    weights[i == 1] = _FIRST
    weights[i == 2 * cells - 1] = _FIRST[::-1]
    # next to an edge of the lobe the four are those at the edge
    first = np.clip(i // 2 - 1, 0, cells - 3)
    shift = i // 2 - 1 - first
    even = i % 2 == 0
    weights[even] = np.eye(4)[(1 + shift)[even]]
    return (lobe * cells + first)[:, None] + np.arange(4), weights
