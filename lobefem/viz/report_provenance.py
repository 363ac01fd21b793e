"""The end of a report: the design, first what is not a default, and with what the run was made."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from lobefem.errors import LobefemError
from lobefem.io.design import Design
from lobefem.io.run_reader import Run
from lobefem.typing import Unchecked
from lobefem.units import scaled
from lobefem.viz.report_tables import Table, number

__all__ = ["changes", "design", "flat", "setting", "versions"]

# units of a design's keys where they have one
_UNITS = {
    "edge_radius": "m", "R0": "m", "radius": "m", "length": "m", "forming_pressure": "Pa",
    "forming_stiffness": "N/m", "size": "m", "E": "Pa", "E1": "Pa", "E2": "Pa", "G12": "Pa", "strength": "Pa",
    "thickness": "m", "EA": "N", "area": "m²", "lift": "m", "value": "Pa", "equator_radius": "m",
    "tendon_length": "m", "volume": "m³", "fitting_radius": "m", "half_angle": "rad", "density": "kg/m³",
    "mass_per_length": "kg/m", "mass": "kg", "payload": "kg", "gradient": "Pa/m", "level": "m",
}  # fmt: skip

# what the kinds of shapes need, so that there is no default
_NEEDED = (
    "kind", "file", "gores", "fitting_radius", "half_angle", "equator_radius", "tendon_length", "volume",
    "lobe", "stations", "half_widths", "curve",
)  # fmt: skip


def design(run: Run) -> Table:
    """The design, all defaults filled in."""
    return _table("Design, all defaults filled in", dict(flat(run.design)))


def changes(run: Run) -> Table | None:
    """Values of the design that are not defaults; None if the defaults of such a shape are not known."""
    shape = run.design.get("shape")
    if not isinstance(shape, Mapping):
        return None
    needed = {key: shape[key] for key in _NEEDED if shape.get(key) is not None}
    try:
        defaults = Design.parse({"shape": needed}).model_dump(mode="json")
    except (LobefemError, ValueError, TypeError):
        return None
    known, given = dict(flat(defaults)), dict(flat(run.design))
    changed = {
        key: value
        for key, value in given.items()
        if key.removeprefix("shape.") in needed or not _same(known.get(key), value)
    }
    count = f"{len(changed)} of {len(given)} settings" if changed else "All settings have their defaults"
    return _table(f"What differs from the defaults: {count}" if changed else count, changed)


def flat(tables: Mapping[str, Any]) -> list[tuple[str, Any]]:
    """Keys of a design as "section.key" with their values; what is not given is left out."""
    found = []
    for section, keys in tables.items():
        pairs = keys.items() if isinstance(keys, Mapping) else [("", keys)]
        found += [(f"{section}.{key}".rstrip("."), value) for key, value in pairs if value is not None]
    return [(key, value) for key, value in found if value != []]


def _same(one: Any, other: Any) -> bool:
    if isinstance(one, (list, tuple)) and isinstance(other, (list, tuple)):
        return len(one) == len(other) and all(map(_same, one, other))
    if isinstance(one, float) or isinstance(other, float):
        numbers = all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in (one, other))
        return numbers and math.isclose(one, other, rel_tol=1e-12)
    return bool(one == other)


def _table(caption: str, values: Mapping[str, Any]) -> Table:
    rows = tuple((path, setting(path, value)) for path, value in values.items())
    return Table(caption, ("key", "value"), rows)


def setting(path: str, value: Unchecked) -> str:
    """A value of a design as text, with the unit of its key, "section.key"."""
    unit = _UNITS.get(path.rpartition(".")[2], "N" if path.endswith(".bar") else "")
    items = value if isinstance(value, (list, tuple)) else [value]
    if unit and items and all(isinstance(v, float) and math.isfinite(v) for v in items):
        if unit == "rad":  # as designs have it
            return ", ".join(f"{number(math.degrees(v))} deg" for v in items)
        return ", ".join(scaled(v, unit) for v in items).replace("-", "\N{MINUS SIGN}")
    return number(value)


def versions(run: Run) -> Table:
    """With what it was made."""
    told = run.results.get("versions")
    pairs = told.items() if isinstance(told, Mapping) else ()
    return Table(
        "Versions of what has a part in the digits",
        ("part", "version"),
        tuple((str(name), number(value)) for name, value in pairs),
    )
