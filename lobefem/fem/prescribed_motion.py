"""Guides: the plates' motion, and that of seams and nodes, under a temporary constraint.

A guide has one parameter s, set from outside, and leaves the other parameters y free: it is used in
the place of a `PlateMotion`. With the axes e1, e2 across the bar and e3 along it (x, y, z for a
balloon on the z axis):

- `TipMotion`: the top plate's centre is displaced by s along e1,
- `TwistMotion`: the top plate is turned by s about e3,
- `BendMotion`: the axis is an arc of half-angle s, every seam a rigid circle normal to it,
- `WaveMotion`: nodes are displaced outwards.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lobefem.fem.rigid_plates import PlateMotion, sinc
from lobefem.frozen import Frozen
from lobefem.typing import Array

__all__ = ["BendMotion", "PrescribedMotion", "PushedNodes", "TipMotion", "TwistMotion", "WaveMotion"]


@dataclass(frozen=True)
class PushedNodes(Frozen):
    """Nodes that are displaced outwards by first + linear s + quadratic s^2; sideways they are free.

    Attributes:
        nodes: block indices (k,), owned or ghosts.
        frames: radial, hoop and axial unit vectors (rows) of each (k, 3, 3).
        linear: (k,).
        quadratic: (k,) [1/m].
        first: where they are at s = 0 (k,) [m]; None for zero.
    """

    nodes: npt.NDArray[np.int32]
    frames: Array
    linear: Array
    quadratic: Array
    first: Array | None = None


class PrescribedMotion:
    """The plates' motion as it is without a guide; what a guide prescribes is for its subclass.

    Args:
        motion: the plates' own motion.

    Attributes:
        kind: of distortion, in words.
        parameter: s.
        axes: e1, e2, e3 (3, 3).
        seams: names of the seams that move as rigid rings, after the two rims.
        centres: of all rings at rest (rings, 3) [m].
        pushed: nodes that the guide displaces, or None.
        size, names: free parameters y, as of `PlateMotion`.
    """

    kind: str
    seams: tuple[str, ...] = ()
    pushed: PushedNodes | None = None

    def __init__(self, motion: PlateMotion) -> None:
        self.plates, self.parameter = motion, 0.0
        self.axes = np.vstack([motion.across, motion.direction])
        self.centres, self.size, self.names = motion.centres, motion.size, motion.names

    def evaluate(self, y: Array) -> tuple[Array, Array, Array]:
        """The motion w (6 a ring), dw/dy and d2w/dy2 at y, as of `PlateMotion`."""
        return self.plates.evaluate(y)

    def is_angle(self, name: str) -> bool:
        """True if a parameter of a name is one in radians, as of `PlateMotion`."""
        return self.plates.is_angle(name)

    def rate(self, y: Array) -> Array:
        """dw/ds (6 a ring) at y."""
        return np.zeros(6 * len(self.centres))

    def coordinates(self, w: Array) -> Array:
        """The y that comes nearest to a motion w (12,) of the plates."""
        return self.plates.coordinates(w)

    def bar_force(self, w: Array, top_force: Array, built_in: float) -> float | None:
        """Force in the bar [N], as of `PlateMotion`; None where the guide takes part of it."""
        return self.plates.bar_force(w, top_force, built_in)


class _LinearMotion(PrescribedMotion):
    """One direction in the space of the plates' parameters is prescribed, those across it are free."""

    def __init__(self, motion: PlateMotion, first: str, direction: Array) -> None:
        super().__init__(motion)
        k = motion.names.index(first)
        along = np.zeros(motion.size)
        along[k : k + 3] = direction
        # the three components' own two directions across it, from the axes
        others = [a for a in self.axes if abs(a @ direction) < 0.5]
        free = np.eye(motion.size)
        free[k : k + 3, k : k + 3] = 0.0
        free[k : k + 3, k : k + 2] = np.array(others).T
        self._along, self._free = along, np.delete(free, k + 2, axis=1)
        self.size -= 1
        self.names = (*self.names[:k], f"{first}_1", f"{first}_2", *self.names[k + 3 :])

    def evaluate(self, y: Array) -> tuple[Array, Array, Array]:
        w, dw, d2w = self.plates.evaluate(self._free @ y + self.parameter * self._along)
        return w, dw @ self._free, np.einsum("wab,ai,bj->wij", d2w, self._free, self._free)

    def rate(self, y: Array) -> Array:
        return self.plates.evaluate(self._free @ y + self.parameter * self._along)[1] @ self._along

    def coordinates(self, w: Array) -> Array:
        return self._free.T @ self.plates.coordinates(w)


class TwistMotion(_LinearMotion):
    """The top plate's rotation vector has the component s [rad] along the axis; the rest is free.

    While the plate does not tilt, the reaction is the moment about the axis [N m].
    """

    kind = "twist"

    def __init__(self, motion: PlateMotion) -> None:
        super().__init__(motion, "top_rotation_x", motion.direction)


class _FreeTipMotion(_LinearMotion):
    """As `TipMotion` where no rigid bar ties the top centre to a sphere."""

    kind = "tip displacement"

    def __init__(self, motion: PlateMotion) -> None:
        super().__init__(motion, "top_x", motion.across[0])


class _BarTipMotion(PrescribedMotion):
    """As `TipMotion` at the end of a rigid bar: the centre moves on the sphere about the bottom's.

    d = s e1 + v e2 + (sqrt(L^2 - s^2 - v^2) - L) e3 with v free.
    """

    kind = "tip displacement"

    def __init__(self, motion: PlateMotion) -> None:
        super().__init__(motion)
        self._v = motion.names.index("bar_tilt_1")  # y holds v here in the place of two tilts
        self.size -= 1
        self.names = (*self.names[: self._v], "top_sideways", *self.names[self._v + 2 :])

    def _height(self, v: float) -> float:
        square = self.plates.length**2 - self.parameter**2 - v**2
        # a wild Newton step may leave the sphere: not a number, which ends the solve
        return math.sqrt(square) if square > 0 else math.nan

    def evaluate(self, y: Array) -> tuple[Array, Array, Array]:
        k, v, s = self._v, float(y[self._v]), self.parameter
        e1, e2, e3 = self.axes
        w, dw, d2w = self.plates.evaluate(np.insert(np.delete(y, k), k, [0.0, 0.0]))
        # the two tilts' column k stays, for v
        dw = np.delete(dw, k + 1, axis=1)
        d2w = np.delete(np.delete(d2w, k + 1, axis=1), k + 1, axis=2)
        z = self._height(v)
        w[6:9] = s * e1 + v * e2 + (z - self.plates.length) * e3
        dw[6:9, :], d2w[6:9, :, :] = 0.0, 0.0
        dw[6:9, k] = e2 - v / z * e3
        d2w[6:9, k, k] = -(1 / z + v**2 / z**3) * e3
        return w, dw, d2w

    def rate(self, y: Array) -> Array:
        rate = np.zeros(12)
        rate[6:9] = self.axes[0] - self.parameter / self._height(float(y[self._v])) * self.axes[2]
        return rate

    def coordinates(self, w: Array) -> Array:
        y = self.plates.coordinates(w)
        return np.insert(np.delete(y, [self._v, self._v + 1]), self._v, w[6:9] @ self.axes[1])

    def bar_force(self, w: Array, top_force: Array, built_in: float) -> float | None:
        x = self.plates.length * self.plates.direction + w[6:9] - w[0:3]
        x /= self.plates.length
        # bar and guide together balance the rest: top_force = F e1 - N x
        (_, force), *_ = np.linalg.lstsq(np.stack([self.axes[0], -x], axis=1), top_force)
        return float(force)


def TipMotion(motion: PlateMotion) -> PrescribedMotion:
    """The top plate's centre is displaced by s [m] along e1; the reaction is a force along e1 [N].

    All else is free: its motion across e1 (a rigid bar keeps its length), the plate's rotation.
    """
    return _BarTipMotion(motion) if motion.rigid_bar else _FreeTipMotion(motion)


class BendMotion(PrescribedMotion):
    """Lennon and Pellegrino's bending (paper fig. 21b): the axis an arc, its chord the bar.

    With t = 0 ... 1 along the axis, ring t has its centre at the distance L sin(s t)/sin s from the
    bottom's, which makes an arc of radius L/(2 sin s), and is turned by alpha = s (2 t - 1) about
    -e2: normal to the arc. A clamped bottom plate stays as it is; there all is turned by s as a whole.
    The reaction is conjugate to s [N m]: with end moments M at both ends it is 2 M.

    Args:
        motion: the plates' own motion.
        seams: names of all seams.
        centres: of the seams (seams, 3) [m].
    """

    kind = "bend"

    def __init__(self, motion: PlateMotion, seams: tuple[str, ...], centres: Array) -> None:
        super().__init__(motion)
        self.seams, self.size, self.names = seams, 0, ()
        self.centres = np.vstack([motion.centres, np.reshape(centres, (-1, 3))])
        self._t = (self.centres - motion.centres[0]) @ motion.direction / motion.length
        # slope of the chord against the axis at the bottom, per s
        self._tilt = -1.0 if motion.plates.support == "pinned" else 0.0

    def evaluate(self, y: Array) -> tuple[Array, Array, Array]:
        """The rings' places on the arc; there is no y."""
        s, t, (e1, e2, e3) = self.parameter, self._t, self.axes
        slope = (self._tilt + t) * s  # of the line from the bottom's centre to the ring's
        w = np.zeros((len(t), 6))
        chord = self.plates.length * self._stretch()[0]
        w[:, :3] = self.plates.centres[0] - self.centres
        w[:, :3] += chord[:, None] * (np.outer(-np.sin(slope), e1) + np.outer(np.cos(slope), e3))
        w[:, 3:] = -np.outer((self._tilt + 2 * t) * s, e2)
        n = w.size
        return w.ravel(), np.zeros((n, 0)), np.zeros((n, 0, 0))

    def rate(self, y: Array) -> Array:
        """dw/ds."""
        t, (e1, e2, e3) = self._t, self.axes
        turn = self._tilt + t
        sine, cosine = np.sin(turn * self.parameter), np.cos(turn * self.parameter)
        f, df = self._stretch()
        rate = np.zeros((len(t), 6))
        rate[:, :3] = np.outer(-df * sine - f * turn * cosine, e1) * self.plates.length
        rate[:, :3] += np.outer(df * cosine - f * turn * sine, e3) * self.plates.length
        rate[:, 3:] = -np.outer(self._tilt + 2 * t, e2)
        return rate.ravel()

    def _stretch(self) -> tuple[Array, Array]:
        """sin(s t)/sin s of each ring and its derivative in s, without 0/0 at s = 0."""
        s, t = self.parameter, self._t
        one, d_one, _ = sinc(s**2)
        f = np.array([sinc((s * k) ** 2)[:2] for k in t])
        value = t * f[:, 0] / one
        return value, 2 * s * (t**3 * f[:, 1] - value * d_one) / one

    def coordinates(self, w: Array) -> Array:
        """None: all is prescribed."""
        return np.empty(0)

    def bar_force(self, w: Array, top_force: Array, built_in: float) -> float | None:
        """None for a rigid bar: it and the guide hold the same two points."""
        return None if self.plates.rigid_bar else super().bar_force(w, top_force, built_in)


class WaveMotion(PrescribedMotion):
    """Nodes are displaced outwards by s and s^2 times fixed numbers; the reaction is conjugate to s [N].

    Args:
        motion: the plates' own motion.
        kind: in words.
        pushed: nodes and numbers.
    """

    def __init__(self, motion: PlateMotion, kind: str, pushed: PushedNodes) -> None:
        super().__init__(motion)
        self.kind, self.pushed = kind, pushed
