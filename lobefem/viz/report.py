"""The report of a run folder: one HTML file that needs no network, drawn from what the folder holds.

The page's own script and Plotly's are inside it. A content security policy forbids everything else,
so that nothing that a design or a folder is called can load or run anything.
"""

from __future__ import annotations

import base64
import hashlib
import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Any

import jinja2
import markupsafe
from plotly.offline import get_plotlyjs

from lobefem import files
from lobefem.errors import InputError
from lobefem.io.run_reader import Run, find_runs, load_run
from lobefem.log import logger
from lobefem.version import __version__
from lobefem.viz import pumpkin_charts, report_charts, report_shapes, report_tables
from lobefem.viz.assumptions import assumptions
from lobefem.viz.report_charts import Chart
from lobefem.viz.report_shapes import Picture
from lobefem.viz.report_tables import Table
from lobefem.viz.style import REGIONS
from lobefem.viz.verdict import verdict

__all__ = ["FILE", "write_report"]

FILE = "report.html"

TABLES = "tables.json"  # what stands beside the runs in a folder of them: a title, and tables

ROOM = 5_000_000  # bytes of a report for its 3D views

_COMMANDS = {
    "inflate": "Equilibrium under gas pressure",
    "modes": "Buckling modes",
    "critical": "Critical pressure",
    "harmonics": "Critical pressure of each harmonic",
    "mesh-study": "Critical pressure under mesh refinement",
    "perturb": "Distortion and release",
    "sweep": "Sweep",
    "sensitivities": "What makes the balloon more stable",
}


@dataclass(frozen=True)
class _Section:
    """A heading of the page and what is below it."""

    title: str
    id: str
    note: str = ""
    sentences: Sequence[str] = ()
    charts: Sequence[Chart] = ()
    tables: Sequence[Table] = ()
    pictures: Sequence[Picture] = ()
    files: Mapping[str, str] = field(default_factory=dict)  # texts by name, folded away


@dataclass(frozen=True)
class _Part:
    """One run's part of the page."""

    run: Run
    id: str
    title: str
    subtitle: str
    warnings: list[str]
    verdict: list[str]
    sections: list[_Section]
    scene: dict[str, Any] | None  # for the 3D view
    views_left: int


def write_report(folder: str | Path) -> Path:
    """Write report.html into a run folder, or into a folder of run folders.

    Args:
        folder: what a command's --out has made, or a folder that holds such folders.

    Returns:
        the file's path.

    Raises:
        InputError: no run there, one of a newer lobefem, or the file cannot be written.
    """
    path = Path(folder)
    file = path / FILE
    found = find_runs(path)
    beside = path / TABLES if found != [path] else None
    text = _page(path.absolute().name, [load_run(run) for run in found], beside)
    try:
        files.replace(file, text)
    except OSError as error:
        raise InputError(
            f"'{file}' cannot be written ({error.strerror}); make room or give another folder"
        ) from None
    return file


def _page(name: str, runs: list[Run], beside: Path | None) -> str:
    faults: list[str] = []
    compared = None if beside is None or not beside.is_file() else _compared(beside, faults)
    parts = [_part(run, f"run-{k}", ROOM // len(runs)) for k, run in enumerate(runs)]
    scenes = [part.scene for part in parts if part.scene is not None]
    charts = [chart for part in parts for section in part.sections for chart in section.charts]
    plotly, script = get_plotlyjs() if charts or scenes else "", _text("report.js")
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("lobefem.viz", "templates"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    shown = {"charts": {f"chart-{k}": chart.spec for k, chart in enumerate(charts)}}
    return environment.get_template("report.html").render(
        name=name,
        parts=parts,
        overview=_overview(parts) if len(parts) > 1 else None,
        ids={id(chart): f"chart-{k}" for k, chart in enumerate(charts)},
        id_of=id,
        data=files.plain(shown | {"scenes": scenes, "regions": list(REGIONS.items())}),
        faults=faults,
        compared=compared,
        warnings=_merged([(part.run.name, part.warnings) for part in parts]),
        remarks=_merged([(part.run.name, part.verdict[1:]) for part in parts]),
        views_left=sum(part.views_left for part in parts),
        version=__version__,
        style=markupsafe.Markup(_text("report.css")),
        plotly=_script(plotly),
        script=_script(script),
        policy=_policy(plotly, script),
    )


def _part(run: Run, name: str, room: int) -> _Part:
    """The sections of a run, each with what can be made of its results, be they damaged."""
    results = run.results
    faults: list[str] = []

    def made[T](title: str, make: Callable[[Run], T]) -> T | None:
        try:
            return make(run)
        except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
            logger.debug("report: %s: %r", title, error)
            faults.append(f"The results are damaged, so a part of the section '{title}' is missing.")
            return None

    pictures, left = made("Modes", report_shapes.mode_pictures) or ([], 0)
    scene, views_left = made("Shapes in 3D", partial(report_shapes.scene, room=room)) or (None, 0)
    more = f"Drawn are the highest pressures' modes; {left} more are in fields.xdmf." if left else ""
    makers = (
        report_tables.pressures,
        report_tables.modes,
        report_tables.sweep,
        report_tables.sensitivities,
    )
    tables = [made("Results", make) for make in makers]
    gores = "gores" in run.results
    curves = made("Eigenvalues", (pumpkin_charts if gores else report_charts).eigenvalues)
    chart = made("Harmonics", (pumpkin_charts if gores else report_charts).harmonics)
    history = made("Ramp and release", report_charts.history) or []
    residuals = [one for one in history if "residual" in one.title]
    maps = made("Stress and wrinkles", report_shapes.stress_maps) or []
    said = made("Is it stable?", lambda run: verdict(run.results)) or []
    sections = [
        _Section("Results", "results", tables=_present(report_tables.numbers(run), *tables)),
        _Section("Eigenvalues", "eigenvalues", charts=_present(curves)),
        _Section("Modes", "modes", note=more, pictures=pictures),
        _Section("Stress and wrinkles", "stress", pictures=maps),
        _Section("Harmonics", "harmonics", charts=_present(chart)),
        _Section(
            "Mesh study",
            "meshes",
            sentences=_sentences(run),
            charts=_present(made("Mesh study", report_charts.refinement)),
            tables=made("Mesh study", report_tables.trends) or [],
        ),
        _Section("Ramp and release", "release", charts=[one for one in history if one not in residuals]),
        _Section(
            "Convergence",
            "convergence",
            charts=residuals,
            tables=made("Convergence", report_tables.convergence) or [],
        ),
        _Section(
            "Design",
            "design",
            tables=_present(report_tables.design(run)),
            files={"design.toml": run.design_text} if run.design_text else {},
        ),
        _Section("Made with", "versions", tables=_present(report_tables.versions(run))),
        _Section("Log", "log", files={"log.txt": run.log} if run.log else {}),
    ]
    return _Part(
        run,
        name,
        str(results.get("title") or _COMMANDS.get(str(results.get("command")), run.name)),
        _subtitle(run),
        [*report_tables.warnings(run), *dict.fromkeys(faults)],
        said,
        [
            replace(section, id=f"{name}-{section.id}")
            for section in sections
            if section.charts or section.tables or section.pictures or section.sentences or section.files
        ],
        scene,
        views_left,
    )


def _merged(said: Sequence[tuple[str, Sequence[str]]]) -> list[tuple[str, str]]:
    """Whose each sentence is, in words, and the sentence: once, of however many runs it is."""
    whose: dict[str, list[str]] = {}
    for name, sentences in said:
        for text in dict.fromkeys(sentences):
            whose.setdefault(text, []).append(name)
    names = {k: f"{k} runs" for k in range(4, len(said))} | {len(said): f"All {len(said)} runs"}
    return [(names.get(len(of), ", ".join(of)), text) for text, of in whose.items()]


def _sentences(run: Run) -> list[str]:
    """A demo's sentences on its meshes; those of a mesh study are its verdict."""
    found = run.results.get("verdict")
    if not isinstance(found, list) or run.results.get("command") == "mesh-study":
        return []
    return [str(sentence) for sentence in found]


def _compared(file: Path, faults: list[str]) -> _Section | None:
    """The section of a file {"title", "note", "tables": [{"caption", "head", "rows"}]}, or a fault more."""
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
        tables = [
            Table(
                str(one["caption"]),
                tuple(map(str, one["head"])),
                tuple(tuple(report_tables.number(cell) for cell in row) for row in one["rows"]),
            )
            for one in found["tables"]
        ]
        return _Section(str(found["title"]), "compared", note=str(found.get("note", "")), tables=tables)
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        logger.debug("report: %s: %r", file, error)
        faults.append(f"{file.name} cannot be read or is damaged, so its tables are not shown.")
        return None


def _present(*found: Any) -> list[Any]:
    """The tables that are not empty."""
    return [one for one in found if one is not None and not (isinstance(one, Table) and not one.rows)]


def _overview(parts: Sequence[_Part]) -> Table:
    """One line a run."""
    rows = []
    for part in parts:
        results = part.run.results
        critical = results.get("critical_pressure")
        n = results.get("harmonic")
        shown = ("" if critical is None else report_tables.number(critical), "" if n is None else str(n))
        rows.append((part.run.name, part.title, part.subtitle, *shown))
    return Table("Runs", ("run", "what", "of", "critical pressure [Pa]", "n"), tuple(rows))


def _subtitle(run: Run) -> str:
    """The design in a line."""
    results = run.results
    lobes, mesh = results.get("lobes"), results.get("divisions")
    said = [] if lobes is None else ["1 lobe" if lobes == 1 else f"{lobes} lobes"]
    said += [f"{results['film']} film"] if results.get("film") else []
    said += assumptions(results)
    if isinstance(mesh, list) and results.get("command") != "mesh-study":
        said.append(" × ".join(map(str, mesh)) + " divisions")
    return ", ".join(said)


def _text(name: str) -> str:
    return (resources.files("lobefem.viz") / "templates" / name).read_text(encoding="utf-8")


def _script(text: str) -> markupsafe.Markup:
    """A script as it stands in the page; what would end it there is refused."""
    if re.search(r"</script|<!--|\r", text, re.IGNORECASE):
        raise ValueError("a script holds what would end it")
    return markupsafe.Markup(text)


def _policy(*scripts: str) -> str:
    """A content security policy that lets these scripts run, by their hashes, and nothing be loaded.

    Plotly compiles its drawing loops ('unsafe-eval') and sets styles of its elements.
    """
    hashes = [base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() for text in scripts]
    allowed = " ".join(f"'sha256-{one}'" for one in hashes)
    return (
        f"default-src 'none'; script-src {allowed} 'unsafe-eval'; style-src 'unsafe-inline'; "
        "img-src data: blob:; form-action 'none'; base-uri 'none'"
    )
