"""The run folder: the design, the results, fields for ParaView, and the last state to go on from.

    design.toml     the validated design with all defaults filled in
    results.json    what the command line's --json holds
    fields.xdmf/.h5 mesh, displacement, stress resultants and modes; one time step a pressure
    state.npz       the last converged state in the mesh's input order, for any number of ranks

Every file appears complete or not at all. Rank 0 alone touches the file system (HDF5 apart), and
what goes wrong there is raised on every rank.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any
from xml.etree import ElementTree

import numpy as np
import numpy.typing as npt

from lobefem import _dolfinx
from lobefem._files import on_root, replace, replacing, require_writable, save_json
from lobefem.balloon import Balloon
from lobefem.equilibrium import Equilibrium
from lobefem.errors import InputError
from lobefem.stability import Mode

# isort: split
from dolfinx import fem
from dolfinx.io import XDMFFile

__all__ = [
    "Checkpoint",
    "RunFolder",
    "Snapshot",
    "load_state",
    "save_state",
]

Array = npt.NDArray[np.float64]
_FIGURES = ("critical_pressures.png", "mesh_study.png", "eigenvalues.png", "history.png")
_FILES = ("design.toml", "results.json", "fields.xdmf", "fields.h5", "state.npz")


@dataclass(frozen=True)
class Snapshot:
    """What there is to draw at one pressure.

    Attributes:
        balloon: the balloon that it is of.
        pressure: [Pa], the time of an animation.
        state: its displacement and stress are drawn, None for the shape as designed.
        modes: drawn as mode_1, mode_2, ..., with imaginary parts if one of a run's is complex.
    """

    balloon: Balloon
    pressure: float
    state: Equilibrium | None = None
    modes: tuple[Mode, ...] = ()


@dataclass(frozen=True)
class Checkpoint:
    """A state read back: `inflate(balloon, pressure, start=checkpoint)` goes on from it.

    Attributes:
        balloon: the balloon whose unknowns these are.
        pressure, prestress: as in `Equilibrium` [Pa].
        unknowns: this rank's part of q.
    """

    balloon: Balloon = field(repr=False)
    pressure: float
    prestress: float
    unknowns: Array = field(repr=False)

    def vector(self) -> Any:
        """The unknowns q as a PETSc vector. Collective."""
        q = self.balloon.map.create_vector()
        q.array[:] = self.unknowns
        return q


class RunFolder:
    """A folder for one run's files; nothing is made before there is something to write.

    Args:
        path: of the folder; parents are made as well.
        comm: MPI communicator.
        overwrite: whether an earlier run's files may be replaced.

    Raises:
        InputError: a path that cannot be a folder, or one that is not empty. Collective.
    """

    def __init__(self, path: str | Path, comm: Any, *, overwrite: bool = False) -> None:
        self.path, self.comm, self.overwrite = Path(path), comm, overwrite
        on_root(comm, self.path, lambda: self._check(overwrite))

    def _check(self, overwrite: bool) -> None:
        path = self.path
        if path.is_dir():
            if not overwrite and any(path.iterdir()):
                raise InputError(f"'{path}' is not empty; give another --out, or --overwrite")
            require_writable(path)
        elif path.exists():
            raise InputError(f"'{path}' is a file, not a folder; give another --out")
        else:
            require_writable(next(p for p in path.absolute().parents if p.exists()))

    def save(
        self,
        design: str,
        results: dict[str, Any],
        snapshots: Sequence[Snapshot] = (),
        figures: Mapping[str, Callable[[], Any]] = MappingProxyType({}),
    ) -> None:
        """Write all of a run; earlier files of ours go first. Collective.

        Args:
            design: the design as TOML.
            results: what --json holds.
            snapshots: what ParaView shows; the last state among them is kept to go on from.
            figures: by file name, what makes each Matplotlib figure; called on rank 0.

        Raises:
            InputError: the file system refuses.
        """

        def start() -> None:
            self.path.mkdir(parents=True, exist_ok=True)
            if not self.overwrite:
                # of two runs into one folder at the same time the first one to end has it
                try:
                    (self.path / "design.toml").touch(exist_ok=False)
                except FileExistsError:
                    raise InputError(
                        f"another run has filled '{self.path}' meanwhile; give another --out, or --overwrite"
                    ) from None
                self.overwrite = True  # it is ours from here on
            for name in (*_FILES, *_FIGURES):
                (self.path / name).unlink(missing_ok=True)
            replace(self.path / "design.toml", design)

        on_root(self.comm, self.path, start)
        states = [s.state for s in snapshots if s.state is not None]
        if states:
            save_state(self.path / "state.npz", states[-1])
        if snapshots:
            _save_fields(self.path, snapshots)
        for name, draw in figures.items():
            assert name in _FIGURES  # else --overwrite would leave it behind
            on_root(self.comm, self.path / name, partial(_save_figure, self.path / name, draw))
        save_json(self.path / "results.json", results, self.comm)


def _save_figure(path: Path, draw: Callable[[], Any]) -> None:
    with replacing(path) as stream:
        draw().savefig(stream, format=path.suffix[1:])


# --- states -------------------------------------------------------------------------------------


def save_state(path: str | Path, state: Equilibrium) -> None:
    """Keep a state as NumPy arrays in the mesh's input order. Collective.

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
        except (ValueError, EOFError) as error:
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
    return Checkpoint(balloon, float(data["pressure"]), float(data["prestress"]), unknowns)


def _input_order(balloon: Balloon) -> npt.NDArray[np.int64]:
    """Number in the mesh's input of each node that this rank owns, in the order of V's dofs."""
    dofs = balloon.V.dofmap
    nodes = np.empty(dofs.index_map.size_local + dofs.index_map.num_ghosts, dtype=np.int64)
    # geometry and V number the same points each in its own way
    nodes[dofs.list] = _dolfinx.geometry_dofmap(balloon.mesh)
    numbers = np.asarray(balloon.mesh.geometry.input_global_indices, dtype=np.int64)
    return numbers[nodes[: dofs.index_map.size_local]]


# --- fields -------------------------------------------------------------------------------------


def _save_fields(folder: Path, snapshots: Sequence[Snapshot]) -> None:
    """Write fields.xdmf and fields.h5. Collective."""
    mesh, comm = snapshots[0].balloon.mesh, snapshots[0].balloon.comm
    hidden = Path(on_root(comm, folder, lambda: tempfile.mkdtemp(prefix=".fields-", dir=folder)))

    def publish() -> None:
        text = _merged(hidden / "fields.xdmf", [s.pressure for s in snapshots])
        os.replace(hidden / "fields.h5", folder / "fields.h5")
        replace(folder / "fields.xdmf", text)

    try:
        imaginary = any(mode.value.imag for snapshot in snapshots for mode in snapshot.modes)
        with XDMFFile(comm, str(hidden / "fields.xdmf"), "w") as file:
            file.write_mesh(mesh)
            for step, snapshot in enumerate(snapshots):
                for function in _functions(snapshot, imaginary):
                    file.write_function(function, float(step))
        on_root(comm, folder, publish)
    finally:
        if comm.rank == 0:
            shutil.rmtree(hidden, ignore_errors=True)


def _functions(snapshot: Snapshot, imaginary: bool) -> list[Any]:
    balloon = snapshot.balloon
    found = []
    if snapshot.state is not None:
        found.append(_nodal(balloon, "displacement", snapshot.state.displacement))
        stress = snapshot.state.stress_resultants()
        stress.name = "stress_resultants"
        found.append(stress)
    for k, mode in enumerate(snapshot.modes, 1):
        found.append(_nodal(balloon, f"mode_{k}", mode.displacement))
        if imaginary:  # for all or for none: readers keep a field that a later step lacks
            found.append(_nodal(balloon, f"mode_{k}_imag", mode.displacement_imag))
    lobes = fem.Function(fem.functionspace(balloon.mesh, ("DG", 0)), name="lobe")
    cells = balloon.surface.lobes.indices
    lobes.x.array[cells] = balloon.surface.lobes.values
    return [*found, lobes]


def _nodal(balloon: Balloon, name: str, values: Array) -> Any:
    function = fem.Function(balloon.V, name=name)
    function.x.array[:] = values.ravel()
    return function


def _merged(path: Path, times: list[float]) -> str:
    """DOLFINx's XML with all fields of a step in one grid, its time the pressure [Pa].

    DOLFINx writes a grid a field, which ParaView shows as blocks that cannot be combined: no
    warping by a mode with the stress as colour.
    """
    root = ElementTree.parse(path).getroot()
    domain = root.find("Domain")
    assert domain is not None
    plain = next(grid for grid in domain.findall("Grid") if grid.get("GridType") == "Uniform")
    mesh = [part for part in plain if part.tag in ("Topology", "Geometry")]
    for item in domain.iter("DataItem"):
        if item.get("NumberType", "Float") == "Float":
            item.set("Precision", "8")  # left out, readers take it for single
    merged = []
    for step, time in enumerate(times):
        grid = ElementTree.Element("Grid", {"Name": "film", "GridType": "Uniform"})
        grid.extend(mesh)
        ElementTree.SubElement(grid, "Time", {"Value": repr(float(time))})
        for written in domain.iter("Grid"):
            stamp = written.find("Time")
            if stamp is not None and float(stamp.get("Value", "nan")) == step:
                grid.extend(written.findall("Attribute"))
        merged.append(grid)
    for old in domain.findall("Grid"):
        domain.remove(old)
    if len(merged) > 1:
        series = {"Name": "pressures", "GridType": "Collection", "CollectionType": "Temporal"}
        ElementTree.SubElement(domain, "Grid", series).extend(merged)
    else:
        domain.extend(merged)
    ElementTree.indent(root)
    return f'<?xml version="1.0"?>\n{ElementTree.tostring(root, encoding="unicode")}\n'
