"""The film as linear triangles on rank 0: what its contact is found on.

Quadrilaterals are cut in two, quadratic cells into the triangles between their nodes, and each end
plate is a fan of triangles from its rim to the mean of the rim's nodes. That mean moves with the rim
as the rigid plate does, so that plates add no unknowns.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from lobefem.frozen import Frozen
from lobefem.typing import Array, Indices, Space, Sparse

__all__ = ["Facets", "Gathering", "film_facets"]

# triangles between the nodes of a cell in DOLFINx's order, turned as the cell is
_TRIANGLES = {
    3: [[0, 1, 2]],
    4: [[0, 1, 3], [0, 3, 2]],
    6: [[0, 5, 4], [5, 1, 3], [4, 3, 2], [3, 4, 5]],
    9: [[8, a, b] for a, b in ((0, 4), (4, 1), (1, 6), (6, 3), (3, 7), (7, 2), (2, 5), (5, 0))],
}


@dataclass(frozen=True)
class Facets(Frozen):
    """The film and its plates as triangles.

    Args:
        x: reference positions of the film's nodes (nodes, 3) [m], in their global order.
        triangles: corners (triangles, 3) among the nodes and, after them, the plates' centres.
        follow: displacements of nodes and centres from those of the nodes, (nodes + plates, nodes).
    """

    x: Array
    triangles: Indices
    follow: Any


class Gathering:
    """Nodal vectors between the ranks that own them and rank 0.

    Args:
        V: vector function space (three components).
    """

    def __init__(self, V: Space) -> None:
        self.comm = V.mesh.comm
        self.owned = 3 * V.dofmap.index_map.size_local
        counts = self.comm.gather(self.owned, root=0)
        self.counts = np.array(counts) if counts is not None else None
        self.size = 3 * V.dofmap.index_map.size_global

    def gather(self, local: Array) -> Array | None:
        """All nodes' values (nodes, 3) on rank 0, None elsewhere, of this rank's. Collective."""
        whole = np.empty(self.size) if self.comm.rank == 0 else None
        self.comm.Gatherv(
            np.ascontiguousarray(local[: self.owned]),
            None if whole is None else (whole, self.counts),
            root=0,
        )
        return None if whole is None else whole.reshape(-1, 3)

    def scatter(self, whole: Array | None) -> Array:
        """This rank's part of a vector (3 nodes,) of rank 0. Collective."""
        local = np.empty(self.owned)
        self.comm.Scatterv(None if whole is None else (whole, self.counts), local, root=0)
        return local

    def scatter_rows(self, matrix: Sparse | None) -> tuple[Array, Array, Array]:
        """This rank's rows, as the arrays of CSR, of a sparse matrix of rank 0. Collective."""
        components = None
        if self.counts is not None:
            from scipy import sparse  # slow to import, and most films do not touch themselves

            rows = sparse.csr_array(matrix)
            ends = np.concatenate([[0], np.cumsum(self.counts)])
            blocks = [rows[a:b] for a, b in pairwise(ends)]
            components = [(b.indptr, b.indices, b.data) for b in blocks]
        return self.comm.scatter(components, root=0)


def film_facets(V: Space, rims: tuple[npt.NDArray[np.int32], ...]) -> Facets | None:
    """The triangles of all ranks on rank 0, None elsewhere. Collective.

    Args:
        V: vector function space of degree 1 or 2.
        rims: nodes (owned or ghosts) of each rim that a plate closes.
    """
    comm, dofs = V.mesh.comm, V.dofmap.index_map
    topology = V.mesh.topology
    cells = V.dofmap.list[: topology.index_map(topology.dim).size_local]
    local = cells[:, _TRIANGLES[cells.shape[1]]].reshape(-1, 3)
    triangles = dofs.local_to_global(local.ravel().astype(np.int32)).reshape(-1, 3)
    on_rims = [dofs.local_to_global(rim[rim < dofs.size_local].astype(np.int32)) for rim in rims]
    components = comm.gather((V.tabulate_dof_coordinates()[: dofs.size_local], triangles, on_rims), root=0)
    if components is None:
        return None
    from scipy import sparse  # as above

    x, triangles = (np.concatenate([p[k] for p in components]) for k in range(2))
    fans, means = [], []
    for k in range(len(rims)):
        rim = np.concatenate([p[2][k] for p in components])
        edges = _free_edges(triangles)
        edges = edges[np.isin(edges, rim).all(axis=1)]
        centre = np.full((len(edges), 1), len(x) + k)
        fans.append(np.hstack([edges[:, ::-1], centre]))
        means.append(sparse.csr_array((np.full(rim.size, 1 / rim.size), rim, [0, rim.size]), (1, len(x))))
    follow = sparse.vstack([sparse.eye_array(len(x)), *means], format="csc")
    return Facets(x, np.concatenate([triangles, *fans]).astype(np.int32), follow)


def _free_edges(triangles: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Edges (n, 2) of one triangle only, in its sense."""
    edges = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2)
    _, first, counts = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
    return edges[first[counts == 1]]
