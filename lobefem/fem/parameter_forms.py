"""Derivatives of a balloon's weak forms by its parameters, in a fixed displacement.

All come from one functional of displacement and parameters,

    L = R[eta] + R'[phi, phi],

the nodal residual R acting on a field eta, and its derivative, the second variation, along a mode phi. With
eta the adjoint displacement of a quantity the parameter's derivative of L is what the quantity's total
derivative takes beside its own explicit part. Each form is compiled when it is first asked for.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from lobefem.errors import InputError
from lobefem.fem.balloon import Balloon
from lobefem.linalg import dolfinx_compat
from lobefem.linalg.assembly import total
from lobefem.model import kinematics
from lobefem.typing import Array, Form

import ufl
from dolfinx import fem

__all__ = ["SCALARS", "ParameterForms"]

# parameters that are numbers, of which derivatives are per relative change, but for `shortening`: the share
# by which cables at rest are shorter than they are
SCALARS = ("E", "thickness", "EA", "shortening")


class ParameterForms:
    """Derivatives of L, and of a few quantities, at the present displacement of a balloon of one process.

    Args:
        balloon: without built-in stress.

    Raises:
        InputError: built-in stress, a load path, or contact.
    """

    def __init__(self, balloon: Balloon) -> None:
        if balloon.prestressed or balloon.load_path is not None or balloon.contact is not None:
            raise InputError(
                "sensitivities are those of film without built-in stress, load path and contact; leave these "
                "out"
            )
        self._balloon, self._forms = balloon, balloon.forms
        self.phi, self.eta = self._forms.directions
        self._test = ufl.TestFunction(balloon.V)
        self._mesh = balloon.mesh
        # of the mean true resultants of a cell: what to sum for the stress
        self.pick = fem.Function(fem.functionspace(self._mesh, ("DG", 0, (3,))))

    def set_directions(self, eta: Array | None, phi: Array | None) -> None:
        """Put nodal fields (nodes, 3) into eta and phi, 0 for those that are None."""
        for target, field in ((self.eta, eta), (self.phi, phi)):
            target.x.array[:] = 0.0 if field is None else np.asarray(field).ravel()

    def _functional(self, residual: Any) -> Any:
        """L of a residual in UFL."""
        along = ufl.action(residual, self.phi)
        return ufl.action(residual, self.eta) + ufl.derivative(along, self._balloon.u, self.phi)

    # --- by numbers -----------------------------------------------------------------------------------
    def by_scalars(self) -> dict[str, float]:
        """Derivatives of L by `SCALARS` at eta and phi; those of a thickness with the film's weight."""
        found = {"E": total(self._mesh, self._by_film)}
        found["thickness"] = found["E"]
        if self._by_weight is not None:
            found["thickness"] += total(self._mesh, self._by_weight)
        for name, form in (("EA", self._by_stiffness), ("shortening", self._by_shortening)):
            found[name] = 0.0 if form is None else total(self._mesh, form)
        return found

    @cached_property
    def _by_film(self) -> Form:
        return dolfinx_compat.form(self._functional(self._forms.film_ufl))

    @cached_property
    def _by_weight(self) -> Form | None:
        weight = self._forms.film_weight_ufl
        if weight is None:
            return None
        return dolfinx_compat.form(ufl.derivative(weight, self._balloon.u, self.eta))

    @cached_property
    def _by_stiffness(self) -> Form | None:
        energy = self._forms.cables_ufl
        if not self._forms.cable_forms.terms:
            return None
        return dolfinx_compat.form(self._functional(ufl.derivative(energy, self._balloon.u, self._test)))

    @cached_property
    def _by_shortening(self) -> Form | None:
        terms = self._forms.cable_forms.terms
        if not terms:
            return None
        share, energies = self._share, []
        for term in terms:
            shorter = term.shortened(share)
            density = shorter.energy(shorter.strain(self._edge(term)))
            if self._forms.has_rope_weight:
                density += self._forms.rope_weight(shorter)
            energies.append(ufl.diff(density, share) * term.measure)
        energy = sum(energies[1:], energies[0])
        return dolfinx_compat.form(self._functional(ufl.derivative(energy, self._balloon.u, self._test)))

    @cached_property
    def _share(self) -> Any:
        return ufl.variable(fem.Constant(self._mesh, 0.0))

    def _edge(self, term: Any) -> Any:
        return kinematics.edge_strain(self._balloon.u, self._mesh, term.side)

    # --- by fields ------------------------------------------------------------------------------------
    def by_displacement(self) -> Array:
        """Derivative of L by the nodal displacements (components,)."""
        return np.asarray(fem.assemble_vector(self._by_displacement).array)

    @cached_property
    def _by_displacement(self) -> Form:
        L = self._functional(self._forms.residual_ufl)
        return dolfinx_compat.form(ufl.derivative(L, self._balloon.u, self._test))

    def by_pattern(self) -> Array | None:
        """Derivative of L by the degrees of freedom of the flat pattern; None without a pattern."""
        if self._balloon.pattern is None:
            return None
        return np.asarray(fem.assemble_vector(self._by_pattern).array)

    @cached_property
    def _by_pattern(self) -> Form:
        return self._along_pattern(self._functional(self._forms.residual_ufl))

    def _along_pattern(self, functional: Any) -> Form:
        pattern: Any = self._balloon.pattern
        if not hasattr(pattern, "function_space"):
            raise InputError(
                "the pattern is an expression, and a derivative by it needs a function; interpolate it into "
                "one"
            )
        test = ufl.TestFunction(pattern.function_space)
        return dolfinx_compat.form(ufl.derivative(functional, pattern, test))

    # --- quantities -----------------------------------------------------------------------------------
    def volume_by_displacement(self) -> Array:
        """Derivative of the film's part of the volume by the nodal displacements [m^2]."""
        return np.asarray(fem.assemble_vector(self._volume).array)

    @cached_property
    def _volume(self) -> Form:
        return dolfinx_compat.form(ufl.derivative(self._forms.volume_ufl, self._balloon.u, self._test))

    def pull_by_displacement(self) -> Array:
        """Derivative of the tension summed along the cables by the nodal displacements [N]."""
        return np.asarray(fem.assemble_vector(self._pull[1]).array)

    def pull_by_shortening(self) -> tuple[float, float]:
        """Tension summed along the cables [N m] and its derivative by the share of a shortening."""
        value, _, by_share = self._pull
        return total(self._mesh, value), total(self._mesh, by_share)

    @cached_property
    def _pull(self) -> tuple[Form, Form, Form]:
        terms, share = self._forms.cable_forms.terms, self._share
        value = sum(self._forms.pull(term) * term.measure for term in terms)
        shorter = sum(
            ufl.diff(self._forms.pull(term.shortened(share)), share) * term.measure for term in terms
        )
        by_u = ufl.derivative(value, self._balloon.u, self._test)
        return dolfinx_compat.form(value), dolfinx_compat.form(by_u), dolfinx_compat.form(shorter)

    @cached_property
    def _picked(self) -> Any:
        balloon = self._balloon
        S = self._forms.pattern.resultants(balloon.film.stress(self._forms.strain, self._forms.number))
        N = kinematics.true_resultants(S, balloon.u, balloon.frame, balloon.x, balloon.direction)
        return ufl.inner(self.pick, N) * self._forms.dx

    def picked_by_displacement(self) -> Array:
        """Derivative of the integral of the true resultants, weighted by `pick`, by the displacements."""
        return np.asarray(fem.assemble_vector(self._picked_by_displacement).array)

    @cached_property
    def _picked_by_displacement(self) -> Form:
        return dolfinx_compat.form(ufl.derivative(self._picked, self._balloon.u, self._test))

    def picked_by_pattern(self) -> Array | None:
        """That by the degrees of freedom of the pattern; None without a pattern."""
        if self._balloon.pattern is None:
            return None
        return np.asarray(fem.assemble_vector(self._picked_by_pattern).array)

    @cached_property
    def _picked_by_pattern(self) -> Form:
        return self._along_pattern(self._picked)

    def area_by_pattern(self) -> Array | None:
        """Derivative of the area of all layers of film by the degrees of freedom of the pattern [m]."""
        if self._balloon.pattern is None:
            return None
        return np.asarray(fem.assemble_vector(self._area_by_pattern).array)

    @cached_property
    def _area_by_pattern(self) -> Form:
        area, layers = self._forms.area_of_film, self._balloon.layers
        return self._along_pattern((area if layers is None else layers * area) * self._forms.dx)
