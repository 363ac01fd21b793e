"""Numbers with units in design files and options: SI values, or text such as "0.05 mm".

A plain number is in SI. Text is a decimal number and a unit of the right kind; it is converted in
decimal arithmetic, so that "0.05 mm" is exactly the number 5e-5. Nothing is guessed: 5 kPa is no
length.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lobefem.typing import Unchecked


__all__ = [
    "ANGLE",
    "AREA",
    "DEGREES",
    "DENSITY",
    "FORCE",
    "GRADIENT",
    "KINDS",
    "LENGTH",
    "LINE_DENSITY",
    "MASS",
    "NUMBER",
    "PRESSURE",
    "STIFFNESS",
    "STRESS",
    "VOLUME",
    "Quantity",
    "handy",
    "in_degrees",
    "pascals",
    "scaled",
    "shown",
]

_PREFIX = {"": "1", "k": "1e3", "M": "1e6", "G": "1e9"}

_LENGTHS = {
    "m": "1",
    "km": "1e3",
    "cm": "1e-2",
    "mm": "1e-3",
    "micron": "1e-6",
    "microns": "1e-6",
    "um": "1e-6",
    "µm": "1e-6",
    "μm": "1e-6",
    "mil": "2.54e-5",
    "in": "0.0254",
    "ft": "0.3048",
}

_POUND = "4.4482216152605"  # [N], by definition

_PSI = "6894.757293168361336722673445347"  # that over a square inch [Pa]

_PRESSURES = {f"{p}Pa": f for p, f in _PREFIX.items()} | {
    "hPa": "1e2",
    "mbar": "1e2",
    "bar": "1e5",
    "N/m^2": "1",
    "N/m2": "1",
    "N/mm^2": "1e6",
    "N/mm2": "1e6",
    "psi": _PSI,
    "ksi": f"{_PSI}e3",
    "Msi": f"{_PSI}e6",
}

_FORCES = {f"{p}N": f for p, f in _PREFIX.items()} | {"lbf": _POUND, "kgf": "9.80665"}

_STIFFNESSES = {f"{p}N/m": f for p, f in _PREFIX.items()} | {
    "N/mm": "1e3",
    "N/cm": "1e2",
    "lbf/in": "175.1268352464763779527559055118",
}

_AREAS = {
    "m^2": "1", "m2": "1", "cm^2": "1e-4", "cm2": "1e-4", "mm^2": "1e-6", "mm2": "1e-6", "in^2": "6.4516e-4",
    "in2": "6.4516e-4",
}  # fmt: skip

_DEGREES = {"deg": "1", "degrees": "1", "°": "1", "rad": "57.29577951308232087679815481411"}

# SI unit: from which size on another one is handier (0.9995: what is rounded to four digits), and its value
_HANDY = {
    "Pa": ((9.9995e8, "GPa", 1e9), (9.9995e5, "MPa", 1e6), (9999.5, "kPa", 1e3)),
    "N": ((9.9995e8, "GN", 1e9), (9.9995e5, "MN", 1e6), (9999.5, "kN", 1e3)),
    "m": ((9.9995e-2, "m", 1.0), (1e-6, "mm", 1e-3)),
}

_TEXT = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3})?)\s*([^\d\s.+-]\S*)?\s*")


def shown(value: Unchecked) -> str:
    """A value as a message quotes it: on one line, and not at any length."""
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # an integer of thousands of digits, tables in tables in tables
        return f"{type(value).__name__} of that size"
    return text if len(text) <= 80 else f"{text[:60]}...{text[-10:]}"


def pascals(pressure: float) -> str:
    """A pressure in words, to four digits: from 10 kPa on in kilopascals, and so on."""
    return scaled(pressure, "Pa")


def scaled(value: float, unit: str) -> str:
    """A number to four significant digits with a unit of a handy size: "290.6 kPa", "0.025 mm"."""
    name, factor = handy(value, unit)
    return f"{value / factor:.4g} {name}".strip()


def handy(value: float, unit: str) -> tuple[str, float]:
    """The unit of a handy size for a number in SI, and its value in SI."""
    size = abs(value)
    for least, name, factor in _HANDY.get(unit, ()):
        if least <= size < math.inf:
            return name, factor
    return unit, 1.0


def in_degrees(value: float, unit: str) -> tuple[float, str]:
    """An amount and its unit as users give it: angles are radians inside and degrees outside."""
    return (math.degrees(value), "degrees") if unit == "rad" else (value, unit)


@dataclass(frozen=True)
class Quantity:
    """A kind of quantity.

    Args:
        name: with its article, for messages ("a length").
        si: name of its SI unit in the plural ("metres"), "" for a pure number.
        example: how to write one, in both ways.
        factors: SI value of each unit, as decimal text.
    """

    name: str
    si: str
    example: str
    factors: Mapping[str, str]

    def read(self, value: Unchecked) -> float:
        """The SI value of a number or a text.

        Raises:
            ValueError: with the rest of a sentence that begins with the key's name.
        """
        if isinstance(value, bool) or not isinstance(value, (int, float, str)):
            raise ValueError(f"{shown(value)} is not {self.name}; {self.advice}")
        number = self._convert(value) if isinstance(value, str) else _to_float(value)
        if not math.isfinite(number):
            raise ValueError(f"{shown(value)} is not a finite number; {self.advice}")
        return number

    def _convert(self, text: str) -> float:
        match = _TEXT.fullmatch(text)
        if match is None:
            raise ValueError(f"{shown(text)} is not {self.name}; {self.advice}")
        number, unit = match[1], match[2] or ""
        if unit and unit not in self.factors:
            raise ValueError(f"{shown(text)} is not {self.name}; {self.advice}")
        try:
            return float(Decimal(number) * Decimal(self.factors[unit] if unit else "1"))
        except (InvalidOperation, OverflowError):
            return math.inf

    @property
    def advice(self) -> str:
        """The advice on the accepted forms."""
        return f"give {self.si}, e.g. {self.example}" if self.si else f"give a number, e.g. {self.example}"


def _to_float(value: float) -> float:
    try:
        return float(value)
    except OverflowError:  # an integer of hundreds of digits
        return math.inf


LENGTH = Quantity("a length", "metres", '5e-5 or "0.05 mm"', _LENGTHS)

PRESSURE = Quantity("a pressure", "pascals", '5.0 or "5 Pa"', _PRESSURES)

STRESS = Quantity("a stress", "pascals", '3.5e9 or "3.5 GPa"', _PRESSURES)

FORCE = Quantity("a force", "newtons", '2.15e9 or "2.15 GN"', _FORCES)

STIFFNESS = Quantity("a membrane stiffness", "newtons per metre", '188 or "188 N/m"', _STIFFNESSES)

AREA = Quantity("an area", "square metres", '4e-4 or "400 mm^2"', _AREAS)

DEGREES = Quantity("an angle", "degrees", '7.5 or "7.5 deg"', _DEGREES)  # of options; design files: ANGLE

NUMBER = Quantity("a pure number", "", "0.3", {})

_DEGREE = "0.017453292519943295769"

ANGLE = Quantity(
    "an angle",
    "radians",
    '0.7853981633974483 or "45 deg"',
    {"deg": _DEGREE, "degrees": _DEGREE, "°": _DEGREE, "rad": "1"},
)

MASS = Quantity("a mass", "kilograms", '91.4 or "91.4 kg"', {"kg": "1", "g": "1e-3", "t": "1e3"})

VOLUME = Quantity("a volume", "cubic metres", '530e3 or "530000 m^3"', {"m^3": "1", "m3": "1"})

DENSITY = Quantity(
    "a density",
    "kilograms per cubic metre",
    '920 or "920 kg/m^3"',
    {"kg/m^3": "1", "kg/m3": "1", "g/cm^3": "1e3"},
)

LINE_DENSITY = Quantity(
    "a mass per length", "kilograms per metre", '0.015 or "15 g/m"', {"kg/m": "1", "g/m": "1e-3"}
)

GRADIENT = Quantity(
    "a pressure gradient", "pascals per metre", '0.085 or "0.085 Pa/m"', {"Pa/m": "1", "N/m^3": "1"}
)

# what `lobefem units` lists
KINDS = {
    "length": LENGTH, "pressure, stress": PRESSURE, "force, EA": FORCE, "membrane stiffness": STIFFNESS,
    "area": AREA, "angle in a design file": ANGLE, "angle of an option": DEGREES, "mass": MASS,
    "volume": VOLUME, "density": DENSITY, "mass per length": LINE_DENSITY, "pressure gradient": GRADIENT,
}  # fmt: skip
