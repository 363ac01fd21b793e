"""Charts of a report as plain data, which the page's script draws: a point may name its shape."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

from lobefem.io.run_reader import Run
from lobefem.typing import Unchecked
from lobefem.units import handy, pascals
from lobefem.viz.report_tables import Table, pairs, rows_of, waves
from lobefem.viz.style import COLOURS, UNITS

__all__ = ["Axis", "Chart", "Series", "Show", "eigenvalues", "finite", "harmonics", "refinement", "rows_with"]

Show = Callable[[int, int], str]  # a step and a stored mode -> the view that shows it, "" if none does


@dataclass(frozen=True)
class Axis:
    """An axis of a chart.

    Attributes:
        label: with the unit.
        scale: "linear", "log" or "symlog" (linear near zero).
        range: values at its ends, None for those of the data.
        ticks: values that are named, None for round ones.
        names: of the ticks, None for the values.
    """

    label: str
    scale: str = "linear"
    range: tuple[float, float] | None = None
    ticks: Sequence[float] | None = None
    names: Sequence[str] | None = None


@dataclass(frozen=True)
class Series:
    """A curve.

    Attributes:
        name: in the key.
        colour: a kind of mode, "gas", ..., "line" (ink) or "quiet" (grey).
        x, y: its points; None breaks the curve.
        hints: of each point, what it is.
        views: of each point, the view that shows its shape, "" for none.
        width: of the line [px], 0 for points alone.
        size: of the points [px], 0 for none.
        dash: True for a dashed line.
    """

    name: str
    colour: str
    x: Sequence[Any] = field(repr=False)
    y: Sequence[Any] = field(repr=False)
    hints: Sequence[str] = field(default=(), repr=False)
    views: Sequence[str] = field(default=(), repr=False)
    width: float = 2.0
    size: float = 4.0
    dash: bool = False


@dataclass(frozen=True)
class Chart:
    """A chart and the same numbers as a table.

    Attributes:
        title: of the chart, one line.
        description: what a reader sees who cannot see it.
        x, y: the axes.
        series: the curves.
        table: the numbers, None where another table has them.
        unstable: True if below zero is the unstable side.
        band: values of x between which the answer lies, and what that is.
        mark: a point that is the answer, and its name.
    """

    title: str
    description: str
    x: Axis
    y: Axis
    series: Sequence[Series] = field(repr=False)
    table: Table | None = field(default=None, repr=False)
    unstable: bool = False
    band: tuple[float, float, str] | None = None
    mark: tuple[float, float, str] | None = None

    @property
    def spec(self) -> dict[str, Any]:
        """The data from which the page's script draws."""
        axes = {
            name: {
                "label": axis.label, "scale": axis.scale, "range": axis.range, "ticks": axis.ticks,
                "names": axis.names,
            }
            for name, axis in (("x", self.x), ("y", self.y))
        }  # fmt: skip
        series = [
            {
                "name": one.name, "colour": one.colour, "x": list(one.x), "y": list(one.y),
                "hints": list(one.hints), "views": list(one.views), "width": one.width, "size": one.size,
                "dash": one.dash,
            }
            for one in self.series
        ]  # fmt: skip
        return axes | {
            "title": self.title, "series": series, "unstable": self.unstable, "band": self.band,
            "mark": self.mark,
        }  # fmt: skip


def rows_with(value: Unchecked, *keys: str) -> list[dict[str, Any]]:
    """The dictionaries of a list that have certain keys."""
    if not isinstance(value, list):
        return []
    return [row for row in value if isinstance(row, dict) and all(key in row for key in keys)]


def finite(value: Unchecked) -> bool:
    """True for a number that is one."""
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def _in(factor: float, values: Sequence[Any]) -> list[Any]:
    return [value / factor if finite(value) else None for value in values]


# --- eigenvalues against pressure ---------------------------------------------------------------
def eigenvalues(run: Run, show: Show) -> Chart | None:
    """lambda-p curves: of followed branches, or of the modes at each pressure by kind and harmonic."""
    results = run.results
    branches = rows_with(results.get("branches"), "kind", "harmonic", "rank", "pressures", "values")
    branches = [row for row in branches if len(row["pressures"]) == len(row["values"]) > 0]
    mass = UNITS.get(str(results.get("mass", "unit")), "Pa/m")
    entries = rows_with(results.get("pressures"), "pressure", "modes")
    places = {entry["pressure"]: step for step, entry in enumerate(entries)}
    if not branches:
        branches = _by_look(entries)
    if not branches:
        return _visited(run, show)
    branches.sort(key=lambda b: (str(b["kind"]), b["harmonic"], b["rank"]))
    last = max(max(b["pressures"]) for b in branches)
    unit, factor = handy(last, "Pa")
    low, high = _window(branches)
    series = []
    for branch in branches:
        kind, minor = str(branch["kind"]), branch["rank"] > 0
        members = branch.get("members") or []
        members = members if len(members) == len(branch["values"]) else [[]] * len(branch["values"])
        views = [
            show(places[p], m[0]) if p in places and m else ""
            for p, m in zip(branch["pressures"], members, strict=True)
        ]
        hints = [
            f"{_name(branch)}: {_told(value)} {mass} at {pascals(p)}"
            for p, value in zip(branch["pressures"], branch["values"], strict=True)
        ]
        strong = not minor and min(branch["values"]) <= high
        series.append(
            Series(
                kind, kind if strong else "quiet", _in(factor, branch["pressures"]), branch["values"], hints,
                views, 2.0 if strong else 0.8, 4.0 if strong else 2.0,
            )
        )  # fmt: skip
    critical: Any = results.get("critical_pressure")
    far, mark = "", None
    if finite(critical) and critical > 1.5 * last:  # would leave the curves no room
        far = f" The critical pressure, {pascals(critical)}, is far to the right."
    elif finite(critical) and critical:
        mark = (critical / factor, 0.0, f"unstable above {pascals(critical)}")
    lowest, band = min(min(b["values"]) for b in branches), _crossing(entries, factor)
    description = (
        f"Eigenvalues of {len(branches)} modes against pressure; the lowest value is {_told(lowest)} {mass}."
        f"{far}{f' The balloon {band[2]}.' if band is not None else ''}"
    )
    table = Table(
        "Eigenvalue curves",
        ("mode", f"pressures [{unit}]", f"eigenvalues [{mass}]"),
        tuple((_name(b), _listed(_in(factor, b["pressures"])), _listed(b["values"])) for b in branches),
    )
    return Chart(
        "Eigenvalues against pressure", description, Axis(f"pressure [{unit}]"),
        _axis(branches, mass, low, high), series, table, unstable=True,
        band=band, mark=mark,
    )  # fmt: skip


def _axis(branches: Sequence[dict[str, Any]], mass: str, low: float, high: float) -> Axis:
    """Linear near zero where the lowest curves would else lie on the axis."""
    sizes = [max(abs(v) for v in b["values"]) for b in branches if min(b["values"]) <= high]
    least = min((size for size in sizes if size > 0), default=0.0)
    label = f"eigenvalue [{mass}]"
    if 0 < 25 * least < high:
        return Axis(label, "symlog", (low, high))
    return Axis(label, "linear", (low, high))


def _crossing(entries: Sequence[dict[str, Any]], factor: float) -> tuple[float, float, str] | None:
    """The interval of pressures in which the balloon becomes unstable."""
    told = sorted((e["pressure"], bool(e["stable"])) for e in entries if "stable" in e)
    for (p, stable), (q, after) in pairwise(told):
        if stable and not after:
            return p / factor, q / factor, f"becomes unstable between {pascals(p)} and {pascals(q)}"
    return None


def _name(branch: dict[str, Any]) -> str:
    more = f" ({branch['rank'] + 1})" if branch["rank"] else ""
    return f"{branch['kind']}, {waves(branch['harmonic'])}{more}"


def _listed(values: Sequence[Any]) -> str:
    return ", ".join(map(_told, values))


def _told(value: Unchecked) -> str:
    return f"{value:.4g}".replace("-", "\N{MINUS SIGN}") if finite(value) else "none"


def _by_look(entries: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Curves through the modes of the same kind and harmonic, a pair being one; by their order."""
    curves: dict[tuple[str, int, int], dict[str, Any]] = {}
    for entry in sorted(entries, key=lambda e: e["pressure"]):
        rank: dict[tuple[str, int], int] = {}
        for numbers, mode in pairs(rows_with(entry["modes"], "kind", "harmonic", "real")):
            look, value = (str(mode["kind"]), int(mode["harmonic"])), float(mode["real"])
            rank[look] = rank.get(look, -1) + 1
            key = (*look, rank[look])
            curve = curves.setdefault(
                key,
                {
                    "kind": look[0], "harmonic": look[1], "rank": key[2], "pressures": [], "values": [],
                    "members": [],
                },
            )  # fmt: skip
            curve["pressures"].append(entry["pressure"])
            curve["values"].append(value)
            curve["members"].append([numbers[0] - 1])
    return list(curves.values()) if len(entries) > 1 else []


def _window(branches: Sequence[dict[str, Any]]) -> tuple[float, float]:
    """Eigenvalues shown at first: all below zero and, above it, the lowest few curves."""
    low = min(min(b["values"]) for b in branches)
    tops = sorted(max(b["values"]) for b in branches)
    high = max(tops[min(5, len(tops) - 1)], 1e-300)
    margin = 0.06 * (high - min(low, 0.0))
    return min(low, 0.0) - margin, high + margin


def _visited(run: Run, show: Show) -> Chart | None:
    """The lowest eigenvalue at the pressures that a search along inflated states has visited."""
    results = run.results
    found = [
        pair
        for pair in results.get("visited") or []
        if isinstance(pair, list) and len(pair) == 2 and all(map(finite, pair))
    ]
    if not found:
        return None
    x, y = (list(column) for column in zip(*sorted(found), strict=True))
    unit, factor = handy(x[-1], "Pa")
    critical: Any = results.get("critical_pressure")
    at = next((s for s, step in enumerate(run.steps) if step.num_modes), None)
    view = "" if at is None else show(at, 0)
    hints = [f"lowest eigenvalue {_told(b)} Pa/m at {pascals(a)}" for a, b in zip(x, y, strict=True)]
    series = [Series("lowest eigenvalue", "sway", _in(factor, x), y, hints)]
    mark = None
    if finite(critical) and critical:
        kind = str(results.get("kind"))
        hint = f"critical at {pascals(critical)}: {kind}"
        mark = (critical / factor, 0.0, f"unstable above {pascals(critical)}")
        colour = kind if kind in COLOURS else "line"
        series.append(Series("critical mode", colour, [critical / factor], [0.0], [hint], [view], 0.0, 7.0))
    head = (f"pressure [{unit}]", "eigenvalue [Pa/m]")
    end = f"; it becomes unstable at {pascals(critical)}" if mark else ""
    return Chart(
        "Lowest eigenvalue along the inflated states",
        f"The lowest eigenvalue at {len(x)} pressures up to {pascals(x[-1])}{end}.",
        Axis(f"pressure [{unit}]"), Axis("eigenvalue [Pa/m]"), series,
        rows_of(head, (_in(factor, x), y), "Lowest eigenvalue at each pressure"), unstable=True, mark=mark,
    )  # fmt: skip


# --- harmonics and meshes -----------------------------------------------------------------------
def harmonics(run: Run, show: Show) -> Chart | None:
    """Critical pressure of each harmonic."""
    results = run.results
    rows = rows_with(results.get("chart"), "harmonic", "critical_pressure", "kind")
    if not rows:
        return None
    crossing = [r for r in rows if finite(r["critical_pressure"]) and r["critical_pressure"] > 0]
    unit, factor = handy(max((r["critical_pressure"] for r in crossing), default=1.0), "Pa")
    at = next((s for s, step in enumerate(run.steps) if step.num_modes), None)
    series = [
        Series(
            "", "quiet", [r["harmonic"] for r in crossing],
            _in(factor, [r["critical_pressure"] for r in crossing]), width=1.0, size=0.0,
        )
    ]  # fmt: skip
    for kind in dict.fromkeys(str(r["kind"]) for r in crossing):
        own = [r for r in crossing if str(r["kind"]) == kind]
        series.append(
            Series(
                kind, kind if kind in COLOURS else "line", [r["harmonic"] for r in own],
                _in(factor, [r["critical_pressure"] for r in own]),
                [f"{kind}, n = {r['harmonic']}: {pascals(r['critical_pressure'])}" for r in own],
                ["" if at is None or r["harmonic"] != results.get("harmonic") else show(at, 0) for r in own],
                0.0, 5.0,
            )
        )  # fmt: skip
    lowest = min(crossing, key=lambda r: r["critical_pressure"], default=None)
    first = "No harmonic turns unstable."
    if lowest is not None:
        first = f"The lowest is {pascals(lowest['critical_pressure'])} at n = {lowest['harmonic']}."
    always = [str(r["harmonic"]) for r in rows if r["critical_pressure"] == 0]
    bounded = any("upper_bound" in r for r in rows)
    if always:
        what = "The lower bound is zero" if bounded else "Unstable at any pressure"
        first = f"{what}: n = {', '.join(always)}.{'' if lowest is None else f' Of the others: {first}'}"
    never = [str(r["harmonic"]) for r in rows if r["critical_pressure"] is None]
    more = f" Never unstable: n = {', '.join(never)}." if never else ""
    head, columns = ["n", "critical pressure [Pa]", "kind"], ["harmonic", "critical_pressure", "kind"]
    if bounded:
        head.append("upper bound [Pa]")
        columns.append("upper_bound")
    title = "Critical pressure of each number of waves around"
    mark = None
    if lowest is not None:
        p = lowest["critical_pressure"]
        mark = (lowest["harmonic"], p / factor, f"lowest: {pascals(p)}")
    return Chart(
        title, f"{first}{more}", Axis("waves around, n"), Axis(f"critical pressure [{unit}]", "log"), series,
        rows_of(head, [[r.get(c) for r in rows] for c in columns], title), mark=mark,
    )  # fmt: skip


def refinement(run: Run) -> Chart | None:
    """Critical pressures under mesh refinement."""
    results = run.results
    rows = rows_with(results.get("meshes"), "divisions", "critical_pressure")
    rows = [r for r in rows if isinstance(r["divisions"], list) and len(r["divisions"]) == 2]
    if not rows:
        return None
    around, values = [r["divisions"][1] for r in rows], [r["critical_pressure"] for r in rows]
    unit, factor = handy(max((v for v in values if finite(v)), default=1.0), "Pa")
    series: list[Series] = []
    low = results.get("low_harmonics")
    columns: dict[str, list[Any]] = {}
    for n, trend in low.items() if isinstance(low, dict) else ():
        found = trend.get("values") if isinstance(trend, dict) else None
        if not isinstance(found, list) or len(found) != len(rows):
            continue
        columns[f"n = {n} [Pa]"] = found
        towards: Any = trend.get("limit")
        converges = trend.get("behaviour") == "converges" and finite(towards)
        more = f", limit {pascals(towards)}" if converges else ""
        hints = [f"n = {n}: {_told(v)} Pa on {a} around{more}" for a, v in zip(around, found, strict=True)]
        series.append(Series("single harmonics", "quiet", around, _in(factor, found), hints, (), 1.0, 3.0))
    hints = [
        f"lowest of all: {_told(r['critical_pressure'])} Pa on {r['divisions'][1]} around"
        f"{', n = ' + str(r['harmonic']) if 'harmonic' in r else ''}"
        for r in rows
    ]
    series.append(Series("lowest of all", "local", around, _in(factor, values), hints, (), 2.5, 5.0))
    published: Any = results.get("published")
    ends = [around[0], around[-1]]
    if finite(published):
        hint = f"published: {pascals(published)}"
        level = [published / factor] * 2
        series.append(Series("published", "sway", ends, level, [hint, hint], (), 1.2, 0.0, True))
    lowest = results.get("lowest")
    behaviour = lowest.get("behaviour") if isinstance(lowest, dict) else None
    limit: Any = lowest.get("limit") if isinstance(lowest, dict) else None
    if behaviour == "converges" and finite(limit):
        hint = f"limit of the fit: {pascals(limit)}"
        series.append(Series("limit", "line", ends, [limit / factor] * 2, [hint, hint], (), 1.2, 0.0, True))
    told = f"The lowest critical pressure on {len(rows)} meshes."
    if finite(values[0]) and finite(values[-1]):
        told = f"From mesh to mesh the lowest goes from {pascals(values[0])} to {pascals(values[-1])}."
    words = {"falls": " It does not converge.", "converges": " It converges.", "open": " Undecided."}
    told += words.get(str(behaviour), "")
    harmonic = {"n": [r["harmonic"] for r in rows]} if all("harmonic" in r for r in rows) else {}
    told_by = {
        "mesh": [" × ".join(map(str, r["divisions"])) for r in rows],
        "lowest of all [Pa]": values,
        **harmonic,
        **columns,
    }
    return Chart(
        "Critical pressure by mesh", told, Axis("divisions around", "log", ticks=around),
        Axis(f"critical pressure [{unit}]", "log"), series,
        rows_of(list(told_by), list(told_by.values()), "Critical pressures by mesh"),
    )  # fmt: skip
