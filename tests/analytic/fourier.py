"""Stability of one held lobe by Fourier series around and Legendre polynomials along the meridian.

An answer of its own to what `critical_pressure` computes: from the continuum equations, by NumPy and
SciPy alone, sharing no line with the package. Its mistakes and the package's are not the same.

The lobe. Meridian R(s), z(s), s the arc length from the equator upwards, z' = (R/R0)^2, curvature
k = 2 R/R0^2 (from z'' = k R'), so that N = p R0^2/(2 R), hoop stress 0, balances p = k N. Frame: meridian
m = R' e_r + z' e_z, hoop h = e_theta, normal n = h x m outwards.

Displacement u = a m + b h + w n. With m' = -k n, n' = k m, m,theta = R' h, n,theta = z' h and
h,theta = -R' m - z' n its gradients are

    u,s       = (a' + k w) m + b' h + (w' - k a) n,
    u,theta/R = [(a,theta - R' b) m + (b,theta + R' a + z' w) h + (w,theta - z' b) n]/R,

and the linear strains e = m.u,s, f = h.u,theta/R, g = h.u,s + m.u,theta/R (the shear angle).

Second variation. The Green-Lagrange strain has the second-order part |u,s|^2/2, of the full gradient
with its in-plane components, and N does work on it. The gas has potential -p V, and with rims held
delta^2 V = integral of u . (u,theta x m + R h x u,s) ds dtheta; h x m = n, m x n = h, n x h = m give

    K(p)[u] = int C (e, f, g).(e, f, g) + N |u,s|^2
              - p [w (e + f) - b (w,theta - z' b)/R - a (w' - k a)] dA.

C is the film's tangent: diag(Et, 0, 0) for a fixed wrinkle direction, plane stress for an isotropic
film, diag(Et, 0, G) with G = N/(2 (e1 - e2)) for a wrinkled tension field, whose principal strains
differ by e1 - e2 = (1 + nu) N/Et + s with s the hoop slack. At s = 0 that G is Et/(2 (1 + nu)) at any p.

For harmonic n, a and w go with cos(n theta) and b with sin(n theta); integrals over theta leave pi.

The lowest critical pressure. In every law above C/p falls with p, and the rest of K(p)/p does not depend
on p. So the lowest eigenvalue of K(p)/p falls with p too: it has one zero at most, found by bracketing.

None at all. As p -> 0, C/p grows beyond bounds and what is left are the motions without strain energy.
Of the fixed direction these have e = 0, that is w = -a'/k, and any b, for hoop and shear are free. On
them K(p)/p is the same at every p: N (b'^2 + w'^2), which does not know n, against -2 n b w/R, which
grows with n. From n = 7 on it is negative for some of them, so that no pressure is stable. A mesh has a
critical pressure there only because it cannot follow such a motion. The wrinkled tension field at s = 0
has shear stiffness too, and the same happens from n = 13 on, with b' - (n a + R' b)/R = 0 besides.
`Lobe.at_any_pressure` computes that least value.
"""

from functools import cached_property

import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import eigh
from scipy.optimize import brentq
from scipy.special import ellipeinc, ellipj

ET, NU = 3.5e9 * 5e-5, 0.3
EDGE_RADIUS, TRUNCATION = 2.0, 0.55


def meridian_end():
    """Elliptic argument of the edge |z| = 0.55 R0 and R0 [m] for an edge radius of 2 m."""

    def height(x):
        return (2 * ellipeinc(ellipj(x, 0.5)[3], 0.5) - x) / np.sqrt(2)

    end = brentq(lambda x: height(x) - TRUNCATION, 0.1, 1.8, xtol=1e-15)
    return end, EDGE_RADIUS / ellipj(end, 0.5)[1]


class Lobe:
    """The quadratic forms of one harmonic on a basis of polynomials along the meridian.

    Args:
        n: harmonic.
        degree: polynomials up to this degree in each of a, b, w.
    """

    def __init__(self, n, degree=40):
        self.n, self.degree = n, degree
        end, self.R0 = meridian_end()
        self.half = end * self.R0 / np.sqrt(2)  # half the arc length
        x, weight = legendre.leggauss(2 * degree + 20)
        self.x = x
        sn, cn, dn, _ = ellipj(end * x, 0.5)
        self.R, self.dR, self.dz = self.R0 * cn, -np.sqrt(2) * sn * dn, cn**2
        self.k, self.dk = 2 * self.R / self.R0**2, 2 * self.dR / self.R0**2
        self.N = self.R0**2 / (2 * self.R)  # per Pa
        self.dA = weight * self.half * self.R

    @cached_property
    def held(self):
        """(a, a', b, b', w, w') of all basis motions, each (3 (degree - 1), points), zero on the rims.

        Integrals of Legendre polynomials, orthonormal in their derivatives.
        """
        P = legendre.legvander(self.x, self.degree)
        j = np.arange(1, self.degree)
        value = (P[:, 2:] - P[:, :-2]) / np.sqrt(2 * (2 * j + 1))
        slope = P[:, 1:-1] * np.sqrt((2 * j + 1) / 2) / self.half
        zero = np.zeros_like(value)
        rows = [
            np.hstack([f if i == at else zero for i in range(3)]).T for at in range(3) for f in (value, slope)
        ]
        return tuple(rows)

    def strains(self, motions):
        """e, f, g of motions."""
        a, da, b, db, w, _ = motions
        R, n = self.R, self.n
        return da + self.k * w, (n * b + self.dR * a + self.dz * w) / R, db - (n * a + self.dR * b) / R

    def geometric(self, motions):
        """Matrix of what is proportional to p, per Pa."""
        a, _, b, db, w, dw = motions
        e, f, _ = self.strains(motions)
        R, n = self.R, self.n
        gradient = sum(self._product(g, self.N, g) for g in (e, db, dw - self.k * a))
        volume = (
            self._product(w, 1.0, e + f)
            + self._product(b, 1 / R, n * w + self.dz * b)
            - self._product(a, 1.0, dw - self.k * a)
        )
        return gradient - (volume + volume.T) / 2

    def _product(self, left, factor, right):
        return left @ (factor * self.dA * right).T

    def stiffness(self, law, p, slack=0.0):
        """The film's tangent C at pressure p: 3 x 3 entries, each a number or one per point."""
        if law == "fixed":
            return np.diag([ET, 0, 0]).tolist()
        C = ET / (1 - NU**2)
        if law == "isotropic":
            return [[C, NU * C, 0], [NU * C, C, 0], [0, 0, ET / (2 * (1 + NU))]]
        if law == "mean":  # of isotropic and wrinkled at s = 0
            half = C / 2
            return [[(ET + C) / 2, NU * half, 0], [NU * half, half, 0], [0, 0, ET / (2 * (1 + NU))]]
        N = p * self.N
        return [[ET, 0, 0], [0, 0, 0], [0, 0, N / (2 * ((1 + NU) * N / ET + slack))]]

    def tangent(self, law, p, slack=0.0):
        """Matrix K(p) [J/m^2 per pi] on the held polynomials."""
        C, strains = self.stiffness(law, p, slack), self.strains(self.held)
        K = p * self.geometric(self.held)
        for i in range(3):
            for j in range(3):
                if np.any(C[i][j]):
                    K += self._product(strains[i], C[i][j], strains[j])
        return K

    def lowest(self, law, p, slack=0.0):
        """Lowest eigenvalue of K(p)/p."""
        return eigh(self.tangent(law, p, slack) / p, eigvals_only=True, subset_by_index=(0, 0))[0]

    def critical_pressure(self, law="fixed", slack=0.0, low=1.0, high=1e8):
        """The pressure [Pa] where K(p) turns indefinite; 0 where it is at `low`, inf if not at `high`."""
        if self.lowest(law, low, slack) < 0:
            return 0.0
        if self.lowest(law, high, slack) > 0:
            return np.inf
        root = brentq(lambda t: self.lowest(law, np.exp(t), slack), np.log(low), np.log(high), rtol=1e-14)
        return float(np.exp(root))

    def free_motions(self, law="fixed"):
        """Motions without strain energy, exactly, as in `held`.

        fixed: a with double zeros at the rims, w = -a'/k, and any b. wrinkled (no shear either): b with
        triple zeros, a = (R b' - R' b)/n, w = -a'/k.
        """
        order = 2 if law == "fixed" else 3
        bubble = legendre.Legendre([2 / 3, 0, -2 / 3]) ** order  # (1 - x^2)^order
        rows = []
        for j in range(self.degree - 2 * order):
            f = bubble * legendre.Legendre.basis(j)
            rows.append([f.deriv(i)(self.x) / self.half**i for i in range(4)])
        F, dF, d2F, d3F = (np.array(r) for r in zip(*rows, strict=True))
        if law == "fixed":
            a, da, d2a = F, dF, d2F
        else:
            d2R, d3R = -self.k * self.dz, -self.dk * self.dz - self.k * self.k * self.dR
            a = (self.R * dF - self.dR * F) / self.n
            da = (self.R * d2F - d2R * F) / self.n
            d2a = (self.R * d3F + self.dR * d2F - d2R * dF - d3R * F) / self.n
        w, dw = -da / self.k, -d2a / self.k + da * self.dk / self.k**2
        if law == "fixed":
            zero = np.zeros_like(a)
            b, db = (r[self.degree - 1 : 2 * (self.degree - 1)] for r in self.held[2:4])
            pad = np.zeros_like(b)
            return tuple(
                np.vstack(v) for v in ((a, pad), (da, pad), (zero, b), (zero, db), (w, pad), (dw, pad))
            )
        return a, da, F, dF, w, dw

    def at_any_pressure(self, law="fixed"):
        """Least value of K(p)/p, which no p changes, over motions without strain energy.

        Relative to the integral of |u,s|^2; negative: unstable at any pressure.
        """
        motions = self.free_motions(law)
        a, _, _, db, _, dw = motions
        e = self.strains(motions)[0]
        scale = sum(self._product(g, 1.0, g) for g in (e, db, dw - self.k * a))
        return eigh(self.geometric(motions), scale, eigvals_only=True, subset_by_index=(0, 0))[0]
