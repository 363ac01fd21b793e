"""The pencil of a balloon whose geometry is held: its stiffness is linear in the pressure."""

from __future__ import annotations

from typing import Any

from lobefem.balloon import Balloon
from lobefem.errors import InputError
from lobefem.films import require_one_tangent

__all__ = ["held_pencil"]


def held_pencil(balloon: Balloon, low: float = 0.0, high: float = 1e5) -> tuple[Any, Any]:
    """K_m and K_g of K(p) = K_m + p K_g at the reference shape, its stress proportional to p.

    Args:
        balloon: with built-in stress.
        low: pressure [Pa] of one of the two tangents that it is made from; 0 is 1 Pa for film that has none
            at rest.
        high: that of the other. Where K is linear in p they do not matter; a high one keeps the
            round-off of K_m's 1e9 N/m out of the difference.

    Raises:
        InputError: film with two tangents, or with hoop slack and one that is not linear in the pressure.

    Collective.
    """
    require_one_tangent(balloon.film, balloon.hoop_slack)
    if balloon.film.turns and balloon.hoop_slack and not low:
        raise InputError(
            f"hoop slack {balloon.hoop_slack:g} makes the stiffness of {type(balloon.film).__name__} film "
            "not linear in the pressure; use slack_critical_pressure of lobefem.kink, a harmonic at a time"
        )
    if not low and not balloon.film.has_tangent_at_rest:
        low = 1.0
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
