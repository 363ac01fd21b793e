"""A pumpkin's section of a report: tension and bulge angle along the tendon."""

from __future__ import annotations

import math

from lobefem.io.run_reader import Run
from lobefem.units import handy
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
    for key, name, unit in (
        ("tendon_tension", "tendon tension", "N"),
        ("bulge_half_angle", "half angle of the bulge", ""),
    ):
        values = results.get(key)
        if not isinstance(values, list) or len(values) != len(stations) or not all(map(finite, values)):
            continue
        if unit:
            called, factor = handy(max(values), unit)
        else:
            called, factor = "degrees", math.pi / 180
        told = [value / factor for value in values]
        hints = [
            f"{number(v)} {called} at {number(s)} of its length" for s, v in zip(stations, told, strict=True)
        ]
        columns[f"{name} [{called}]"] = told
        charts.append(
            Chart(
                name.capitalize(),
                f"From {number(min(told))} to {number(max(told))} {called}.",
                axis, Axis(f"{name} [{called}]"),
                [Series(name, "sway" if unit else "global", stations, told, hints, (), 2.0, 3.0)],
            )
        )  # fmt: skip
    table = rows_of(list(columns), list(columns.values()), "Along the tendon") if charts else None
    return Section("Gores and tendons", "gores", charts=charts, tables=[table] if table else [])
