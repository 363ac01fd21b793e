"""`FilmAssembly`: integrals, nodal vectors and nodal matrices of film, cables and contact."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from lobefem.fem.contact_potential import Contact
from lobefem.fem.weak_forms import WeakForms
from lobefem.linalg.assembly import NodalMatrix, NodalVector, total
from lobefem.typing import Array

from dolfinx import fem
from mpi4py import MPI

__all__ = ["FilmAssembly"]


class FilmAssembly:
    """Assembly over film, cables and contact in their present displacement `u`.

    It knows neither plates nor a constraint map, so that a balloon, its untied sector and the same balloon
    under a prescribed motion share one: a nodal vector or matrix belongs to the displacement and the loads,
    whichever of them has set these. Forms are compiled when they are first asked for.

    Args:
        forms: the weak forms, with the displacement `u` in which they are evaluated.
        pressure, prestress: the loads that the forms hold [Pa].
        contact: the film's contact with itself, if any.
        forces: constant forces at this rank's nodes, ghosts included (components,) [N].
    """

    def __init__(
        self,
        forms: WeakForms,
        pressure: fem.Constant,
        prestress: fem.Constant,
        contact: Contact | None,
        forces: Array | None = None,
    ) -> None:
        self.forms, self.contact, self._forces = forms, contact, forces
        self._pressure, self._prestress = pressure, prestress
        self._comm = forms.mesh.comm
        self._residual_at: Array | None = None  # displacement and loads of the residual that is kept

    @cached_property
    def _vector(self) -> NodalVector:
        return NodalVector(self.forms.residual)

    @cached_property
    def _matrix(self) -> NodalMatrix:
        return NodalMatrix(self.forms.tangent)

    @cached_property
    def mass(self) -> NodalMatrix:
        """Consistent mass of unit areal density [m^2]. Collective."""
        mass = NodalMatrix(self.forms.mass)
        mass.assemble(self.forms.mass)
        return mass

    def residual(self) -> Array:
        """Nodal residual [N], this rank's part (components,); the next call overwrites it. Collective.

        It is kept for the tangent that is asked for next.
        """
        u = self.forms.u
        now = np.append(u.x.array, (self._pressure.value, self._prestress.value))
        kept = self._residual_at
        if self._comm.allreduce(kept is not None and np.array_equal(kept, now), op=MPI.LAND):
            return self._vector.array
        self._residual_at = None
        r = self._vector.assemble(self.forms.residual)
        if self.contact is not None:
            r += self.contact.gradient(u)
        if self._forces is not None:
            r -= self._forces[: r.size]
        self._residual_at = now
        return r

    def tangent(self, *, iteration: bool = False, predicted: bool = False) -> NodalMatrix:
        """Nodal tangent of film and cables [N/m]; the next call overwrites it. Collective.

        Args:
            iteration: the matrix that the film law wants in Newton's method, maybe a secant.
            predicted: the one at the strain that is linear in `forms.increment`.
        """
        form = self.forms.tangent
        if predicted:
            form = self.forms.predicted
        elif iteration:
            form = self.forms.iteration
        self._matrix.assemble(form)
        return self._matrix

    def load(self) -> Array:
        """Nodal forces of unit pressure on the film [m^2], this rank's part (components,). Collective."""
        return NodalVector(self.forms.load).assemble(self.forms.load)

    def volume_gradient(self) -> Array:
        """Gradient of `volume` in the nodal displacements [m^2], this rank's part. Collective."""
        return NodalVector(self.forms.volume_gradient).assemble(self.forms.volume_gradient)

    def elastic(self) -> float:
        """Strain energy of film and cables [J]. Collective."""
        return total(self.forms.mesh, self.forms.elastic)

    def volume(self) -> float:
        """Change of the film's part of the enclosed volume [m^3]. Collective."""
        return total(self.forms.mesh, self.forms.volume)

    def moment(self) -> float:
        """Work of the pressure's gradient on the film, 0 without one [J]. Collective."""
        return 0.0 if self.forms.moment is None else total(self.forms.mesh, self.forms.moment)

    def raised(self) -> float:
        """Potential of dead weight, further energies and nodal forces, 0 without any [J]. Collective."""
        potential = 0.0 if self.forms.raised is None else total(self.forms.mesh, self.forms.raised)
        if self._forces is not None:
            own = self.forms.V.dofmap.index_map.size_local * self.forms.V.dofmap.index_map_bs
            work = float(self._forces[:own] @ self.forms.u.x.array[:own])
            potential -= self._comm.allreduce(work)
        return potential

    def barrier(self) -> float:
        """Energy of the contact barrier, infinite where the film intersects itself [J]. Collective."""
        return 0.0 if self.contact is None else self.contact.energy(self.forms.u)

    def second_variation(self) -> float:
        """Second variation along the two `forms.directions` [J]. Collective."""
        value = total(self.forms.mesh, self.forms.second_variation)
        if self.contact is not None:
            along = (direction.x.petsc_vec for direction in self.forms.directions)
            value += self.contact.second_variation(self.forms.u, *along)
        return value
