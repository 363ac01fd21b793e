"""The whole film on rank 0: in the order of the mesh's input, the same on any ranks, or of a space."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from lobefem.frozen import Frozen
from lobefem.linalg import dolfinx_compat
from lobefem.typing import Array, Integers, Mesh, Space

import basix.ufl
from dolfinx import fem
from dolfinx.cpp.io import perm_vtk

__all__ = ["GatheredMesh", "at_nodes", "degree", "gather", "nodal_space", "to_pyvista"]

# by nodes of a cell: three, four, six and nine
_VTK_TYPES = {3: 5, 4: 9, 6: 22, 9: 28}


@dataclass(frozen=True)
class GatheredMesh(Frozen):
    """A mesh and its fields on one rank.

    Attributes:
        x: node positions (nodes, 3) [m].
        cells: nodes of each cell in VTK's order, corners first (cells, 3, 4, 6 or 9).
        nodal: fields by name, each (nodes, ...).
        cellwise: fields by name, each (cells, ...).
    """

    x: Array
    cells: Integers
    nodal: Mapping[str, npt.NDArray[Any]]
    cellwise: Mapping[str, npt.NDArray[Any]]


def gather(
    mesh: Mesh,
    nodal: Mapping[str, npt.NDArray[Any]],
    cellwise: Mapping[str, npt.NDArray[Any]],
    V: Any = None,
) -> GatheredMesh | None:
    """Nodes, cells and fields of all ranks on rank 0, None elsewhere. Collective.

    Rank 0 holds the whole film then, 24 bytes a node or cell for each vector field: 8 MB a field for a
    million displacement components, sent once. Solving takes a hundred times that.

    Args:
        mesh: DOLFINx's.
        nodal: by name, values at this rank's nodes in the order of the mesh's geometry (see `at_nodes`).
        cellwise: by name, values of this rank's cells; ghosts may follow.
        V: a space of the geometry's degree, in whose order the nodes are to be, those of rank 0 first
            (default: in the order of the mesh's input).
    """
    geometry, topology, comm = mesh.geometry, mesh.topology, mesh.comm
    nodes, cells = geometry.index_map().size_local, topology.index_map(topology.dim).size_local
    dofmap = dolfinx_compat.geometry_dofmap(mesh)
    if V is None:
        numbers = np.asarray(geometry.input_global_indices, dtype=np.int64)
    else:
        numbers = np.empty(len(geometry.x), dtype=np.int64)
        numbers[dofmap] = V.dofmap.index_map.local_to_global(V.dofmap.list.ravel()).reshape(dofmap.shape)
    dofmap = dofmap[:cells]
    order = np.argsort(perm_vtk(topology.cell_type, dofmap.shape[1]))
    own_cells = np.asarray(topology.original_cell_index, dtype=np.int64)[:cells]
    parts = comm.gather(
        (
            numbers[:nodes],
            own_cells,
            geometry.x[:nodes],
            numbers[dofmap[:, order]],
            {name: values[:nodes] for name, values in nodal.items()},
            {name: values[:cells] for name, values in cellwise.items()},
        ),
        root=0,
    )
    if comm.rank != 0:
        return None
    of_nodes, of_cells = (np.argsort(np.concatenate([p[k] for p in parts])) for k in (0, 1))
    return GatheredMesh(
        x=np.concatenate([p[2] for p in parts])[of_nodes],
        cells=np.concatenate([p[3] for p in parts])[of_cells],
        nodal={name: np.concatenate([p[4][name] for p in parts])[of_nodes] for name in nodal},
        cellwise={name: np.concatenate([p[5][name] for p in parts])[of_cells] for name in cellwise},
    )


def at_nodes(V: Space, field: Array) -> Array:
    """Values at this rank's nodes in the order of the mesh's geometry, from those in the order of V's dofs.

    Args:
        V: a space of the geometry's degree.
        field: ghosts included, (nodes, ...).
    """
    out = np.empty_like(field)
    out[dolfinx_compat.geometry_dofmap(V.mesh)] = field[V.dofmap.list]
    return out


def degree(mesh: Mesh) -> int:
    """Degree of a mesh's geometry, 1 or 2, from the nodes of a cell."""
    return {3: 1, 4: 1, 6: 2, 9: 2}[dolfinx_compat.geometry_dofmap(mesh).shape[1]]


def nodal_space(mesh: Mesh) -> Any:
    """The space of displacements of a mesh's nodes, of the geometry's degree. Collective."""
    return fem.functionspace(mesh, basix.ufl.element("Lagrange", mesh.basix_cell(), degree(mesh), shape=(3,)))


def to_pyvista(whole: GatheredMesh) -> Any:
    """A PyVista grid of it, fields as point and cell data. Needs no communication."""
    import pyvista

    count = whole.cells.shape[1]
    cells = np.column_stack([np.full(len(whole.cells), count), whole.cells]).ravel()
    grid = pyvista.UnstructuredGrid(cells, np.full(len(whole.cells), _VTK_TYPES[count]), whole.x)
    for name, values in whole.nodal.items():
        grid.point_data[name] = values
    for name, values in whole.cellwise.items():
        grid.cell_data[name] = values
    return grid
