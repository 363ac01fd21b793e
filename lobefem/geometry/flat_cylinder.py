"""The flat-sided cylinder from which a lobe is formed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lobefem import checks
from lobefem.typing import Array

__all__ = ["Cylinder"]


@dataclass(frozen=True)
class Cylinder:
    """A flat-sided cylinder, with the same questions answered as by `Isotensoid`.

    Args:
        edge_radius: radius [m].
        height: length from rim to rim [m].

    Raises:
        InputError: a number that is not positive and finite.
    """

    edge_radius: float = 2.0
    height: float = 4.2

    def __post_init__(self) -> None:
        checks.positive("the cylinder's radius", self.edge_radius, "m")
        checks.positive("the cylinder's length", self.height, "m")

    @property
    def half_height(self) -> float:
        """Half the length [m]."""
        return 0.5 * self.height

    @property
    def arc_length(self) -> float:
        """Length of the straight meridian [m]."""
        return self.height

    @property
    def area(self) -> float:
        """Area of the film [m^2]."""
        return 2.0 * math.pi * self.edge_radius * self.height

    @property
    def volume(self) -> float:
        """Volume between the rims [m^3]."""
        return math.pi * self.edge_radius**2 * self.height

    def radius(self, s: npt.ArrayLike) -> Array:
        """Distance from the axis [m] at the arc length `s` from mid-height [m], any shape."""
        return np.full(np.shape(s), float(self.edge_radius))

    def z(self, s: npt.ArrayLike) -> Array:
        """Height above mid-height [m] at the arc length `s` [m]: `s` itself."""
        return np.array(s, dtype=np.float64)

    def slope(self, s: npt.ArrayLike) -> tuple[Array, Array]:
        """Unit tangent (dR/ds, dz/ds) = (0, 1)."""
        return np.zeros(np.shape(s)), np.ones(np.shape(s))

    def stations(self, count: int) -> Array:
        """Arc lengths [m], shape (count + 1,), of equal steps from the bottom to the top rim."""
        return self.half_height * (2.0 * np.arange(count + 1) - count) / count
