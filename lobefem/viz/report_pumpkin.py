"""A pumpkin's section of a report: tension, bulges, resultants and strains along the tendon."""

from __future__ import annotations

from typing import Any

from lobefem.io.run_reader import Run
from lobefem.units import handy
from lobefem.viz.pumpkin_pictures import STATIONS
from lobefem.viz.report_charts import Axis, Chart, Series, finite
from lobefem.viz.report_section import Section
from lobefem.viz.report_tables import number, rows_of

__all__ = ["pumpkin"]


def pumpkin(run: Run) -> Section | None:
    """Charts over the tendon's length; None of other balloons."""
    results = run.results
    stations = results.get("stations")
    if "gores" not in results or not isinstance(stations, list) or not stations:
        return None
    axis = Axis("place along the tendon from the bottom, over its length")
    charts = []
    columns = {"place": stations}
    for title, unit, lines in STATIONS:
        values: list[Any] = [results.get(key) for key, _, _ in lines]
        if not all(isinstance(v, list) and len(v) == len(stations) and all(map(finite, v)) for v in values):
            continue
        told = [[factor * v for v in given] for (_, _, factor), given in zip(lines, values, strict=True)]
        called, factor = handy(max(map(max, told)), unit) if unit in ("N", "m", "N/m") else (unit, 1.0)
        series = []
        for (_, label, _), colour, line in zip(lines, ("sway", "twist"), told, strict=False):
            line = [value / factor for value in line]
            hints = [
                f"{number(v)} {called} at {number(s)} of its length"
                for s, v in zip(stations, line, strict=True)
            ]
            columns[f"{label} {title} [{called}]".strip()] = line
            series.append(Series(label or title, colour, stations, line, hints, (), 2.0, 3.0))
        every = [v for one in series for v in one.y]
        span = f"From {number(min(every))} to {number(max(every))} {called}."
        charts.append(Chart(title.capitalize(), span, axis, Axis(f"{title} [{called}]"), series))
    table = rows_of(list(columns), list(columns.values()), "Along the tendon") if charts else None
    return Section("Gores and tendons", "gores", charts=charts, tables=[table] if table else [])
