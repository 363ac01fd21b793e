"""The run folder: the design, the results, fields for ParaView, and steps to go on from.

    design.toml       the validated design with all defaults filled in
    run.json          what was looked for, with which versions, and steps that are plain data
    log.txt           what was said on the way
    checkpoint.npz    the last accepted step, in the mesh's input order, for any number of ranks
    modes-1.npz ...   the modes at each pressure of a sweep, in the same way
    results.json      what the command line's --json holds
    fields.xdmf/.h5   mesh, displacement, stress resultants and modes; one time step a pressure
    state.npz         the last converged state
    *.csv             eigenvalues, history and stations by height, for spreadsheets
    report.html       what --report and `lobefem report` make of it

Every file appears complete or not at all. Rank 0 alone touches the file system (HDF5 apart), and
what goes wrong there is raised on every rank.
"""

from __future__ import annotations

import json
import logging
import shutil
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from lobefem.equilibrium.state import Checkpoint, Equilibrium, State
from lobefem.errors import InputError
from lobefem.fem.balloon import Balloon
from lobefem.files import on_root, replace, replacing, require_writable, save_json, to_json
from lobefem.io import spreadsheets, workbook
from lobefem.io.checkpoints import load_modes, load_state, save_modes, save_state
from lobefem.io.run_reader import load_run
from lobefem.io.xdmf import Snapshot, save_fields
from lobefem.log import logger
from lobefem.typing import Comm
from lobefem.units import shown

if TYPE_CHECKING:
    from lobefem.stability.mode_records import Mode

__all__ = ["RunFolder"]

_FIGURES = ("critical_pressures.png", "mesh_study.png", "eigenvalues.png", "history.png")

# what `lobefem plot` puts there by itself
_PICTURES = tuple(
    f"{what}.{suffix}"
    for what in ("modes", "stress", "state", "curves", "release")
    for suffix in ("png", "svg", "gif", "mp4")
)

_FILES = (
    "design.toml", "run.json", "results.json", "fields.xdmf", "fields.h5", "state.npz", "checkpoint.npz",
    "log.txt", "report.html", workbook.NAME, *spreadsheets.NAMES,
)  # fmt: skip


class RunFolder:
    """A folder for one run's files.

    As a context manager it keeps the log too, from the beginning of the context on, and takes an empty
    start away where bad input ended the run.

    Args:
        path: of the folder; parents are made as well.
        comm: MPI communicator.
        overwrite: whether an earlier run's files may be replaced.
        resume: whether to go on with the run that is in it.

    Raises:
        InputError: a path that cannot be a folder, one that is not empty, or none to go on with.
            Collective.

    Attributes:
        has_steps: whether there is a step in it to go on from.
        versions: with which the run began, as `begin` was told.
    """

    def __init__(
        self, path: str | Path, comm: Comm, *, overwrite: bool = False, resume: bool = False
    ) -> None:
        self.path, self.comm, self.overwrite, self.resume = Path(path), comm, overwrite, resume
        self.has_steps = False
        self.versions: dict[str, Any] = {}
        self._ours = self._fresh = False
        self._design = ""
        self._run: dict[str, Any] = {}
        self._log = _Log(self.path / "log.txt")
        self._others = on_root(comm, self.path, self._check)

    def _check(self) -> bool:
        """Refuse what cannot be; whether an earlier run's files are there to be replaced."""
        path = self.path
        if path.is_dir():
            filled = any(path.iterdir())
            if self.resume and not (path / "design.toml").is_file():
                raise InputError(f"'{path}' holds no run to go on with; leave out --resume")
            if not (self.overwrite or self.resume) and filled:
                more = ", or --resume to go on with its run" if (path / "run.json").is_file() else ""
                raise InputError(f"'{path}' is not empty; give another --out, or --overwrite{more}")
            require_writable(path)
            return filled and self.overwrite
        if path.exists():
            raise InputError(f"'{path}' is a file, not a folder; give another --out")
        if self.resume:
            raise InputError(f"there is no run in '{path}' to go on with; leave out --resume")
        require_writable(next(p for p in path.absolute().parents if p.exists()))
        return False

    def __enter__(self) -> RunFolder:
        if self.comm.rank == 0:
            self._log.attach()
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if self.comm.rank:
            return
        self._log.detach()
        if kind is not None and issubclass(kind, InputError) and self._fresh and not self.has_steps:
            for name in ("design.toml", "run.json", "log.txt"):
                (self.path / name).unlink(missing_ok=True)
            with suppress(OSError):
                self.path.rmdir()

    def begin(
        self,
        design: str,
        study: Mapping[str, Any] = MappingProxyType({}),
        versions: Mapping[str, Any] = MappingProxyType({}),
    ) -> None:
        """Make the folder ours, or find that its run is the one to go on with. Collective.

        An earlier run's files, with `overwrite`, stay until there is a first step of this one.

        Args:
            design: as TOML.
            study: plain data that says what is looked for; a run goes on with the same only.
            versions: with which the run is made.

        Raises:
            InputError: the file system refuses, another run has filled the folder meanwhile, or the
                run to go on with is another one.
        """
        if self._ours and design == self._design:
            return
        self._design = design
        if not self._ours:
            if not self._run:  # `save` knows of neither
                self._run = {
                    "study": dict(study), "design": design, "versions": dict(versions), "steps": {}
                }  # fmt: skip
                self.versions = dict(versions)
            if self._others:
                return
        self._claim()

    def _claim(self) -> None:
        self._run, self.has_steps = on_root(self.comm, self.path, self._start)
        self.versions = self._run["versions"]
        self._ours = True

    def _start(self) -> tuple[dict[str, Any], bool]:
        file = self.path / "design.toml"
        self.path.mkdir(parents=True, exist_ok=True)
        if self._ours:
            replace(file, self._design)
            return self._run, self.has_steps
        if self.resume:
            theirs = self._begun(file)
            if theirs != self._design:
                differ = [line[:60] for line in theirs.splitlines() if line not in self._design.splitlines()]
                said = f" ({', '.join(differ[:3])})" if differ else ""
                raise InputError(
                    f"the run in '{self.path}' is of another design{said}; resume it with its own "
                    "design.toml and options, or begin afresh with --overwrite or in another folder"
                )
            run = self._read()
            replace(file, self._design)  # which may be damaged, or a finer mesh's
            self._sweep()
            self._log.open()
            return run, bool(run["steps"]) or any(self.path.glob("*.npz"))
        if not self.overwrite:
            # of two runs into one folder at the same time the first one to write has it
            try:
                file.touch(exist_ok=False)
            except FileExistsError:
                raise InputError(
                    f"another run has filled '{self.path}' meanwhile; give another --out, or --overwrite"
                ) from None
            self._fresh = True
        self._sweep()
        names = (*_FILES, *_FIGURES, *_PICTURES, *(p.name for p in self.path.glob("modes-*.npz")))
        names += tuple(p.name for p in self.path.glob("fields-*.vtu"))
        for name in names:
            (self.path / name).unlink(missing_ok=True)
        shutil.rmtree(self.path / "frames", ignore_errors=True)
        replace(file, self._design)
        replace(self.path / "run.json", to_json(self._run))
        self._log.open()
        return self._run, False

    def _begun(self, file: Path) -> str:
        """The design that the run was begun with; a mesh study leaves that of its finest mesh in a file."""
        try:
            return str(json.loads((self.path / "run.json").read_text(encoding="utf-8"))["design"])
        except (OSError, ValueError, TypeError, KeyError, RecursionError):  # of an earlier version, or broken
            return file.read_text(encoding="utf-8", errors="replace")

    def _read(self) -> dict[str, Any]:
        """The content of run.json, if it is of the same study."""
        file = self.path / "run.json"
        if not file.is_file():  # of an earlier version
            return self._run
        try:
            run = json.loads(file.read_text(encoding="utf-8"))
            study, _, _ = (dict(run[name]) for name in ("study", "versions", "steps"))
        except (ValueError, TypeError, KeyError, RecursionError) as error:
            raise InputError(
                f"'{file}' says nothing of a run ({error}); start afresh with --overwrite"
            ) from None
        asked = json.loads(to_json(self._run["study"]))
        if study and asked and study != asked:
            differ = [name for name in {**study, **asked} if study.get(name) != asked.get(name)]
            said = ", ".join(f"{name.replace('_', '-')} {shown(study.get(name))}" for name in differ[:9])
            raise InputError(
                f"the run in '{self.path}' is of another study, with {said}; repeat its command and options, "
                "or begin afresh with --overwrite or in another folder"
            )
        return run

    def _sweep(self) -> None:
        """Take away what a run that was killed had begun to write."""
        for name in (*_FILES, *_FIGURES, *_PICTURES, "modes-*"):
            for hidden in self.path.glob(f".{name}-*"):
                hidden.unlink(missing_ok=True)
        for hidden in self.path.glob("frames/.*.npz-*"):
            hidden.unlink(missing_ok=True)
        for hidden in self.path.glob(".fields-*"):
            shutil.rmtree(hidden, ignore_errors=True)

    # --- steps ----------------------------------------------------------------------------------

    def _before_step(self) -> None:
        if not self._ours:
            self._claim()
        self.has_steps = True

    def keep(self, state: State, notes: Mapping[str, Any]) -> None:
        """Keep a state to go on from, with plain data, in place of the last one. Collective."""
        self._before_step()
        path = self.path / "checkpoint.npz"
        self._written(state.balloon, path, lambda: save_state(path, state, notes))

    def _written(self, balloon: Balloon, path: Path, write: Callable[[], None]) -> None:
        """Write what is of a balloon; by one rank where each has all of it, as one gore. Collective."""
        if balloon.comm.size < self.comm.size:
            on_root(self.comm, path, write)
        else:
            write()

    def kept(self, balloon: Balloon) -> Checkpoint | None:
        """The state to go on from; None where the run ended before there was one. Collective.

        Raises:
            InputError: it is of another mesh or support, or no state.
        """
        path = self._to_resume("checkpoint.npz")
        return None if path is None else load_state(path, balloon)

    def keep_modes(
        self, number: int, state: Equilibrium, modes: Sequence[Mode], notes: Mapping[str, Any]
    ) -> None:
        """Keep the modes of a state as a step of a sweep, with plain data. Collective."""
        self._before_step()
        path = self.path / f"modes-{number}.npz"
        self._written(state.balloon, path, lambda: save_modes(path, state, modes, notes))

    def kept_modes(
        self, number: int, balloon: Balloon
    ) -> tuple[Equilibrium, tuple[Mode, ...], Mapping[str, Any]] | None:
        """Read what `keep_modes` has written; None for a step that the run did not reach. Collective.

        Raises:
            InputError: it is of another mesh or support, or no state.
        """
        path = self._to_resume(f"modes-{number}.npz")
        return None if path is None else load_modes(path, balloon)

    def _to_resume(self, name: str) -> Path | None:
        path = self.path / name
        here = on_root(self.comm, path, lambda: self.resume and path.is_file())
        return path if here else None

    def keep_step(self, name: str, data: Any) -> None:
        """Keep a step that is plain data, infinite numbers as null. Collective."""
        self._before_step()
        self._run["steps"][name] = data
        save_json(self.path / "run.json", self._run, self.comm)

    def kept_step(self, name: str) -> Any:
        """Read what `keep_step` has written; None for a step that the run did not reach."""
        return self._run["steps"].get(name) if self.resume else None

    # --- results --------------------------------------------------------------------------------

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
        self._before_step()
        states = [s.state for s in snapshots if s.state is not None]
        if states:
            last = states[-1]
            if last.balloon.free is not None:
                from lobefem.equilibrium.displacement_control import release_start  # seldom needed

                # without its constraint, which no balloon that is read back knows
                last = release_start(last)
            save_state(self.path / "state.npz", last)
        if snapshots:
            save_fields(self.path, snapshots)
        for name, draw in figures.items():
            assert name in _FIGURES  # else --overwrite would leave it behind
            on_root(self.comm, self.path / name, partial(_save_figure, self.path / name, draw))
        save_json(self.path / "results.json", results, self.comm)
        on_root(self.comm, self.path, self._tabulate)

    def _tabulate(self) -> None:
        """The tables of what has been written, on one rank."""
        for name, text in spreadsheets.tables(load_run(self.path)).items():
            replace(self.path / name, text)


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
        if not self._waiting:
            return
        try:
            with self._path.open("a", encoding="utf-8") as stream:
                stream.writelines(self._waiting)
            self._waiting.clear()
        except OSError:  # of a full disk, say: no end for a run; lines wait, and what must be kept says it
            return


def _save_figure(path: Path, draw: Callable[[], Any]) -> None:
    with replacing(path) as stream:
        draw().savefig(stream, format=path.suffix[1:])
