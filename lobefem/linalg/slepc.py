"""Eigenpairs by SLEPc that can be trusted: every copy of a multiple one, and the last digits.

Vectors are complex in a real PETSc, x + i y. Up to `with_conjugates` a complex value stands for its
conjugate too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from lobefem.errors import EigenError
from lobefem.typing import EPS, Mat, Vec

from petsc4py import PETSc
from slepc4py import SLEPc

__all__ = ["Pair", "distinct", "order", "refine", "residual", "run", "solver", "with_conjugates"]

Complex = tuple[Any, Any]  # (real, imaginary)

_TRUSTED = 1e-4  # relative change of a value that a better quotient may bring

_NEW = 1e-2  # squared sine of the angle to known vectors from which on a vector is another one


class Pair(NamedTuple):
    """An eigenvalue with its vector x + i y."""

    value: complex
    x: Any
    y: Any


def order(pair: Pair) -> tuple[float, float, float]:
    """Sort key: real part, then |imaginary part|; conjugates stay together."""
    return pair.value.real, abs(pair.value.imag), -pair.value.imag


def solver(A: Mat, B: Mat, count: int, symmetric: bool, prefix: str) -> Any:
    """A SLEPc solver for A phi = lambda B phi, B positive definite where A is symmetric."""
    eps = SLEPc.EPS().create(A.getComm())
    eps.setOptionsPrefix(prefix)
    eps.setOperators(A, B)
    kind = SLEPc.EPS.ProblemType
    eps.setProblemType(kind.GHEP if symmetric else kind.GNHEP)
    eps.setDimensions(count, min(max(2 * count + 8, 24), A.getSize()[0]))
    _start(eps, 1)
    return eps


def _start(eps: EPS, seed: int) -> None:
    """Let the next solve begin with a random vector; SLEPc sets itself up again, factorisation and all."""
    A, _ = eps.getOperators()
    start = A.createVecRight()
    rng = np.random.default_rng((seed, A.getComm().rank))
    start.array[:] = rng.standard_normal(start.getLocalSize())
    eps.setInitialSpace([start])


def run(eps: EPS, count: int, seed: int = 1) -> list[Pair]:
    """Solve from a random vector and return the converged pairs, at least `count`, in order.

    A Krylov space grown from one vector holds one vector of each eigenspace; where symmetry makes
    eigenspaces double, the second one comes from round-off, or from a run with another seed.

    Raises:
        EigenError: SLEPc failed, or fewer converged.
    """
    A, _ = eps.getOperators()
    if seed > 1:  # the first one is there since the solver was made
        _start(eps, seed)
    try:
        eps.solve()
    except (PETSc.Error, SystemError) as error:
        raise EigenError(f"SLEPc failed ({error}); try a finer mesh or another pressure") from error
    converged = eps.getConverged()
    if converged < count:
        raise EigenError(
            f"only {converged} of {count} eigenpairs converged (SLEPc's reason "
            f"{eps.getConvergedReason()}); try another mesh or pressure",
            converged=converged,
        )
    pairs = []
    for i in range(converged):
        x, y = A.createVecRight(), A.createVecRight()
        value = complex(eps.getEigenpair(i, x, y))
        if value.imag < 0:
            continue
        _polish(eps, x, y)
        if value.imag > 1e-8 * abs(value - eps.getTarget()):
            pairs.append(Pair(value, x, y))
        else:  # real; one of a double value that round-off split has two real vectors
            pairs += [Pair(complex(value.real), v, v.duplicate()) for v in ((x, y) if value.imag else (x,))]
    return sorted(pairs, key=order)


def with_conjugates(pairs: Sequence[Pair]) -> list[Pair]:
    """The pairs in order, each complex one followed by its conjugate."""
    result = []
    for pair in sorted(pairs, key=order):
        result.append(pair)
        if pair.value.imag:
            minus_y = pair.y.copy()
            minus_y.scale(-1.0)
            result.append(Pair(pair.value.conjugate(), pair.x, minus_y))
    return result


def _polish(eps: EPS, x: Vec, y: Vec) -> None:
    """Shift-invert the vector once more.

    That multiplies it by a number, and damps the noise that the stiffest directions, the hoops'
    stretch, have in it.
    """
    st = eps.getST()
    if st.getType() != SLEPc.ST.Type.SINVERT:
        return
    work = x.duplicate()
    for v in (x, y) if y.norm() else (x,):
        st.apply(v, work)
        work.copy(v)
    _scale((x, y), 1 / math.hypot(x.norm(), y.norm()))


def distinct(pairs: Sequence[Pair], M: Mat, shift: float) -> list[Pair]:
    """The pairs without repetition: of a cluster of equal values, those with independent vectors.

    What one run gives as a complex pair may be two real pairs of another, whose double value round-off has
    not split; where one of the two is there already, the other's direction alone is new.

    Args:
        pairs: of one run or several.
        M: a positive definite matrix, the inner product in which vectors are compared.
        shift: number from which values are told apart, to a relative 1e-3: vectors of values closer than
            that are mixed by round-off, and differently so in each run.
    """
    kept: list[Pair] = []
    known: list[tuple[complex, Any]] = []  # values and real vectors, orthonormal where values are close
    for pair in sorted(pairs, key=order):
        parts = [v.copy() for v in ((pair.x, pair.y) if pair.value.imag else (pair.x,))]
        apart = _independence(parts, M)
        for v in parts:
            v.scale(1 / math.sqrt(_inner(M, v, v)))
            for value, unit in known:
                if abs(value - pair.value) <= 1e-3 * abs(pair.value - shift):
                    v.axpy(-_inner(M, unit, v), unit)
        new = [v for v in parts if _inner(M, v, v) > _NEW]
        if len(new) == 2 and _independence(new, M) <= _NEW * apart:
            new.pop()
        if len(new) == len(parts):
            kept.append(pair)
        else:
            kept += [Pair(complex(pair.value.real), v, _zero(v)) for v in new]
        for k, v in enumerate(new):
            if k:
                v.axpy(-_inner(M, new[0], v), new[0])
            v.scale(1 / math.sqrt(_inner(M, v, v)))
            known.append((pair.value, v))
    return kept


def _independence(vectors: Sequence[Any], M: Mat) -> float:
    """Squared sine of the angle between two vectors, 1 for a single one."""
    if len(vectors) == 1:
        return 1.0
    a, b = vectors
    return 1.0 - _inner(M, a, b) ** 2 / (_inner(M, a, a) * _inner(M, b, b))


def refine(
    pairs: Sequence[Pair],
    B: Mat,
    curvature: Callable[[Any, Any], float],
    solve_transposed: Callable[[Any, Any], None] | None,
    shift: float,
) -> list[Pair]:
    """The pairs with their values as two-sided quotients z . K x/z . B x of an unassembled K.

    A complex pair that turns out to be two real ones becomes these. Values that are far from zero have no
    need of it, and where left vectors are not found well enough they stay as they are.

    The error of a value is then the product of both vectors' errors, and the round-off of K's
    entries has no part in it. Left vectors are the dual basis to the right ones after three steps of
    inverse iteration with the transposed matrix.

    Args:
        pairs: all pairs of a run.
        B: symmetric matrix of the right-hand side.
        curvature: (v, u) -> v . K u for real vectors.
        solve_transposed: (b, x) solves (K - shift B)^T x = b; None where K is symmetric and left
            vectors are the right ones.
        shift: a number below all values, from which their changes are judged.
    """
    blocks = [(p.x, p.y) if p.value.imag else (p.x,) for p in pairs]
    right = [v for block in blocks for v in block]
    left = [v.copy() for v in right]
    work = B.createVecLeft()
    for z in left if solve_transposed is not None else ():
        for _ in range(3):
            B.mult(z, work)
            solve_transposed(work, z)  # type: ignore[misc]
            z.scale(1 / z.norm())
    gram = np.empty((len(left), len(right)))
    for j, u in enumerate(right):
        B.mult(u, work)
        gram[:, j] = [z.dot(work) for z in left]
    dual = np.linalg.inv(gram)  # rows combine the left vectors to W with W^T B R = 1
    refined: list[Pair] = []
    start = 0
    for pair, block in zip(pairs, blocks, strict=True):
        at = range(start, start + len(block))
        start += len(block)
        small = np.empty((len(block), len(block)))
        for a, i in enumerate(at):
            w = B.createVecLeft()
            w.maxpy(list(dual[i]), left)
            small[a] = [curvature(w, right[j]) for j in at]
        found, combined = np.linalg.eig(small)
        if np.abs(found.real - pair.value.real).max() > _TRUSTED * abs(pair.value - shift):
            refined.append(pair)
        elif len(block) == 2 and not found.imag.any():  # a double real value that round-off has split
            for value, share in zip(found.real, combined.real.T, strict=True):
                x = _zero(block[0])
                x.maxpy(list(share), list(block))
                refined.append(Pair(complex(value), x, _zero(x)))
        else:
            refined.append(pair._replace(value=complex(found[np.argmax(found.imag)])))
    return refined


def residual(
    pair: Pair, K: Mat, B: Mat, shift: float = 0.0, project: Callable[[Any], None] | None = None
) -> float:
    """The relative residual ||K phi - lambda B phi||/||K phi||.

    With a shift the denominator is at least |lambda - shift| ||B phi||: a rigid motion has K phi = 0
    but for round-off. What a constraint bears is left out, by `project`.
    """
    Kx, Ky, Bx, By = (M.createVecLeft() for M in (K, K, B, B))
    K.mult(pair.x, Kx)
    K.mult(pair.y, Ky)
    B.mult(pair.x, Bx)
    B.mult(pair.y, By)
    size = math.hypot(Kx.norm(), Ky.norm())
    if shift:
        size = max(size, abs(pair.value - shift) * math.hypot(Bx.norm(), By.norm()))
    _subtract((Kx, Ky), pair.value, (Bx, By))
    if project is not None:
        project(Kx)
        project(Ky)
    return math.hypot(Kx.norm(), Ky.norm()) / size if size else 0.0


def _inner(M: Mat, a: Vec, b: Vec) -> float:
    """Inner product a . M b of real vectors."""
    work = M.createVecLeft()
    M.mult(b, work)
    found = float(a.dot(work))
    work.destroy()
    return found


def _zero(v: Vec) -> Any:
    zero = v.duplicate()
    zero.set(0.0)
    return zero


def _subtract(a: Complex, factor: complex, b: Complex) -> None:
    """A -= factor b, in place."""
    a[0].axpy(-factor.real, b[0])
    a[0].axpy(factor.imag, b[1])
    a[1].axpy(-factor.real, b[1])
    a[1].axpy(-factor.imag, b[0])


def _scale(a: Complex, factor: float) -> None:
    a[0].scale(factor)
    a[1].scale(factor)
