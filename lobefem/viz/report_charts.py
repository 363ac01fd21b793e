"""Charts of a report as Plotly's plain data: hovering over a point tells what it is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from lobefem.io.run_reader import Run
from lobefem.typing import Unchecked
from lobefem.units import pascals
from lobefem.viz.report_tables import Table, rows_of
from lobefem.viz.style import COLOURS, LEDGER, UNITS

__all__ = ["Chart", "eigenvalues", "harmonics", "history", "refinement"]


@dataclass(frozen=True)
class Chart:
    """A chart and the same numbers as a table.

    Attributes:
        title: of the chart, one line.
        description: what a reader sees who cannot see it.
        traces: Plotly's data.
        x, y: titles of the axes.
        layout: what else Plotly's layout holds.
        table: the numbers, None where another table has them.
    """

    title: str
    description: str
    traces: list[dict[str, Any]] = field(repr=False)
    x: str
    y: str
    layout: dict[str, Any] = field(default_factory=dict, repr=False)
    table: Table | None = field(default=None, repr=False)

    @property
    def spec(self) -> dict[str, Any]:
        """The data from which the page's script draws."""
        axes = {"xaxis": {"title": {"text": self.x}}, "yaxis": {"title": {"text": self.y}}}
        for axis, more in self.layout.items():
            axes[axis] = axes.get(axis, {}) | more
        return {"data": self.traces, "layout": axes}


def _rows(value: Unchecked, *keys: str) -> list[dict[str, Any]]:
    """The dictionaries of a list that have certain keys."""
    if not isinstance(value, list):
        return []
    return [row for row in value if isinstance(row, dict) and all(key in row for key in keys)]


def _finite(value: Unchecked) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


# --- eigenvalues against pressure ---------------------------------------------------------------
def eigenvalues(run: Run) -> Chart | None:
    """lambda-p curves: of followed branches, or of the modes at each pressure by kind and harmonic."""
    results = run.results
    branches = _rows(results.get("branches"), "kind", "harmonic", "rank", "pressures", "values")
    branches = [row for row in branches if len(row["pressures"]) == len(row["values"]) > 0]
    unit = UNITS.get(str(results.get("mass", "unit")), "Pa/m")
    if not branches:
        branches = _by_look(_rows(results.get("pressures"), "pressure", "modes"))
    if not branches:
        return _visited(run)
    branches.sort(key=lambda b: (str(b["kind"]), b["harmonic"], b["rank"]))
    # one trace of each kind, gaps between its curves: a browser draws ten at once, a hundred late
    traces: dict[tuple[str, bool], dict[str, Any]] = {}
    for branch in branches:
        kind = str(branch["kind"])
        minor = kind == "local" and branch["rank"] > 0
        trace = traces.setdefault(
            (kind, minor),
            {
                "type": "scatter", "mode": "lines+markers",
                "x": [], "y": [], "text": [],
                "name": f"{kind}, higher" if minor else kind, "opacity": 0.6 if minor else 1.0,
                "line": {"color": COLOURS.get(kind, "#777777"), "width": 0.6 if minor else 1.8},
                # a mode that is among the lowest at one pressure only is a point
                "marker": {"size": 2 if minor else 5}, "connectgaps": False,
                "hovertemplate": f"%{{text}}<br>%{{y:.4g}} {unit} at %{{x:.4g}} Pa<extra></extra>",
            },
        )  # fmt: skip
        trace["x"] += [*branch["pressures"], None]
        trace["y"] += [*branch["values"], None]
        trace["text"] += [_name(branch)] * (len(branch["values"]) + 1)
    shown = list(traces.values())
    critical: Any = results.get("critical_pressure")
    last = max(max(b["pressures"]) for b in branches)
    far = ""
    if _finite(critical) and critical > 1.5 * last:  # would leave the curves no room
        far = f" The critical pressure, {pascals(critical)}, is far to the right."
    elif _finite(critical) and critical:
        n = results.get("harmonic")
        shown.append(
            {
                "type": "scatter", "mode": "markers", "x": [critical], "y": [0.0], "name": "critical",
                "marker": {"symbol": "circle-open", "size": 12, "line": {"width": 2}, "color": "#888888"},
                "hovertemplate": f"critical pressure %{{x:.4g}} Pa, n = {n}<extra></extra>",
            }
        )  # fmt: skip
    lowest = min(min(b["values"]) for b in branches)
    told = f"the lowest value is {lowest:.4g} {unit}"
    description = f"Eigenvalues of {len(branches)} modes against pressure; {told}.{far}"
    table = Table(
        "Eigenvalue curves",
        ("mode", "pressures [Pa]", f"eigenvalues [{unit}]"),
        tuple((_name(b), _listed(b["pressures"]), _listed(b["values"])) for b in branches),
    )
    layout = {"yaxis": {"range": _window(branches), "zeroline": True}}
    return Chart(
        "Eigenvalues against pressure", description, shown, "pressure p [Pa]", f"eigenvalue λ [{unit}]",
        layout, table,
    )  # fmt: skip


def _name(branch: dict[str, Any]) -> str:
    more = f" ({branch['rank'] + 1})" if branch["rank"] else ""
    return f"{branch['kind']}, n = {branch['harmonic']}{more}"


def _listed(values: Sequence[float]) -> str:
    return ", ".join(f"{value:.4g}" for value in values).replace("-", "\N{MINUS SIGN}")


def _by_look(entries: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Curves through the modes of the same kind and harmonic, a pair being one; by their order."""
    curves: dict[tuple[str, int, int], dict[str, Any]] = {}
    for entry in sorted(entries, key=lambda e: e["pressure"]):
        last: dict[tuple[str, int], float] = {}
        rank: dict[tuple[str, int], int] = {}
        for mode in _rows(entry["modes"], "kind", "harmonic", "real"):
            look, value = (str(mode["kind"]), int(mode["harmonic"])), float(mode["real"])
            if look in last and abs(value - last[look]) <= 1e-5 * max(abs(value), abs(last[look])):
                continue
            last[look], rank[look] = value, rank.get(look, -1) + 1
            key = (*look, rank[look])
            curve = curves.setdefault(
                key, {"kind": look[0], "harmonic": look[1], "rank": key[2], "pressures": [], "values": []}
            )
            curve["pressures"].append(entry["pressure"])
            curve["values"].append(value)
    return list(curves.values()) if len(entries) > 1 else []


def _window(branches: Sequence[dict[str, Any]]) -> list[float]:
    """Eigenvalues shown at first: all below zero and, above it, the lowest few curves."""
    low = min(min(b["values"]) for b in branches)
    tops = sorted(max(b["values"]) for b in branches)
    high = max(tops[min(7, len(tops) - 1)], 1e-300)
    margin = 0.06 * (high - min(low, 0.0))
    return [min(low, 0.0) - margin, high + margin]


def _visited(run: Run) -> Chart | None:
    """The lowest eigenvalue at the pressures that a search along inflated states has visited."""
    pairs = [
        pair
        for pair in run.results.get("visited") or []
        if isinstance(pair, list) and len(pair) == 2 and all(map(_finite, pair))
    ]
    if not pairs:
        return None
    x, y = (list(column) for column in zip(*sorted(pairs), strict=True))
    kind, n = run.results.get("kind"), run.results.get("harmonic")
    trace = {
        "type": "scatter", "mode": "lines+markers", "x": x, "y": y, "name": "lowest",
        "line": {"color": COLOURS["sway"], "width": 1.8},
        "hovertemplate": "lowest mode: %{y:.4g} Pa/m at %{x:.4g} Pa<extra></extra>",
    }  # fmt: skip
    end = f"; it turns unstable by a {kind} mode of harmonic {n}" if kind else ""
    return Chart(
        "Lowest eigenvalue along the inflated states",
        f"The lowest eigenvalue at {len(x)} pressures up to {pascals(x[-1])}{end}.",
        [trace], "pressure p [Pa]", "eigenvalue λ [Pa/m]", {},
        rows_of(("pressure [Pa]", "eigenvalue [Pa/m]"), (x, y), "Lowest eigenvalue at each pressure"),
    )  # fmt: skip


# --- harmonics and meshes -----------------------------------------------------------------------
def harmonics(run: Run) -> Chart | None:
    """Critical pressure of each harmonic."""
    rows = _rows(run.results.get("chart"), "harmonic", "critical_pressure", "kind")
    crossing = [r for r in rows if _finite(r["critical_pressure"]) and r["critical_pressure"] > 0]
    if not rows:
        return None
    traces: list[dict[str, Any]] = [
        {
            "type": "scatter", "mode": "lines", "x": [r["harmonic"] for r in crossing],
            "y": [r["critical_pressure"] for r in crossing], "showlegend": False, "hoverinfo": "skip",
            "line": {"color": "#999999", "width": 1},
        }
    ]  # fmt: skip
    for kind in dict.fromkeys(str(r["kind"]) for r in crossing):
        own = [r for r in crossing if str(r["kind"]) == kind]
        traces.append(
            {
                "type": "scatter", "mode": "markers", "x": [r["harmonic"] for r in own],
                "y": [r["critical_pressure"] for r in own], "name": kind,
                "marker": {"size": 8, "color": COLOURS.get(kind, "#777777")},
                "text": [kind] * len(own),
                "hovertemplate": "%{text}, n = %{x}<br>%{y:.4g} Pa<extra></extra>",
            }
        )  # fmt: skip
    lowest = min(crossing, key=lambda r: r["critical_pressure"], default=None)
    first = "No harmonic turns unstable."
    if lowest is not None:
        first = f"The lowest is {lowest['critical_pressure']:.4g} Pa at n = {lowest['harmonic']}."
    always = [str(r["harmonic"]) for r in rows if r["critical_pressure"] == 0]
    if always:
        what = (
            "The lower bound is zero" if any("upper_bound" in r for r in rows) else "Unstable at any pressure"
        )
        first = f"{what}: n = {', '.join(always)}.{'' if lowest is None else f' Of the others: {first}'}"
    never = [str(r["harmonic"]) for r in rows if r["critical_pressure"] is None]
    more = f" Never unstable: n = {', '.join(never)}." if never else ""
    head, columns = ["n", "critical pressure [Pa]", "kind"], ["harmonic", "critical_pressure", "kind"]
    if any("upper_bound" in r for r in rows):
        head.append("upper bound [Pa]")
        columns.append("upper_bound")
    title = "Critical pressure of each harmonic"
    return Chart(
        title, f"{first}{more}", traces, "harmonic n", "critical pressure [Pa]", {"yaxis": {"type": "log"}},
        rows_of(head, [[r.get(c) for r in rows] for c in columns], title),
    )  # fmt: skip


def refinement(run: Run) -> Chart | None:
    """Critical pressures under mesh refinement."""
    rows = _rows(run.results.get("meshes"), "divisions", "critical_pressure")
    rows = [r for r in rows if isinstance(r["divisions"], list) and len(r["divisions"]) == 2]
    if not rows:
        return None
    around = [r["divisions"][1] for r in rows]
    traces: list[dict[str, Any]] = []
    low = run.results.get("low_harmonics")
    columns: dict[str, list[Any]] = {}
    for n, trend in low.items() if isinstance(low, dict) else ():
        values = trend.get("values") if isinstance(trend, dict) else None
        if not isinstance(values, list) or len(values) != len(rows):
            continue
        columns[f"n = {n} [Pa]"] = values
        limit = trend.get("limit")
        ends = f", limit {limit:.4g} Pa" if trend.get("behaviour") == "converges" and _finite(limit) else ""
        traces.append(
            {
                "type": "scatter", "mode": "lines+markers", "x": around, "y": values, "name": f"n = {n}",
                "line": {"color": "#999999", "width": 1}, "marker": {"size": 5},
                "hovertemplate": f"n = {n}: %{{y:.4g}} Pa on %{{x}} divisions{ends}<extra></extra>",
            }
        )  # fmt: skip
    traces.append(
        {
            "type": "scatter", "mode": "lines+markers", "x": around,
            "y": [r["critical_pressure"] for r in rows], "name": "lowest of all",
            "line": {"color": COLOURS["local"], "width": 2.5}, "marker": {"size": 8},
            "text": [f", n = {r['harmonic']}" if "harmonic" in r else "" for r in rows],
            "hovertemplate": "lowest of all%{text}<br>%{y:.4g} Pa on %{x} divisions<extra></extra>",
        }
    )  # fmt: skip
    published = run.results.get("published")
    if _finite(published):
        traces.append(
            {
                "type": "scatter", "mode": "lines", "x": [around[0], around[-1]], "y": [published, published],
                "name": "published", "line": {"color": COLOURS["sway"], "width": 1.2, "dash": "dash"},
                "hovertemplate": f"published: {published:.4g} Pa<extra></extra>",
            }
        )  # fmt: skip
    values = [r["critical_pressure"] for r in rows]
    told = f"The lowest critical pressure on {len(rows)} meshes."
    if _finite(values[0]) and _finite(values[-1]):
        told = f"From mesh to mesh the lowest goes from {pascals(values[0])} to {pascals(values[-1])}."
    words = {"falls": " It does not converge.", "converges": " It converges.", "open": " Undecided."}
    told += words.get(run.results.get("lowest", {}).get("behaviour"), "")
    harmonic = {"n": [r["harmonic"] for r in rows]} if all("harmonic" in r for r in rows) else {}
    told_by = {
        "mesh": [" × ".join(map(str, r["divisions"])) for r in rows],
        "lowest of all [Pa]": values,
        **harmonic,
        **columns,
    }
    table = rows_of(list(told_by), list(told_by.values()), "Critical pressures by mesh")
    return Chart(
        "Critical pressure by mesh",
        told, traces, "divisions around", "critical pressure [Pa]",
        {"xaxis": {"type": "log", "tickvals": around, "ticktext": [*map(str, around)]},
         "yaxis": {"type": "log"}},
        table,
    )  # fmt: skip


# --- distortion and release ---------------------------------------------------------------------
def history(run: Run) -> list[Chart]:
    """Reaction over the ramp; volume, ledger and residual over the release."""
    results = run.results
    rows = _rows(results.get("history"), "parameter", "reaction", "volume", "time")
    unit, force = str(results.get("unit", "")), str(results.get("reaction_unit", ""))
    ramp = [r for r in rows if r["time"] is None and _finite(r["parameter"])]
    motion = [r for r in rows if _finite(r["time"]) and r["time"] > 0]
    charts = []
    if ramp:
        x, y = [r["parameter"] for r in ramp], [r["reaction"] for r in ramp]
        more = ([r.get(key) for r in ramp] for key in ("volume", "contact_force"))
        head = (f"distortion [{unit}]", f"reaction [{force}]", "volume [m³]", "contact force [N]")
        hover = f"%{{y:.4g}} {force} at %{{x:.4g}} {unit}"
        charts.append(
            Chart(
                "Ramp: reaction against distortion",
                f"{len(ramp)} steps; the reaction ends at {_told(y[-1])} {force}.",
                [_line(x, y, "reaction", COLOURS["sway"], hover)], *head[:2], {},
                rows_of(head, (x, y, *more), "The ramp"),
            )
        )  # fmt: skip
    if motion:
        charts += _release(motion)
    return charts


def _told(value: Unchecked) -> str:
    return f"{value:.4g}" if _finite(value) else "none"


def _release(motion: Sequence[dict[str, Any]]) -> list[Chart]:
    time, volume = [r["time"] for r in motion], [r["volume"] for r in motion]
    logarithmic = {"xaxis": {"type": "log"}}
    said = f"{len(motion)} steps over {time[-1]:.4g} s; from {_told(volume[0])} to {_told(volume[-1])} m³."
    line = _line(time, volume, "volume", COLOURS["sway"], "%{y:.4g} m³ after %{x:.4g} s")
    charts = [Chart("Release: volume against time", said, [line], "time [s]", "volume [m³]", logarithmic)]
    ledgers = [r["ledger"] for r in motion if isinstance(r.get("ledger"), dict)]
    if len(ledgers) == len(motion):
        signs = {"gas": ("pressure", 1), "constraint": ("constraint", 1), "strain": ("strain", -1),
                 "contact": ("contact", -1), "damping": ("damping", -1)}  # fmt: skip
        terms = {
            name: [sign * ledger.get(key, math.nan) for ledger in ledgers]
            for name, (key, sign) in signs.items()
        }
        terms["sum"] = [math.fsum(column) for column in zip(*terms.values(), strict=True)]
        charts.append(
            Chart(
                "Release: ledger of energy",
                "Work of gas and constraint less what strain, contact and damping took; the sum, what is "
                f"not accounted for, is {_told(terms['sum'][-1])} J at the end.",
                [
                    _line(time, values, name, colour, f"{name}: %{{y:.4g}} J after %{{x:.4g}} s")
                    for (name, values), colour in zip(terms.items(), LEDGER, strict=True)
                ],
                "time [s]", "energy [J]", logarithmic,
                rows_of(("time [s]", *(f"{n} [J]" for n in terms)), (time, *terms.values()), "The ledger"),
            )
        )  # fmt: skip
    residual = [r.get("residual") for r in motion]
    if all(map(_finite, residual)):
        charts.append(
            Chart(
                "Release: residual against time",
                f"The residual over the load falls from {residual[0]:.1e} to {residual[-1]:.1e}.",
                [_line(time, residual, "residual", COLOURS["local"], "%{y:.3g} of it after %{x:.4g} s")],
                "time [s]", "residual / load", logarithmic | {"yaxis": {"type": "log"}},
            )
        )  # fmt: skip
    return charts


def _line(x: Sequence[float], y: Sequence[Any], name: str, colour: str, hover: str) -> dict[str, Any]:
    return {
        "type": "scatter", "mode": "lines+markers", "x": list(x), "y": list(y), "name": name,
        "line": {"color": colour, "width": 1.8}, "marker": {"size": 4},
        "hovertemplate": f"{hover}<extra></extra>",
    }  # fmt: skip
