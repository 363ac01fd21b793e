"""`lobefem check`: a design in full, what of it is a default, what it does to the answer, and its size."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from lobefem.app import advice
from lobefem.io.design import Design
from lobefem.viz.report_provenance import flat, setting

__all__ = ["check", "unknowns"]

Rows = list[tuple[str, str, str, str]]


def check(design: Design) -> tuple[Rows, list[str]]:
    """A row for each key (key, value, where from, what to know of it), and sentences on the whole.

    Args:
        design: what a command would compute.
    """
    left_out = set() if design.is_pumpkin else {"tendons", "fittings", "cleft"}
    tables = design.model_dump(mode="json", exclude=left_out)
    notes = dict(_notes(design))
    rows = []
    for key, value in flat(tables):
        section, _, name = key.partition(".")
        if key == "hoops.EA" and not design.hoops.enabled:
            continue
        table = getattr(design, section)
        fields = getattr(table, "model_fields_set", ())
        stated = section in design.model_fields_set and (name in fields or not name)
        origin = "given" if stated else _source(table, name)
        rows.append((key, setting(key, value), origin, notes.pop(key, "")))
    rows += [(key, "none", "default", note) for key, note in notes.items()]
    order = list(tables)
    rows.sort(key=lambda row: order.index(row[0].partition(".")[0]))
    given = sum(row[2] == "given" for row in rows)
    default = sum(row[2] == "default" for row in rows)
    follow = len(rows) - given - default
    rest = f", {follow} follow{'s' if follow == 1 else ''} from them" if follow else ""
    said = [f"{given} settings are given{rest}, {default} have their defaults.", _size(design)]
    return rows, [*said, *(f"{text[:1].upper()}{text[1:]}." for text in advice.of_design(design))]


def _source(table: Any, name: str) -> str:
    """Source of a value that was not given: its default, a material, or E and area."""
    if (
        name in ("E", "nu", "strength")
        and getattr(table, "material", None)
        and getattr(table, name) is not None
    ):
        return "material"
    if name == "EA" and getattr(table, "area", None) is not None:
        return "E, area"
    return "default"


def _notes(design: Design) -> Iterator[tuple[str, str]]:
    """Notes on keys that change the answer much, by key."""
    if design.film.law == "fixed-wrinkles":
        yield "film.law", "the paper's film: its critical pressure goes to zero as the mesh is refined"
    if design.film.strength is None:
        yield "film.strength", "nothing is compared with the film's stress"
    if design.is_pumpkin:
        return
    if design.shape.lobes > 1 and not design.hoops.enabled:
        why = "enabled = false" if "hoops" in design.model_fields_set else "the file has no table of hoops"
        yield "hoops.enabled", f"no hoops at the seams, for {why}"
    if not design.has_plates or design.plates.support == "fixed":
        return
    bar, load = design.plates.bar, design.pressure.load
    if bar is True and load == "closed":
        yield "plates.bar", "rigid: it decides much in a closed balloon; false if yours has none"
    elif bar is True:
        yield "plates.bar", "rigid: a bar of constant length along the axis"
    if load == "film":
        yield "pressure.load", "the gas does not press on the end plates; in a closed balloon it does"


def _size(design: Design) -> str:
    """A sentence on the number of unknowns."""
    count = unknowns(design)
    if count is None:
        return "The number of unknowns is known when the mesh is made."
    words = f"{count:,}".replace(",", " ")
    return f"The mesh has {words} unknowns; twice as many divisions both ways have four times as many."


def unknowns(design: Design) -> int | None:
    """Displacement components of all nodes of a structured stack; None of other meshes, and of pumpkins."""
    if design.mesh.divisions is None or design.is_pumpkin or design.shape.kind == "mesh":
        return None
    along, around = (design.mesh.order * n for n in design.mesh.divisions)
    return int(3 * (design.shape.lobes * along + 1) * around)
