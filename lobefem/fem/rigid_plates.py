"""Rigid end plates: finite rotations, the central bar, supports, and the plates' own gas load.

Each plate moves with six numbers w = (d, theta): its centre's displacement [m] and its rotation
vector [rad], X -> C + d + R(theta)(X - C). The two plates' w (12,) depend on the few free parameters y
that supports and bar leave. All of it is small dense algebra in NumPy, the same on every rank.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from lobefem.model.end_plates import EndPlates
from lobefem.typing import Array

__all__ = ["PlateMotion", "rotation", "sinc"]

# E[a] maps x to e_a cross x
_SKEW = np.array(
    [
        [[0, 0, 0], [0, 0, -1], [0, 1, 0]],
        [[0, 0, 1], [0, 0, 0], [-1, 0, 0]],
        [[0, -1, 0], [1, 0, 0], [0, 0, 0]],
    ],
    dtype=float,
)


def _sinc_series(x: float, first: int) -> tuple[float, float, float]:
    """Value and two derivatives of sum_k (-x)^k/(2k + first)! in x = t^2, for |t| < 2 pi.

    first = 1 gives sin t/t, first = 2 gives (1 - cos t)/t^2; the series converges to round-off over
    the whole range and has no 0/0. Beyond it, where a Newton step may go astray, the closed forms hold.
    """
    if x > 36.0:
        t = math.sqrt(x)
        f = math.sin(t) / t
        df = (math.cos(t) - f) / (2 * x)
        if first == 1:
            return f, df, -(6 * df + f) / (4 * x)
        g = (1 - math.cos(t)) / x
        dg = (f / 2 - g) / x
        return g, dg, (df / 2 - 2 * dg) / x
    value = d1 = d2 = 0.0
    for k in range(32):
        c = (-1.0) ** k / math.factorial(2 * k + first)
        value += c * x**k
        if k > 0:
            d1 += c * k * x ** (k - 1)
        if k > 1:
            d2 += c * k * (k - 1) * x ** (k - 2)
    return value, d1, d2


def sinc(x: float) -> tuple[float, float, float]:
    """Value of sin t/t with two derivatives in x = t^2, |t| < 2 pi."""
    return _sinc_series(x, 1)


def rotation(theta: Array) -> tuple[Array, Array, Array]:
    """Rotation matrix of a rotation vector with its first and second derivatives.

    R = I + a K + b K^2, K = skew(theta), a = sin t/t, b = (1 - cos t)/t^2 (Rodrigues).

    Args:
        theta: rotation vector (3,) [rad], shorter than 2 pi.

    Returns:
        R (3, 3), dR (3, 3, 3) with dR[a] = dR/dtheta_a, d2R (3, 3, 3, 3).
    """
    return _rotation(*np.asarray(theta, dtype=float).tolist())


@lru_cache(maxsize=8)  # map, residual and tangent ask for the same ones
def _rotation(*components: float) -> tuple[Array, Array, Array]:
    theta = np.array(components)
    x = float(theta @ theta)
    a, a1, a2 = sinc(x)
    b, b1, b2 = _sinc_series(x, 2)
    K = np.einsum("a,aij->ij", theta, _SKEW)
    K2 = K @ K
    dK2 = _SKEW @ K + K @ _SKEW
    da, db = 2 * a1 * theta, 2 * b1 * theta
    eye = np.eye(3)
    d2a = 2 * a1 * eye + 4 * a2 * np.outer(theta, theta)
    d2b = 2 * b1 * eye + 4 * b2 * np.outer(theta, theta)
    R = eye + a * K + b * K2
    dR = np.einsum("a,ij->aij", da, K) + a * _SKEW + np.einsum("a,ij->aij", db, K2) + b * dK2
    d2K2 = np.einsum("aij,bjk->abik", _SKEW, _SKEW)
    d2K2 = d2K2 + d2K2.transpose(1, 0, 2, 3)
    mixed = np.einsum("a,bij->abij", da, _SKEW) + np.einsum("a,bij->abij", db, dK2)
    d2R = (
        np.einsum("ab,ij->abij", d2a, K)
        + np.einsum("ab,ij->abij", d2b, K2)
        + mixed
        + mixed.transpose(1, 0, 2, 3)
        + b * d2K2
    )
    for result in (R, dR, d2R):
        result.flags.writeable = False
    return R, dR, d2R


class PlateMotion:
    """The map y -> w of both plates, with the parts of the energy that live on w alone.

    Args:
        plates: supports and bar.
        centres: bottom and top plate centres (2, 3) [m].
        areas: plate areas (2,) [m^2], as enclosed by the meshed rims.
        origin: about which volumes are counted (3,) [m].
        copies: number of sectors of which these are the plates' shares of one.

    Attributes:
        size: number of free parameters y.
        names: what each of them is.
        length, direction: of the bar at rest [m], unit vector (3,).
        across: two unit vectors across it (2, 3), right-handed with its direction.
    """

    def __init__(
        self,
        plates: EndPlates,
        centres: Array,
        areas: Array,
        origin: npt.ArrayLike = 0.0,
        copies: int = 1,
    ) -> None:
        self.plates, self.copies = plates, copies
        self.centres = np.asarray(centres, dtype=float)
        self._arms = self.centres - origin
        span = self.centres[1] - self.centres[0]
        self.length = float(np.linalg.norm(span))
        self.direction = span / self.length
        helper = np.eye(3)[np.argmin(np.abs(self.direction))]
        across = np.cross(self.direction, helper)
        across /= np.linalg.norm(across)
        # two axes across the bar; the bar tilts about them and never spins
        self.across = np.array([np.cross(across, self.direction), across])
        # outward area vectors of the plates
        self.area_vectors = np.array([-areas[0], areas[1]])[:, None] * self.direction
        self.rigid_bar = plates.bar is True
        tilt = ("tilt_1", "tilt_2")
        spin = ("rotation_x", "rotation_y", "rotation_z")
        names: tuple[str, ...] = ()
        if plates.support == "pinned":
            names += tuple(f"bottom_{n}" for n in tilt)
        if plates.support != "fixed":
            names += tuple(f"bar_{n}" for n in tilt) if self.rigid_bar else ("top_x", "top_y", "top_z")
            names += tuple(f"top_{n}" for n in spin)
        self.names = names
        self.size = len(names)

    @staticmethod
    def is_angle(name: str) -> bool:
        """True if a parameter of a name is one in radians, not in metres."""
        return "tilt" in name or "rotation" in name

    def tilts(self, rotation: Array) -> Array:
        """The two tilt parameters of a rotation vector (3,) [rad]; its spin about the axis is left out."""
        return self.across @ np.asarray(rotation, dtype=float)

    @property
    def moving(self) -> bool:
        """True if any plate can move."""
        return self.size > 0

    def evaluate(self, y: Array) -> tuple[Array, Array, Array]:
        """Return w (12,), dw/dy (12, size) and d2w/dy2 (12, size, size) at y (size,)."""
        n = self.size
        w, dw, d2w = np.zeros(12), np.zeros((12, n)), np.zeros((12, n, n))
        if self.plates.support == "fixed":
            w[6:9] = self.plates.lift * self.direction
            return w, dw, d2w
        k = 0
        if self.plates.support == "pinned":
            w[3:6] = y[:2] @ self.across
            dw[3:6, :2] = self.across.T
            k = 2
        if self.rigid_bar:
            # d_top = L (R(beta) e - e), beta across the bar: its length is kept exactly
            R, dR, d2R = rotation(y[k : k + 2] @ self.across)
            Q = self.across
            w[6:9] = self.length * (R @ self.direction - self.direction)
            dw[6:9, k : k + 2] = self.length * np.einsum("aij,ka,j->ik", dR, Q, self.direction)
            d2w[6:9, k : k + 2, k : k + 2] = self.length * np.einsum(
                "abij,ka,lb,j->ikl", d2R, Q, Q, self.direction
            )
            k += 2
        else:
            w[6:9] = y[k : k + 3]
            dw[6:9, k : k + 3] = np.eye(3)
            k += 3
        w[9:12] = y[k:]
        dw[9:12, k:] = np.eye(3)
        return w, dw, d2w

    def coordinates(self, w: Array) -> Array:
        """The y that comes nearest to a motion w (12,): the inverse of `evaluate` where there is one."""
        if not self.moving:
            return np.empty(0)
        tilts = [self.across @ w[3:6]] if self.plates.support == "pinned" else []
        if not self.rigid_bar:
            return np.concatenate([*tilts, w[6:12]])
        x = self.length * self.direction + w[6:9] - w[0:3]
        turn = np.cross(self.direction, x)
        sine = float(np.linalg.norm(turn))
        angle = math.atan2(sine, float(self.direction @ x))
        tilt = self.across @ turn * (angle / sine) if sine else np.zeros(2)
        return np.concatenate([*tilts, tilt, w[9:12]])

    @property
    def volume(self) -> float:
        """The plates' part of the enclosed volume at rest, sum A n . C/3 [m^3]."""
        return float((self.area_vectors * self._arms).sum()) / 3

    def turned_area_vectors(self, w: Array) -> Array:
        """Outward area vectors (2, 3) [m^2] of the plates at w."""
        turns = [rotation(w[6 * k + 3 : 6 * k + 6])[0] for k in range(2)]
        return np.array([R @ a for R, a in zip(turns, self.area_vectors, strict=True)])

    def volume_change(self, w: Array) -> tuple[float, Array, Array]:
        """Change of the plates' part of the volume, sum A (R n).(C + d)/3 less that at rest.

        Exact for flat plates, whatever the rim's shape, because x . n is constant over a plane.

        Returns:
            value [m^3], gradient (12,), Hessian (12, 12) with respect to w.
        """
        value, gradient, hessian = 0.0, np.zeros(12), np.zeros((12, 12))
        for k in range(2):
            d, t = slice(6 * k, 6 * k + 3), slice(6 * k + 3, 6 * k + 6)
            R, dR, d2R = rotation(w[t])
            a = self.area_vectors[k] / 3
            x = self._arms[k] + w[d]
            value += float((R - np.eye(3)) @ a @ x + a @ w[d])
            gradient[d] += R @ a
            gradient[t] += np.einsum("aij,j,i->a", dR, a, x)
            hessian[t, t] += np.einsum("abij,j,i->ab", d2R, a, x)
            cross = np.einsum("aij,j->ia", dR, a)
            hessian[d, t] += cross
            hessian[t, d] += cross.T
        return value, gradient, hessian

    def moment_change(self, w: Array, level: float) -> tuple[float, Array, Array]:
        """Change of the plates' part of W, the integral of the height over `level` in the volume.

        For flat circular discs A n_z (z_c^2 + r^2 (1 - n_z^2)/4)/2, z_c the height of their centre.

        Returns:
            value [m^4], gradient (12,), Hessian (12, 12) with respect to w.
        """
        e = self.direction
        value, gradient, hessian = 0.0, np.zeros(12), np.zeros((12, 12))
        for k in range(2):
            d, t = slice(6 * k, 6 * k + 3), slice(6 * k + 3, 6 * k + 6)
            R, dR, d2R = rotation(w[t])
            area = float(np.linalg.norm(self.area_vectors[k]))
            n = self.area_vectors[k] / area
            inertia = self.copies * area**2 / (4 * math.pi)  # of this sector's share
            z0 = float(self._arms[k] @ e) - level
            z = z0 + float(w[d] @ e)
            n0, nz = float(n @ e), float(e @ R @ n)
            dn, d2n = np.einsum("i,aij,j->a", e, dR, n), np.einsum("i,abij,j->ab", e, d2R, n)
            value += (nz * (area * z**2 + inertia * (1 - nz**2)) - n0 * area * z0**2) / 2
            tilt = (area * z**2 + inertia * (1 - 3 * nz**2)) / 2
            gradient[d] += area * nz * z * e
            gradient[t] += tilt * dn
            hessian[d, d] += area * nz * np.outer(e, e)
            cross = area * z * np.outer(e, dn)
            hessian[d, t] += cross
            hessian[t, d] += cross.T
            hessian[t, t] += tilt * d2n - 3 * inertia * nz * np.outer(dn, dn)
        return value, gradient, hessian

    def bar_energy(self, w: Array, built_in: float) -> tuple[float, Array, Array]:
        """Energy of an elastic bar, N0 (l - L) + EA (l - L)^2/(2 L), with gradient and Hessian in w.

        Args:
            w: plate parameters (12,).
            built_in: force N0 [N] in the bar at its reference length.
        """
        gradient, hessian = np.zeros(12), np.zeros((12, 12))
        if isinstance(self.plates.bar, bool):
            return 0.0, gradient, hessian
        k = self.plates.bar / self.length
        x = self.length * self.direction + w[6:9] - w[0:3]
        length = float(np.linalg.norm(x))
        e = x / length
        force = built_in + k * (length - self.length)
        gradient[6:9], gradient[0:3] = force * e, -force * e
        block = k * np.outer(e, e) + force / length * (np.eye(3) - np.outer(e, e))
        hessian[6:9, 6:9] = hessian[0:3, 0:3] = block
        hessian[6:9, 0:3] = hessian[0:3, 6:9] = -block
        stretch = length - self.length
        return built_in * stretch + k * stretch**2 / 2, gradient, hessian

    def bar_force(self, w: Array, top_force: Array, built_in: float) -> float | None:
        """Force in the bar [N], tension positive; None where there is no bar or both rims are held.

        Args:
            w: plate parameters (12,).
            top_force: gradient (3,) [N] of all other energy with respect to the top plate's centre;
                in equilibrium a rigid bar balances its part along the bar.
            built_in: force in an elastic bar at its reference length [N].
        """
        if self.plates.bar is False or not self.moving:
            return None
        x = self.length * self.direction + w[6:9] - w[0:3]
        length = float(np.linalg.norm(x))
        if self.rigid_bar:
            return -float(top_force @ x) / length
        return built_in + float(self.plates.bar) / self.length * (length - self.length)
