"""Numbers that vary along the tendons of a pumpkin, by station: a function of points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from lobefem.errors import InputError
from lobefem.geometry.tendon_curve import TendonCurve
from lobefem.typing import Array

__all__ = ["StationTable"]

_FINE = 2001  # points of the curve among which a point is placed


@dataclass(frozen=True)
class StationTable:
    """A table of values along the tendons, linear between its rows.

    Args:
        curve: on which the tendons lie.
        stations: places from the bottom, over the length, ascending from 0 to 1.
        values: there.

    Raises:
        InputError: rows that are no such table.
    """

    curve: TendonCurve
    stations: tuple[float, ...]
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        s, values = (np.asarray(row, dtype=np.float64) for row in (self.stations, self.values))
        sound = s.ndim == 1 and len(s) == len(values) >= 2 and np.isfinite(values).all()
        if not sound or s[0] != 0.0 or s[-1] != 1.0 or not (np.diff(s) > 0).all():
            raise InputError(
                f"a table along the tendons has stations {self.stations} and {len(values)} values; give "
                "stations that ascend from 0 to 1, and a number for each"
            )

    @property
    def mean(self) -> float:
        """Mean over the length."""
        return float(np.trapezoid(self.values, self.stations))

    def at(self, stations: Any) -> Array:
        """Values at stations from 0 to 1."""
        return np.asarray(np.interp(stations, self.stations, self.values))

    def __call__(self, points: Array) -> Array:
        """Values at points (n, 3) on the tendons at rest or near them [m], (n,)."""
        s = np.linspace(0.0, 1.0, _FINE)
        r, z = (of(s * self.curve.arc_length) for of in (self.curve.radius, self.curve.z))
        middle = (z.max() + z.min()) / 2
        angle = np.arctan2(z - middle, r)  # ascends along a curve that is convex
        own = np.arctan2(points[:, 2] - middle, np.hypot(points[:, 0], points[:, 1]))
        return self.at(np.interp(own, angle, s))
