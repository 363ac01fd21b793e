"""A few materials of balloons with the sources of their numbers, at room temperature.

They are typical values to begin a design with, none to certify one. Polyethylene films are left out: they
creep, so that no one modulus holds for a flight.
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["CABLES", "FILMS", "MATERIALS", "Material"]


@dataclass(frozen=True)
class Material:
    """A material.

    Attributes:
        title: what it is.
        E: Young's modulus [Pa], of a fibre along it.
        nu: Poisson's ratio; None for a fibre.
        density: [kg/m^3].
        strength: tensile strength [Pa], of a metal its yield stress.
        source: of the numbers.
    """

    title: str
    E: float
    nu: float | None
    density: float
    strength: float
    source: str


_KG_PER_MM2 = 9.80665e6  # [Pa]

MATERIALS = {
    "mylar-a": Material(
        "Mylar polyester film, along the machine", 490 * _KG_PER_MM2, 0.38, 1390.0, 20 * _KG_PER_MM2,
        "DuPont Teijin Films, Mylar Physical-Thermal Properties (H-37232-3), table 1",
    ),
    "aluminium-6061-t6": Material(
        "aluminium alloy 6061-T6", 68.9e9, 0.33, 2700.0, 276e6, "Aluminum Association, typical values",
    ),
    "steel-s355": Material("structural steel S355", 210e9, 0.3, 7850.0, 355e6, "EN 1993-1-1, 3.2"),
    "kevlar-49": Material(
        "Kevlar 49 aramid yarn", 112.4e9, None, 1440.0, 3.0e9, "DuPont, Kevlar Technical Guide, section II",
    ),
    "zylon-as": Material(
        "Zylon AS (PBO) fibre", 180e9, None, 1540.0, 5.8e9, "Toyobo, Zylon Technical Information (2005)",
    ),
}  # fmt: skip

FILMS = tuple(name for name, one in MATERIALS.items() if one.nu is not None)

CABLES = tuple(name for name in MATERIALS if name != "mylar-a")
