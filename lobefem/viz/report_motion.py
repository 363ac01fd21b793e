"""Charts of a distortion and its release: force, volume, energy and residual on the way."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from lobefem.io.run_reader import Run
from lobefem.viz.report_charts import Axis, Chart, Series, finite, rows_with
from lobefem.viz.report_tables import number, rows_of

__all__ = ["motion"]

At = Callable[[int], str]  # a point of the history -> the view that shows its shape

_SIGNS = {"gas": ("pressure", 1), "constraint": ("constraint", 1), "strain": ("strain", -1),
          "contact": ("contact", -1), "damping": ("damping", -1)}  # fmt: skip


def motion(run: Run, at: At) -> list[Chart]:
    """Reaction over the ramp; volume, ledger and residual over the release."""
    results = run.results
    rows = rows_with(results.get("history"), "parameter", "reaction", "volume", "time")
    numbered = list(enumerate(rows))
    unit, force = str(results.get("unit", "")), str(results.get("reaction_unit", ""))
    ramp = [(k, r) for k, r in numbered if r["time"] is None and finite(r["parameter"])]
    release = [(k, r) for k, r in numbered if finite(r["time"]) and r["time"] > 0]
    charts = []
    if ramp:
        x, y = [r["parameter"] for _, r in ramp], [r["reaction"] for _, r in ramp]
        more = ([r.get(key) for _, r in ramp] for key in ("volume", "contact_force"))
        head = (f"distortion [{unit}]", f"reaction [{force}]", "volume [m³]", "contact force [N]")
        hints = [f"{number(b)} {force} at {number(a)} {unit}" for a, b in zip(x, y, strict=True)]
        charts.append(
            Chart(
                "Force against distortion",
                f"{len(ramp)} steps; the reaction ends at {number(y[-1])} {force}.",
                Axis(head[0]), Axis(head[1]),
                [Series("reaction", "sway", x, y, hints, [at(k) for k, _ in ramp])],
                rows_of(head, (x, y, *more), "The distortion, step by step"),
            )
        )  # fmt: skip
    if release:
        charts += _release(release, at)
    return charts


def _release(release: Sequence[tuple[int, dict[str, Any]]], at: At) -> list[Chart]:
    rows = [r for _, r in release]
    time, volume = [r["time"] for r in rows], [r["volume"] for r in rows]
    views = [at(k) for k, _ in release]
    axis = Axis("time [s]", "log")

    def line(name: str, colour: str, values: Sequence[Any], unit: str) -> Series:
        hints = [f"{name}: {number(v)} {unit} after {number(t)} s" for t, v in zip(time, values, strict=True)]
        return Series(name, colour, time, values, hints, views, 2.0, 3.0)

    said = (
        f"{len(rows)} steps over {number(time[-1])} s; from {number(volume[0])} to {number(volume[-1])} m³."
    )
    charts = [
        Chart(
            "Volume after the release", said, axis, Axis("volume [m³]"),
            [line("volume", "sway", volume, "m³")],
            rows_of(("time [s]", "volume [m³]"), (time, volume), "The release, step by step"),
        )
    ]  # fmt: skip
    ledgers = [r["ledger"] for r in rows if isinstance(r.get("ledger"), dict)]
    if len(ledgers) == len(rows):
        terms = {
            name: [sign * ledger.get(key, math.nan) for ledger in ledgers]
            for name, (key, sign) in _SIGNS.items()
        }
        terms["sum"] = [math.fsum(column) for column in zip(*terms.values(), strict=True)]
        charts.append(
            Chart(
                "Energy after the release",
                "Work of gas and constraint less what strain, contact and damping took; the sum, what is "
                f"not accounted for, is {number(terms['sum'][-1])} J at the end.",
                axis, Axis("energy [J]"),
                [line(name, name, values, "J") for name, values in terms.items()],
                rows_of(("time [s]", *(f"{n} [J]" for n in terms)), (time, *terms.values()), "The ledger"),
            )
        )  # fmt: skip
    residual = [r.get("residual") for r in rows]
    if all(map(finite, residual)):
        charts.append(
            Chart(
                "Residual after the release",
                f"The residual over the load falls from {residual[0]:.1e} to {residual[-1]:.1e}.",
                axis, Axis("residual / load", "log"), [line("residual", "local", residual, "of the load")],
            )
        )  # fmt: skip
    return charts
