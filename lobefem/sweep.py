"""Eigenvalues of the held ideal geometry over the pressure, as branches.

On a cyclic mesh every harmonic is a small problem of its own (`lobefem.cyclic`), and with the geometry
held K(p) = K_m + p K_g: so all branches of a sweep cost little more than two assemblies.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial

import numpy as np
import numpy.typing as npt

from lobefem import checks
from lobefem._banded import HERMITIAN, asymmetry, lowest
from lobefem.balloon import Balloon
from lobefem.branches import Branch
from lobefem.chart import sector_pencil
from lobefem.cyclic import Sector, own_pairs
from lobefem.equilibrium import require_drawn
from lobefem.errors import InputError
from lobefem.harmonics import kind_of
from lobefem.sector_modes import mass_matrix
from lobefem.stability import check_request

__all__ = ["branches"]

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]


def branches(
    balloon: Balloon,
    pressures: Sequence[float],
    *,
    count: int = 4,
    harmonics: int | Iterable[int] | None = None,
    mass: str = "unit",
) -> list[Branch]:
    """The lowest branches of each harmonic, for the held isotensoid with its stress proportional to p.

    Each rank solves the same small problems of one sector; rigid rotations that the supports leave are left
    out.

    Args:
        balloon: prestressed, on a cyclic mesh.
        pressures: ascending [Pa].
        count: branches of each harmonic; of n = 0 as many twists and as many others, or fewer.
        harmonics: that or those looked at; by default all that the mesh has, 0 to N/2.
        mass: "unit" or "nodal".

    Raises:
        InputError: the balloon is not prestressed, pressures do not ascend, or the mesh is not cyclic.

    Collective.
    """
    if not balloon.prestressed:
        raise InputError("a sweep of the ideal state needs a prestressed balloon; pass prestressed=True")
    require_drawn(balloon)
    check_request(balloon, count, mass)
    p = np.array(checks.numbers("the path of pressures", pressures, "Pa"))
    if p.size == 0 or (np.diff(p) <= 0).any():
        raise InputError(f"pressures {list(pressures)} must ascend")
    asked = () if harmonics is None else checks.integers("a harmonic", harmonics, 0)
    sector = Sector(balloon)
    M = mass_matrix(sector, sector.balloon.map.create_vector(), mass)
    K_m, K_g, _ = sector_pencil(sector)
    found: list[Branch] = []
    for n in sector.harmonics if harmonics is None else asked:
        K_mn, K_gn, M_n = (sector.reduce(A, n) for A in (K_m, K_g, M))
        # rows: pressures; columns: the lowest, ascending
        wanted = count if n else 4 * count  # of n = 0 there are two kinds
        hermitian = asymmetry(K_gn) < HERMITIAN
        turn = sector.rotation(sector.balloon.map.create_vector(), M_n, n)
        c = None if turn is None else M_n @ turn
        scale = 1e-2 / np.sqrt(balloon.reference_area * balloon.surface.copies)
        pairs = [
            own_pairs(
                sector,
                n,
                partial(lowest, K_mn + v * K_gn, M_n, scale=max(scale * v, 1e-6), hermitian=hermitian, c=c),
                wanted,
                K_mn.shape[0] - (c is not None),
            )[:2]
            for v in p
        ]
        if n == 0:
            both = _axisymmetric(pairs, p, 3 * sector.num_slots)
            found += [b for b in both if b.rank < count and len(b.values) == len(p)]
            continue
        values = np.array([values.real for values, _ in pairs])
        for k in range(values.shape[1]):
            kind = kind_of(sector.balloon, sector.displacement(pairs[-1][1][:, k], n), n)
            found.append(Branch(kind, n, k, p, values[:, k]))
    return found


def _axisymmetric(pairs: Sequence[tuple[Complex, Complex]], p: Array, film: int) -> list[Branch]:
    """Branches of n = 0, twists (mostly hoopwise) apart from the others."""
    rows: dict[tuple[str, int], list[tuple[float, float]]] = {}
    for pressure, (values, vectors) in zip(p, pairs, strict=True):
        parts = (np.abs(vectors[:film]) ** 2).reshape(-1, 3, len(values)).sum(axis=0)
        ranks = {"twist": 0, "global": 0}
        for k, value in enumerate(values):
            kind = "twist" if parts[1, k] > parts[:, k].sum() / 2 else "global"
            rows.setdefault((kind, ranks[kind]), []).append((pressure, value.real))
            ranks[kind] += 1
    table = {key: np.array(points) for key, points in rows.items()}
    return [Branch(kind, 0, rank, t[:, 0], t[:, 1]) for (kind, rank), t in sorted(table.items())]
