"""Charts of a report on a pumpkin's stability: eigenvalues and critical pressures by harmonic."""

from __future__ import annotations

from typing import Any

from lobefem.io.run_reader import Run
from lobefem.units import handy, pascals
from lobefem.viz.harmonic_curves import named_harmonics
from lobefem.viz.report_charts import Axis, Chart, Series, Show, finite, rows_with
from lobefem.viz.report_tables import Table, number, waves
from lobefem.viz.style import UNITS

__all__ = ["eigenvalues", "harmonics"]

# of the harmonics that matter
_COLOURS = ("sway", "twist", "global", "local", "contact", "line")


def eigenvalues(run: Run, show: Show) -> Chart | None:
    """Lowest eigenvalue of each harmonic: of a search against pressure, of modes against n; else None."""
    if "gores" not in run.results:
        return None
    return _along_path(run, show) or _spectrum(run, show)


def _critical_view(run: Run, show: Show) -> str:
    at = next((s for s, step in enumerate(run.steps) if step.num_modes), None)
    return "" if at is None else show(at, 0)


def _along_path(run: Run, show: Show) -> Chart | None:
    results = run.results
    visited = [v for v in results.get("visited") or [] if isinstance(v, list) and len(v) == 2]
    rows = rows_with(results.get("curves"), "harmonic", "values")
    curves = {r["harmonic"]: r["values"] for r in rows if len(r["values"]) == len(visited) > 0}
    if not curves:
        return None
    named = [n for n in named_harmonics(results) if n in curves]
    pressures = [v[0] for v in visited]
    unit, factor = handy(max(pressures), "Pa")
    series = []
    for n, values in curves.items():
        hints = [
            f"{waves(n)}: {number(v)} Pa/m at {pascals(p)}" for p, v in zip(pressures, values, strict=True)
        ]
        strong = n in named
        colour = _COLOURS[named.index(n) % len(_COLOURS)] if strong else "quiet"
        width, size = (2.0, 3.5) if strong else (0.8, 1.5)
        told = [p / factor for p in pressures]
        series.append(Series(f"n = {n}", colour, told, values, hints, (), width, size))
    critical: Any = results.get("critical_pressure")
    at, mark, end = results.get("harmonic"), None, ""
    if finite(critical) and critical:
        mark = (critical / factor, 0.0, f"unstable above {pascals(critical)}")
        end = f" Stability is lost at {pascals(critical)}, with {waves(at)}."
        view, hint = _critical_view(run, show), f"critical mode, {waves(at)}, at {pascals(critical)}"
        series.append(Series("critical mode", "line", [mark[0]], [0.0], [hint], [view], 0.0, 6.0))
    shown = [curves[n] for n in named] or list(curves.values())
    high = max(
        max(values) for n, values in curves.items() if n == at or (not critical and n in named) or not named
    )
    high *= 4 if critical else 1.05
    low = min(0.0, *(min(values) for values in shown))
    low = max(low, -high) if high > 0 else low
    table = Table(
        "Eigenvalues by harmonic [Pa/m]",
        ("n", *(f"at {pascals(p)}" for p in pressures)),
        tuple((str(n), *map(number, values)) for n, values in curves.items()),
    )
    return Chart(
        "Lowest eigenvalue of each number of waves along the inflated path",
        f"Named are {len(named)} of {len(curves)} harmonics at {len(visited)} pressures up to "
        f"{pascals(max(pressures))}.{end}",
        Axis(f"pressure [{unit}]"), Axis("eigenvalue [Pa/m]", "linear", (low - 0.1 * (high - low), high)),
        series, table, unstable=True, mark=mark,
    )  # fmt: skip


def _spectrum(run: Run, show: Show) -> Chart | None:
    unit = UNITS.get(str(run.results.get("mass", "unit")), "Pa/m")
    series, rows = [], []
    for k, entry in enumerate(rows_with(run.results.get("pressures"), "pressure", "by_harmonic")):
        found = rows_with(entry["by_harmonic"], "harmonic", "lowest")
        modes = rows_with(entry.get("modes"), "harmonic")
        places = {mode["harmonic"]: i for i, mode in reversed(list(enumerate(modes)))}
        told = pascals(entry["pressure"])
        n, values = [r["harmonic"] for r in found], [r["lowest"] for r in found]
        hints = [f"{waves(h)}: {number(v)} {unit} at {told}" for h, v in zip(n, values, strict=True)]
        views = [show(k, places[h]) if h in places else "" for h in n]
        series.append(Series(f"at {told}", _COLOURS[k % len(_COLOURS)], n, values, hints, views))
        rows += [(told, str(h), number(v)) for h, v in zip(n, values, strict=True)]
    if not rows:
        return None
    lowest = min(v for one in series for v in one.y)
    axis = Axis(f"eigenvalue [{unit}]", "log" if lowest > 0 else "linear")
    return Chart(
        "Lowest eigenvalue of each number of waves", f"The lowest one of all is {number(lowest)} {unit}.",
        Axis("waves around, n"), axis, series,
        Table("Lowest eigenvalue of each harmonic", ("pressure", "n", f"eigenvalue [{unit}]"), tuple(rows)),
        unstable=lowest <= 0,
    )  # fmt: skip


def harmonics(run: Run, show: Show) -> Chart | None:
    """Critical pressure by harmonic; None of runs that are no search for it."""
    results = run.results
    chart = rows_with(results.get("chart"), "harmonic", "critical_pressure", "stable_from")
    end: Any = results.get("searched_to")
    if "gores" not in results or len(chart) < 2 or not finite(end):
        return None
    unit, factor = handy(end, "Pa")
    if not any(row["critical_pressure"] for row in chart):
        return None  # the answer says it
    lost = [(row["harmonic"], row["critical_pressure"]) for row in chart if row["critical_pressure"]]
    never = [row["harmonic"] for row in chart if row["critical_pressure"] is None]
    first: Any = results.get("critical_pressure")
    view = _critical_view(run, show)
    series = [
        Series(
            "stability lost", "sway", [n for n, _ in lost], [p / factor for _, p in lost],
            [f"{waves(n)}: unstable from {pascals(p)}" for n, p in lost],
            [view if n == results.get("harmonic") else "" for n, _ in lost],
        ),
        Series(
            f"stable up to {pascals(end)}", "quiet", never, [end / factor] * len(never),
            [f"{waves(n)}: stable up to {pascals(end)}, the end of the search" for n in never], (), 0.0, 3.0,
        ),
    ]  # fmt: skip
    said = tuple(
        (
            str(row["harmonic"]),
            "" if row["stable_from"] is None else pascals(row["stable_from"]),
            {0: "never stable", None: f"{pascals(end)} at least"}.get(row["critical_pressure"])
            or pascals(row["critical_pressure"]),
        )
        for row in chart
    )
    lowest = (
        f"The lowest is {pascals(first)}, n = {results.get('harmonic')}."
        if first
        else "None loses stability."
    )
    log = lost and end > 8 * min(p for _, p in lost)
    mark = (results["harmonic"], first / factor, f"lowest: {pascals(first)}") if first else None
    return Chart(
        "Critical pressure of each number of waves", lowest, Axis("waves around, n"),
        Axis(f"critical pressure [{unit}]", "log" if log else "linear"), series,
        Table("Critical pressure of each harmonic", ("n", "stable from", "stable up to"), said), mark=mark,
    )  # fmt: skip
