"""Charts of numbers against what was varied: over runs side by side, or over the points of a sweep."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from lobefem.io.run_reader import Run
from lobefem.typing import Unchecked
from lobefem.units import handy, pascals
from lobefem.viz.report_charts import Axis, Chart, Series, finite, rows_with
from lobefem.viz.report_tables import number

__all__ = ["Point", "parameter_chart", "place", "said", "sweep"]

_PALETTE = ("sway", "twist", "global", "local", "line")


@dataclass(frozen=True)
class Point:
    """A number, the settings that it belongs to by key, and what it is in words."""

    value: float
    settings: Mapping[str, Any]
    hint: str


def sweep(run: Run) -> Chart | None:
    """Critical pressures of a sweep against what varies; None of other runs."""
    rows = rows_with(run.results.get("rows"), "values", "found")
    known = [r for r in rows if isinstance(r["values"], dict) and isinstance(r["found"], dict)]
    points = [
        Point(value, row["values"], f"{_settings(row['values'])}: {pascals(value)}")
        for row in known
        if finite(value := row["found"].get("critical_pressure"))
    ]
    keys = list(dict.fromkeys(key for row in known for key in row["values"]))
    differing = [key for key in keys if len({repr(row["values"].get(key)) for row in known}) > 1]
    return parameter_chart(points, differing, "critical pressure [Pa]")


def _settings(values: Mapping[str, Any]) -> str:
    return ", ".join(f"{key} = {said(value)}" for key, value in values.items())


def said(value: Unchecked) -> str:
    """A value of a design in few letters."""
    if isinstance(value, (list, tuple)):
        return "×".join(map(number, value))
    return number(value)


def parameter_chart(points: Sequence[Point], keys: Sequence[str], about: str) -> Chart | None:
    """Numbers against a key, a curve for each value of a second one; None of fewer than two or of more keys.

    Args:
        points: the numbers.
        keys: that differ.
        about: what the numbers are, with their unit in SI.
    """
    if len(points) < 2 or not 1 <= len(keys) <= 2:
        return None
    plain = [key for key in keys if all(place(one.settings.get(key)) is not None for one in points)]
    key = (plain or list(keys))[0]
    other = next((one for one in keys if one != key), None)
    names = None if plain else list(dict.fromkeys(said(one.settings.get(key)) for one in points))
    unit = about.rpartition("[")[2].rstrip("]")
    handier, factor = handy(max(abs(one.value) for one in points), unit)
    about = f"{about.rpartition('[')[0]}[{handier}]"
    series = []
    groups = list(dict.fromkeys(said(one.settings.get(other)) for one in points)) if other else [""]
    for k, group in enumerate(groups):
        placed = [
            (_at(one.settings.get(key), names), one.value / factor, one.hint)
            for one in points
            if not other or said(one.settings.get(other)) == group
        ]
        placed.sort(key=lambda point: point[0])
        series.append(
            Series(
                group and f"{other} = {group}", _PALETTE[k % len(_PALETTE)], [x for x, _, _ in placed],
                [y for _, y, _ in placed],
                [hint for _, _, hint in placed],
                (), 0.0 if names else 2.0, 5.0,
            )
        )  # fmt: skip
    x = Axis(
        "divisions around" if key == "mesh.divisions" else key,
        ticks=list(range(len(names))) if names else sorted({x for one in series for x in one.x}),
        names=names,
    )
    values = [one.value for one in points]
    scale = "log" if min(values) > 0 and max(values) > 20 * min(values) else "linear"
    least, most = (number(value / factor) for value in (min(values), max(values)))
    told_ = f"{len(points)} points, from {least} to {most} {handier}."
    return Chart(
        f"{about.rpartition(' [')[0].capitalize()} against {x.label}", told_, x, Axis(about, scale), series
    )


def _at(value: Unchecked, names: Sequence[str] | None) -> float:
    at = place(value)
    return float(names.index(said(value))) if names or at is None else at  # type: ignore[union-attr]


def place(value: Unchecked) -> float | None:
    """Position of a value on an axis; of divisions the number around; None of words."""
    if isinstance(value, (list, tuple)) and len(value) == 2 and all(isinstance(v, int) for v in value):
        return float(value[1])
    if isinstance(value, (list, tuple)) and len(value) == 1:
        return place(value[0])
    return float(value) if finite(value) else None
