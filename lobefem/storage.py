"""The run folder: the design, the results, fields for ParaView, and the last state to go on from.

    design.toml     the validated design with all defaults filled in
    results.json    what the command line's --json holds
    fields.xdmf/.h5 mesh, displacement, stress, taut film and modes; one time step a pressure
    state.npz       the last converged state in the mesh's input order, for any number of ranks

Every file appears complete or not at all. Rank 0 alone touches the file system (HDF5 apart), and
what goes wrong there is raised on every rank.
"""

from __future__ import annotations

import logging
import os
import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any
from xml.etree import ElementTree

import numpy as np
import numpy.typing as npt

from lobefem._files import on_root, replace, replacing, require_writable, save_json
from lobefem.balloon import Balloon
from lobefem.equilibrium import Equilibrium
from lobefem.errors import InputError
from lobefem.log import logger
from lobefem.stability import Mode
from lobefem.states import Checkpoint, Keepable, load_state, save_state

# isort: split
from dolfinx import fem
from dolfinx.io import XDMFFile

__all__ = [
    "RunFolder",
    "Snapshot",
]

Array = npt.NDArray[np.float64]
_FIGURES = ("critical_pressures.png", "mesh_study.png", "eigenvalues.png", "history.png")
# what `lobefem plot` puts there by itself
_PICTURES = tuple(
    f"{what}.{suffix}"
    for what in ("modes", "stress", "state", "curves", "release")
    for suffix in ("png", "svg", "gif", "mp4")
)
_FILES = (
    "design.toml", "results.json", "fields.xdmf", "fields.h5", "state.npz", "checkpoint.npz", "log.txt",
)  # fmt: skip


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


class RunFolder:
    """A folder for one run's files; nothing is made before there is something to write.

    As a context manager it keeps the log too, from the beginning of the context on.

    Args:
        path: of the folder; parents are made as well.
        comm: MPI communicator.
        overwrite: whether an earlier run's files may be replaced.
        resume: whether to go on with the run that is in it.

    Raises:
        InputError: a path that cannot be a folder, one that is not empty, or none to go on with.
            Collective.
    """

    def __init__(self, path: str | Path, comm: Any, *, overwrite: bool = False, resume: bool = False) -> None:
        self.path, self.comm, self.overwrite, self.resume = Path(path), comm, overwrite, resume
        self._ours = False
        self._log = _Log(self.path / "log.txt")
        on_root(comm, self.path, self._check)

    def _check(self) -> None:
        path = self.path
        if path.is_dir():
            if self.resume and not (path / "design.toml").is_file():
                raise InputError(f"'{path}' holds no run to go on with; leave out --resume")
            if not (self.overwrite or self.resume) and any(path.iterdir()):
                raise InputError(f"'{path}' is not empty; give another --out, or --overwrite")
            require_writable(path)
        elif path.exists():
            raise InputError(f"'{path}' is a file, not a folder; give another --out")
        elif self.resume:
            raise InputError(f"there is no run in '{path}' to go on with; leave out --resume")
        else:
            require_writable(next(p for p in path.absolute().parents if p.exists()))

    def __enter__(self) -> RunFolder:
        if self.comm.rank == 0:
            self._log.attach()
        return self

    def __exit__(self, *_: object) -> None:
        if self.comm.rank == 0:
            self._log.detach()

    def begin(self, design: str) -> None:
        """Make the folder ours: earlier files of ours go, unless their run goes on. Collective.

        Args:
            design: the design as TOML.

        Raises:
            InputError: the file system refuses, another run has filled the folder meanwhile, or the
                run to go on with is of another design.
        """

        def start() -> None:
            file = self.path / "design.toml"
            self.path.mkdir(parents=True, exist_ok=True)
            if self._ours:
                replace(file, design)
                return
            if self.resume:
                if file.read_text(encoding="utf-8") != design:
                    raise InputError(
                        f"the run in '{self.path}' is of another design; resume it with its own "
                        "design.toml and options, or leave out --resume"
                    )
                self._log.open()
                return
            if not self.overwrite:
                # of two runs into one folder at the same time the first one to write has it
                try:
                    file.touch(exist_ok=False)
                except FileExistsError:
                    raise InputError(
                        f"another run has filled '{self.path}' meanwhile; give another --out, or --overwrite"
                    ) from None
            for name in (*_FILES, *_FIGURES, *_PICTURES):
                (self.path / name).unlink(missing_ok=True)
            shutil.rmtree(self.path / "frames", ignore_errors=True)
            replace(file, design)
            self._log.open()

        on_root(self.comm, self.path, start)
        self._ours = True

    def keep(self, state: Keepable, notes: Mapping[str, Any]) -> None:
        """Keep a state to go on from, with plain data, in place of the last one. Collective."""
        save_state(self.path / "checkpoint.npz", state, notes)

    def kept(self, balloon: Balloon) -> Checkpoint | None:
        """The state to go on from; None where the run ended before there was one. Collective.

        Raises:
            InputError: it is of another mesh or support, or no state.
        """
        path = self.path / "checkpoint.npz"
        if not on_root(self.comm, path, path.is_file):
            return None
        return load_state(path, balloon)

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
        self.begin(design)
        states = [s.state for s in snapshots if s.state is not None]
        if states:
            save_state(self.path / "state.npz", states[-1])
        if snapshots:
            _save_fields(self.path, snapshots)
        for name, draw in figures.items():
            assert name in _FIGURES  # else --overwrite would leave it behind
            on_root(self.comm, self.path / name, partial(_save_figure, self.path / name, draw))
        save_json(self.path / "results.json", results, self.comm)


class _Log(logging.Handler):
    """log.txt of a run: what was said before the folder was made comes first."""

    def __init__(self, path: Path) -> None:
        super().__init__(logging.INFO)
        self.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
        self._path = path
        self._waiting: list[str] = []
        self._open = False

    def attach(self) -> None:
        self._level = logger.level
        logger.setLevel(logging.INFO)
        logger.addHandler(self)

    def detach(self) -> None:
        logger.removeHandler(self)
        logger.setLevel(self._level)
        self.close()

    def open(self) -> None:
        """From here on the file is written; each line at once, so that nothing is lost."""
        self._open = True
        self._write()

    def emit(self, record: logging.LogRecord) -> None:
        self._waiting.append(self.format(record) + "\n")
        if self._open:
            self._write()

    def _write(self) -> None:
        if self._waiting:
            with self._path.open("a", encoding="utf-8") as stream:
                stream.writelines(self._waiting)
            self._waiting.clear()


def _save_figure(path: Path, draw: Callable[[], Any]) -> None:
    with replacing(path) as stream:
        draw().savefig(stream, format=path.suffix[1:])


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
        found += [stress, snapshot.state.regions()]
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
