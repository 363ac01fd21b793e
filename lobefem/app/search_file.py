"""Searches for the best design of a pumpkin: what varies, the goal and the limits, from a TOML file."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator

from lobefem.errors import InputError
from lobefem.frozen import Frozen
from lobefem.io.design import Design
from lobefem.io.toml import read_toml
from lobefem.typing import Array
from lobefem.units import FORCE, MASS, PRESSURE, STRESS, VOLUME, Quantity, shown

__all__ = ["LIMITS", "Search", "load"]

# what can be bounded: its unit, and 1 for an upper bound, -1 for a lower one
LIMITS = {
    "max_stress": (STRESS, 1),
    "mass": (MASS, 1),
    "tendon_tension": (FORCE, 1),
    "volume": (VOLUME, -1),
    "critical_pressure": (PRESSURE, -1),
}

_POINTS = 41  # rows of the table of half-widths


class _Widths(BaseModel):
    """Factors of the half-width at stations of the gore; a cubic spline through them, and 1 at the ends."""

    model_config = ConfigDict(extra="forbid", strict=True)

    stations: list[float]
    range: list[float]

    @field_validator("stations")
    @classmethod
    def _between(cls, stations: list[float]) -> list[float]:
        if not stations or sorted({0.0, 1.0, *stations}) != [0.0, *stations, 1.0]:
            raise ValueError(
                f"widths.stations = {shown(stations)} must ascend between 0 and 1, as [0.25, 0.5, 0.75]"
            )
        return stations

    @field_validator("range")
    @classmethod
    def _factors(cls, ends: list[float]) -> list[float]:
        if len(ends) != 2 or not 0.5 <= ends[0] < ends[1] <= 2:
            raise ValueError(
                f"widths.range = {shown(ends)} must be two ascending factors from 0.5 to 2, as [0.9, 1.1]"
            )
        return ends


class _File(BaseModel):
    """A search as its TOML file describes it."""

    model_config = ConfigDict(extra="forbid", strict=True)

    design: str
    goal: Literal["critical_pressure", "mass", "volume"]
    harmonics: list[int] = Field(default_factory=lambda: [3, 4, 5])
    search_to: str | float | int = 1000.0
    vary: dict[str, list[str | int | float]] = Field(default_factory=dict)
    choose: dict[str, list[str | int | float]] = Field(default_factory=dict)
    set: dict[str, str | bool | int | float | list[Any]] = Field(default_factory=dict)
    widths: _Widths | None = None
    limits: dict[str, str | int | float] = Field(default_factory=dict)

    @field_validator("vary", "choose", "set", mode="before")
    @classmethod
    def _flat(cls, tables: Any) -> Any:
        """`shape.gores = [...]` is a table in a table for TOML; "shape.gores" = [...] is not."""
        if not isinstance(tables, dict):
            return tables
        flat: dict[str, Any] = {}
        for key, value in tables.items():
            flat |= {f"{key}.{k}": v for k, v in value.items()} if isinstance(value, dict) else {key: value}
        return flat


@dataclass(frozen=True)
class Search(Frozen):
    """A search for the best design.

    Attributes:
        base: the design that is varied.
        goal: "critical_pressure" (the lowest of the harmonics, as high as possible), "mass" (as low), or
            "volume" (as large).
        harmonics: n whose critical pressures count; without any none is computed.
        search_to: pressure above which no loss of stability is looked for [Pa].
        keys: of the design that vary between two ends.
        stations: of the gore at which the half-width varies by a factor.
        low, high: ends of keys and factors (parameters,) [SI].
        choices: values of the keys that are enumerated, in all combinations.
        limits: bounds by the names of `LIMITS` [SI].
        text: of the file.
    """

    base: Design
    goal: str
    harmonics: tuple[int, ...]
    search_to: float
    keys: tuple[str, ...]
    stations: tuple[float, ...]
    low: Array
    high: Array
    choices: tuple[Mapping[str, Any], ...]
    limits: Mapping[str, float]
    text: str

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return (*self.keys, *(f"half-width at {s:g}" for s in self.stations))

    @cached_property
    def size(self) -> int:
        """Number of parameters."""
        return len(self.low)

    def design(self, choice: Mapping[str, Any], x: Array) -> Design:
        """The design of a choice and of parameters (parameters,), a table of widths where these vary.

        Raises:
            InputError: there is none.
        """
        varied = dict(zip(self.keys, map(float, x), strict=False))
        design = self.base.with_overrides({**choice, **varied})
        if not self.stations:
            return design
        from scipy.interpolate import CubicSpline

        factors = CubicSpline((0.0, *self.stations, 1.0), (1.0, *x[len(self.keys) :], 1.0), bc_type="natural")
        shares = np.linspace(0.0, 1.0, _POINTS)
        widths = design.gore.half_width(shares * design.curve.arc_length) * factors(shares)
        tables = design.model_dump(exclude_unset=True)
        shape = {key: value for key, value in tables["shape"].items() if key != "half_angle"}
        shape |= {
            "lobe": "table",
            "stations": tuple(map(float, shares)),
            "half_widths": tuple(map(float, widths)),
        }
        return Design.parse(tables | {"shape": shape})


def load(path: str | Path) -> Search:
    """Read a search's file.

    Args:
        path: of a TOML file; the design is found from its folder.

    Raises:
        InputError: a file that cannot be read or describes no search.
    """
    path = Path(path)
    tables, text, fault = read_toml(path, "search file", "demos/ for an example")
    if tables is None:
        raise InputError(fault)
    try:
        file = _File.model_validate(tables)
    except ValidationError as error:
        raise InputError(f"{path}: {_first(error)}") from None
    base = Design.load(path.parent / file.design).with_overrides(file.set)
    if not base.is_pumpkin:
        raise InputError(f"{path}: design = {shown(file.design)} is no pumpkin; only pumpkins are searched")
    if len(base.pressure.value) != 1:
        raise InputError(f"{path}: design = {shown(file.design)} has several pressures; give it one")
    if base.pressure.gas != "given":
        raise InputError(
            f"{path}: a search takes a given pressure, and pressure.gas is 'isothermal'; leave it out"
        )
    if min(base.pressure.value) <= 0:
        raise InputError(f"{path}: pressure.value = 0 leaves the film without stress; give one above 0")
    if file.widths is not None and base.shape.reference != "flat":
        raise InputError(f"{path}: widths need a design with shape.reference = 'flat'")
    low, high = [], []
    for key, ends in file.vary.items():
        if key in file.choose:
            raise InputError(f"{path}: {key} stands in [choose] and in [vary]; leave it out of one")
        if len(ends) != 2:
            raise InputError(
                f"{path}: vary.{key} = {shown(ends)} must be the two ends between which it varies"
            )
        numbers = [_number(path, base, key, value) for value in ends]
        if any(isinstance(number, int) for number in numbers):
            raise InputError(f"{path}: vary.{key} = {shown(ends)} are whole numbers; list them in [choose]")
        if not numbers[0] < numbers[1]:
            raise InputError(f"{path}: vary.{key} = {shown(ends)} must ascend")
        low.append(numbers[0])
        high.append(numbers[1])
    stations = () if file.widths is None else tuple(file.widths.stations)
    if file.widths is not None:
        low += [file.widths.range[0]] * len(stations)
        high += [file.widths.range[1]] * len(stations)
    if not low:
        raise InputError(f"{path}: nothing varies; give [vary] or [widths]")
    try:
        search_to = _positive("search_to", PRESSURE, file.search_to)
        limits = {
            name: _positive(f"limits.{name}", LIMITS[name][0], value) for name, value in file.limits.items()
        }
    except KeyError as error:
        raise InputError(f"{path}: limits.{error.args[0]} is unknown; use {', '.join(LIMITS)}") from None
    except ValueError as error:
        raise InputError(f"{path}: {error}") from None
    choices = tuple(
        dict(zip(file.choose, values, strict=True)) for values in itertools.product(*file.choose.values())
    )
    if not choices:
        raise InputError(f"{path}: [choose] has a key without values; give some, as [48, 64]")
    gores = min(base.with_overrides(choice).shape.gores or 0 for choice in choices)
    if not file.harmonics and "critical_pressure" in (file.goal, *limits):
        raise InputError(f"{path}: harmonics = [] leaves no critical pressure; give some, as [3, 4, 5]")
    if "mass" in (file.goal, *limits) and not (base.film.density or base.tendons.mass_per_length):
        raise InputError(
            f"{path}: design = {shown(file.design)} has film and tendons without mass, which then does not "
            "vary; give it film.density, 920 kg/m^3 say"
        )
    if not all(0 <= n <= gores // 2 for n in file.harmonics):
        raise InputError(f"{path}: harmonics = {file.harmonics} must lie from 0 to {gores // 2}")
    return Search(
        base,
        file.goal,
        tuple(sorted(set(file.harmonics))),
        search_to,
        tuple(file.vary),
        stations,
        np.array(low),
        np.array(high),
        choices,
        limits,
        text,
    )


def _positive(key: str, kind: Quantity, value: Any) -> float:
    """A positive quantity of the file [SI]; ValueError in a sentence that begins with its key."""
    try:
        number = kind.read(value)
    except ValueError as error:
        raise ValueError(f"{key} = {error}") from None
    if number <= 0:
        raise ValueError(f"{key} = {shown(value)} must be above 0; {kind.advice}")
    return number


def _number(path: Path, base: Design, key: str, value: Any) -> float:
    """A key's value as the number that it is in SI, an integer where only these are possible."""
    design = base.with_overrides({key: value})
    section, _, name = key.partition(".")
    found = getattr(getattr(design, section), name)
    found = found[0] if isinstance(found, tuple) and len(set(found)) == 1 else found
    if isinstance(found, bool) or not isinstance(found, (int, float)):
        raise InputError(f"{path}: vary.{key} = {shown(value)} is no number that could vary between two ends")
    return found


def _first(error: ValidationError) -> str:
    """The first fault of a file in a sentence."""
    first = error.errors(include_url=False)[0]
    where = ".".join(map(str, first["loc"]))
    if first["type"] == "value_error":
        return str(first["ctx"]["error"])
    if first["type"] == "missing":
        return f"{where} is missing; give it"
    if first["type"] == "extra_forbidden":
        return f"{where} is unknown; use {', '.join(_File.model_fields)}"
    return f"{where} = {shown(first['input'])}: {first['msg'].lower()}"
