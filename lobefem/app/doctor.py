"""`lobefem doctor`: does this installation work, part by part, and what to do where it does not."""

from __future__ import annotations

import importlib
import os
import platform
import re
import shutil
import signal
import subprocess
import sys
import uuid
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

__all__ = ["CHECKS", "Finding", "examine"]

# the process's memory map, and the file of Netlib's BLAS in it (those of others have no such number)
_MAPS, _NETLIB = Path("/proc/self/maps"), re.compile(r"\S*/libblas\.so\.3\.\d+\S*")

# how many processes Open MPI, or MPICH and its kin, started
_SIZES = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE")


@dataclass(frozen=True)
class Finding:
    """The outcome of one check.

    Attributes:
        name: what was looked at.
        fine: whether it works.
        found: a version, a number, or the error in its own words.
        advice: what to do about it, "" where it works.
    """

    name: str
    fine: bool
    found: str
    advice: str = ""


def _python() -> str:
    return f"{platform.python_version()} ({sys.prefix})"


def _stack() -> str:
    from lobefem.linalg.dolfinx_compat import PETSc, dolfinx

    # isort: split
    from slepc4py import SLEPc

    petsc, slepc = (".".join(map(str, module.Sys.getVersion())) for module in (PETSc, SLEPc))
    return f"DOLFINx {dolfinx.__version__}, PETSc {petsc}, SLEPc {slepc}"


def _scalars() -> str:
    from lobefem.linalg.dolfinx_compat import PETSc

    # isort: split
    import numpy as np

    scalar, integer = np.dtype(PETSc.ScalarType), np.dtype(PETSc.IntType)
    if scalar != np.float64:
        raise RuntimeError(f"{scalar}")
    return f"{scalar} numbers, {integer} indices"


def _mumps() -> str:
    """A 2 x 2 matrix by MUMPS's LDL^T, with its inertia."""
    from lobefem.linalg import petsc

    # isort: split
    from mpi4py import MPI
    from petsc4py import PETSc

    matrix = PETSc.Mat().createAIJ((2, 2), comm=MPI.COMM_SELF)  # type: ignore[arg-type]
    matrix.setUp()
    for row, value in enumerate((2.0, -1.0)):
        matrix.setValue(row, row, value)
    matrix.assemble()
    negative = petsc.num_negative(matrix)
    if negative != 1:
        raise RuntimeError(f"counts {negative} negative eigenvalues of diag(2, -1)")
    return "factorises"


def _blas() -> str:
    """Netlib's reference BLAS works, and takes five times as long for a factorisation."""
    from lobefem.linalg import petsc  # noqa: F401  brings it

    try:
        slow = _NETLIB.search(_MAPS.read_text(encoding="utf-8", errors="replace"))
    except OSError:
        return "not known on this system"
    if slow is not None:
        raise RuntimeError(f"{slow[0]} is Netlib's, several times slower than an optimised one")
    return "not Netlib's slow one"


def _compiler() -> str:
    """A form compiled anew where runs keep theirs: libraries cannot be loaded from everywhere."""
    from lobefem.linalg import dolfinx_compat

    # isort: split
    import ufl
    from dolfinx import fem, mesh
    from mpi4py import MPI

    square = mesh.create_unit_square(MPI.COMM_SELF, 1, 1)
    x = ufl.SpatialCoordinate(square)
    empty = dolfinx_compat.cache_folder() / f"lobefem-{uuid.uuid4().hex}"
    try:
        area = dolfinx_compat.form((1 + 0 * x[0]) * ufl.dx(square), cache_dir=empty)
        value = fem.assemble_scalar(area)
    finally:
        shutil.rmtree(empty, ignore_errors=True)
    if abs(value - 1) > 1e-12:
        raise RuntimeError(f"the unit square's area comes out as {value}")
    return "compiles forms"


def _cached() -> str:
    """Load what earlier runs have compiled."""
    from lobefem.linalg import dolfinx_compat, form_cache

    folder = dolfinx_compat.cache_folder()
    number, faults = form_cache.examine(folder)
    if faults:
        name, why = next(iter(faults.items()))
        raise RuntimeError(f"{len(faults)} of {number} in {folder} cannot be used, as {name} ({why})")
    return f"{number} in {folder}"


def _ranks() -> str:
    """All ranks see the same versions and can add up."""
    from mpi4py import MPI

    comm = MPI.COMM_WORLD
    started = next((int(os.environ[name]) for name in _SIZES if os.environ.get(name, "").isdecimal()), 1)
    if comm.size < started:
        raise RuntimeError(f"{started} processes were started, and {comm.size} of them know(s) of each other")
    said = comm.allgather((platform.python_version(), _stack()))
    if len(set(said)) > 1:
        raise RuntimeError(f"ranks differ: {'; '.join(' with '.join(one) for one in sorted(set(said)))}")
    if comm.allreduce(comm.rank + 1) != comm.size * (comm.size + 1) // 2:
        raise RuntimeError("ranks do not add up")
    library = " ".join(MPI.Get_library_version().splitlines()[0].split(",")[0].split())
    return f"{library}, {comm.size} rank(s)"


def _gmsh() -> str:
    import gmsh

    from lobefem.geometry.stacks import lobed_cylinder
    from lobefem.linalg import dolfinx_compat  # noqa: F401

    surface = lobed_cylinder(1, (2, 4), sector=True)
    if surface.mesh.topology.index_map(2).size_local != 4:
        raise RuntimeError("a sector of two cells comes out with another number")
    return str(gmsh.__version__)


def _rendering() -> str:
    import pyvista

    from lobefem.linalg import dolfinx_compat  # noqa: F401
    from lobefem.viz.rendering import can_render

    if not can_render():
        raise RuntimeError(f"PyVista {pyvista.__version__} draws nothing off-screen")
    return f"PyVista {pyvista.__version__} draws off-screen"


_TOUCH = """
import ipctk
import numpy as np

x = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 0.1), (1, 0, 0.1), (0, 1, 0.1)])
facets = np.array([(0, 1, 2), (3, 4, 5)], dtype=np.int32)
mesh = ipctk.CollisionMesh(x, ipctk.edges(facets), facets)
pairs = ipctk.NormalCollisions()
pairs.build(mesh, x, 0.2)
print(ipctk.BarrierPotential(0.2, 1.0, True)(pairs, mesh, x) > 0)
"""


def _contact() -> str:
    """Two facets repel each other, in another process: a wheel for another processor ends it."""
    ipctk = importlib.import_module("ipctk")
    name = f"ipctk {getattr(ipctk, '__version__', '')}".strip()
    touch = subprocess.run(
        [sys.executable, "-c", _TOUCH], capture_output=True, text=True, timeout=60, check=False
    )
    if touch.returncode < 0:
        killed = signal.Signals(-touch.returncode).name
        raise RuntimeError(f"{name} ends by {killed}: it was built for another processor")
    if touch.stdout.strip() != "True":
        raise RuntimeError(f"{name} finds no contact: {(touch.stderr.strip().splitlines() or ['?'])[-1]}")
    return name


CHECKS: dict[str, tuple[Callable[[], str], str]] = {
    "Python": (_python, "use Python 3.12 or newer"),
    "finite elements": (
        _stack,
        "on Debian 13 install python3-dolfinx-real python3-slepc4py-real, elsewhere run "
        "pip install 'lobefem[wheel]'",
    ),
    "scalars": (_scalars, "use a PETSc of real double-precision scalars (python3-dolfinx-real)"),
    "MUMPS": (_mumps, "use a PETSc that was built with MUMPS; Debian's and PyPI's are"),
    "BLAS": (_blas, "install an optimised one (Debian: libopenblas0-serial)"),
    "compiler": (_compiler, "install a C compiler (Debian: gcc libc6-dev), or set CC to yours"),
    "compiled forms": (
        _cached,
        "a run that needs one of these compiles it again by itself; to do so for all, remove that folder",
    ),
    "MPI": (
        _ranks,
        "start all ranks with the mpirun of the MPI that mpi4py was built with, from one installation: "
        ".venv/bin/mpirun with PyPI's, the system's with Debian's",
    ),
    "Gmsh": (_gmsh, "install Gmsh with its system libraries (Debian: python3-gmsh, or libglu1-mesa libxft2)"),
    "pictures": (_rendering, "install OpenGL (Debian: libegl1 libgl1-mesa-dri), or run under xvfb-run -a"),
    "contact": (_contact, "pip install 'ipctk>=1.6,!=1.6.1'"),
}  # fmt: skip


def examine(progress: Callable[[str], None] | None = None) -> list[Finding]:
    """Run all checks; nothing that fails ends the others. Collective.

    Args:
        progress: called with a line of text before each check.
    """
    findings = []
    for name, (check, advice) in CHECKS.items():
        if progress is not None:
            progress(f"checking {name}")
        try:
            findings.append(Finding(name, True, check()))
        except Exception as error:  # whatever is wrong is what we want to know
            own = getattr(error, "advice", "")
            said: Any = " ".join(str(error).removesuffix(f"; {own}").split()) or type(error).__name__
            findings.append(Finding(name, False, said[:200], own or advice))
    return _of_all_ranks(findings)


def _of_all_ranks(findings: list[Finding]) -> list[Finding]:
    """Each finding as the first rank has it where it is not fine."""
    try:
        from mpi4py import MPI
    except ImportError:  # one process, without MPI
        return findings
    everything = MPI.COMM_WORLD.allgather(findings)
    return [next((f for f in same if not f.fine), same[0]) for same in zip(*everything, strict=True)]
