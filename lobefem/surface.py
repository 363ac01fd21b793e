"""The film's mesh: a stack of lobes, a flat cylinder or a mesh of one's own, on any number of MPI ranks.

Meshed here the axis is the z axis, the bottom rim lies in the plane z = 0 and the top rim at
z = num_lobes * height. Rank 0 runs Gmsh; nodes and cells do not depend on the number of ranks.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from lobefem import _claims, _distribute, _dolfinx, _gmsh, _manifold, _net, _whole, checks
from lobefem._axis import Axis
from lobefem._cylinder import Cylinder
from lobefem._glance import Glance, Glanceable, number
from lobefem._memory import require_memory
from lobefem._records import Frozen, OnMesh
from lobefem.errors import InputError
from lobefem.isotensoid import Isotensoid
from lobefem.lobe import Lobe
from lobefem.log import logger
from lobefem.profiling import timed

# isort: split
from dolfinx.mesh import Mesh, MeshTags  # after lobefem._dolfinx, which finds the stack
from mpi4py import MPI

__all__ = ["Cylinder", "Surface", "coarser", "cylinder", "lobed_cylinder", "sector_of"]

Array = npt.NDArray[np.float64]

_SEAM, _RIM = 100, 200  # seam k has the value 100 + k, the rims 201 and 202
_MAX_LOBES = 1000  # Gmsh takes a minute for them, a time that grows with their square
_MAX_CELLS = 50_000_000
_BYTES = 1e4  # of memory that an equilibrium takes a node, at the least: measured from 96 x 128 to 192 x 256


@dataclass(frozen=True, repr=False)
class Surface(Frozen, OnMesh, Glanceable):
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

    def __post_init__(self) -> None:
        for name, value in _claims.checked_fields(self).items():
            object.__setattr__(self, name, value)

    def to_pyvista(self) -> Any:
        """The film as a PyVista grid on rank 0, None elsewhere; cell data "lobe" (1, 2, ...). Collective.

        Rank 0 gathers nodes and cells of all ranks: see `lobefem._whole.gather` for what that takes.
        """
        whole = _whole.gather(self.mesh, {}, {"lobe": self.lobe_numbers()})
        return None if whole is None else _whole.to_pyvista(whole)

    def lobe_numbers(self) -> npt.NDArray[np.int32]:
        """Number of the lobe, from 1, of each of this rank's cells, ghosts included (cells,)."""
        cells = self.mesh.topology.index_map(2)
        if self.lobes is None:
            return np.ones(cells.size_local + cells.num_ghosts, dtype=np.int32)
        numbers = np.zeros(cells.size_local + cells.num_ghosts, dtype=np.int32)
        numbers[self.lobes.indices] = self.lobes.values
        return numbers

    def _glance(self) -> Glance:
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
        return Glance(f"{self.num_lobes} {what}{'s' if self.num_lobes > 1 else ''}", tuple(rows))


def lobed_cylinder(
    lobes: int = 4,
    divisions: tuple[int, int] = (24, 32),
    *,
    shape: Lobe | None = None,
    cell: str = "triangle",
    order: int = 1,
    diagonals: str = "same",
    grading: float = 0.0,
    layout: str = "structured",
    size: float | None = None,
    sector: bool = False,
    comm: Any = MPI.COMM_WORLD,
) -> Surface:
    """Mesh a stack of lobes. Collective.

    Args:
        lobes: number of lobes, 1 or more.
        divisions: structured cells (along one lobe's meridian, around the axis), at least (2, 3).
        shape: one lobe, an `Isotensoid` or a `FormedLobe`; the paper's design (edge radius 2 m,
            truncation 0.55) when None.
        cell: 'triangle' or 'quadrilateral'.
        order: degree of the geometry, 1 (flat facets) or 2.
        diagonals: how structured triangles are cut, all the same way ('same') or 'alternating'.
        grading: how much flatter than even structured cells are at the rims of each lobe, where film
            folds: 0 (even) to 0.95 (a twentieth of the even height there).
        layout: 'structured' (exactly cyclic) or 'unstructured'.
        size: target edge length [m] of an unstructured mesh.
        sector: mesh one of its equal sectors only, whole on every rank (see `lobefem.cyclic`).
        comm: MPI communicator.

    Raises:
        InputError: an argument that cannot be used, on every rank before any communication.
        SolveError: Gmsh failed (raised on every rank).
    """
    if shape is None:
        shape = Isotensoid.from_edge_radius()
    if not isinstance(shape, Lobe):
        raise InputError(
            f"shape is {shape!r}; give an Isotensoid, a FormedLobe, or None for the paper's design"
        )
    return _make(shape, lobes, (2, 3), divisions, cell, order, diagonals, grading, layout, size, sector, comm)


def cylinder(
    radius: float = 2.0,
    length: float = 4.2,
    divisions: tuple[int, int] = (24, 32),
    *,
    cell: str = "triangle",
    order: int = 1,
    diagonals: str = "same",
    grading: float = 0.0,
    layout: str = "structured",
    size: float | None = None,
    sector: bool = False,
    comm: Any = MPI.COMM_WORLD,
) -> Surface:
    """Mesh a flat cylinder (paper sec. 5), one lobe with straight meridians. Collective.

    Args:
        radius: radius [m].
        length: length from rim to rim [m].
        divisions: structured cells (along the axis, around it), at least (1, 3).
        cell: as for `lobed_cylinder`, like all that follow.
        order: degree of the geometry.
        diagonals: how structured triangles are cut.
        grading: how much flatter cells are at the rims.
        layout: 'structured' or 'unstructured'.
        size: target edge length [m] of an unstructured mesh.
        sector: as for `lobed_cylinder`.
        comm: MPI communicator.

    Raises:
        InputError: an argument that cannot be used, on every rank before any communication.
        SolveError: Gmsh failed (raised on every rank).
    """
    shape = Cylinder(radius, length)
    return _make(shape, 1, (1, 3), divisions, cell, order, diagonals, grading, layout, size, sector, comm)


@timed("mesh")
def _make(
    shape: Lobe | Cylinder,
    lobes: int,
    least: tuple[int, int],
    divisions: tuple[int, int],
    cell: str,
    order: int,
    diagonals: str,
    grading: float,
    layout: str,
    size: float | None,
    sector: bool,
    comm: Any,
    known: bool = False,
) -> Surface:
    """A surface; that of a `known` grid, which Gmsh has meshed on a finer one, is numbered without it."""
    lobes = checks.integer("the number of lobes", lobes, 1)
    if lobes > _MAX_LOBES:
        raise InputError(f"the number of lobes is {lobes}; give {_MAX_LOBES} or less")
    checks.one_of("cell", cell, ("triangle", "quadrilateral"))
    checks.one_of("diagonals", diagonals, ("same", "alternating"))
    checks.one_of("layout", layout, ("structured", "unstructured"))
    order = checks.integer("the geometry's order", order, 1)
    if order > 2:
        raise InputError(f"the geometry's order is {order}; give 1 or 2")
    corners = 3 if cell == "triangle" else 4
    alternating = diagonals == "alternating"
    if alternating and (corners == 4 or layout == "unstructured"):
        raise InputError("diagonals='alternating' needs structured triangles; leave it out")
    if not 0 <= grading <= 0.95 or (grading and layout == "unstructured"):
        raise InputError(f"grading = {grading} must lie in [0, 0.95], and a structured mesh takes it only")

    counts = sectors = None
    build: Callable[[], _net.Net]
    if layout == "structured":
        counts = _divisions(divisions, least, lobes, alternating)
        sectors = counts[1] // 2 if alternating else counts[1]
        if size is not None:
            raise InputError(
                f"size is {size!r} but the layout is structured; give divisions, or layout='unstructured'"
            )
        cut = diagonals if corners == 3 else None
        nodes = lobes * counts[0] * (counts[1] if not sector else 1)
        build = partial(_structured, shape, lobes, counts, cut, grading, order, sectors if sector else None)
    else:
        if sector:
            raise InputError("an unstructured mesh has no equal sectors; use layout='structured'")
        length = _size(size, shape, lobes)
        nodes = round(lobes * shape.area / length**2)
        build = partial(_unstructured, shape, lobes, length, corners, order)

    if sector:
        comm = MPI.COMM_SELF
    nodes *= order**2
    fewer = "try fewer divisions" if layout == "structured" else "try a larger size"
    require_memory(comm, _BYTES * nodes, f"a mesh of {nodes:.3g} nodes", fewer)
    net: _net.Net | None
    if counts is not None and (comm.size > 1 or known) and order == 1:  # each rank numbers its own rows
        net = _net.grid(shape, lobes, counts, cut, grading, comm.rank, comm.size)
    else:
        net = _distribute.on_root(comm, build)
    x = None if net is None else _net.place(shape, lobes, net.t, net.theta)
    mesh = _distribute.distribute_mesh(comm, cell, order, x, None if net is None else net.cells)
    mesh.name = "film"
    _manifold.vouch(mesh)

    groups = {f"lobe_{k}": (2, k) for k in range(1, lobes + 1)}
    groups |= {f"seam_{k}": (1, _SEAM + k) for k in range(1, lobes)}
    rim = max(_RIM, _SEAM + lobes)  # beyond a hundred lobes the rims make way for the seams
    groups |= {"rim_bottom": (1, rim + 1), "rim_top": (1, rim + 2)}
    values = [rim + 1, *range(_SEAM + 1, _SEAM + lobes), rim + 2]
    first_cell, rings = comm.bcast(None if net is None else (net.first_cell, net.rings), root=0)
    num_nodes = comm.allreduce(0 if net is None else len(net.t))
    surface = Surface(
        mesh=mesh,
        lobes=_distribute.lobe_tags(mesh, first_cell),
        edges=_distribute.edge_tags(mesh, rings, values, num_nodes),
        groups=groups,
        axis=np.array([0.0, 0.0, 1.0]),
        cyclic_order=sectors,
        divisions=counts,
        shape=shape,
        num_lobes=lobes,
        copies=sectors if sector and sectors is not None else 1,
        grading=grading,
    )
    logger.info("meshed %d lobe(s): %d %ss, %d nodes", lobes, int(first_cell[-1]), cell, num_nodes)
    return surface


def _structured(
    shape: Lobe | Cylinder,
    lobes: int,
    divisions: tuple[int, int],
    diagonals: str | None,
    grading: float,
    order: int,
    sectors: int | None,
) -> _net.Net:
    along, around = divisions
    # of one sector Gmsh meshes a coarse turn, all of whose columns are alike
    columns = around if sectors is None else min(around, 4)
    raw = _gmsh.structured(shape, lobes, (along, columns))
    net = _net.structured_net(raw, shape, (along, columns), diagonals, grading)
    if sectors is not None:
        net = _net.sector_of(net, columns, around // sectors, sectors)
    return net if order == 1 else _net.with_midpoints(net)


def sector_of(surface: Surface, axis: Axis | None = None) -> Surface:
    """One sector of a structured surface, meshed alike, whole on every rank.

    Args:
        surface: of which it is.
        axis: where the surface stands, if not on the z axis with its bottom rim about the origin.

    Raises:
        InputError: the surface has no equal sectors.
    """
    if surface.cyclic_order is None or surface.divisions is None or surface.shape is None:
        raise InputError("a single harmonic needs a cyclic mesh; use mesh layout 'structured'")
    return _moved(_alike(surface, surface.divisions, sector=True), axis)


def coarser(surface: Surface, axis: Axis | None = None) -> Surface | None:
    """The same surface with half the divisions both ways; None where they cannot be halved. Collective.

    Every node of it is a node of the finer one.

    Args:
        surface: the finer one.
        axis: as for `sector_of`.
    """
    if surface.divisions is None or surface.copies != 1 or surface.grading or surface.shape is None:
        return None
    along, around = (count // 2 for count in surface.divisions)
    even = surface.divisions == (2 * along, 2 * around)
    if not even or along < 4 or around < 4 or (_diagonals(surface) == "alternating" and around % 2):
        return None
    return _moved(_alike(surface, (along, around), known=True), axis)


def _moved(surface: Surface, axis: Axis | None) -> Surface:
    """A surface meshed here, taken to an axis."""
    if axis is None or (axis.home and (axis.first == [1.0, 0.0, 0.0]).all()):
        return surface
    surface.mesh.geometry.x[:] = axis.origin + surface.mesh.geometry.x @ axis.basis
    return replace(surface, axis=axis.direction, origin=axis.origin)


def _diagonals(surface: Surface) -> str:
    return "same" if surface.divisions and surface.cyclic_order == surface.divisions[1] else "alternating"


def _alike(
    surface: Surface, divisions: tuple[int, int], sector: bool = False, known: bool = False
) -> Surface:
    """A structured surface again, with other divisions or one sector of it. Collective."""
    assert surface.shape is not None  # by those who call
    cell = surface.mesh.topology.cell_name()
    order = 1 if _dolfinx.geometry_dofmap(surface.mesh).shape[1] == {"triangle": 3}.get(cell, 4) else 2
    return _make(
        surface.shape, surface.num_lobes, (1, 3), divisions, cell, order, _diagonals(surface),
        surface.grading, "structured", None, sector, surface.mesh.comm, known,
    )  # fmt: skip


def _unstructured(shape: Lobe | Cylinder, lobes: int, size: float, corners: int, order: int) -> _net.Net:
    net = _net.unstructured_net(_gmsh.unstructured(shape, lobes, size, corners), shape)
    return net if order == 1 else _net.with_midpoints(net)


def _divisions(divisions: Any, least: tuple[int, int], lobes: int, alternating: bool) -> tuple[int, int]:
    try:
        along, around = divisions
    except (TypeError, ValueError):
        raise InputError(
            f"divisions is {divisions!r}; give two integers (along a lobe's meridian, around)"
        ) from None
    along = checks.integer("the number of divisions along the meridian", along, least[0])
    around = checks.integer("the number of divisions around the axis", around, least[1])
    if alternating and around % 2:
        raise InputError(
            f"alternating diagonals need an even number around the axis, not {around}; try {around + 1}"
        )
    if lobes * along * around > _MAX_CELLS:
        raise InputError(
            f"{lobes} lobe(s) of {along} x {around} cells are more than {_MAX_CELLS}; try fewer divisions"
        )
    return along, around


def _size(size: Any, shape: Lobe | Cylinder, lobes: int) -> float:
    if size is None:
        raise InputError("an unstructured mesh needs its target size [m]; give size=0.25, say")
    number = checks.positive("size", size, "m")
    if number > shape.edge_radius:
        raise InputError(
            f"size is {number:g} m, more than the edge radius {shape.edge_radius:g} m; "
            f"try {0.125 * shape.edge_radius:g}"
        )
    if lobes * shape.area > _MAX_CELLS * number**2:
        raise InputError(
            f"size {number:g} m gives more than {_MAX_CELLS} cells; try {0.05 * shape.edge_radius:g}"
        )
    return number
