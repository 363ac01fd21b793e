"""Balloons whose slack film is firmer, on the way to one where it has next to no stiffness.

Newton's method has no direction in film that is slack. With a hundredth of its stiffness left to slack film
it comes to a shape close to the wanted one, be it converged or not; less and less of it leads there.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lobefem.fem.balloon import Balloon

__all__ = ["firmer"]

_SHARES = (1e-2, 1e-3, 1e-4)


def firmer(balloon: Balloon) -> list[Balloon]:
    """The balloon with shares of its film's stiffness left to slack film, the largest first. Collective.

    None of a balloon without tendons, or whose film carries compression or has a larger share itself.
    """
    film: Any = balloon.film
    if film.bears_compression or not any(cable.tension_only for cable in balloon.cables):
        return []
    return [
        balloon.with_changes(film=replace(film, slack_stiffness=share))
        for share in _SHARES
        if share > film.slack_stiffness
    ]
