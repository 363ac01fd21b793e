"""`Surface`: the mesh of a film with its lobes, seams and rims named, on any number of MPI ranks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from lobefem.display import Summarized, Summary, number
from lobefem.frozen import Frozen, OnMesh
from lobefem.geometry import gather, surface_checks
from lobefem.geometry.axis import Axis
from lobefem.geometry.flat_cylinder import Cylinder
from lobefem.geometry.meridian import Lobe
from lobefem.typing import Array, Indices

from dolfinx.mesh import Mesh, MeshTags

__all__ = ["Surface"]


@dataclass(frozen=True, repr=False)
class Surface(Frozen, OnMesh, Summarized):
    """A meshed film with its parts named.

    One of a mesh of one's own needs the mesh, its tags and their names; what it says of itself is checked
    against the mesh as soon as a `Balloon` is made of it (docs/howto/own.md).

    Args:
        mesh: surface mesh in space, ghosted over facets so that `dS` is complete in parallel;
            every cell's normal (`ufl.CellNormal`) points outwards, away from the axis. Gas presses along
            the normals; where two rims close the film, or no edge is free, cells turned inwards are refused.
        lobes: cell tags; lobe k from the bottom has the value k, from 1. None for a single lobe.
        edges: facet tags: seams and rims.
        groups: (dimension, value) by name: lobe_1, ..., seam_1, ..., rim_bottom, rim_top.
        axis: direction of the axis from the bottom to the top rim, shape (3,), of any length: kept as a unit
            vector. None for that between the rims' centres.
        cyclic_order: number of identical sectors around the axis, None for an unstructured mesh.
        divisions: cells (along one lobe's meridian, around the axis), None for unstructured.
        shape: the exact shape of each lobe, None where there is none.
        num_lobes: number of lobes in the stack.
        copies: how many turned copies of it close the surface: 1, or `cyclic_order` for one sector.
        grading: of a structured mesh, see `lobed_cylinder`.
        origin: a point on the axis, shape (3,) [m]. None for the centre of the bottom rim, or, without
            one, the origin.
        recipe: from which the mesh was made, for another one of the same shape; None of a mesh of one's own.

    Raises:
        InputError: fields of the wrong kind, or that do not go together.
    """

    mesh: Mesh
    lobes: MeshTags | None = None
    edges: MeshTags | None = None
    groups: Mapping[str, tuple[int, int]] = field(default_factory=dict)
    axis: Array | None = None
    cyclic_order: int | None = None
    divisions: tuple[int, int] | None = None
    shape: Lobe | Cylinder | None = None
    num_lobes: int = 1
    copies: int = 1
    grading: float = 0.0
    origin: Array | None = None
    recipe: Any = None

    def __post_init__(self) -> None:
        for name, value in surface_checks.checked_fields(self).items():
            object.__setattr__(self, name, value)

    @property
    def lobe(self) -> Lobe:
        """The exact shape of each lobe, where there is one."""
        assert isinstance(self.shape, Lobe)  # as those who ask have seen to
        return self.shape

    def facets(self, group: str) -> Indices:
        """Facets of an edge group that this rank has, ghosts included (facets,)."""
        assert self.edges is not None  # which an edge group needs
        return np.asarray(self.edges.find(self.groups[group][1]))

    def to_pyvista(self) -> Any:
        """The film as a PyVista grid on rank 0, None elsewhere; cell data "lobe" (1, 2, ...). Collective.

        Rank 0 gathers nodes and cells of all ranks: see `lobefem.geometry.gather.gather` for what that takes.
        """
        lobes = {"lobe": self.lobe_numbers()}
        whole = gather.gather(self.mesh, {}, lobes, gather.nodal_space(self.mesh))
        return None if whole is None else gather.to_pyvista(whole)

    def lobe_numbers(self) -> npt.NDArray[np.int32]:
        """Number of the lobe, from 1, of each of this rank's cells, ghosts included (cells,)."""
        cells = self.mesh.topology.index_map(2)
        if self.lobes is None:
            return np.ones(cells.size_local + cells.num_ghosts, dtype=np.int32)
        numbers = np.zeros(cells.size_local + cells.num_ghosts, dtype=np.int32)
        numbers[self.lobes.indices] = self.lobes.values
        return numbers

    def _summary(self) -> Summary:
        shape, topology = self.shape, self.mesh.topology
        what = "cylinder" if isinstance(shape, Cylinder) else "lobe"
        mesh = "unstructured" if self.divisions is None else " x ".join(map(str, self.divisions))
        cells = f"{topology.index_map(2).size_global} {topology.cell_name()}s"
        part = f", one of {self.copies} sectors" if self.copies > 1 else ""
        rows = [
            ("mesh", f"{mesh}{part}"),
            ("cells", cells),
            ("nodes", str(self.mesh.geometry.index_map().size_global)),
        ]
        if shape is not None:
            rows += [
                ("edge radius", number(shape.edge_radius, "m")),
                ("height", number(self.num_lobes * shape.height, "m")),
                ("volume as designed", number(self.num_lobes * shape.volume, "m^3")),
            ]
        return Summary(f"{self.num_lobes} {what}{'s' if self.num_lobes > 1 else ''}", tuple(rows))


def _moved(surface: Surface, axis: Axis | None) -> Surface:
    """A surface meshed here, taken to an axis."""
    if axis is None or (axis.home and (axis.first == [1.0, 0.0, 0.0]).all()):
        return surface
    surface.mesh.geometry.x[:] = axis.origin + surface.mesh.geometry.x @ axis.basis
    return replace(surface, axis=axis.direction, origin=axis.origin)
