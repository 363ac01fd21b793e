"""A run's curves as a figure, from its results alone."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from lobefem import charts, plotting
from lobefem.branches import Branch
from lobefem.runs import Run

__all__ = ["curves"]


def curves(run: Run, width: float) -> Figure:
    """The figure of a run's curves: eigenvalues, a path, harmonics, meshes or a history.

    Args:
        run: that holds some.
        width: of the figure [mm].
    """
    results = run.results
    if results.get("branches"):
        branches = [
            Branch(
                b["kind"],
                b["harmonic"],
                b["rank"],
                np.array(b["pressures"], float),
                np.array(b["values"], float),
            )
            for b in results["branches"]
        ]
        return plotting.eigenvalue_curves(branches, mass=results["mass"], title=_name(results), width=width)
    if results.get("visited"):
        return charts.lowest_along_path(
            results["visited"],
            title=_name(results),
            critical=results["critical_pressure"],
            mode=f"{results['kind']}, n = {results['harmonic']}",
            width=width,
        )
    if results.get("chart"):
        return charts.harmonic_pressures(_chart(results), width=width)
    if results.get("meshes"):
        return charts.refinement(_study(results), width=width)
    return charts.perturbation(
        _history(results), unit=results["unit"], reaction_unit=results["reaction_unit"], width=width
    )


def _name(results: dict[str, Any] | Any) -> str:
    lobes = "1 lobe" if results["lobes"] == 1 else f"{results['lobes']} lobes"
    return f"{lobes}, {results['film'].replace('-', ' ')}, {results['state']} state"


def _number(value: Any, missing: float) -> float:
    return missing if value is None else float(value)


def _chart(results: Any) -> Any:
    from lobefem.chart import HarmonicChart

    rows = results["chart"]
    return HarmonicChart(
        tuple(row["harmonic"] for row in rows),
        tuple(_number(row["critical_pressure"], math.inf) for row in rows),
        tuple(row["kind"] for row in rows),
        tuple(_number(row["residual"], math.nan) for row in rows),
        tuple(results["divisions"]),
        results["lobes"],
    )


def _study(results: Any) -> Any:
    from lobefem.chart import HarmonicChart
    from lobefem.mesh_study import MeshStudy, Trend

    def trend(data: dict[str, Any]) -> Trend:
        values = {name: _number(data[name], math.nan) for name in ("limit", "order", "uncertainty")}
        return Trend(tuple(_number(p, math.inf) for p in data["pressures"]), data["behaviour"], **values)

    return MeshStudy(
        results["film"],
        results["lobes"],
        tuple(
            HarmonicChart(
                (row["harmonic"],), (_number(row["critical_pressure"], math.inf),), ("",), (math.nan,),
                tuple(row["divisions"]), results["lobes"],
            )
            for row in results["meshes"]
        ),
        trend(results["lowest"]),
        {int(n): trend(data) for n, data in results["low_harmonics"].items()},
        (),
        results["published"],
        results["published_around"],
    )  # fmt: skip


def _history(results: Any) -> Any:
    from lobefem.flow import Ledger
    from lobefem.perturbation import Point

    factor = math.pi / 180 if results["unit"] == "degrees" else 1.0
    names = {"reaction", "volume", "mid_hoop_displacement", "contact_force", "time", "residual"}
    ledger = Ledger.__dataclass_fields__
    return [
        Point(
            parameter=factor * p["parameter"],
            gap=None,
            ledger=Ledger(**{name: p["ledger"][name] for name in ledger}),
            **{name: p[name] for name in names},
        )
        for p in results["history"]
    ]
