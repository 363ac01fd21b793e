"""Warnings for the reader of a result: designs, pressures and balances that make little sense."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from lobefem.units import pascals

if TYPE_CHECKING:
    from lobefem.io.design import Design

__all__ = ["of_balance", "of_built_in", "of_design", "of_distortion", "of_ledger", "of_pressures"]

# thickness over radius between which film is one; beyond them a unit was probably forgotten. A balloon of
# 57 m and 0.038 mm has 7e-7, one of 0.1 m and 0.1 mm 1e-3.
_THIN, _THICK = 1e-7, 2e-3

# strain beyond which St Venant-Kirchhoff film is no model of a plastic one
_STRAIN = 0.05

# residual of a held ideal state over the load, and energy not accounted for over the largest part
_UNBALANCED, _OPEN = 0.5, 0.02


def of_design(design: Design) -> list[str]:
    """Sentences on the design itself."""
    film, shape = design.film, design.shape
    return [
        *_if(
            film.law == "isotropic" and bool(film.slack_stiffness),
            "isotropic film has no slack part, so slack_stiffness has no effect",
        ),
        *_if(
            film.hoop_slack > 0 and not film.prestress,
            "hoop_slack is part of the built-in stress: without film.prestress = true it has an effect on "
            "the ideal state only",
        ),
        *_if(
            shape.lobes > 1 and not design.hoops.enabled,
            f"no hoops at the seams of the {shape.lobes} lobes: if that is intended, expect no result "
            "that is independent of the mesh; otherwise add a table [hoops] to the design",
        ),
        *_if(
            film.thickness < _THIN * design.size,
            f"a radius of {design.size:g} m is {design.size / film.thickness:.0e} times the film's "
            f"{1e3 * film.thickness:g} mm: lengths are in metres, or write '1500 mm'",
        ),
        *_if(
            0 < _THICK * design.size < film.thickness,
            f"film of {1e3 * film.thickness:g} mm is 1/{design.size / film.thickness:.0f} of the radius of "
            f"{design.size:g} m, thick for a film: lengths are in metres, or write '0.05 mm'",
        ),
    ]


def of_pressures(design: Design, pressures: Iterable[float | None]) -> list[str]:
    """A sentence on film stressed beyond its law, by the isotensoid's p R0/2 along the meridian."""
    film, highest = design.film, max((p for p in pressures if p), default=0.0)
    if design.is_pumpkin:  # the tendons bear that pull
        return []
    stress = highest * design.size / 2 / film.thickness
    return _if(
        stress > _STRAIN * film.modulus,
        f"at {pascals(highest)} the film is stressed to about {stress / 1e6:.0f} MPa and strained by about "
        f"{100 * stress / film.modulus:.0f} %: a linear law does not hold there, and most films break before",
    )


def of_balance(residual: float) -> list[str]:
    """A sentence on an ideal state that is none, by its unbalanced forces over the load's."""
    return _if(
        residual > _UNBALANCED,
        f"the shape as designed is not in equilibrium ({residual:.2g} of the load is unbalanced), so its "
        "modes mean little; use --state inflated, and check that no part is missing",
    )


def of_built_in(design: Design) -> list[str]:
    """A sentence on a study of the built-in stress, of a design that would be without."""
    film = design.film
    return _if(
        film.law == "fixed-wrinkles" and not film.prestress,
        "film.prestress = false has no effect here: the ideal shape always has its stress built in; use "
        "--state inflated for film without it",
    )


def of_distortion(design: Design) -> list[str]:
    """A sentence on film that is distorted far and can neither shear nor fold."""
    return _if(
        design.film.law == "fixed-wrinkles",
        "film with fixed wrinkles has no shear stiffness and does not fold: its reaction force is 10 to 30 "
        "times smaller than that of real film for a tip pushed sideways, and whether it returns says nothing "
        "of real film; use --film tension-field or imp",
    )


def of_ledger(error: float) -> list[str]:
    """A sentence on energy that is not accounted for, as a share of the largest part."""
    return _if(
        error > _OPEN,
        f"{100 * error:.0f} % of the energy is not accounted for, so do not rely on this run; try --film "
        "tension-field, more --steps or a finer mesh",
    )


def _if(true: bool, sentence: str) -> list[str]:
    return [sentence] if true else []
