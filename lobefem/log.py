"""The package's logger: silent on every rank but 0, and nothing configured at import."""

from __future__ import annotations

import logging
import sys

__all__ = ["is_root", "logger"]


def is_root() -> bool:
    """True if this process is MPI rank 0 (true where MPI was never started)."""
    mpi = sys.modules.get("mpi4py.MPI")  # importing it here would start MPI for `lobefem --help`
    return mpi is None or mpi.COMM_WORLD.rank == 0


logger = logging.getLogger("lobefem")

logger.addHandler(logging.NullHandler())

logger.addFilter(lambda record: is_root())
