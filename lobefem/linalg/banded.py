"""Small pencils A x = lambda B x of one harmonic: LAPACK's banded Cholesky, ARPACK on top of it.

One sector's unknowns follow each other along the meridian, so its matrices are narrow bands: a
factorisation costs n w^2, 0.1 ms for a thousand unknowns, and whether one exists is the test of
positive definiteness.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from scipy.sparse.csgraph import reverse_cuthill_mckee
from scipy.sparse.linalg import ArpackError, LinearOperator, eigs, splu

from lobefem.errors import EigenError
from lobefem.typing import Array, ComplexArray, Mat, Sparse

__all__ = ["HERMITIAN", "Band", "as_scipy", "asymmetry", "constrained", "lowest", "most_negative"]

HERMITIAN = 1e-12  # relative asymmetry below which a matrix counts as Hermitian

_DENSE = 80  # below this size LAPACK's dense solver is the faster one


class Band:
    """An ordering in which matrices of one pattern are narrow bands.

    Args:
        pattern: a sparse matrix that has all their entries.
    """

    def __init__(self, pattern: Sparse) -> None:
        symmetric = (abs(pattern) + abs(pattern).T).tocsr()
        self.order = reverse_cuthill_mckee(symmetric, symmetric_mode=True)
        coo = symmetric[self.order][:, self.order].tocoo()
        self.width = int(np.abs(coo.row - coo.col).max(initial=0))
        self.size = pattern.shape[0]

    def pack(self, matrix: Sparse) -> ComplexArray:
        """The lower band of a Hermitian matrix, (width + 1, size), as LAPACK wants it."""
        coo = sp.tril(sp.csr_matrix(matrix)[self.order][:, self.order]).tocoo()
        band = np.zeros((self.width + 1, self.size), dtype=complex)
        band[coo.row - coo.col, coo.col] = coo.data
        return band

    def factor(self, band: ComplexArray) -> Callable[[ComplexArray], ComplexArray] | None:
        """A solver for a Hermitian matrix given by its band; None if it is not positive definite."""
        try:
            cholesky = scipy.linalg.cholesky_banded(band, lower=True, check_finite=False)
        except np.linalg.LinAlgError:
            return None

        def solve(b: ComplexArray) -> ComplexArray:
            x = np.empty(b.shape, dtype=complex)
            x[self.order] = scipy.linalg.cho_solve_banded((cholesky, True), b[self.order], check_finite=False)
            return x

        return solve


def as_scipy(matrix: Mat | Sparse) -> Any:
    """A PETSc matrix of this rank alone as a SciPy matrix, a SciPy one as it is."""
    if sp.issparse(matrix):
        return matrix
    pointers, columns, values = matrix.getValuesCSR()
    return sp.csr_matrix((values, columns, pointers), shape=matrix.getSize())


def asymmetry(matrix: Sparse) -> float:
    """Relative asymmetry max|A - A^H|/max|A|."""
    largest = abs(matrix).max()
    return float(abs(matrix - matrix.conj().T).max() / largest) if largest else 0.0


def constrained(
    solve: Callable[[ComplexArray], ComplexArray], c: ComplexArray | None
) -> Callable[[ComplexArray], ComplexArray]:
    """A solver of A x + c m = b, c^H x = 0 made from one of A x = b; itself without c.

    Args:
        solve: applies the inverse of A.
        c: vector of the constraint (size,).
    """
    if c is None:
        return solve
    moved = solve(c)
    along = np.vdot(c, moved)

    def across(b: ComplexArray) -> ComplexArray:
        x = solve(b)
        return x - np.multiply.outer(moved, c.conj() @ x / along)

    return across


def lowest(
    A: Sparse, B: Sparse, count: int, scale: float, hermitian: bool, c: ComplexArray | None = None
) -> tuple[ComplexArray, ComplexArray, ComplexArray | None]:
    """The eigenvalues of A x = lambda B x with the lowest real parts, B positive definite.

    Shift-invert about a shift below the whole spectrum: by Bendixson's theorem no real part lies
    below the lowest eigenvalue of A's Hermitian part, and Cholesky's success proves the shift to.

    Args:
        A: sparse, Hermitian or not.
        B: sparse Hermitian.
        count: how many.
        scale: size of the first shift tried, of the lowest eigenvalues' order or less.
        hermitian: whether A is.
        c: for the eigenpairs of A on the vectors with c^H x = 0 alone (size,).

    Returns:
        values (count,) ascending by real part, right vectors (size, count), and the left ones
        (z^H A = lambda z^H B) where A is not Hermitian.

    Raises:
        EigenError: ARPACK did not converge.
    """
    A, B = sp.csr_matrix(A), sp.csr_matrix(B)
    size = A.shape[0]
    count = min(count, size - (c is not None))
    S = A if hermitian else (A + A.conj().T) / 2
    band = Band(abs(A) + abs(B))
    a, b = band.pack(S), band.pack(B)
    shift = -abs(scale)
    solve = band.factor(a - shift * b)
    while solve is None:
        shift *= 8
        if shift < -1e15:
            raise EigenError("no shift below the spectrum was found; are the loads finite?")
        solve = band.factor(a - shift * b)
    inverse: Any
    vectors: Any
    if hermitian:
        values, vectors = _largest(B, constrained(solve, c), A - shift * B, count, c)
        return (shift + 1 / values).astype(complex), vectors, None
    lu = splu((A - shift * B).tocsc())
    right = constrained(lu.solve, c)
    if size < _DENSE or count > size - 3:
        inverse, vectors = scipy.linalg.eig(right(B.toarray().astype(complex)))
    else:
        operator: Any = LinearOperator((size, size), lambda x: right(B @ x), dtype=complex)
        inverse, vectors = _arpack(operator, count + 2, "LM")
    # the stiffest ones end in round-off of any sign
    found: Any = np.full(len(inverse), np.inf + 0j)
    certain = inverse.real > 1e-9 * np.abs(inverse).max()
    found[certain] = shift + 1 / inverse[certain]
    first = np.argsort(found.real, kind="stable")[:count]
    left = vectors[:, first].astype(complex)
    transposed = constrained(lambda b: lu.solve(b, trans="H"), c)
    for _ in range(3):
        left = np.linalg.qr(transposed(B @ left))[0]
    return found[first], vectors[:, first].astype(complex), left


def most_negative(
    A: Sparse,
    B: Sparse,
    solve: Callable[[ComplexArray], ComplexArray],
    count: int,
    c: ComplexArray | None = None,
) -> tuple[Array, ComplexArray]:
    """The most negative eigenvalues of a Hermitian pencil A x = nu B x, with their vectors.

    Args:
        A: sparse Hermitian.
        B: sparse Hermitian, positive definite.
        solve: applies the inverse of B, under the constraint where there is one.
        count: how many.
        c: for the eigenpairs on the vectors with c^H x = 0 alone (size,).

    Raises:
        EigenError: ARPACK did not converge.
    """
    size = A.shape[0]
    count = min(count, size - (c is not None))
    if size < _DENSE or count > size - 3:
        return _dense(A, B, solve, 0, count, c)
    operator: Any = LinearOperator((size, size), lambda x: solve(A @ x), dtype=complex)
    try:
        found, vectors = _arpack(operator, count, "SR")
    except EigenError:  # values so close together that Lanczos tells them apart slowly
        return _dense(A, B, solve, 0, count, c)
    first = np.argsort(found.real)[:count]
    return found.real[first], vectors[:, first]


def _dense(
    A: Sparse,
    B: Sparse,
    solve: Callable[[ComplexArray], ComplexArray],
    first: int,
    last: int,
    c: ComplexArray | None,
) -> tuple[Array, ComplexArray]:
    """Eigenpairs `first` to `last` - 1, ascending, of a Hermitian pencil A x = nu B x, by LAPACK."""
    basis: Any = np.eye(A.shape[0]) if c is None else scipy.linalg.null_space(c.conj()[None, :])
    adjoint = basis.conj().T
    try:
        values, vectors = scipy.linalg.eigh(
            adjoint @ (A @ basis), adjoint @ (B @ basis), subset_by_index=[first, last - 1]
        )
    except np.linalg.LinAlgError:
        # where B is singular but for round-off its Cholesky can find what the banded one does not
        values, vectors = scipy.linalg.eig(adjoint @ solve((A @ basis).astype(complex)))
        order = np.argsort(values.real)[first:last]
        values, vectors = values.real[order], vectors[:, order]
    return values, (basis @ vectors).astype(complex)


def _largest(
    B: Sparse,
    solve: Callable[[ComplexArray], ComplexArray],
    shifted: Sparse,
    count: int,
    c: ComplexArray | None,
) -> tuple[Array, ComplexArray]:
    """Largest nu, descending, of B x = nu (A - shift B) x, both positive definite."""
    size = B.shape[0]
    if size < _DENSE or count > size - 3:
        end = size - (c is not None)
        values, vectors = _dense(B, shifted, solve, end - count, end, c)
        return values[::-1], vectors[:, ::-1]
    operator: Any = LinearOperator((size, size), lambda x: solve(B @ x), dtype=complex)
    found, vectors = _arpack(operator, count + 2, "LM")
    first = np.argsort(-found.real)[:count]
    return found.real[first], vectors[:, first]


def _arpack(operator: Any, count: int, which: str) -> tuple[ComplexArray, ComplexArray]:
    size = operator.shape[0]
    rng = np.random.default_rng(1)  # the same start every time
    start = rng.standard_normal(size) + 1j * rng.standard_normal(size)
    solve: Any = eigs  # the stubs that some have want `which` as a literal
    try:
        return solve(
            operator, count, which=which, v0=start, ncv=min(size - 1, max(4 * count, 24)), maxiter=300
        )
    except ArpackError as error:
        raise EigenError(
            f"the modes of one harmonic did not converge ({error}); try fewer of them"
        ) from error
