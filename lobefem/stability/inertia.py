"""Inertia of a pencil: a shift below its spectrum, and a proof that a solver has missed none of it.

By Sylvester's law a factorisation of K - sigma B has as many negative pivots as there are eigenvalues
below sigma; each row of a constraint in the solver's matrices makes one more.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from lobefem.linalg import petsc
from lobefem.linalg.slepc import Pair
from lobefem.typing import EPS, Mat

from petsc4py import PETSc

__all__ = ["as_many", "num_below", "num_proved", "shift_below", "vary"]


def shift_below(first: float, eps: EPS, K: Mat, B: Mat, symmetric: bool, borders: int) -> float:
    """A shift below every eigenvalue's real part, by inertia of K's symmetric part; `eps` has it then.

    Where K is symmetric the factorisation that proves it is the one that the solver inverts with. No
    constraint takes a value below those of K without it.
    """
    shift = -first
    S = _symmetric_part(K, symmetric)
    while True:
        eps.setTarget(shift)
        if symmetric:
            below = num_below(eps, shift, borders)
        else:
            shifted = S.copy()
            shifted.axpy(-shift, B)
            below = petsc.num_negative(shifted)
            shifted.destroy()
        if not below or shift <= -1e15:
            break
        shift *= 8
    if S is not K:
        S.destroy()
    return shift


def vary(eps: EPS, shift: float, pairs: Sequence[Pair], wanted: int, idle: int) -> None:
    """Ready the solver for a run: about the shift, or after one that brought nothing new in another way.

    That is with more vectors, and about a shift that is closer to the lowest value known.
    """
    place = shift
    if idle:
        _, vectors, _ = eps.getDimensions()
        vectors = min(2 * vectors, eps.getOperators()[0].getSize()[0])
        eps.setDimensions(wanted, vectors, vectors)
        lowest = min(pair.value.real for pair in pairs)
        place = lowest - (lowest - shift) / 8**idle
    eps.setTarget(place)
    eps.getST().setShift(place)


def num_below(eps: EPS, value: float, borders: int) -> int:
    """Number of eigenvalues below a value, by the inertia of a solver's own factorisation there. Collective.

    Each row of a constraint in the solver's matrices is one negative eigenvalue more of theirs. Where the
    user has chosen an iterative solver, a factorisation of its own tells.
    """
    st = eps.getST()
    if st.getKSP().getPC().getType() != PETSc.PC.Type.CHOLESKY:
        K, B = eps.getOperators()
        shifted = K.copy()
        shifted.axpy(-value, B)
        below = petsc.num_negative(shifted) - borders
        shifted.destroy()
        return below
    st.setShift(value)
    eps.setUp()  # which gives it its matrices, the first time
    st.setUp()
    ksp = st.getKSP()
    ksp.setUp()
    return int(ksp.getPC().getFactorMatrix().getInertia()[0]) - borders


def num_proved(eps: EPS, pairs: list[Pair], count: int, shift: float, borders: int) -> int | None:
    """Number of the lowest pairs that are all below a gap past the wanted ones, by inertia.

    None where copies are missing, 0 where no gap is among the pairs. The solver's shift stays as it was.
    """
    values = [pair.value.real for pair in pairs]
    for k in range(count, len(values)):
        if values[k] - values[k - 1] > 1e-6 * abs(values[k] - shift):
            below = num_below(eps, (values[k] + values[k - 1]) / 2, borders)
            return k if below == k else None
    return 0


def as_many(K: Mat, B: Mat, pairs: list[Pair], count: int, shift: float, borders: int) -> bool:
    """True if as many pairs were found below a gap as K's symmetric part has there, or more.

    Its eigenvalues are close to K's, whose skew part is that of the plates' load alone. A state that kept
    no symmetry, turned as a whole say, may have double values all the same.
    """
    values = [pair.value.real for pair in pairs]
    for k in range(count, len(values)):
        if values[k] - values[k - 1] > 1e-3 * abs(values[k] - shift):
            S = _symmetric_part(K, False)
            S.axpy(-(values[k] + values[k - 1]) / 2, B)
            below = petsc.num_negative(S) - borders
            S.destroy()
            return below <= k
    return True


def _symmetric_part(K: Mat, symmetric: bool) -> Any:
    if symmetric:
        return K
    transposed = K.transpose(PETSc.Mat())
    transposed.axpy(1.0, K)
    transposed.scale(0.5)
    return transposed
