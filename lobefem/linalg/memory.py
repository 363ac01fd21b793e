"""A check that a computation fits into memory: refused beforehand, not killed half-way by the system."""

from __future__ import annotations

import os
from pathlib import Path

from lobefem.errors import InputError
from lobefem.typing import Comm

from mpi4py import MPI

__all__ = ["require_memory"]

_SMALL = 2**30  # what any machine has [bytes]; less is not looked at

_LIMIT = Path("/sys/fs/cgroup/memory.max")  # a container's


def require_memory(comm: Comm, needed: float, what: str, remedy: str) -> None:
    """Refuse what does not fit into the memory of the machines that run it. Collective.

    Args:
        comm: MPI communicator; the memory of its machines is added up.
        needed: bytes, alike on all ranks.
        what: what needs them.
        remedy: what to try.

    Raises:
        InputError: there is less.
    """
    if needed <= _SMALL:
        return
    machine = comm.Split_type(MPI.COMM_TYPE_SHARED)
    memory = comm.allreduce(_memory() if machine.rank == 0 else 0)
    machine.Free()
    if needed > memory:
        raise InputError(
            f"{what} needs about {needed / 1e9:.3g} GB of memory, of {memory / 1e9:.3g} GB that there are; "
            f"{remedy}"
        )


def _memory() -> int:
    """Bytes of memory of this machine, or of this container."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    try:
        return min(memory, int(_LIMIT.read_text()))
    except (OSError, ValueError):  # no such limit, or "max"
        return memory
