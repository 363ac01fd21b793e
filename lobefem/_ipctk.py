"""ipctk, found to be there and to run on this processor before anything depends on it.

The wheels of ipctk 1.6.1 hold instructions (AVX-512) that many processors lack, and a process that comes to
one ends at once: no error can be caught. So one process of its own tries first.
"""

from __future__ import annotations

import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

from lobefem.errors import MissingDependencyError

__all__ = ["ADVICE", "fault_here", "load_ipctk", "trial"]

ADVICE = "pip install 'ipctk!=1.6.1'"
_TRIAL = """
import ipctk, numpy
corners, facet = numpy.eye(3), numpy.array([[0, 1, 2]])
mesh = ipctk.CollisionMesh(corners, ipctk.edges(facet), facet)
near = ipctk.NormalCollisions()
near.build(mesh, corners, 0.1)
ipctk.BarrierPotential(0.1, 1.0, True)(near, mesh, corners)
"""
_SLOW = 60.0  # [s]
_CPU = Path("/proc/cpuinfo")


def load_ipctk() -> Any:
    """The module.

    Raises:
        MissingDependencyError: it is not there.
    """
    try:
        import ipctk
    except ImportError as error:
        raise MissingDependencyError(f"self-contact needs ipctk ({error}); run: {ADVICE}") from error
    return ipctk


def fault_here(comm: Any) -> str:
    """What keeps rank 0, which does the work, from using ipctk, "" if nothing does. Collective."""
    # a processor that has them all needs no trial, which takes half a second
    fault = "" if comm.rank or _has_avx512() else trial()
    return str(comm.bcast(fault, root=0))


def _has_avx512() -> bool:
    try:
        return {"avx512f", "avx512bw", "avx512dq", "avx512vl"} <= set(_CPU.read_text().split())
    except OSError:
        return False


@cache
def trial() -> str:
    """What happens when another process uses ipctk: "" if all is well, else in words."""
    try:
        done = subprocess.run(
            [sys.executable, "-c", _TRIAL],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
            timeout=_SLOW,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"a trial of ipctk did not run ({type(error).__name__})"
    if done.returncode < 0:
        return f"ipctk uses instructions that this processor lacks (signal {-done.returncode})"
    if done.returncode:
        last = (done.stderr.strip().splitlines() or ["no reason given"])[-1]
        return f"a trial of ipctk failed ({last[:120]})"
    return ""
