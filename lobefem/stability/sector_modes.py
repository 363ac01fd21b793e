"""The lowest modes of single harmonics, K_n phi = lambda M_n phi, from one sector."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
import scipy.sparse as sp

from lobefem.equilibrium.newton import revealing_pressure
from lobefem.fem.balloon import Balloon
from lobefem.files import on_all
from lobefem.frozen import Frozen
from lobefem.linalg.banded import HERMITIAN, as_scipy, asymmetry, lowest
from lobefem.stability.cyclic import Sector, own_pairs
from lobefem.typing import Array, Comm, ComplexArray, Mass, Sparse, Vec

__all__ = ["SectorMode", "mass_matrix", "modes_of_harmonics"]


class SectorMode(NamedTuple):
    """An eigenvalue of harmonic n with its vector in q_n, of unit mass; -n has their conjugates.

    Attributes:
        harmonic: n.
        value: lambda.
        vector: phi in q_n.
        residual: ||K_n phi - lambda M_n phi||/||K_n phi||.
        asymmetry: of K_n, relative.
        hermitian: whether K_n counts as such.
    """

    harmonic: int
    value: complex
    vector: ComplexArray
    residual: float
    asymmetry: float
    hermitian: bool


def modes_of_harmonics(
    sector: Sector, q: Vec, harmonics: Sequence[int], count: int, *, mass: Mass, scale: float, comm: Comm
) -> list[SectorMode]:
    """The lowest modes of some harmonics together, dealt out to the ranks. Collective over `comm`.

    Values are two-sided quotients of an unassembled K, as in `lobefem.linalg.slepc.refine`.

    Args:
        sector: with its balloon's loads set.
        q: the sector's state.
        harmonics: n, each at least 0 and at most N/2.
        count: how many of all the wanted harmonics, those that the full model has twice counted twice.
        mass: "unit" or "nodal".
        scale: size of the first shift, of the lowest eigenvalues' order or less.
        comm: the ranks.

    Returns:
        the modes in ascending order of their real parts, and the rigid rotation that supports leave.

    Raises:
        EigenError: a harmonic's problem did not converge.
    """
    balloon = sector.balloon
    K, M = as_scipy(balloon.tangent(q)), mass_matrix(sector, q, mass)
    revealing = _loaded(sector, q, K)
    found: list[_Raw] = []

    def solve() -> list[tuple[float, int]]:
        found.extend(
            _Raw.solve(sector, q, K, M, revealing, n, count, scale)
            for n in list(harmonics)[comm.rank :: comm.size]
        )
        return [(v, one.copies) for one in found for v in one.values.real]

    components = on_all(comm, solve)
    everything = sorted(v for values in components for v, copies in values for _ in range(copies))
    last = everything[min(count, len(everything)) - 1]
    last += 1e-6 * abs(last - everything[0])
    own = [one.mode(sector, q, int(k)) for one in found for k in np.flatnonzero(one.values.real <= last)]
    own += [one.turn(sector, q) for one in found if one.rotation is not None]
    modes = [mode for part in comm.allgather(own) for mode in part]
    return sorted(modes, key=lambda m: (m.value.real, m.harmonic))


@dataclass(frozen=True)
class _Raw(Frozen):
    """The solution of one harmonic's assembled problem."""

    harmonic: int
    copies: int
    K: Any
    M: Any
    values: ComplexArray
    right: ComplexArray
    left: ComplexArray | None
    asymmetry: float
    hermitian: bool
    rotation: ComplexArray | None  # of unit mass, where the supports leave one

    @classmethod
    def solve(
        cls, sector: Sector, q: Vec, K: Sparse, M: Sparse, revealing: Any, n: int, count: int, scale: float
    ) -> _Raw:
        K_n, M_n = sector.reduce(K, n), sector.reduce(M, n)
        rotation = sector.rotation(q, M_n, n)
        c = None if rotation is None else M_n @ rotation
        skew = asymmetry(K_n)
        hermitian = skew < HERMITIAN
        if hermitian and revealing is not None:
            hermitian = asymmetry(sector.reduce(revealing, n)) < HERMITIAN
        size = K_n.shape[0] - (c is not None)
        found = own_pairs(sector, n, lambda k: lowest(K_n, M_n, k, scale, hermitian, c), count, size)
        values, right, left = found
        return cls(n, sector.copies(n), K_n, M_n, values, right, left, skew, hermitian, rotation)

    def turn(self, sector: Sector, q: Vec) -> SectorMode:
        """The rigid rotation; what its value shows is the error of an equilibrium that is none."""
        assert self.rotation is not None
        value = complex(sector.curvature(q, self.rotation, self.rotation, self.harmonic).real)
        return SectorMode(self.harmonic, value, self.rotation, 0.0, self.asymmetry, self.hermitian)

    def mode(self, sector: Sector, q: Vec, k: int) -> SectorMode:
        x = self.right[:, k] / np.sqrt(np.vdot(self.right[:, k], self.M @ self.right[:, k]).real)
        z, M_x, K_x = x, self.M @ x, self.K @ x
        if self.left is not None:  # the left vector that is orthogonal to all other right ones
            gram = self.left.conj().T @ (self.M @ self.right)
            z = self.left @ np.linalg.inv(gram).conj().T[:, k]
        value = sector.curvature(q, z, x, self.harmonic) / complex(np.vdot(z, M_x))
        if self.left is None:
            value = complex(value.real)
        rest = K_x - value * M_x
        if self.rotation is not None:
            rest -= self.M @ self.rotation * np.vdot(self.rotation, rest)
        error = np.linalg.norm(rest) / max(float(np.linalg.norm(K_x)), 1e-300)
        return SectorMode(self.harmonic, value, x, float(error), self.asymmetry, self.hermitian)


def _loaded(sector: Sector, q: Vec, K: Sparse) -> Any:
    """The tangent at a pressure beside which no asymmetry is round-off; None where there can be none."""
    balloon = sector.balloon
    if balloon.load.convention == "closed":
        return None
    loads = float(balloon.pressure.value), float(balloon.prestress.value)
    balloon.set_loads(revealing_pressure(balloon, float(abs(K).max())), 0.0)
    found = as_scipy(balloon.tangent(q))
    balloon.set_loads(*loads)
    return found


class _Cut(Protocol):
    """A sector, as far as its mass goes."""

    balloon: Balloon

    def cut_weights(self) -> Array:
        """Share of the sector in each of its nodes."""


def mass_matrix(sector: _Cut, q: Vec, kind: Mass) -> Sparse:
    """The mass of the sector's unknowns; each node on a cut has half of the "nodal" identity."""
    balloon = sector.balloon
    if kind == "unit":
        return as_scipy(balloon.mass(q))
    w, dw, _ = balloon.map.plate_parameters(balloon.map.parameters(q))
    J = as_scipy(balloon.map.jacobian(w, dw))
    return J.T @ sp.diags(np.repeat(sector.cut_weights(), 3)) @ J
