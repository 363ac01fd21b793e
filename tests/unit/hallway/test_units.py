"""Quantities: every unit is read as what it is, and what no quantity is is refused."""

import math

import pytest

from lobefem import units
from lobefem.units import (
    ANGLE,
    AREA,
    DEGREES,
    DENSITY,
    FORCE,
    GRADIENT,
    LENGTH,
    LINE_DENSITY,
    MASS,
    NUMBER,
    PRESSURE,
    STIFFNESS,
    STRESS,
    VOLUME,
    in_degrees,
    pascals,
    scaled,
)

# written out, not taken from the module: a wrong factor there must not be right here
LENGTHS = {"m": 1.0, "km": 1e3, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6}
LENGTHS |= {"micron": 1e-6, "microns": 1e-6, "mil": 2.54e-5, "in": 0.0254, "ft": 0.3048}
PRESSURES = {
    "Pa": 1.0, "hPa": 1e2, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "mbar": 1e2, "bar": 1e5,
    "N/m^2": 1.0, "N/m2": 1.0, "N/mm^2": 1e6, "N/mm2": 1e6,
    "psi": 6894.75729316836134, "ksi": 6894757.29316836134, "Msi": 6894757293.16836134,
}  # fmt: skip
FORCES = {"N": 1.0, "kN": 1e3, "MN": 1e6, "GN": 1e9, "lbf": 4.4482216152605, "kgf": 9.80665}
STIFFNESSES = {"N/m": 1.0, "kN/m": 1e3, "MN/m": 1e6, "GN/m": 1e9}
STIFFNESSES |= {"N/mm": 1e3, "N/cm": 1e2, "lbf/in": 175.126835246476378}
AREAS = {"m^2": 1.0, "m2": 1.0, "cm^2": 1e-4, "cm2": 1e-4, "mm^2": 1e-6, "mm2": 1e-6, "in^2": 6.4516e-4}
AREAS |= {"in2": 6.4516e-4}
ANGLES = {"deg": 1.0, "degrees": 1.0, "°": 1.0, "rad": 57.2957795130823209}
KINDS = (
    (LENGTH, LENGTHS), (PRESSURE, PRESSURES), (STRESS, PRESSURES), (FORCE, FORCES), (STIFFNESS, STIFFNESSES),
    (AREA, AREAS), (DEGREES, ANGLES), (NUMBER, {}),
    (ANGLE, {"rad": 1.0, "deg": math.pi / 180, "degrees": math.pi / 180, "°": math.pi / 180}),
    (MASS, {"kg": 1.0, "g": 1e-3, "t": 1e3}), (VOLUME, {"m^3": 1.0, "m3": 1.0}),
    (DENSITY, {"kg/m^3": 1.0, "kg/m3": 1.0, "g/cm^3": 1e3}), (LINE_DENSITY, {"kg/m": 1.0, "g/m": 1e-3}),
    (GRADIENT, {"Pa/m": 1.0, "N/m^3": 1.0}),
)  # fmt: skip


@pytest.mark.parametrize(
    ("kind", "unit", "factor"), [(kind, *pair) for kind, known in KINDS for pair in known.items()]
)
def test_every_unit_is_read_as_what_it_is(kind, unit, factor):
    for text in (f"2 {unit}", f"2.0{unit}", f" 20e-1  {unit} "):
        assert kind.read(text) == 2 * factor
    assert kind.read(f"-.5 {unit}") == -0.5 * factor


def test_no_unit_is_untested():
    kinds = [kind for kind in vars(units).values() if isinstance(kind, units.Quantity)]
    assert [(kind, set(known)) for kind, known in KINDS if set(kind.factors) != set(known)] == []
    assert {kind.name for kind in kinds} == {kind.name for kind, _ in KINDS}


def test_a_unit_of_another_kind_is_none():
    """5 kPa is no length: none of the units that a kind does not have is read."""
    every = {unit for _, known in KINDS for unit in known}
    for kind, known in KINDS:
        for unit in every - set(known):
            with pytest.raises(ValueError, match="is not"):
                kind.read(f"5 {unit}")


@pytest.mark.parametrize("kind", [kind for kind, _ in KINDS], ids=lambda kind: kind.name)
def test_the_example_in_a_message_is_read(kind):
    """Both ways to write it mean the same number."""
    ways = [way.strip('"') for way in kind.example.split(" or ")]
    assert {kind.read(way) for way in ways} == {float(ways[0])}
    assert len(ways) == (1 if kind is NUMBER else 2)


@pytest.mark.parametrize(
    ("pressure", "text"),
    [
        (0.0, "0 Pa"), (4.99951, "5 Pa"), (9999.0, "9999 Pa"), (9999.6, "10 kPa"), (12345.6, "12.35 kPa"),
        (-5e4, "-50 kPa"), (math.inf, "inf Pa"),
    ],
)  # fmt: skip
def test_a_pressure_in_words(pressure, text):
    assert pascals(pressure) == text


def test_angles_are_given_in_degrees():
    assert in_degrees(math.pi / 2, "rad") == (90.0, "degrees")
    assert in_degrees(0.3, "m") == (0.3, "m")


@pytest.mark.parametrize(
    ("kind", "text", "value"),
    [
        (LENGTH, "0.05 mm", 5e-5),  # exactly: 0.05 * 1e-3 is 5.000000000000001e-05
        (LENGTH, "50um", 5e-5),
        (LENGTH, "50 µm", 5e-5),
        (LENGTH, "4.2 m", 4.2),
        (LENGTH, "25 micron", 2.5e-5),
        (LENGTH, "1 mil", 2.54e-5),
        (LENGTH, "2 ft", 0.6096),
        (STRESS, "1 ksi", 6894757.293168361),
        (PRESSURE, "0.1 psi", 689.4757293168361),
        (FORCE, "10 lbf", 44.482216152605),
        (STIFFNESS, "1 lbf/in", 175.12683524647638),
        (AREA, "400 mm2", 4e-4),
        (DEGREES, "7.5", 7.5),
        (DEGREES, "7.5 deg", 7.5),
        (DEGREES, "0.5 rad", 28.64788975654116),
        (LENGTH, "2e-3 km", 2.0),
        (LENGTH, "2", 2.0),
        (STRESS, "3.5 GPa", 3.5e9),
        (STRESS, "3500 N/mm^2", 3.5e9),
        (STRESS, "215 GPa", 2.15e11),
        (PRESSURE, " 5 Pa ", 5.0),
        (PRESSURE, "-0.5 mbar", -50.0),
        (FORCE, "2.15e9 N", 2.15e9),
        (FORCE, "2.15 GN", 2.15e9),
        (NUMBER, "0.3", 0.3),
        (NUMBER, 1, 1.0),
    ],
)
def test_quantities_are_converted_exactly(kind, text, value):
    assert kind.read(text) == value


@pytest.mark.parametrize(
    ("kind", "value", "message"),
    [
        (LENGTH, "5 kPa", "'5 kPa' is not a length; give metres, e.g. 5e-5 or \"0.05 mm\""),
        (LENGTH, "5 MM", "'5 MM' is not a length; give metres, e.g. 5e-5 or \"0.05 mm\""),
        (STRESS, "3.5 GN", "'3.5 GN' is not a stress; give pascals, e.g. 3.5e9 or \"3.5 GPa\""),
        (FORCE, True, 'True is not a force; give newtons, e.g. 2.15e9 or "2.15 GN"'),
        (NUMBER, "0.3 m", "'0.3 m' is not a pure number; give a number, e.g. 0.3"),
        (NUMBER, math.inf, "inf is not a finite number; give a number, e.g. 0.3"),
        (NUMBER, math.nan, "nan is not a finite number; give a number, e.g. 0.3"),
        (NUMBER, 10**400, "is not a finite number; give a number, e.g. 0.3"),
        (PRESSURE, "1e999 Pa", "'1e999 Pa' is not a finite number; give pascals"),
        (PRESSURE, "five", "'five' is not a pressure; give pascals, e.g. 5.0 or \"5 Pa\""),
        (PRESSURE, "", "'' is not a pressure"),
        (PRESSURE, [5], "[5] is not a pressure"),
    ],
)
def test_wrong_quantities_are_refused(kind, value, message):
    with pytest.raises(ValueError) as caught:  # noqa: PT011  the words are compared below
        kind.read(value)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("value", "unit", "said"),
    [
        (5497.06, "Pa", "5497 Pa"),
        (9999.7, "Pa", "10 kPa"),
        (290608.0, "Pa", "290.6 kPa"),
        (-2.45e8, "Pa", "-245 MPa"),
        (2.5e-5, "m", "0.025 mm"),
        (0.04, "m", "40 mm"),
        (1.2, "m", "1.2 m"),
        (3.9e-13, "m", "3.9e-13 m"),
        (14800.0, "N", "14.8 kN"),
        (2.15e9, "N", "2.15 GN"),
        (0.0, "m", "0 m"),
        (12.34567, "m^3", "12.35 m^3"),
        (0.25, "", "0.25"),
    ],
)
def test_numbers_are_told_with_a_handy_unit(value, unit, said):
    assert scaled(value, unit) == said
