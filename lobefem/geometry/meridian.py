"""`Lobe`: the meridian of a surface that carries gas pressure by meridional tension alone.

Without hoop stress the film's equilibrium along the meridian reads d(R N_phi)/ds = 0: each meridian
carries a constant tension c p per unit of azimuth, N_phi = c p/R, and normal to the film its curvature
is R/c. NumPy only: no mesh, no MPI.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
import numpy.typing as npt

from lobefem import checks
from lobefem.errors import InputError
from lobefem.typing import Array

__all__ = ["Lobe"]


class Lobe(ABC):
    """A surface of revolution, symmetric about its mid-height, s the arc length from there [m]."""

    @property
    @abstractmethod
    def edge_radius(self) -> float:
        """Radius R_e of seams and rims [m]."""

    @property
    @abstractmethod
    def half_height(self) -> float:
        """Height from the equator to an edge [m]."""

    @property
    def height(self) -> float:
        """Height from edge to edge [m]."""
        return 2.0 * self.half_height

    @property
    @abstractmethod
    def arc_length(self) -> float:
        """Length of the meridian from edge to edge [m]."""

    @property
    @abstractmethod
    def area(self) -> float:
        """Area of the film [m^2]."""

    @property
    @abstractmethod
    def volume(self) -> float:
        """Volume between the two edge planes [m^3]."""

    # --- along the meridian ----------------------------------------------------------------

    @abstractmethod
    def radius(self, s: npt.ArrayLike) -> Array:
        """Distance from the axis [m] at the arc length `s` from the equator [m], any shape."""

    @abstractmethod
    def z(self, s: npt.ArrayLike) -> Array:
        """Height above the equator [m] at the arc length `s` [m], any shape."""

    @abstractmethod
    def slope(self, s: npt.ArrayLike) -> tuple[Array, Array]:
        """Unit tangent (dR/ds, dz/ds) at the arc length `s` [m]."""

    def angle(self, s: npt.ArrayLike) -> Array:
        """Angle phi between meridian and horizontal plane [rad], sin phi = dz/ds.

        Unsigned: pi/2 at the equator, falling towards both edges. From the two components of the
        tangent, because arcsin alone loses half the digits at the equator.
        """
        radial, axial = self.slope(s)
        return np.arctan2(axial, np.abs(radial))

    def stations(self, count: int) -> Array:
        """Arc lengths [m], shape (count + 1,), of equal steps from the bottom to the top edge.

        Equal steps of arc length are equal steps of the elliptic argument.
        """
        count = checks.integer("the number of steps along the meridian", count, 1)
        half = 0.5 * self.arc_length
        # symmetric by construction, which linspace is not to the last bit
        return half * (2.0 * np.arange(count + 1) - count) / count

    # --- stress and free bodies ------------------------------------------------------------

    @property
    @abstractmethod
    def meridional_tension(self) -> float:
        """Tension of the meridian per unit of azimuth and pascal, c = R N_phi/p [m^2]."""

    @property
    @abstractmethod
    def axial_excess(self) -> float:
        """Axial pull on an end plate beyond the gas's push p pi R_e^2, per pascal [m^2]."""

    @abstractmethod
    def seam_tension(self, pressure: float) -> float:
        """Tension [N] of a seam's hoop, T = 2 N_phi cos(phi) R_e."""

    def meridional_resultant(self, pressure: float, radius: npt.ArrayLike) -> Array:
        """N_phi = c p/R [N/m], with no hoop stress; p R0^2/(2 R) for the isotensoid (paper eq. 4).

        Args:
            pressure: gas pressure p [Pa], of either sign.
            radius: distance R from the axis [m], any shape, positive.
        """
        checks.finite("the pressure", pressure, "Pa")
        R: Array = np.asarray(radius, dtype=np.float64)
        if not np.all(np.isfinite(R) & (R > 0.0)):
            raise InputError("a radius is not a positive number of metres; give R > 0")
        return np.asarray(pressure * self.meridional_tension / R)
