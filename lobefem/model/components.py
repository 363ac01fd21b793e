"""The parts of a balloon besides its film, sorted by what they are.

The list is open: a part of any other class that has a `potential` or `forces` (`OwnComponent`) is one too.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from lobefem.errors import InputError
from lobefem.model.cables import Cables
from lobefem.model.dead_weight import DeadWeight
from lobefem.model.end_plates import EndPlates, PlateLoad
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.self_contact import SelfContact
from lobefem.model.supports import Fixed, FreeBody
from lobefem.typing import Unchecked

__all__ = ["Components", "OwnComponent", "row"]

_KINDS = (GasPressure, Cables, EndPlates, PlateLoad, Fixed, FreeBody, SelfContact, DeadWeight)


class OwnComponent(Protocol):
    """A part of a class of one's own, which has one of the two methods, or both.

    They are called with a balloon when it is made: its mesh, `V`, `u`, `X` and `dx` are there. The same
    component serves any mesh.
    """

    def potential(self, balloon: Any) -> Any:
        """Energy in UFL in the balloon's `u`, integrated [J]; its derivatives enter residual and tangent."""

    def forces(self, balloon: Any) -> Any:
        """Constant forces at this rank's nodes, in the order of `balloon.X` (nodes, 3) [N]."""


@dataclass(frozen=True)
class Components:
    """At most one gas pressure, by default "closed", pair of plates, load on them and contact."""

    load: GasPressure
    cables: tuple[Cables, ...]
    fixed: tuple[Fixed, ...]
    plates: EndPlates | None
    plate_load: PlateLoad | None
    contact: SelfContact | None
    weight: DeadWeight
    free: FreeBody | None
    own: tuple[OwnComponent, ...] = ()

    @classmethod
    def sort(cls, components: Sequence[Any]) -> Components:
        """Parts in any order, as `row` gives them.

        Raises:
            InputError: something that is no part, or two of which there can be one.
        """
        one = {
            kind: _single(components, kind)
            for kind in (GasPressure, EndPlates, PlateLoad, SelfContact, DeadWeight, FreeBody)
        }
        others = [p for p in components if not isinstance(p, _KINDS)]
        unknown = [p for p in others if not _is_own(p)]
        if unknown:
            names = ", ".join(kind.__name__ for kind in _KINDS)
            if isinstance(unknown[0], type):
                name = unknown[0].__name__
                raise InputError(f"{name} is a class and no part of a balloon; make one of it, {name}()")
            raise InputError(
                f"{unknown[0]!r} is no part of a balloon; use one of {names}, or a part of your own with a "
                "method potential or forces"
            )
        return cls(
            one[GasPressure] or GasPressure(),
            tuple(p for p in components if isinstance(p, Cables)),
            tuple(p for p in components if isinstance(p, Fixed)),
            one[EndPlates],
            one[PlateLoad],
            one[SelfContact],
            one[DeadWeight] or DeadWeight(),
            one[FreeBody],
            tuple(others),
        )


def row(components: Unchecked) -> tuple[Any, ...]:
    """Parts as a tuple; a single one needs no brackets.

    Raises:
        InputError: something else than a part or a row of things.
    """
    if isinstance(components, _KINDS) or _is_own(components):
        return (components,)
    if isinstance(components, str) or not isinstance(components, Iterable):
        raise InputError(
            f"parts are {components!r}; give a list of them, such as [GasPressure(), EndPlates()]"
        )
    return tuple(components)


def _is_own(part: Unchecked) -> bool:
    return not isinstance(part, type) and any(
        callable(getattr(part, name, None)) for name in ("potential", "forces")
    )


def _single(components: Sequence[Any], kind: type) -> Any:
    found = [p for p in components if isinstance(p, kind)]
    if len(found) > 1:
        raise InputError(f"a balloon takes one {kind.__name__}, not {len(found)}")
    return found[0] if found else None
