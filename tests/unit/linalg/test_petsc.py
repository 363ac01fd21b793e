"""PETSc's seams: options that do not leak, symmetry, inertia, the direct solver."""

import gc

import numpy as np
import pytest

from lobefem import Balloon, TensionField, lobed_cylinder
from lobefem.linalg import petsc

from mpi4py import MPI
from petsc4py import PETSc


def matrix(comm, dense):
    """A distributed AIJ matrix of dense numbers."""
    dense = np.asarray(dense, dtype=float)
    A = PETSc.Mat().createAIJ(dense.shape, comm=comm)
    A.setUp()
    start, end = A.getOwnershipRange()
    for i in range(start, end):
        A.setValues(i, list(range(dense.shape[1])), dense[i])
    A.assemble()
    return A


def random(n, seed=0):
    return np.random.default_rng(seed).normal(size=(n, n))


def test_options_are_removed_after_use_and_the_users_stay():
    database = PETSc.Options("lobefem_test_")
    database["theirs"] = "7"
    try:
        with petsc.options("lobefem_test_", {"ours": 3, "theirs": 4}):
            assert database.getInt("ours") == 3
            assert database.getInt("theirs") == 7
        assert not database.hasName("ours")
        assert database.getInt("theirs") == 7
        with pytest.raises(KeyError), petsc.options("lobefem_test_", {"ours": 3}):
            raise KeyError
        assert not database.hasName("ours")
    finally:
        database.delValue("theirs")


def test_asymmetry(comm):
    A = random(9)
    assert petsc.asymmetry(matrix(comm, A + A.T)) == 0
    expected = np.abs(A - A.T).max() / np.abs(A).max()
    assert petsc.asymmetry(matrix(comm, A)) == pytest.approx(expected, rel=1e-14)
    assert petsc.asymmetry(matrix(comm, np.zeros((4, 4)))) == 0.0


@pytest.mark.parametrize("negative", [0, 1, 5])
def test_inertia(comm, negative):
    Q = np.linalg.qr(random(12))[0]
    values = np.concatenate([-np.arange(1.0, negative + 1), np.arange(1.0, 13 - negative)])
    assert petsc.num_negative(matrix(comm, Q * values @ Q.T)) == negative


@pytest.fixture
def prefix():
    """A solver's options prefix, and none of its options left afterwards."""
    yield "lobefem_test_"
    database = PETSc.Options()
    for name in [name for name in database.getAll() if name.startswith("lobefem_test_")]:
        database.delValue(name)


@pytest.mark.parametrize("symmetric", [True, False])
def test_direct_solver(comm, prefix, symmetric):
    A = random(10) + 8 * np.eye(10)
    A = A + A.T if symmetric else A
    M = matrix(comm, A)
    ksp = PETSc.KSP().create(comm)
    ksp.setOptionsPrefix(prefix)
    ksp.setOperators(M)
    petsc.set_direct_solver(ksp, symmetric)
    x, b = M.createVecs()
    x.set(1.0)
    M.mult(x, b)
    x.set(0.0)
    ksp.solve(b, x)
    np.testing.assert_allclose(x.array_r, 1.0, rtol=1e-12)
    assert ksp.getPC().getType() == ("cholesky" if symmetric else "lu")


def test_mumps_options_reach_a_solver_without_operators(comm, prefix):
    """As SNES and TS have it: the matrix comes later, and a new factor after a reset."""
    ksp = PETSc.KSP().create(comm)
    ksp.setOptionsPrefix(prefix)
    PETSc.Options(prefix)["mat_mumps_icntl_14"] = 70
    petsc.set_direct_solver(ksp, True)
    ksp.setOperators(matrix(comm, np.eye(5)))
    for _ in range(2):
        ksp.setUp()
        factor = ksp.getPC().getFactorMatrix()
        assert factor.getMumpsIcntl(24) == 1
        assert factor.getMumpsIcntl(14) == 70  # the user's
        ksp.getPC().reset()
        ksp.setOperators(matrix(comm, 2 * np.eye(5)))


def test_python_is_asked_before_each_solve_so_that_it_sees_ctrl_c(comm, monkeypatch):
    asked = []
    monkeypatch.setattr(petsc, "_look", lambda ksp, b, x: asked.append(1))
    ksp = PETSc.KSP().create(comm)
    ksp.setOptionsPrefix("lobefem_test_")
    ksp.setOperators(matrix(comm, np.eye(4)))
    petsc.set_direct_solver(ksp, True)
    b, x = ksp.getOperators()[0].createVecs()
    for _ in range(3):
        ksp.solve(b, x)
    assert len(asked) == 3
    ksp.destroy()


def test_compression_is_of_one_solver_alone(comm, prefix):
    """Solvers of one prefix come and go, large systems' and small ones'; what the user says holds for all."""
    PETSc.Options(prefix)["mat_mumps_cntl_7"] = 1e-6
    for compressed, way in ((True, 2), (False, 0), (True, 2)):
        ksp = PETSc.KSP().create(comm)
        ksp.setOptionsPrefix(prefix)
        ksp.setOperators(matrix(comm, np.eye(5)))
        petsc.set_direct_solver(ksp, True, compressed=compressed)
        ksp.setUp()
        factor = ksp.getPC().getFactorMatrix()
        assert factor.getMumpsIcntl(35) == way
        assert factor.getMumpsCntl(7) == 1e-6
        assert ksp.getType() == ("gmres" if compressed else "preonly")


def test_what_a_balloon_leaves_behind_is_freed_on_all_ranks(comm, monkeypatch):
    """On one rank Python frees it itself; on several its mesh is kept until that is done."""
    freed = []
    cleanup = PETSc.garbage_cleanup
    monkeypatch.setattr(PETSc, "garbage_cleanup", lambda c: (freed.append(c), cleanup(c)))
    gc.collect()
    petsc.tidy(comm)
    before = len(petsc._watched)
    balloon = Balloon(lobed_cylinder(1, (2, 4), comm=comm), TensionField())
    mesh_comm = balloon.mesh.comm
    balloon.tangent(balloon.map.create_vector())
    kept = before + (comm.size > 1)
    petsc.tidy(comm)
    assert len(petsc._watched) == kept
    if comm.rank:  # ranks may let go of it at different times
        del balloon
        gc.collect()
    petsc.tidy(comm)
    assert len(petsc._watched) == kept
    if not comm.rank:
        del balloon
        gc.collect()
    freed.clear()
    petsc.tidy(MPI.COMM_SELF)  # other ranks, another communicator
    assert not freed
    petsc.tidy(comm)
    assert len(petsc._watched) == before
    assert (mesh_comm in freed) == (comm.size > 1)
