"""The one answer to whether output goes to a terminal, for tables, progress and colours.

Open MPI 5 gives its ranks pseudo-terminals without columns, also where their output goes to a pipe or a
file: `isatty` is true there, tables are cut to nothing and full of escape codes.
"""

from __future__ import annotations

import os
import sys
from typing import Any

__all__ = ["console", "is_terminal", "settle"]


def is_terminal(stream: Any) -> bool:
    """True for a terminal that has columns."""
    if not stream.isatty():
        return False
    try:
        return os.get_terminal_size(stream.fileno()).columns > 0
    except (OSError, ValueError):  # no device: a program's own window, say
        return True


def settle() -> None:
    """Let standard streams that are no terminals say so, to libraries that ask them themselves."""
    for stream in (sys.stdout, sys.stderr):
        if stream.isatty() and not is_terminal(stream):
            stream.isatty = lambda: False  # type: ignore[method-assign]


def console(stream: Any, width: int | None = None) -> Any:
    """Rich's console on a stream: as wide as a terminal, `width` columns elsewhere."""
    from rich.console import Console  # slow to import, and --help does without

    terminal = is_terminal(stream)
    plain = False if stream.isatty() and not terminal else None  # Rich asks isatty
    return Console(file=stream, width=None if terminal else width, force_terminal=plain, highlight=False)
