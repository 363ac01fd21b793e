"""Ctrl-C, and the end that a batch system sends: every accepted step is on file, so a run stops at once.

The end comes when Python is next asked, which during a factorisation takes a moment; a second Ctrl-C waits
for nothing. No rank unwinds its solvers, whose destructors would wait for the other ranks.
"""

from __future__ import annotations

import ctypes
import os
import signal
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import FrameType
from typing import Any

__all__ = ["Stop"]

_WORDS: dict[int, str] = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}


class Stop:
    """What ends a run from outside.

    Attributes:
        note: says where what was reached is, after "interrupted".
        hush: called first, to leave the terminal as it was.
        abandon: called next, to leave nothing half-made.
        comm: MPI communicator of all ranks, None for one process.
    """

    def __init__(self, comm: Any = None) -> None:
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
