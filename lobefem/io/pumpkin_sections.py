"""Sections of a design file that only pumpkins have: tendons, end fittings and the cleft."""

from __future__ import annotations

import math
from typing import Annotated

from lobefem.io.design_sections import Section
from lobefem.io.design_values import integer, pair, positive, quantity, shortening
from lobefem.units import ANGLE, FORCE, LENGTH, LINE_DENSITY, MASS

__all__ = ["CleftTable", "Fittings", "Tendons"]


class Tendons(Section):
    """[tendons]: the cables between a pumpkin's gores; foreshortening is a share of their drawn length."""

    EA: Annotated[float, positive(FORCE)] = 1e5
    foreshortening: Annotated[float | tuple[tuple[float, float], ...], shortening] = 0.0
    mass_per_length: Annotated[float, quantity(LINE_DENSITY, "0 or more", lambda v: v >= 0)] = 0.0


class Fittings(Section):
    """[fittings]: masses of a pumpkin's end fittings, [bottom, top], and of the payload below them."""

    mass: Annotated[tuple[float, float], pair(MASS)] = (0.0, 0.0)
    payload: Annotated[float, quantity(MASS, "0 or more", lambda v: v >= 0)] = 0.0


class CleftTable(Section):
    """[cleft]: the gap that `perturb --cleft` makes in a pumpkin: its gores, its depth and its turn.

    Without a depth the gap is pulled in by a tenth of the radius.
    """

    gores: Annotated[int, integer(2)] = 4
    depth: Annotated[float | None, positive(LENGTH)] = None
    turn: Annotated[float, quantity(ANGLE, "from -360 to 360 degrees", lambda v: abs(v) <= 2 * math.pi)] = (
        math.pi / 2
    )
