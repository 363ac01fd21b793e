"""What the demos' command lines share: options, progress, the folder and errors."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from lobefem.errors import LobefemError


def parser(about: str, out: str, divisions: str, of: str = "of a lobe along its meridian, and around") -> Any:
    """A parser with the options that all demos have, `--out` and `--divisions`.

    Args:
        about: the demo in a few words.
        out: folder to write to, by default.
        divisions: of its mesh, by default.
        of: what these divide.
    """
    found = argparse.ArgumentParser(description=about)
    found.add_argument("--out", type=Path, default=Path(out), help="folder to write to")
    found.add_argument("--divisions", default=divisions, help=of)
    return found


def pair(options: Any, parser: Any, check: Callable[[tuple[int, int]], Any] | None = None) -> tuple[int, int]:
    """The two numbers of `--divisions`; ends the program with a sentence if they cannot be used."""
    try:
        along, around = (int(part) for part in options.divisions.split("x"))
        if check is not None:
            check((along, around))
    except (ValueError, argparse.ArgumentTypeError):
        example = parser.get_default("divisions")
        what = "two integers" if check is None else "two multiples of four"
        parser.error(f"--divisions {options.divisions}: give {what} such as {example}")
    return along, around


def speaker(comm: Any, clock: bool = False) -> Callable[[str], None]:
    """A function that prints a line of progress on rank 0, with the time if wanted."""
    begin = time.monotonic()

    def say(text: str) -> None:
        if comm.rank == 0:
            print(
                f"[{time.monotonic() - begin:5.1f} s] {text}" if clock else text, file=sys.stderr, flush=True
            )

    return say


def folder(out: str | Path, comm: Any) -> Path:
    """The folder to write to, which rank 0 makes. Collective."""
    out = Path(out)
    if comm.rank == 0:
        out.mkdir(parents=True, exist_ok=True)
    comm.Barrier()
    return out


def exit_code(comm: Any, task: Callable[[], list[str]]) -> int:
    """Run a demo's task, which returns its last lines; what goes wrong is one sentence. Collective."""
    try:
        lines = task()
    except LobefemError as error:
        if comm.rank == 0:
            print(f"demo: {error}", file=sys.stderr)
        return error.exit_code
    if comm.rank == 0:
        print("\n".join(lines))
    return 0
