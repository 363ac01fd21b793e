"""The lowest modes of single harmonics, K_n phi = lambda M_n phi, from one sector."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp

from lobefem._banded import HERMITIAN, asymmetry, lowest
from lobefem._files import on_all
from lobefem._records import Frozen
from lobefem._snes import revealing_pressure
from lobefem.cyclic import Sector, as_scipy, own_pairs

__all__ = ["SectorMode", "mass_matrix", "modes_of_harmonics"]

Complex = npt.NDArray[np.complex128]


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
    vector: Complex
    residual: float
    asymmetry: float
    hermitian: bool


def modes_of_harmonics(
    sector: Sector, q: Any, harmonics: Sequence[int], count: int, *, mass: str, scale: float, comm: Any
) -> list[SectorMode]:
    """The lowest modes of some harmonics together, dealt out to the ranks. Collective over `comm`.

    Values are two-sided quotients of an unassembled K, as in `lobefem.eigenpairs.refine`.

    Args:
        sector: with its balloon's loads set.
        q: the sector's state.
        harmonics: n, each at least 0 and at most N/2.
        count: how many of all the wanted harmonics, those that the full model has twice counted twice.
        mass: "unit" or "nodal".
        scale: size of the first shift, of the lowest eigenvalues' order or less.
        comm: the ranks.

    Returns:
        the modes in ascending order of their real parts.

    Raises:
        EigenError: a harmonic's problem did not converge.
    """
    balloon = sector.balloon
    K, M = as_scipy(balloon.tangent(q)), mass_matrix(sector, q, mass)
    revealing = _loaded(sector, q, K)
    found: list[_Raw] = []

    def solve() -> list[tuple[float, int]]:
        found.extend(
            _Raw.solve(sector, K, M, revealing, n, count, scale)
            for n in list(harmonics)[comm.rank :: comm.size]
        )
        return [(v, one.copies) for one in found for v in one.values.real]

    parts = on_all(comm, solve)
    everything = sorted(v for values in parts for v, copies in values for _ in range(copies))
    last = everything[min(count, len(everything)) - 1]
    last += 1e-6 * abs(last - everything[0])
    own = [one.mode(sector, q, int(k)) for one in found for k in np.flatnonzero(one.values.real <= last)]
    modes = [mode for part in comm.allgather(own) for mode in part]
    return sorted(modes, key=lambda m: (m.value.real, m.harmonic))


@dataclass(frozen=True)
class _Raw(Frozen):
    """The solution of one harmonic's assembled problem."""

    harmonic: int
    copies: int
    K: Any
    M: Any
    values: Complex
    right: Complex
    left: Complex | None
    asymmetry: float
    hermitian: bool

    @classmethod
    def solve(cls, sector: Sector, K: Any, M: Any, revealing: Any, n: int, count: int, scale: float) -> _Raw:
        K_n, M_n = sector.reduce(K, n), sector.reduce(M, n)
        skew = asymmetry(K_n)
        hermitian = skew < HERMITIAN
        if hermitian and revealing is not None:
            hermitian = asymmetry(sector.reduce(revealing, n)) < HERMITIAN
        found = own_pairs(sector, n, lambda k: lowest(K_n, M_n, k, scale, hermitian), count, K_n.shape[0])
        values, right, left = found
        return cls(n, sector.copies(n), K_n, M_n, values, right, left, skew, hermitian)

    def mode(self, sector: Sector, q: Any, k: int) -> SectorMode:
        x = self.right[:, k] / np.sqrt(np.vdot(self.right[:, k], self.M @ self.right[:, k]).real)
        z, M_x, K_x = x, self.M @ x, self.K @ x
        if self.left is not None:  # the left vector that is orthogonal to all other right ones
            gram = self.left.conj().T @ (self.M @ self.right)
            z = self.left @ np.linalg.inv(gram).conj().T[:, k]
        value = sector.curvature(q, z, x, self.harmonic) / complex(np.vdot(z, M_x))
        if self.left is None:
            value = complex(value.real)
        error = np.linalg.norm(K_x - value * M_x) / max(float(np.linalg.norm(K_x)), 1e-300)
        return SectorMode(self.harmonic, value, x, float(error), self.asymmetry, self.hermitian)


def _loaded(sector: Sector, q: Any, K: Any) -> Any:
    """The tangent at a pressure beside which no asymmetry is round-off; None where there can be none."""
    balloon = sector.balloon
    if balloon.load.convention == "closed":
        return None
    loads = float(balloon.pressure.value), float(balloon.prestress.value)
    balloon.set_loads(revealing_pressure(balloon, float(abs(K).max())), 0.0)
    found = as_scipy(balloon.tangent(q))
    balloon.set_loads(*loads)
    return found


def mass_matrix(sector: Sector, q: Any, kind: str) -> Any:
    """The mass of the sector's unknowns; each node on the cut has half of the "nodal" identity."""
    balloon = sector.balloon
    if kind == "unit":
        return as_scipy(balloon.mass(q))
    w, dw, _ = balloon.map.plate_parameters(balloon.map.parameters(q))
    J = as_scipy(balloon.map.jacobian(w, dw))
    return J.T @ sp.diags(np.repeat(sector.cut_weights(), 3)) @ J
