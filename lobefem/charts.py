"""Figures of critical pressures: by harmonic.

Matplotlib is used through its objects: no window system is needed, no global state is touched.
"""

from __future__ import annotations

import numpy as np
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from lobefem._style import COLOURS, MM, STYLE
from lobefem.chart import HarmonicChart

__all__ = ["harmonic_pressures"]


def harmonic_pressures(chart: HarmonicChart, *, title: str = "", width: float = 85.0) -> Figure:
    """p_crit(n) on a logarithmic axis; harmonics that never turn unstable lie on the upper edge.

    Args:
        chart: from `lobefem.chart`.
        title: over the figure; by default lobes and mesh.
        width: of the figure [mm].
    """
    n, p = np.array(chart.harmonics), np.array(chart.pressures)
    kinds = np.array(chart.kinds)
    crossing = np.isfinite(p) & (p > 0)
    lobes = "1 lobe" if chart.lobes == 1 else f"{chart.lobes} lobes"
    with rc_context(STYLE):
        figure = Figure(figsize=(width * MM, 0.72 * width * MM), layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.add_subplot()
        axes.set_yscale("log")
        axes.plot(n[crossing], p[crossing], "-", color="0.75", lw=0.7, zorder=1)
        for kind, colour in COLOURS.items():
            chosen = crossing & (kinds == kind)
            if chosen.any():
                axes.plot(n[chosen], p[chosen], "o", ms=3, color=colour, label=kind, zorder=2)
        low, high = (p[crossing].min(), p[crossing].max()) if crossing.any() else (1.0, 10.0)
        axes.set_ylim(low / 2, 4 * high)
        never = np.isinf(p)
        if never.any():
            axes.plot(
                n[never], np.full(never.sum(), 3 * high), "^", ms=3, mfc="none", mec="0.4", mew=0.7,
                label="never unstable",
            )  # fmt: skip
        if crossing.any():
            first = int(np.argmin(np.where(crossing, p, np.inf)))
            axes.annotate(
                f"{p[first]:.4g} Pa, n = {n[first]}",
                (n[first], p[first]),
                xytext=(0, -8),
                textcoords="offset points",
                ha="center",
                va="top",
                fontsize=6.5,
            )
            axes.set_ylim(low / 3, 4 * high)
        axes.set(xlabel="harmonic $n$", ylabel="critical pressure [Pa]")
        mesh = f"{chart.divisions[0]} × {chart.divisions[1]} divisions"
        axes.set_title(title or f"{lobes}, {mesh}", loc="left")
        axes.spines[["top", "right"]].set_visible(False)
        axes.legend(frameon=False, fontsize=6, loc="best")
    return figure
