"""Bases of records: read-only arrays, and one sentence where a mesh cannot be copied."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from lobefem.errors import InputError

__all__ = ["Frozen", "OnMesh"]


class Frozen:
    """A frozen dataclass whose arrays are read-only as well, those in tuples, lists and mappings too.

    They are views: whoever made an array can still write into it.
    """

    def __post_init__(self) -> None:
        for field in fields(self):  # type: ignore[arg-type]
            object.__setattr__(self, field.name, _read_only(getattr(self, field.name)))


def _read_only(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        view = value.view()
        view.flags.writeable = False
        return view
    if isinstance(value, Mapping) and any(isinstance(one, np.ndarray) for one in value.values()):
        return {name: _read_only(one) for name, one in value.items()}
    if type(value) in (tuple, list) and any(isinstance(one, np.ndarray) for one in value):
        return type(value)(_read_only(one) for one in value)
    return value


class OnMesh:
    """Base of objects on a mesh, and with it on all ranks: copies share the mesh, none can be pickled."""

    def __reduce_ex__(self, protocol: Any) -> Any:
        raise InputError(
            f"a {type(self).__name__} cannot be pickled or deep-copied, nor what holds one: its mesh lies on "
            "all ranks; build it anew, and keep a state by save_state, modes by save_modes of "
            "lobefem.io.checkpoints"
        )

    def __copy__(self) -> Any:
        new = object.__new__(type(self))
        vars(new).update(vars(self))
        return new
