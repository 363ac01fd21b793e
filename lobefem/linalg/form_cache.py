"""The cache of compiled forms, which many runs share: entries come at once, whole, and are known to be.

FFCx keeps a form as NAME.c, a library NAME.*.so, and NAME.c.cached as the word that both are there. It
compiles among them, so that a killed run, a full disk or a power cut leaves half of an entry. Here one is
compiled beside them and moved in, and NAME.c.cached, in which FFCx reads nothing, has the library's digest,
as `sha256sum -c` reads it.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import shutil
import tempfile
import time
from contextlib import suppress
from pathlib import Path

__all__ = ["examine", "is_whole", "publish", "workplace"]

_PREFIX = "lobefem-"

_DAY = 86400.0  # [s]


def is_whole(folder: Path, name: str) -> bool:
    """True if a form is there as it was put there."""
    return (folder / f"{name}.c").exists() and _library(folder, name) is not None


def workplace(folder: Path) -> Path:
    """An empty folder to compile in, on the cache's file system; the caller removes it.

    Raises:
        OSError: the cache cannot be written to.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for left in folder.glob(f"{_PREFIX}*"):  # by runs that were killed
        with suppress(FileNotFoundError):  # another run that has just ended removes its own
            if left.stat().st_mtime < time.time() - _DAY:
                shutil.rmtree(left, ignore_errors=True)
    return Path(tempfile.mkdtemp(prefix=_PREFIX, dir=folder))


def publish(workplace: Path, folder: Path) -> None:
    """Move what was compiled in a workplace into the cache, in place of what is there.

    Whoever looks meanwhile finds the old entry, none, or the new one, never a part.

    Raises:
        OSError: the cache cannot be written to.
    """
    for source in workplace.glob("*.c"):
        (library,) = workplace.glob(f"{source.stem}.*.so")
        ready = source.with_suffix(".c.cached")
        ready.write_text(f"{_digest(library)}  {library.name}\n", encoding="ascii")
        for path in (library, ready, source):  # FFCx looks for them the other way round
            os.replace(path, folder / path.name)


def examine(folder: Path) -> tuple[int, dict[str, str]]:
    """Number of forms that lobefem has put into a cache, and the faults of some, by name; each is loaded."""
    number, faults = 0, {}
    for ready in sorted(folder.glob("libffcx_*.c.cached")):
        if not _said(ready):
            continue  # another program's, or FFCx's own
        number += 1
        name = ready.name.removesuffix(".c.cached")
        library = _library(folder, name)
        if library is None:
            faults[name] = "cut short, changed or lost"
            continue
        try:
            ctypes.CDLL(str(library))
        except OSError as error:
            faults[name] = str(error)
    return number, faults


def _library(folder: Path, name: str) -> Path | None:
    """The library of an entry, None where it is not the one that was put there."""
    digest, _, file = _said(folder / f"{name}.c.cached").partition("  ")
    library = folder / file
    try:
        return library if file and _digest(library) == digest else None
    except OSError:
        return None


def _said(ready: Path) -> str:
    """The line of a digest and a file name, "" where another program wrote something else."""
    try:
        text = ready.read_text(encoding="ascii", errors="replace").rstrip("\n")
    except OSError:
        return ""
    digest, gap, file = text.partition("  ")
    return text if gap and len(digest) == 64 and file == Path(file).name else ""


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
