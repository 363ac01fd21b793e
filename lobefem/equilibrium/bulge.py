"""A start for flat film: bulged outwards as a soap film under the gas pressure.

Flat unstressed film has no transverse stiffness, so that Newton's method has no step to take from it. The
equilibrium does not depend on the guess.
"""

from __future__ import annotations

from typing import Any

from lobefem.equilibrium.newton import lever
from lobefem.fem.balloon import Balloon
from lobefem.fem.reduced_matrix import reduction
from lobefem.linalg import dolfinx_compat, petsc
from lobefem.linalg.assembly import NodalMatrix, NodalVector

import ufl
from petsc4py import PETSc

__all__ = ["bulged"]


def bulged(balloon: Balloon, times: float = 1.0) -> Any:
    """Unknowns of the reference shape blown up by a tenth of the square root of its area, or `times` that.

    Every component of the displacement solves Poisson's equation, as a soap film under the gas. Collective.
    """
    constraint, V = balloon.map, balloon.V
    rest = constraint.create_vector()
    balloon.set_unknowns(rest)
    w, dw, _ = constraint.plate_parameters(constraint.parameters(rest))
    v, du = ufl.TestFunction(V), ufl.TrialFunction(V)
    form = dolfinx_compat.form(ufl.inner(ufl.grad(du), ufl.grad(v)) * balloon.dx)
    matrix = NodalMatrix(form)
    matrix.assemble(form)
    K = reduction(matrix, constraint).fill(matrix, w, dw)
    force = NodalVector(balloon.forms.load).assemble(balloon.forms.load)
    b, q = constraint.create_vector(), constraint.create_vector()
    constraint.reduce(force, constraint.plate_forces(force, w)[0], dw, b)
    ksp = PETSc.KSP().create(balloon.comm)
    ksp.setOperators(K)
    petsc.set_direct_solver(ksp, True)
    ksp.solve(b, q)
    ksp.destroy()
    largest = q.norm(PETSc.NormType.NORM_INFINITY)
    q.scale(times * lever(balloon) / largest if largest else 0.0)
    return q
