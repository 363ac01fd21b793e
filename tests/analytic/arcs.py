"""Pumpkins of hoop fibres as exact circular arcs between polygonal tendons; nothing of lobefem is used.

N elastic tendons from fitting to fitting are polygons. At each station a fibre of fixed length, an arc of a
circle, spans the chord between neighbouring tendons, in the plane normal to the line through the chords'
middles. With the volume V within the chords, the area A between arc and chord, its first moment M about the
chord, and the length l and the angle theta of that line, the potential is

    Pi = sum over tendons of EA/2 int e^2 ds - p (V + sum over gores of (int A dl + int M d theta)).

The last term is there because a lobe is longer outside than at its chord; `moment=False` leaves it out.
Lengths are in the equator's radius, forces in p times its square. The number of lobes may be any real number.
Derivatives are taken by complex steps and central differences.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq

TRIANGLES = ((0, 1, 3), (0, 3, 2), (0, 1, 2), (1, 3, 2))  # of points 0 1 below and 2 3 above, two halvings


def segment(chord, fibre):
    """Area between arcs and their chords, and its first moment about the chord."""
    q = chord / fibre
    a = np.sqrt(6 * (1 - q))
    for _ in range(7):  # sin a = q a
        a = a - (np.sin(a) - q * a) / (np.cos(a) - q)
    rho, s, c = fibre / (2 * a), np.sin(a), np.cos(a)
    area = rho**2 * (a - s * c)
    return area, 2 / 3 * rho**3 * s**3 - rho * c * area


def norm(v):
    return np.sqrt((v * v).sum(-1))


def derivatives(energy, y):
    """Gradient and Hessian of energies of local points, (elements, points, 3), flattened."""
    count, size = len(y), y[0].size
    flat = y.reshape(count, size).astype(complex)
    tiny, step = 1e-30, 1e-5

    def gradient(at):
        found = np.zeros((count, size))
        for i in range(size):
            moved = at.copy()
            moved[:, i] += 1j * tiny
            found[:, i] = energy(moved.reshape(y.shape)).imag / tiny
        return found

    hessian = np.zeros((count, size, size))
    for j in range(size):
        shift = np.zeros(size)
        shift[j] = step
        hessian[:, j] = (gradient(flat + shift) - gradient(flat - shift)) / (2 * step)
    return gradient(flat), (hessian + hessian.transpose(0, 2, 1)) / 2


class Arcs:
    """Pumpkin of a real number of lobes with a constant half angle [rad], in equilibrium."""

    def __init__(self, lobes, half_angle, *, stations=61, end=0.03, strain=1 / 3000, moment=True):
        # the isotensoid: sin phi = r^2; with r^2 = sin t: dr = cos t/(2 sqrt(sin t)) dt, ds = dr/cos t
        first = math.asin(end**2)
        t = np.linspace(first, math.pi - first, 20001)
        root = np.sqrt(np.sin(t))
        both = np.stack([1 / (2 * root), root / 2])
        s, z = np.pad(np.cumsum((t[1] - t[0]) * (both[:, 1:] + both[:, :-1]) / 2, axis=1), ((0, 0), (1, 0)))
        at = np.linspace(0.0, s[-1], stations)
        r, z = np.interp(at, s, root), np.interp(at, s, z)
        self.lobes, self.end, self.moment, self.turn = lobes, end, moment, 2 * math.pi / lobes
        self.rest = np.hypot(np.diff(r), np.diff(z))
        self.fibre = 2 * r * math.sin(math.pi / lobes) * half_angle / math.sin(half_angle)
        self.EA = math.pi / lobes / strain
        c, s = math.cos(self.turn), math.sin(self.turn)
        self.rotation = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
        self.x = self._equilibrium(np.column_stack([r, np.zeros_like(r), z]))

    def cells(self, y):
        """Energy of the tendon, minus the volume within chords and arcs, of four points."""
        strain = norm(y[:, 2] - y[:, 0]) / self.rest - 1
        tendon = self.EA * self.rest / 2 * strain**2
        volume = sum((np.cross(y[:, a], y[:, b]) * y[:, c]).sum(-1) for a, b, c in TRIANGLES) / 12
        areas = [
            segment(norm(y[:, k + 1] - y[:, k]), fibre)[0]
            for k, fibre in ((0, self.fibre[:-1]), (2, self.fibre[1:]))
        ]
        line = norm(y[:, 2] + y[:, 3] - y[:, 0] - y[:, 1]) / 2
        return tendon - volume - (areas[0] + areas[1]) / 2 * line

    def bends(self, y):
        """Minus the volume that the bend of the line through three chords adds, of six points."""
        lines = [y[:, k + 2] + y[:, k + 3] - y[:, k] - y[:, k + 1] for k in (0, 2)]
        before, after = (line / norm(line)[:, None] for line in lines)
        chord = y[:, 3] - y[:, 2]
        outwards = np.cross(chord, before + after)
        outwards = outwards / norm(outwards)[:, None]
        _, moment = segment(norm(chord), self.fibre[1:-1])
        return -moment * ((before - after) * outwards).sum(-1)

    def folded(self, x, phase):
        """Gradient (3n) and Hessian (3n, 3n) of the tendon's motion, the next one's by a phase."""
        n = len(x)
        both = np.stack([x, x @ self.rotation.T], axis=1)  # (n, 2, 3)
        G, H = np.zeros(3 * n, complex), np.zeros((3 * n, 3 * n), complex)
        for rows, energy in ((2, self.cells), (3, self.bends))[: 1 + self.moment]:
            count = n - rows + 1
            y = np.concatenate([both[k : count + k] for k in range(rows)], axis=1)
            g, h = derivatives(energy, y)
            pair = np.concatenate([np.eye(3), phase * self.rotation])
            T = np.kron(np.eye(rows), pair)
            g, h = g @ T, T.conj().T @ h @ T
            for e in range(count):
                at = slice(3 * e, 3 * (e + rows))
                G[at] += g[e]
                H[at, at] += h[e]
        return G, H

    def _equilibrium(self, x):
        """Tendon in its plane: bottom fitting held, the top one free along the axis under pressure."""
        free = np.ones((len(x), 3), bool)
        free[:, 1] = False
        free[0] = False
        free[-1, 0] = False
        at = free.ravel()
        for _ in range(60):
            g, K = (part.real for part in self.folded(x, 1.0))
            g[-1] -= math.sin(self.turn) / 2 * self.end**2 / 3  # the cone from the origin to the top fitting
            step = np.zeros(x.size)
            step[at] = np.linalg.solve(K[np.ix_(at, at)], -g[at])
            largest = np.abs(step).max()
            x = x + step.reshape(x.shape) * min(1.0, 0.02 / largest)
            if largest < 1e-9:
                return x
        raise RuntimeError("no equilibrium of the arcs")

    def tensions(self):
        """Tension of all tendons by cell, in pi p r0^2."""
        return self.lobes * self.EA * (norm(np.diff(self.x, axis=0)) / self.rest - 1) / math.pi

    def lowest(self, harmonic):
        """Lowest eigenvalue of a harmonic above 1, in which the fittings rest."""
        _, K = self.folded(self.x, np.exp(1j * harmonic * self.turn))
        return float(np.linalg.eigvalsh(K[3:-3, 3:-3])[0])


def critical_lobes(half_angle, near, *, harmonic=4, **options):
    """Number of lobes at which a harmonic loses its stiffness."""

    def value(lobes):
        return Arcs(lobes, half_angle, **options).lowest(harmonic)

    return brentq(value, 0.85 * near, 1.15 * near, xtol=1e-4 * near)
