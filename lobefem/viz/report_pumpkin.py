"""A pumpkin's part of a report: eigenvalues by harmonic, tension and bulge angle along the tendon."""

from __future__ import annotations

import math

from lobefem.io.run_reader import Run
from lobefem.units import handy, pascals
from lobefem.viz.report_charts import Axis, Chart, Series, Show, finite, rows_with
from lobefem.viz.report_section import Section
from lobefem.viz.report_tables import number, rows_of, waves

__all__ = ["pumpkin", "searched", "spectrum"]

_STRONG = ("sway", "twist", "global", "local")  # colours of the harmonics that are lowest


def searched(run: Run, show: Show) -> Chart | None:
    """The lowest eigenvalue of each harmonic along the path of a search; None of other runs."""
    results = run.results
    visited = [v for v in results.get("visited") or [] if isinstance(v, list) and len(v) == 2]
    curves = rows_with(results.get("curves"), "harmonic", "values")
    curves = [c for c in curves if isinstance(c["values"], list) and len(c["values"]) == len(visited)]
    if not visited or not curves:
        return None
    order = sorted(range(len(visited)), key=lambda k: visited[k][0])
    pressures = [visited[k][0] for k in order]
    unit, factor = handy(max(pressures), "Pa")
    sizes = [min((v for v in c["values"] if finite(v)), default=math.inf) for c in curves]
    strong = sorted(range(len(curves)), key=lambda k: sizes[k])[: len(_STRONG)]
    series = []
    for k, curve in enumerate(curves):
        n = curve["harmonic"]
        values = [curve["values"][i] if finite(curve["values"][i]) else None for i in order]
        hints = [
            f"{waves(n)}: {number(v)} Pa/m at {pascals(p)}" for p, v in zip(pressures, values, strict=True)
        ]
        colour = _STRONG[sorted(strong).index(k)] if k in strong else "quiet"
        series.append(
            Series(f"n = {n}", colour, [p / factor for p in pressures], values, hints, (),
                   2.0 if k in strong else 0.8, 3.5 if k in strong else 1.5)
        )  # fmt: skip
    critical, mark = results.get("critical_pressure"), None
    if finite(critical) and critical:
        at = next((s for s, step in enumerate(run.steps) if step.num_modes), None)
        view = "" if at is None else show(at, 0)
        mark = (critical / factor, 0.0, f"unstable above {pascals(critical)}")  # type: ignore[operator]
        hint = f"critical mode, {waves(results.get('harmonic'))}, at {pascals(critical)}"  # type: ignore[arg-type]
        series.append(Series("critical mode", "line", [mark[0]], [0.0], [hint], [view], 0.0, 6.0))
    tops = sorted(
        max((abs(v) for v in one.y if v is not None), default=0.0) for one in series if one.colour in _STRONG
    )
    lowest = min(sizes)
    high = 1.1 * max(tops[-1], 1e-300) if tops else 1.0
    low = min(1.1 * lowest, 0.0) - 0.04 * high
    end = f" It becomes unstable at {pascals(critical)}." if mark else ""  # type: ignore[arg-type]
    return Chart(
        "Lowest eigenvalue of each number of waves",
        f"{len(curves)} harmonics at {len(visited)} pressures; the lowest value is {number(lowest)} "
        f"Pa/m.{end}",
        Axis(f"pressure [{unit}]"), Axis("eigenvalue [Pa/m]", "linear", (low, high)),
        series, unstable=True, mark=mark,
    )  # fmt: skip


def spectrum(run: Run, show: Show) -> Chart | None:
    """The lowest eigenvalue against the number of waves, a curve each pressure; None of other runs."""
    found = run.results.get("pressures")
    entries = rows_with(found, "pressure", "by_harmonic")
    series = []
    for k, entry in enumerate(entries):
        rows = rows_with(entry["by_harmonic"], "harmonic", "lowest")
        modes = rows_with(entry.get("modes"), "harmonic")
        places = {mode["harmonic"]: i for i, mode in reversed(list(enumerate(modes)))}
        told = pascals(entry["pressure"])
        hints = [f"{waves(r['harmonic'])}: {number(r['lowest'])} Pa/m at {told}" for r in rows]
        views = [show(k, places[r["harmonic"]]) if r["harmonic"] in places else "" for r in rows]
        colour = _STRONG[k] if k < len(_STRONG) else "line"
        series.append(
            Series(
                f"at {told}", colour, [r["harmonic"] for r in rows], [r["lowest"] for r in rows], hints, views
            )
        )
    if not any(one.x for one in series):
        return None
    lowest = min(v for one in series for v in one.y if finite(v))
    return Chart(
        "Lowest eigenvalue of each number of waves",
        f"At {len(series)} pressures; the lowest value is {number(lowest)} Pa/m.",
        Axis("waves around, n"), Axis("eigenvalue [Pa/m]"), series, unstable=True,
    )  # fmt: skip


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
