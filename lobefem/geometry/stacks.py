"""Surfaces of stacks of lobes and of flat cylinders, whole or one sector of them, and coarser copies.

The axis is the z axis, the bottom rim lies in the plane z = 0 and the top rim at z = num_lobes * height.
Rank 0 runs Gmsh; nodes and cells do not depend on the number of ranks.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import get_args

import numpy as np

from lobefem import checks
from lobefem.errors import InputError
from lobefem.geometry import distribute, gmsh, grid, manifold
from lobefem.geometry.axis import Axis
from lobefem.geometry.flat_cylinder import Cylinder
from lobefem.geometry.isotensoid import Isotensoid
from lobefem.geometry.meridian import Lobe
from lobefem.geometry.surface import Surface
from lobefem.linalg import dolfinx_compat
from lobefem.linalg.memory import require_memory
from lobefem.log import logger
from lobefem.profiling import timed
from lobefem.typing import Cell, Comm, Diagonals, Layout, Unchecked

from mpi4py import MPI

__all__ = ["StackRecipe", "coarser", "cylinder", "lobed_cylinder", "sector_of"]

_SEAM, _RIM = 100, 200  # seam k has the value 100 + k, the rims 201 and 202

_MAX_LOBES = 1000  # Gmsh takes a minute for them, a time that grows with their square

_MAX_CELLS = 50_000_000

_BYTES = 1e4  # of memory that an equilibrium takes a node, at the least: measured from 96 x 128 to 192 x 256


def lobed_cylinder(
    lobes: int = 4,
    divisions: tuple[int, int] = (24, 32),
    *,
    shape: Lobe | None = None,
    cell: Cell = "triangle",
    order: int = 1,
    diagonals: Diagonals = "same",
    grading: float = 0.0,
    layout: Layout = "structured",
    size: float | None = None,
    sector: bool = False,
    comm: Comm = MPI.COMM_WORLD,
) -> Surface:
    """Mesh a stack of lobes. Collective.

    Args:
        lobes: number of lobes, 1 or more.
        divisions: structured cells (along one lobe's meridian, around the axis), at least (2, 3).
        shape: one lobe, an `Isotensoid` or a `NaturalShape`; the paper's design (edge radius 2 m,
            truncation 0.55) when None.
        cell: 'triangle' or 'quadrilateral'.
        order: degree of the geometry, 1 (flat facets) or 2.
        diagonals: how structured triangles are cut, all the same way ('same') or 'alternating'.
        grading: how much flatter than even structured cells are at the rims of each lobe, where film
            folds: 0 (even) to 0.95 (a twentieth of the even height there).
        layout: 'structured' (exactly cyclic) or 'unstructured'.
        size: target edge length [m] of an unstructured mesh.
        sector: mesh one of its equal sectors only, whole on every rank (see `lobefem.stability.cyclic`).
        comm: MPI communicator.

    Raises:
        InputError: an argument that cannot be used, on every rank before any communication.
        SolveError: Gmsh failed (raised on every rank).
    """
    if shape is None:
        shape = Isotensoid.from_edge_radius()
    if not isinstance(shape, Lobe):
        raise InputError(
            f"shape is {shape!r}; give an Isotensoid, a NaturalShape, or None for the paper's design"
        )
    recipe = StackRecipe(shape, lobes, divisions, cell, order, diagonals, grading, layout, size, sector)
    return recipe.surface(comm)


def cylinder(
    radius: float = 2.0,
    length: float = 4.2,
    divisions: tuple[int, int] = (24, 32),
    *,
    cell: Cell = "triangle",
    order: int = 1,
    diagonals: Diagonals = "same",
    grading: float = 0.0,
    layout: Layout = "structured",
    size: float | None = None,
    sector: bool = False,
    comm: Comm = MPI.COMM_WORLD,
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
    recipe = StackRecipe(shape, 1, divisions, cell, order, diagonals, grading, layout, size, sector)
    return recipe.surface(comm)


@dataclass(frozen=True)
class StackRecipe:
    """From what the surface of a stack is made; `lobed_cylinder` says what each argument is.

    Args:
        shape: of each lobe.
        lobes: their number.
        divisions: structured cells (along one lobe's meridian, around the axis).
        cell: "triangle" or "quadrilateral".
        order: degree of the geometry, 1 or 2.
        diagonals: "same" or "alternating".
        grading: how much flatter cells are at the rims.
        layout: "structured" or "unstructured".
        size: target edge length of an unstructured mesh [m].
        sector: True for one of the equal sectors.

    Raises:
        InputError: an argument that cannot be used.
    """

    shape: Lobe | Cylinder
    lobes: int = 1
    divisions: tuple[int, int] = (24, 32)
    cell: Cell = "triangle"
    order: int = 1
    diagonals: Diagonals = "same"
    grading: float = 0.0
    layout: Layout = "structured"
    size: float | None = None
    sector: bool = False

    def __post_init__(self) -> None:
        grading = self.grading
        lobes = checks.integer("the number of lobes", self.lobes, 1)
        if lobes > _MAX_LOBES:
            raise InputError(f"the number of lobes is {lobes}; give {_MAX_LOBES} or less")
        checks.one_of("cell", self.cell, get_args(Cell))
        checks.one_of("diagonals", self.diagonals, get_args(Diagonals))
        checks.one_of("layout", self.layout, get_args(Layout))
        order = checks.integer("the geometry's order", self.order, 1)
        if order > 2:
            raise InputError(f"the geometry's order is {order}; give 1 or 2")
        structured, alternating = self.layout == "structured", self.diagonals == "alternating"
        if alternating and (self.cell == "quadrilateral" or not structured):
            raise InputError("diagonals='alternating' needs structured triangles; leave it out")
        if not 0 <= grading <= 0.95 or (grading and not structured):
            raise InputError(
                f"grading = {grading} must lie in [0, 0.95], and a structured mesh takes it only"
            )
        if structured:
            least = (2, 3) if isinstance(self.shape, Lobe) else (1, 3)
            counts = _divisions(self.divisions, least, lobes, alternating)
            object.__setattr__(self, "divisions", counts)
            if self.size is not None:
                raise InputError(
                    f"size is {self.size!r} but the layout is structured; give divisions, or "
                    "layout='unstructured'"
                )
        else:
            if self.sector:
                raise InputError("an unstructured mesh has no equal sectors; use layout='structured'")
            object.__setattr__(self, "size", _size(self.size, self.shape, lobes))

    @property
    def sectors(self) -> int | None:
        """Number of equal sectors, None of an unstructured mesh."""
        if self.layout != "structured":
            return None
        return self.divisions[1] // 2 if self.diagonals == "alternating" else self.divisions[1]

    @timed("mesh")
    def surface(self, comm: Comm = MPI.COMM_WORLD, known: bool = False) -> Surface:
        """Mesh it. Collective.

        Args:
            comm: MPI communicator.
            known: True for a grid that Gmsh has meshed on a finer one: it is numbered without Gmsh.

        Raises:
            SolveError: Gmsh failed (raised on every rank).
        """
        shape, lobes, order, grading, sector = self.shape, self.lobes, self.order, self.grading, self.sector
        sectors, counts = self.sectors, self.divisions if self.layout == "structured" else None
        build: Callable[[], grid.SurfaceGrid]
        cut = self.diagonals if self.cell == "triangle" else None
        if counts is not None:
            nodes = lobes * counts[0] * (counts[1] if not sector else 1)
            build = partial(
                _structured, shape, lobes, counts, cut, grading, order, sectors if sector else None
            )
        else:
            assert self.size is not None  # by `__post_init__`
            nodes = round(lobes * shape.area / self.size**2)
            corners = 3 if self.cell == "triangle" else 4
            build = partial(_unstructured, shape, lobes, self.size, corners, order)

        if sector:
            comm = MPI.COMM_SELF
        nodes *= order**2
        fewer = "try fewer divisions" if self.layout == "structured" else "try a larger size"
        require_memory(comm, _BYTES * nodes, f"a mesh of {nodes:.3g} nodes", fewer)
        surface_grid: grid.SurfaceGrid | None
        if counts is not None and (comm.size > 1 or known) and order == 1:  # each rank numbers its own rows
            surface_grid = grid.grid(shape, lobes, counts, cut, grading, comm.rank, comm.size)
        else:
            surface_grid = distribute.on_root(comm, build)
        x = None if surface_grid is None else grid.place(shape, lobes, surface_grid.t, surface_grid.theta)
        mesh = distribute.distribute_mesh(
            comm, self.cell, order, x, None if surface_grid is None else surface_grid.cells
        )
        mesh.name = "film"
        manifold.vouch(mesh)

        groups = {f"lobe_{k}": (2, k) for k in range(1, lobes + 1)}
        groups |= {f"seam_{k}": (1, _SEAM + k) for k in range(1, lobes)}
        rim = max(_RIM, _SEAM + lobes)  # beyond a hundred lobes the rims make way for the seams
        groups |= {"rim_bottom": (1, rim + 1), "rim_top": (1, rim + 2)}
        values = [rim + 1, *range(_SEAM + 1, _SEAM + lobes), rim + 2]
        first_cell, rings = comm.bcast(
            None if surface_grid is None else (surface_grid.first_cell, surface_grid.rings), root=0
        )
        num_nodes = comm.allreduce(0 if surface_grid is None else len(surface_grid.t))
        surface = Surface(
            mesh=mesh,
            lobes=distribute.lobe_tags(mesh, first_cell),
            edges=distribute.edge_tags(mesh, rings, values, num_nodes),
            groups=groups,
            axis=np.array([0.0, 0.0, 1.0]),
            cyclic_order=sectors,
            divisions=counts,
            shape=shape,
            num_lobes=lobes,
            copies=sectors if sector and sectors is not None else 1,
            grading=grading,
            recipe=self,
        )
        logger.info("meshed %d lobe(s): %d %ss, %d nodes", lobes, int(first_cell[-1]), self.cell, num_nodes)
        return surface


def _structured(
    shape: Lobe | Cylinder,
    lobes: int,
    divisions: tuple[int, int],
    diagonals: str | None,
    grading: float,
    order: int,
    sectors: int | None,
) -> grid.SurfaceGrid:
    along, around = divisions
    # of one sector Gmsh meshes a coarse turn, all of whose columns are alike
    columns = around if sectors is None else min(around, 4)
    raw = gmsh.structured(shape, lobes, (along, columns))
    surface_grid = grid.structured_grid(raw, shape, (along, columns), diagonals, grading)
    if sectors is not None:
        surface_grid = grid.sector_of(surface_grid, columns, around // sectors, sectors)
    return surface_grid if order == 1 else grid.with_midpoints(surface_grid)


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
    recipe = replace(_recipe(surface), sector=True)
    return _moved(recipe.surface(surface.mesh.comm), axis)


def coarser(surface: Surface, axis: Axis | None = None) -> Surface | None:
    """The same surface with half the divisions both ways; None where they cannot be halved. Collective.

    Every node of it is a node of the finer one.

    Args:
        surface: the finer one.
        axis: as for `sector_of`.
    """
    if surface.divisions is None or surface.copies != 1 or surface.grading or surface.shape is None:
        return None
    recipe = _recipe(surface)
    along, around = (count // 2 for count in surface.divisions)
    even = surface.divisions == (2 * along, 2 * around)
    if not even or along < 4 or around < 4 or (recipe.diagonals == "alternating" and around % 2):
        return None
    return _moved(replace(recipe, divisions=(along, around)).surface(surface.mesh.comm, known=True), axis)


def _recipe(surface: Surface) -> StackRecipe:
    """The recipe of a structured surface; that of a mesh of one's own is what it says of itself."""
    if isinstance(surface.recipe, StackRecipe):
        return surface.recipe
    assert surface.shape is not None  # by those who call
    assert surface.divisions is not None
    cell = surface.mesh.topology.cell_name()
    nodes = dolfinx_compat.geometry_dofmap(surface.mesh).shape[1]
    return StackRecipe(
        surface.shape,
        surface.num_lobes,
        surface.divisions,
        cell,
        order=1 if nodes == {"triangle": 3}.get(cell, 4) else 2,
        diagonals="same" if surface.cyclic_order == surface.divisions[1] else "alternating",
        grading=surface.grading,
    )


def _unstructured(
    shape: Lobe | Cylinder, lobes: int, size: float, corners: int, order: int
) -> grid.SurfaceGrid:
    surface_grid = grid.unstructured_grid(gmsh.unstructured(shape, lobes, size, corners), shape)
    return surface_grid if order == 1 else grid.with_midpoints(surface_grid)


def _divisions(
    divisions: Unchecked, least: tuple[int, int], lobes: int, alternating: bool
) -> tuple[int, int]:
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


def _size(size: Unchecked, shape: Lobe | Cylinder, lobes: int) -> float:
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


def _moved(surface: Surface, axis: Axis | None) -> Surface:
    """A surface meshed here, taken to an axis."""
    if axis is None or (axis.home and (axis.first == [1.0, 0.0, 0.0]).all()):
        return surface
    surface.mesh.geometry.x[:] = axis.origin + surface.mesh.geometry.x @ axis.basis
    return replace(surface, axis=axis.direction, origin=axis.origin)
