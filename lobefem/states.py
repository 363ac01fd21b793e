"""States on file, exact in every digit: what a run goes on from, on any number of ranks.

A state is kept as NumPy arrays in the mesh's input order. Files are data: nothing in them is executed.
Rank 0 reads and writes, a block of rows at a time: no rank ever holds more of a field than that.
"""

from __future__ import annotations

import json
import zipfile
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from lobefem import _dolfinx
from lobefem._files import on_root, replacing
from lobefem.balloon import Balloon
from lobefem.errors import InputError

# isort: split
from mpi4py import MPI

__all__ = ["Checkpoint", "Keepable", "load_state", "save_state"]

Array = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
_FIELDS = ("position", "displacement")  # (nodes, 3) each
_BLOCK = 1 << 18  # rows


class Keepable(Protocol):
    """What can be kept: an `Equilibrium`, or unknowns in motion."""

    @property
    def balloon(self) -> Balloon:
        """The balloon whose state it is."""

    @property
    def pressure(self) -> float:
        """Gas pressure [Pa]."""

    @property
    def prestress(self) -> float:
        """Pressure of the built-in stress [Pa]."""

    @property
    def displacement(self) -> Array:
        """This rank's nodal displacements, ghosts included, (nodes, 3) [m]."""

    def vector(self) -> Any:
        """The unknowns q as a PETSc vector. Collective."""


@dataclass(frozen=True)
class Checkpoint:
    """A state read back: `inflate(balloon, pressure, start=checkpoint)` goes on from it.

    Attributes:
        balloon: the balloon whose unknowns these are.
        pressure, prestress: as in `Equilibrium` [Pa].
        unknowns: this rank's part of q.
        notes: what was kept with it.
    """

    balloon: Balloon = field(repr=False)
    pressure: float
    prestress: float
    unknowns: Array = field(repr=False)
    notes: Mapping[str, Any] = field(default_factory=dict, repr=False)

    def vector(self) -> Any:
        """The unknowns q as a PETSc vector. Collective."""
        q = self.balloon.map.create_vector()
        q.array[:] = self.unknowns
        return q


def save_state(path: str | Path, state: Keepable, notes: Mapping[str, Any] | None = None) -> None:
    """Keep a state, complete or not at all. Collective.

    Args:
        path: of the file.
        state: of a balloon without temporary constraints.
        notes: plain data to keep with it.

    Raises:
        InputError: the file system refuses.
    """
    balloon, comm = state.balloon, state.balloon.comm
    owned = balloon.V.dofmap.index_map.size_local
    x = balloon.V.tabulate_dof_coordinates()[:owned]
    parameters = balloon.map.parameters(state.vector())
    count = balloon.V.dofmap.index_map.size_global
    small = {
        "plate_parameters": parameters,
        "pressure": state.pressure,
        "prestress": state.prestress,
        "notes": json.dumps(notes or {}),
    }
    blocks = _in_blocks(comm, _input_order(balloon), (x, state.displacement[:owned]), count)

    def write() -> None:
        try:
            with replacing(Path(path)) as stream, zipfile.ZipFile(stream, "w") as archive:
                for name in _FIELDS:
                    with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                        head = {"descr": "<f8", "fortran_order": False, "shape": (count, 3)}
                        np.lib.format.write_array_header_1_0(member, head)
                        for block in islice(blocks, -(-count // _BLOCK)):
                            member.write(block.tobytes())  # type: ignore[union-attr]
                for name, value in small.items():
                    with archive.open(f"{name}.npy", "w") as member:
                        np.lib.format.write_array(member, np.asarray(value), allow_pickle=False)
        finally:
            deque(blocks, maxlen=0)  # whatever went wrong here: the other ranks hand over all

    if comm.rank != 0:
        deque(blocks, maxlen=0)
    on_root(comm, Path(path), write)


def load_state(path: str | Path, balloon: Balloon) -> Checkpoint:
    """Read a state into a balloon of the same design, on any number of ranks. Collective.

    Raises:
        InputError: no such file, not a state, or of another mesh or support.
    """
    file, comm = _StateFile(Path(path)), balloon.comm
    with closing(file):
        data, shape = on_root(comm, file.path, file.read)
        order = _input_order(balloon)
        x = balloon.V.tabulate_dof_coordinates()[: len(order)]
        count = balloon.V.dofmap.index_map.size_global
        same = shape == (count, 3) and data["plate_parameters"].shape == (balloon.map.num_parameters,)
        if same:
            position, displacement = (_from_blocks(comm, file, name, order, count) for name in _FIELDS)
            size = comm.allreduce(np.abs(x).max(initial=0.0), op=MPI.MAX)
            same = bool(np.allclose(position, x, rtol=0, atol=1e-9 * size))
    if not comm.allreduce(same, op=MPI.LAND):
        raise InputError(f"'{path}' is a state of another mesh or support; give this design's own")
    free = displacement.ravel()[balloon.map.free]
    extra = balloon.map.local_size - len(free)  # the last rank holds the plates' parameters
    unknowns = np.concatenate([free, data["plate_parameters"][:extra]])
    notes = json.loads(str(data["notes"])) if "notes" in data else {}
    return Checkpoint(balloon, float(data["pressure"]), float(data["prestress"]), unknowns, notes)


def _input_order(balloon: Balloon) -> npt.NDArray[np.int64]:
    """Number in the mesh's input of each node that this rank owns, in the order of V's dofs."""
    dofs = balloon.V.dofmap
    nodes = np.empty(dofs.index_map.size_local + dofs.index_map.num_ghosts, dtype=np.int64)
    # geometry and V number the same points each in its own way
    nodes[dofs.list] = _dolfinx.geometry_dofmap(balloon.mesh)
    numbers = np.asarray(balloon.mesh.geometry.input_global_indices, dtype=np.int64)
    return numbers[nodes[: dofs.index_map.size_local]]


def _in_blocks(comm: Any, numbers: Integers, fields: Sequence[Array], count: int) -> Iterator[Array | None]:
    """Distributed fields, one after the other, as blocks of rows in order on rank 0. Collective.

    Args:
        comm: MPI communicator.
        numbers: global number of each row of this rank.
        fields: this rank's rows of each field.
        count: rows in all.

    Yields:
        the next block on rank 0, None elsewhere.
    """
    order = np.argsort(numbers)
    numbers = numbers[order]
    for rows in fields:
        for first in range(0, count, _BLOCK):
            mine = slice(*np.searchsorted(numbers, (first, first + _BLOCK)))
            parts = comm.gather((numbers[mine] - first, rows[order[mine]]), root=0)
            block = None
            if parts is not None:
                block = np.empty((min(_BLOCK, count - first), 3))
                for at, values in parts:
                    block[at] = values
            yield block


def _from_blocks(comm: Any, file: _StateFile, name: str, numbers: Integers, count: int) -> Array:
    """This rank's rows of a field that rank 0 reads block by block. Collective."""
    order = np.argsort(numbers)
    ordered, field = numbers[order], np.empty((len(numbers), 3))
    for first in range(0, count, _BLOCK):
        block = on_root(comm, file.path, partial(file.rows, name, min(_BLOCK, count - first)))
        mine = slice(*np.searchsorted(ordered, (first, first + _BLOCK)))
        field[order[mine]] = block[ordered[mine] - first]
    return field


class _StateFile:
    """A state's file, open on the rank that reads it.

    Args:
        path: of the file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file: Any = None
        self._members: dict[str, Any] = {}

    def read(self) -> tuple[dict[str, Array], tuple[int, ...] | None]:
        """All but the fields, and their common shape, None where there is none.

        Raises:
            InputError: it is no such file.
        """
        try:
            self._file = np.load(self.path, allow_pickle=False)
            small = {name: self._file[name] for name in self._file.files if name not in _FIELDS}
            shapes = {self._shape(name) for name in _FIELDS}
        except (ValueError, EOFError, AttributeError, zipfile.BadZipFile) as error:
            raise InputError(f"'{self.path}' holds no state ({error}); give a run's state.npz") from None
        return small, shapes.pop() if len(shapes) == 1 else None

    def _shape(self, name: str) -> tuple[int, ...] | None:
        if name not in self._file.files:
            return None
        member = self._members[name] = self._file.zip.open(f"{name}.npy")
        np.lib.format.read_magic(member)
        shape, by_column, kind = np.lib.format.read_array_header_1_0(member)
        return None if by_column or kind != np.dtype("<f8") else shape

    def rows(self, name: str, count: int) -> Array:
        """The next rows of a field.

        Raises:
            InputError: the file is damaged.
        """
        try:
            return np.frombuffer(self._members[name].read(24 * count)).reshape(count, 3)
        except (ValueError, EOFError, zipfile.BadZipFile) as error:
            raise InputError(f"'{self.path}' is damaged ({error}); give a run's state.npz") from None

    def close(self) -> None:
        """Close it."""
        for member in self._members.values():
            member.close()
        if self._file is not None and hasattr(self._file, "close"):
            self._file.close()
