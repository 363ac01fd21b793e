"""Tables of a run for spreadsheets: eigenvalues, the history of a perturbation, stations by height."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from lobefem.io.run_reader import Run, Step
from lobefem.typing import Array, Integers, Unchecked

__all__ = ["NAMES", "records", "tables"]

NAMES = ("eigenvalues.csv", "history.csv", "stations.csv")

_BANDS = 60  # of a film without rows of cells


def tables(run: Run) -> dict[str, str]:
    """CSV texts by file name, of what the run has: heads with units, SI, one record a line."""
    return {name: _text(rows) for name, rows in records(run).items()}


def records(run: Run) -> dict[str, list[Sequence[Any]]]:
    """The same tables as rows, the head first."""
    makers = dict(zip(NAMES, (_eigenvalues, _history, _stations), strict=True))
    made = {name: list(make(run)) for name, make in makers.items()}
    return {name: rows for name, rows in made.items() if len(rows) > 1}


def _text(rows: Sequence[Sequence[Any]]) -> str:
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows(rows)
    return stream.getvalue()


def _dicts(value: Unchecked) -> list[Mapping[str, Any]]:
    return [one for one in value if isinstance(one, Mapping)] if isinstance(value, list) else []


def _eigenvalues(run: Run) -> Iterator[Sequence[Any]]:
    """Of each pressure all modes; along a path of inflated states the lowest one."""
    unit = "N/m" if run.results.get("mass") == "nodal" else "Pa/m"
    keys = ("harmonic", "kind", "residual")
    yield ("pressure [Pa]", "mode", f"real [{unit}]", f"imaginary [{unit}]", *keys)
    for entry in _dicts(run.results.get("pressures")):
        for number, mode in enumerate(_dicts(entry.get("modes")), 1):
            yield (entry.get("pressure"), number, *(mode.get(key) for key in ("real", "imag", *keys)))
    visited = run.results.get("visited")
    pairs = [p for p in visited if isinstance(p, list) and len(p) == 2] if isinstance(visited, list) else []
    for pressure, lowest in sorted(pairs):
        yield (pressure, 1, lowest, "", "", "", "")


def _history(run: Run) -> Iterator[Sequence[Any]]:
    """Every accepted step of ramp and release."""
    records = _dicts(run.results.get("history"))
    flat = [
        {**{k: v for k, v in one.items() if not isinstance(v, Mapping)}, **_energies(one.get("ledger"))}
        for one in records
    ]
    units = {
        "parameter": run.results.get("unit"), "reaction": run.results.get("reaction_unit"), "volume": "m^3",
        "mid_hoop_displacement": "m", "contact_force": "N", "time": "s", "residual": "",
    }  # fmt: skip
    names = list(dict.fromkeys(name for one in flat for name in one))
    units |= {name: "J" for name in names if name.startswith("energy_")}
    yield [f"{name} [{units[name]}]" if units.get(name) else name for name in names]
    for one in flat:
        yield ["" if one.get(name) is None else one[name] for name in names]


def _energies(ledger: Any) -> dict[str, Any]:
    return {f"energy_{name}": value for name, value in ledger.items()} if isinstance(ledger, Mapping) else {}


def _stations(run: Run) -> Iterator[Sequence[Any]]:
    """Shape and stress of each row of cells, from the bottom, at each step; means by area."""
    yield (
        "step", "pressure [Pa]", "height [m]", "radius [m]", "deformed height [m]", "deformed radius [m]",
        "N_m [N/m]", "N_h [N/m]", "N_mh [N/m]", "largest N_m [N/m]", "taut", "wrinkled", "slack",
    )  # fmt: skip
    if not len(run.corners):
        return
    rows, areas = _rows(run), _areas(run)
    for number, step in enumerate(run.steps, 1):
        fields = _fields(run, step)
        largest = fields[:, 4]
        for k in range(rows.max() + 1):
            own = rows == k
            if not own.any():
                continue
            means = np.average(fields[own], axis=0, weights=areas[own]).tolist()
            yield (number, step.pressure, *means[:7], float(largest[own].max()), *means[7:])


def _rows(run: Run) -> Integers:
    """The row of each cell from the bottom: between the rings of a structured mesh, or even bands."""
    heights = run.x[run.corners][:, :, 2]
    mesh = run.design.get("mesh", {})
    rings = np.unique(np.round(heights, 9))
    if isinstance(mesh, Mapping) and mesh.get("layout") == "unstructured":
        rings = np.linspace(heights.min(), heights.max(), _BANDS + 1)
    return np.clip(np.searchsorted(rings, heights.mean(axis=1)) - 1, 0, max(len(rings) - 2, 0))


def _areas(run: Run) -> Array:
    a, b, c = (run.x[run.triangles[:, k]] for k in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    return np.asarray(np.bincount(run.owners, weights=areas, minlength=len(run.corners)), dtype=float)


def _fields(run: Run, step: Step) -> Array:
    """Of each cell: height and radius as meshed and deformed, resultants, shares of its state."""
    moved = run.x + step.nodal.get("displacement", 0.0)
    shape = [
        values.mean(axis=1)
        for x in (run.x[run.corners], moved[run.corners])
        for values in (x[:, :, 2], np.hypot(x[:, :, 0], x[:, :, 1]))
    ]
    nothing = np.full((len(run.corners), 3), np.nan)
    cellwise = [step.cells.get(name, nothing) for name in ("stress_resultants", "regions")]
    return np.column_stack([*shape, *cellwise])
