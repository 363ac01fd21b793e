"""Specification of the rigid end plates, the central bar, their support, and a dead load on the top plate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import get_args

import numpy as np

from lobefem import checks
from lobefem.errors import InputError
from lobefem.typing import Support

__all__ = ["SUPPORTS", "EndPlates", "PlateLoad"]

SUPPORTS: tuple[str, ...] = get_args(Support)


@dataclass(frozen=True)
class EndPlates:
    """Rigid plates that close the two rims of a stack, the bar between them, and the support.

    Args:
        support: "clamped" (bottom plate held), "pinned" (its centre and its spin held) or "fixed"
            (both plates held).
        bar: True for a pin-jointed central bar of constant length, a number for an elastic one of
            that axial stiffness EA [N] (the paper's steel bar: 2.15e9), False for none.
        lift: rise of the top plate [m], with "fixed" only.

    Raises:
        InputError: an unknown support, a bar that is neither a bool nor a positive number, a lift without
            "fixed".
    """

    support: Support = "clamped"
    bar: bool | float = True
    lift: float = 0.0

    def __post_init__(self) -> None:
        if self.support not in SUPPORTS:
            raise InputError(f"support '{self.support}' is unknown; use one of {', '.join(SUPPORTS)}")
        if not isinstance(self.bar, (bool, int, float, np.number)):
            raise InputError(f"bar is {self.bar!r}; give True, False, or its stiffness EA [N]")
        if not isinstance(self.bar, bool):
            checks.positive("bar stiffness EA", self.bar, "N")
        if checks.finite("lift", self.lift, "m") and self.support != "fixed":
            raise InputError(
                f"lift = {self.lift} m needs support 'fixed', where both rims are held; here it is "
                f"'{self.support}'"
            )


@dataclass(frozen=True)
class PlateLoad:
    """Dead force and moment on the centre of the top plate, the whole balloon's where one sector is meshed.

    Args:
        force: (3,) [N].
        moment: (3,) [N m], conjugate to the plate's rotation vector: while that keeps its direction, the
            moment about it.

    Raises:
        InputError: not three finite numbers each.
    """

    force: tuple[float, float, float] = (0.0, 0.0, 0.0)
    moment: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        checks.numbers("a plate's force", self.force, "N", 3)
        checks.numbers("a plate's moment", self.moment, "N m", 3)
