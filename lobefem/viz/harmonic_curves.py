"""Figures of a pumpkin's stability: eigenvalues by harmonic against pressure, critical pressures by harmonic.

They are drawn from results as results.json has them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from lobefem.units import pascals
from lobefem.viz.style import MM, STYLE

__all__ = ["critical_pressures", "curves", "eigenvalues", "named_harmonics", "spectrum"]

Results = Mapping[str, Any]

# Okabe and Ito's
_LINES = ("#0072B2", "#D55E00", "#009E73", "#B4588F", "#E69F00", "#56B4E9", "black")

_UNSTABLE = "#D55E00"


def named_harmonics(results: Results, most: int = 6) -> list[int]:
    """The harmonics that a chart names: those that cross zero first, then the lowest ones; ascending.

    Args:
        results: of `critical` or `harmonics` of a pumpkin.
        most: how many.
    """
    crossing = dict.fromkeys(crossing["harmonic"] for crossing in results["crossings"])
    lowest = sorted(results["curves"], key=lambda curve: min(curve["values"]))
    return sorted(list(dict.fromkeys([*crossing, *(curve["harmonic"] for curve in lowest)]))[:most])


def _blank(width: float, results: Results, title: str) -> tuple[Figure, Any]:
    figure = Figure(figsize=(width * MM, 0.72 * width * MM), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_title(title or f"{results['gores']} gores", loc="left")
    return figure, axes


def curves(results: Results, *, width: float = 85.0) -> Figure:
    """The figure of a run: of modes by harmonic, of a search against pressure, of all harmonics p_cr(n)."""
    draw = {"modes": spectrum, "harmonics": critical_pressures}.get(str(results.get("command")), eigenvalues)
    return draw(results, width=width)


def eigenvalues(results: Results, *, title: str = "", width: float = 85.0) -> Figure:
    """The lowest eigenvalue of each harmonic against pressure, those that matter with their names.

    Args:
        results: of `critical` or `harmonics` of a pumpkin.
        title: over the figure; by default the number of gores.
        width: of the figure [mm].
    """
    p = np.array([pair[0] for pair in results["visited"]])
    named = named_harmonics(results)
    shown = {c["harmonic"]: np.array(c["values"]) for c in results["curves"] if c["harmonic"] in named}
    # about zero, where it matters: high harmonics are a thousand times as stiff
    critical = results["critical_pressure"]
    matters = [shown[results["harmonic"]]] if critical else list(shown.values())
    high = max(float(np.max(values)) for values in matters)
    high = 4 * high if critical else max(high, 0.0)
    lowest = min(0.0, *(float(values.min()) for values in shown.values()))
    low = max(lowest, -high) if high > 0 else lowest
    with rc_context(STYLE):
        figure, axes = _blank(width, results, title)
        for curve in results["curves"]:
            if curve["harmonic"] not in named:
                axes.plot(p, curve["values"], "-", color="0.85", lw=0.5, zorder=1)
        for k, n in enumerate(named):
            axes.plot(p, shown[n], ".-", ms=2.5, lw=1.0, color=_LINES[k % len(_LINES)], label=f"$n$ = {n}")
        span = max(high, -low, 1e-12)
        bottom = low - 0.15 * span
        axes.axhline(0.0, color="0.2", lw=0.7, zorder=0)
        axes.axhspan(bottom, 0.0, color=_UNSTABLE, alpha=0.10, lw=0, zorder=0)
        axes.set_ylim(bottom, 1.2 * max(high, 0.2 * span))
        if critical:
            side, shift = ("left", 5) if critical < 0.4 * p[-1] else ("right", -5)
            axes.plot(critical, 0.0, "o", ms=4.5, mfc="white", mec="black", mew=0.9, zorder=5)
            axes.annotate(
                f"{pascals(critical)}, $n$ = {results['harmonic']}",
                (critical, 0.0), xytext=(shift, -4), textcoords="offset points", ha=side, va="top",
                fontsize=6.5,
            )  # fmt: skip
        axes.set(xlabel="pressure $p$ [Pa]", ylabel=r"lowest eigenvalue $\lambda_n$ [Pa/m]")
        axes.set_xlim(0, None)
        axes.legend(frameon=False, fontsize=6, loc="best")
    return figure


def critical_pressures(results: Results, *, title: str = "", width: float = 85.0) -> Figure:
    """p_cr(n): where each harmonic loses stability; triangles where it does not up to the search's end.

    Args:
        results: of `critical` or `harmonics` of a pumpkin.
        title: over the figure; by default the number of gores.
        width: of the figure [mm].
    """
    chart, end = results["chart"], results["searched_to"]
    lost = [(row["harmonic"], row["critical_pressure"]) for row in chart if row["critical_pressure"]]
    never = [row["harmonic"] for row in chart if row["critical_pressure"] is None]
    always = [row["harmonic"] for row in chart if row["critical_pressure"] == 0]
    gained = [(row["harmonic"], row["stable_from"]) for row in chart if row["stable_from"]]
    known = [p for _, p in [*lost, *gained]] or [end]
    with rc_context(STYLE):
        figure, axes = _blank(width, results, title)
        if lost:
            axes.plot(*zip(*lost, strict=True), "o-", ms=3, lw=0.8, color=_LINES[0], label="stability lost")
        if gained:
            axes.plot(*zip(*gained, strict=True), "v", ms=3.5, color=_LINES[2], label="stability gained")
        if never:
            style = {
                "ms": 3,
                "mfc": "none",
                "mec": "0.4",
                "mew": 0.7,
                "label": f"stable up to {pascals(end)}",
            }
            axes.plot(never, [end] * len(never), "^", **style)
        if always:
            axes.plot(
                always, [min(known)] * len(always), "x", ms=4, color=_UNSTABLE, label="unstable throughout"
            )
        if max([*known, end]) > 8 * min(known):
            axes.set_yscale("log")
        else:
            axes.set_ylim(0, 1.15 * max([*known, end]))
        axes.set_xlim(chart[0]["harmonic"] - 0.5, chart[-1]["harmonic"] + 0.5)
        critical = results["critical_pressure"]
        if critical:
            n = results["harmonic"]
            side, shift = ("left", 5) if n < 0.7 * chart[-1]["harmonic"] else ("right", -5)
            axes.annotate(
                f"{pascals(critical)}, $n$ = {n}",
                (n, critical), xytext=(shift, -2), textcoords="offset points", ha=side, va="top",
                fontsize=6.5,
            )  # fmt: skip
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set(xlabel="harmonic $n$", ylabel="critical pressure [Pa]")
        axes.legend(frameon=False, fontsize=6, loc="best")
    return figure


def spectrum(results: Results, *, title: str = "", width: float = 85.0) -> Figure:
    """The lowest eigenvalue of each harmonic at the pressures of a modes run.

    Args:
        results: of `modes` of a pumpkin.
        title: over the figure; by default the number of gores.
        width: of the figure [mm].
    """
    entries: Sequence[Mapping[str, Any]] = results["pressures"]
    unit = "N/m" if results["mass"] == "nodal" else "Pa/m"
    values = [row["lowest"] for entry in entries for row in entry["by_harmonic"]]
    with rc_context(STYLE):
        figure, axes = _blank(width, results, title)
        for k, entry in enumerate(entries):
            n, lowest = zip(*((row["harmonic"], row["lowest"]) for row in entry["by_harmonic"]), strict=True)
            colour = _LINES[k % len(_LINES)]
            axes.plot(n, lowest, ".-", ms=3, lw=0.9, color=colour, label=pascals(entry["pressure"]))
        if min(values) > 0:
            axes.set_yscale("log")
        else:
            smallest = min(abs(value) for value in values if value)
            axes.set_yscale("symlog", linthresh=10.0 ** math.ceil(math.log10(smallest)))
            bottom, top = axes.get_ylim()
            axes.axhspan(bottom, 0.0, color=_UNSTABLE, alpha=0.10, lw=0, zorder=0)
            axes.set_ylim(bottom, top)
            axes.axhline(0.0, color="0.2", lw=0.7, zorder=0)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set(xlabel="harmonic $n$", ylabel=rf"lowest eigenvalue $\lambda_n$ [{unit}]")
        axes.legend(frameon=False, fontsize=6, loc="best")
    return figure
