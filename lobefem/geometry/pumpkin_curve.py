"""The isotensoid from fitting to fitting: the tendon curve of a pumpkin balloon under uniform pressure.

Its tendons carry all of the meridional load and the same tension everywhere, T = p pi R0^2/N.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from lobefem import checks
from lobefem.errors import InputError
from lobefem.geometry.elliptic import jacobi

__all__ = ["PumpkinCurve", "fittings"]

from lobefem.typing import Array

_SQRT2 = math.sqrt(2.0)


def fittings(radius: Any) -> tuple[float, float]:
    """Radii of the bottom and the top fitting [m], from one for both or two.

    Raises:
        InputError: they are not one or two positive numbers.
    """
    both = radius if isinstance(radius, (tuple, list, np.ndarray)) else (radius, radius)
    if len(both) != 2:
        raise InputError(f"the fitting radius is {radius!r}; give one number or two, (bottom, top) [m]")
    bottom, top = (checks.positive("the fitting radius", value, "m") for value in both)
    return bottom, top


@dataclass(frozen=True)
class PumpkinCurve:
    """A `lobefem.geometry.tendon_curve.Meridian`: sin phi = (r/R0)^2 from one fitting to the other.

    Args:
        R0: equator radius [m].
        fitting_radii: radii of the bottom and the top fitting [m].

    Raises:
        InputError: a number that is not positive, or a fitting that is not smaller than the equator.
    """

    R0: float
    fitting_radii: tuple[float, float]

    def __post_init__(self) -> None:
        checks.positive("the equator radius", self.R0, "m")
        object.__setattr__(self, "fitting_radii", fittings(self.fitting_radii))
        largest = max(self.fitting_radii)
        if largest >= self.R0:
            raise InputError(
                f"the fitting radius {largest:g} m is not smaller than the equator radius {self.R0:g} m; "
                "give smaller fittings"
            )

    @classmethod
    def of_tendon_length(cls, length: float, fitting_radii: Any) -> PumpkinCurve:
        """The curve whose arc from fitting to fitting has this length [m].

        Raises:
            InputError: also a tendon too short for its fittings.
        """
        return cls._sized("the tendon length", length, "m", 1.0 / 2.6220576, 1, "arc_length", fitting_radii)

    @classmethod
    def of_volume(cls, volume: float, fitting_radii: Any) -> PumpkinCurve:
        """The curve whose surface of revolution encloses this volume [m^3] between the fittings.

        Raises:
            InputError: also a volume too small for the fittings.
        """
        return cls._sized("the volume", volume, "m^3", 1.0 / 2.7458122, 3, "volume", fitting_radii)

    @classmethod
    def _sized(
        cls, name: str, value: float, unit: str, share: float, power: int, what: str, fitting_radii: Any
    ) -> PumpkinCurve:
        """The curve with a given measure, which grows with the equator radius."""
        from scipy.optimize import brentq  # slow to import

        checks.positive(name, value, unit)
        radii = fittings(fitting_radii)
        guess = (share * value) ** (1.0 / power)  # without fittings; with them the equator is larger
        low, high = max(radii) * (1 + 1e-12), 2.0 * (max(radii) + guess)

        def excess(R0: float) -> float:
            return float(getattr(cls(R0, radii), what)) - value

        if excess(low) >= 0.0:
            raise InputError(
                f"{name} {value:g} {unit} is too small for fittings of {radii} m; give more of it"
            )
        return cls(float(brentq(excess, low, high, xtol=1e-15 * high, rtol=1e-15)), radii)

    # --- the curve as a whole --------------------------------------------------------------

    @cached_property
    def _ends(self) -> tuple[float, float]:
        """Elliptic arguments from the equator down to the bottom fitting and up to the top one."""
        from scipy.special import ellipkinc

        bottom, top = (float(ellipkinc(math.acos(r / self.R0), 0.5)) for r in self.fitting_radii)
        return bottom, top

    @property
    def arc_length(self) -> float:
        """Length from fitting to fitting [m]; 2.62206 R0 from pole to pole."""
        return self.R0 * sum(self._ends) / _SQRT2

    @property
    def equator(self) -> float:
        """Arc length of the largest radius [m]."""
        return self.R0 * self._ends[0] / _SQRT2

    @property
    def height(self) -> float:
        """Height from fitting to fitting [m]; 1.19814 R0 from pole to pole."""
        return self.R0 * sum(_height(a) for a in self._ends)

    @property
    def volume(self) -> float:
        """Volume of the surface of revolution between the fittings [m^3]; 2.74581 R0^3 from pole to pole."""
        total = 0.0
        for a in self._ends:
            sn, cn, dn, _ = jacobi(a, 0.5)
            total += a + 2.0 * float(sn * cn * dn)
        return math.pi * self.R0**3 * total / (3.0 * _SQRT2)

    @property
    def area(self) -> float:
        """Area of the surface of revolution [m^2]; pi^2 R0^2 from pole to pole."""
        return (
            2.0 * math.pi * self.R0**2 * sum(math.asin(float(jacobi(a, 0.5)[0]) / _SQRT2) for a in self._ends)
        )

    def tension(self, pressure: float, tendons: int) -> float:
        """Tension of each tendon [N], constant along it, p pi R0^2/N."""
        checks.finite("the pressure", pressure, "Pa")
        return pressure * math.pi * self.R0**2 / checks.integer("the number of tendons", tendons, 1)

    # --- along the curve -------------------------------------------------------------------

    def radius(self, s: npt.ArrayLike) -> Array:
        """Distance from the axis [m] at the arc length `s` from the bottom fitting [m], any shape."""
        return self.R0 * jacobi(self._argument(s), 0.5)[1]

    def z(self, s: npt.ArrayLike) -> Array:
        """Height above the bottom fitting [m] at the arc length `s` [m], any shape."""
        a = self._argument(s)
        return self.R0 * (_height(self._ends[0]) + (2.0 * jacobi(a, 0.5)[3] - a) / _SQRT2)

    def slope(self, s: npt.ArrayLike) -> tuple[Array, Array]:
        """Unit tangent (dr/ds, dz/ds) at the arc length `s` [m]."""
        sn, cn, dn, _ = jacobi(self._argument(s), 0.5)
        return -_SQRT2 * sn * dn, cn**2

    def curvature(self, s: npt.ArrayLike) -> Array:
        """Curvature 2 r/R0^2 [1/m] at the arc length `s` [m]."""
        return np.asarray(2.0 * self.radius(s) / self.R0**2)

    def _argument(self, s: npt.ArrayLike) -> Array:
        """Elliptic argument from the equator, refused beyond the fittings."""
        s = np.asarray(s, dtype=np.float64)
        if not np.all(np.abs(s / self.arc_length - 0.5) <= 0.5 + 1e-9):  # NaN fails too
            raise InputError(
                f"an arc length lies beyond the fittings; give 0 <= s <= {self.arc_length:.6g} m"
            )
        return _SQRT2 * s / self.R0 - self._ends[0]


def _height(a: float) -> float:
    """Height over R0 from the equator to the elliptic argument `a`."""
    return (2.0 * float(jacobi(a, 0.5)[3]) - a) / _SQRT2
