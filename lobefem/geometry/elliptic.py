"""Elliptic functions by the arithmetic-geometric mean, for shapes that every run needs.

scipy.special has them, too, and takes a tenth of a second to import: a tenth of what a run of 36 000
unknowns needs in all.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from lobefem.typing import Array

__all__ = ["jacobi", "quarter_period"]


def _means(m: float) -> list[tuple[float, float]]:
    """(a_n, c_n) of the arithmetic-geometric mean of 1 and sqrt(1 - m), until they agree."""
    a, b, c = 1.0, math.sqrt(1.0 - m), math.sqrt(m)
    means = [(a, c)]
    while abs(c) > 1e-16 * a:
        a, b, c = (a + b) / 2.0, math.sqrt(a * b), (a - b) / 2.0
        means.append((a, c))
    return means


def quarter_period(m: float) -> float:
    """K(m), the complete integral of the first kind, of a parameter 0 <= m < 1 (DLMF 19.8.5)."""
    return math.pi / (2.0 * _means(m)[-1][0])


def jacobi(u: Any, m: float) -> tuple[Array, Array, Array, Array]:
    """sn, cn, dn and Jacobi's epsilon E(am u | m) of an argument of any shape, 0 <= m < 1.

    The amplitude phi_0 comes from phi_N = 2^N a_N u by sin(2 phi_(n-1) - phi_n) = (c_n/a_n) sin phi_n
    (DLMF 22.20.6), the integral of the second kind from E(phi_0) - u E/K = sum of c_n sin phi_n with
    E/K = 1 - sum of 2^(n-1) c_n^2 (Abramowitz and Stegun 17.6.3, 17.6.10).
    """
    means = _means(m)
    u = np.asarray(u, dtype=np.float64)
    phi = 2.0 ** (len(means) - 1) * means[-1][0] * u
    epsilon = u * (1.0 - sum(2.0 ** (n - 1) * c**2 for n, (_, c) in enumerate(means)))
    for a, c in reversed(means[1:]):
        sine = np.sin(phi)
        epsilon = epsilon + c * sine
        phi = (phi + np.arcsin(c / a * sine)) / 2.0
    sn = np.sin(phi)
    return sn, np.cos(phi), np.sqrt(1.0 - m * sn**2), epsilon
