"""States on file, exact in every digit: what a run goes on from, on any number of ranks.

A state is kept as NumPy arrays in the mesh's input order. Files are data: nothing in them is executed.
"""

from __future__ import annotations

import json
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from lobefem import _dolfinx
from lobefem._files import on_root, replacing
from lobefem.balloon import Balloon
from lobefem.errors import InputError

__all__ = ["Checkpoint", "Keepable", "load_state", "save_state"]

Array = npt.NDArray[np.float64]


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
    parts = comm.gather((_input_order(balloon), x, state.displacement[:owned]), root=0)

    def write() -> None:
        order = np.concatenate([part[0] for part in parts])
        position, displacement = np.empty((len(order), 3)), np.empty((len(order), 3))
        position[order] = np.concatenate([part[1] for part in parts])
        displacement[order] = np.concatenate([part[2] for part in parts])
        with replacing(Path(path)) as stream:
            np.savez(
                stream,
                position=position,
                displacement=displacement,
                plate_parameters=parameters,
                pressure=state.pressure,
                prestress=state.prestress,
                notes=np.array(json.dumps(notes or {})),
            )

    on_root(comm, Path(path), write)


def load_state(path: str | Path, balloon: Balloon) -> Checkpoint:
    """Read a state into a balloon of the same design, on any number of ranks. Collective.

    Raises:
        InputError: no such file, not a state, or of another mesh or support.
    """

    def read() -> dict[str, Array]:
        try:
            with np.load(path, allow_pickle=False) as file:
                return {name: file[name] for name in file.files}
        except (ValueError, EOFError, zipfile.BadZipFile) as error:
            raise InputError(f"'{path}' holds no state ({error}); give a run's state.npz") from None

    data = on_root(balloon.comm, Path(path), read)
    order = _input_order(balloon)
    x = balloon.V.tabulate_dof_coordinates()[: len(order)]
    position, count = data.get("position"), balloon.V.dofmap.index_map.size_global
    same = (
        position is not None
        and position.shape == (count, 3)
        and data["plate_parameters"].shape == (balloon.map.num_parameters,)
        and bool(np.allclose(position[order], x, rtol=0, atol=1e-9 * np.ptp(position)))
    )
    if not balloon.comm.allreduce(int(same)) == balloon.comm.size:
        raise InputError(f"'{path}' is a state of another mesh or support; give this design's own")
    free = data["displacement"][order].ravel()[balloon.map.free]
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
