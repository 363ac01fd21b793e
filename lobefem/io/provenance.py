"""With what a result was made: versions of everything that has a part in its digits."""

from __future__ import annotations

import platform
import subprocess
from pathlib import Path
from typing import Any

import gmsh

from lobefem.linalg.dolfinx_compat import PETSc, dolfinx
from lobefem.typing import Comm
from lobefem.version import __version__

import ufl
from mpi4py import MPI
from slepc4py import SLEPc

__all__ = ["provenance"]


def provenance(comm: Comm) -> dict[str, Any]:
    """Versions, git revision (None outside of a checkout) and number of ranks. Collective."""
    return {
        "lobefem": __version__,
        "revision": comm.bcast(_revision() if comm.rank == 0 else None, root=0),
        "python": platform.python_version(),
        "dolfinx": dolfinx.__version__,
        "petsc": ".".join(map(str, PETSc.Sys.getVersion())),
        "slepc": ".".join(map(str, SLEPc.Sys.getVersion())),
        "ufl": ufl.__version__,
        "gmsh": gmsh.__version__,
        "mpi": " ".join(MPI.Get_library_version().splitlines()[0].split(",")[0].split()),
        "ranks": comm.size,
    }


def _revision() -> str | None:
    """The commit of the checkout that this package lies in, with "-dirty" if it was changed since."""
    here = Path(__file__).parent
    if not (here.parent / ".git").exists():
        return None
    command = ["git", "-C", str(here), "describe", "--always", "--dirty", "--abbrev=12"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=10)
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip() or None
