"""Simpler balloons on the way to one whose film is cut flat or which has weight.

As it was drawn, film that is cut flat is slack here and there and has no stiffness; weight lies on film that
no gas bears yet. A balloon whose film is free of stress as drawn, without weight and under even pressure, is
found from there; its shape is close to the wanted one.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from lobefem.equilibrium.state import Equilibrium, record
from lobefem.model.dead_weight import DeadWeight
from lobefem.model.end_plates import PlateLoad
from lobefem.model.gas_pressure import GasPressure

if TYPE_CHECKING:
    from lobefem.fem.balloon import Balloon

__all__ = ["simpler", "stretched"]

_STRETCH = 1e-3


def simpler(balloon: Balloon) -> list[Balloon]:
    """Balloons on the same mesh to find one after the other before this one. Collective.

    None where its film is free of stress as drawn and has no weight, or itself if it has tendons.
    """
    even = [_even(part) for part in balloon.components if not isinstance(part, DeadWeight | PlateLoad)]
    found = []
    if balloon.pattern is not None:
        found.append(balloon.with_changes(pattern=None, components=even))
    if tuple(even) != tuple(balloon.components):
        found.append(balloon.with_changes(components=even))
    if not found and any(cable.tension_only for cable in balloon.cables):
        found.append(balloon)
    return found


def stretched(balloon: Balloon) -> Equilibrium:
    """The drawn shape stretched by a thousandth, without load. Collective."""
    balloon.set_loads(0.0)
    motion, w = balloon.motion, np.zeros(12)
    start = balloon.axis.origin if motion is None else motion.centres[0]
    balloon.u.x.array[:] = (_STRETCH * (balloon.X - start)).ravel()
    if motion is not None:
        w[6:9] = _STRETCH * (motion.centres[1] - start)
    q = balloon.map.unknowns(balloon.u, w)
    return record(balloon, q, False, "stretched", 0, ())


def _even(part: Any) -> Any:
    return replace(part, gradient=0.0) if isinstance(part, GasPressure) else part
