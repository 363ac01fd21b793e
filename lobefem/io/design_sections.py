"""The sections of a design file: which keys they have, and what is possible in each.

Every check raises `ValueError` with the rest of a sentence that begins with the key's name;
`Design` turns the first of them into an `InputError`.
"""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import BaseModel, BeforeValidator, ConfigDict, model_validator

from lobefem.io.design_values import (
    angle,
    bar_stiffness,
    cells,
    file_name,
    fill,
    flag,
    group_name,
    integer,
    listed,
    number_row,
    pair,
    positive,
    pressure_row,
    quantity,
    shortening,
    text,
    word,
)
from lobefem.io.materials import CABLES, FILMS, MATERIALS
from lobefem.units import (
    ANGLE,
    AREA,
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
    shown,
)

__all__ = [
    "Cap",
    "CleftTable",
    "Film",
    "Fittings",
    "Hoops",
    "Mesh",
    "Plates",
    "Pressure",
    "Section",
    "Shape",
    "Tendons",
]

_PAPER_RADIUS = 2.0  # [m]

_PAPER_LENGTH = 4.2  # of the cylinder [m]

_LOBE_HEIGHT = 2.094950553365567  # of the paper's lobe over its edge radius

_FORMING_PRESSURE = 37.5  # [Pa]

_SIZES = {
    "isotensoid": ("edge_radius", "R0", "truncation"),
    "cylinder": ("radius", "length"),
    "formed": ("radius", "length", "forming_pressure", "forming_stiffness"),
    "pumpkin": (
        "equator_radius", "tendon_length", "volume", "curve", "gores", "fitting_radius", "lobe",
        "half_angle", "pattern", "stations", "half_widths", "reference",
    ),
    "mesh": ("file",),
}  # fmt: skip

_PUMPKIN_SIZES = {"equator_radius": 1.0, "tendon_length": 2.6220576, "volume": 2.7458122}  # of radius 1


_LAWS = ("isotropic", "orthotropic", "fixed-wrinkles", "tension-field", "imp", "load-path")

_ORTHOTROPIC = ("E1", "E2", "nu12", "G12")


class Section(BaseModel):
    """A table of a design file: unknown keys are refused, values do not change."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Shape(Section):
    """[shape]: one lobe's isotensoid and how many are stacked, a flat cylinder, a formed lobe, or a pumpkin.

    An isotensoid is sized by the radius of its seams and rims, or by its equator radius R0. A formed
    lobe is what a cylinder of fixed-direction film becomes at the forming pressure; without a
    `forming_stiffness`, its E t [N/m], 37.5 Pa make it an isotensoid. A mesh of one's own is read from a
    `file` of Gmsh's, beside the design file, or made on the faces of a STEP file.

    A pumpkin's tendons lie on the isotensoid of one of three sizes, or on the natural shape, whose size
    is that of its loads. Its gores bulge by their `half_angle`, or are as wide as a table says: `pattern`
    is a file with stations over the gore's length and half-widths, which `Design.load` reads.
    """

    kind: Annotated[str, word(*_SIZES)] = "isotensoid"
    edge_radius: Annotated[float | None, positive(LENGTH)] = None
    R0: Annotated[float | None, positive(LENGTH)] = None
    truncation: Annotated[float | None, quantity(NUMBER, "in (0, 0.599]", lambda v: 0 < v <= 0.599)] = None
    lobes: Annotated[int, integer(1)] = 1
    radius: Annotated[float | None, positive(LENGTH)] = None
    length: Annotated[float | None, positive(LENGTH)] = None
    forming_pressure: Annotated[float | None, positive(PRESSURE)] = None
    forming_stiffness: Annotated[float | None, positive(STIFFNESS)] = None
    equator_radius: Annotated[float | None, positive(LENGTH)] = None
    tendon_length: Annotated[float | None, positive(LENGTH)] = None
    volume: Annotated[float | None, positive(VOLUME)] = None
    curve: Annotated[str | None, word("pumpkin", "natural")] = None
    gores: Annotated[int | None, integer(3)] = None
    fitting_radius: Annotated[tuple[float, float] | None, pair(LENGTH)] = None
    lobe: Annotated[str | None, word("constant-angle", "constant-radius", "flat", "table")] = None
    half_angle: Annotated[float | None, angle] = None
    pattern: Annotated[str | None, BeforeValidator(text)] = None
    stations: Annotated[tuple[float, ...] | None, number_row] = None
    half_widths: Annotated[tuple[float, ...] | None, number_row] = None
    reference: Annotated[str | None, word("lobe", "flat")] = None
    file: Annotated[str | None, BeforeValidator(file_name)] = None

    @model_validator(mode="after")
    def _one_kind(self) -> Shape:
        for key in sorted({key for keys in _SIZES.values() for key in keys} - {*_SIZES[self.kind]}):
            if getattr(self, key) is not None:
                raise ValueError(
                    f"{key} = {shown(getattr(self, key))} does not fit the kind {self.kind!r}; use "
                    f"{listed(_SIZES[self.kind])}"
                )
        if self.kind in ("cylinder", "pumpkin", "mesh") and self.lobes != 1:
            raise ValueError(f"lobes = {self.lobes} does not fit the kind {self.kind!r}; leave it out")
        if self.kind == "pumpkin":
            return self._pumpkin()
        if self.kind == "mesh":
            if self.file is None:
                raise ValueError("file is missing; give that of a mesh from Gmsh, e.g. 'beam.msh'")
            return self
        if self.kind == "cylinder":
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

    def _pumpkin(self) -> Shape:
        """Check a pumpkin's keys: those that it needs, and those that exclude each other."""
        given = [key for key in _PUMPKIN_SIZES if getattr(self, key) is not None]
        said = " and ".join(f"{key} = {getattr(self, key):g}" for key in given)
        if self.curve == "natural":
            if given:
                raise ValueError(
                    f"{said} does not fit curve = 'natural', which its payload and gas size; leave it out"
                )
        elif not given:
            raise ValueError(f"kind = 'pumpkin' lacks a size; give one of {listed(tuple(_PUMPKIN_SIZES))}")
        elif len(given) > 1:
            raise ValueError(f"{said} all give the size; give one of them")
        for key, example in (("gores", "64"), ("fitting_radius", "'25 cm'")):
            if getattr(self, key) is None:
                raise ValueError(f"kind = 'pumpkin' lacks {key}; give it, e.g. {key} = {example}")
        lobe = self.lobe or "constant-angle"
        angled, tabled = lobe.startswith("constant"), lobe == "table"
        if angled and self.half_angle is None:
            raise ValueError(f"lobe = {lobe!r} lacks half_angle; give it, e.g. half_angle = '60 deg'")
        if not angled and self.half_angle is not None:
            raise ValueError(f"half_angle = {self.half_angle:.4g} does not fit lobe = {lobe!r}; leave it out")
        if self.pattern is not None:
            raise ValueError(
                f"pattern = {shown(self.pattern)} is read with design files; give stations and half_widths"
            )
        rows = {"stations": self.stations, "half_widths": self.half_widths}
        for key, row in rows.items():
            if tabled and row is None:
                raise ValueError(
                    f"lobe = 'table' lacks {key}; give pattern = 'gore.csv', or both rows of numbers"
                )
            if not tabled and row is not None:
                raise ValueError(
                    f"{key} do not fit lobe = {lobe!r}; give lobe = 'table', or leave the table out"
                )
        return self._filled(curve="pumpkin", lobe=lobe, reference="flat" if tabled else "lobe")

    @property
    def size(self) -> float:
        """The radius that the design gives [m]: R0, that of its rims and seams, or about a pumpkin's own.

        0 of a natural shape, whose loads decide, and of a mesh.
        """
        for key, share in _PUMPKIN_SIZES.items():
            value = getattr(self, key)
            if value is not None:
                return float((value / share) ** (1 / 3 if key == "volume" else 1))
        return self.R0 or self.edge_radius or self.radius or 0.0

    def _filled(self, **defaults: float | str) -> Shape:
        """Put the defaults of this kind where nothing is given."""
        for key, value in defaults.items():
            if getattr(self, key) is None:
                fill(self, key, value)
        return self


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


class Tendons(Section):
    """[tendons]: the cables between a pumpkin's gores; foreshortening is a share of their drawn length."""

    EA: Annotated[float, positive(FORCE)] = 1e5
    foreshortening: Annotated[float | tuple[tuple[float, float], ...], shortening] = 0.0
    mass_per_length: Annotated[float, quantity(LINE_DENSITY, "0 or more", lambda v: v >= 0)] = 0.0


class Fittings(Section):
    """[fittings]: masses of a pumpkin's end fittings, [bottom, top], and of the payload below them."""

    mass: Annotated[tuple[float, float], pair(MASS)] = (0.0, 0.0)
    payload: Annotated[float, quantity(MASS, "0 or more", lambda v: v >= 0)] = 0.0


class CleftTable(Section):
    """[cleft]: the gap that `perturb --cleft` makes in a pumpkin: its gores, its depth and its turn.

    Without a depth the gap is pulled in by a tenth of the radius.
    """

    gores: Annotated[int, integer(2)] = 4
    depth: Annotated[float | None, positive(LENGTH)] = None
    turn: Annotated[float, quantity(ANGLE)] = math.pi / 2
