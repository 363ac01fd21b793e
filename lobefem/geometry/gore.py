"""Gores: film that bulges between two neighbouring tendons of a pumpkin balloon.

A tendon lies in a meridional plane on a curve r(s), z(s). In the plane normal to it, halfway between two
tendons, the film is an arc of radius rho and half angle alpha over the chord 2 h = 2 r sin(pi/N):

    sin alpha = h/rho,   half-width w = rho alpha,   rise d = h tan(alpha/2).

The reference surface is X(s, xi) = r cos(pi/N) e_r + n rho (cos(alpha xi) - cos alpha) + e_theta rho
sin(alpha xi), xi from -1 to 1, with e_r and e_theta of the gore's middle and n the curve's outward normal
there. A gore is cut flat, with x the length of its centre line and y = w xi (docs/theory/pumpkin.md).
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from lobefem import checks
from lobefem.errors import InputError
from lobefem.typing import Array

__all__ = ["ConstantAngle", "ConstantRadius", "FlatLobe", "Gore", "Lobes", "MeridianCurve", "TabulatedWidth"]


class MeridianCurve(Protocol):
    """A tendon's curve as a gore needs it; s is its arc length from the bottom fitting [m]."""

    @property
    def arc_length(self) -> float:
        """Length from fitting to fitting [m]."""

    def radius(self, s: Array) -> Array:
        """Distance from the axis [m]."""

    def z(self, s: Array) -> Array:
        """Height above the bottom fitting [m]."""

    def slope(self, s: Array) -> tuple[Array, Array]:
        """Unit tangent (dr/ds, dz/ds)."""


class Lobes(ABC):
    """Half angles of the lobes of a balloon along its tendons."""

    @abstractmethod
    def half_angle(self, s: Array, chord: Array, largest_chord: float, length: float) -> Array:
        """Half angle alpha [rad] at stations s.

        Args:
            s: arc length of the tendon from the bottom [m].
            chord: half chord h = r sin(pi/N) there [m].
            largest_chord: of them [m].
            length: of the tendon [m].
        """

    def half_width(self, s: Array, chord: Array, largest_chord: float, length: float) -> Array:
        """Half-width w [m] of the flat gore at stations s, by default that of the drawn arc."""
        return chord / np.sinc(self.half_angle(s, chord, largest_chord, length) / np.pi)


@dataclass(frozen=True)
class ConstantAngle(Lobes):
    """Lobes of one half angle everywhere ("constant bulge angle").

    Args:
        angle: half angle alpha [rad], from 0 to pi/2; the bulge angle of the literature is often 2 alpha.

    Raises:
        InputError: an angle out of this range.
    """

    angle: float

    def __post_init__(self) -> None:
        _check_angle(self.angle)

    def half_angle(self, s: Array, chord: Array, largest_chord: float, length: float) -> Array:
        """The angle."""
        return np.full(np.shape(s), self.angle)


@dataclass(frozen=True)
class ConstantRadius(Lobes):
    """Lobes of one radius everywhere ("constant bulge radius").

    Args:
        angle: half angle alpha at the equator [rad], where the chord is longest.

    Raises:
        InputError: an angle that is not between 0 and pi/2.
    """

    angle: float

    def __post_init__(self) -> None:
        _check_angle(self.angle)

    def half_angle(self, s: Array, chord: Array, largest_chord: float, length: float) -> Array:
        """arcsin(h/rho) with rho = h_max/sin(alpha)."""
        return np.arcsin(chord / largest_chord * math.sin(self.angle))


class FlatLobe(ConstantAngle):
    """Film straight from tendon to tendon."""

    def __init__(self) -> None:
        super().__init__(0.0)


@dataclass(frozen=True)
class TabulatedWidth(Lobes):
    """Lobes whose half-widths are given, as on the drawing of a gore.

    Near its fittings a gore may be much wider than the chord: it is drawn as half a circle there, and what
    is wider lies in folds.

    Args:
        stations: places along the gore from the bottom, over its length, ascending from 0 to 1.
        half_widths: w there [m].

    Raises:
        InputError: rows that are no such table, or widths below the chord between the tendons.
    """

    stations: tuple[float, ...]
    half_widths: tuple[float, ...]

    def __post_init__(self) -> None:
        s, w = np.asarray(self.stations, dtype=float), np.asarray(self.half_widths, dtype=float)
        if s.ndim != 1 or s.shape != w.shape or len(s) < 2:
            raise InputError("a gore's table needs as many half-widths as stations, two at least")
        if s[0] != 0.0 or s[-1] != 1.0 or not (np.diff(s) > 0).all():
            raise InputError("a gore's stations must ascend from 0 to 1, the ends of its centre line")
        if not (np.isfinite(w) & (w > 0)).all():
            raise InputError("a gore's half-widths must be positive numbers of metres")

    def width(self, share: Array) -> Array:
        """Half-width [m] at shares of the gore's length, by a monotone cubic."""
        from scipy.interpolate import PchipInterpolator

        return np.asarray(PchipInterpolator(self.stations, self.half_widths)(share))

    def half_angle(self, s: Array, chord: Array, largest_chord: float, length: float) -> Array:
        """The alpha with sin(alpha)/alpha = h/w, a right angle at most."""
        ratio: Array = chord / self.width(np.asarray(s / length))
        if (ratio > 1 + 1e-9).any():
            worst = int(np.argmax(ratio))
            raise InputError(
                f"the gore's half-width at {s[worst] / length:.3g} of its length is "
                f"{chord[worst] / ratio[worst]:.4g} m, less than the half chord of {chord[worst]:.4g} m "
                "between the tendons; give wider gores, more of them, or a smaller balloon"
            )
        return np.minimum(_angle_of(np.minimum(ratio, 1.0)), math.pi / 2)

    def half_width(self, s: Array, chord: Array, largest_chord: float, length: float) -> Array:
        """The given one, where the drawn arc is narrower too."""
        return self.width(np.asarray(s / length))


def _check_angle(angle: float) -> None:
    if not 0 <= checks.finite("the half angle of a lobe", angle, "rad") <= math.pi / 2:
        raise InputError(
            f"the half angle of a lobe is {math.degrees(angle):.4g} degrees; give 0 to 90 (half of the bulge "
            "angle)"
        )


def _angle_of(ratio: Array) -> Array:
    """The alpha in [0, pi] with sin(alpha)/alpha = ratio, by Newton's method."""
    alpha = np.sqrt(np.maximum(6 * (1 - ratio), 0.0))
    for _ in range(60):
        safe = np.maximum(alpha, 1e-12)
        f = np.sinc(safe / np.pi) - ratio
        slope = (np.cos(safe) - np.sinc(safe / np.pi)) / safe
        step = np.where(alpha > 1e-7, f / np.where(slope == 0, -1.0, slope), 0.0)
        alpha = np.clip(alpha - step, 0.0, np.pi)
        if np.abs(step).max(initial=0.0) < 1e-15:
            break
    return alpha


class Gore:
    """One gore of a balloon: its surface between two tendons, and the flat piece from which it is cut.

    The tendons lie at the azimuths 0 and 2 pi/N.

    Args:
        curve: of the tendons.
        count: number N of gores, at least 3.
        lobes: how the film bulges.

    Raises:
        InputError: fewer than three gores, or lobes that do not fit between the tendons.
    """

    def __init__(self, curve: MeridianCurve, count: int, lobes: Lobes) -> None:
        self.curve, self.lobes = curve, lobes
        self.count = checks.integer("the number of gores", count, 3)
        table: Array = np.asarray(np.linspace(0.0, curve.arc_length, 2001))
        self._largest = float(self.half_chord(table).max())
        self.half_angle(table)  # which refuses what does not fit
        # length of the centre line: chords of two steps, and Richardson's extrapolation of their sums
        fine: Array = np.asarray(np.linspace(0.0, curve.arc_length, 4001))
        x = self.position(fine, np.zeros(len(fine)))
        single = np.linalg.norm(np.diff(x, axis=0), axis=1).reshape(-1, 2).sum(axis=1)
        double = np.linalg.norm(x[2::2] - x[:-2:2], axis=1)
        self._table = table
        self._centre = np.concatenate([[0.0], np.cumsum((4 * single - double) / 3)])

    def half_chord(self, s: Array) -> Array:
        """Half the distance between the tendons, r sin(pi/N) [m]."""
        return np.asarray(self.curve.radius(s)) * math.sin(math.pi / self.count)

    def half_angle(self, s: Array) -> Array:
        """Half angle alpha of the lobe [rad]."""
        return self.lobes.half_angle(s, self.half_chord(s), self._largest, self.curve.arc_length)

    def half_width(self, s: Array) -> Array:
        """Half-width w of the flat gore [m]; that of the drawn arc, rho alpha, or the table's."""
        return self.lobes.half_width(s, self.half_chord(s), self._largest, self.curve.arc_length)

    def bulge_radius(self, s: Array) -> Array:
        """Radius rho of the lobe [m], infinite where it is flat."""
        with np.errstate(divide="ignore"):
            return self.half_chord(s) / np.sin(self.half_angle(s))

    @property
    def centre_length(self) -> float:
        """Length of the gore's centre line [m]."""
        return float(self._centre[-1])

    def along(self, s: Array) -> Array:
        """Length x of the centre line from the bottom to the arc length s of the tendon [m]."""
        from scipy.interpolate import CubicSpline

        return np.asarray(CubicSpline(self._table, self._centre)(s))

    def position(self, s: Array, xi: Array) -> Array:
        """Points of the reference surface (n, 3) [m].

        Args:
            s: arc length of the tendon from the bottom (n,) [m].
            xi: from -1 at the tendon of azimuth 0 to 1 at that of 2 pi/N (n,).
        """
        r, z = np.asarray(self.curve.radius(s)), np.asarray(self.curve.z(s))
        dr, dz = self.curve.slope(s)
        alpha, h = self.half_angle(s), self.half_chord(s)
        w = h / np.sinc(alpha / np.pi)
        # rho sin(alpha xi) and rho (cos(alpha xi) - cos(alpha)) without dividing by a small angle
        sideways = w * xi * np.sinc(alpha * xi / np.pi)
        rise = 2 * w * np.sin(alpha * (1 + xi) / 2) * (1 - xi) / 2 * np.sinc(alpha * (1 - xi) / (2 * np.pi))
        middle = math.pi / self.count
        out = r * math.cos(middle) + dz * rise
        c, sn = math.cos(middle), math.sin(middle)
        return np.stack([out * c - sideways * sn, out * sn + sideways * c, z - dr * rise], axis=1)

    def pattern(self, s: Array, xi: Array) -> Array:
        """Coordinates (x, y) on the flat gore (n, 2) [m]."""
        return np.stack([self.along(s), self.half_width(s) * xi], axis=1)
