"""Specification of what holds film without plates: prescribed displacement components, or nothing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lobefem import checks
from lobefem.errors import InputError
from lobefem.typing import Array

__all__ = ["Fixed", "FreeBody"]


@dataclass(frozen=True)
class Fixed:
    """Displacement components that are given, zero by default, for films without plates.

    Args:
        on: name of an edge group, or a function of coordinates x (3, n) that marks nodes (n,).
        components: which of 0, 1, 2 are held.
        displacement: a function of coordinates x (3, n) that gives the displacements (3, n) [m] at
            which they are held; where parts overlap the first one counts.

    Raises:
        InputError: `on` or `displacement` of another kind, or components beside 0, 1 and 2.
    """

    on: str | Callable[[Array], npt.NDArray[np.bool_]]
    components: tuple[int, ...] = (0, 1, 2)
    displacement: Callable[[Array], Array] | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.on, str) and not callable(self.on):
            raise InputError(f"film is held on {self.on!r}; give an edge group's name or a function of x")
        row = isinstance(self.components, (tuple, list))
        if not row or any(c > 2 for c in checks.integers("a held component", self.components, 0)):
            raise InputError(f"held components are {self.components!r}; give some of 0, 1 and 2, as (2,)")
        if self.displacement is not None and not callable(self.displacement):
            raise InputError(f"a held displacement is {self.displacement!r}; give a function of x or None")


@dataclass(frozen=True)
class FreeBody:
    """A closed film that nothing holds, an airbag say: rigid motions are taken out without a reaction."""
