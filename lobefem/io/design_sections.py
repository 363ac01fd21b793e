"""Sections of a design file: which keys mesh, film, hoops, plates and pressure have, and what is possible.

Every check raises `ValueError` with the rest of a sentence that begins with the key's name;
`Design` turns the first of them into an `InputError`.
"""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import BaseModel, BeforeValidator, ConfigDict, model_validator

from lobefem.io.design_values import (
    bar_stiffness,
    cells,
    fill,
    flag,
    group_name,
    integer,
    listed,
    positive,
    pressure_row,
    quantity,
    word,
)
from lobefem.io.materials import CABLES, FILMS, MATERIALS
from lobefem.units import (
    AREA,
    DENSITY,
    FORCE,
    GRADIENT,
    LENGTH,
    NUMBER,
    PRESSURE,
    STRESS,
    shown,
)

__all__ = [
    "Cap",
    "Film",
    "Hoops",
    "Mesh",
    "Plates",
    "Pressure",
    "Section",
]

_LAWS = ("isotropic", "orthotropic", "fixed-wrinkles", "tension-field", "imp", "load-path")

_ORTHOTROPIC = ("E1", "E2", "nu12", "G12")


class Section(BaseModel):
    """A table of a design file: unknown keys are refused, values do not change."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Mesh(Section):
    """[mesh]: structured `divisions` (along a lobe, around), or a `size` without them."""

    divisions: Annotated[tuple[int, int] | None, cells] = None
    cell: Annotated[str, word("triangle", "quadrilateral")] = "triangle"
    order: Annotated[int, integer(1, 2)] = 1
    diagonals: Annotated[str, word("same", "alternating")] = "same"
    grading: Annotated[float, quantity(NUMBER, "in [0, 0.95]", lambda v: 0 <= v <= 0.95)] = 0.0
    layout: Annotated[str, word("structured", "unstructured")] = "structured"
    size: Annotated[float | None, positive(LENGTH)] = None

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


class Cap(Section):
    """[[film.caps]]: so many layers of film, from the top fitting down to a length along the tendons."""

    length: Annotated[float, positive(LENGTH)]
    layers: Annotated[int, integer(2)] = 2


class Film(Section):
    """[film]: law and material; `slack_stiffness` and `prestress` follow the law if not given.

    `setup` says how the built-in stress of `prestress` is found: in closed form, or by inflating unstressed
    film with the prescribed load path at the design's pressure. `tangent` is Newton's for laws that are
    written as a stress. `strength` is the stress at which the film breaks; it changes no result, but what is
    said of it. A `material` has E, nu and strength where they are not given. E1, E2, nu12 and G12 in place of
    E and nu are those of orthotropic film, 1 along the meridian; of a pumpkin only, as are its `density`,
    with which it has weight, and its `caps`.
    """

    law: Annotated[str, word(*_LAWS)] = "fixed-wrinkles"
    E: Annotated[float | None, positive(STRESS)] = None
    nu: Annotated[float | None, quantity(NUMBER, "in (-1, 0.5]", lambda v: -1 < v <= 0.5)] = None
    thickness: Annotated[float, positive(LENGTH)] = 5e-5
    slack_stiffness: Annotated[float | None, quantity(NUMBER, "in [0, 1)", lambda v: 0 <= v < 1)] = None
    prestress: Annotated[bool | None, BeforeValidator(flag)] = None
    hoop_slack: Annotated[float, quantity(NUMBER, "in [0, 1)", lambda v: 0 <= v < 1)] = 0.0
    setup: Annotated[str, word("initial-stress", "load-path")] = "initial-stress"
    tangent: Annotated[str, word("consistent", "secant")] = "consistent"
    E1: Annotated[float | None, positive(STRESS)] = None
    E2: Annotated[float | None, positive(STRESS)] = None
    nu12: Annotated[float | None, quantity(NUMBER)] = None
    G12: Annotated[float | None, positive(STRESS)] = None
    density: Annotated[float | None, positive(DENSITY)] = None
    caps: tuple[Cap, ...] | None = None
    strength: Annotated[float | None, positive(STRESS)] = None
    material: Annotated[str | None, word(*FILMS)] = None

    @property
    def is_orthotropic(self) -> bool:
        """True if the film has moduli of its own along and across."""
        return self.E1 is not None

    @property
    def modulus(self) -> float:
        """E, or the geometric mean of both moduli [Pa]."""
        return (self.E1 * self.E2) ** 0.5 if self.E1 and self.E2 else self.E or 0.0

    @model_validator(mode="after")
    def _of_material(self) -> Film:
        if self.material is not None:
            for key in ("E", "nu", "strength"):
                if key not in self.model_fields_set:
                    fill(self, key, getattr(MATERIALS[self.material], key))
        return self

    @model_validator(mode="after")
    def _one_material(self) -> Film:
        given = [key for key in _ORTHOTROPIC if getattr(self, key) is not None]
        if not given:
            if self.law == "orthotropic":
                raise ValueError(
                    "law = 'orthotropic' lacks E1, E2 and nu12; give them, or the law 'isotropic'"
                )
            for key, value in (("E", 3.5e9), ("nu", 0.3)):
                if getattr(self, key) is None:
                    fill(self, key, value)
            return self
        for key in ("E", "nu"):
            if getattr(self, key) is not None:
                raise ValueError(
                    f"{key} = {getattr(self, key):g} and {given[0]} are of two materials; leave one out"
                )
        for key in _ORTHOTROPIC[:3]:
            if getattr(self, key) is None:
                raise ValueError(
                    f"{given[0]} is that of orthotropic film, which lacks {key}; give E1, E2 and nu12"
                )
        assert self.E1 is not None
        assert self.E2 is not None
        assert self.nu12 is not None
        other = self.nu12 * self.E2 / self.E1
        if self.nu12 * other >= 1 or min(self.nu12, other) <= -1:
            raise ValueError(
                f"nu12 = {self.nu12:g} gives nu21 = nu12 E2/E1 = {other:.4g}, and their product must be "
                "below 1; give a smaller nu12"
            )
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

    EA: Annotated[float, positive(FORCE)] = 2.15e9
    enabled: Annotated[bool, BeforeValidator(flag)] = True
    E: Annotated[float | None, positive(STRESS)] = None
    area: Annotated[float | None, positive(AREA)] = None
    material: Annotated[str | None, word(*CABLES)] = None

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
    """[plates]: the rigid end plates' support, the bar between them, the lift of the top one.

    On a mesh of one's own, `bottom` and `top` name the edge groups of the rims that they close.
    """

    support: Annotated[str, word("clamped", "pinned", "fixed")] = "clamped"
    bar: Annotated[bool | float, bar_stiffness] = True
    lift: Annotated[float, quantity(LENGTH)] = 0.0
    bottom: Annotated[str | None, BeforeValidator(group_name)] = None
    top: Annotated[str | None, BeforeValidator(group_name)] = None

    @model_validator(mode="after")
    def _lifted(self) -> Plates:
        if (self.bottom is None) != (self.top is None):
            given, missing = ("bottom", "top") if self.top is None else ("top", "bottom")
            raise ValueError(f"{given} = {shown(getattr(self, given))} lacks a {missing}; name both rims")
        if self.lift and self.support != "fixed":
            raise ValueError(
                f"lift = {self.lift} needs support = 'fixed', not {self.support!r}; change one of them"
            )
        return self


class Pressure(Section):
    """[pressure]: where the gas presses (film only, or film and plates), and how much [Pa].

    The pressure is that at `level` above the bottom rim and rises by `gradient` per metre. With the gas
    "isothermal" it is the pressure above the `ambient` one at which the gas is sealed in: what is done
    to the balloon then changes it.
    """

    load: Annotated[str, word("film", "closed")] = "film"
    value: Annotated[tuple[float, ...], pressure_row] = (1000.0,)
    gradient: Annotated[float, quantity(GRADIENT)] = 0.0
    level: Annotated[float, quantity(LENGTH)] = 0.0
    gas: Annotated[str, word("given", "isothermal")] = "given"
    ambient: Annotated[float, quantity(PRESSURE, "0 or more", lambda v: v >= 0)] = 0.0

    @model_validator(mode="after")
    def _law(self) -> Pressure:
        if self.ambient and self.gas == "given":
            raise ValueError(
                f"ambient = {self.ambient:g} Pa has no effect under a given pressure; give gas = "
                "'isothermal', or leave it out"
            )
        return self
