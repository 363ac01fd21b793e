"""Modes of every harmonic from the equilibrium of one sector, by condensation onto its cuts.

In a motion of harmonic n the far cut of a sector does what the near one does, rotated by alpha = 2 pi/N and
multiplied by e^{i n alpha}. Only the cuts feel n. With A = K - sigma M of one sector whose cuts are free, its
inner unknowns are eliminated once,

    S = A_ee - A_ei A_ii^{-1} A_ie,    S_n = T_n^H S T_n,    T_n = [1, e^{i n alpha} R, plates of n],

for all n together: S is real, and what is left of each harmonic is a dense Hermitian matrix as wide as one
cut. A_ii and S_n positive definite prove that no eigenvalue of harmonic n lies below sigma, so that Arnoldi's
method on A_n^{-1} M_n finds the lowest ones. Where A_ii is positive definite, as many eigenvalues of n lie
below sigma as S_n has negative ones. Harmonic -n has the eigenvalues of n.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from scipy.sparse.csgraph import reverse_cuthill_mckee
from scipy.sparse.linalg import ArpackError, LinearOperator, eigs

from lobefem import checks
from lobefem.equilibrium.newton import revealing_pressure
from lobefem.errors import EigenError, InputError
from lobefem.fem.balloon import Balloon
from lobefem.fem.cyclic_symmetry import plate_basis, ties
from lobefem.fem.functionals import displacement_of
from lobefem.linalg.banded import HERMITIAN, as_scipy
from lobefem.stability.sector_modes import mass_matrix
from lobefem.typing import Array, ComplexArray, Mass

__all__ = ["Condensed", "GoreMode", "GorePencil", "GoreSector"]

_COLUMNS = 128  # solved for at a time, which bounds the memory that a condensation takes


class GoreMode(NamedTuple):
    """An eigenvalue of harmonic n with its vector, of unit mass on one sector.

    Attributes:
        harmonic: n, the phase from sector to sector over 2 pi/N.
        value: lambda.
        vector: of the sector's untied unknowns.
        residual: ||K_n phi - lambda M_n phi||/||K_n phi||.
    """

    harmonic: int
    value: float
    vector: ComplexArray
    residual: float


class GoreSector:
    """One sector with free cuts: its unknowns as inner ones, those of the cuts and those of the plates.

    Args:
        balloon: of one sector, tied or not.

    Attributes:
        balloon: untied.
        order: number N of sectors.
        inner, near, far, plates: places in the untied q; near and far correspond.

    Raises:
        InputError: a whole balloon, or nodes of the cuts that are held in some components only.
    """

    def __init__(self, balloon: Balloon) -> None:
        if balloon.surface.copies < 2:
            raise InputError("this is a whole balloon; mesh one sector of it")
        self.balloon = loose = balloon.untied()
        self.order = int(loose.surface.copies)
        pairs = ties(loose.V, loose.X, loose.surface, loose.axis)
        numbers = loose.map.numbers.reshape(-1, 3)
        free = (numbers[np.stack([pairs.near, pairs.far])] >= 0).transpose(1, 0, 2).reshape(-1, 6)
        alike = free.all(axis=1)
        if (free.any(axis=1) & ~alike).any():
            raise InputError(
                "a single harmonic needs nodes on the cuts that are free or held in all components, alike on "
                "both; hold whole rings of nodes"
            )
        self.near, self.far = numbers[pairs.near[alike]].ravel(), numbers[pairs.far[alike]].ravel()
        size, params = loose.map.size, loose.map.num_parameters
        self.plates = np.arange(size - params, size)
        self.inner = np.setdiff1d(np.arange(size - params), np.concatenate([self.near, self.far]))
        self.ends = np.concatenate([self.near, self.far, self.plates])
        self._rotation = pairs.rotation
        self._basis: tuple[int, Any] = (-1, None)
        self._cuts = np.concatenate([pairs.near, pairs.far])

    def cut_weights(self) -> Array:
        """Share of the sector in each of its nodes, held ones included: a half on both of its cuts."""
        weights = np.ones(self.balloon.map.owned // 3)
        weights[self._cuts] = 0.5
        return weights

    @property
    def harmonics(self) -> range:
        """All harmonics: 0 to N/2."""
        return range(self.order // 2 + 1)

    def check(self, harmonic: int) -> None:
        """Refuse a harmonic that is none from 0 to N/2, by an InputError."""
        if checks.integer("a harmonic", harmonic, 0) > self.order // 2:
            raise InputError(
                f"harmonic = {harmonic}: {self.order} equal sectors have harmonics 0 to {self.order // 2}"
            )

    def phase(self, harmonic: int) -> complex:
        """Factor e^{i n alpha} from one sector to the next."""
        angle = 2.0 * math.pi * harmonic / self.order
        return complex(math.cos(angle), math.sin(angle))

    def copies(self, harmonic: int) -> int:
        """Multiplicity of each eigenvalue of a harmonic in the full model: of n and of -n."""
        return 1 if harmonic == 0 or 2 * harmonic == self.order else 2

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

    def basis(self, harmonic: int) -> Any:
        """T_n: from the near cut and the plates of n to both cuts and all plates, SciPy."""
        if self._basis[0] != harmonic:  # asked for several times in a row
            cut = sp.identity(len(self.near), dtype=complex)
            film = sp.vstack([cut, self.phase(harmonic) * cut]).tocsr()
            if self.plates.size:
                plates = plate_basis(self.balloon.motion, self.balloon.axis, harmonic)
                film = sp.block_diag([film, sp.csr_matrix(plates)]).tocsr()
            self._basis = harmonic, film
        return self._basis[1]

    def unknowns(self, harmonic: int, inner: ComplexArray, ends: ComplexArray) -> ComplexArray:
        """A vector in the untied q from its inner part and that of the near cut and the plates of n."""
        q = np.zeros(self.balloon.map.size, dtype=complex)
        q[self.inner], q[self.ends] = inner, self.basis(harmonic) @ ends
        q[self.far] = (q[self.far].reshape(-1, 3) @ self._rotation.T).ravel()
        return q

    def displacement(self, own: Any, vector: ComplexArray) -> ComplexArray:
        """Nodal displacements (nodes, 3) of a vector in the untied q at a state `own`."""
        real, imag = own.duplicate(), own.duplicate()
        real.array[:], imag.array[:] = vector.real, vector.imag
        return displacement_of(self.balloon, own, real) + 1j * displacement_of(self.balloon, own, imag)


class Condensed:
    """A sector's pencil less a shift, condensed onto its cuts and plates.

    Args:
        sector: whose pencil it is.
        K: aligned tangent of the sector.
        M: its aligned mass.
        shift: sigma.

    Attributes:
        inner_is_positive: True if no eigenvalue of the sector with fixed cuts lies below the shift; else
            nothing more can be asked.
    """

    def __init__(self, sector: GoreSector, K: Any, M: Any, shift: float) -> None:
        self._sector, self._M, self.shift = sector, M, shift
        inner, ends = sector.inner, sector.ends
        A = (K - shift * M).tocsr()
        self._A_ie = A[inner][:, ends].tocsr()
        core = A[inner][:, inner].tocsr()
        self._order = reverse_cuthill_mckee(core, symmetric_mode=True) if len(inner) else inner
        lower = sp.tril(core[self._order][:, self._order]).tocoo()
        width = int((lower.row - lower.col).max(initial=0))
        band = np.zeros((width + 1, len(inner)))
        band[lower.row - lower.col, lower.col] = lower.data
        self._S = A[ends][:, ends].toarray()
        self.inner_is_positive = True
        try:
            self._factor = scipy.linalg.cholesky_banded(
                band, lower=True, overwrite_ab=True, check_finite=False
            )
        except np.linalg.LinAlgError:
            self.inner_is_positive = False
            return
        for first in range(0, len(ends), _COLUMNS):
            some = slice(first, first + _COLUMNS)
            self._S[:, some] -= self._A_ie.T @ self._solve(self._A_ie[:, some].toarray())

    def _solve(self, b: Array) -> Array:
        """A_ii^{-1} b for real columns."""
        x = np.empty_like(b)
        x[self._order] = scipy.linalg.cho_solve_banded(
            (self._factor, True), b[self._order], check_finite=False
        )
        return x

    def _solve_complex(self, b: ComplexArray) -> ComplexArray:
        components = self._solve(np.stack([b.real, b.imag], axis=1))
        return components[:, 0] + 1j * components[:, 1]

    def _reduced(self, T: Any) -> ComplexArray:
        """S_n, its Hermitian part."""
        S = T.conj().T @ (T.T @ self._S.T).T
        return (S + S.conj().T) / 2

    def factor(self, harmonic: int) -> ComplexArray | None:
        """Cholesky's factor of S_n; None where an eigenvalue of n lies below the shift."""
        if not self.inner_is_positive:
            return None
        try:
            return np.asarray(np.linalg.cholesky(self._reduced(self._sector.basis(harmonic))), dtype=complex)
        except np.linalg.LinAlgError:
            return None

    def num_below(self, harmonic: int) -> int | None:
        """Number of eigenvalues of a harmonic below the shift, by inertia; None where A_ii cannot tell."""
        if not self.inner_is_positive:
            return None
        if self.factor(harmonic) is not None:
            return 0
        return int((np.linalg.eigvalsh(self._reduced(self._sector.basis(harmonic))) < 0).sum())

    def lowest(
        self, harmonic: int, L: ComplexArray, count: int, start: ComplexArray | None = None
    ) -> tuple[Array, ComplexArray]:
        """The lowest eigenvalues of a harmonic (count,) with their vectors (size, count), inner part first.

        Args:
            harmonic: n.
            L: of `factor`.
            count: how many.
            start: a vector that is near the first one's.

        Raises:
            EigenError: Arnoldi's method did not converge.
        """
        T, num = self._sector.basis(harmonic), len(self._sector.inner)
        A_ic = (self._A_ie @ T).tocsr()
        A_ci = A_ic.conj().T.tocsr()
        inner, ends = self._sector.inner, self._sector.ends
        rows = self._M[inner]
        M_ic = rows[:, ends] @ T
        M_n = sp.bmat([[rows[:, inner], M_ic], [M_ic.conj().T, T.conj().T @ self._M[ends][:, ends] @ T]])
        M_n = M_n.tocsr()
        size = num + T.shape[1]

        def solve(b: ComplexArray) -> ComplexArray:
            z = self._solve_complex(b[:num])
            c = scipy.linalg.cho_solve((L, True), b[num:] - A_ci @ z, check_finite=False)
            return np.concatenate([self._solve_complex(b[:num] - A_ic @ c), c])

        count = min(count, size)
        rng = np.random.default_rng(1)
        v0 = rng.standard_normal(size) + 1j * rng.standard_normal(size)
        if start is not None and start.size == size:  # with a part of every vector in it
            v0 = start / np.linalg.norm(start) + 1e-3 * v0 / np.linalg.norm(v0)
        if count > size - 2:  # as few unknowns as ARPACK does not take
            inverse = np.stack([solve(e) for e in np.eye(size, dtype=complex)], axis=1)
            inverse = (inverse + inverse.conj().T) / 2
            found, vectors = scipy.linalg.eigh(M_n.toarray(), scipy.linalg.inv(inverse))
        else:
            shape = (size, size)
            try:
                found, vectors = eigs(
                    LinearOperator(shape, lambda x: solve(M_n @ x), dtype=complex),
                    count,
                    v0=v0,
                    ncv=min(size, max(2 * count + 6, 10)),
                    which="LR",
                    tol=1e-12,
                )
            except ArpackError as error:
                raise EigenError(
                    f"the modes of harmonic {harmonic} did not converge ({error}); try fewer"
                ) from error
        first = np.argsort(-found.real)[:count]
        values: Array = self.shift + 1.0 / found.real[first]
        return values, vectors[:, first]


class GorePencil:
    """K phi = lambda M phi of every harmonic at a symmetric state of one sector.

    Args:
        sector: the sector; `balloon` has the state's loads.
        balloon: the tied one, its unknowns set to the state's.
        mass: "unit" or "nodal".
        scale: size of the first shift, of the lowest eigenvalues' order or less.
        starts: vectors of neighbouring states to start from, by harmonic; new ones are written there.

    Attributes:
        own: the state in the untied q.
        asymmetry: largest one of a harmonic that was looked at, relative.

    Raises:
        InputError: film whose stress is no energy's gradient.
    """

    def __init__(
        self,
        sector: GoreSector,
        balloon: Balloon,
        mass: Mass,
        scale: float,
        starts: dict[int, ComplexArray] | None = None,
    ) -> None:
        loose = sector.balloon
        if not loose.film.has_energy:
            raise InputError(
                f"{type(loose.film).__name__} film has no symmetric tangent, which one sector's harmonics "
                "need; use a film with an energy"
            )
        self.sector, self._scale = sector, scale
        self.own = loose.unknowns_of(balloon)
        self._K = sector.aligned(loose.tangent(self.own))
        self._M = sector.aligned(mass_matrix(sector, self.own, mass).tocsr())
        self._condensed: Condensed | None = None
        self._starts = {} if starts is None else starts
        self.asymmetry = 0.0
        self._skew, self._size = self._asymmetric_part()

    def _asymmetric_part(self) -> tuple[Any, float]:
        """K - K^T where the load's stiffness shows in it, None where there can be none, and max|K|."""
        loose = self.sector.balloon
        size = float(abs(self._K).max())
        if loose.load.convention == "closed":
            return None, size
        loads = float(loose.pressure.value), float(loose.prestress.value)
        loose.set_loads(revealing_pressure(loose, size), 0.0)
        K = self.sector.aligned(loose.tangent(self.own))
        loose.set_loads(*loads)
        return (K - K.T).tocsr(), float(abs(K).max())

    def _check_symmetry(self, harmonic: int) -> None:
        """Refuse a harmonic whose K_n is not Hermitian: `film` pressure on plates that move."""
        if self._skew is None:
            return
        inner, ends = self.sector.inner, self.sector.ends
        T = self.sector.basis(harmonic)
        parts = (
            self._skew[inner][:, inner],
            self._skew[inner][:, ends] @ T,
            T.conj().T @ self._skew[ends][:, ends] @ T,
        )
        skew = max(float(abs(part).max()) if part.nnz else 0.0 for part in parts) / self._size
        self.asymmetry = max(self.asymmetry, skew)
        if skew > HERMITIAN:
            raise InputError(
                f"the stiffness of harmonic {harmonic} is not symmetric under 'film' pressure on plates that "
                "move; use GasPressure('closed') or fixed plates, or leave this harmonic out"
            )

    def condensed_at(self, shift: float) -> Condensed:
        """The pencil less a shift, condensed."""
        return Condensed(self.sector, self._K, self._M, shift)

    def _below(self, harmonic: int) -> tuple[Condensed, ComplexArray]:
        """The pencil about a shift that is proved to be below all eigenvalues of n, with `factor`."""
        if self._condensed is None:
            self._condensed = self.condensed_at(-abs(self._scale))
        while True:
            L = self._condensed.factor(harmonic)
            if L is not None:
                return self._condensed, L
            shift = 4.0 * self._condensed.shift
            if shift < -1e15:
                raise EigenError("no shift below the spectrum was found; are the loads finite?")
            self._condensed = self.condensed_at(shift)

    def lowest(self, harmonic: int, count: int = 1) -> list[GoreMode]:
        """The lowest modes of a harmonic, ascending.

        Values are Rayleigh quotients with the second variation of the energy, integrated without assembling
        K, as in `lobefem.linalg.slepc.refine`.

        Raises:
            InputError: n out of range, or K_n that is not Hermitian.
            EigenError: no shift below the spectrum was found, or Arnoldi's method did not converge.
        """
        self.sector.check(harmonic)
        self._check_symmetry(harmonic)
        condensed, L = self._below(harmonic)
        start = next(
            (self._starts[k] for k in (harmonic, harmonic - 1, harmonic + 1) if k in self._starts), None
        )
        _, vectors = condensed.lowest(harmonic, L, count, start)
        self._starts[harmonic] = vectors[:, 0]
        found = [self._mode(harmonic, x) for x in vectors.T]
        return sorted(found, key=lambda mode: mode.value)

    def _mode(self, harmonic: int, x: ComplexArray) -> GoreMode:
        sector = self.sector
        inner, ends, T = sector.inner, sector.ends, sector.basis(harmonic)
        aligned = np.zeros(sector.balloon.map.size, dtype=complex)
        aligned[inner], aligned[ends] = x[: len(inner)], T @ x[len(inner) :]
        scale = math.sqrt(np.vdot(aligned, self._M @ aligned).real)
        if sector.copies(harmonic) == 1:  # of a real matrix: its phase is arbitrary
            largest = aligned[np.abs(aligned).argmax()]
            scale *= largest / abs(largest)
        x, aligned = x / scale, aligned / scale
        vector = sector.unknowns(harmonic, x[: len(inner)], x[len(inner) :])
        value = 0.0
        for part in (vector.real, vector.imag):
            direction = self.own.duplicate()
            direction.array[:] = part
            value += sector.balloon.second_variation(self.own, direction, direction)

        def reduced(y: ComplexArray) -> ComplexArray:
            return np.concatenate([y[inner], T.conj().T @ y[ends]])

        K_x, M_x = reduced(self._K @ aligned), reduced(self._M @ aligned)
        error = np.linalg.norm(K_x - value * M_x) / max(float(np.linalg.norm(K_x)), 1e-300)
        return GoreMode(harmonic, value, vector, float(error))

    def num_below(self, shift: float, harmonics: Mapping[int, int]) -> int | None:
        """Number of eigenvalues below a shift by inertia; None where the fixed sector has some there.

        Args:
            shift: sigma.
            harmonics: n, and how often each of its eigenvalues counts.
        """
        condensed = self.condensed_at(shift)
        counts = [condensed.num_below(n) for n in harmonics]
        if None in counts:
            return None
        return sum(times * (count or 0) for times, count in zip(harmonics.values(), counts, strict=True))
