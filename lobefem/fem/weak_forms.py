"""The weak forms of a balloon in UFL, compiled when they are first asked for.

Written once as energies: residual and tangent are derivatives. A film law written as a stress gives
the film's virtual work S : dE instead. Numbers of the design enter as constants, so that a compiled
form serves every design of its kind.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

from lobefem.errors import InputError
from lobefem.fem.cable_forms import CableForms, CableTerm
from lobefem.fem.discretization import Discretization
from lobefem.fem.specification import Specification
from lobefem.linalg import dolfinx_compat
from lobefem.linalg.assembly import together
from lobefem.model.cutting_pattern import Drawn, Pattern
from lobefem.model.gas_pressure import film_moment_change, film_volume_change, pressure_work
from lobefem.model.kinematics import edge_strain, green_lagrange
from lobefem.typing import Expr, Form, Measure

import ufl
from dolfinx import fem

__all__ = ["WeakForms", "film_measure"]


class WeakForms:
    """Energy, residual, tangent and what else is integrated over a balloon's film and cables.

    Args:
        given: what the balloon is made of.
        fields: mesh, displacement and loads.
        dx: the film's measure, see `film_measure`.
        extra: a further energy, integrated [J].

    Attributes:
        has_energy: whether the film has an energy.
        strain: total Green-Lagrange strain of the film in its frame, built-in strain included.
        increment: displacement d of the last Newton step, for `predicted`.
        cable_forms: the balloon's cables.

    Raises:
        InputError: a cable on an edge group that is empty, or lies on free edges and within the film.

    Collective.
    """

    def __init__(
        self, given: Specification, fields: Discretization, dx: Measure, extra: Form | None = None
    ) -> None:
        self.mesh, self.u, self.V, self.frame = fields.mesh, fields.u, fields.V, fields.frame
        mesh, u, number = self.mesh, self.u, self.number
        surface, parts, load_path = given.surface, given.parts, given.load_path
        film: Any = given.film  # of which laws written as a stress have more than others
        for value in film.varying:
            if any(domain != mesh.ufl_domain() for domain in ufl.domain.extract_domains(value)):
                raise InputError("film E or thickness is a function on another mesh; make it on surface.mesh")
        self._film = film
        X, axis = fields.x, fields.direction
        pattern = Drawn() if given.pattern is None else Pattern(given.pattern, self.frame)
        area = pattern.area if given.layers is None else given.layers * pattern.area
        strain = pattern.strain(green_lagrange(u, self.frame))
        if given.prestressed:
            across = X - ufl.dot(X, axis) * axis
            radius = ufl.sqrt(ufl.dot(across, across))
            resultant = fields.prestress * number(surface.lobe.meridional_tension) / radius
            strain = strain + film.prestrain(resultant, number, given.hoop_slack)
        if load_path is not None:
            found = fem.Function(self.V)
            found.x.array[:] = load_path.displacement.ravel()
            path: Any = load_path.balloon.film
            strain = strain + path.removed_strain(green_lagrange(found, self.frame), number, given.hoop_slack)
        self.strain, self.area_of_film, self.pattern = strain, pattern.area, pattern
        self.dx = dx
        self.has_energy = film.has_energy
        # strains less what is quadratic in the increment, their parts `bend`, are those of `predicted`
        self.increment = fem.Function(self.V)
        predicted: Any = 0
        v, du = ufl.TestFunction(self.V), ufl.TrialFunction(self.V)
        cables = []
        self.cable_forms = CableForms(surface, parts.cables, given.prestressed)
        self._strains: list[Any] = []
        for term in self.cable_forms.terms:
            e = term.strain(edge_strain(u, mesh, term.side))
            if given.prestressed:
                e = e + fields.prestress * term.built_in
            cables.append(term.energy(e) * term.measure)
            bend = _even(lambda d: edge_strain(d, mesh, term.side), self.increment)  # noqa: B023
            predicted += term.force(e - bend) * ufl.derivative(e, u, v) * term.measure
            self._strains.append(e)
        weight, up = parts.weight, ufl.dot(u, axis)
        self._weighs = bool(weight.film)
        self._weight = [] if not weight.film else [number(weight.film) * area * up * dx]
        self._rope, self._up = number(weight.cables) if weight.cables else None, up
        if self._rope is not None:
            self._weight += [self.rope_weight(term) * term.measure for term in self.cable_forms.terms]
        if extra is not None:
            self._weight.append(extra)
        self._volume = film_volume_change(u, X, self.frame) * dx
        self._cables, self._film_energy = sum(cables), 0
        if self.has_energy:
            self._film_energy = area * film.energy(strain, number) * dx
            self._elastic = sum(cables, self._film_energy)
        self._moment = None
        gas, level, rise = parts.load, number(fields.lowest + parts.load.level), number(parts.load.gradient)
        if gas.gradient:
            self._moment = rise * film_moment_change(u, X, self.frame, axis, level) * dx
        if gas.convention == "closed":
            potential = fields.pressure * self._volume
            load = ufl.derivative(-(potential if self._moment is None else potential + self._moment), u, v)
        else:
            local = (
                fields.pressure + rise * (ufl.dot(X + u, axis) - level) if gas.gradient else fields.pressure
            )
            load = -local * pressure_work(u, v, self.frame) * dx
        self._potential = None
        if gas.convention == "closed":
            self._potential = -(potential if self._moment is None else potential + self._moment)
        # the energies whose derivative is taken; the work of the rest is written as it is
        energies = [*(cables if film.by_stress else [self._elastic]), *self._weight]
        residual = ufl.derivative(sum(energies[1:], energies[0]), u, v) if energies else 0
        residual += load
        bend = _even(lambda d: pattern.linear(green_lagrange(d, self.frame)), self.increment)
        predicted += area * ufl.inner(film.stress(strain - bend, number), ufl.derivative(strain, u, v)) * dx
        for potential in self._weight:
            load += ufl.derivative(potential, u, v)
        self._predicted = ufl.derivative(predicted + load, u, du)
        self._iteration = None
        if film.by_stress:
            S, virtual = film.stress(strain, number), ufl.derivative(strain, u, v)
            if film.tangent == "secant":
                held = film.secant(strain, ufl.derivative(strain, u, du), number)
                moduli = ufl.inner(held, virtual) + ufl.inner(S, ufl.derivative(virtual, u, du))
                self._iteration = ufl.derivative(residual, u, du) + area * moduli * dx
            self._film_work = area * ufl.inner(S, virtual) * dx
            residual += self._film_work
        self._residual, self._tangent = residual, ufl.derivative(residual, u, du)

    def number(self, value: Any) -> Any:
        """A UFL constant; what is in UFL already stays."""
        return value if isinstance(value, ufl.core.expr.Expr) else fem.Constant(self.mesh, float(value))

    @property
    def energy_ufl(self) -> Any:
        """The film's potential energy in UFL, see `Balloon.energy_ufl`."""
        if not self.has_energy:
            raise InputError(
                f"{type(self._film).__name__} film has no energy; use residual_ufl, or TensionField film"
            )
        if self._potential is None:
            raise InputError(
                "the film load has no potential; use residual_ufl, or GasPressure('closed'), the same where "
                "nothing but film encloses the gas"
            )
        return sum(self._weight, self._elastic + self._potential)

    @property
    def residual_ufl(self) -> Any:
        """The nodal residual in UFL."""
        return self._residual

    @property
    def tangent_ufl(self) -> Any:
        """Its derivative in UFL."""
        return self._tangent

    @property
    def film_ufl(self) -> Any:
        """The film's part of the nodal residual in UFL, proportional to E t."""
        if self._film.by_stress:
            return self._film_work
        return ufl.derivative(self._film_energy, self.u, ufl.TestFunction(self.V))

    @property
    def cables_ufl(self) -> Any:
        """Strain energy of the cables in UFL, proportional to EA; 0 without any."""
        return self._cables

    @property
    def film_weight_ufl(self) -> Any:
        """Potential of the film's dead weight in UFL, None of film without weight."""
        return self._weight[0] if self._weighs else None

    @property
    def volume_ufl(self) -> Any:
        """Change of the film's part of the enclosed volume in UFL."""
        return self._volume

    def rope_weight(self, term: CableTerm) -> Any:
        """Potential of a cable's dead weight per drawn length in UFL [J/m], that of its length at rest."""
        laid = ufl.conditional(ufl.gt(term.EA, 0), 1.0, 0.0)
        length = laid if term.rest is None else laid * ufl.sqrt(1 - 2 * term.rest)
        return self._rope * length * (self._up(term.side) if term.side else self._up)

    @property
    def has_rope_weight(self) -> bool:
        """True if the cables have a weight."""
        return self._rope is not None

    def pull(self, term: CableTerm) -> Any:
        """Force along a deformed cable in UFL [N]: second Piola tension times stretch."""
        edge = edge_strain(self.u, self.mesh, term.side)
        return term.force(term.strain(edge)) * ufl.sqrt(1 + 2 * edge)

    @cached_property
    def elastic(self) -> Any:
        """Strain energy of film and cables [J]."""
        return dolfinx_compat.form(self._elastic)

    @cached_property
    def residual(self) -> Any:
        """Nodal residual [N]."""
        return dolfinx_compat.form(self._residual)

    @cached_property
    def tangent(self) -> Any:
        """Derivative of the residual [N/m]."""
        return dolfinx_compat.form(self._tangent)

    @cached_property
    def iteration(self) -> Any:
        """The matrix of Newton's method: the tangent, or the law's secant in its place [N/m]."""
        return self.tangent if self._iteration is None else dolfinx_compat.form(self._iteration)

    @cached_property
    def predicted(self) -> Any:
        """The tangent at the strain that is linear in the last `increment` of displacement [N/m].

        Stress and moduli are those of E(u - d) + DE(u - d) d = E(u) - q(d)/2, as if strain were an
        unknown of its own (mixed integration point Newton; Magisano, Leonetti and Garcea 2017). After a
        Newton step the strain E(u) of nearly inextensible film and hoops is far off by the square of
        their turn; a tangent with its stress sends the next step astray. A secant law keeps its secant.
        """
        return self.iteration if self._iteration is not None else dolfinx_compat.form(self._predicted)

    @cached_property
    def mass(self) -> Any:
        """Consistent mass of unit areal density [m^2]."""
        v, du = ufl.TestFunction(self.V), ufl.TrialFunction(self.V)
        return dolfinx_compat.form(ufl.inner(du, v) * ufl.dx(self.mesh))

    @cached_property
    def load(self) -> Any:
        """Nodal forces of unit pressure on the film [m^2]."""
        v = ufl.TestFunction(self.V)
        return dolfinx_compat.form(pressure_work(self.u, v, self.frame) * self.dx)

    @cached_property
    def volume(self) -> Any:
        """Change of the film's part of the enclosed volume [m^3]."""
        return dolfinx_compat.form(self._volume)

    @cached_property
    def volume_gradient(self) -> Any:
        """Its derivative in the displacement [m^2]."""
        return dolfinx_compat.form(ufl.derivative(self._volume, self.u, ufl.TestFunction(self.V)))

    @cached_property
    def moment(self) -> Any:
        """Work of the pressure's gradient on the film [J], None without one."""
        return None if self._moment is None else dolfinx_compat.form(self._moment)

    @cached_property
    def raised(self) -> Any:
        """Potential of the dead weight, and the further energy of the user [J]; None without either."""
        return dolfinx_compat.form(sum(self._weight[1:], self._weight[0])) if self._weight else None

    @cached_property
    def regions(self) -> Any:
        """Reference areas of taut, wrinkled and slack film [m^2], `together`."""
        regions = self._film.regions(self.strain, self.number)
        return together(self.mesh, *((self.area_of_film * region, self.dx) for region in regions))

    @cached_property
    def pulls(self) -> Any:
        """Tensions of the cables, integrated over their lengths [N m], for `CableForms.sums`."""
        # second Piola tension times stretch: the force in the deformed cable
        return self.cable_forms.compile(
            [
                term.force(e) * ufl.sqrt(1 + 2 * edge_strain(self.u, self.mesh, term.side))
                for term, e in zip(self.cable_forms.terms, self._strains, strict=True)
            ]
        )

    @cached_property
    def lengths(self) -> Any:
        """Reference lengths of the cables [m]."""
        return self.cable_forms.sums(self.cable_forms.compile([1.0] * len(self.cable_forms.terms)))

    @cached_property
    def directions(self) -> tuple[Any, Any]:
        """Two displacement fields, the directions of `second_variation` and `straining`."""
        return fem.Function(self.V), fem.Function(self.V)

    @cached_property
    def second_variation(self) -> Any:
        """Second variation along the two directions [J]."""
        dv, du = self.directions
        return dolfinx_compat.form(ufl.action(ufl.action(self._tangent, du), dv))

    @cached_property
    def straining(self) -> tuple[Any, Any]:
        """Squares of strain and of displacement gradient of the first direction."""
        gradient = ufl.grad(self.directions[0])
        g_m, g_h = ufl.dot(gradient, self.frame.m), ufl.dot(gradient, self.frame.h)
        e_mm, e_hh = ufl.dot(self.frame.m, g_m), ufl.dot(self.frame.h, g_h)
        e_mh = (ufl.dot(self.frame.m, g_h) + ufl.dot(self.frame.h, g_m)) / 2
        strain = e_mm**2 + e_hh**2 + 2 * e_mh**2
        return dolfinx_compat.form(strain * self.dx), dolfinx_compat.form(
            ufl.inner(gradient, gradient) * self.dx
        )


def film_measure(given: Specification, fields: Discretization) -> Measure:
    """The film's measure, by default exact for the element where it can be."""
    simplex = fields.mesh.topology.cell_name() == "triangle"
    order = fields.order
    degree: Any = given.quadrature_degree
    if degree is None:
        # exact for the enclosed volume; a linear triangle has one strain, but prestress (1/R)
        # and the frame vary over it
        varies = given.prestressed or given.film.directional or given.load_path is not None
        linear = order == 1 and simplex
        degree = (4 if varies else 1) if linear else 2 * order + (not simplex)
        if given.parts.load.gradient:  # and for the integral of z over it
            degree = max(degree, 4 * order - 1 - simplex)
        if given.pattern is not None:  # rational, and exact by no rule
            degree = max(degree, 2 * order + 2)
    # one rule for film and load: FFCx 0.9 to 0.11 evaluates the coordinates in a kernel that
    # mixes a one-point rule with a larger one at the one point for both (1e-4 off)
    return ufl.Measure("dx", domain=fields.mesh, metadata={"quadrature_degree": degree})


def _even(f: Callable[[Expr], Expr], d: Expr) -> Any:
    """The even part of f(d): of a strain, what is quadratic."""
    return (f(d) + f(-d)) / 2
