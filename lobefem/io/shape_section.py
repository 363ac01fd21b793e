"""The section [shape] of a design file: which keys each kind of shape has."""

from __future__ import annotations

from typing import Annotated

from pydantic import BeforeValidator, model_validator

from lobefem.io.design_sections import Section
from lobefem.io.design_values import (
    angle,
    file_name,
    fill,
    integer,
    listed,
    number_row,
    pair,
    positive,
    quantity,
    text,
    word,
)
from lobefem.units import LENGTH, NUMBER, PRESSURE, STIFFNESS, VOLUME, shown

__all__ = ["Shape"]

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
