"""Gas pressure, a follower load, in its two conventions, and the volume of the film.

- `film`: on the film only, residual -p v . n da (the paper's). Where plates move it has no potential.
- `closed`: on film and plates, potential -p V, V the enclosed volume; symmetric.

The pressure may rise along the axis, p(z) = p0 + b z, b = g (rho_air - rho_gas), z from the level at which p0
is given; the potential of `closed` is then -(p0 V + b W), W the integral of z over the enclosed volume.

With both rims held the two give the same film forces. `closed` needs a closed surface: a free edge
without a plate leaves the volume, and with it the load, dependent on the point from which places count, that
of the axis at the bottom rim (edges in symmetry planes through the axis are fine).

A `SealedGas` has no given pressure but a given mass at a given temperature; its potential is
-m R T ln V + p_a V, whose second derivative is that at its pressure and, of rank one, m R T/V^2 dV x dV.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, get_args

from lobefem import checks
from lobefem.errors import InputError
from lobefem.model.kinematics import Frame, area_vector
from lobefem.typing import Constant, Convention, Expr

import ufl

__all__ = [
    "LOADS",
    "GasPressure",
    "SealedGas",
    "film_moment_change",
    "film_volume",
    "film_volume_change",
    "pressure_work",
]

LOADS: tuple[str, ...] = get_args(Convention)


@dataclass(frozen=True)
class GasPressure:
    """Gas pressure, and the surfaces on which it acts.

    Args:
        convention: "film" or "closed".
        gradient: b, rise of the pressure per metre along the axis [Pa/m].
        level: height above the bottom rim at which the gas has the pressure of a state [m].

    Raises:
        InputError: another convention, or a number that is none.
    """

    convention: Convention = "closed"
    gradient: float = 0.0
    level: float = 0.0

    def __post_init__(self) -> None:
        checks.finite("the pressure's gradient", self.gradient, "Pa/m")
        checks.finite("the level of the gas pressure", self.level, "m")
        if self.convention not in LOADS:
            raise InputError(f"pressure load '{self.convention}' is unknown; use 'film' or 'closed'")


@dataclass(frozen=True)
class SealedGas:
    """Gas of a given mass at a given temperature: (p + p_a) V = m R T, Boyle's law.

    Args:
        amount: m R T [J].
        ambient: pressure p_a of the air around, from which p counts [Pa].

    Raises:
        InputError: no gas, or an ambient pressure below 0.
    """

    amount: float
    ambient: float = 0.0

    def __post_init__(self) -> None:
        checks.positive("the amount of sealed gas", self.amount, "J")
        if checks.finite("the ambient pressure", self.ambient, "Pa") < 0:
            raise InputError(f"the ambient pressure is {self.ambient} Pa; give one of 0 or more")

    @classmethod
    def of(cls, pressure: float, volume: float, ambient: float = 0.0) -> SealedGas:
        """The gas that has a pressure [Pa] above the ambient one in a volume [m^3]."""
        return cls((pressure + ambient) * volume, ambient)

    def pressure(self, volume: float) -> float:
        """The pressure p above the ambient one in a volume [Pa]; not a number in one that is none."""
        return self.amount / volume - self.ambient if volume > 0 else math.nan

    def work(self, volume: float, gain: float) -> float:
        """Work on the balloon, the ambient air's included, as a volume gains [J]; -inf where none is left."""
        if volume + gain <= 0:
            return -math.inf
        return self.amount * math.log1p(gain / volume) - self.ambient * gain

    def stiffness(self, volume: float) -> float:
        """-dp/dV [Pa/m^3]."""
        return self.amount / volume**2


def film_volume(x: Expr, frame: Frame) -> Any:
    """The undeformed film's part of the enclosed volume per area, X . n/3 [m]."""
    return ufl.dot(x, frame.n) / 3


def _area_change(u: Expr, frame: Frame) -> Any:
    """Current area vector less the reference normal, per reference area."""
    gradient = ufl.grad(u)
    g_m, g_h = ufl.dot(gradient, frame.m), ufl.dot(gradient, frame.h)
    return ufl.cross(g_m, frame.h) + ufl.cross(frame.m, g_h) + ufl.cross(g_m, g_h)


def film_moment_change(u: Expr, x: Expr, frame: Frame, axis: Expr, level: Constant) -> Any:
    """Change of the film's part of W per reference area, z^2/2 along the axis through its area [m^2].

    Args:
        u: displacement.
        x: reference position.
        frame: the reference frame.
        axis: unit vector, upwards.
        level: where z is zero, along the axis [m].
    """
    change = ufl.dot(_area_change(u, frame), axis)
    z, rise = ufl.dot(x, axis) - level, ufl.dot(u, axis)
    return (z * rise + rise**2 / 2) * (ufl.dot(frame.n, axis) + change) + z**2 / 2 * change


def film_volume_change(u: Expr, x: Expr, frame: Frame) -> Any:
    """Change of the film's part of the volume per reference area, (x . n da - X . n)/3 [m].

    Expanded in u: energies that a line search compares differ by 1e-10 of -p V, and the difference
    of two volumes would drown them in round-off.

    Args:
        u: displacement.
        x: reference position from a point on the axis.
        frame: the reference frame.
    """
    change = _area_change(u, frame)
    return (ufl.dot(u, frame.n + change) + ufl.dot(x, change)) / 3


def pressure_work(u: Expr, v: Expr, frame: Frame) -> Any:
    """Work of unit pressure on the film per reference area, v . n da [m]."""
    return ufl.dot(v, area_vector(u, frame))
