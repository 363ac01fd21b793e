"""The axis of a balloon: a place and a direction, found from its rims. NumPy only."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lobefem.frozen import Frozen
from lobefem.typing import Array

__all__ = ["Axis", "across", "circle", "unit"]


@dataclass(frozen=True)
class Axis(Frozen):
    """The place and the direction of a balloon's axis.

    Attributes:
        direction: unit vector from the bottom to the top rim (3,).
        origin: where heights count from, the centre of the bottom rim (3,) [m].
        first: unit vector across the axis from which azimuths count (3,).
    """

    direction: Array
    origin: Array
    first: Array

    @property
    def home(self) -> bool:
        """True of the z axis with the bottom rim about the origin, where lobefem's own meshes stand."""
        return bool((self.origin == 0).all() and (self.direction == [0.0, 0.0, 1.0]).all())

    @property
    def basis(self) -> Array:
        """Rows: first, the other vector across, direction (3, 3)."""
        return np.stack([self.first, np.cross(self.direction, self.first), self.direction])

    def relative(self, x: Array) -> Array:
        """Components in `basis` of places from the origin, (n, 3) [m]."""
        return (x - self.origin) @ self.basis.T

    def cylindrical(self, x: Array) -> tuple[Array, Array, Array, Array]:
        """Azimuths [rad], heights [m] and distances from the axis [m] of places (n, 3), and their frames.

        Returns:
            angle (n,), height (n,), radius (n,), frame (n, 3, 3; rows radial, hoop, axial).
        """
        first, second, direction = self.basis
        arm = x - self.origin
        angle = np.arctan2(arm @ second, arm @ first)
        radial = np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * second
        hoop = np.cross(direction, radial)
        frame = np.stack([radial, hoop, np.broadcast_to(direction, radial.shape)], axis=1)
        return angle, arm @ direction, np.einsum("ni,ni->n", arm, radial), frame


def unit(vector: npt.ArrayLike) -> Array:
    """A vector of length 1 with the direction of another, which is not zero; read-only."""
    v = np.array(vector, dtype=float)
    v /= np.linalg.norm(v)
    v.flags.writeable = False
    return v


def across(axis: Array) -> tuple[Array, Array]:
    """Two unit vectors that complete the axis to a right-handed frame."""
    e1 = np.eye(3)[np.argmin(np.abs(axis))]
    e1 = e1 - (e1 @ axis) * axis
    e1 /= np.linalg.norm(e1)
    return e1, np.cross(axis, e1)


def circle(points: Array) -> tuple[Array, float]:
    """Centre (3,) and radius of the circle that the sum of some points' distances from is least of.

    So it is that through nearly all of them where a few were moved by hand. The centre is rounded to 14
    digits of the coordinates: those of meshes on whole numbers are exact.
    """
    middle = points.mean(axis=0)
    x = points - middle
    size = float(np.abs(x).max()) or 1.0
    e1, e2 = across(np.linalg.svd(x, full_matrices=False)[2][-1])
    flat = np.stack([x @ e1, x @ e2], axis=1) / size
    # |x|^2 = 2 c . x + (R^2 - |c|^2), by least squares whose weights make a sum of distances of them
    A, b = np.column_stack([2 * flat, np.ones(len(flat))]), (flat**2).sum(axis=1)
    weights = np.ones(len(flat))
    for _ in range(50):
        root = np.sqrt(weights)
        found = np.linalg.lstsq(A * root[:, None], b * root, rcond=None)[0]
        off = np.abs(A @ found - b)
        if off.max() < 1e-14:  # a circle
            break
        weights = 1 / np.maximum(off, 1e-15)
    centre = middle + size * (found[0] * e1 + found[1] * e2)
    radius = size * math.sqrt(max(float(found[2] + found[:2] @ found[:2]), 0.0))
    return rounded(centre, float(np.abs(points).max())), radius


def rounded(vector: Array, size: float) -> Array:
    """Numbers to 14 digits of a size, without signed zeros."""
    return np.asarray(np.round(vector, 14 - math.ceil(math.log10(size or 1.0))) + 0.0)
