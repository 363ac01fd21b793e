"""`find_form`: a cylinder of fixed-direction film finds the shape in which it carries the pressure.

The paper's sec. 5 (figs 8-10): the film's fibres run along the axis, it has no stiffness across them,
and gas pressure inflates it between two held rims. What it becomes has no hoop stress, so it is a lobe
of the family `lobefem.geometry.natural_shape`, stackable and meshable at will, with its stress in closed
form.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from lobefem.equilibrium.inflation import Progress, inflate
from lobefem.equilibrium.state import Equilibrium, placed_state
from lobefem.errors import ConvergenceError, InputError
from lobefem.fem.balloon import Balloon
from lobefem.frozen import Frozen
from lobefem.geometry.flat_cylinder import Cylinder
from lobefem.geometry.natural_shape import FORMING_PRESSURE, NaturalShape, isotensoid_stiffness
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.geometry.surface import Surface
from lobefem.linalg import dolfinx_compat
from lobefem.model.end_plates import EndPlates
from lobefem.model.fixed_wrinkles import FixedWrinkles
from lobefem.model.gas_pressure import GasPressure
from lobefem.typing import Array

from mpi4py import MPI

__all__ = ["Form", "find_form", "row_means"]

_FAR = 0.05  # of the equator radius: a film that far from every lobe without hoop stress is no form


@dataclass(frozen=True)
class Form(Frozen):
    """A form that was found.

    Attributes:
        state: the equilibrium of the forming film on the cylinder's mesh.
        Et: membrane stiffness of the forming film [N/m].
        shape: the lobe without hoop stress that lies nearest to the film's nodes.
        distance: largest distance of a node from the point of `shape` where it belongs [m].
        rings: mean distance from the axis and height above mid-height of the nodes of each ring, from
            the bottom rim, (rings, 2) [m].
        s: arc lengths of the rows of cells from the equator of `shape` (rows,) [m].
        N_phi: mean true meridional resultant of the forming film in each row (rows,) [N/m].
        N_theta: the same in the hoop direction.
    """

    state: Equilibrium = field(repr=False)
    Et: float
    shape: NaturalShape
    distance: float
    rings: Array = field(repr=False)
    s: Array = field(repr=False)
    N_phi: Array = field(repr=False)
    N_theta: Array = field(repr=False)

    @property
    def pressure(self) -> float:
        """Forming pressure [Pa]."""
        return self.state.pressure

    @property
    def tension(self) -> Array:
        """N_phi R of each row (rows,) [N], constant where there is no hoop stress."""
        return self.N_phi * self.shape.radius(self.s)

    def surface(self, lobes: int = 1, divisions: tuple[int, int] = (24, 32), **mesh: Any) -> Surface:
        """A stack of lobes of this form, meshed anew, for all later steps. Collective.

        `Balloon(..., prestressed=True)` on it has the film's own stress built in, in proportion to the
        pressure: N_phi = c p/R with the c of `shape`.

        Args:
            lobes: number of lobes.
            divisions: cells (along one lobe's meridian, around the axis).
            **mesh: further arguments of `lobed_cylinder`.
        """
        mesh = {"comm": self.state.balloon.comm} | mesh
        return lobed_cylinder(lobes, divisions, shape=self.shape, **mesh)


def find_form(
    surface: Surface,
    pressure: float = FORMING_PRESSURE,
    *,
    Et: float | None = None,
    progress: Progress | None = None,
) -> Form:
    """Inflate a cylinder of fixed-direction film between held rims, and tell what it became.

    A flat cylinder has no stiffness against the pressure and Newton's method no way to begin. So it
    begins from a shallow bulge: a parabola of the height b at which the fibres of an almost flat
    cylinder would balance the pressure. Their stretch is 1 + 8 b^2/(3 L^2), their curvature 8 b/L^2, so

        E t (8 b^2/(3 L^2)) (8 b/L^2) = p,   b^3 = 3 p L^4/(64 E t).

    The form is the symmetric equilibrium, to which Newton's method keeps from a symmetric start. Film
    without hoop stiffness that strains so much is unstable there in local modes (24 x 64 triangles at
    37.5 Pa: 82 negative eigenvalues); the lobe made of it is a stiffer film with little strain.

    Args:
        surface: from `cylinder`, structured and not graded.
        pressure: forming pressure [Pa].
        Et: membrane stiffness of the film [N/m]; by default that with which the paper's 37.5 Pa form an
            isotensoid (`isotensoid_stiffness`).
        progress: called with a line of text after each solve.

    Raises:
        InputError: another surface, or numbers with which the film bulges over its rims.
        ConvergenceError: Newton's method found no equilibrium, or one that is not a lobe.

    Collective.
    """
    cylinder = surface.shape
    if not isinstance(cylinder, Cylinder) or surface.divisions is None or surface.grading:
        raise InputError(
            "a form is found from a structured cylinder with even rows; give lobefem.cylinder(radius, "
            "length, divisions), without grading"
        )
    radius, length = cylinder.edge_radius, cylinder.height
    if Et is None:
        Et = isotensoid_stiffness(radius, length)
    expected = NaturalShape.inflated(radius, length, Et, pressure)  # refuses what cannot be
    film = FixedWrinkles(E=Et / FixedWrinkles.thickness)
    balloon = Balloon(surface, film, [GasPressure("film"), EndPlates(support="fixed")])
    _, height, _, frames = balloon.axis.cylindrical(balloon.X)
    share = height / length
    bulge = 4 * share * (1 - share) * (3 * pressure * length**4 / (64 * Et)) ** (1 / 3)
    start = placed_state(balloon, bulge[:, None] * frames[:, 0])
    state = inflate(balloon, pressure, start=start, progress=progress)
    rows = surface.divisions[0]
    shape, distance, rings = _nearest_lobe(state, rows * balloon.order, expected)
    if distance > _FAR * shape.R0:
        raise ConvergenceError(
            f"the film at {pressure:g} Pa lies up to {distance:.3g} m off every lobe without hoop stress; "
            "try more divisions",
            state=state,
            distance=distance,
        )
    s, (N,) = shape.stations(rows), row_means(state)
    return Form(state, Et, shape, distance, rings, (s[1:] + s[:-1]) / 2, N[:, 0].copy(), N[:, 1].copy())


def _nearest_lobe(state: Equilibrium, steps: int, first: NaturalShape) -> tuple[NaturalShape, float, Array]:
    """The lobe of the family, between the same rims, that lies nearest to the nodes; how near; the rings.

    The fibres' stretch is uniform, so the nodes of a ring belong at equal steps of arc length. The sum
    of their squared distances has one unknown, m, for which `first` is the first guess.
    """
    balloon = state.balloon
    owned = balloon.V.dofmap.index_map.size_local
    X, axis = balloon.X[:owned], balloon.axis
    x = axis.relative(X + state.displacement[:owned])
    shape = balloon.surface.shape
    assert shape is not None  # a cylinder
    length, radius = shape.height, shape.edge_radius
    ring = np.rint(axis.relative(X)[:, 2] / length * steps).astype(np.int64)
    found = np.column_stack([np.hypot(x[:, 0], x[:, 1]), x[:, 2] - length / 2])
    sums = np.zeros((steps + 1, 3))
    np.add.at(sums, ring, np.column_stack([np.ones(owned), found]))
    # one rank's word for all: reductions may differ in the last bit from rank to rank
    sums = balloon.comm.bcast(balloon.comm.allreduce(sums))
    means = sums[:, 1:] / sums[:, :1]

    def points(lobe: NaturalShape) -> Array:
        s = lobe.stations(steps)
        return np.column_stack([lobe.radius(s), lobe.z(s)])

    def lobe_of(m: float) -> NaturalShape:
        return NaturalShape.between_rims(radius, length, m)

    def misses(m: Array) -> Array:
        return (points(lobe_of(float(m[0]))) - means).ravel()

    from scipy.optimize import least_squares  # slow to import, and most lobes are not formed ones

    fit = least_squares(misses, [first.m], xtol=1e-12)
    shape = lobe_of(float(fit.x[0]))
    off = np.linalg.norm(found - points(shape)[ring], axis=1).max(initial=0.0)
    return shape, float(balloon.comm.allreduce(off, op=MPI.MAX)), means


def row_means(state: Equilibrium) -> Array:
    """True resultants along the meridian, each the mean over a row of cells around the axis.

    Args:
        state: on a structured surface.

    Returns:
        N_phi, N_theta and N_phitheta [N/m] of each lobe from the bottom, shape (lobes, rows, 3).

    Raises:
        InputError: the surface is not structured.

    Collective.
    """
    surface = state.balloon.surface
    if surface.divisions is None:
        raise InputError("rows of cells need a structured mesh; give divisions, not a size")
    shape = surface.num_lobes, surface.divisions[0]
    topology = surface.mesh.topology
    owned, cells = topology.index_map(2).size_local, topology.index_map(2).size_global
    N = state.true_resultants().x.array.reshape(-1, 3)[:owned]
    balloon, rows = state.balloon, shape[0] * shape[1]
    corners = surface.mesh.geometry.x[dolfinx_compat.geometry_dofmap(surface.mesh)[:owned]]
    heights = (corners - balloon.axis.origin) @ balloon.axis.direction
    # all cells of a row are as high, up to round-off: as many lie below as the rows below hold
    middle = (heights.min(axis=1) + heights.max(axis=1)) / 2
    below = np.searchsorted(np.sort(np.concatenate(balloon.comm.allgather(middle))), middle)
    row = below // (cells // rows)
    sums = np.zeros((rows, 3))
    np.add.at(sums, row, N)
    return (balloon.comm.allreduce(sums) * rows / cells).reshape(*shape, 3)
