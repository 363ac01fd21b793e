"""The parts of a balloon besides its film, sorted by what they are."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from lobefem import checks
from lobefem.cables import Cords
from lobefem.contact import SelfContact
from lobefem.errors import InputError
from lobefem.loads import GasPressure
from lobefem.plates import EndPlates, PlateLoad

__all__ = ["Held", "Parts", "row"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Held:
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


_KINDS = (GasPressure, Cords, EndPlates, PlateLoad, Held, SelfContact)


@dataclass(frozen=True)
class Parts:
    """At most one gas pressure, by default "closed", pair of plates, load on them and contact."""

    load: GasPressure
    cords: tuple[Cords, ...]
    held: tuple[Held, ...]
    plates: EndPlates | None
    plate_load: PlateLoad | None
    contact: SelfContact | None

    @classmethod
    def sort(cls, parts: Sequence[Any]) -> Parts:
        """Parts in any order, as `row` gives them.

        Raises:
            InputError: something that is no part, or two of which there can be one.
        """
        one = {kind: _single(parts, kind) for kind in (GasPressure, EndPlates, PlateLoad, SelfContact)}
        unknown = [p for p in parts if not isinstance(p, _KINDS)]
        if unknown:
            names = ", ".join(kind.__name__ for kind in _KINDS)
            if isinstance(unknown[0], type):
                name = unknown[0].__name__
                raise InputError(f"{name} is a class and no part of a balloon; make one of it, {name}()")
            raise InputError(f"{unknown[0]!r} is no part of a balloon; use one of {names}")
        return cls(
            one[GasPressure] or GasPressure(),
            tuple(p for p in parts if isinstance(p, Cords)),
            tuple(p for p in parts if isinstance(p, Held)),
            one[EndPlates],
            one[PlateLoad],
            one[SelfContact],
        )


def row(parts: Any) -> tuple[Any, ...]:
    """Parts as a tuple; a single one needs no brackets.

    Raises:
        InputError: something else than a part or a row of things.
    """
    if isinstance(parts, _KINDS):
        return (parts,)
    if isinstance(parts, str) or not isinstance(parts, Iterable):
        raise InputError(f"parts are {parts!r}; give a list of them, such as [GasPressure(), EndPlates()]")
    return tuple(parts)


def _single(parts: Sequence[Any], kind: type) -> Any:
    found = [p for p in parts if isinstance(p, kind)]
    if len(found) > 1:
        raise InputError(f"a balloon takes one {kind.__name__}, not {len(found)}")
    return found[0] if found else None
