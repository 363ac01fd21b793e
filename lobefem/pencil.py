"""The pencil of a balloon whose geometry is held: its stiffness is linear in the pressure."""

from __future__ import annotations

from typing import Any

from lobefem.balloon import Balloon

__all__ = ["held_pencil"]


def held_pencil(balloon: Balloon, low: float = 0.0, high: float = 1e5) -> tuple[Any, Any]:
    """K_m and K_g of K(p) = K_m + p K_g at the reference shape, its stress proportional to p.

    Args:
        balloon: with built-in stress.
        low: pressure [Pa] of one of the two tangents that it is made from.
        high: that of the other. Where K is linear in p they do not matter; a high one keeps the
            round-off of K_m's 1e9 N/m out of the difference.

    Collective.
    """
    q = balloon.map.create_vector()
    balloon.set_loads(low, low)
    K_m = balloon.tangent(q).copy()
    balloon.set_loads(high, high)
    K_g = balloon.tangent(q).copy()
    K_g.axpy(-1.0, K_m)
    K_g.scale(1 / (high - low))
    if low:
        K_m.axpy(-low, K_g)
    return K_m, K_g
