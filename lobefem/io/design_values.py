"""Kinds of values in design files, as validators: what is possible, and how messages say what is not."""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Iterable
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from lobefem.typing import Unchecked
from lobefem.units import ANGLE, FORCE, LENGTH, MASS, NUMBER, PRESSURE, Quantity, shown

__all__ = [
    "angle",
    "bar_stiffness",
    "cells",
    "file_name",
    "fill",
    "flag",
    "group_name",
    "integer",
    "listed",
    "nearest",
    "number_row",
    "pair",
    "positive",
    "pressure_row",
    "quantity",
    "shortening",
    "text",
    "word",
]

_MOST_DIGITS = 9  # of integers; Python refuses to read and to write thousands of them


def _written(kind: Quantity, rule: str = "") -> Any:
    """The type of a quantity as a file writes it, for the JSON schema."""
    must = f" Must be {rule}." if rule else ""
    return Annotated[float | str, Field(description=f"{kind.advice[:1].upper()}{kind.advice[1:]}.{must}")]


def quantity(kind: Quantity, rule: str = "", holds: Callable[[float], bool] | None = None) -> BeforeValidator:
    """Read a quantity; `holds` says whether its SI value is possible, `rule` so in words."""

    def check(value: Unchecked) -> float:
        number = kind.read(value)
        if holds is not None and not holds(number):
            raise ValueError(f"{shown(value)} must be {rule}; {kind.advice}")
        return number

    return BeforeValidator(check, json_schema_input_type=_written(kind, rule))


def positive(kind: Quantity) -> BeforeValidator:
    """Read a positive quantity."""
    # the bounds keep squares and products of sound numbers away from overflow
    return quantity(kind, "positive (1e-15 to 1e15 in SI)", lambda v: 1e-15 <= v <= 1e15)


def word(*words: str) -> BeforeValidator:
    """Read one of the words."""

    def check(value: Unchecked) -> str:
        if not isinstance(value, str) or value not in words:
            raise ValueError(f"{shown(value)} is unknown; use {listed(words)}{nearest(value, words)}")
        return value

    return BeforeValidator(check, json_schema_input_type=Literal[words])


def text(value: Unchecked) -> str:
    """Read words of any kind."""
    if not isinstance(value, str) or not value:
        raise ValueError(f"{shown(value)} is no text; write words in quotes")
    return value


def group_name(value: Unchecked) -> str:
    """Read the name of a group of the mesh."""
    if not isinstance(value, str) or not value:
        raise ValueError(f'{shown(value)} is no name; give that of an edge group of the mesh, e.g. "rim"')
    return value


def file_name(value: Unchecked) -> str:
    """Read the name of a mesh file."""
    if not isinstance(value, str) or not value.strip() or "\0" in value:
        raise ValueError(f'{shown(value)} is no file; give that of a mesh from Gmsh, e.g. "beam.msh"')
    return value


def flag(value: Unchecked) -> bool:
    """Read true or false."""
    if not isinstance(value, bool):
        raise ValueError(f"{shown(value)} is neither true nor false; write one of the two without quotes")
    return value


def integer(least: int, most: int | None = None) -> BeforeValidator:
    """Read an integer from `least` to `most`."""
    span = f"{least} or {most}" if most else f"an integer, {least} or more"

    def check(value: Unchecked) -> int:
        text = isinstance(value, str) and value.strip().isdecimal() and len(value) <= _MOST_DIGITS
        number = int(value) if text else value
        whole = isinstance(number, int) and not isinstance(number, bool)
        if not whole or not least <= number <= (most or 10**_MOST_DIGITS):
            raise ValueError(f"{shown(value)} is impossible; give {span}")
        return number

    return BeforeValidator(check, json_schema_input_type=Annotated[int, Field(ge=least, le=most)])


def _cell_divisions(value: Unchecked) -> tuple[int, int]:
    """Read numbers of cells along and around."""
    pair: Any = value
    if isinstance(value, str):
        ends = value.lower().split("x")
        pair = [int(n) if n.strip().isdecimal() and len(n) <= _MOST_DIGITS else n for n in ends]
    whole = isinstance(pair, (list, tuple)) and all(
        type(n) is int and 0 < n <= 10**_MOST_DIGITS for n in pair
    )
    if not whole or len(pair) != 2:
        raise ValueError(
            f"{shown(value)} is no mesh division; give cells along a lobe's meridian and around the "
            'axis, e.g. [24, 32] or "24x32"'
        )
    return pair[0], pair[1]


cells = BeforeValidator(_cell_divisions, json_schema_input_type=tuple[int, int] | str)


def _bar(value: Unchecked) -> bool | float:
    """Read whether there is a rigid bar, or the stiffness of an elastic one [N]."""
    if isinstance(value, bool):
        return value
    if isinstance(value, str) and value in ("rigid", "none"):
        return value == "rigid"
    try:
        number = FORCE.read(value)
    except ValueError:
        number = 0.0
    if number <= 0:
        raise ValueError(
            f'{shown(value)} is no bar; give true (rigid), false (none) or its EA in newtons, e.g. "2.15 GN"'
        )
    return number


bar_stiffness = BeforeValidator(_bar, json_schema_input_type=bool | float | str)


def _pressures(value: Unchecked) -> tuple[float, ...]:
    """Read one pressure or several [Pa]."""
    values = value if isinstance(value, (list, tuple)) else [value]
    if not values:
        raise ValueError(f"[] holds no pressure; {PRESSURE.advice}")
    numbers = tuple(PRESSURE.read(v) for v in values)
    for given, number in zip(values, numbers, strict=True):
        if number < 0:
            raise ValueError(f"{shown(given)} is below 0, and a film carries no suction; {PRESSURE.advice}")
    return numbers


_one_pressure: Any = _written(PRESSURE)

pressure_row = BeforeValidator(_pressures, json_schema_input_type=_one_pressure | list[_one_pressure])


def listed(words: tuple[str, ...]) -> str:
    """Words as a choice: a, b or c."""
    return " or ".join([", ".join(words[:-1]), words[-1]] if words[1:] else words)


def nearest(word: Any, words: Iterable[str]) -> str:
    """A parenthesis that names the word that was probably meant, or nothing."""
    close = difflib.get_close_matches(str(word), list(words), n=1, cutoff=0.6)
    return f" (did you mean {close[0]}?)" if close else ""


def _half_angle(value: Unchecked) -> float:
    number = ANGLE.read(value)
    if not 0 <= number <= math.pi / 2 * (1 + 1e-12):
        raise ValueError(
            f"{shown(value)} is {math.degrees(number):.4g} degrees; give 0 to 90, half of the bulge angle, "
            'e.g. "60 deg"'
        )
    return min(number, math.pi / 2)


angle = BeforeValidator(_half_angle, json_schema_input_type=_written(ANGLE))  # a lobe's half angle [rad]


def pair(kind: Quantity) -> BeforeValidator:
    """Read two quantities above zero, of the bottom and the top, or one for both; masses may be zero."""

    def check(value: Unchecked) -> tuple[float, float]:
        both = value if isinstance(value, (list, tuple)) else (value, value)
        if len(both) != 2:
            raise ValueError(f"{shown(value)} is not one number or two, [bottom, top]; {kind.advice}")
        bottom, top = (kind.read(one) for one in both)
        low, high = min(bottom, top), max(bottom, top)
        if low < 0 or high > 1e15 or (kind is not MASS and low < 1e-15):
            raise ValueError(
                f"{shown(value)} must be {'0 or more' if kind is MASS else 'positive'}; {kind.advice}"
            )
        return bottom, top

    one: Any = _written(kind)
    return BeforeValidator(check, json_schema_input_type=one | tuple[one, one])


def _number_row(value: Unchecked) -> tuple[float, ...]:
    if not isinstance(value, (list, tuple)) or len(value) < 2:
        raise ValueError(f"{shown(value)} is no row of numbers; give two at least, [0, 1]")
    return tuple(LENGTH.read(one) for one in value)


number_row = BeforeValidator(_number_row, json_schema_input_type=list[float | str])


def fill(section: Any, key: str, value: Unchecked) -> None:
    """Set a default that depends on other keys; it does not count as given."""
    object.__setattr__(section, key, value)  # sections are frozen for all others


def _shortening(value: Unchecked) -> float | tuple[tuple[float, float], ...]:
    """Read a tendon's foreshortening: one share, or rows of a station and a share."""
    if isinstance(value, str) and value.lower().endswith(".csv"):
        raise ValueError(f"{shown(value)} is read with design files; give rows, as [[0, 0], [1, 0.02]]")
    if not isinstance(value, (list, tuple)):
        rows: list[Any] = [(0.0, value)]
    else:
        rows = list(value)
    if not all(isinstance(row, (list, tuple)) and len(row) == 2 for row in rows) or not rows:
        raise ValueError(
            f"{shown(value)} is no table; give rows of a station and a share, as [[0, 0], [1, 0.02]]"
        )
    found = tuple((NUMBER.read(s), NUMBER.read(share)) for s, share in rows)
    for _, share in found:
        if not -0.5 < share < 0.5:
            raise ValueError(f"{share:g} must be in (-0.5, 0.5); {NUMBER.advice}")
    if not isinstance(value, (list, tuple)):
        return found[0][1]
    stations = [s for s, _ in found]
    if len(found) < 2 or (stations[0], stations[-1]) != (0.0, 1.0) or sorted(set(stations)) != stations:
        raise ValueError(f"{shown(stations)} are no stations; let them ascend from 0 to 1")
    return found


# of a pumpkin's tendons, everywhere or by station
shortening = BeforeValidator(_shortening, json_schema_input_type=float | str | list[tuple[float, float]])
