"""Checks that gas can press on a surface: each edge between two cells, all turned outwards, no hole.

lobefem's own meshes are; this is for those that users bring.
"""

from __future__ import annotations

from typing import Any
from weakref import WeakSet

import numpy as np

from lobefem.errors import InputError
from lobefem.geometry.orientation import CORNERS
from lobefem.geometry.surface import Surface
from lobefem.linalg import dolfinx_compat
from lobefem.typing import Integers, Mesh

from dolfinx.mesh import exterior_facet_indices

__all__ = ["require_manifold", "vouch"]

_vouched: WeakSet[Any] = WeakSet()


def vouch(mesh: Mesh) -> None:
    """Note a mesh of which it is known that its surface is one: it is not examined."""
    _vouched.add(mesh)


def require_manifold(surface: Surface, closed: bool) -> None:
    """Refuse a surface whose parts do not make one film.

    Args:
        surface: a `Surface`, of lobefem's or of a user's own.
        closed: whether end plates close it: then it is in one piece, and its rims are its only free edges.

    Raises:
        InputError: an edge of three cells, neighbours turned to opposite sides, parts that do not hang
            together, or a hole.

    Collective.
    """
    mesh, comm = surface.mesh, surface.mesh.comm
    if mesh in _vouched:
        return
    nodes = dolfinx_compat.geometry_dofmap(mesh)
    corners = nodes[:, CORNERS[nodes.shape[1]]].astype(np.int64)
    directed = np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1).reshape(-1, 2)
    keys = directed @ [len(mesh.geometry.x), 1]
    twice = len(np.unique(keys)) < len(keys)  # neighbours run along a common edge in opposite senses
    if comm.allreduce(int(twice)):
        raise InputError(
            "the mesh has edges of more than two cells, or neighbours turned to opposite sides; give all "
            "cells corners that run anticlockwise as seen from outside"
        )
    if not closed:
        return  # sheets may lie side by side
    parts = _num_parts(mesh, corners)
    if parts > 1:
        raise InputError(f"the mesh falls apart into {parts} pieces; merge the nodes that they should share")
    if surface.copies == 1:
        _require_closed(surface)


def _num_parts(mesh: Mesh, corners: Integers) -> int:
    """Number of pieces that share no node. Collective."""
    # slow to import, and lobefem's own meshes do without
    from scipy import sparse
    from scipy.sparse.csgraph import connected_components

    count = len(mesh.geometry.x)
    first = np.repeat(corners[:, 0], corners.shape[1])
    graph = sparse.coo_array((np.ones(first.size), (first, corners.ravel())), shape=(count, count))
    _, piece = connected_components(graph, directed=False)
    if mesh.comm.size == 1:
        return len(np.unique(piece[corners[:, 0]])) if len(corners) else 0
    # pieces of several ranks are one where they share a ghost cell's nodes
    cells = mesh.topology.index_map(2)
    numbers = mesh.geometry.index_map().local_to_global(np.arange(count, dtype=np.int32))
    mine = np.unique(piece[corners[:, 0]])
    ghosts = np.unique(corners[cells.size_local :])
    links = np.column_stack([piece[ghosts], numbers[ghosts]])
    gathered = mesh.comm.gather((mine, links), root=0)
    found = 0
    if gathered is not None:
        names = {name: k for k, name in enumerate((r, p) for r, (own, _) in enumerate(gathered) for p in own)}
        shared = np.unique(np.concatenate([ends[:, 1] for _, ends in gathered]))
        rows = [names[r, p] for r, (_, ends) in enumerate(gathered) for p in ends[:, 0]]
        columns = np.concatenate([np.searchsorted(shared, ends[:, 1]) for _, ends in gathered]) + len(names)
        size = len(names) + len(shared)
        whole = sparse.coo_array((np.ones(len(rows)), (rows, columns)), shape=(size, size))
        found = connected_components(whole, directed=False)[0]
    return int(mesh.comm.bcast(found, root=0))


def _require_closed(surface: Surface) -> None:
    """Refuse free edges beside the rims. Collective."""
    mesh = surface.mesh
    mesh.topology.create_connectivity(1, 2)
    rims = np.concatenate([surface.facets(n) for n in ("rim_bottom", "rim_top")])
    open_edges = np.setdiff1d(exterior_facet_indices(mesh.topology), rims)
    count = mesh.comm.allreduce(len(open_edges))
    if count:
        raise InputError(
            f"the mesh has {count} free edges beside its two rims, through which gas leaks; close them"
        )
