"""From coarse to fine: a balloon on a mesh half as fine, and its displacement taken over to the finer one.

The equilibrium on the coarser mesh is a start for Newton's method on the finer one from which, on any
mesh, a few steps lead to the answer; it costs about a quarter. Structured meshes nest: nodes lie on a
grid of stations along the meridian and azimuths, and every other one is a node of the coarser mesh.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from lobefem import _net
from lobefem.balloon import Balloon
from lobefem.surface import coarser

__all__ = ["coarser_balloon", "interpolate"]

Array = npt.NDArray[np.float64]

_WORTH = 4000  # nodes of a mesh above which a coarser one saves time
_PER_RANK = 1000  # nodes on a rank below which a coarser mesh does not


def coarser_balloon(balloon: Balloon) -> Balloon | None:
    """The same balloon with half the divisions both ways; None where that cannot be had or saves nothing.

    Contact, guides, and what is bound to the mesh (a frame or a load path of the user's) are for one mesh
    only.

    Collective.
    """
    nodes = balloon.V.dofmap.index_map.size_global
    bound = (balloon.contact, balloon.guide, balloon.given_frame, balloon.load_path)
    if any(part is not None for part in bound) or nodes <= max(_WORTH, _PER_RANK * balloon.comm.size):
        return None
    surface = coarser(balloon.surface)
    return balloon.on(surface) if surface is not None else None


def interpolate(coarse: Balloon, q: Any, balloon: Balloon) -> Any:
    """The unknowns of a balloon from those of `coarser_balloon`. Collective.

    Displacements between the coarse nodes are cubic in the radial, hoop and axial components, lobe by
    lobe, for the meridian is bent at a seam; plates move as they do there. Every rank gets the whole coarse
    field: 24 bytes a node.

    Args:
        coarse: the coarser balloon.
        q: its unknowns.
        balloon: the finer one, its displacement is overwritten.
    """
    coarse.place(q)
    row, column, shape = _places(coarse)
    owned = coarse.map.owned // 3
    field = np.zeros((*shape, 3))
    field[row[:owned], column[:owned]] = coarse.u.x.array.reshape(-1, 3)[:owned]
    coarse.comm.Allreduce(field.copy(), field)

    turned = _turn(field, -1)
    fine = _turn(_between(_around(turned), coarse.surface.num_lobes), 1)
    row, column, _ = _places(balloon)
    balloon.u.x.array[:] = fine[row, column].ravel()
    w, _, _ = coarse.map.plate_parameters(coarse.map.parameters(q))
    return balloon.map.unknowns(balloon.u, w)


def _places(balloon: Balloon) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], tuple[int, int]]:
    """Row and column of each node of this rank in the grid, and the grid's shape."""
    surface, x = balloon.surface, balloon.V.tabulate_dof_coordinates()
    along, around = (balloon.order * count for count in surface.divisions)
    t = surface.shape.arc_length / along * np.arange(surface.num_lobes * along + 1)
    heights = _net.place(surface.shape, surface.num_lobes, t, np.zeros_like(t))[:, 2]
    row = np.searchsorted((heights[1:] + heights[:-1]) / 2, x[:, 2])
    column = np.rint(np.arctan2(x[:, 1], x[:, 0]) * around / (2 * np.pi)).astype(np.int64) % around
    return row, column, (len(t), around)


def _turn(field: Array, sign: int) -> Array:
    """Cartesian components of cylindrical ones (sign 1), or the other way round (-1)."""
    theta = sign * 2 * np.pi / field.shape[1] * np.arange(field.shape[1])
    c, s = np.cos(theta), np.sin(theta)
    x, y, z = np.moveaxis(field, -1, 0)
    return np.stack((c * x - s * y, s * x + c * y, z), axis=-1)


def _around(field: Array) -> Array:
    """Twice the columns, which close upon themselves."""
    before, after = np.roll(field, 1, axis=1), np.roll(field, -1, axis=1)
    out = np.repeat(field, 2, axis=1)
    out[:, 1::2] = (9 * (field + after) - before - np.roll(field, -2, axis=1)) / 16
    return out


def _between(field: Array, lobes: int) -> Array:
    """Twice the rows of cells, lobe by lobe."""
    cells = (len(field) - 1) // lobes
    g = field[np.arange(lobes)[:, None] * cells + np.arange(cells + 1)]
    middle = (g[:, 1:] + g[:, :-1]) / 2
    middle[:, 1:-1] = (9 * (g[:, 1:-2] + g[:, 2:-1]) - g[:, :-3] - g[:, 3:]) / 16
    middle[:, 0] = (3 * g[:, 0] + 6 * g[:, 1] - g[:, 2]) / 8
    middle[:, -1] = (3 * g[:, -1] + 6 * g[:, -2] - g[:, -3]) / 8
    out = np.repeat(field, 2, axis=0)[:-1]
    out[1::2] = middle.reshape(lobes * cells, *field.shape[1:])
    return out
