"""States on file, exact in every digit: what a run goes on from, on any number of ranks.

A state is kept as NumPy arrays in the mesh's input order. Files are data: nothing in them is executed.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from lobefem import checks
from lobefem.equilibrium.state import Checkpoint, Equilibrium, State
from lobefem.errors import InputError
from lobefem.fem.balloon import Balloon
from lobefem.io import npz
from lobefem.linalg import dolfinx_compat
from lobefem.typing import Array

from dolfinx import fem
from mpi4py import MPI

if TYPE_CHECKING:
    from lobefem.stability.mode_records import Mode

__all__ = ["load_modes", "load_state", "save_modes", "save_state"]

_FIELD = "field:"

_NODAL, _SMALL = ("position", "displacement"), ("plate_parameters", "pressure", "prestress")

_OWN = ("balloon", "pressure", "prestress", "unknowns", "displacement")

_MEASURED = tuple(f.name for f in dataclasses.fields(Equilibrium) if f.name not in _OWN)

_MODE = ("residual", "harmonic", "harmonics", "kind")


def save_state(
    path: str | Path,
    state: State,
    notes: Mapping[str, Any] | None = None,
    fields: Mapping[str, Array] | None = None,
) -> None:
    """Keep a state, complete or not at all. Collective.

    Args:
        path: of the file.
        state: of a balloon without temporary constraints.
        notes: plain data to keep with it.
        fields: nodal fields to keep with it, each as `displacement` is (nodes, 3).

    Raises:
        InputError: the file system refuses.
    """
    checks.having("state", state, "balloon", "a state, from inflate or ideal_state")
    balloon, comm = state.balloon, state.balloon.comm
    owned = balloon.V.dofmap.index_map.size_local
    x = balloon.X[:owned]
    parameters = balloon.map.parameters(state.vector())
    nodal = {"position": x, "displacement": state.displacement[:owned]}
    nodal |= {_FIELD + name: values[:owned] for name, values in (fields or {}).items()}
    others = {
        "plate_parameters": parameters,
        "pressure": float(state.pressure),
        "prestress": float(state.prestress),
        "notes": json.dumps(notes or {}),
    }
    count = balloon.V.dofmap.index_map.size_global
    npz.write(Path(path), comm, _input_order(balloon), count, nodal, others)


def load_state(path: str | Path, balloon: Balloon) -> Checkpoint:
    """Read a state into a balloon of the same design, on any number of ranks. Collective.

    Raises:
        InputError: no such file, not a state, or of another mesh or support.
    """
    comm, count = balloon.comm, balloon.V.dofmap.index_map.size_global
    with closing(npz.BlockReader(Path(path), comm, count, _NODAL, _SMALL)) as file:
        order = _input_order(balloon)
        x = balloon.X[: len(order)]
        parameters, *pressures = (file.others[name] for name in _SMALL)
        same = file.shape == (count, 3) and parameters.shape == (balloon.map.num_parameters,)
        same = same and all(pressure.shape == () for pressure in pressures)
        if same:
            data = {name: file.field(name, order) for name in file.names}
            size = comm.allreduce(np.abs(x).max(initial=0.0), op=MPI.MAX)
            same = bool(np.allclose(data["position"], x, rtol=0, atol=1e-9 * size))
    if not comm.allreduce(same, op=MPI.LAND):
        raise InputError(f"'{path}' is a state of another mesh or support; give this design's own")
    free = data["displacement"].ravel()[balloon.map.free]
    extra = balloon.map.local_size - len(free)  # the last rank holds the plates' parameters
    unknowns = np.concatenate([free, parameters[:extra]])
    fields = {
        name.removeprefix(_FIELD): _with_ghosts(balloon, values)
        for name, values in data.items()
        if name.startswith(_FIELD)
    }
    pressure, prestress = map(float, pressures)
    parameter = balloon.prescribed.parameter if balloon.prescribed is not None else 0.0
    return Checkpoint(balloon, pressure, prestress, unknowns, file.notes, fields, parameter=parameter)


def _with_ghosts(balloon: Balloon, owned: Array) -> Array:
    """Values of this rank's own nodes (n, 3), and of its ghosts from their owners. Collective."""
    function = fem.Function(balloon.V)
    function.x.array[: owned.size] = owned.ravel()
    function.x.scatter_forward()
    return function.x.array.reshape(-1, 3).copy()


def save_modes(path: str | Path, state: Equilibrium, modes: Sequence[Mode], notes: Mapping[str, Any]) -> None:
    """Keep a state with modes, complete or not at all. Collective.

    Args:
        path: of the file.
        state: of a balloon without temporary constraints.
        modes: of it, or of the same balloon with another tangent.
        notes: plain data to keep with them.

    Raises:
        InputError: the file system refuses.
    """
    fields: dict[str, Array] = {}
    for k, mode in enumerate(modes):
        fields[f"real:{k}"], fields[f"imag:{k}"] = mode.displacement, mode.displacement_imag
    scalars = [
        {"value": [mode.value.real, mode.value.imag]} | {name: getattr(mode, name) for name in _MODE}
        for mode in modes
    ]
    measured = {name: getattr(state, name) for name in _MEASURED}
    save_state(path, state, {"modes": scalars, "state": measured, "notes": dict(notes)}, fields)


def load_modes(path: str | Path, balloon: Balloon) -> tuple[Equilibrium, tuple[Mode, ...], Mapping[str, Any]]:
    """Read what `save_modes` has written, for a balloon of the same design. Collective.

    Raises:
        InputError: no such file, no modes, or of another mesh or support.
    """
    kept = load_state(path, balloon)
    notes = kept.notes
    if not {"modes", "state", "notes"} <= set(notes):
        raise InputError(f"'{path}' holds no modes; start afresh with --overwrite")
    balloon.set_loads(kept.pressure, kept.prestress)
    balloon.set_unknowns(kept.vector())
    try:
        return _rebuilt(balloon, kept)
    except (TypeError, KeyError, ValueError, AttributeError) as error:
        raise InputError(f"'{path}' holds no modes ({error}); start afresh with --overwrite") from None


def _rebuilt(balloon: Balloon, kept: Checkpoint) -> tuple[Equilibrium, tuple[Mode, ...], Mapping[str, Any]]:
    """State and modes from what was kept of them."""
    from lobefem.stability.mode_records import Mode  # slow to import: inflate does without

    notes = kept.notes
    measured = {name: _tupled(value) for name, value in notes["state"].items()}
    state = Equilibrium(
        balloon=balloon,
        pressure=kept.pressure,
        prestress=kept.prestress,
        unknowns=kept.unknowns,
        displacement=balloon.u.x.array.reshape(-1, 3).copy(),
        **measured,
    )
    modes = tuple(
        Mode(
            displacement=kept.fields[f"real:{k}"],
            displacement_imag=kept.fields[f"imag:{k}"],
            points=balloon.X,
            value=complex(*scalars["value"]),
            **{name: _tupled(scalars[name]) for name in _MODE},
        )
        for k, scalars in enumerate(notes["modes"])
    )
    return state, modes, notes["notes"]


def _tupled(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def _input_order(balloon: Balloon) -> npt.NDArray[np.int64]:
    """Number in the mesh's input of each node that this rank owns, in the order of V's dofs."""
    dofs = balloon.V.dofmap
    nodes = np.empty(dofs.index_map.size_local + dofs.index_map.num_ghosts, dtype=np.int64)
    # geometry and V number the same points each in its own way
    nodes[dofs.list] = dolfinx_compat.geometry_dofmap(balloon.mesh)
    numbers = np.asarray(balloon.mesh.geometry.input_global_indices, dtype=np.int64)
    return numbers[nodes[: dofs.index_map.size_local]]
