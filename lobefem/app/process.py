"""Ctrl-C, and the end that a batch system sends: every accepted step is on file, so a run stops at once.

The end comes when Python is next asked, which during a factorisation takes a moment; a second Ctrl-C waits
for nothing. No rank unwinds its solvers, whose destructors would wait for the other ranks.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stdout, suppress
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lobefem.typing import Comm

__all__ = ["Ranks", "Stop", "stdout_to_stderr"]

# set by mpirun of Open MPI, of MPICH and its kin, and by PMIx launchers
_LAUNCHERS = ("OMPI_COMM_WORLD_RANK", "PMI_RANK", "PMIX_RANK")


class Ranks:
    """All ranks of this run; MPI is started early only where a launcher did start several.

    Errors that are not the same on all ranks must not leave the others waiting: `end` sees whether
    all have come to an end, on a communicator of its own, and aborts the run if not.
    """

    def __init__(self) -> None:
        self._comm: Any = None
        if any(name in os.environ for name in _LAUNCHERS):
            from mpi4py import MPI

            if MPI.COMM_WORLD.size > 1:
                self._comm = MPI.COMM_WORLD.Dup()
        self.stop = Stop(self._comm)

    @property
    def comm(self) -> Any:
        """A communicator of all ranks, None where there is one only."""
        return self._comm

    @property
    def is_root(self) -> bool:
        """True if this is rank 0."""
        return self._comm is None or self._comm.rank == 0

    def end(self, code: int, message: str = "", patience: float = 10.0) -> int:
        """End the run: rank 0 says the message on stderr, all ranks leave together.

        Args:
            code: exit code of this rank.
            message: one sentence, or more lines, for the user.
            patience: how long to wait for the other ranks [s].

        Returns:
            the exit code. A rank that is alone with its failure speaks itself, and aborts all.
        """
        if self.is_root and message:
            _say(message)
        if self._comm is None:
            return code
        request, limit = self._comm.Ibarrier(), time.monotonic() + patience
        while not request.Test():
            if code and time.monotonic() > limit:
                if not self.is_root and message:
                    _say(f"{message} (rank {self._comm.rank})")
                self._comm.Abort(code)
            time.sleep(0.001)
        self._comm.Free()
        return code


def _say(message: str) -> None:
    sys.stdout.flush()
    print(message, file=sys.stderr, flush=True)


@contextmanager
def stdout_to_stderr(wanted: bool) -> Iterator[None]:
    """Send what libraries print to stdout, in C or in Python, on to stderr: stdout is for JSON."""
    if not wanted:
        yield
        return
    sys.stdout.flush()
    flush_all = ctypes.CDLL(None).fflush  # C's own buffers, PETSc's and HDF5's for example
    flush_all(None)
    kept = os.dup(1)
    os.dup2(2, 1)
    try:
        with redirect_stdout(sys.stderr):
            yield
    finally:
        flush_all(None)
        os.dup2(kept, 1)
        os.close(kept)


_WORDS: dict[int, str] = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}


class Stop:
    """Interruption of a run from outside.

    Attributes:
        note: says where what was reached is, after "interrupted".
        hush: called first, to leave the terminal as it was.
        abandon: called next, to leave nothing half-made.
        comm: MPI communicator of all ranks, None for one process.
    """

    def __init__(self, comm: Comm | None = None) -> None:
        self.comm = comm
        self.note: Callable[[], str] = lambda: ""
        self.hush: Callable[[], None] = lambda: None
        self.abandon: Callable[[], None] = lambda: None

    def install(self) -> None:
        """Take SIGINT and SIGTERM over, now and after a library may have taken them."""
        if threading.current_thread() is not threading.main_thread():
            return
        for number in _WORDS:
            signal.signal(number, self._end)
            _once(number)

    def _end(self, number: int, frame: FrameType | None) -> None:
        for child in _children():
            with suppress(OSError):
                os.kill(child, number)
        rank = 0 if self.comm is None else self.comm.rank
        code = 128 + number
        if rank:
            # rank 0 speaks, unless it is held up in a long factorisation
            time.sleep(3.0)
        self.hush()
        with suppress(Exception):
            self.abandon()
        where = f" (rank {rank})" if rank else ""
        os.write(2, f"lobefem: {_WORDS[number]}{self.note()}{where}\n".encode())
        if self.comm is not None and self.comm.size > 1:
            self.comm.Abort(code)
        os._exit(code)


def _children() -> list[int]:
    """Processes that this one has started: a sweep's points, a compiler."""
    lists = Path("/proc/self/task").glob("*/children")
    return [int(child) for one in lists for child in one.read_text().split()]


def _once(number: int) -> None:
    """Let the next signal after this one end the process at once, in compiled code too.

    System V's way to handle a signal, which glibc has, puts the default back before it calls the handler.
    """
    libc = ctypes.CDLL(None)
    system_v = getattr(libc, "sysv_signal", None)
    if system_v is None:
        return
    for function in (libc.signal, system_v):
        function.restype, function.argtypes = ctypes.c_void_p, (ctypes.c_int, ctypes.c_void_p)
    handler = libc.signal(number, signal.SIG_IGN)  # Python's own, in C
    system_v(number, handler)
