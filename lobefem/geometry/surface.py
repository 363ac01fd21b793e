"""`Surface`: the mesh of a film with its lobes, seams and rims named, on any number of MPI ranks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from lobefem import checks
from lobefem.display import Summarized, Summary, number
from lobefem.errors import InputError
from lobefem.frozen import Frozen, OnMesh
from lobefem.geometry import gather
from lobefem.geometry.axis import unit
from lobefem.geometry.flat_cylinder import Cylinder
from lobefem.geometry.meridian import Lobe
from lobefem.geometry.orientation import CORNERS
from lobefem.linalg import dolfinx_compat
from lobefem.typing import Array, Comm, Indices

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
            vector. None for that between the rims' centres, or of film that runs around none the longest
            principal axis of a long body and the shortest one of a flat body.
        cyclic_order: number of identical sectors around the axis, None for an unstructured mesh.
        divisions: cells (along one lobe's meridian, around the axis), None for unstructured.
        shape: the exact shape of each lobe, None where there is none.
        num_lobes: number of lobes in the stack.
        copies: how many turned copies of it close the surface: 1, or `cyclic_order` for one sector.
        grading: of a structured mesh, see `lobed_cylinder`.
        origin: a point on the axis, shape (3,) [m]. None for the centre of the bottom rim, or, without
            one, the origin.
        recipe: from which the mesh was made, for another one of the same shape; None of a mesh of one's own.
        regions: cell tags of a mesh of one's own, which the groups of dimension 2 name; None for the lobes.
        of_revolution: False for film that runs around no axis: strains and stresses then count along each
            cell's own first side, so only laws without a direction of their own fit.

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
    regions: MeshTags | None = None
    of_revolution: bool = True

    @classmethod
    def from_mesh(
        cls,
        mesh: Mesh,
        facet_tags: MeshTags | None = None,
        names: Mapping[str, tuple[int, int]] | None = None,
        cell_tags: MeshTags | None = None,
        *,
        plates: tuple[str, str] | None = None,
        axis: Any = None,
        origin: Any = None,
    ) -> Surface:
        """A film on a mesh of DOLFINx's.

        Args:
            mesh: triangles or quadrilaterals in space, ghosted over facets.
            facet_tags: of the edges that carry a name.
            names: (dimension, tag) by name, as the `physical_groups` of dolfinx.io.gmsh.
            cell_tags: of the regions that carry a name.
            plates: names of the bottom and of the top rim that end plates close.
            axis: direction of the axis, of a surface of revolution about one (3,).
            origin: a point on it (3,) [m].

        Raises:
            InputError: another kind of mesh, or names that do not go with it.
        """
        from lobefem.geometry.read import groups_of

        groups = groups_of(names, plates)
        return cls._own(axis, origin, mesh=mesh, regions=cell_tags, edges=facet_tags, groups=groups)

    @classmethod
    def from_msh(
        cls,
        path: Any,
        comm: Comm | None = None,
        *,
        plates: tuple[str, str] | None = None,
        axis: Any = None,
        origin: Any = None,
    ) -> Surface:
        """A film on a surface mesh that Gmsh has saved, its physical groups by their names. Collective.

        Cells are turned to one sense: outwards where the film, with the rims that plates close, encloses a
        volume. Rank 0 reads the file.

        Args:
            path: of a file that Gmsh reads, such as beam.msh.
            comm: MPI communicator (default: all ranks).
            plates: names of the bottom and of the top rim that end plates close.
            axis: direction of the axis, of a surface of revolution about one (3,).
            origin: a point on it (3,) [m].

        Raises:
            InputError: a file that Gmsh cannot read, or that holds something else than one surface mesh.
        """
        from lobefem.geometry.read import read_msh

        return cls._own(axis, origin, **read_msh(path, _communicator(comm), plates))

    @classmethod
    def from_step(
        cls,
        path: Any,
        size: float,
        comm: Comm | None = None,
        *,
        order: int = 1,
        plates: tuple[str, str] | None = None,
        axis: Any = None,
        origin: Any = None,
    ) -> Surface:
        """A film on the faces of a STEP file, meshed by Gmsh in triangles. Collective.

        Edges and faces are called as in the file, or curve_5 and surface_2 by Gmsh's numbers.

        Args:
            path: of the file.
            size: edge length of the triangles [m].
            comm: MPI communicator (default: all ranks).
            order: degree of the cells, 1 or 2.
            plates: names of the bottom and of the top rim that end plates close.
            axis: direction of the axis, of a surface of revolution about one (3,).
            origin: a point on it (3,) [m].

        Raises:
            InputError: a file that Gmsh cannot read, or a size or order that is impossible.
        """
        from lobefem.geometry.read import read_step

        return cls._own(axis, origin, **read_step(path, size, _communicator(comm), plates, order))

    @classmethod
    def _own(cls, axis: Any, origin: Any, **fields: Any) -> Surface:
        """A surface of someone else's mesh, of revolution if it has an axis or rims about one."""
        closed = "rim_bottom" in fields["groups"]
        revolved = closed or axis is not None
        return cls(axis=axis, origin=origin, of_revolution=revolved, **fields)

    def tags(self, name: str) -> tuple[MeshTags, int]:
        """The mesh tags in which a group is, and its value in them.

        Raises:
            InputError: a name that the surface does not have.
        """
        if name not in self.groups:
            raise InputError(f"no group '{name}' on this surface; it has {sorted(self.groups)}")
        dimension, value = self.groups[name]
        tags = self.edges if dimension == 1 else self.lobes if self.regions is None else self.regions
        if tags is None:
            raise InputError(f"group '{name}' needs the cell tags that it names; give regions")
        return tags, value

    def __post_init__(self) -> None:
        for name, value in _checked_fields(self).items():
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

    def by_region(self, values: Mapping[str, float]) -> Any:
        """A function that is constant on each named region, as a film's modulus or thickness. Collective.

        Args:
            values: by the name of a cell group; together they cover the surface.

        Raises:
            InputError: a name that no region has, or cells without a value.
        """
        from dolfinx import fem

        found = fem.Function(fem.functionspace(self.mesh, ("DG", 0)))
        found.x.array[:] = np.nan
        regions = sorted(group for group, (dimension, _) in self.groups.items() if dimension == 2)
        for name, value in values.items():
            if name not in regions:
                raise InputError(f"no region '{name}' on this surface; it has {regions}")
            tags, tag = self.tags(name)
            found.x.array[tags.find(tag)] = checks.finite(f"the value of region '{name}'", value, "")
        missing = self.mesh.comm.allreduce(int(np.isnan(found.x.array).sum()))
        if missing:
            raise InputError(
                f"some cells are in none of the regions {sorted(values)}; of all there are {regions}"
            )
        return found

    def length(self, name: str) -> float:
        """Length of an edge group as drawn [m]. Collective.

        Raises:
            InputError: a name that no edge of the surface has.
        """
        edges = sorted(group for group, (dimension, _) in self.groups.items() if dimension == 1)
        if name not in edges:
            raise InputError(f"no edge group '{name}' on this surface; it has {edges}")
        tags, value = self.tags(name)
        facets = tags.find(value)
        facets = facets[facets < self.mesh.topology.index_map(1).size_local]
        x = self.mesh.geometry.x[dolfinx_compat.entity_nodes(self.mesh, 1, facets)]
        a, b = x[:, 0], x[:, 1]
        middle = x[:, 2] if x.shape[1] > 2 else (a + b) / 2
        places, weights = np.polynomial.legendre.leggauss(4)  # on (-1, 1)
        rates = [a * (t - 0.5) + b * (t + 0.5) - 2 * t * middle for t in places]
        own = sum(w * np.linalg.norm(rate, axis=1).sum() for w, rate in zip(weights, rates, strict=True))
        return float(self.mesh.comm.allreduce(float(own)))

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
        what = "cylinder" if isinstance(shape, Cylinder) else "lobe" if self.of_revolution else "film"
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


def _checked_fields(surface: Surface) -> dict[str, Any]:
    """Fields of a surface as they are kept, those that are not kept as they came. Needs no communication.

    Raises:
        InputError: one that is of the wrong kind, or two that do not go together.
    """
    mesh = surface.mesh
    kept: dict[str, Any] = {"groups": MappingProxyType(dict(surface.groups))}
    if dolfinx_compat.mixes_cells(mesh):
        raise InputError("the mesh mixes cells of several kinds; give triangles or quadrilaterals alone")
    nodes = dolfinx_compat.geometry_dofmap(mesh).shape[1]
    if mesh.topology.dim != 2 or mesh.geometry.dim != 3 or nodes not in CORNERS:
        raise InputError(
            f"the mesh has {mesh.topology.cell_name()}s of {nodes} nodes in {mesh.geometry.dim} dimensions; "
            "give triangles or quadrilaterals of degree 1 or 2 in space, of an element with shape=(3,)"
        )
    if surface.shape is not None and not isinstance(surface.shape, (Lobe, Cylinder)):
        raise InputError(
            f"shape is {surface.shape!r}; give an Isotensoid, a NaturalShape, a Cylinder or None"
        )
    for name in ("num_lobes", "copies"):
        checks.integer(name, getattr(surface, name), 1)
    for name, group in surface.groups.items():
        if not isinstance(group, tuple) or len(group) != 2 or group[0] not in (1, 2):
            raise InputError(f"group '{name}' is {group!r}; give (1, tag) for edges, (2, tag) for cells")
        if group[0] == 1 and surface.edges is None:
            raise InputError(f"edge group '{name}' needs the facet tags that it names; give edges")
    if surface.divisions is not None:
        kept["divisions"] = _grid(surface)
    if surface.axis is not None:
        if not any(checks.numbers("the axis", surface.axis, "", 3)):
            raise InputError("the axis is a vector of length zero; give a direction, as (0, 0, 1)")
        kept["axis"] = unit(surface.axis)
    if surface.origin is not None:
        kept["origin"] = np.array(checks.numbers("the axis's origin", surface.origin, "m", 3))
        kept["origin"].flags.writeable = False
    return kept


def _grid(surface: Surface) -> tuple[int, int]:
    """Divisions, with which the number of sectors goes."""
    pair = checks.integers("a number of divisions", surface.divisions, 1)
    if len(pair) != 2:
        raise InputError(
            f"divisions is {surface.divisions!r}; give two integers (along a lobe's meridian, around)"
        )
    order = surface.cyclic_order
    if order is not None and pair[1] not in (order, 2 * checks.integer("cyclic_order", order, 1)):
        raise InputError(
            f"cyclic_order = {order} does not fit {pair[1]} divisions around; give {pair[1]}, half of it "
            "where diagonals alternate, or None"
        )
    return pair[0], pair[1]


def _communicator(comm: Comm) -> Any:
    if comm is not None:
        return comm
    from mpi4py import MPI

    return MPI.COMM_WORLD
