"""What a user looks up: units and materials, as rows of a table whose first is its head."""

from __future__ import annotations

from lobefem.errors import InputError
from lobefem.io.materials import MATERIALS
from lobefem.units import KINDS, scaled

__all__ = ["materials", "units"]

Rows = list[tuple[str, ...]]


def units(quantity: str = "") -> Rows:
    """Units of each kind of quantity whose name holds a word.

    Raises:
        InputError: none does.
    """
    chosen = {name: kind for name, kind in KINDS.items() if quantity.lower() in name.lower()}
    if not chosen:
        raise InputError(f"{quantity!r} is no quantity with units; use {', '.join(KINDS)}")
    rows = [(name, kind.si, kind.example, ", ".join(kind.factors)) for name, kind in chosen.items()]
    return [("quantity", "without a unit", "example", "units"), *rows]


def materials(name: str = "") -> Rows:
    """Materials whose name holds a word, with their numbers and sources.

    Raises:
        InputError: none does.
    """
    chosen = {known: one for known, one in MATERIALS.items() if name.lower() in known}
    if not chosen:
        raise InputError(f"{name!r} is no material here; use {', '.join(MATERIALS)}")
    rows = [
        (
            known,
            scaled(one.E, "Pa"),
            "" if one.nu is None else f"{one.nu:g}",
            f"{one.density:g} kg/m^3",
            scaled(one.strength, "Pa"),
            f"{one.title}: {one.source}",
        )
        for known, one in chosen.items()
    ]
    return [("material", "E", "nu", "density", "strength", "source"), *rows]
