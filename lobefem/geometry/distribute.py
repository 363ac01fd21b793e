"""From the ranks that made a mesh, mostly the one that ran Gmsh, to all: the distributed mesh and its tags.

Tags need no messages about entities: DOLFINx remembers under which number every cell and every
node was handed over.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from lobefem.errors import LobefemError, SolveError
from lobefem.linalg import dolfinx_compat
from lobefem.typing import Comm, Integers

import basix.ufl
from dolfinx.mesh import Mesh, MeshTags, meshtags

__all__ = ["distribute_mesh", "edge_tags", "lobe_tags", "on_root"]


def on_root[T](
    comm: Comm,
    build: Callable[[], T],
    failed: str = "Gmsh could not mesh the surface ({}); try another mesh size",
) -> T | None:
    """Build on rank 0, None elsewhere; what goes wrong there is raised on every rank. Collective.

    Args:
        comm: MPI communicator.
        build: called on rank 0.
        failed: what to say, with the error in place of {}, where `build` raised no `LobefemError`.

    Raises:
        SolveError: rank 0 failed (or whichever `LobefemError` it raised itself).
    """
    result, error = None, None
    if comm.rank == 0:
        try:
            result = build()
        except LobefemError as caught:
            error = caught
        except Exception as caught:  # Gmsh raises plain Exception with its last message
            error = SolveError(failed.format(caught))
            error.__cause__ = caught
    failure = comm.bcast(None if error is None else (type(error), str(error)), root=0)
    if error is not None:
        raise error
    if failure is not None:
        kind, text = failure
        raise kind(text)
    return result


def distribute_mesh(
    comm: Comm, cell: str, order: int, x: npt.NDArray[np.float64] | None, cells: Integers | None
) -> Mesh:
    """The mesh of what rank 0 or each rank hands over, ghosted over facets. Collective.

    Args:
        comm: MPI communicator.
        cell: name of the cell type.
        order: degree of the geometry.
        x: positions [m], shape (n, 3), None on a rank that has none; nodes are numbered rank by rank.
        cells: nodes in DOLFINx's order, shape (m, nodes per cell), None on a rank that has none.
    """
    element = basix.ufl.element(
        "Lagrange", cell, order, lagrange_variant=basix.LagrangeVariant.equispaced, shape=(3,)
    )
    if x is None or cells is None:
        x, cells = np.empty((0, 3)), np.empty((0, element.basix_element.dim), dtype=np.int64)
    return dolfinx_compat.create_mesh(comm, cells, element, x)


def lobe_tags(mesh: Mesh, first_cell: Integers) -> MeshTags:
    """Tag all cells of lobe k with k, from 1: each lobe's cells were handed over in a row.

    Args:
        mesh: the distributed mesh.
        first_cell: number of each lobe's first cell, and of cells, shape (lobes + 1,).
    """
    original = np.asarray(mesh.topology.original_cell_index)
    values = np.searchsorted(first_cell, original, side="right").astype(np.int32)
    tags = meshtags(mesh, 2, np.arange(len(values), dtype=np.int32), values)
    tags.name = "lobes"
    return tags


def edge_tags(mesh: Mesh, rings: list[Integers], values: list[int], num_nodes: int) -> MeshTags:
    """Tag the facets of each ring, ghosts included, by the numbers their ends had at hand-over.

    Args:
        mesh: the distributed mesh.
        rings: vertices of the edges of each ring, shape (k, 2).
        values: one value a ring.
        num_nodes: number of nodes handed over.
    """
    mesh.topology.create_entities(1)
    mesh.topology.create_connectivity(1, 2)
    mesh.topology.create_connectivity(2, 1)
    imap = mesh.topology.index_map(1)
    facets = np.arange(imap.size_local + imap.num_ghosts, dtype=np.int32)
    # for quadratic cells the mid-side node comes third
    ends = dolfinx_compat.entity_nodes(mesh, 1, facets)[:, :2]
    handed_over = np.asarray(mesh.geometry.input_global_indices)[ends]
    keys = np.sort(handed_over, axis=1) @ [num_nodes, 1]

    ring_keys = np.sort(np.concatenate(rings), axis=1) @ [num_nodes, 1]
    ring_values = np.repeat(np.array(values, dtype=np.int32), [len(ring) for ring in rings])
    order = np.argsort(ring_keys)
    ring_keys, ring_values = ring_keys[order], ring_values[order]
    at = np.minimum(np.searchsorted(ring_keys, keys), len(ring_keys) - 1)
    tagged = ring_keys[at] == keys
    tags = meshtags(mesh, 1, facets[tagged], ring_values[at[tagged]])
    tags.name = "edges"
    return tags
