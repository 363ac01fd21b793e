"""Charts of a report on a pumpkin's stability: eigenvalues and critical pressures by harmonic."""

from __future__ import annotations

from typing import Any

from lobefem.io.run_reader import Run
from lobefem.units import pascals
from lobefem.viz.harmonic_curves import named_harmonics
from lobefem.viz.report_charts import Chart
from lobefem.viz.report_tables import Table

__all__ = ["eigenvalues", "harmonics"]

# Okabe and Ito's
_LINES = ("#0072B2", "#D55E00", "#009E73", "#B4588F", "#E69F00", "#56B4E9")


def _line(x: list[Any], y: list[Any], name: str, colour: str, hover: str) -> dict[str, Any]:
    return {
        "type": "scatter", "mode": "lines+markers", "x": x, "y": y, "name": name,
        "line": {"color": colour, "width": 1.8}, "hovertemplate": f"{hover}<extra></extra>",
    }  # fmt: skip


def eigenvalues(run: Run) -> Chart | None:
    """Lowest eigenvalue of each harmonic: of a search against pressure, of modes against n; else None."""
    results = run.results
    if "gores" not in results:
        return None
    if results.get("curves"):
        return _along_path(results)
    return _spectrum(results) if results.get("pressures") else None


def _along_path(results: Any) -> Chart:
    p = [pair[0] for pair in results["visited"]]
    curves = {curve["harmonic"]: curve["values"] for curve in results["curves"]}
    named = named_harmonics(results)
    traces = [
        _line(p, curves[n], f"n = {n}", _LINES[k % len(_LINES)], f"n = {n}: %{{y:.4g}} Pa/m at %{{x:.4g}} Pa")
        for k, n in enumerate(named)
    ]
    critical, at = results["critical_pressure"], results["harmonic"]
    high = max(max(values) for n, values in curves.items() if n == at or (not critical and n in named))
    low = min(0.0, *(min(curves[n]) for n in named))
    high = 4 * high if critical else high
    end = f"; stability is lost at {pascals(critical)} in harmonic {at}" if critical else ""
    rows = tuple((f"{n}", ", ".join(f"{value:.4g}" for value in values)) for n, values in curves.items())
    return Chart(
        "Lowest eigenvalue of each harmonic along the inflated path",
        f"Named are {len(named)} of {len(curves)} harmonics at {len(p)} pressures up to "
        f"{pascals(p[-1])}{end}.",
        traces, "pressure p [Pa]", "eigenvalue λ [Pa/m]",
        {"yaxis": {"range": [max(low, -high) if high > 0 else low, high], "zeroline": True}},
        Table("Eigenvalues by harmonic", ("n", f"at {', '.join(f'{x:.4g}' for x in p)} Pa [Pa/m]"), rows),
    )  # fmt: skip


def _spectrum(results: Any) -> Chart:
    unit = "N/m" if results["mass"] == "nodal" else "Pa/m"
    traces, rows = [], []
    for k, entry in enumerate(results["pressures"]):
        n = [row["harmonic"] for row in entry["by_harmonic"]]
        values = [row["lowest"] for row in entry["by_harmonic"]]
        at = pascals(entry["pressure"])
        traces.append(_line(n, values, at, _LINES[k % len(_LINES)], f"n = %{{x}}: %{{y:.4g}} {unit} at {at}"))
        rows += [(at, str(h), f"{value:.5g}") for h, value in zip(n, values, strict=True)]
    lowest = min(min(trace["y"]) for trace in traces)
    logarithmic = {"yaxis": {"type": "log"}} if lowest > 0 else {}
    return Chart(
        "Lowest eigenvalue of each harmonic", f"The lowest one of all is {lowest:.4g} {unit}.", traces,
        "harmonic n", f"eigenvalue λ [{unit}]", logarithmic,
        Table("Lowest eigenvalue of each harmonic", ("pressure", "n", f"eigenvalue [{unit}]"), tuple(rows)),
    )  # fmt: skip


def harmonics(run: Run) -> Chart | None:
    """Where each harmonic loses stability; None of runs that are no search for it."""
    results = run.results
    if "gores" not in results or len(results.get("chart") or ()) < 2:
        return None
    chart: Any = results["chart"]
    end = results["searched_to"]
    lost = [(row["harmonic"], row["critical_pressure"]) for row in chart if row["critical_pressure"]]
    never = [row["harmonic"] for row in chart if row["critical_pressure"] is None]
    hover = "n = %{x}: unstable from %{y:.4g} Pa"
    traces = [_line([n for n, _ in lost], [p for _, p in lost], "stability lost", _LINES[0], hover)]
    traces.append(
        {
            "type": "scatter", "mode": "markers", "x": never, "y": [end] * len(never),
            "name": f"stable up to {pascals(end)}",
            "marker": {"symbol": "triangle-up-open", "color": "#888888"},
            "hovertemplate": "n = %{x}: stable<extra></extra>",
        }
    )  # fmt: skip
    said = [
        (
            str(row["harmonic"]),
            "" if row["stable_from"] is None else pascals(row["stable_from"]),
            {0: "never stable", None: f"{pascals(end)} at least"}.get(row["critical_pressure"])
            or pascals(row["critical_pressure"]),
        )
        for row in chart
    ]
    first = results["critical_pressure"]
    lowest = (
        f"The lowest is {pascals(first)}, n = {results['harmonic']}." if first else "None loses stability."
    )
    log = {"yaxis": {"type": "log"}} if lost and end > 8 * min(p for _, p in lost) else {}
    return Chart(
        "Critical pressure of each harmonic", lowest, traces, "harmonic n", "critical pressure [Pa]", log,
        Table("Critical pressure of each harmonic", ("n", "stable from", "stable up to"), tuple(said)),
    )  # fmt: skip
