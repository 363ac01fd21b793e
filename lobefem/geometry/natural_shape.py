"""The lobe that a cylinder of fixed-direction film takes up under pressure, in closed form.

All surfaces of revolution that carry a uniform pressure p without hoop stress: with the tension c p of
each meridian per unit of azimuth (`lobefem.geometry.meridian`) and phi the angle between meridian and
horizontal plane, d(sin phi)/dR = R/c. With s the arc length from the equator, l = sqrt c and m > 0,

    R = R0 cn(s/l | m),   z = l (2 E(am(s/l)) - s/l),   R0 = 2 l sqrt m,   dz/ds = 2 dn^2 - 1.

m = 1/2 is the isotensoid (paper eqs. 1-3), where the film pulls on a plate as the gas pushes it;
m -> 0 is the cylinder; beyond 1/2 the film bulges on until it is horizontal at its edges.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.special import ellipeinc, ellipj, ellipk, ellipkinc

from lobefem import checks
from lobefem.errors import InputError
from lobefem.geometry.meridian import Lobe
from lobefem.typing import Array

__all__ = ["FORMING_PRESSURE", "NaturalShape", "isotensoid_stiffness"]

FORMING_PRESSURE = 37.5  # [Pa], at which the paper's cylinder becomes an isotensoid (fig. 9c)

_LEAST = 1e-9  # m of a film that hardly bulges


def _elliptic(u: Any, m: float) -> tuple[Any, Any, Any, Any]:
    """sn, cn, dn and E(am u) for any m > 0; beyond 1 by Jacobi's real transformation."""
    if m <= 1.0:
        sn, cn, dn, amplitude = ellipj(u, m)
        return sn, cn, dn, ellipeinc(amplitude, m)
    k = math.sqrt(m)
    sn, cn, dn, amplitude = ellipj(k * u, 1.0 / m)
    return sn / k, dn, cn, k * ellipeinc(amplitude, 1.0 / m) - (m - 1.0) * u


def _last_argument(m: float) -> float:
    """Elliptic argument at which the meridian meets the axis or, for m > 1/2, turns horizontal."""
    if m <= 0.5:
        return float(ellipk(m))
    if m <= 1.0:
        return float(ellipkinc(math.asin(math.sqrt(0.5 / m)), m))
    return float(ellipkinc(math.pi / 4.0, 1.0 / m)) / math.sqrt(m)


@dataclass(frozen=True)
class NaturalShape(Lobe):
    """One lobe without hoop stress.

    Args:
        R0: equator radius [m].
        m: parameter of the elliptic functions; 1/2 is the isotensoid.
        edge: elliptic argument s/l of the upper edge.

    Raises:
        InputError: a number that is not positive, or an edge beyond the meridian's end.
    """

    R0: float
    m: float
    edge: float

    def __post_init__(self) -> None:
        checks.positive("the equator radius R0", self.R0, "m")
        checks.positive("the parameter m", self.m, "")
        checks.positive("the edge's elliptic argument", self.edge, "")
        last = _last_argument(self.m)
        if self.edge >= last:
            raise InputError(
                f"the edge's elliptic argument is {self.edge!r}; with m = {self.m:.6g} give less than "
                f"{last:.6g}"
            )

    @classmethod
    def between_rims(cls, radius: float, length: float, m: float = 0.5) -> NaturalShape:
        """The lobe through two equal rims.

        Args:
            radius: of the rims [m].
            length: distance between them [m].
            m: parameter of the elliptic functions.

        Raises:
            InputError: impossible numbers, or an m at which the film bulges over its rims.
        """
        checks.positive("the radius", radius, "m")
        checks.positive("the length", length, "m")
        checks.positive("the parameter m", m, "")
        last = _last_argument(m)
        if _height_excess(last, radius, length, m) >= 0.0:
            raise InputError(
                f"with m = {m:.6g} the film bulges over rims of radius {radius:g} m that are {length:g} m "
                "apart; give a smaller m"
            )
        u = _root(lambda u: _height_excess(u, radius, length, m), 0.0, last)
        return cls(radius / float(_elliptic(u, m)[1]), m, u)

    @classmethod
    def inflated(cls, radius: float, length: float, Et: float, pressure: float) -> NaturalShape:
        """The lobe that a cylinder of fixed-direction film becomes between fixed rims: m solved for.

        The fibres have the energy E t e^2/2 per reference area in the Green-Lagrange strain
        e = (a^2 - 1)/2 of their stretch a, so the force of the meridians per unit of azimuth, whose
        reference width is the cylinder's radius r, is r a E t e. It is constant along the meridian and
        equal to c p: the stretch is uniform, a = arc length/length, and

            r E t a (a^2 - 1)/2 = c p.

        Args:
            radius: of the cylinder and its rims [m].
            length: of the cylinder [m].
            Et: membrane stiffness of the film, E times thickness [N/m].
            pressure: gas pressure [Pa].

        Raises:
            InputError: impossible numbers, or a film that would bulge over its rims.
        """
        checks.positive("the radius", radius, "m")
        checks.positive("the length", length, "m")
        checks.positive("the film's E t", Et, "N/m")
        checks.positive("the forming pressure", pressure, "Pa")

        def imbalance(log_m: float) -> float:
            lobe = cls.between_rims(radius, length, math.exp(log_m))
            return fibre_tension(radius, lobe.arc_length / length, Et) - pressure * lobe.meridional_tension

        low, high = math.log(_LEAST), math.log(_most(radius, length))
        if imbalance(low) >= 0.0:
            raise InputError(
                f"{pressure:g} Pa hardly bulge a film of E t = {Et:g} N/m; try more pressure or a softer film"
            )
        if imbalance(high) <= 0.0:
            raise InputError(
                f"at {pressure:g} Pa a film of E t = {Et:g} N/m bulges over its rims; try less pressure or a "
                "stiffer film"
            )
        return cls.between_rims(radius, length, math.exp(_root(imbalance, low, high, xtol=1e-14)))

    @cached_property
    def _scale(self) -> float:
        """Arc length per elliptic argument, l = R0/(2 sqrt m) [m]."""
        return self.R0 / (2.0 * math.sqrt(self.m))

    @cached_property
    def _edge_functions(self) -> tuple[float, float, float, float]:
        """sn, cn, dn and E at the upper edge."""
        sn, cn, dn, E = _elliptic(self.edge, self.m)
        return float(sn), float(cn), float(dn), float(E)

    # --- the lobe as a whole ---------------------------------------------------------------

    @property
    def edge_radius(self) -> float:
        """Radius of seams and rims [m]."""
        return self.R0 * self._edge_functions[1]

    @property
    def half_height(self) -> float:
        """Height from the equator to an edge [m]."""
        return self._scale * (2.0 * self._edge_functions[3] - self.edge)

    @property
    def arc_length(self) -> float:
        """Length of the meridian from edge to edge [m]."""
        return 2.0 * self._scale * self.edge

    @property
    def area(self) -> float:
        """Area of the film [m^2]: 2 pi * integral of R ds = 2 pi R0^2 arcsin(sqrt m sn)/m."""
        return 2.0 * math.pi * self.R0**2 * math.asin(math.sqrt(self.m) * self._edge_functions[0]) / self.m

    @property
    def volume(self) -> float:
        """Volume between the edge planes [m^3], pi * integral of R^2 dz.

        = 2 pi R0^2 l * integral of cn^2 (2 dn^2 - 1) du, by the recurrence of the integrals of cn^n.
        """
        m, u = self.m, self.edge
        sn, cn, dn, E = self._edge_functions
        square = (E - (1.0 - m) * u) / m  # integral of cn^2
        integral = ((2.0 * m - 1.0) * square + 2.0 * (1.0 - m) * u + 2.0 * sn * cn * dn) / 3.0
        return 2.0 * math.pi * self.R0**2 * self._scale * integral

    # --- along the meridian ----------------------------------------------------------------

    def radius(self, s: npt.ArrayLike) -> Array:
        """Distance from the axis [m] at the arc length `s` from the equator [m], any shape."""
        return self.R0 * _elliptic(self._argument(s), self.m)[1]

    def z(self, s: npt.ArrayLike) -> Array:
        """Height above the equator [m] at the arc length `s` [m], any shape."""
        u = self._argument(s)
        return self._scale * np.asarray(2.0 * _elliptic(u, self.m)[3] - u)

    def slope(self, s: npt.ArrayLike) -> tuple[Array, Array]:
        """Unit tangent (dR/ds, dz/ds) = (-2 sqrt m sn dn, 2 dn^2 - 1) at the arc length `s` [m]."""
        sn, _, dn, _ = _elliptic(self._argument(s), self.m)
        return -2.0 * math.sqrt(self.m) * sn * dn, 2.0 * dn**2 - 1.0

    # --- stress and free bodies ------------------------------------------------------------

    @property
    def meridional_tension(self) -> float:
        """R N_phi/p = c = l^2 = R0^2/(4 m) [m^2]."""
        return self.R0**2 / (4.0 * self.m)

    @property
    def axial_excess(self) -> float:
        """(2 pi R_e N_phi sin phi)/p - pi R_e^2 = 2 pi c (1 - 2 m) [m^2], 0 for the isotensoid."""
        return 2.0 * math.pi * self.meridional_tension * (1.0 - 2.0 * self.m)

    def seam_tension(self, pressure: float) -> float:
        """Tension [N] of a seam's hoop, T = 2 N_phi cos(phi) R_e = 2 c p |dR/ds| at the edge."""
        checks.finite("the pressure", pressure, "Pa")
        sn, _, dn, _ = self._edge_functions
        return pressure * self.meridional_tension * 4.0 * math.sqrt(self.m) * sn * dn

    def _argument(self, s: npt.ArrayLike) -> Array:
        """Elliptic argument s/l, refused outside the lobe."""
        u: Any = np.asarray(s, dtype=np.float64) / self._scale
        if not np.all(np.abs(u) <= self.edge * (1.0 + 1e-9)):  # NaN fails too
            raise InputError(
                f"an arc length lies outside the lobe; give -{0.5 * self.arc_length:.6g} m "
                f"<= s <= {0.5 * self.arc_length:.6g} m from the equator"
            )
        return u


def fibre_tension(radius: float, stretch: float, Et: float) -> float:
    """Force of the stretched meridians per unit of azimuth, r a E t (a^2 - 1)/2 [N]."""
    return radius * stretch * Et * (stretch**2 - 1.0) / 2.0


def isotensoid_stiffness(radius: float, length: float, pressure: float = FORMING_PRESSURE) -> float:
    """E t [N/m] of the film whose cylinder a pressure forms into an isotensoid between its rims.

    With a the isotensoid's arc over the cylinder's length, c = R0^2/2 and the balance of
    `NaturalShape.inflated`,

        E t = p R0^2/(r a (a^2 - 1)):

    187.5 N/m for the paper's design at 37.5 Pa (the paper gives none).

    Args:
        radius: r of the cylinder and its rims [m].
        length: of the cylinder [m].
        pressure: p [Pa].

    Raises:
        InputError: a number that is not positive.
    """
    checks.positive("the forming pressure", pressure, "Pa")
    lobe = NaturalShape.between_rims(radius, length)
    return pressure * lobe.meridional_tension / fibre_tension(radius, lobe.arc_length / length, 1.0)


def _height_excess(u: float, radius: float, length: float, m: float) -> float:
    """Proportional to length/height - 1 of the lobe whose rims lie at the elliptic argument u."""
    _, cn, _, E = _elliptic(u, m)
    return math.sqrt(m) * float(cn) * length - radius * float(2.0 * E - u)


def _most(radius: float, length: float) -> float:
    """The m at which the film between two rims is horizontal at its edges."""

    def excess(m: float) -> float:
        return _height_excess(_last_argument(m), radius, length, m)

    high = 1.0
    while excess(high) < 0.0:
        high *= 2.0
    # a hair below, where the film still rises at its edges
    return (1.0 - 1e-9) * _root(excess, 0.5, high)


def _root(function: Callable[[float], float], low: float, high: float, xtol: float = 1e-15) -> float:
    """The root of a function between two arguments where its signs differ."""
    from scipy.optimize import brentq  # slow to import, and most lobes are not formed ones

    return float(brentq(function, low, high, xtol=xtol, rtol=1e-15))
