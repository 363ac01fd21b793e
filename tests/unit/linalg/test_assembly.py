"""Matrices and vectors by DOLFINx's own storage against PETSc's, entry by entry."""

import gc

import numpy as np
import pytest
from states import nodes, unknowns, wavy

from lobefem.fem.balloon import Balloon
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.linalg.assembly import NodalMatrix, NodalVector, PickedMatrix, integral, together, totals
from lobefem.model.end_plates import EndPlates
from lobefem.model.tension_field import TensionField

import dolfinx.fem.petsc
import ufl
from mpi4py import MPI
from petsc4py import PETSc


def make(comm, order=1):
    surface = lobed_cylinder(2, (3, 7), comm=comm, order=order)
    balloon = Balloon(surface, TensionField(thickness=38.1e-6, E=2e9, nu=0.3), [EndPlates("fixed")])
    balloon.set_loads(10.0)
    balloon.set_unknowns(unknowns(balloon, 0.01 * wavy(nodes(balloon), 1, 2.0), 0.0))
    return balloon


def by_petsc(form):
    K = dolfinx.fem.petsc.assemble_matrix(form)
    K.assemble()
    return K


def pick(K, free):
    """Those components of this rank's nodes, as a matrix that follows K."""
    numbers = np.full(3 * K.nodes, -1)
    numbers[free] = (K.comm.exscan(free.size) or 0) + np.arange(free.size)
    return PickedMatrix(K, numbers, free.size)


def largest(matrix):
    return matrix.norm(PETSc.NormType.INFINITY)


def difference(A, B):
    D = A.copy()
    D.axpy(-1.0, B)
    return largest(D) / largest(B)


@pytest.mark.parametrize("order", [1, 2])
def test_matrix_is_petsc_own(comm, order):
    balloon = make(comm, order)
    K, form = NodalMatrix(balloon.forms.tangent), balloon.forms.tangent
    K.assemble(form)
    reference = by_petsc(form)
    assert difference(K.whole(), reference) < 1e-15
    free = balloon.map.free[::2].copy()  # any components, not whole nodes alone
    rows = PETSc.IS().createGeneral(
        (3 * balloon.V.dofmap.index_map.local_range[0] + free).astype(PETSc.IntType), comm=comm
    )
    picked = pick(K, free).fill(K.blocks)
    assert difference(picked, reference.createSubMatrix(rows, rows)) < 1e-15


def test_matrices_follow_what_is_assembled(comm):
    balloon = make(comm)
    K, form = NodalMatrix(balloon.forms.tangent), balloon.forms.tangent
    K.assemble(form)
    whole, following = K.whole(), pick(K, balloon.map.free)
    picked = following.fill(K.blocks)
    ksp = PETSc.KSP().create(comm)
    ksp.setOperators(picked)
    ksp.setType("preonly")
    ksp.getPC().setType("lu")
    ksp.getPC().setFactorSolverType("mumps")
    x, b = picked.createVecs()
    b.set(1.0)
    ksp.solve(b, x)
    balloon.set_loads(0.0)
    K.assemble(form)
    assert K.whole() is whole
    assert following.fill(K.blocks) is picked
    assert difference(whole, by_petsc(form)) < 1e-15
    ksp.solve(b, x)  # PETSc knows that the values are others now
    r = b.duplicate()
    picked.mult(x, r)
    r.axpy(-1.0, b)
    assert r.norm() < 1e-9 * b.norm()


def test_a_copy_outlives_its_mesh(comm):
    balloon = make(comm)
    K = NodalMatrix(balloon.forms.tangent)
    K.assemble(balloon.forms.tangent)
    copies = [K.whole().copy(), pick(K, balloon.map.free).fill(K.blocks).copy()]
    norms = [matrix.norm() for matrix in copies]
    del K, balloon
    gc.collect()
    for matrix, norm in zip(copies, norms, strict=True):
        x, y = matrix.createVecs()
        x.set(1.0)
        matrix.mult(x, y)
        assert matrix.norm() == norm


def test_vector_is_petsc_own(comm):
    balloon = make(comm)
    form = balloon.forms.residual
    reference = dolfinx.fem.petsc.assemble_vector(form)
    reference.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)
    r = NodalVector(form)
    for _ in range(2):  # in place of what was there
        found = r.assemble(form)
        np.testing.assert_allclose(
            found, reference.array_r, rtol=0, atol=1e-15 * np.abs(found).max(initial=1)
        )
    np.testing.assert_array_equal(r.array, found)


def test_integrals_together_are_each_alone(comm):
    balloon = make(comm)
    dx, ds = balloon.dx, ufl.Measure("ds", domain=balloon.mesh, metadata={"quadrature_degree": 4})
    x = ufl.SpatialCoordinate(balloon.mesh)
    parts = [(x[2] ** 2, dx), (balloon.u[0], dx), (ufl.dot(x, x), ds), (1 + 0 * x[0], ds), (0 * x[0], dx)]
    found = totals(balloon.mesh, together(balloon.mesh, *parts))
    assert found.shape == (5,)
    alone = [integral(balloon.mesh, f * measure) for f, measure in parts[:-1]]
    np.testing.assert_allclose(found, [*alone, 0.0], rtol=1e-13, atol=1e-15)


def test_matrices_are_under_the_meshs_communicator(comm):
    """There `_petsc.tidy` frees them, and with them the communicators of their storage."""
    balloon = make(comm)
    K = NodalMatrix(balloon.forms.tangent)
    K.assemble(balloon.forms.tangent)
    other = PETSc.Vec().create(balloon.mesh.comm)
    for matrix in (K.whole(), pick(K, balloon.map.free).fill(K.blocks)):
        assert MPI.Comm.Compare(matrix.comm.tompi4py(), other.comm.tompi4py()) == MPI.IDENT
