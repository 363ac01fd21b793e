"""The report of a run folder: one HTML file that needs no network, drawn from what the folder holds.

The page's own script is inside it. A content security policy forbids everything else, so that nothing
that a design or a folder is called can load or run anything.
"""

from __future__ import annotations

import base64
import hashlib
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path

import jinja2
import markupsafe
from matplotlib import colormaps

from lobefem import files
from lobefem.errors import InputError
from lobefem.io.run_reader import Run, find_runs, load_run
from lobefem.log import logger
from lobefem.version import __version__
from lobefem.viz import report_tables
from lobefem.viz.headline import Mark
from lobefem.viz.report_compare import comparison, with_meshes
from lobefem.viz.report_part import Part, part
from lobefem.viz.report_pictures import Picture
from lobefem.viz.report_section import Section
from lobefem.viz.report_tables import Table
from lobefem.viz.style import COLOURS, DARK, DIVERGING, LEDGER, REGIONS, SEQUENTIAL

__all__ = ["FILE", "write_report"]

FILE = "report.html"

TABLES = "tables.json"  # what stands beside the runs in a folder of them: a title, and tables

ROOM = 8_000_000  # bytes of a report for its 3D views

PICTURES = 24  # of modes in a report

# colour maps, and what is cut off at both ends; the motion of a mode is to be seen by its shape, too
_RAMPS = (("size", SEQUENTIAL, 0.0), ("signed", DIVERGING, 0.0), ("motion", DIVERGING, 0.14))

_SCRIPTS = ("report_chart.js", "report_view.js", "report_table.js", "report.js")


@dataclass(frozen=True)
class _Thumb:
    """A picture of a mode that shows it in the view."""

    run: int
    view: str
    picture: Picture


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
    runs = sorted(
        runs, key=lambda run: [(int(w), w) if w.isdigit() else (-1, w) for w in re.split(r"(\d+)", run.name)]
    )
    most = max(PICTURES // len(runs), 2)
    parts = [part(run, f"run-{k}", ROOM // len(runs), most) for k, run in enumerate(runs)]
    parts = with_meshes(parts) if len(parts) > 1 else parts
    parts, shared = _without_shared(parts)
    before = [one for one in (comparison(parts) if len(parts) > 1 else None, compared) if one is not None]
    shapes = _shapes_title(parts)
    charts = [chart for one in parts for chart in ([one.chart] if one.chart is not None else [])]
    charts += [
        c for section in (*before, *(s for one in parts for s in one.sections)) for c in section.charts
    ]
    ids = {id(chart): f"chart-{k}" for k, chart in enumerate(charts)}
    script = '"use strict";\n(() => {\n' + "\n".join(map(_text, _SCRIPTS)) + "\n})();"
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("lobefem.viz", "templates"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    heading, common = _common(parts, name)
    return environment.get_template("report.html").render(
        name=name,
        heading=heading,
        common=common,
        parts=parts,
        before=before,
        shared=shared,
        shapes=shapes,
        thumbs=_thumbs(parts),
        contents=_contents(parts, before, shapes),
        ids=ids,
        id_of=id,
        regions=list(REGIONS.items()),
        data=files.plain(
            {
                "charts": {ids[id(chart)]: chart.spec for chart in charts},
                "palettes": _palettes(),
                "runs": [
                    {
                        "name": one.run.name,
                        "scene": None if one.scene is None else one.scene.data,
                        "chart": None if one.chart is None else ids[id(one.chart)],
                        "title": "" if one.chart is None else one.chart.title,
                        "label": "" if one.chart is None else one.chart.description,
                    }
                    for one in parts
                ],
            }
        ),
        faults=faults,
        warnings=_merged([(one.run.name, one.warnings) for one in parts]),
        views_left=sum(one.scene.left_out for one in parts if one.scene is not None),
        pictures_left=sum(one.pictures_left for one in parts),
        version=__version__,
        style=markupsafe.Markup(_colours() + _text("report.css")),
        script=_script(script),
        policy=_policy(script),
    )


def _without_shared(parts: list[Part]) -> tuple[list[Part], list[Mark]]:
    """Runs without the marks that all of them have, and those marks."""
    if len(parts) < 2:
        return parts, []
    shared = [mark for mark in parts[0].headline.marks if all(mark in one.headline.marks for one in parts)]
    made = [
        replace(
            one, headline=replace(one.headline, marks=tuple(m for m in one.headline.marks if m not in shared))
        )
        for one in parts
    ]
    return made, shared


def _shapes_title(parts: Sequence[Part]) -> str:
    """The heading over chart and view, "" without either."""
    chart, scene = (any(getattr(one, what) is not None for one in parts) for what in ("chart", "scene"))
    return {(True, True): "Chart and shapes", (True, False): "Chart", (False, True): "Shapes"}.get(
        (chart, scene), ""
    )


def _thumbs(parts: Sequence[Part]) -> list[_Thumb]:
    found = []
    for k, one in enumerate(parts):
        for picture in one.pictures:
            view = "" if one.scene is None else one.scene.mode(picture.step, picture.mode)
            if view:
                found.append(_Thumb(k, f"{k}:{view}", picture))
    return found


def _contents(parts: Sequence[Part], before: Sequence[Section], shapes: str) -> list[tuple[str, str]]:
    """Anchors and names of the navigation, five or so."""
    found = [("answer", "Answer"), *((one.id, one.title) for one in before)]
    found += [("shapes", shapes)] if shapes else []
    if len(parts) > 1:
        return [*found, ("runs", "Run by run")]
    return found + [(one.id, one.title) for one in parts[0].sections]


def _common(parts: Sequence[Part], name: str) -> tuple[str, str]:
    """The title of a folder of runs, and what all of them are."""
    titles, subtitles = {one.title for one in parts}, {one.subtitle for one in parts}
    heading = titles.pop() if len(titles) == 1 else f"Runs of {name}"
    return heading, subtitles.pop() if len(subtitles) == 1 else ""


def _merged(said: Sequence[tuple[str, Sequence[str]]]) -> list[tuple[str, str]]:
    """Whose each sentence is, in words, and the sentence: once, of however many runs it is."""
    whose: dict[str, list[str]] = {}
    for name, sentences in said:
        for text in dict.fromkeys(sentences):
            whose.setdefault(text, []).append(name)
    names = {k: f"{k} runs" for k in range(4, len(said))} | {len(said): f"All {len(said)} runs"}
    return [(names.get(len(of), ", ".join(of)), text) for text, of in whose.items()]


def _compared(file: Path, faults: list[str]) -> Section | None:
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
        note = str(found.get("note", ""))
        return Section(str(found["title"]), "compared", sentences=[note] if note else [], tables=tables)
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        logger.debug("report: %s: %r", file, error)
        faults.append(f"{file.name} cannot be read or is damaged, so its tables are not shown.")
        return None


# --- colours, and what may run --------------------------------------------------------------------
def _palettes() -> dict[str, str]:
    """The figures' colour maps as bytes of red, green and blue."""
    maps = {
        name: [
            [round(255 * c) for c in colormaps[cmap](low + (1 - 2 * low) * k / 255)[:3]] for k in range(256)
        ]
        for name, cmap, low in _RAMPS
    }
    maps["regions"] = [[int(colour[i : i + 2], 16) for i in (1, 3, 5)] for colour in REGIONS.values()]
    return {
        name: base64.b64encode(bytes(c for rgb in rows for c in rgb)).decode() for name, rows in maps.items()
    }


def _colours() -> str:
    """The figures' colours as variables and classes of the page."""
    ledger = dict(zip(("gas", "constraint", "strain", "contact", "damping"), LEDGER, strict=False))
    ramps = {
        name: ", ".join(
            "#" + "".join(f"{round(255 * c):02x}" for c in colormaps[cmap](low + (1 - 2 * low) * k / 8)[:3])
            for k in range(9)
        )
        for name, cmap, low in _RAMPS
    }
    kinds = {name.replace(" ", "-"): colour for name, colour in COLOURS.items()}
    dark = {name.replace(" ", "-"): colour for name, colour in DARK.items()}
    variables = " ".join(f"--{name}-ramp: linear-gradient(to right, {ramp});" for name, ramp in ramps.items())
    light = " ".join(f".k-{name} {{ --k: {colour}; }}" for name, colour in (ledger | kinds).items())
    night = " ".join(f".k-{name} {{ --k: {colour}; }}" for name, colour in dark.items())
    return (
        f":root {{ {variables} }}\n{light}\n.k-sum {{ --k: var(--ink); }}\n"
        f"@media screen and (prefers-color-scheme: dark) {{ {night} }}\n"
    )


def _text(name: str) -> str:
    return (resources.files("lobefem.viz") / "templates" / name).read_text(encoding="utf-8")


def _script(text: str) -> markupsafe.Markup:
    """A script as it stands in the page; what would end it there is refused."""
    if re.search(r"</script|<!--|\r", text, re.IGNORECASE):
        raise ValueError("a script holds what would end it")
    return markupsafe.Markup(text)


def _policy(*scripts: str) -> str:
    """A content security policy that lets these scripts run, by their hashes, and nothing be loaded."""
    hashes = [base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() for text in scripts]
    allowed = " ".join(f"'sha256-{one}'" for one in hashes)
    return (
        f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; "
        "img-src data: blob:; form-action 'none'; base-uri 'none'"
    )
