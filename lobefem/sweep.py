"""Eigenvalues of the held ideal geometry over the pressure, as branches.

On a cyclic mesh every harmonic is a small problem of its own (`lobefem.cyclic`), and with the geometry
held K(p) = K_m + p K_g: so all branches of a sweep cost little more than two assemblies.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.linalg
import scipy.sparse

from lobefem.balloon import Balloon
from lobefem.branches import Branch
from lobefem.cyclic import CyclicReduction
from lobefem.errors import InputError
from lobefem.harmonics import label
from lobefem.stability import check_request

__all__ = ["branches"]

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]


def branches(
    balloon: Balloon,
    pressures: Sequence[float],
    *,
    count: int = 4,
    harmonics: Iterable[int] | None = None,
    mass: str = "unit",
) -> list[Branch]:
    """The lowest branches of each harmonic, for the held isotensoid with its stress proportional to p.

    Each rank solves the same dense problems of one sector with LAPACK.

    Args:
        balloon: prestressed, on a cyclic mesh.
        pressures: ascending [Pa].
        count: branches of each harmonic; of n = 0 as many twists and as many others, or fewer.
        harmonics: those looked at; by default all that the mesh has, 0 to N/2.
        mass: "unit" or "nodal".

    Raises:
        InputError: the balloon is not prestressed, pressures do not ascend, or the mesh is not cyclic.

    Collective.
    """
    if not balloon.prestressed:
        raise InputError("a sweep of the ideal state needs a prestressed balloon; pass prestressed=True")
    check_request(balloon, count, mass)
    p = np.asarray(pressures, dtype=float)
    if p.size == 0 or not np.isfinite(p).all() or (np.diff(p) <= 0).any():
        raise InputError(f"pressures {list(pressures)} must be finite and ascend")
    reduction = CyclicReduction(balloon)
    q = balloon.map.create_vector()
    K_m, K_g = balloon.held_pencil()
    M = balloon.mass(q, mass)
    found: list[Branch] = []
    for n in range(reduction.order // 2 + 1) if harmonics is None else harmonics:
        K_mn, K_gn, M_n = (_complex(reduction, A, n) for A in (K_m, K_g, M))
        # rows: pressures; columns: the lowest, ascending
        wanted = count if n else 4 * count  # of n = 0 there are two kinds
        pairs = [_lowest(K_mn + pressure * K_gn, M_n, wanted) for pressure in p]
        if n == 0:
            both = _axisymmetric(pairs, p, 3 * reduction.num_slots)
            found += [b for b in both if b.rank < count and len(b.values) == len(p)]
            continue
        values = np.array([values for values, _ in pairs])
        for k in range(values.shape[1]):
            kind = "sway" if n == 1 else _skin_kind(balloon, reduction, q, n, pairs[-1][1][:, k])
            found.append(Branch(kind, n, k, p, values[:, k]))
    return found


def _complex(reduction: CyclicReduction, matrix: Any, n: int) -> Complex:
    """The dense complex matrix of a harmonic; film first, plates last."""
    real, plates = reduction.reduce(matrix, n)
    pointers, columns, values = real.getValuesCSR()
    dense = scipy.sparse.csr_matrix((values, columns, pointers), shape=real.getSize()).toarray()
    if n == 0 or 2 * n == reduction.order:
        return dense.astype(complex)
    film = 3 * reduction.num_slots
    last = 2 * film + np.arange(plates)
    re = np.concatenate([np.arange(film), last[: plates // 2]])
    im = np.concatenate([film + np.arange(film), last[plates // 2 :]])
    return dense[np.ix_(re, re)] + 1j * dense[np.ix_(im, re)]


def _lowest(K: Complex, M: Complex, count: int) -> tuple[Array, Complex]:
    """Lowest real parts and their vectors (columns).

    By shift-invert: the hoops are 1e11 times stiffer than the softest mode, whose digits a direct
    solution would leave in the round-off. Below the shift there is no eigenvalue, for no real part
    lies below the lowest eigenvalue of the Hermitian part (Bendixson).
    """
    size = len(K)
    count = min(count, size)
    adjoint = K.conj().T
    bound = scipy.linalg.eigh((K + adjoint) / 2, M, eigvals_only=True, subset_by_index=[0, 0])[0]
    shift = bound - max(abs(bound), 1e-12 * float(np.abs(K).max()))
    shifted = K - shift * M
    if np.abs(K - adjoint).max() < 1e-10 * np.abs(K).max():
        inverse, vectors = scipy.linalg.eigh(M, shifted, subset_by_index=[size - count, size - 1])
        return (shift + 1 / inverse)[::-1], vectors[:, ::-1].astype(np.complex128)
    inverse, vectors = scipy.linalg.eig(scipy.linalg.solve(shifted, M))
    largest = np.abs(inverse).max()
    values = np.full(size, np.inf)
    certain = inverse.real > 1e-9 * largest  # the stiffest ones end in round-off of any sign
    values[certain] = shift + (1 / inverse[certain]).real
    first = np.argsort(values)[:count]
    return values[first], vectors[:, first].astype(np.complex128)


def _axisymmetric(pairs: Sequence[tuple[Array, Complex]], p: Array, film: int) -> list[Branch]:
    """Branches of n = 0, twists (mostly hoopwise) apart from the others."""
    rows: dict[tuple[str, int], list[tuple[float, float]]] = {}
    for pressure, (values, vectors) in zip(p, pairs, strict=True):
        parts = (np.abs(vectors[:film]) ** 2).reshape(-1, 3, len(values)).sum(axis=0)
        ranks = {"twist": 0, "global": 0}
        for k, value in enumerate(values):
            kind = "twist" if parts[1, k] > parts[:, k].sum() / 2 else "global"
            rows.setdefault((kind, ranks[kind]), []).append((pressure, value))
            ranks[kind] += 1
    table = {key: np.array(points) for key, points in rows.items()}
    return [Branch(kind, 0, rank, t[:, 0], t[:, 1]) for (kind, rank), t in sorted(table.items())]


def _skin_kind(balloon: Balloon, reduction: CyclicReduction, q: Any, n: int, vector: Complex) -> str:
    """Kind of a mode with n >= 2, in which the plates have no part."""
    doubled = vector.real
    if 2 * n != reduction.order:
        doubled = np.concatenate([vector.real, vector.imag])
    real, imag = (balloon.displacement_of(q, x) for x in reduction.expand(doubled, n, 0))
    power = np.zeros(n + 1)
    power[n] = 1.0
    return label(balloon, real, imag, power)
