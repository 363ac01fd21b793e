"""The reduced tangent, written directly, against PETSc's own product of three matrices."""

import gc

import numpy as np
import pytest
from states import nodes, unknowns, wavy

from lobefem.equilibrium.displacement_control import constrain
from lobefem.equilibrium.distortions import Bend, Tip, Twist, Wave
from lobefem.fem.balloon import Balloon
from lobefem.fem.reduced_matrix import Reduction
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.model.cables import Hoops
from lobefem.model.end_plates import EndPlates
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.supports import Fixed
from lobefem.model.tension_field import TensionField

from petsc4py import PETSc

FILM = TensionField(thickness=38.1e-6, E=2e9, nu=0.3)
HALF = Fixed(lambda x: np.abs(x[2] - 1.5) < 1.2, (0, 2))  # not all components of its nodes


def make(comm, *parts, order=1, distortion=None):
    """A balloon of two lobes somewhere, under a load that is not symmetric."""
    surface = lobed_cylinder(2, (4, 7), comm=comm, order=order)
    balloon = Balloon(surface, FILM, [GasPressure("film"), *parts])
    if distortion is not None:
        balloon = constrain(balloon, distortion)
        balloon.prescribed.parameter = distortion.parameter
    balloon.set_loads(50.0)
    return balloon


def state(balloon, scale=1.0):
    y = scale * np.linspace(0.02, 0.05, balloon.map.num_parameters)
    return unknowns(balloon, scale * 0.01 * wavy(nodes(balloon), 1, 2.0), y)


def product(balloon, q):
    """J^T K J and the parameters' block, by PETSc."""
    balloon.set_unknowns(q)
    w, dw, d2w = balloon.map.displace(q, balloon.u)
    found = balloon.assembly.tangent().whole().ptap(balloon.map.jacobian(w, dw))
    if balloon.map.num_parameters:
        add_block(balloon, found, balloon.parameter_block(dw, d2w))
    return found


def add_block(balloon, matrix, block):
    """Add to the parameters' rows and columns, which the last rank has."""
    matrix.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, False)
    if balloon.comm.rank == balloon.comm.size - 1:
        c = balloon.map.parameter_columns
        matrix.setValues(c, c, block, addv=PETSc.InsertMode.ADD_VALUES)
    matrix.assemble()


def difference(A, B):
    D = A.copy()
    D.axpy(-1.0, B)
    return D.norm(PETSc.NormType.INFINITY) / B.norm(PETSc.NormType.INFINITY)


CASES = {
    "no plates": (HALF,),
    "fixed": (EndPlates("fixed", lift=0.01),),
    "clamped": (EndPlates("clamped"), Hoops(EA=1e5)),
    "pinned": (EndPlates("pinned"), Hoops(EA=1e5)),
    "no bar": (EndPlates("pinned", bar=False),),
    "half held": (EndPlates("clamped"), HALF),
}
KINDS = [Tip(0.1), Bend(8.0), Twist(5.0), Wave(2, 0.1)]


@pytest.mark.slow
@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("case", CASES)
def test_reduced_tangent_is_the_product(comm, case, order):
    balloon = make(comm, *CASES[case], order=order)
    for scale in (0.0, 1.0):  # the second one in place of the first
        q = state(balloon, scale)
        assert difference(balloon.tangent(q), product(balloon, q)) < 1e-14
    for kind in ("unit", "nodal"):
        w, dw, _ = balloon.map.plate_parameters(balloon.map.parameters(q))
        J = balloon.map.jacobian(w, dw)
        M = balloon.mass_matrix().ptap(J) if kind == "unit" else J.transposeMatMult(J)
        assert difference(balloon.mass(q, kind), M) < 1e-14


@pytest.mark.parametrize("distortion", KINDS, ids=lambda kind: type(kind).__name__)
def test_reduced_tangent_under_a_guide_is_the_product(comm, distortion):
    balloon = make(comm, EndPlates("clamped"), distortion=distortion)
    q = state(balloon)
    assert difference(balloon.tangent(q), product(balloon, q)) < 1e-14


def test_solvers_see_new_values(comm):
    balloon = make(comm, EndPlates("clamped"))
    ksp = PETSc.KSP().create(comm)
    ksp.setType("preonly")
    ksp.getPC().setType("lu")
    ksp.getPC().setFactorSolverType("mumps")
    for scale in (0.0, 1.0):
        q = state(balloon, scale)
        K = balloon.tangent(q)
        ksp.setOperators(K)
        x, b = K.createVecs()
        b.set(1.0)
        ksp.solve(b, x)
        r = b.duplicate()
        K.mult(x, r)
        r.axpy(-1.0, b)
        assert r.norm() < 1e-9 * b.norm()


def test_the_matrix_outlives_what_made_it(comm):
    balloon = make(comm, EndPlates("clamped"))
    q = state(balloon)
    expected = product(balloon, q)
    w, dw, _ = balloon.map.plate_parameters(balloon.map.parameters(q))
    K = balloon.assembly.tangent()
    M = Reduction(K, balloon.map).fill(K, w, dw)
    gc.collect()
    _, dw, d2w = balloon.map.displace(q, balloon.u)
    add_block(balloon, M, balloon.parameter_block(dw, d2w))
    assert difference(M, expected) < 1e-14
