"""The weak forms of a balloon in UFL, compiled when they are first asked for.

Written once as energies: residual and tangent are derivatives. Numbers of the design enter as
constants, so that a compiled form serves every design of its kind.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

from lobefem import _dolfinx
from lobefem.cables import Cords
from lobefem.kinematics import edge_strain, green_lagrange
from lobefem.loads import film_volume_change, pressure_work

# isort: split
import ufl
from dolfinx import fem

__all__ = ["WeakForms"]


class WeakForms:
    """Energy, residual, tangent and what else is integrated over a balloon's film and cords.

    Args:
        balloon: a `Balloon` under construction: mesh, space, displacement, loads and parts are there.
        hoop_slack: hoop slack of a prestressed film (strain).
        degree: quadrature degree; by default exact for the element where it can be.

    Attributes:
        dx: the film's measure.
        strain: total Green-Lagrange strain of the film in its frame, built-in strain included.
        cords: (group, tension [N], measure) of each edge group with a cord.
    """

    def __init__(self, balloon: Any, hoop_slack: float = 0.0, degree: int | None = None) -> None:
        self.mesh, self.u, self.V, self.frame = balloon.mesh, balloon.u, balloon.V, balloon.frame
        mesh, u, number = self.mesh, self.u, self.number
        surface, film = balloon.surface, balloon.film
        X = ufl.SpatialCoordinate(mesh)
        simplex = mesh.topology.cell_name() == "triangle"
        linear = balloon.order == 1 and simplex
        if degree is None:
            # exact for the enclosed volume; a linear triangle has one strain, but prestress (1/R)
            # and the frame vary over it
            varies = balloon.prestressed or film.directional
            degree = (4 if varies else 1) if linear else 2 * balloon.order + (not simplex)
        # one rule for film and load: FFCx 0.9 to 0.11 evaluates the coordinates in a kernel that
        # mixes a one-point rule with a larger one at the one point for both (1e-4 off)
        dx = ufl.Measure("dx", domain=mesh, metadata={"quadrature_degree": degree})
        strain = green_lagrange(u, self.frame)
        if balloon.prestressed:
            shape, axis = surface.shape, ufl.as_vector(list(surface.axis))
            across = X - ufl.dot(X, axis) * axis
            radius = ufl.sqrt(ufl.dot(across, across))
            resultant = balloon.prestress * number(shape.meridional_tension) / radius
            strain = strain + film.prestrain(resultant, number, hoop_slack)
        self.strain = strain
        self.dx = dx
        elastic = film.energy(strain, number) * dx
        self.cords: list[tuple[str, Any, Any]] = []
        for cord in balloon.cords:
            for name in cord.groups(surface):
                measure, side = _edge_measure(mesh, surface, name)
                e = edge_strain(u, mesh, side)
                if balloon.prestressed:
                    e = e + balloon.prestress * number(_tension(cord, surface) / cord.EA)
                elastic += cord.energy(e, number) * measure
                # second Piola tension times stretch: the force in the deformed cord
                stretch = ufl.sqrt(1 + 2 * edge_strain(u, mesh, side))
                self.cords.append((name, number(cord.EA) * e * stretch, measure))
        self._elastic = elastic
        v, du = ufl.TestFunction(self.V), ufl.TrialFunction(self.V)
        self._volume = film_volume_change(u, X, self.frame) * dx
        energy = elastic
        if balloon.load.convention == "closed":
            energy = energy - balloon.pressure * self._volume
        residual = ufl.derivative(energy, u, v)
        if balloon.load.convention == "film":
            residual -= balloon.pressure * pressure_work(u, v, self.frame) * dx
        self._residual, self._tangent = residual, ufl.derivative(residual, u, du)

    def number(self, value: float) -> Any:
        """A UFL constant."""
        return fem.Constant(self.mesh, float(value))

    @cached_property
    def elastic(self) -> Any:
        """Strain energy of film and cords [J]."""
        return _dolfinx.form(self._elastic)

    @cached_property
    def residual(self) -> Any:
        """Nodal residual [N]."""
        return _dolfinx.form(self._residual)

    @cached_property
    def tangent(self) -> Any:
        """Derivative of the residual [N/m]."""
        return _dolfinx.form(self._tangent)

    @cached_property
    def mass(self) -> Any:
        """Consistent mass of unit areal density [m^2]."""
        v, du = ufl.TestFunction(self.V), ufl.TrialFunction(self.V)
        return _dolfinx.form(ufl.inner(du, v) * ufl.dx(self.mesh))

    @cached_property
    def load(self) -> Any:
        """Nodal forces of unit pressure on the film [m^2]."""
        v = ufl.TestFunction(self.V)
        return _dolfinx.form(pressure_work(self.u, v, self.frame) * self.dx)

    @cached_property
    def volume(self) -> Any:
        """Change of the film's part of the enclosed volume [m^3]."""
        return _dolfinx.form(self._volume)

    @cached_property
    def directions(self) -> tuple[Any, Any]:
        """Two displacement fields, the directions of `second_variation` and `straining`."""
        return fem.Function(self.V), fem.Function(self.V)

    @cached_property
    def second_variation(self) -> Any:
        """Second variation along the two directions [J]."""
        dv, du = self.directions
        return _dolfinx.form(ufl.action(ufl.action(self._tangent, du), dv))

    @cached_property
    def straining(self) -> tuple[Any, Any]:
        """Squares of strain and of displacement gradient of the first direction."""
        gradient = ufl.grad(self.directions[0])
        g_m, g_h = ufl.dot(gradient, self.frame.m), ufl.dot(gradient, self.frame.h)
        e_mm, e_hh = ufl.dot(self.frame.m, g_m), ufl.dot(self.frame.h, g_h)
        e_mh = (ufl.dot(self.frame.m, g_h) + ufl.dot(self.frame.h, g_m)) / 2
        strain = e_mm**2 + e_hh**2 + 2 * e_mh**2
        return _dolfinx.form(strain * self.dx), _dolfinx.form(ufl.inner(gradient, gradient) * self.dx)


def _edge_measure(mesh: Any, surface: Any, name: str) -> tuple[Any, str | None]:
    """The measure over an edge group: dS between lobes, ds on a rim."""
    tag = surface.groups[name][1]
    kind, side = ("ds", None) if name.startswith("rim") else ("dS", "+")
    return ufl.Measure(kind, domain=mesh, subdomain_data=surface.edges)(tag), side


def _tension(cord: Cords, surface: Any) -> float:
    """Tension in a cord per Pa of prestress [N/Pa]."""
    if cord.tension_per_pressure is not None:
        return cord.tension_per_pressure
    return float(surface.shape.seam_tension(1.0))
