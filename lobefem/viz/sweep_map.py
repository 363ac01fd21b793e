"""Maps: what a sweep over two numbers has found, as contours over both.

A cell without a critical pressure is stable up to the end of its search, one with 0 is never stable, and one
that failed has a reason; a map shows which is which. Drawn from results.json.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from lobefem.frozen import Frozen
from lobefem.io.run_reader import Run
from lobefem.typing import Array, Axes
from lobefem.units import pascals
from lobefem.viz.report_pictures import Picture, png
from lobefem.viz.style import MM, STYLE

__all__ = ["SweepMap", "draw_map", "map_picture", "sweep_map"]

_UNSTABLE, _STABLE, _FAILED = "#D55E00", "#E8F3EE", "0.75"

_FEWEST = 2  # values along each side


@dataclass(frozen=True)
class SweepMap(Frozen):
    """The cells of a sweep over two numbers.

    Attributes:
        names: of both, x and y.
        units: of their values, "" of plain numbers.
        x, y: their values, ascending.
        pressure: critical pressure of each cell (y, x) [Pa]; inf where the balloon is stable up to the end of
            the search, 0 where it is never stable, nan without an answer.
        reasons: of the cells that failed, by (y, x).
        design_pressure: of the design [Pa]; None where the points have several.
    """

    names: tuple[str, str]
    units: tuple[str, str]
    x: Array
    y: Array
    pressure: Array
    reasons: Mapping[tuple[int, int], str]
    design_pressure: float | None

    def unstable(self) -> Any:
        """True for the cells that are unstable at the design's pressure (y, x)."""
        limit = self.design_pressure or 0.0
        return np.asarray(np.where(np.isnan(self.pressure), False, self.pressure <= limit))


def sweep_map(results: Mapping[str, Any]) -> SweepMap | None:
    """The map of a sweep's results; None where they are none of critical pressures over two numbers."""
    rows: Sequence[Mapping[str, Any]] = results.get("rows") or ()
    varied = list(results.get("varied") or ())
    if len(varied) != 2 or results.get("of") not in ("critical", "harmonics"):
        return None
    sides = [_side([row["values"][name] for row in rows]) for name in varied]
    if any(side is None for side in sides):
        return None
    (x, x_unit), (y, y_unit) = (side for side in sides if side is not None)
    xs, ys = np.unique(x), np.unique(y)
    if min(len(xs), len(ys)) < _FEWEST:
        return None
    pressure = np.full((len(ys), len(xs)), np.nan)
    reasons: dict[tuple[int, int], str] = {}
    for row, a, b in zip(rows, x, y, strict=True):
        cell = int(np.searchsorted(ys, b)), int(np.searchsorted(xs, a))
        if row["exit_code"] != 0:
            reasons[cell] = str(row["reason"])
            continue
        found = row["found"].get("critical_pressure")
        pressure[cell] = math.inf if found is None else found
    design: Any = results.get("design_pressure")
    return SweepMap((varied[0], varied[1]), (x_unit, y_unit), xs, ys, pressure, reasons, design)


def _side(values: Sequence[Any]) -> tuple[Array, str] | None:
    """Numbers of plain ones, or of texts with one unit, and the unit; None of others."""
    if all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in values):
        return np.array(values, dtype=float), ""
    parts = [str(v).strip().split(maxsplit=1) for v in values]
    try:
        numbers = np.array([float(part[0]) for part in parts])
    except (ValueError, IndexError):
        return None
    units = {part[1] if len(part) > 1 else "" for part in parts}
    return (numbers, units.pop()) if len(units) == 1 else None


def draw_map(chart: SweepMap, *, width: float = 120.0) -> Figure:
    """Contours of the critical pressure, with what is unstable at the design's pressure, and what failed.

    Args:
        chart: from `sweep_map`.
        width: of the figure [mm].
    """
    p, x, y = chart.pressure, chart.x, chart.y
    finite = np.isfinite(p) & (p > 0)
    with rc_context(STYLE):
        figure = Figure(figsize=(width * MM, 0.72 * width * MM), layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.add_subplot()
        edges = _edges(x), _edges(y)
        if finite.any():
            low, high = float(p[finite].min()), float(p[finite].max())
            norm = LogNorm(low, high) if high > 3 * low else Normalize(min(0.98 * low, low), 1.02 * high)
            shown = np.ma.masked_where(~finite, p)
            mesh = axes.pcolormesh(*edges, shown, norm=norm, cmap="cividis", alpha=0.75, lw=0, zorder=1)
            bar = figure.colorbar(mesh, ax=axes, label="critical pressure [Pa]")
            bar.outline.set_linewidth(0.5)  # type: ignore[operator]
            bar.ax.yaxis.set_major_formatter("{x:g}")
            bar.ax.yaxis.set_minor_formatter("{x:g}")
            bar.ax.tick_params(which="both", labelsize=5.5)
            _contours(axes, x, y, shown, low, high)
        keys = _marks(axes, chart, edges)
        axes.set(
            xlabel=_label(chart.names[0], chart.units[0]),
            ylabel=_label(chart.names[1], chart.units[1]),
            xlim=edges[0][[0, -1]],
            ylim=edges[1][[0, -1]],
        )
        axes.set_xticks(x, [f"{value:g}" for value in x], rotation=30 if len(x) > 10 else 0)
        axes.set_yticks(y, [f"{value:g}" for value in y])
        if keys:
            figure.legend(handles=keys, loc="outside lower center", ncols=2, frameon=False, fontsize=6)
    return figure


def map_picture(run: Run) -> Picture | None:
    """The map of a sweep for a report; None of other runs."""
    cells = sweep_map(run.results)
    if cells is None:
        return None
    x, y = (_label(name, "") for name in cells.names)
    known = cells.pressure[np.isfinite(cells.pressure) & (cells.pressure > 0)]
    span = f" from {pascals(known.min())} to {pascals(known.max())}" if known.size else ""
    alt = (
        f"Critical pressure{span} over {x} and {y}: of {cells.pressure.size} cells "
        f"{int(np.isposinf(cells.pressure).sum())} are stable up to the end of their search, "
        f"{int((cells.pressure == 0).sum())} are never stable, {len(cells.reasons)} failed."
    )
    return Picture(f"Critical pressure over {x} and {y}", alt, png(draw_map(cells)), wide=True)


def _contours(axes: Axes, x: Array, y: Array, pressure: Any, low: float, high: float) -> None:
    """Lines of equal pressure at round values, where four neighbours have one."""
    if high <= 1.05 * low:
        return
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    levels = [k * 10.0**power for power in powers for k in (1, 2, 5) if low < k * 10.0**power < high]
    if len(levels) < 2:
        levels = [float(value) for value in np.linspace(low, high, 5)[1:-1]]
    logarithm = np.ma.log(pressure)
    lines = axes.contour(x, y, logarithm, np.log(levels), colors="black", linewidths=0.7, zorder=3)
    names = {float(np.log(level)): f"{level:.3g} Pa" for level in levels}
    axes.clabel(lines, fontsize=5.5, fmt=lambda value: names.get(float(value), f"{math.exp(value):.3g} Pa"))


def _marks(axes: Axes, chart: SweepMap, edges: tuple[Array, Array]) -> list[Patch]:
    """Mark cells without a number and those unstable at the design's pressure; return the keys."""
    p, keys = chart.pressure, []
    kinds = (
        (np.isposinf(p), {"facecolor": _STABLE, "hatch": "", "label": "stable up to the end of the search"}),
        (p == 0, {"facecolor": _UNSTABLE, "hatch": "", "label": "never stable in its search"}),
        (
            _cells(chart),
            {"facecolor": _FAILED, "hatch": "xx", "label": "failed, see its reason in the table"},
        ),
        (
            chart.unstable() & (p > 0),
            {
                "facecolor": "none",
                "hatch": "////",
                "label": f"unstable at the design's {pascals(chart.design_pressure or 0.0)}",
            },
        ),
    )
    for chosen, look in kinds:
        if not chosen.any():
            continue
        style: dict[str, Any] = {"edgecolor": (0.2, 0.2, 0.2, 0.6), "linewidth": 0.0, **look}
        keys.append(Patch(**style))
        for j, i in np.argwhere(chosen):
            (left, right), (low, high) = edges[0][i : i + 2], edges[1][j : j + 2]
            corners = [(left, low), (right, low), (right, high), (left, high)]
            axes.add_patch(_polygon(corners, style))
    return keys


def _polygon(corners: Sequence[tuple[float, float]], style: Mapping[str, Any]) -> Any:
    from matplotlib.patches import Polygon

    rest = {key: value for key, value in style.items() if key != "label"}
    return Polygon(np.array(corners), closed=True, zorder=2, **rest)


def _cells(chart: SweepMap) -> Array:
    """True for the cells that failed (y, x)."""
    failed = np.zeros(chart.pressure.shape, dtype=bool)
    for cell in chart.reasons:
        failed[cell] = True
    return failed


def _edges(values: Array) -> Array:
    """Edges of the cells about some values."""
    middle = (values[1:] + values[:-1]) / 2
    first, last = 2 * values[0] - middle[0], 2 * values[-1] - middle[-1]
    return np.concatenate([[first], middle, [last]])


def _label(name: str, unit: str) -> str:
    plain = name.rpartition(".")[2].replace("_", " ").replace("-", " ")
    return f"{plain} [{unit}]" if unit else plain
