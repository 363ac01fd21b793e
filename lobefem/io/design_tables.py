"""Tables of a design file together, and what follows from them: its size, a pumpkin's curve and gore."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Annotated

from pydantic import BeforeValidator, Field

from lobefem.errors import InputError
from lobefem.io.design_sections import Film, Hoops, Mesh, Plates, Pressure, Section
from lobefem.io.mesh_sections import CableTable, FixedTable, Supports, one_or_more
from lobefem.io.pumpkin_sections import CleftTable, Fittings, Tendons
from lobefem.io.shape_section import Shape

if TYPE_CHECKING:
    from lobefem.geometry.gore import Gore, Lobes
    from lobefem.geometry.natural_curve import NaturalCurve
    from lobefem.geometry.tendon_curve import TendonCurve

__all__ = ["GRAVITY", "Tables"]

GRAVITY = 9.80665  # [m/s^2]


class Tables(Section):
    """The tables of a design, whose defaults may not be complete yet."""

    shape: Shape = Field(default_factory=Shape)
    mesh: Mesh = Field(default_factory=Mesh)
    film: Film = Field(default_factory=Film)
    hoops: Hoops = Field(default_factory=lambda: Hoops(enabled=False))
    plates: Plates = Field(default_factory=Plates)
    pressure: Pressure = Field(default_factory=Pressure)
    tendons: Tendons = Field(default_factory=Tendons)
    fittings: Fittings = Field(default_factory=Fittings)
    cleft: CleftTable = Field(default_factory=CleftTable)
    supports: Supports = Field(default_factory=Supports)
    fixed: Annotated[tuple[FixedTable, ...], BeforeValidator(one_or_more)] = ()
    cables: Annotated[tuple[CableTable, ...], BeforeValidator(one_or_more)] = ()

    @property
    def has_ideal_state(self) -> bool:
        """True if the shape carries the pressure without hoop stress: an isotensoid or a formed lobe."""
        return self.shape.kind not in ("cylinder", "pumpkin", "mesh")

    @property
    def is_pumpkin(self) -> bool:
        """True if the shape is a pumpkin's."""
        return self.shape.kind == "pumpkin"

    @property
    def size(self) -> float:
        """The radius that the design gives [m], of a pumpkin that of its tendons at the equator."""
        return self.curve.R0 if self.is_pumpkin else self.shape.size

    @cached_property
    def curve(self) -> TendonCurve:
        """The curve on which a pumpkin's tendons lie.

        Raises:
            InputError: fittings that do not fit.
            SolveError: loads that no natural shape bears.
        """
        from lobefem.geometry.pumpkin_curve import PumpkinCurve

        shape = self.shape
        assert shape.fitting_radius is not None
        if shape.curve == "natural":
            return self._natural_curve()
        if shape.equator_radius is not None:
            return PumpkinCurve(shape.equator_radius, shape.fitting_radius)
        if shape.tendon_length is not None:
            return PumpkinCurve.of_tendon_length(shape.tendon_length, shape.fitting_radius)
        assert shape.volume is not None
        return PumpkinCurve.of_volume(shape.volume, shape.fitting_radius)

    @cached_property
    def gore(self) -> Gore:
        """One gore of a pumpkin.

        Raises:
            InputError: lobes that do not fit.
        """
        from lobefem.geometry.gore import ConstantAngle, ConstantRadius, FlatLobe, Gore, TabulatedWidth

        shape = self.shape
        assert shape.gores is not None
        lobes: Lobes = FlatLobe()
        if shape.lobe == "table":
            assert shape.stations is not None
            assert shape.half_widths is not None
            lobes = TabulatedWidth(shape.stations, shape.half_widths)
        elif shape.half_angle is not None:
            lobes = (ConstantAngle if shape.lobe == "constant-angle" else ConstantRadius)(shape.half_angle)
        return Gore(self.curve, shape.gores, lobes)

    @property
    def has_plates(self) -> bool:
        """True if end plates close the rims: always, but on a mesh whose rims the design does not name."""
        return self.shape.kind != "mesh" or self.plates.bottom is not None

    def _natural_curve(self) -> NaturalCurve:
        from lobefem.geometry.natural_curve import NaturalCurve

        shape, film, gas = self.shape, self.film, self.pressure
        tendons, fittings = self.tendons, self.fittings
        assert shape.gores is not None
        if len(gas.value) != 1:
            raise InputError(f"the natural shape is that of one pressure, not of {len(gas.value)}; give one")
        caps = film.caps or ()
        if len(caps) > 1:
            raise InputError(
                f"the natural shape knows one cap, not {len(caps)}; give one, or the curve 'pumpkin'"
            )
        layer = GRAVITY * film.thickness * (film.density or 0.0)
        bottom, top = fittings.mass
        return NaturalCurve(
            payload=GRAVITY * fittings.payload,
            gradient=gas.gradient,
            pressure=gas.value[0] - gas.gradient * gas.level,
            film_weight=layer,
            tendon_weight=GRAVITY * tendons.mass_per_length * shape.gores,
            cap_weight=layer * (caps[0].layers - 1) if caps else 0.0,
            cap_length=caps[0].length if caps else 0.0,
            fitting_weights=(GRAVITY * bottom, GRAVITY * top),
            fitting_radii=shape.fitting_radius,  # type: ignore[arg-type]
        )
