"""A few materials of balloons with the sources of their numbers, at room temperature.

They are typical values to begin a design with, none to certify one. The list is short on purpose: it
has only materials whose numbers a data sheet confirms. Polyethylene films are left out: they creep, so that
no one modulus holds for a flight.
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["CABLES", "FILMS", "MATERIALS", "NOTE", "Material"]

NOTE = (
    "The list is short on purpose: it has only materials whose numbers a data sheet confirms. Give the "
    "numbers of others yourself: E, nu and strength in [film], EA or E and area in [hoops]."
)


@dataclass(frozen=True)
class Material:
    """A material.

    Attributes:
        title: what it is.
        E: Young's modulus [Pa].
        nu: Poisson's ratio.
        density: [kg/m^3].
        strength: tensile strength [Pa], of a metal its yield stress.
        source: of the numbers.
    """

    title: str
    E: float
    nu: float
    density: float
    strength: float
    source: str


_KG_PER_MM2 = 9.80665e6  # [Pa]

MATERIALS = {
    "mylar-a": Material(
        title="Mylar polyester film, type 92A, along the machine",
        E=490 * _KG_PER_MM2,
        nu=0.38,
        density=1390.0,
        strength=20 * _KG_PER_MM2,
        source="DuPont Teijin Films, Mylar Physical-Thermal Properties (H-37232-3): table 1, and nu from the "
        "text (before yield)",
    ),
    "aluminium-6061-t6": Material(
        title="aluminium alloy 6061-T6",
        E=68.9e9,
        nu=0.33,
        density=2700.0,
        strength=276e6,
        source="data sheet of Glemco, Inc.: typical values of the Aluminum Association, but nu estimated "
        "from similar alloys",
    ),
}

FILMS = tuple(MATERIALS)

CABLES = ("aluminium-6061-t6",)
