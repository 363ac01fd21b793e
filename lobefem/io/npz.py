"""Distributed nodal fields in one NumPy file (npz), which rank 0 reads and writes block by block.

No rank ever holds more of a field than its own rows and one block.
"""

from __future__ import annotations

import json
import zipfile
from collections import deque
from collections.abc import Iterator, Mapping
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from lobefem.errors import InputError
from lobefem.files import on_root, replacing
from lobefem.typing import Array, Comm, Integers

__all__ = ["BlockReader", "write"]

_BLOCK = 1 << 18  # rows

_MOST_NOTES = 10**8  # bytes

_ROW = 24  # bytes


def write(
    path: Path,
    comm: Comm,
    numbers: Integers,
    count: int,
    fields: Mapping[str, Array],
    others: Mapping[str, Any],
) -> None:
    """Write fields in the order of their rows' numbers, complete or not at all. Collective.

    Args:
        path: of the file.
        comm: MPI communicator.
        numbers: global number of each row of this rank.
        count: rows in all.
        fields: this rank's rows (n, 3) of each field.
        others: small arrays, alike on all ranks.

    Raises:
        InputError: the file system refuses.
    """
    blocks = _blocks(comm, numbers, count, fields)

    def on_disk() -> None:
        try:
            with replacing(path) as stream, zipfile.ZipFile(stream, "w") as archive:
                for name in fields:
                    with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                        head = {"descr": "<f8", "fortran_order": False, "shape": (count, 3)}
                        np.lib.format.write_array_header_1_0(member, head)
                        for block in islice(blocks, -(-count // _BLOCK)):
                            member.write(block.tobytes())  # type: ignore[union-attr]
                for name, value in others.items():
                    with archive.open(f"{name}.npy", "w") as member:
                        np.lib.format.write_array(member, np.asarray(value), allow_pickle=False)
        finally:
            deque(blocks, maxlen=0)  # whatever went wrong here: the other ranks hand over all

    if comm.rank != 0:
        deque(blocks, maxlen=0)
    on_root(comm, path, on_disk)


def _blocks(comm: Comm, numbers: Integers, count: int, fields: Mapping[str, Array]) -> Iterator[Array | None]:
    """Each field as blocks of rows in order: on rank 0, None elsewhere. Collective."""
    order = np.argsort(numbers)
    numbers = numbers[order]
    for rows in fields.values():
        for first in range(0, count, _BLOCK):
            mine = slice(*np.searchsorted(numbers, (first, first + _BLOCK)))
            parts = comm.gather((numbers[mine] - first, rows[order[mine]]), root=0)
            block = None
            if parts is not None:
                block = np.empty((min(_BLOCK, count - first), 3))
                for at, values in parts:
                    block[at] = values
            yield block


class BlockReader:
    """A file that `write` made, open on rank 0 until `close`. What else it may hold is refused.

    Args:
        path: of the file.
        comm: MPI communicator.
        count: rows of a field.
        fields: names of fields that must be there.
        small: names of small arrays that must be there.
        what: the file ought to be, for its errors: "state".

    Attributes:
        others: small arrays by name.
        notes: the plain data in the array of that name.
        names: of the fields, in the file's order.
        shape: of all fields.

    Raises:
        InputError: no such file, or not one of these.

    Collective.
    """

    def __init__(
        self,
        path: Path,
        comm: Comm,
        count: int,
        fields: tuple[str, ...],
        small: tuple[str, ...],
        what: str = "state",
    ) -> None:
        self.path, self.comm, self.count, self.what = path, comm, count, what
        self._file: Any = None
        self._members: dict[str, Any] = {}
        try:
            begun = on_root(comm, path, partial(self._begin, fields, small))
        except BaseException:
            self.close()
            raise
        self.others, self.notes, self.names, self.shape = begun

    def _begin(
        self, fields: tuple[str, ...], small: tuple[str, ...]
    ) -> tuple[dict[str, Array], dict[str, Any], list[str], tuple[int, ...]]:
        try:
            with zipfile.ZipFile(self.path) as archive:
                parts = archive.infolist()
            if sum(part.file_size for part in parts) > _MOST_NOTES + _ROW * self.count * len(parts):
                raise InputError(
                    f"'{self.path}' is a {self.what} of another mesh or support; give this design's own"
                )
            self._file = file = np.load(self.path, allow_pickle=False)
            missing = [name for name in (*fields, *small) if name not in file.files]
            if missing:
                raise KeyError(missing[0])
            notes = json.loads(str(file["notes"]) if "notes" in file.files else "{}")
            others, shapes = {}, {}
            for name in file.files:
                if name != "notes":
                    shape, kind, by_column = self._open(name)
                    if kind != np.float64 or by_column:
                        raise self._fault("not all is numbers")
                    if len(shape) == 2:
                        shapes[name] = shape
                    else:
                        others[name] = file[name]
        except (OSError, InputError):
            raise
        except Exception as error:  # NumPy's and zipfile's are of many kinds
            raise self._fault(str(error)[:200]) from None
        if not isinstance(notes, dict) or not all(np.isfinite(value).all() for value in others.values()):
            raise self._fault("not all is numbers")
        if len(set(shapes.values())) != 1 or not (
            shapes.keys() >= set(fields) and others.keys() >= set(small)
        ):
            raise self._fault("arrays of other shapes")
        return others, notes, list(shapes), next(iter(shapes.values()))

    def _open(self, name: str) -> tuple[tuple[int, ...], Any, bool]:
        member = self._members[name] = self._file.zip.open(f"{name}.npy")
        version = np.lib.format.read_magic(member)
        read = (
            np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        )
        shape, by_column, kind = read(member)
        return shape, kind, by_column

    def _fault(self, why: str) -> InputError:
        return InputError(f"'{self.path}' holds no {self.what} ({why}); give a run's {self.what}.npz")

    def field(self, name: str, numbers: Integers) -> Array:
        """The rows (n, 3) of a field that have these numbers; each field once. Collective.

        Raises:
            InputError: the file is damaged.
        """
        order = np.argsort(numbers)
        ordered, field = numbers[order], np.empty((len(numbers), 3))
        for first in range(0, self.count, _BLOCK):
            block = on_root(self.comm, self.path, partial(self._rows, name, min(_BLOCK, self.count - first)))
            mine = slice(*np.searchsorted(ordered, (first, first + _BLOCK)))
            field[order[mine]] = block[ordered[mine] - first]
        return field

    def _rows(self, name: str, count: int) -> Array:
        try:
            rows = np.frombuffer(self._members[name].read(_ROW * count)).reshape(count, 3)
        except OSError:
            raise
        except Exception as error:  # zipfile's and its decompressors'
            raise self._fault(str(error)[:200]) from None
        if not np.isfinite(rows).all():
            raise self._fault("not all is numbers")
        return rows

    def close(self) -> None:
        """Close the file."""
        for member in self._members.values():
            member.close()
        if self._file is not None:
            self._file.close()
