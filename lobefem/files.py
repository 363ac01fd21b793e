"""Files that appear complete or not at all, written by rank 0, its errors raised on all ranks."""

from __future__ import annotations

import json
import math
import os
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from lobefem.errors import InputError
from lobefem.typing import Comm

__all__ = [
    "check_file",
    "on_all",
    "on_root",
    "plain",
    "replace",
    "replacing",
    "require_everywhere",
    "require_file",
    "require_writable",
    "reserve",
    "save_json",
    "share_of",
    "to_json",
]


def to_json(results: dict[str, Any]) -> str:
    """JSON text; a number that is not finite becomes null."""
    return json.dumps(plain(results), indent=2, allow_nan=False, ensure_ascii=False) + "\n"


def plain(value: Any) -> Any:
    """Data as JSON has it; a number that is not finite becomes None."""
    if isinstance(value, dict):
        return {str(key): plain(v) for key, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(v) for v in value]
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else None
    return int(value) if isinstance(value, np.integer) else value


def save_json(path: str | Path, results: dict[str, Any], comm: Comm) -> None:
    """Write results as JSON, complete or not at all. Collective.

    Raises:
        InputError: the file system refuses.
    """
    on_root(comm, Path(path), lambda: replace(Path(path), to_json(results)))


def check_file(path: str | Path, comm: Comm) -> None:
    """Refuse a path at which no file can be written, on all ranks. Collective.

    Raises:
        InputError: a folder, or a place that does not exist or may not be written to.
    """
    on_root(comm, Path(path), lambda: require_file(path))


def require_file(path: str | Path) -> None:
    """Refuse a path at which this process can write no file.

    Raises:
        InputError: a folder, or a place that does not exist or may not be written to.
    """
    if Path(path).is_dir():
        raise InputError(f"'{path}' is a folder; give a file to write")
    if Path(path).exists() and not Path(path).is_file():  # a device or a pipe stays where it is
        if not os.access(path, os.W_OK):
            raise InputError(f"'{path}' cannot be written to; give another file")
        return
    require_writable(Path(path).absolute().parent)


@contextmanager
def replacing(path: Path) -> Iterator[BinaryIO]:
    """A hidden neighbour of a file to write to; it takes the file's place once it is on disk."""
    path = path.resolve()
    if path.exists() and not path.is_file():  # a device or a pipe: nothing to replace
        with path.open("wb") as stream:
            yield stream
        return
    handle, hidden = tempfile.mkstemp(prefix=f".{path.name}-", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as stream:
            mask = os.umask(0)
            os.umask(mask)
            os.fchmod(handle, 0o666 & ~mask)  # mkstemp's are for the user alone
            yield stream
            stream.flush()
            os.fsync(handle)
        os.replace(hidden, path)
    except BaseException:
        os.unlink(hidden)
        raise


def replace(path: Path, text: str) -> None:
    """Write a text file, complete or not at all."""
    with replacing(path) as stream:
        stream.write(text.encode())


def reserve(path: Path, size: int) -> None:
    """Find out whether a file of this size [bytes] can be written, and leave none behind.

    For libraries that end the process, or say nothing, where a disk is full.
    """
    try:
        with path.open("wb") as stream:
            os.posix_fallocate(stream.fileno(), 0, size)
    finally:
        path.unlink(missing_ok=True)


def require_everywhere(comm: Comm, folder: Path) -> None:
    """Refuse a folder that is not the same on all ranks: MPI writes files from each. Collective."""
    mine = folder.is_dir() and os.access(folder, os.W_OK | os.X_OK)
    lacking = [rank for rank, has in enumerate(comm.allgather(mine)) if not has]
    if lacking:
        raise InputError(
            f"'{folder.parent}' cannot be written to from rank {lacking[0]} of {comm.size}; give a folder "
            "that all machines share, by its full path"
        )


def require_writable(folder: Path) -> None:
    """Refuse a folder that no file can be put into."""
    if not (folder.is_dir() and os.access(folder, os.W_OK | os.X_OK)):
        raise InputError(f"'{folder}' cannot be written to; give another place")


def on_root[T](comm: Comm, path: Path, action: Callable[[], T]) -> T:
    """Do something on rank 0 and give its result, or its error, to all. Collective."""
    result, fault, bug = None, "", None
    if comm.rank == 0:
        try:
            result = action()
        except InputError as error:
            fault = str(error)
        except OSError as error:
            fault = f"'{path}': {error.strerror or error}; give another place"
        except Exception as error:  # of ours; no rank is left waiting
            bug = error
    result, fault, why = comm.bcast((result, fault, "" if bug is None else repr(bug)), root=0)
    if fault:
        raise InputError(fault)
    if why:
        raise bug or RuntimeError(f"rank 0 failed: {why}")
    return result  # type: ignore[return-value]


def on_all[T](comm: Comm, action: Callable[[], T]) -> list[T]:
    """Do something on each rank by itself and give all results, or a rank's error, to all. Collective."""
    result, fault = None, None
    try:
        result = action()
    except Exception as error:  # of any kind: no rank is left waiting
        fault = error
    parts = comm.allgather((result, fault))
    for _, failure in parts:
        if failure is not None:
            raise failure
    return [part for part, _ in parts]


def share_of[T](items: Sequence[T], comm: Comm) -> list[T]:
    """The items that this rank computes: neighbours in the list, as many as the others' but for one."""
    cuts = [len(items) * k // comm.size for k in range(comm.size + 1)]
    return list(items[cuts[comm.rank] : cuts[comm.rank + 1]])
