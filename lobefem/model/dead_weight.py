"""Specification of the dead weight of film and cables."""

from __future__ import annotations

from dataclasses import dataclass

from lobefem import checks
from lobefem.errors import InputError

__all__ = ["DeadWeight"]


@dataclass(frozen=True)
class DeadWeight:
    """Weight of film and cables, against the direction of the axis.

    Args:
        film: per area of one layer of unstressed film [N/m^2].
        cables: per reference length of every cable [N/m].

    Raises:
        InputError: a weight that is negative or no number.
    """

    film: float = 0.0
    cables: float = 0.0

    def __post_init__(self) -> None:
        for name, weight, unit in (("film", self.film, "N/m^2"), ("cables", self.cables, "N/m")):
            if checks.finite(f"the weight of the {name}", weight, unit) < 0:
                raise InputError(f"the weight of the {name} is {weight} {unit}; give 0 or more")
