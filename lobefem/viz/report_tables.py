"""Tables of a report: what results and designs say, in words and with units."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from lobefem.io import result_keys
from lobefem.io.run_reader import Run
from lobefem.typing import Unchecked
from lobefem.units import handy, scaled
from lobefem.viz.sensitivity_table import sensitivity_table
from lobefem.viz.style import UNITS

__all__ = [
    "Table",
    "column",
    "convergence",
    "entries",
    "modes",
    "number",
    "numbers",
    "pairs",
    "pressures",
    "rows_of",
    "sensitivities",
    "stored_modes",
    "sweep",
    "trends",
    "warnings",
    "waves",
]


@dataclass(frozen=True)
class Table:
    """A caption, the heads of the columns, and rows whose first cell is their head.

    Attributes:
        caption: above it.
        head: of the columns.
        rows: the cells as they are read.
        hints: of rows by number, what their first cell means.
    """

    caption: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    hints: Mapping[int, str] = field(default_factory=dict)

    @property
    def numeric(self) -> tuple[bool, ...]:
        """True for columns of numbers, which stand to the right."""
        columns = zip(*self.rows, strict=True) if self.rows else ((),) * len(self.head)
        return tuple(
            any(map(_is_number, column)) and all(_is_number(c) or c in ("", "none") for c in column)
            for column in columns
        )


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace("\N{MINUS SIGN}", "-"))
    except ValueError:
        return False
    return True


# results that say how well the others are known
_CONVERGENCE = ("converged", "iterations", "residual", "relative_residual", "steps", "num_dofs")

# what the header, another table or a chart says
_ELSEWHERE = {
    "schema", "command", "title", "version", "versions", "warnings", "profile", "film", "load", "support",
    "bar", "hoops", "lobes", "divisions", "unit", "reaction_unit", "pressures", "verdict", "visited", "rows",
    "lowest", "low_harmonics", "shown", "stations", "tendon_tension", "bulge_half_angle", "bulge_radius",
    "meridional_resultant", "hoop_resultant", "meridional_strain", "hoop_strain",
}  # fmt: skip

_MESHES = {
    "falls": "This critical pressure depends on the mesh: it falls as the mesh is refined, without a limit",
    "open": "The meshes of this study do not show whether the critical pressure depends on the mesh",
}


def number(value: Unchecked) -> str:
    """A value of the results as text."""
    if value is None:
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}".replace("-", "\N{MINUS SIGN}") if math.isfinite(value) else "none"
    if isinstance(value, (list, tuple)):
        return ", ".join(number(v) for v in value)
    return str(value)


def warnings(run: Run) -> list[str]:
    """Warnings to read before the numbers: failures first."""
    found = [f"The run failed: {run.results['error']}"] if run.results.get("error") else []
    found += run.faults
    told = run.results.get("warnings")  # sentences without a capital: errors begin so on the command line
    behaviour = str(dict(_pairs(run.results.get("lowest"))).get("behaviour"))
    found += [_MESHES[behaviour]] if behaviour in _MESHES else []
    found += [text[:1].upper() + text[1:] for text in map(str, told if isinstance(told, list) else ())]
    return [text.rstrip(".") + "." for text in found]


def numbers(run: Run) -> Table:
    """All single numbers of the results, with their units and meanings from `lobefem.io.result_keys`."""
    found = dict(_singles(run.results))
    keys = ["error", "outcome", "reason", *(key for keys in result_keys.COMMANDS.values() for key in keys)]
    ordered = dict.fromkeys([*(key for key in keys if key in found), *found])
    return _told(run.results, "Numbers of this run", [key for key in ordered if key not in _CONVERGENCE])


def sensitivities(run: Run) -> Table | None:
    """The effect of each parameter of a pumpkin, those that count most for its stability first."""
    if not run.results.get("parameters"):
        return None
    return Table("What makes this balloon more stable", *sensitivity_table(run.results))


def _singles(results: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Plain values, or lists of them, that have no place of their own; one level down as "energy.strain"."""
    for key, value in results.items():
        if key in _ELSEWHERE:
            continue
        inner = {f"{key}.{name}": one for name, one in _pairs(value)} or {key: value}
        for path, one in inner.items():
            items = one if isinstance(one, list) else [one]
            if one not in (None, [], {}, "") and not any(isinstance(item, (dict, list)) for item in items):
                yield path, one


def _told(results: Mapping[str, Any], caption: str, keys: Sequence[str]) -> Table:
    found = dict(_singles(results))
    rows: list[tuple[str, ...]] = []
    hints: dict[int, str] = {}
    for key in keys:
        unit, meaning = _meaning(str(results.get("command")), key)
        unit = str(results.get(unit, "")) if unit in ("unit", "reaction_unit") else unit
        words = key.replace("_", " ").replace(".", ", ")
        hints[len(rows)] = meaning
        value = number(found[key])
        if isinstance(found[key], float) and math.isfinite(found[key]) and unit:
            value, _, unit = scaled(found[key], unit).replace("-", "\N{MINUS SIGN}").partition(" ")
        rows.append((words, value, unit.replace("^2", "²").replace("^3", "³")))
    return Table(caption, ("quantity", "value", "unit"), tuple(rows), hints)


def _meaning(command: str, key: str) -> tuple[str, str]:
    """Unit and meaning of a key of a command's results, or of the first command that has it."""
    for one in (command, *result_keys.COMMANDS):
        name = result_keys.described(one, key)
        if name is not None:
            return (result_keys.COMMON | result_keys.COMMANDS.get(one, {}))[name]
    return "", ""


def _pairs(value: Unchecked) -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict):
        yield from ((str(key), one) for key, one in value.items())


def convergence(run: Run) -> list[Table]:
    """Accuracy of the numbers: of Newton's method, of eigenpairs, of a fit over meshes."""
    results, tables = run.results, []
    found = dict(_singles(results))
    known = [key for key in _CONVERGENCE if key in found]
    if known:
        tables.append(_told(results, "How well the state is known", known))
    head = (
        "pressure [Pa]",
        "residual of the state / load",
        "asymmetry of the tangent",
        "largest residual of a mode",
    )
    rows = tuple(
        (
            number(entry.get("pressure")),
            number(entry.get("state_residual")),
            number(entry.get("asymmetry")),
            number(
                max(
                    (float(m["residual"]) for m in _dicts(entry.get("modes")) if m.get("residual")),
                    default=None,
                )
            ),
        )
        for entry in entries(run)
    )
    if rows:
        tables.append(Table("States and their modes", head, rows))
    chart = [r["residual"] for r in _dicts(results.get("chart")) if isinstance(r.get("residual"), float)]
    if chart:
        tables.append(
            Table(
                "How well the modes are known",
                ("quantity", "value"),
                (("largest residual of a critical mode", number(max(chart))),),
            )
        )
    return tables


def trends(run: Run) -> list[Table]:
    """Limits that a mesh study has fitted, and what there is without a mesh."""
    results, tables = run.results, []
    low = [(f"n = {n}", trend) for n, trend in _pairs(results.get("low_harmonics"))]
    named = [(name, dict(_pairs(one))) for name, one in [("lowest of all", results.get("lowest")), *low]]
    named = [(name, told) for name, told in named if told]
    if named:
        columns = dict(
            [
                ("critical pressure", [name for name, _ in named]),
                ("under refinement", [number(told.get("behaviour")) for _, told in named]),
                column("limit", "Pa", [told.get("limit") for _, told in named]),
                column("uncertainty", "Pa", [told.get("uncertainty") for _, told in named]),
                ("order", [number(told.get("order")) for _, told in named]),
            ]
        )
        tables.append(
            rows_of(list(columns), list(columns.values()), "The fit p = limit + C h^order over the meshes")
        )
    sides: tuple[tuple[str, ...], ...] = tuple(
        tuple(number(side.get(key)) for key in ("law", "lowest", "unstable_from"))
        for side in _dicts(results.get("continuum_of_one_lobe"))
    )
    if sides:
        heads = ("film of one lobe", "lowest critical pressure [Pa]", "unstable at any pressure from n =")
        tables.append(Table("Without a mesh", heads, sides))
    return tables


def pressures(run: Run) -> Table | None:
    """The verdict at each pressure of `lobefem modes`."""
    found = [entry for entry in entries(run) if "stable" in entry]
    columns = dict(
        [
            column("pressure", "Pa", [entry.get("pressure") for entry in found]),
            ("verdict", [_verdict(entry) for entry in found]),
            ("negative eigenvalues", [number(entry.get("num_negative")) for entry in found]),
            column("volume", "m³", [entry.get("volume") for entry in found]),
            column("largest film stress", "Pa", [entry.get("max_stress") for entry in found]),
            ("bounds of the lowest [Pa/m]", [number(entry.get("bounds")) for entry in found]),
        ]
    )
    told = {head: cells for head, cells in columns.items() if any(cell != "none" for cell in cells)}
    return rows_of(list(told), list(told.values()), "Stable or not") if told and found else None


def _verdict(entry: Mapping[str, Any]) -> str:
    return str(entry.get("verdict") or ("stable" if entry["stable"] else "unstable"))


def column(name: str, unit: str, values: Sequence[Any]) -> tuple[str, list[str]]:
    """A column of numbers in SI: its head with a unit of a handy size for all, and its cells."""
    sizes = [abs(v) for v in values if isinstance(v, (int, float)) and math.isfinite(v)]
    handier, factor = handy(max(sizes, default=1.0) or 1.0, unit)
    cells = [number(v / factor if factor != 1.0 and isinstance(v, (int, float)) else v) for v in values]
    return f"{name} [{handier}]", cells


def entries(run: Run) -> list[dict[str, Any]]:
    """The pressures at which there are modes: of `lobefem modes`, or of another study."""
    found = run.results.get("pressures")
    found = [e for e in found if isinstance(e, dict)] if isinstance(found, list) else []
    return found or [e for e in (run.results.get("shown"),) if isinstance(e, dict)]


def modes(run: Run) -> Table | None:
    """All eigenvalues that were computed, equal pairs in one row."""
    unit = UNITS.get(str(run.results.get("mass", "unit")), "Pa/m")
    rows = [
        (entry.get("pressure"), numbers_, mode)
        for entry in entries(run)
        for numbers_, mode in pairs(_dicts(entry.get("modes")))
    ]
    if not rows:
        return None
    complex_ = any(abs(m.get("imag") or 0.0) > 1e-6 * abs(m.get("real") or 0.0) for _, _, m in rows)
    head, cells = column("pressure", "Pa", [pressure for pressure, _, _ in rows])
    columns = {
        head: cells,
        "mode": [", ".join(map(str, numbers_)) for _, numbers_, _ in rows],
        "kind": [number(mode.get("kind")) for _, _, mode in rows],
        "waves around": [number(mode.get("harmonic")) for _, _, mode in rows],
        f"eigenvalue [{unit}]" if not complex_ else f"real part [{unit}]": [
            number(mode.get("real")) for _, _, mode in rows
        ],
    }
    if complex_:
        columns[f"imaginary part [{unit}]"] = [number(mode.get("imag") or 0.0) for _, _, mode in rows]
    columns["residual"] = [
        f"{m['residual']:.0e}" if isinstance(m.get("residual"), float) else "" for _, _, m in rows
    ]
    return rows_of(list(columns), list(columns.values()), "Eigenvalues: below zero the balloon is unstable")


def pairs(modes: Sequence[Mapping[str, Any]]) -> list[tuple[tuple[int, ...], Mapping[str, Any]]]:
    """Modes with their numbers from 1, of which equal ones that follow each other are one."""
    found: list[tuple[tuple[int, ...], Mapping[str, Any]]] = []
    for k, mode in enumerate(modes, 1):
        if found and _equal(found[-1][1], mode) and len(found[-1][0]) < 2:
            found[-1] = ((*found[-1][0], k), found[-1][1])
        else:
            found.append(((k,), mode))
    return found


def _equal(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    same = all(one.get(key) == other.get(key) for key in ("kind", "harmonic"))
    values = [mode.get("real") for mode in (one, other)]
    imaginary = [abs(mode.get("imag") or 0.0) for mode in (one, other)]
    if not same or not one.get("harmonic") or not all(isinstance(v, float) for v in (*values, *imaginary)):
        return False
    a, b = (complex(re, im) for re, im in zip(values, imaginary, strict=True))  # type: ignore[arg-type]
    return abs(a - b) <= 1e-5 * max(abs(a), abs(b))


def _dicts(value: Unchecked) -> list[dict[str, Any]]:
    return [v for v in value if isinstance(v, dict)] if isinstance(value, list) else []


def stored_modes(run: Run, step: int) -> Sequence[Mapping[str, Any]]:
    """Entries of the modes whose fields are stored with a step, in their order."""
    told: list[Mapping[str, Any]] = [*_dicts(run.results.get("stored_modes"))]
    known = entries(run)
    if not told and step < len(known) and "stable" in known[step]:
        told = [*_dicts(known[step].get("modes"))]
    if not told and run.results.get("kind"):
        told = [run.results]  # the one critical mode
    count = run.steps[step].num_modes
    return [*told, *({} for _ in range(count))][:count]


def sweep(run: Run) -> Table | None:
    """The points of `lobefem sweep`: what varied, what was found, where it is."""
    rows = _dicts(run.results.get("rows"))
    if not rows:
        return None
    values, found = ([dict(_pairs(row.get(key))) for row in rows] for key in ("values", "found"))
    columns = {name: [one.get(name, "") for one in values] for name in _names(values)}
    for name in _names(found):
        unit, _ = _meaning(str(run.results.get("of")), name)
        words, cells = name.replace("_", " "), [one.get(name) for one in found]
        head, told = column(words, unit, cells) if unit else (words, [number(cell) for cell in cells])
        columns[head] = told
    columns |= {key: [row.get(key) or "" for row in rows] for key in ("reason", "folder")}
    columns = {
        head: cells for head, cells in columns.items() if any(cell not in ("", "none") for cell in cells)
    }
    return rows_of(list(columns), list(columns.values()), "Points of the sweep")


def _names(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    return list(dict.fromkeys(name for row in rows for name in row))


def waves(harmonic: Unchecked) -> str:
    """A harmonic in words."""
    return {0: "no waves around", 1: "1 wave around"}.get(harmonic, f"{number(harmonic)} waves around")


def rows_of(head: Sequence[str], columns: Sequence[Sequence[Any]], caption: str) -> Table:
    """A table of columns of values."""
    return Table(
        caption, tuple(head), tuple(tuple(number(v) for v in row) for row in zip(*columns, strict=True))
    )
