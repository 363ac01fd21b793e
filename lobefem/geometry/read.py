"""Surfaces that others have made: a mesh of DOLFINx's, a Gmsh file, the faces of a STEP file.

Rank 0 reads a file with Gmsh, turns its cells to one sense, and hands them over to all ranks, so that names,
ghost cells and the order of nodes are the same whatever the version of DOLFINx.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from lobefem import checks
from lobefem.errors import InputError
from lobefem.geometry.distribute import distribute_mesh, edge_tags, on_root
from lobefem.geometry.gmsh import fresh_model
from lobefem.geometry.orientation import turned
from lobefem.linalg import dolfinx_compat
from lobefem.typing import Array, Comm, Gmsh, Integers, Mesh

from dolfinx.mesh import CellType, meshtags

__all__ = ["groups_of", "read_msh", "read_step"]

# Gmsh's numbers of cells: name, corners, nodes, degree
_CELLS = {
    2: ("triangle", 3, 3, 1),
    3: ("quadrilateral", 4, 4, 1),
    9: ("triangle", 3, 6, 2),
    10: ("quadrilateral", 4, 9, 2),
}


@dataclass
class _Read:
    """A mesh file as rank 0 has read it: nodes numbered from 0, cells in Gmsh's order, names.

    Attributes:
        kind: Gmsh's number of the cells.
        points: (nodes, 3) [m].
        cells: (cells, nodes per cell).
        regions: tag of each cell's group, 0 without one (cells,).
        edges: ends of the tagged edges, one array a group.
        groups: (dimension, tag) by name.
    """

    kind: int
    points: Array
    cells: Integers
    regions: Integers
    edges: dict[int, Integers] = field(default_factory=dict)
    groups: dict[str, tuple[int, int]] = field(default_factory=dict)


def groups_of(
    names: Mapping[str, tuple[int, int]] | None, plates: Iterable[str] | None
) -> dict[str, tuple[int, int]]:
    """Groups by name as a `Surface` has them, with those that plates close called rim_bottom and rim_top.

    Args:
        names: (dimension, tag) by name, as the `physical_groups` of dolfinx.io.gmsh; points and volumes are
            left out.
        plates: names of the bottom and of the top rim, or None.

    Raises:
        InputError: a rim that is no edge group.
    """
    if names is not None and not isinstance(names, Mapping):
        raise InputError(f"names is {names!r}; give (dimension, tag) by name, as {{'rim': (1, 5)}}")
    groups = {}
    for name, group in (names or {}).items():
        if not isinstance(group, tuple) or len(group) != 2:
            raise InputError(f"group '{name}' is {group!r}; give (1, tag) for edges, (2, tag) for cells")
        if group[0] in (1, 2):
            groups[str(name)] = (int(group[0]), int(group[1]))
    if plates is None:
        return groups
    pair = [plates] if isinstance(plates, str) else list(plates)
    if len(pair) != 2 or pair[0] == pair[1]:
        raise InputError(f"plates is {plates!r}; name two edge groups, the bottom rim's and the top rim's")
    edges = sorted(name for name, (dimension, _) in groups.items() if dimension == 1)
    for rim, name in zip(("rim_bottom", "rim_top"), pair, strict=True):
        if name not in edges:
            raise InputError(f"no edge group '{name}' on this surface; it has {edges}")
        groups[rim] = groups[name]
    return groups


def read_msh(path: str | Path, comm: Comm, plates: Iterable[str] | None = None) -> dict[str, Any]:
    """Mesh, tags and groups of a Gmsh file, by the names of a `Surface`'s fields. Collective.

    Raises:
        InputError: a file that Gmsh cannot read, or that holds something else than one surface mesh.
    """
    path = Path(path)

    def merge(gmsh: Gmsh) -> None:
        gmsh.merge(str(path))

    return _distributed(path, comm, merge, plates)


def read_step(
    path: str | Path, size: float, comm: Comm, plates: Iterable[str] | None = None, order: int = 1
) -> dict[str, Any]:
    """The faces of a STEP file in triangles, by the names of a `Surface`'s fields. Collective.

    Args:
        path: of the file; whatever its unit, lengths become metres.
        size: edge length of the triangles [m].
        comm: MPI communicator.
        plates: names of the bottom and of the top rim, or None.
        order: degree of the cells, 1 or 2.

    Raises:
        InputError: a file that Gmsh cannot read, or a size or order that is impossible.
    """
    path = Path(path)
    checks.positive("size", size, "m")
    if order not in (1, 2):
        raise InputError(f"order = {order!r} must be 1 or 2")

    def mesh(gmsh: Gmsh) -> None:
        gmsh.option.setString("Geometry.OCCTargetUnit", "M")
        try:
            gmsh.model.occ.importShapes(str(path), highestDimOnly=False)
        finally:
            gmsh.option.setString("Geometry.OCCTargetUnit", "")
        gmsh.model.occ.synchronize()
        gmsh.option.setNumber("Mesh.MeshSizeMin", size)
        gmsh.option.setNumber("Mesh.MeshSizeMax", size)
        gmsh.model.mesh.generate(2)
        gmsh.model.mesh.setOrder(order)

    return _distributed(path, comm, mesh, plates)


def _distributed(
    path: Path, comm: Comm, fill: Callable[[Any], None], plates: Iterable[str] | None
) -> dict[str, Any]:
    """Read on rank 0, turn the cells, and share the mesh out. Collective."""

    def build() -> tuple[_Read, dict[str, tuple[int, int]]]:
        if not path.is_file():
            raise InputError(f"there is no mesh file '{path}'; give a surface mesh that Gmsh has saved")
        with fresh_model() as gmsh:
            try:
                fill(gmsh)
            except Exception as error:  # Gmsh raises plain Exception with its last message
                raise InputError(f"Gmsh cannot read '{path}' ({error}); open it in Gmsh to see why") from None
            read = _extract(gmsh, path)
        groups = groups_of(read.groups, plates)
        rims = [read.edges[groups[name][1]] for name in ("rim_bottom", "rim_top") if name in groups]
        corners = _CELLS[read.kind][1]
        _turn(read, turned(read.cells[:, :corners], read.points, rims))
        return read, groups

    whole = on_root(comm, build)
    read = None if whole is None else whole[0]
    head = None if whole is None else (whole[0].kind, sorted(whole[0].edges), len(whole[0].points), whole[1])
    kind, values, count, groups = comm.bcast(head, root=0)
    name, _, nodes, degree = _CELLS[kind]
    order = dolfinx_compat.gmshio.cell_perm_array(getattr(CellType, name), nodes)
    x, cells = (None, None) if read is None else (read.points, read.cells[:, order])
    mesh = distribute_mesh(comm, name, degree, x, cells)
    rings = comm.bcast(None if read is None else [read.edges[value] for value in values], root=0)
    regions = comm.bcast(None if read is None else read.regions, root=0)
    numbers = regions[np.asarray(mesh.topology.original_cell_index)].astype(np.int32)
    tags = meshtags(mesh, 2, np.arange(len(numbers), dtype=np.int32), numbers)
    tags.name = "regions"
    return {
        "mesh": mesh,
        "regions": tags,
        "edges": edge_tags(mesh, rings, values, count) if values else None,
        "groups": groups,
    }


def _turn(read: _Read, backwards: npt.NDArray[np.bool_]) -> None:
    """Reverse the cells that are turned inwards, mid-side nodes included."""
    # corners, mid-side nodes (between corners 0-1, 1-2, ...), and the node in the middle
    reverse = {2: [0, 2, 1], 3: [0, 3, 2, 1], 9: [0, 2, 1, 5, 4, 3], 10: [0, 3, 2, 1, 7, 6, 5, 4, 8]}
    read.cells[backwards] = read.cells[backwards][:, reverse[read.kind]]


def _extract(gmsh: Gmsh, path: Path) -> _Read:
    """Cells, tagged edges and names of the current model; refuse what is not one surface mesh."""
    mesh = gmsh.model.mesh
    if len(mesh.getElementTypes(3)):
        raise InputError(f"'{path}' is a volume mesh; save the cells of the film's surface alone")
    kinds = sorted(int(kind) for kind in mesh.getElementTypes(2))
    if not kinds:
        raise InputError(f"'{path}' has no triangles or quadrilaterals; save a surface mesh, with all groups")
    shown = [mesh.getElementProperties(kind)[0].lower() for kind in kinds]
    if len(kinds) > 1:
        raise InputError(
            f"'{path}' mixes {' and '.join(shown)} cells; give cells of one kind, in Gmsh with "
            "Mesh.RecombineAll = 0 for triangles"
        )
    if kinds[0] not in _CELLS:
        raise InputError(
            f"'{path}' has cells of kind {shown[0]}; give triangles or quadrilaterals of degree 1 or 2"
        )
    named = _named(gmsh)
    entities = [entity for _, entity in gmsh.model.getEntities(2)]
    found = [_of_entity(mesh, 2, entity) for entity in entities]
    tag_of = _tag_of(named, 2)
    cells = np.concatenate(found).reshape(-1, _CELLS[kinds[0]][2])
    sizes = [len(part) // cells.shape[1] for part in found]
    regions = np.repeat([tag_of.get(entity, 0) for entity in entities], sizes)
    tags, points, _ = mesh.getNodes()
    used, flat = np.unique(cells, return_inverse=True)
    row = np.full(int(tags.max()) + 1, -1, dtype=np.int64)
    row[tags.astype(np.int64)] = np.arange(len(tags))
    number = np.full(len(row), -1, dtype=np.int64)
    number[used] = np.arange(len(used))
    edges: dict[int, list[Integers]] = {}
    for curve, tag in _tag_of(named, 1).items():
        ends = number[_of_entity(mesh, 1, curve).reshape(-1, _nodes_of_edge(mesh))[:, :2]]
        edges.setdefault(tag, []).append(ends[(ends >= 0).all(axis=1)])  # not those beside the film
    rings = {tag: np.concatenate(parts) for tag, parts in edges.items()}
    groups = {
        name: (dim, tag) for name, (dim, tag, _) in named.items() if dim == 2 or len(rings.get(tag, ()))
    }
    rings = {tag: ring for tag, ring in rings.items() if len(ring)}
    cells = flat.reshape(cells.shape).astype(np.int64)
    return _Read(kinds[0], points.reshape(-1, 3)[row[used]], cells, regions, rings, groups)


def _nodes_of_edge(mesh: Mesh) -> int:
    return 3 if 8 in mesh.getElementTypes(1) else 2


def _of_entity(mesh: Mesh, dimension: int, entity: int) -> Integers:
    """Nodes of the cells or edges of one entity, in a row."""
    parts = mesh.getElements(dimension, entity)[2]
    return np.concatenate([np.empty(0, dtype=np.int64), *(part.astype(np.int64) for part in parts)])


def _named(gmsh: Gmsh) -> dict[str, tuple[int, int, list[int]]]:
    """Dimension, tag and entities of each group by its name.

    Where nothing was grouped each curve and face is a group of its own. What has no name is called after its
    dimension and tag: curve_5, surface_2.
    """
    model = gmsh.model
    groups = [(dim, tag) for dim, tag in model.getPhysicalGroups() if dim in (1, 2)]
    found = {}
    if groups:
        for dim, tag in groups:
            name = model.getPhysicalName(dim, tag)
            entities = [int(entity) for entity in model.getEntitiesForPhysicalGroup(dim, tag)]
            found[name or _default(dim, tag)] = (dim, tag, entities)
        return found
    for dim in (1, 2):
        for _, tag in model.getEntities(dim):
            name = model.getEntityName(dim, tag).rpartition("/")[2]
            found[name if name and name not in found else _default(dim, tag)] = (dim, tag, [tag])
    return found


def _default(dim: int, tag: int) -> str:
    return f"{'curve' if dim == 1 else 'surface'}_{tag}"


def _tag_of(named: Mapping[str, tuple[int, int, list[int]]], dimension: int) -> dict[int, int]:
    """The tag of each entity of a dimension; an entity of two groups is refused."""
    tags: dict[int, int] = {}
    owner: dict[int, str] = {}
    for name, (dim, tag, entities) in named.items():
        for entity in entities if dim == dimension else ():
            if entity in owner:
                raise InputError(
                    f"groups '{owner[entity]}' and '{name}' have {_default(dim, entity)} in common; put each "
                    "curve and each face into one group"
                )
            owner[entity], tags[entity] = name, tag
    return tags
