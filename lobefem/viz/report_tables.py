"""Tables of a report: what results and designs say, in words and with units."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from lobefem.io import result_keys
from lobefem.io.run_reader import Run
from lobefem.typing import Unchecked
from lobefem.units import scaled
from lobefem.viz.sensitivity_table import sensitivity_table
from lobefem.viz.style import UNITS

__all__ = [
    "Table",
    "convergence",
    "design",
    "modes",
    "number",
    "numbers",
    "pressures",
    "rows_of",
    "stored_modes",
    "sweep",
    "trends",
    "versions",
    "warnings",
]


@dataclass(frozen=True)
class Table:
    """A caption, the heads of the columns, and rows whose first cell is their head."""

    caption: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


# results that say how well the others are known
_CONVERGENCE = ("converged", "iterations", "residual", "relative_residual", "steps", "num_dofs")

# what the header, another table or a chart says
_ELSEWHERE = {
    "schema", "command", "title", "version", "versions", "warnings", "profile", "film", "load", "support",
    "bar", "hoops", "lobes", "divisions", "unit", "reaction_unit", "pressures", "verdict", "visited", "rows",
    "lowest", "low_harmonics", "shown",
}  # fmt: skip

_MESHES = {
    "falls": "This critical pressure depends on the mesh: it falls as the mesh is refined, without a limit",
    "open": "The meshes of this study do not show whether the critical pressure depends on the mesh",
}

# units of a design's keys where they have one
_DESIGN_UNITS = {
    "edge_radius": "m", "R0": "m", "radius": "m", "length": "m", "forming_pressure": "Pa",
    "forming_stiffness": "N/m", "size": "m", "E": "Pa", "strength": "Pa", "thickness": "m", "EA": "N",
    "area": "m²",    "lift": "m", "value": "Pa",
}  # fmt: skip


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
    rows = []
    for key in keys:
        unit, meaning = _meaning(str(results.get("command")), key)
        unit = str(results.get(unit, "")) if unit in ("unit", "reaction_unit") else unit
        words = key.replace("_", " ").replace(".", ", ")
        value = number(found[key])
        if isinstance(found[key], float) and math.isfinite(found[key]) and unit:
            value, _, unit = scaled(found[key], unit).replace("-", "\N{MINUS SIGN}").partition(" ")
        rows.append((words, value, unit.replace("^2", "²").replace("^3", "³"), meaning))
    return Table(caption, ("quantity", "value", "unit", "meaning"), tuple(rows))


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
    entries = tuple(
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
        for entry in _entries(run)
    )
    if entries:
        tables.append(Table("States and their modes", head, entries))
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
    rows: list[tuple[str, ...]] = []
    low = [(f"n = {n}", trend) for n, trend in _pairs(results.get("low_harmonics"))]
    for name, trend in [("lowest of all harmonics", results.get("lowest")), *low]:
        told = dict(_pairs(trend))
        if told:
            words = (told.get(key) for key in ("behaviour", "limit", "uncertainty", "order"))
            rows.append((name, *map(number, words)))
    if rows:
        head = ("critical pressure", "behaviour", "limit [Pa]", "uncertainty [Pa]", "order")
        tables.append(Table("What p = limit + C h^order says of the meshes", head, tuple(rows)))
    sides: tuple[tuple[str, ...], ...] = tuple(
        tuple(number(side.get(key)) for key in ("law", "lowest", "unstable_from"))
        for side in _dicts(results.get("continuum_of_one_lobe"))
    )
    if sides:
        columns = ("film of one lobe", "lowest critical pressure [Pa]", "unstable at any pressure from n =")
        tables.append(Table("Without a mesh", columns, sides))
    return tables


def pressures(run: Run) -> Table | None:
    """The verdict at each pressure of `lobefem modes`."""
    entries = [entry for entry in _entries(run) if "stable" in entry]
    columns = {
        "pressure [Pa]": [number(entry.get("pressure")) for entry in entries],
        "verdict": [
            str(entry.get("verdict") or ("stable" if entry["stable"] else "unstable")) for entry in entries
        ],
        "negative eigenvalues": [number(entry.get("num_negative")) for entry in entries],
        "volume [m³]": [number(entry.get("volume")) for entry in entries],
        "largest film stress [MPa]": [
            number(1e-6 * stress if isinstance(stress := entry.get("max_stress"), float) else None)
            for entry in entries
        ],
        "bounds of the lowest [Pa/m]": [number(entry.get("bounds")) for entry in entries],
    }
    told = {head: column for head, column in columns.items() if any(cell != "none" for cell in column)}
    return rows_of(list(told), list(told.values()), "Stable or not") if told else None


def _entries(run: Run) -> list[dict[str, Any]]:
    """The pressures at which there are modes: of `lobefem modes`, or of another study."""
    entries = run.results.get("pressures")
    entries = [e for e in entries if isinstance(e, dict)] if isinstance(entries, list) else []
    return entries or [e for e in (run.results.get("shown"),) if isinstance(e, dict)]


def modes(run: Run) -> Table | None:
    """All eigenvalues that were computed."""
    unit = UNITS.get(str(run.results.get("mass", "unit")), "Pa/m")
    rows = tuple(
        (
            number(entry.get("pressure")),
            str(k),
            number(mode.get("real")),
            number(mode.get("imag") or 0.0),
            number(mode.get("harmonic")),
            number(mode.get("kind")),
            f"{mode['residual']:.0e}" if isinstance(mode.get("residual"), float) else "",
        )
        for entry in _entries(run)
        for k, mode in enumerate(_dicts(entry.get("modes")), 1)
    )
    head = ("pressure [Pa]", "mode", f"real [{unit}]", f"imaginary [{unit}]", "n", "kind", "residual")
    return Table("Eigenvalues: a negative real part means unstable", head, rows) if rows else None


def _dicts(value: Unchecked) -> list[dict[str, Any]]:
    return [v for v in value if isinstance(v, dict)] if isinstance(value, list) else []


def stored_modes(run: Run, step: int) -> Sequence[Mapping[str, Any]]:
    """Entries of the modes whose fields are stored with a step, in their order."""
    told: list[Mapping[str, Any]] = [*_dicts(run.results.get("stored_modes"))]
    entries = _entries(run)
    if not told and step < len(entries) and "stable" in entries[step]:
        told = [*_dicts(entries[step].get("modes"))]
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
    columns |= {name: [one.get(name, "") for one in found] for name in _names(found)}
    columns |= {key: [row.get(key, "") for row in rows] for key in ("reason", "folder")}
    return rows_of(list(columns), list(columns.values()), "Points of the sweep, in SI units")


def _names(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    return list(dict.fromkeys(name for row in rows for name in row))


def design(run: Run) -> Table:
    """The design, all defaults filled in."""
    rows = []
    for section, keys in run.design.items():
        for key, value in _pairs(keys):
            unit = _DESIGN_UNITS.get(key, "")
            if key == "bar":
                unit = "" if isinstance(value, bool) else "N"
            rows.append((f"{section}.{key}", number(value), unit))
    return Table("Design, all defaults filled in", ("key", "value", "unit"), tuple(rows))


def versions(run: Run) -> Table:
    """With what it was made."""
    told = [(name, number(value)) for name, value in _pairs(run.results.get("versions"))]
    return Table("Versions of what has a part in the digits", ("part", "version"), tuple(told))


def rows_of(head: Sequence[str], columns: Sequence[Sequence[Any]], caption: str) -> Table:
    """A table of columns of values."""
    return Table(
        caption, tuple(head), tuple(tuple(number(v) for v in row) for row in zip(*columns, strict=True))
    )
