"""The isotensoid: closed-form shape, stress resultant and free-body forces of one lobe.

The surface of revolution whose meridian carries a constant tension and whose hoops carry none
under uniform pressure (the mylar balloon). With R the distance from the axis and s the arc length
from the equator (positive upwards)

    R = R0 cn(a | 1/2),   z = (R0 / sqrt 2) (2 E(am a) - a),   a = sqrt 2 s / R0,

(paper eqs. 1-3), so that dz/ds = cn^2 = (R / R0)^2 and dR/ds = -sqrt 2 sn dn. A lobe is this
surface cut off at |z| = truncation * R0. Everything here is NumPy: no mesh, no MPI.
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
from lobefem.geometry.elliptic import jacobi, quarter_period
from lobefem.geometry.meridian import Lobe
from lobefem.typing import Array

__all__ = ["MAX_TRUNCATION", "Isotensoid"]

_SQRT2 = math.sqrt(2.0)

_QUARTER = quarter_period(0.5)  # elliptic argument of the pole, 1.31103 * sqrt 2

MAX_TRUNCATION = 0.599  # the closed surface ends at z = 0.59907 R0, where the edge radius is 0


def _height(a: Array | float) -> Array:
    """Height z / R0 at the elliptic argument `a`."""
    return np.asarray((2.0 * jacobi(a, 0.5)[3] - a) / _SQRT2)


@dataclass(frozen=True)
class Isotensoid(Lobe):
    """One lobe: an isotensoid of equator radius R0 cut off at |z| = truncation * R0.

    Args:
        R0: equator radius [m].
        truncation: |z| / R0 at the cut, in (0, 0.599].

    Raises:
        InputError: a number that is not finite or outside its range.
    """

    R0: float
    truncation: float = 0.55

    def __post_init__(self) -> None:
        checks.positive("the equator radius R0", self.R0, "m")
        _require_truncation(self.truncation)

    @classmethod
    def from_edge_radius(cls, edge_radius: float = 2.0, truncation: float = 0.55) -> Isotensoid:
        """The lobe whose seams and rims have this radius [m] (defaults: the paper's design)."""
        checks.positive("the edge radius", edge_radius, "m")
        _require_truncation(truncation)
        return cls(edge_radius / cls(1.0, truncation).edge_radius, truncation)

    @cached_property
    def _edge(self) -> float:
        """Elliptic argument of the upper edge."""
        # z(a) is concave and below R0 a/sqrt 2, so Newton's steps from there rise to the root and never
        # pass it; scipy.optimize, which has root finders, takes a tenth of a second to import
        a, last = _SQRT2 * self.truncation, 0.0
        while a > last:
            last = a
            a += _SQRT2 * (self.truncation - float(_height(a))) / float(jacobi(a, 0.5)[1]) ** 2
        return last

    @cached_property
    def _edge_functions(self) -> tuple[float, float, float]:
        """sn, cn and dn at the upper edge."""
        sn, cn, dn, _ = jacobi(self._edge, 0.5)
        return float(sn), float(cn), float(dn)

    # --- the lobe as a whole ---------------------------------------------------------------

    @property
    def edge_radius(self) -> float:
        """Radius R_e of seams and rims [m]; 0.52507 R0 for truncation 0.55."""
        return self.R0 * self._edge_functions[1]

    @property
    def half_height(self) -> float:
        """Height from the equator to an edge [m], truncation * R0."""
        return self.truncation * self.R0

    @property
    def edge_angle(self) -> float:
        """Angle between meridian and horizontal plane at an edge [rad]; 16.004 degrees."""
        return math.asin(self._edge_functions[1] ** 2)

    @property
    def arc_length(self) -> float:
        """Length of the truncated meridian from edge to edge [m]; 1.56367 R0."""
        return _SQRT2 * self.R0 * self._edge

    @property
    def volume(self) -> float:
        """Volume between the two edge planes [m^3]; 2.69456 R0^3.

        pi * integral of R^2 dz = (pi R0^3 / sqrt 2) * integral of cn^4 da, and for m = 1/2 the
        recurrence of the integrals of cn^n gives (a + 2 sn cn dn) / 3 for n = 4.
        """
        sn, cn, dn = self._edge_functions
        return _SQRT2 * math.pi * self.R0**3 * (self._edge + 2.0 * sn * cn * dn) / 3.0

    @property
    def area(self) -> float:
        """Area of the film [m^2]: 2 pi * integral of R ds = 4 pi R0^2 arcsin(sn / sqrt 2)."""
        return 4.0 * math.pi * self.R0**2 * math.asin(self._edge_functions[0] / _SQRT2)

    # --- along the meridian ----------------------------------------------------------------

    def radius(self, s: npt.ArrayLike) -> Array:
        """Distance from the axis [m] at the arc length `s` from the equator [m], any shape."""
        return self.R0 * jacobi(self._argument(s), 0.5)[1]

    def z(self, s: npt.ArrayLike) -> Array:
        """Height above the equator [m] at the arc length `s` [m], any shape."""
        return self.R0 * _height(self._argument(s))

    def slope(self, s: npt.ArrayLike) -> tuple[Array, Array]:
        """Unit tangent (dR/ds, dz/ds) = (-sqrt 2 sn dn, cn^2) at the arc length `s` [m]."""
        sn, cn, dn, _ = jacobi(self._argument(s), 0.5)
        return -_SQRT2 * sn * dn, cn**2

    # --- stress and free bodies ------------------------------------------------------------

    @property
    def meridional_tension(self) -> float:
        """R N_phi/p = R0^2/2 [m^2] (paper eq. 4)."""
        return self.R0**2 / 2.0

    @property
    def axial_excess(self) -> float:
        """None: an isotensoid pulls on its plates as the gas pushes them."""
        return 0.0

    def seam_tension(self, pressure: float) -> float:
        """Tension [N] of a seam's hoop, T = 2 N_phi cos(phi) R_e = p R0^2 cos(phi).

        Each of the two lobes pulls it outwards with N_phi cos(phi) per length.
        """
        checks.finite("the pressure", pressure, "Pa")
        sn, _, dn = self._edge_functions
        return pressure * self.R0**2 * _SQRT2 * sn * dn

    def plate_force(self, pressure: float) -> float:
        """Axial pull [N] of the film on an end plate, 2 pi R_e N_phi sin(phi) = p pi R_e^2."""
        checks.finite("the pressure", pressure, "Pa")
        return pressure * math.pi * self.edge_radius**2

    def _argument(self, s: npt.ArrayLike) -> Array:
        """Elliptic argument sqrt 2 s / R0, refused outside the lobe."""
        a: Any = _SQRT2 * np.asarray(s, dtype=np.float64) / self.R0
        if not np.all(np.abs(a) <= self._edge * (1.0 + 1e-9)):  # NaN fails too
            raise InputError(
                f"an arc length lies outside the lobe; give -{0.5 * self.arc_length:.6g} m "
                f"<= s <= {0.5 * self.arc_length:.6g} m from the equator"
            )
        return a


def _require_truncation(value: float) -> None:
    checks.finite("the truncation |z|/R0", value, "")
    if not 0.0 < value <= MAX_TRUNCATION:
        raise InputError(
            f"the truncation |z|/R0 is {value!r}; give a number in (0, {MAX_TRUNCATION}] "
            "(0.55 is the paper's)"
        )
