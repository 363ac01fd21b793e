"""Running a parameter study: each point a process, each row kept, one table at the end.

A point is a `lobefem` process of its own on a design file of its own, so that a failure, however hard, ends
that point alone, and anyone can repeat a row by hand. What it found is kept under the hash of its
inputs: a study that was stopped, or grew, computes only what it does not have.
"""

from __future__ import annotations

import csv
import io
import json
import os
import shutil
import subprocess
import sys
import time
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from lobefem.app.sweep_file import Point, Study
from lobefem.app.sweep_meshes import mesh_study
from lobefem.errors import InputError
from lobefem.files import replace
from lobefem.io.result_keys import COMMANDS, COMMON
from lobefem.progress import Progress, said
from lobefem.typing import Comm
from lobefem.version import __version__
from lobefem.viz.style import MM, STYLE

__all__ = ["QUANTITIES", "Row", "as_csv", "begin", "parameter_chart", "results", "run", "table", "workers"]

# what a row shows of each command's results, the first of them in the chart
QUANTITIES = {
    "inflate": ("volume", "max_displacement", "strain_energy", "bar_force", "max_stress"),
    "modes": ("lowest", "stable"),
    "critical": ("critical_pressure", "harmonic", "kind", "max_stress"),
    "harmonics": ("critical_pressure", "harmonic"),
    "perturb": ("imposed_ratio", "volume_final", "min_eigenvalue", "outcome"),
}

_LOWEST = "Pa/m"  # in N/m with nodal mass

# exit codes that may not come again: a fault of ours, input or surroundings (a full disk, a library that is
# missing) that are soon refused again, an interruption, a batch system's end
_UNKEPT = (1, 2, 130, 143)

# what an MPI launcher tells its ranks; a process that inherits it takes itself for one of them
_LAUNCHER = ("OMPI_", "PMIX_", "PMI_", "PRTE_", "HYDI_", "HYDRA_", "MPIR_", "MPI_")


@dataclass(frozen=True)
class Row:
    """The result of one point of a sweep.

    Attributes:
        values: by the name of what varies.
        folder: its run folder, below the study's; empty where there is none.
        exit_code: of its process; 0 where it found what it was asked for.
        reason: why not.
        seconds: that it took.
        found: quantities of `QUANTITIES`.
        warnings: of its command.
    """

    values: Mapping[str, Any]
    folder: str
    exit_code: int
    reason: str
    seconds: float
    found: Mapping[str, Any]
    warnings: Sequence[str] = ()


def run(
    study: Study,
    folder: str | Path,
    executor: Executor,
    *,
    progress: Progress | None = None,
) -> list[Row]:
    """All rows, those of earlier runs from the folder, the others computed.

    Args:
        study: from `load`.
        folder: of the study; points are kept in its folder `points`.
        executor: whose workers each run one point at a time, from `workers`.
        progress: called with a line of text after each point.

    Returns:
        a row a point, in the study's order.
    """
    kept = Path(folder) / "points"
    rows = {i: _known(point, kept) for i, point in enumerate(study.points)}
    todo: dict[str, list[int]] = {}  # designs may be alike: the same name is computed once
    for i, row in rows.items():
        if row is None:
            todo.setdefault(study.points[i].name, []).append(i)
    done = len(rows) - sum(map(len, todo.values()))
    futures = {executor.submit(_solve, study.points[each[0]], str(kept)): each for each in todo.values()}
    try:
        for future in as_completed(futures):
            row = future.result()
            for i in futures[future]:
                rows[i] = Row(**(asdict(row) | {"values": study.points[i].values}))
            done += len(futures[future])
            if progress is not None:
                progress(said(f"{done} of {len(rows)} points", done / len(rows)))
    except BaseException:
        for future in futures:
            future.cancel()
        raise
    return [row for row in rows.values() if row is not None]


def _known(point: Point, kept: Path) -> Row | None:
    if point.fault:
        return Row(point.values, "", 2, point.fault, 0.0, {})
    try:
        row = json.loads((kept / f"{point.name}.json").read_text(encoding="utf-8"))
        return Row(**(row | {"values": point.values}))
    except (OSError, ValueError, TypeError):
        return None


def _solve(point: Point, kept: str) -> Row:
    """Run one point as a process and keep its row."""
    folder = Path(kept) / point.name
    file = folder.with_suffix(".toml")
    replace(file, point.design)
    command = [sys.executable, "-m", "lobefem", point.command, str(file), *point.options]
    # one that was stopped halfway goes on
    command += ["--out", str(folder), "--resume" if (folder / "run.json").is_file() else "--overwrite"]
    calm = {k: v for k, v in os.environ.items() if not k.startswith(_LAUNCHER)}
    start = time.monotonic()
    process = subprocess.run(
        command,
        env={"OMP_NUM_THREADS": "1"} | calm,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
    )
    seconds = round(time.monotonic() - start, 2)
    found: dict[str, Any] = {}
    reason, warnings = "", []
    if process.returncode == 0:
        results = json.loads((folder / "results.json").read_text(encoding="utf-8"))
        found = {key: _quantity(results, key) for key in QUANTITIES[point.command]}
        if point.command in ("critical", "harmonics") and not found["critical_pressure"]:
            reason = str(results.get("reason") or "")  # an empty cell, or a zero, says nothing
        warnings = results["warnings"]
    elif process.returncode < 0:
        reason = f"its process was ended by signal {-process.returncode}; out of memory, perhaps"
    else:
        lines = [line for line in process.stderr.splitlines() if line.startswith("lobefem: ")]
        reason = lines[-1].removeprefix("lobefem: ") if lines else "its process said nothing"
    where = f"points/{point.name}" if folder.is_dir() else ""
    row = Row(point.values, where, process.returncode, reason, seconds, found, warnings)
    if process.returncode >= 0 and process.returncode not in _UNKEPT:
        replace(folder.with_suffix(".json"), json.dumps(asdict(row), indent=2) + "\n")
    return row


def _quantity(results: Mapping[str, Any], key: str) -> Any:
    if results["command"] != "modes":
        return results[key]
    entries = results["pressures"]
    if key == "stable":
        return all(entry["stable"] for entry in entries)
    return min(mode["real"] for entry in entries for mode in entry["modes"])


def workers(number: int, comm: Comm | None = None) -> Any:
    """A context manager with the executor that runs the points.

    Args:
        number: of processes at a time on this machine.
        comm: MPI communicator of several ranks, or None. Then each rank but the first runs points, on
            its machine, and the context gives None to them once all is done. Collective.

    Raises:
        InputError: MPI bears no second thread, which hands out the points.
    """
    if comm is None:
        return ThreadPoolExecutor(number)
    from mpi4py import MPI
    from mpi4py.futures import MPICommExecutor

    if MPI.Query_thread() < MPI.THREAD_SERIALIZED:  # alike on all ranks
        raise InputError(
            "this MPI was started without threads; start the sweep without mpirun, with --workers"
        )

    return MPICommExecutor(comm, root=0)


# --- keeping ------------------------------------------------------------------------------------
def begin(study: Study, folder: str | Path, *, resume: bool = False, overwrite: bool = False) -> None:
    """Make a folder the study's own.

    Raises:
        InputError: it holds something and is neither to be gone on with nor to be replaced, or the
            file system refuses.
    """
    path = Path(folder)
    try:
        if path.exists() and not path.is_dir():
            raise InputError(f"'{path}' is a file, not a folder; give another --out")
        ours = (path / "sweep.toml").is_file()
        if resume and not ours:
            raise InputError(f"'{path}' holds no sweep to go on with; leave out --resume")
        if not (resume or overwrite) and path.is_dir() and any(path.iterdir()):
            raise InputError(f"'{path}' is not empty; go on with --resume, replace it with --overwrite")
        if overwrite and ours:
            shutil.rmtree(path / "points", ignore_errors=True)
        (path / "points").mkdir(parents=True, exist_ok=True)
        for name in ("results.json", "table.csv", "sweep.png"):
            (path / name).unlink(missing_ok=True)
        replace(path / "sweep.toml", study.text)
    except OSError as error:
        raise InputError(f"'{path}': {error.strerror or error}; give another place") from None


def table(study: Study, rows: Sequence[Row]) -> Iterator[list[str]]:
    """The rows as text, the head first, with the units of what was found."""
    quantities = QUANTITIES[study.command]
    yield [*study.varied, *(_headed(study.command, key) for key in quantities), "seconds", "reason"]
    for row in rows:
        values = [row.values[name] for name in study.varied]
        found = [row.found.get(key) for key in quantities]
        yield [*map(_cell, [*values, *found]), f"{row.seconds:.1f}", row.reason]


def _headed(command: str, key: str) -> str:
    unit = _LOWEST if key == "lowest" else (COMMON | COMMANDS[command]).get(key, ("",))[0]
    return f"{key} [{unit}]" if unit else key


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.8g}"
    return "" if value is None else str(value).lower() if isinstance(value, bool) else str(value)


def results(study: Study, rows: Sequence[Row]) -> dict[str, Any]:
    """The study as plain data."""
    failed = sum(row.exit_code != 0 for row in rows)
    done = [row for row in rows if row.exit_code == 0 and "critical_pressure" in row.found]
    meshes = mesh_study(
        study.varied, [row.values for row in done], [row.found["critical_pressure"] for row in done]
    )
    return {
        "schema": 1,
        "command": "sweep",
        "of": study.command,
        "version": __version__,
        "varied": study.varied,
        "design_pressure": _design_pressure(study),
        "rows": [asdict(row) for row in rows],
        "failed": failed,
        "warnings": [
            *([f"{failed} of {len(rows)} points failed; see their reasons"] if failed else []),
            *dict.fromkeys(warning for row in rows for warning in row.warnings),
        ],
    } | meshes


def _design_pressure(study: Study) -> float | None:
    """The pressure of all points' designs [Pa]; None where they have several."""
    values = {str(p.design): tomllib.loads(p.design)["pressure"]["value"] for p in study.points if p.design}
    found = {one for value in values.values() for one in (value if isinstance(value, list) else [value])}
    return float(found.pop()) if len(found) == 1 else None


def as_csv(study: Study, rows: Sequence[Row]) -> str:
    """The table for a spreadsheet."""
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows(table(study, rows))
    return stream.getvalue()


# Okabe and Ito's, each with a mark and a dash of its own for those who see no colours
_LINES = (
    ("#0072B2", "o", "-"), ("#D55E00", "s", "--"), ("#009E73", "^", "-."), ("#B4588F", "D", ":"),
    ("#E69F00", "v", "-"), ("#56B4E9", "P", "--"), ("black", "X", "-."),
)  # fmt: skip

_UNITS = {
    "volume": "volume [m³]",
    "lowest": "lowest eigenvalue [Pa/m, or N/m with nodal mass]",
    "critical_pressure": "critical pressure [Pa]",
    "imposed_ratio": "imposed / original volume",
}

_CROWD = 14  # more lines than that have no key that could be read


def parameter_chart(study: Study, rows: Sequence[Row], *, width: float = 120.0) -> Figure:
    """The first quantity of each row over the first number that varies; a line for each rest.

    Without a number that varies, the rows are named along the axis. Points that found nothing are left
    out.

    Args:
        study: what was computed.
        rows: what was found, in the study's order.
        width: of the figure [mm].
    """
    quantity = QUANTITIES[study.command][0]
    numeric = [name for name in study.varied if len(_numbers(rows, name)) > 1]
    along = numeric[0] if numeric else None
    others = [name for name in study.varied if name != along]
    lines: dict[str, list[tuple[Any, float]]] = {}
    for row in rows:
        y = row.found.get(quantity)
        if y is None:
            continue
        rest = ", ".join(_named(name, row.values[name]) for name in others)
        lines.setdefault(rest if along else "", []).append((row.values[along] if along else rest, y))
    with rc_context(STYLE):
        figure = Figure(figsize=(width * MM, 0.62 * width * MM), layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.add_subplot()
        for k, (name, points) in enumerate(lines.items()):
            colour, mark, dash = _LINES[k % len(_LINES)]
            x, y = zip(*(sorted(points) if along else points), strict=True)
            axes.plot(x, y, mark + (dash if along else ""), color=colour, ms=3, lw=0.9, label=name)
        values = [y for points in lines.values() for _, y in points]
        if values and min(values) > 0 and max(values) > 8 * min(values):
            axes.set_yscale("log")
        elif values and min(values) < 0 < max(values):
            axes.axhline(0.0, color="0.6", lw=0.6, zorder=0)
        if not values:
            axes.text(0.5, 0.5, "no point found anything", transform=axes.transAxes, ha="center")
        if along is None:
            axes.tick_params(axis="x", rotation=30)
        axes.set(xlabel=along or "", ylabel=_UNITS[quantity], title=f"lobefem {study.command}")
        axes.spines[["top", "right"]].set_visible(False)
        if 1 < len(lines) <= _CROWD:
            figure.legend(frameon=False, fontsize=6, loc="outside right upper")
    return figure


def _numbers(rows: Sequence[Row], name: str) -> set[float]:
    values = [row.values[name] for row in rows]
    plain = all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in values)
    return set(values) if plain else set()


def _named(name: str, value: Any) -> str:
    key = name.rpartition(".")[2].replace("_", " ")
    return str(value) if isinstance(value, str) else f"{key} {value}"
