"""Meridians from fitting to fitting: what the tendon curve of a pumpkin balloon can tell.

The curve runs from the bottom fitting (s = 0) to the top one (s = length); z is measured along the axis
from the lower fitting. NumPy only.
"""

from __future__ import annotations

from typing import Protocol

import numpy.typing as npt

__all__ = ["TendonCurve"]

from lobefem.typing import Array


class TendonCurve(Protocol):
    """A curve r(s), z(s) by its arc length s, from the bottom fitting to the top one."""

    @property
    def arc_length(self) -> float:
        """Length from fitting to fitting [m]."""

    @property
    def equator(self) -> float:
        """Arc length of the largest radius [m]."""

    @property
    def height(self) -> float:
        """Height from fitting to fitting [m]."""

    @property
    def fitting_radii(self) -> tuple[float, float]:
        """Radii of the bottom and the top fitting [m]."""

    @property
    def R0(self) -> float:
        """Largest radius [m]."""

    @property
    def volume(self) -> float:
        """Volume of the surface of revolution between the fittings [m^3]."""

    @property
    def area(self) -> float:
        """Area of the surface of revolution [m^2]."""

    def radius(self, s: npt.ArrayLike) -> Array:
        """Distance from the axis [m] at the arc length `s` [m], any shape."""

    def z(self, s: npt.ArrayLike) -> Array:
        """Height above the bottom fitting [m] at the arc length `s` [m], any shape."""

    def slope(self, s: npt.ArrayLike) -> tuple[Array, Array]:
        """Unit tangent (dr/ds, dz/ds) at the arc length `s` [m]."""

    def curvature(self, s: npt.ArrayLike) -> Array:
        """Curvature [1/m] at the arc length `s` [m], positive where the curve is convex."""
