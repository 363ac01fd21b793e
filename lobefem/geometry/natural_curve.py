"""The natural shape of a balloon: tendons alone carry its weight, its payload and hydrostatic pressure.

With the angle theta of the tangent from the vertical and T the tension of all N tendons together,

    r' = sin theta,  z' = cos theta,  T' = (2 pi r w_f + N w_t) cos theta,
    T theta' = -2 pi r (p0 + b z + w_f sin theta) - N w_t sin theta,

from T cos theta = F + W_b + p0 pi r_b^2 at the bottom fitting to T cos theta = p pi r_t^2 - W_t at the top
one. Solved by shooting with SciPy.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from lobefem import checks
from lobefem.errors import InputError, SolveError

__all__ = ["NaturalCurve"]

from lobefem.typing import Array

_RTOL = 1e-11
_STEEPEST = 30.0  # log of tension over load at the bottom, of a curve that is horizontal there


@dataclass(frozen=True, kw_only=True)
class NaturalCurve:
    """A `lobefem.geometry.tendon_curve.Meridian`, its size from the balance of lift and load.

    Args:
        payload: F at the bottom fitting [N].
        gradient: b = g (rho_air - rho_gas), the growth of pressure with height [N/m^3].
        pressure: p0 at the bottom fitting [Pa].
        film_weight: w_f per area [N/m^2].
        tendon_weight: N w_t of all tendons together, per length [N/m].
        cap_weight: of further layers of film around the top, per area [N/m^2].
        cap_length: how far these reach from the top fitting along the curve [m].
        fitting_weights: W_b and W_t of the bottom and the top fitting [N].
        fitting_radii: r_b and r_t [m]; 0 for points.

    Raises:
        InputError: a number out of its range.
        SolveError: no curve carries these loads.
    """

    payload: float
    gradient: float
    pressure: float = 0.0
    film_weight: float = 0.0
    tendon_weight: float = 0.0
    cap_weight: float = 0.0
    cap_length: float = 0.0
    fitting_weights: tuple[float, float] = (0.0, 0.0)
    fitting_radii: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        checks.positive("the pressure gradient", self.gradient, "N/m^3")
        checks.positive("the payload", self.payload, "N")
        checks.numbers("the fitting weights", self.fitting_weights, "N", 2)
        checks.numbers("the fitting radii", self.fitting_radii, "m", 2)
        for name, value, unit in (
            ("the pressure at the bottom", self.pressure, "Pa"),
            ("the film's weight", self.film_weight, "N/m^2"),
            ("the tendons' weight", self.tendon_weight, "N/m"),
            ("the cap's weight", self.cap_weight, "N/m^2"),
            ("the cap's length", self.cap_length, "m"),
            *(("a fitting's weight", w, "N") for w in self.fitting_weights),
            *(("a fitting's radius", r, "m") for r in self.fitting_radii),
        ):
            if checks.finite(name, value, unit) < 0.0:
                raise InputError(f"{name} is {value}; give zero or more [{unit}]")

    # --- shooting, with lengths over `_length` and forces over `_force` -----------------------

    @cached_property
    def _force(self) -> float:
        """Load on the bottom end of the tendons [N]."""
        r = self.fitting_radii[0]
        return self.payload + self.fitting_weights[0] + self.pressure * math.pi * r**2

    @cached_property
    def _length(self) -> float:
        """Edge of the cube whose lift bears that load [m]."""
        return float((self._force / self.gradient) ** (1.0 / 3.0))

    def _shoot(self, tension: float, cap: float, dense: bool = False) -> tuple[float, Any]:
        """The closing error at the top, positive for a curve that closes too early, and the solution.

        Args:
            tension: at the bottom, over the load there.
            cap: arc length, over `_length`, from which the film has its further layers.
            dense: make the solution one that can be asked anywhere.
        """
        from scipy.integrate import solve_ivp  # slow to import

        L, F = self._length, self._force
        p0, b = self.pressure * L**2 / F, self.gradient * L**3 / F
        film, further = self.film_weight * L**2 / F, self.cap_weight * L**2 / F
        wt = self.tendon_weight * L / F
        bottom, top = (r / L for r in self.fitting_radii)
        W = self.fitting_weights[1] / F

        def slopes(s: float, y: Array) -> Any:
            r, z, theta, T = y[:4]
            sine, cosine = math.sin(theta), math.cos(theta)
            wf = film + (further if s > cap else 0.0)
            bend = 2 * math.pi * r * (p0 + b * z + wf * sine) + wt * sine
            return [
                sine, cosine, -bend / T, (2 * math.pi * r * wf + wt) * cosine,
                math.pi * r**2 * cosine, 2 * math.pi * r,
            ]  # fmt: skip

        def pull(y: Array) -> float:
            return float(y[3] * math.cos(y[2]) - (p0 + b * y[1]) * math.pi * top**2 + W)

        def horizontal(_: float, y: Array) -> float:
            return pull(y)

        def closed(_: float, y: Array) -> float:
            return float(y[0] - top) if y[2] < 0.0 else 1.0

        for event in (horizontal, closed):
            event.terminal, event.direction = True, -1.0  # type: ignore[attr-defined]
        start = [bottom, 0.0, math.acos(min(1.0 / tension, 1.0)), tension, 0.0, 0.0]
        found = solve_ivp(
            slopes, (0.0, 1e4), start, method="DOP853", rtol=_RTOL, atol=1e-13,
            events=(horizontal, closed), dense_output=dense,
        )  # fmt: skip
        end = found.y[:, -1]
        if found.t_events[1].size:
            return pull(end), found
        return -math.pi * (p0 + b * float(end[1])) * (float(end[0]) ** 2 - top**2), found

    @cached_property
    def _solution(self) -> Any:
        if not self.cap_weight:
            return self._solve(math.inf)
        # the cap is measured from the top, whose place depends on it a little
        cap, length = self.cap_length / self._length, 0.0
        solution = self._solve(math.inf)
        for _ in range(30):
            last, length = length, float(solution.t[-1])
            if abs(length - last) < 1e-10 * length:
                break
            solution = self._solve(length - cap)
        return solution

    def _solve(self, cap: float) -> Any:
        """The solution of the tension at the bottom with which the curve closes at the top."""
        from scipy.optimize import brentq

        def left(log: float) -> float:
            return self._shoot(1.0 + math.exp(log), cap)[0]

        low, high = math.log(1e-3), 0.0
        while left(high) > 0.0 and high < _STEEPEST:
            low, high = high, high + 2.0
        if left(low) <= 0.0 or high >= _STEEPEST:
            raise SolveError(
                f"no curve carries {self._force:g} N at a gradient of {self.gradient:g} N/m^3 and film "
                f"of {self.film_weight:g} N/m^2; try lighter film or another pressure"
            )
        log = float(brentq(left, low, high, xtol=1e-14, rtol=1e-14))
        return self._shoot(1.0 + math.exp(log), cap, dense=True)[1]

    @property
    def _end(self) -> Array:
        return np.asarray(self._solution.y[:, -1])

    # --- the curve as a whole --------------------------------------------------------------

    @property
    def arc_length(self) -> float:
        """Length from fitting to fitting [m]."""
        return self._length * float(self._solution.t[-1])

    @property
    def height(self) -> float:
        """Height from fitting to fitting [m]."""
        return self._length * float(self._end[1])

    @property
    def volume(self) -> float:
        """Volume of the surface of revolution between the fittings [m^3]."""
        return self._length**3 * float(self._end[4])

    @property
    def area(self) -> float:
        """Area of the surface of revolution [m^2]."""
        return self._length**2 * float(self._end[5])

    @cached_property
    def equator(self) -> float:
        """Arc length of the largest radius [m]."""
        from scipy.optimize import brentq

        end = float(self._solution.t[-1])
        return self._length * float(brentq(lambda t: self._solution.sol(t)[2], 0.0, end, xtol=1e-14))

    @property
    def R0(self) -> float:
        """Largest radius [m]."""
        return float(self.radius(self.equator))

    @property
    def bottom_angle(self) -> float:
        """Angle theta0 of the tendons from the vertical at the bottom fitting [rad]."""
        return float(self._solution.y[2, 0])

    # --- along the curve -------------------------------------------------------------------

    def radius(self, s: npt.ArrayLike) -> Array:
        """Distance from the axis [m] at the arc length `s` from the bottom fitting [m], any shape."""
        return self._length * self._at(s)[0]

    def z(self, s: npt.ArrayLike) -> Array:
        """Height above the bottom fitting [m] at the arc length `s` [m], any shape."""
        return self._length * self._at(s)[1]

    def slope(self, s: npt.ArrayLike) -> tuple[Array, Array]:
        """Unit tangent (dr/ds, dz/ds) at the arc length `s` [m]."""
        theta = self._at(s)[2]
        return np.sin(theta), np.cos(theta)

    def curvature(self, s: npt.ArrayLike) -> Array:
        """Curvature -dtheta/ds [1/m] at the arc length `s` [m]."""
        r, z, theta, T = (self._at(s)[k] for k in range(4))
        r, z, T = r * self._length, z * self._length, T * self._force
        further = np.where(np.asarray(s) > self.arc_length - self.cap_length, self.cap_weight, 0.0)
        load = self.pressure + self.gradient * z + (self.film_weight + further) * np.sin(theta)
        return np.asarray((2 * math.pi * r * load + self.tendon_weight * np.sin(theta)) / T)

    def tension(self, s: npt.ArrayLike) -> Array:
        """Tension of all tendons together [N] at the arc length `s` [m]."""
        return self._force * self._at(s)[3]

    def _at(self, s: npt.ArrayLike) -> Array:
        """Scaled r, z, theta, T, volume and area (6, ...), refused beyond the fittings."""
        s = np.asarray(s, dtype=np.float64)
        if not np.all(np.abs(s / self.arc_length - 0.5) <= 0.5 + 1e-9):  # NaN fails too
            raise InputError(
                f"an arc length lies beyond the fittings; give 0 <= s <= {self.arc_length:.6g} m"
            )
        return np.asarray(self._solution.sol(s.ravel() / self._length)).reshape(6, *s.shape)
