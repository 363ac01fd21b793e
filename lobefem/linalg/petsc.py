"""Small seams to PETSc: scoped options, the direct solver, symmetry and inertia of a matrix."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np

from lobefem.errors import InputError, SolveError
from lobefem.typing import KSP, Comm, Mat, Mesh, Vec

from mpi4py import MPI
from petsc4py import PETSc

__all__ = [
    "PREFIXES",
    "SYMMETRIC",
    "asymmetry",
    "largest_entry",
    "num_negative",
    "options",
    "set_direct_solver",
    "tidy",
    "user_options",
    "watch",
]

# of the solvers' options
PREFIXES = (
    "lobefem_inflate_", "lobefem_modes_", "lobefem_critical_", "lobefem_distort_", "lobefem_release_",
    "lobefem_path_", "lobefem_inertia_",
)  # fmt: skip

# head room [%] for pivoting beyond MUMPS's estimate; null pivots are detected so that a rigid motion
# which the supports leave free does not poison the step
_MUMPS = {"mat_mumps_icntl_14": 60, "mat_mumps_icntl_24": 1}

# the last front by MUMPS itself: ScaLAPACK, which shares it among many ranks, does not tell the inertia
_INERTIA = {"mat_mumps_icntl_13": 1}

# A large matrix's fronts are of low rank block by block: MUMPS compresses them to a relative 1e-10, which
# halves the work of a factorisation at a million unknowns, and two or three steps of GMRES make up for it.
_COMPRESSED = {"mat_mumps_icntl_35": 2, "mat_mumps_cntl_7": 1e-10}

_EXACT = {"mat_mumps_icntl_35": 0, "mat_mumps_cntl_7": 0.0}

# The three unknowns of a node as one in the analysis, which then takes half the time: in blocks of three
# where the matrix is made of them alone. (MUMPS takes blocks of other sizes, too; PETSc passes them on from
# 3.23 on and on one rank only.)
_NODES, _SINGLY = {"mat_mumps_icntl_15": -3}, {"mat_mumps_icntl_15": 0}

_ours: dict[str, str] = {}  # options that `set_direct_solver` has put into PETSc's database

_watched: list[tuple[weakref.ref[Any], Any]] = []  # owners of PETSc objects, and their meshes

# relative asymmetry below which a tangent counts as symmetric
SYMMETRIC = 1e-12


def watch(owner: object, mesh: Mesh) -> None:
    """Keep an owner's mesh, with its communicator, until `tidy` has freed what it leaves behind.

    Args:
        owner: of PETSc objects on the mesh's communicator.
        mesh: of DOLFINx.
    """
    if mesh.comm.size > 1:
        _watched.append((weakref.ref(owner), mesh))


def tidy(comm: Comm) -> None:
    """Free the PETSc objects that Python has let go of on the meshes of these ranks. Collective.

    On several ranks petsc4py cannot free them when they are let go of, which may be at another place on
    each rank: it notes them down, under their communicator, until somebody asks for this. Without it a
    long run on many meshes keeps the matrices of all.

    Args:
        comm: communicator of these ranks, a mesh's or another one.
    """
    for entry in list(_watched):
        owner, mesh = entry
        if MPI.Comm.Compare(mesh.comm, comm) not in (MPI.IDENT, MPI.CONGRUENT):
            continue
        gone = mesh.comm.allreduce(owner() is None, op=MPI.LAND)
        PETSc.garbage_cleanup(mesh.comm)
        if gone:
            _watched.remove(entry)


@contextmanager
def options(prefix: str, values: Mapping[str, Any]) -> Iterator[None]:
    """Put options into PETSc's database under a prefix for a while; what the user set there stays."""
    database: Any = PETSc.Options(prefix)
    added = [name for name in values if not database.hasName(name)]
    for name in added:
        database[name] = values[name]
    try:
        yield
    finally:
        for name in added:
            database.delValue(name)


@contextmanager
def user_options(text: str) -> Iterator[Callable[[], list[str]]]:
    """Put a user's options into PETSc's database for a while; what is given tells those nothing read.

    Args:
        text: as on a command line, "-lobefem_inflate_snes_monitor -lobefem_modes_eps_tol 1e-10".

    Raises:
        InputError: text that is no options, an option of a solver that there is not, or one that PETSc
            refuses at once or when a solver reads it.
        SolveError: PETSc fails without any.
    """
    _check_options(text)
    database: Any = PETSc.Options()
    before = database.getAll()
    added: list[str] = []
    try:
        database.insertString(text)
        added = sorted(set(database.getAll()) - set(before))
        yield lambda: _unread(database, added)
    except (PETSc.Error, SystemError) as error:
        # slepc4py calls back into Python for the error's trace and then hands it on as the cause
        failure = error if isinstance(error, PETSc.Error) else error.__cause__
        if not isinstance(failure, PETSc.Error):
            raise
        reason = str(failure).splitlines()[-1].partition("] ")[2] or str(failure)
        if text:
            raise InputError(f"--petsc: PETSc refuses {text!r} ({reason}); see its manual") from error
        raise SolveError(f"PETSc failed ({reason}); try another mesh or pressure") from error
    finally:
        for name in added:
            database.delValue(name)


def _unread(database: Any, names: list[str]) -> list[str]:
    """Those of some options that nothing has asked for; none where petsc4py cannot tell (before 3.23)."""
    return [name for name in names if not database.used(name)] if hasattr(database, "used") else []


def _check_options(text: str) -> None:
    after_name = False
    for word in text.split():
        is_name = word[0] == "-" and word[1:2].isalpha()
        if not (is_name or after_name):
            raise InputError(
                f"--petsc: '{word}' is no option; write for example '-lobefem_inflate_snes_monitor'"
            )
        if is_name and word.startswith("-lobefem_") and not word[1:].startswith(PREFIXES):
            known = ", ".join(f"-{prefix}" for prefix in PREFIXES)
            raise InputError(f"--petsc: no solver takes '{word}'; theirs begin with {known}")
        after_name = is_name


def set_direct_solver(
    ksp: KSP,
    symmetric: bool,
    *,
    compressed: bool = False,
    inertia: bool = False,
    whole_nodes: bool = False,
    exact: bool = True,
) -> None:
    """Make `ksp` one MUMPS factorisation: LDL^T where the matrix is symmetric, LU where it is not.

    Options of the user's under the solver's prefix make it another solver.

    MUMPS's options stay in PETSc's database under that prefix: PETSc reads them whenever it makes
    a factor's matrix, which is when there are operators, and again after `PC.reset`.

    Args:
        ksp: with its prefix.
        symmetric: whether its matrices are.
        compressed: factors of low rank block by block, and a few steps of GMRES with them.
        inertia: whether the factors are asked for theirs.
        whole_nodes: whether the matrices consist of 3 x 3 blocks (`ConstraintMap.whole_nodes`).
        exact: False where the operator is more than the matrix that is factorised, as in
            `lobefem.linalg.rank_one`: a few steps of GMRES with its factors.
    """
    iterates = compressed or not exact
    ksp.setType(PETSc.KSP.Type.GMRES if iterates else PETSc.KSP.Type.PREONLY)
    if iterates:
        ksp.setTolerances(rtol=1e-8, max_it=30)
    pc = ksp.getPC()
    pc.setType(PETSc.PC.Type.CHOLESKY if symmetric else PETSc.PC.Type.LU)
    pc.setFactorSolverType("mumps")
    values = (
        _MUMPS
        | (_NODES if whole_nodes else _SINGLY)
        | (_COMPRESSED if compressed else _EXACT)
        | (_INERTIA if inertia else {})
    )
    prefix = pc.getOptionsPrefix() or ""
    database: Any = PETSc.Options(prefix)
    for name, value in values.items():
        # what is there may be the user's own, or of another solver that was made here
        if not database.hasName(name) or database.getString(name) == _ours.get(prefix + name):
            database[name] = value
            _ours[prefix + name] = database.getString(name)
    pc.setFromOptions()
    ksp.setFromOptions()
    ksp.setPreSolve(_look)


def _look(ksp: KSP, b: Vec, x: Vec) -> None:
    """A monitor in which Python notices Ctrl-C during an eigensolve."""


def asymmetry(matrix: Mat) -> float:
    """Relative asymmetry max|K - K^T|/max|K|. Collective."""
    transposed = matrix.transpose(PETSc.Mat())
    largest = largest_entry(matrix)
    transposed.axpy(-1.0, matrix)
    difference = largest_entry(transposed)
    transposed.destroy()
    return difference / largest if largest else 0.0


def num_negative(matrix: Mat) -> int:
    """Number of negative eigenvalues of a symmetric matrix: its inertia, from MUMPS's LDL^T. Collective."""
    pc = PETSc.PC().create(matrix.getComm())
    pc.setOptionsPrefix("lobefem_inertia_")
    pc.setOperators(matrix)
    pc.setType(PETSc.PC.Type.CHOLESKY)
    pc.setFactorSolverType("mumps")
    with options("lobefem_inertia_", _MUMPS | _INERTIA):
        pc.setFromOptions()
        pc.setUp()
    negative = pc.getFactorMatrix().getInertia()[0]
    pc.destroy()
    return int(negative)


def largest_entry(matrix: Mat) -> float:
    """max|K|. Collective."""
    largest = np.abs(matrix.getValuesCSR()[2]).max(initial=0.0)
    return float(matrix.getComm().tompi4py().allreduce(largest, op=MPI.MAX))
