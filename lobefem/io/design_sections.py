"""The sections of a design file: which keys they have, and what is possible in each.

Every check raises `ValueError` with the rest of a sentence that begins with the key's name;
`Design` turns the first of them into an `InputError`.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Iterable
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, model_validator

from lobefem.io.materials import CABLES, FILMS, MATERIALS
from lobefem.units import AREA, FORCE, LENGTH, NUMBER, PRESSURE, STIFFNESS, STRESS, Quantity, shown

__all__ = ["Film", "Hoops", "Mesh", "Plates", "Pressure", "Section", "Shape", "fill", "listed", "nearest"]

_PAPER_RADIUS = 2.0  # [m]

_PAPER_LENGTH = 4.2  # of the cylinder [m]

_LOBE_HEIGHT = 2.094950553365567  # of the paper's lobe over its edge radius

_FORMING_PRESSURE = 37.5  # [Pa]

_MOST_DIGITS = 9  # of integers; Python refuses to read and to write thousands of them

_SIZES = {
    "isotensoid": ("edge_radius", "R0", "truncation"),
    "cylinder": ("radius", "length"),
    "formed": ("radius", "length", "forming_pressure", "forming_stiffness"),
}


# --- kinds of values ----------------------------------------------------------------------------
def _quantity(
    kind: Quantity, rule: str = "", holds: Callable[[float], bool] | None = None
) -> BeforeValidator:
    def check(value: Any) -> float:
        number = kind.read(value)
        if holds is not None and not holds(number):
            raise ValueError(f"{shown(value)} must be {rule}; {kind.advice}")
        return number

    return BeforeValidator(check)


def _positive(kind: Quantity) -> BeforeValidator:
    # the bounds keep squares and products of sound numbers away from overflow
    return _quantity(kind, "positive (1e-15 to 1e15 in SI)", lambda v: 1e-15 <= v <= 1e15)


def _word(*words: str) -> BeforeValidator:
    def check(value: Any) -> str:
        if not isinstance(value, str) or value not in words:
            raise ValueError(f"{shown(value)} is unknown; use {listed(words)}{nearest(value, words)}")
        return value

    return BeforeValidator(check)


def _flag(value: Any) -> bool:
    if not isinstance(value, bool):
        raise ValueError(f"{shown(value)} is neither true nor false; write one of the two without quotes")
    return value


def _integer(least: int, most: int | None = None) -> BeforeValidator:
    span = f"{least} or {most}" if most else f"an integer, {least} or more"

    def check(value: Any) -> int:
        text = isinstance(value, str) and value.strip().isdecimal() and len(value) <= _MOST_DIGITS
        number = int(value) if text else value
        whole = isinstance(number, int) and not isinstance(number, bool)
        if not whole or not least <= number <= (most or 10**_MOST_DIGITS):
            raise ValueError(f"{shown(value)} is impossible; give {span}")
        return number

    return BeforeValidator(check)


def _divisions(value: Any) -> tuple[int, int]:
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


def _bar(value: Any) -> bool | float:
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


def _pressures(value: Any) -> tuple[float, ...]:
    values = value if isinstance(value, (list, tuple)) else [value]
    if not values:
        raise ValueError(f"[] holds no pressure; {PRESSURE.advice}")
    numbers = tuple(PRESSURE.read(v) for v in values)
    for given, number in zip(values, numbers, strict=True):
        if number < 0:
            raise ValueError(f"{shown(given)} is below 0, and a film carries no suction; {PRESSURE.advice}")
    return numbers


def listed(words: tuple[str, ...]) -> str:
    """Words as a choice: a, b or c."""
    return " or ".join([", ".join(words[:-1]), words[-1]] if words[1:] else words)


def nearest(word: Any, words: Iterable[str]) -> str:
    """A parenthesis that names the word that was probably meant, or nothing."""
    close = difflib.get_close_matches(str(word), list(words), n=1, cutoff=0.6)
    return f" (did you mean {close[0]}?)" if close else ""


# --- the sections -------------------------------------------------------------------------------
class Section(BaseModel):
    """A table of a design file: unknown keys are refused, values do not change."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Shape(Section):
    """[shape]: one lobe's isotensoid and how many are stacked, or a flat cylinder, or a formed lobe.

    An isotensoid is sized by the radius of its seams and rims, or by its equator radius R0. A formed
    lobe is what a cylinder of fixed-direction film becomes at the forming pressure; without a
    `forming_stiffness`, its E t [N/m], 37.5 Pa make it an isotensoid.
    """

    kind: Annotated[str, _word(*_SIZES)] = "isotensoid"
    edge_radius: Annotated[float | None, _positive(LENGTH)] = None
    R0: Annotated[float | None, _positive(LENGTH)] = None
    truncation: Annotated[float | None, _quantity(NUMBER, "in (0, 0.599]", lambda v: 0 < v <= 0.599)] = None
    lobes: Annotated[int, _integer(1)] = 1
    radius: Annotated[float | None, _positive(LENGTH)] = None
    length: Annotated[float | None, _positive(LENGTH)] = None
    forming_pressure: Annotated[float | None, _positive(PRESSURE)] = None
    forming_stiffness: Annotated[float | None, _positive(STIFFNESS)] = None

    @model_validator(mode="after")
    def _one_kind(self) -> Shape:
        for key in sorted({key for keys in _SIZES.values() for key in keys} - {*_SIZES[self.kind]}):
            if getattr(self, key) is not None:
                raise ValueError(
                    f"{key} = {getattr(self, key)} does not fit the kind {self.kind!r}; use "
                    f"{listed(_SIZES[self.kind])}"
                )
        if self.kind == "cylinder":
            if self.lobes != 1:
                raise ValueError(f"lobes = {self.lobes} does not fit the kind 'cylinder'; leave it out")
            return self._filled(radius=_PAPER_RADIUS, length=_PAPER_LENGTH)
        if self.kind == "formed":
            radius = self.radius or _PAPER_RADIUS
            return self._filled(
                radius=radius, length=_LOBE_HEIGHT * radius, forming_pressure=_FORMING_PRESSURE
            )
        if self.R0 is not None and self.edge_radius is not None:
            raise ValueError(
                f"edge_radius = {self.edge_radius} and R0 = {self.R0} both give the size; leave one out"
            )
        return self._filled(truncation=0.55, **({} if self.R0 else {"edge_radius": _PAPER_RADIUS}))

    @property
    def size(self) -> float:
        """The radius that the design gives [m]: R0, or that of its rims and seams."""
        return self.R0 or self.edge_radius or self.radius or 0.0

    def _filled(self, **defaults: float) -> Shape:
        """Put the defaults of this kind where nothing is given."""
        for key, value in defaults.items():
            if getattr(self, key) is None:
                fill(self, key, value)
        return self


class Mesh(Section):
    """[mesh]: structured `divisions` (along a lobe, around), or a `size` without them."""

    divisions: Annotated[tuple[int, int] | None, BeforeValidator(_divisions)] = None
    cell: Annotated[str, _word("triangle", "quadrilateral")] = "triangle"
    order: Annotated[int, _integer(1, 2)] = 1
    diagonals: Annotated[str, _word("same", "alternating")] = "same"
    grading: Annotated[float, _quantity(NUMBER, "in [0, 0.95]", lambda v: 0 <= v <= 0.95)] = 0.0
    layout: Annotated[str, _word("structured", "unstructured")] = "structured"
    size: Annotated[float | None, _positive(LENGTH)] = None

    @model_validator(mode="after")
    def _one_layout(self) -> Mesh:
        if self.layout == "structured":
            if self.size is not None:
                raise ValueError(
                    f"size = {self.size} needs layout = 'unstructured'; give it or use divisions"
                )
            if self.divisions is None:
                fill(self, "divisions", (24, 32))
        elif self.divisions is not None:
            raise ValueError(
                f"divisions = {shown(list(self.divisions))} do not fit layout = 'unstructured'; "
                "give a size in metres"
            )
        elif self.size is None:
            raise ValueError("layout = 'unstructured' lacks a size; give metres, e.g. 0.25")
        return self


class Film(Section):
    """[film]: law and material; `slack_stiffness` and `prestress` follow the law if not given.

    `setup` says how the built-in stress of `prestress` is found: in closed form, or by inflating unstressed
    film with the prescribed load path at the design's pressure. `tangent` is Newton's for laws that are
    written as a stress. `strength` is the stress at which the film breaks; it changes no result, but what is
    said of it. A `material` has E, nu and strength where they are not given.
    """

    law: Annotated[str, _word("isotropic", "fixed-wrinkles", "tension-field", "imp", "load-path")] = (
        "fixed-wrinkles"
    )
    E: Annotated[float, _positive(STRESS)] = 3.5e9
    nu: Annotated[float, _quantity(NUMBER, "in (-1, 0.5]", lambda v: -1 < v <= 0.5)] = 0.3
    thickness: Annotated[float, _positive(LENGTH)] = 5e-5
    slack_stiffness: Annotated[float | None, _quantity(NUMBER, "in [0, 1)", lambda v: 0 <= v < 1)] = None
    prestress: Annotated[bool | None, BeforeValidator(_flag)] = None
    hoop_slack: Annotated[float, _quantity(NUMBER, "in [0, 1)", lambda v: 0 <= v < 1)] = 0.0
    setup: Annotated[str, _word("initial-stress", "load-path")] = "initial-stress"
    tangent: Annotated[str, _word("consistent", "secant")] = "consistent"
    strength: Annotated[float | None, _positive(STRESS)] = None
    material: Annotated[str | None, _word(*FILMS)] = None

    @model_validator(mode="after")
    def _of_material(self) -> Film:
        if self.material is not None:
            for key in ("E", "nu", "strength"):
                if key not in self.model_fields_set:
                    fill(self, key, getattr(MATERIALS[self.material], key))
        return self

    @model_validator(mode="after")
    def _one_law(self) -> Film:
        by_stress = ("imp", "load-path")
        if self.tangent != "consistent" and self.law not in by_stress:
            raise ValueError(
                f"tangent = {self.tangent!r} needs a law written as a stress, {listed(by_stress)}, not "
                f"{self.law!r}; leave it out"
            )
        if self.law == "load-path" and (self.prestress or self.setup != "initial-stress"):
            key, value = (
                ("setup", repr(self.setup)) if self.setup != "initial-stress" else ("prestress", "true")
            )
            raise ValueError(
                f"{key} = {value} does not fit law = 'load-path', which finds the stress of unstressed film; "
                "leave it out, or give the law that takes over, e.g. 'tension-field'"
            )
        if self.setup == "load-path" and self.prestress is False:
            raise ValueError("setup = 'load-path' is a way to built-in stress; leave out prestress = false")
        return self


class Hoops(Section):
    """[hoops]: hoops on all seams; without this table there are none.

    `EA`, or a cross-section's `area` and its `E` or `material`.
    """

    EA: Annotated[float, _positive(FORCE)] = 2.15e9
    enabled: Annotated[bool, BeforeValidator(_flag)] = True
    E: Annotated[float | None, _positive(STRESS)] = None
    area: Annotated[float | None, _positive(AREA)] = None
    material: Annotated[str | None, _word(*CABLES)] = None

    @model_validator(mode="after")
    def _stiffness(self) -> Hoops:
        if self.material is not None and self.E is None:
            fill(self, "E", MATERIALS[self.material].E)
        if self.E is None and self.area is None:
            return self
        if self.area is None:
            key, value = ("E", self.E) if self.material is None else ("material", repr(self.material))
            raise ValueError(f"{key} = {value} lacks the area of the hoops' cross-section; {AREA.advice}")
        if self.E is None:
            raise ValueError(f"area = {self.area} lacks E or a material; give one, or EA without an area")
        EA = self.E * self.area
        if "EA" in self.model_fields_set and not math.isclose(self.EA, EA, rel_tol=1e-9):
            raise ValueError(f"EA = {self.EA:g} is not E times area, {EA:g} N; leave one of them out")
        fill(self, "EA", EA)
        return self


class Plates(Section):
    """[plates]: the rigid end plates' support, the bar between them, the lift of the top one."""

    support: Annotated[str, _word("clamped", "pinned", "fixed")] = "clamped"
    bar: Annotated[bool | float, BeforeValidator(_bar)] = True
    lift: Annotated[float, _quantity(LENGTH)] = 0.0

    @model_validator(mode="after")
    def _lifted(self) -> Plates:
        if self.lift and self.support != "fixed":
            raise ValueError(
                f"lift = {self.lift} needs support = 'fixed', not {self.support!r}; change one of them"
            )
        return self


class Pressure(Section):
    """[pressure]: where the gas presses (film only, or film and plates), and how much [Pa]."""

    load: Annotated[str, _word("film", "closed")] = "film"
    value: Annotated[tuple[float, ...], BeforeValidator(_pressures)] = (1000.0,)


def fill(section: Section, key: str, value: Any) -> None:
    """Set a default that depends on other keys; it does not count as given."""
    object.__setattr__(section, key, value)  # sections are frozen for all others
