"""Modes of every harmonic from the equilibrium of one sector, by condensation onto its cuts.

In a motion of harmonic n the far cut of a sector does what the near one does, rotated by alpha = 2 pi/N and
multiplied by e^{i n alpha}. Only the cuts feel n. With A = K - sigma M of one sector whose cuts are free, its
inner unknowns are eliminated once,

    S = A_cc - A_ci A_ii^{-1} A_ic,    S_n = T_n^H S T_n,    T_n = [1, e^{i n alpha} R, plates of n],

for all n together: S is real, and what is left of each harmonic is a dense Hermitian matrix as wide as one
cut. A_ii and S_n positive definite prove that no eigenvalue of harmonic n lies below sigma, so that Lanczos'
method on A_n^{-1} M_n finds the lowest ones and none is missed. Harmonic -n has the same eigenvalues.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from scipy.sparse.csgraph import reverse_cuthill_mckee
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

from lobefem.errors import EigenError, InputError
from lobefem.fem.balloon import Balloon
from lobefem.fem.cyclic_symmetry import plate_basis, ties
from lobefem.linalg.banded import as_scipy
from lobefem.typing import Array, ComplexArray

__all__ = ["Condensed", "GoreMode", "GoreSector"]


class GoreMode(NamedTuple):
    """An eigenvalue of harmonic n with its vector of unit mass on all sectors.

    Attributes:
        harmonic: n, the phase from sector to sector over 2 pi/N.
        value: lambda [Pa/m].
        vector: of the sector's untied unknowns.
        residual: ||K_n phi - lambda M_n phi||/||K_n phi||.
    """

    harmonic: int
    value: float
    vector: ComplexArray
    residual: float


class GoreSector:
    """One sector with free cuts: its unknowns as inner ones, those of the near cut and of the plates.

    Args:
        balloon: of one sector, tied or not.

    Attributes:
        balloon: untied.
        order: number N of sectors.
        inner, near, far, plates: places in the untied q; near and far correspond.

    Raises:
        InputError: a whole balloon.
    """

    def __init__(self, balloon: Balloon) -> None:
        if balloon.surface.copies < 2:
            raise InputError("this is a whole balloon; mesh one sector of it")
        self.balloon = loose = balloon.untied()
        self.order = int(loose.surface.copies)
        pairs = ties(loose.V, loose.X, loose.surface, loose.axis)
        numbers = loose.map.numbers.reshape(-1, 3)
        free = (numbers[pairs.far].min(axis=1) >= 0) & (numbers[pairs.near].min(axis=1) >= 0)
        self.near, self.far = numbers[pairs.near[free]].ravel(), numbers[pairs.far[free]].ravel()
        size, params = loose.map.size, loose.map.num_parameters
        self.plates = np.arange(size - params, size)
        self.inner = np.setdiff1d(np.arange(size - params), np.concatenate([self.near, self.far]))
        self._rotation = pairs.rotation

    @property
    def harmonics(self) -> range:
        """All harmonics: 0 to N/2."""
        return range(self.order // 2 + 1)

    def phase(self, harmonic: int) -> complex:
        """Factor e^{i n alpha} from one sector to the next."""
        angle = 2.0 * math.pi * harmonic / self.order
        return complex(math.cos(angle), math.sin(angle))

    def copies(self, harmonic: int) -> int:
        """Multiplicity of each eigenvalue of a harmonic in the full model: of n and of -n."""
        return 1 if harmonic == 0 or 2 * harmonic == self.order else 2

    def plate_basis(self, harmonic: int) -> ComplexArray:
        """Plate parameters (rows) that move in a harmonic (columns): see `plate_basis`."""
        return plate_basis(self.balloon.motion, self.balloon.axis, harmonic)

    def aligned(self, matrix: Any) -> Any:
        """A matrix in q, the far cut's components in the near one's axes, as a SciPy matrix."""
        matrix = as_scipy(matrix)
        nodes = self.far.reshape(-1, 3)
        kept = np.ones(matrix.shape[0])
        kept[self.far] = 0.0
        blocks = np.tile(self._rotation.ravel(), len(nodes))
        rows, columns = np.repeat(nodes, 3, axis=1).ravel(), np.tile(nodes, (1, 3)).ravel()
        turn = sp.csr_matrix((blocks, (rows, columns)), shape=matrix.shape)
        Q = (sp.diags(kept) + turn).tocsr()
        return (Q.T @ matrix @ Q).tocsr()

    def unknowns(self, harmonic: int, inner: ComplexArray, cut: ComplexArray) -> ComplexArray:
        """A vector in the untied q from its inner part and that of the cut and the plates."""
        q = np.zeros(self.balloon.map.size, dtype=complex)
        near, plates = cut[: len(self.near)], cut[len(self.near) :]
        q[self.inner], q[self.near] = inner, near
        q[self.far] = (self.phase(harmonic) * near.reshape(-1, 3) @ self._rotation.T).ravel()
        if plates.size:
            q[self.plates] = self.plate_basis(harmonic) @ plates
        return q


class Condensed:
    """A sector's pencil less a shift, condensed onto its cuts and plates.

    Args:
        sector: whose pencil it is.
        K: aligned tangent of the sector, symmetric.
        M: its aligned mass.
        shift: sigma.

    Attributes:
        inner_is_positive: True if no eigenvalue of the sector with fixed cuts lies below the shift.
    """

    def __init__(self, sector: GoreSector, K: Any, M: Any, shift: float) -> None:
        self._sector, self._K, self._M, self.shift = sector, K, M, shift
        inner, self._ends = sector.inner, np.concatenate([sector.near, sector.far, sector.plates])
        A = (K - shift * M).tocsr()
        self._A_ie = A[inner][:, self._ends].tocsr()
        core = A[inner][:, inner].tocsr()
        self._order = reverse_cuthill_mckee(core, symmetric_mode=True) if len(inner) else inner
        lower = sp.tril(core[self._order][:, self._order]).tocoo()
        width = int((lower.row - lower.col).max(initial=0))
        band = np.zeros((width + 1, len(inner)))
        band[lower.row - lower.col, lower.col] = lower.data
        self.inner_is_positive = True
        self._S = A[self._ends][:, self._ends].toarray()
        self._factor: Any = None
        if not len(inner):
            return
        try:
            self._factor = scipy.linalg.cholesky_banded(
                band, lower=True, overwrite_ab=True, check_finite=False
            )
        except np.linalg.LinAlgError:
            self.inner_is_positive = False
            return
        X = self._solve_inner(self._A_ie.toarray())
        self._S -= self._A_ie.T @ X

    def _solve_inner(self, b: Array) -> Array:
        """A_ii^{-1} b for real columns."""
        if self._factor is None:
            return b
        x = np.empty_like(b)
        x[self._order] = scipy.linalg.cho_solve_banded(
            (self._factor, True), b[self._order], check_finite=False
        )
        return x

    def _solve_complex(self, b: ComplexArray) -> ComplexArray:
        components = self._solve_inner(np.stack([b.real, b.imag], axis=1))
        return components[:, 0] + 1j * components[:, 1]

    def _basis(self, harmonic: int) -> Any:
        """T_n: from the near cut and the plates of n to both cuts and all plates."""
        cut = sp.identity(len(self._sector.near), dtype=complex)
        plates = sp.csr_matrix(self._sector.plate_basis(harmonic))
        film = sp.vstack([cut, self._sector.phase(harmonic) * cut])
        return sp.block_diag([film, plates]).tocsr() if self._sector.plates.size else film.tocsr()

    def factor(self, harmonic: int) -> tuple[Any, ComplexArray] | None:
        """T_n with the Cholesky factor of S_n; None where an eigenvalue of n lies below the shift."""
        T = self._basis(harmonic)
        S = T.conj().T @ (T.T @ self._S.T).T
        try:
            return T, np.linalg.cholesky(S)
        except np.linalg.LinAlgError:
            return None

    def lowest(
        self, harmonic: int, count: int, start: ComplexArray | None = None
    ) -> tuple[Array, ComplexArray]:
        """The lowest eigenvalues of a harmonic with their vectors, inner part first (count,), (size, count).

        Raises:
            EigenError: Lanczos' method did not converge.
        """
        found = self.factor(harmonic)
        if found is None:
            raise EigenError(f"harmonic {harmonic} has an eigenvalue below the shift {self.shift:.3g} Pa/m")
        T, L = found
        inner = self._sector.inner
        num = len(inner)
        A_ic = (self._A_ie @ T).tocsr()
        M_ii, M_ic, M_cc = self._mass(T)
        size = num + T.shape[1]

        def mass(x: ComplexArray) -> ComplexArray:
            i, c = x[:num], x[num:]
            return np.concatenate([M_ii @ i + M_ic @ c, M_ic.conj().T @ i + M_cc @ c])

        def solve(b: ComplexArray) -> ComplexArray:
            z = self._solve_complex(b[:num])
            c = scipy.linalg.cho_solve((L, True), b[num:] - A_ic.conj().T @ z, check_finite=False)
            return np.concatenate([self._solve_complex(b[:num] - A_ic @ c), c])

        shape = (size, size)
        operator = {"M": LinearOperator(shape, mass, dtype=complex), "Minv": None}
        inverse = LinearOperator(shape, solve, dtype=complex)
        rng = np.random.default_rng(1)
        v0 = start if start is not None else rng.standard_normal(size) + 1j * rng.standard_normal(size)
        try:
            values, vectors = eigsh(
                LinearOperator(shape, lambda x: x, dtype=complex),
                count,
                M=operator["M"],
                sigma=self.shift,
                OPinv=inverse,
                v0=v0,
                ncv=min(size - 1, max(2 * count + 8, 12)),
                which="LM",
            )
        except ArpackError as error:
            raise EigenError(
                f"the modes of harmonic {harmonic} did not converge ({error}); try fewer"
            ) from error
        first = np.argsort(values)
        return values[first], vectors[:, first]

    def _mass(self, T: Any) -> tuple[Any, Any, Any]:
        inner, ends = self._sector.inner, self._ends
        rows = self._M[inner]
        return rows[:, inner], (rows[:, ends] @ T).tocsr(), (T.conj().T @ self._M[ends][:, ends] @ T).tocsr()


def modes_of_sector(
    balloon: Balloon, q: Any, harmonics: Sequence[int], count: int, scale: float
) -> list[GoreMode]:
    """The lowest `count` modes of each of some harmonics at a symmetric state of one sector.

    Args:
        balloon: of one sector, its loads set.
        q: unknowns of the tied balloon.
        harmonics: n, from 0 to N/2.
        count: of each harmonic.
        scale: size of the first shift [Pa/m], of the lowest eigenvalues' order or less.

    Raises:
        EigenError: a harmonic did not converge.
    """
    sector = GoreSector(balloon)
    loose = sector.balloon
    balloon.set_unknowns(q)
    own = loose.unknowns_of(balloon)
    K, M = sector.aligned(loose.tangent(own)), sector.aligned(loose.mass(own))
    condensed: Condensed | None = None
    shift, found = -abs(scale), []
    for n in harmonics:
        while condensed is None or not condensed.inner_is_positive or condensed.factor(n) is None:
            if condensed is not None:
                shift *= 4
            if shift < -1e15:
                raise EigenError("no shift below the spectrum was found; are the loads finite?")
            condensed = Condensed(sector, K, M, shift)
        values, vectors = condensed.lowest(n, count)
        for value, vector in zip(values, vectors.T, strict=True):
            phi = sector.unknowns(n, vector[: len(sector.inner)], vector[len(sector.inner) :])
            found.append(GoreMode(n, float(value), phi, 0.0))
    return found
