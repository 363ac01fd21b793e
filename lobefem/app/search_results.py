"""What a search leaves in its folder: all designs in a table, a Pareto chart, the best design's gores."""

from __future__ import annotations

import csv
import io
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from lobefem.app.search_designs import Record, Solved
from lobefem.app.search_file import LIMITS, Search
from lobefem.app.search_ranking import Ended, best_of, feasible
from lobefem.app.tables import printable, show_rows
from lobefem.files import replace, replacing, to_json
from lobefem.io.gore_files import cutting_table, save_gore
from lobefem.io.pumpkin_design import foreshortening
from lobefem.units import scaled
from lobefem.version import __version__
from lobefem.viz.report_provenance import setting
from lobefem.viz.style import MM, STYLE

__all__ = ["as_csv", "finish", "pareto_chart", "show_search", "table"]

_UNITS = {"max_stress": "Pa", "mass": "kg", "tendon_tension": "N", "volume": "m^3", "critical_pressure": "Pa"}

_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#B4588F", "#E69F00", "#56B4E9")


def table(plan: Search, records: Sequence[Record]) -> Iterator[list[str]]:
    """Designs as text, the head first."""
    chosen = list(plan.choices[0])
    quantities = list(LIMITS) + [f"p_{n}" for n in plan.harmonics]
    yield [*chosen, *plan.names, *quantities, "feasible", "design", "fault"]
    for record in records:
        choice = plan.choices[record.choice]
        cells = [*(choice[key] for key in chosen), *record.x, *(record.values.get(q) for q in quantities)]
        text = ["" if c is None else f"{c:.6g}" if isinstance(c, float) else str(c) for c in cells]
        yield [*text, "yes" if feasible(plan, record) else "no", record.name, record.fault]


def as_csv(plan: Search, records: Sequence[Record]) -> str:
    """All designs for a spreadsheet."""
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows(table(plan, records))
    return stream.getvalue()


def finish(plan: Search, solved: Solved, ended: Sequence[Ended], folder: Path) -> dict[str, Any]:
    """Write table, chart, results and the gore of each choice's best design; the results.

    Raises:
        InputError: the file system refuses.
    """
    records = [record for record in solved.records.values() if record.name]
    best = {
        choice: best_of(plan, [r for r in records if r.choice == choice])
        for choice in range(len(plan.choices))
    }
    first = best_of(plan, records)
    none = "no design that was solved keeps the limits"
    if all(record.fault for record in records):
        none = f"no design could be solved: {records[0].fault if records else ended[0].message}"
    replace(folder / "designs.csv", as_csv(plan, records))
    with replacing(folder / "pareto.png") as stream:
        pareto_chart(plan, records, first).savefig(stream, format="png")
    for record in filter(None, best.values()):
        choice = plan.choices[record.choice]
        name = "-".join(f"{key.rpartition('.')[2]}-{value}" for key, value in choice.items()) or "design"
        place = folder / "best" / name
        place.mkdir(parents=True, exist_ok=True)
        design = plan.design(choice, np.array(record.x))
        replace(place / "design.toml", design.to_toml())
        save_gore(place, cutting_table(design.gore, foreshortening(design)), {"design": name})
    results = {
        "schema": 1,
        "command": "optimise",
        "version": __version__,
        "goal": plan.goal,
        "limits": dict(plan.limits),
        "designs": len(records),
        "failed": sum(bool(record.fault) for record in records),
        "best": None if first is None else _data(plan, first),
        "runs": [
            {
                "choice": dict(plan.choices[one.choice]),
                "start": one.start + 1,
                "message": one.message,
                "best": None if one.best is None else _data(plan, one.best),
            }
            for one in ended
        ],
        "warnings": [] if first is not None else [none],
    }
    replace(folder / "results.json", to_json(results))
    return results


def _data(plan: Search, record: Record) -> dict[str, Any]:
    return {
        "design": record.name,
        "choice": dict(plan.choices[record.choice]),
        "parameters": dict(zip(plan.names, record.x, strict=True)),
        "values": dict(record.values),
    }


def pareto_chart(
    plan: Search, records: Sequence[Record], best: Record | None, width: float = 120.0
) -> Figure:
    """Critical pressure, or without harmonics volume, over mass, and the front of what keeps the limits.

    Args:
        plan: what was searched for.
        records: all designs.
        best: is marked.
        width: of the figure [mm].
    """
    upwards, label = (
        ("critical_pressure", "critical pressure [Pa]") if plan.harmonics else ("volume", "volume [m³]")
    )
    with rc_context(STYLE):
        figure = Figure(figsize=(width * MM, 0.7 * width * MM), layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.add_subplot()
        solved = [record for record in records if not record.fault]
        for k, choice in enumerate(plan.choices):
            colour = _COLOURS[k % len(_COLOURS)]
            for keeps in (False, True):
                some = [r for r in solved if r.choice == k and feasible(plan, r) is keeps]
                name = ", ".join(f"{key.rpartition('.')[2]} {value}" for key, value in choice.items())
                axes.plot(
                    [r.values["mass"] for r in some],
                    [r.values[upwards] for r in some],
                    "o",
                    color=colour,
                    fillstyle="full" if keeps else "none",
                    ms=2.5,
                    mew=0.5,
                    alpha=1.0 if keeps else 0.5,
                    label=(name or "designs") if keeps else None,
                )
        front = _front([r for r in solved if feasible(plan, r)], upwards)
        axes.step(*front, where="post", color="black", lw=0.8, label="front")
        if best is not None:
            place = best.values["mass"], best.values[upwards]
            axes.plot(*place, "*", color="black", ms=8, label=f"best {plan.goal.replace('_', ' ')}")
        axes.set(xlabel="mass [kg]", ylabel=label)
        axes.set_title("Designs of the search; hollow: beyond a limit")
        axes.spines[["top", "right"]].set_visible(False)
        axes.legend(frameon=False, fontsize=6)
    return figure


def _front(records: Sequence[Record], upwards: str) -> tuple[list[float], list[float]]:
    """Masses and what is better upwards of designs than which none is better in both."""
    masses: list[float] = []
    heights: list[float] = []
    for record in sorted(records, key=lambda r: (r.values["mass"], -r.values[upwards])):
        if not heights or record.values[upwards] > heights[-1]:
            masses.append(record.values["mass"])
            heights.append(record.values[upwards])
    return masses, heights


def show_search(
    plan: Search,
    ended: Sequence[Ended],
    results: dict[str, Any],
    folder: Path,
    *,
    json: str | None,
    quiet: bool,
) -> None:
    """Print the best design of each run, or all results as JSON, and the warnings.

    Args:
        plan: what was searched for.
        ended: the runs.
        results: of `finish`.
        folder: of the search.
        json: file for the results, "-" for standard output.
        quiet: True for warnings alone.
    """
    for warning in results["warnings"]:
        print(f"lobefem: warning: {warning}", file=sys.stderr)
    if json == "-":
        sys.stdout.write(to_json(results))
    else:
        if json:
            replace(Path(json), to_json(results))
        if not quiet:
            show_rows(_shown(plan, ended))
            print(f"All designs, the Pareto chart and the best gores are in {printable(folder)}")
    sys.stdout.flush()


def _shown(plan: Search, ended: Sequence[Ended]) -> list[list[str]]:
    """The runs' best designs, a column each, as rows of text."""
    runs = [one.best for one in ended if one.best is not None]
    columns = list(table(plan, runs))
    rows = [list(row) for row in zip(*columns, strict=True)]
    for row in rows:  # for the eye; files have SI
        key = row[0]
        unit = _UNITS.get("critical_pressure" if key in {f"p_{n}" for n in plan.harmonics} else key)
        if unit:
            row[1:] = [scaled(float(v), unit) if v else v for v in row[1:]]
        elif key in plan.names:
            row[1:] = [setting(key, float(v)) for v in row[1:]]
    return [["", *(f"run {k}" for k in range(1, len(columns)))], *(row for row in rows if any(row[1:]))]
