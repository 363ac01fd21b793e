"""The chart of a parameter study: what was found over the first number that varies.

It needs no finite elements: on several ranks, PETSc cannot be started by the one that draws.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from lobefem._style import MM, STYLE
from lobefem.parameter_runs import QUANTITIES, Row
from lobefem.parameter_study import Study

__all__ = ["parameter_chart"]

# Okabe and Ito's, each with a mark and a dash of its own for those who see no colours
_LINES = (
    ("#0072B2", "o", "-"), ("#D55E00", "s", "--"), ("#009E73", "^", "-."), ("#B4588F", "D", ":"),
    ("#E69F00", "v", "-"), ("#56B4E9", "P", "--"), ("black", "X", "-."),
)  # fmt: skip
_UNITS = {
    "volume": "volume [m³]",
    "lowest": "lowest eigenvalue [Pa/m, or N/m with nodal mass]",
    "critical_pressure": "critical pressure [Pa]",
    "imposed_ratio": "imposed / original volume",
}
_CROWD = 14  # more lines than that have no key that could be read


def parameter_chart(study: Study, rows: Sequence[Row], *, width: float = 120.0) -> Figure:
    """The first quantity of each row over the first number that varies; a line for each rest.

    Without a number that varies, the rows are named along the axis. Points that found nothing are left
    out.

    Args:
        study: what was computed.
        rows: what was found, in the study's order.
        width: of the figure [mm].
    """
    quantity = QUANTITIES[study.command][0]
    numeric = [name for name in study.varied if len(_numbers(rows, name)) > 1]
    along = numeric[0] if numeric else None
    others = [name for name in study.varied if name != along]
    lines: dict[str, list[tuple[Any, float]]] = {}
    for row in rows:
        y = row.found.get(quantity)
        if y is None:
            continue
        rest = ", ".join(_named(name, row.values[name]) for name in others)
        lines.setdefault(rest if along else "", []).append((row.values[along] if along else rest, y))
    with rc_context(STYLE):
        figure = Figure(figsize=(width * MM, 0.62 * width * MM), layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.add_subplot()
        for k, (name, points) in enumerate(lines.items()):
            colour, mark, dash = _LINES[k % len(_LINES)]
            x, y = zip(*(sorted(points) if along else points), strict=True)
            axes.plot(x, y, mark + (dash if along else ""), color=colour, ms=3, lw=0.9, label=name)
        values = [y for points in lines.values() for _, y in points]
        if values and min(values) > 0 and max(values) > 8 * min(values):
            axes.set_yscale("log")
        elif values and min(values) < 0 < max(values):
            axes.axhline(0.0, color="0.6", lw=0.6, zorder=0)
        if not values:
            axes.text(0.5, 0.5, "no point found anything", transform=axes.transAxes, ha="center")
        if along is None:
            axes.tick_params(axis="x", rotation=30)
        axes.set(xlabel=along or "", ylabel=_UNITS[quantity], title=f"lobefem {study.command}")
        axes.spines[["top", "right"]].set_visible(False)
        if 1 < len(lines) <= _CROWD:
            figure.legend(frameon=False, fontsize=6, loc="outside right upper")
    return figure


def _numbers(rows: Sequence[Row], name: str) -> set[float]:
    values = [row.values[name] for row in rows]
    plain = all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in values)
    return set(values) if plain else set()


def _named(name: str, value: Any) -> str:
    key = name.rpartition(".")[2].replace("_", " ")
    return str(value) if isinstance(value, str) else f"{key} {value}"
