"""Checks of single arguments: each returns the value as a plain number or raises `InputError`.

They need no communication, so that every rank refuses a bad argument before the first collective
call.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from lobefem.errors import InputError
from lobefem.typing import Unchecked

__all__ = ["finite", "having", "integer", "integers", "numbers", "one_of", "positive"]


def finite(name: str, value: Unchecked, unit: str) -> float:
    """A finite real number; `unit` is for the message ('' where there is none)."""
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise InputError(f"{name} is {value!r}; give a number{unit and f' [{unit}]'}")
    if not math.isfinite(value):
        raise InputError(f"{name} is {value}; give a finite number{unit and f' [{unit}]'}")
    return float(value)


def positive(name: str, value: Unchecked, unit: str) -> float:
    """A finite number above zero."""
    number = finite(name, value, unit)
    if number <= 0.0:
        raise InputError(f"{name} is {value}; give a positive number{unit and f' [{unit}]'}")
    return number


def having(name: str, value: Unchecked, attribute: str, what: str) -> None:
    """Refuse an object of another kind, by an attribute that it lacks; `what` is to be given."""
    if not hasattr(value, attribute):
        plain = value is None or isinstance(value, (str, int, float))
        kind = f"the class {value.__name__}" if isinstance(value, type) else f"of type {type(value).__name__}"
        raise InputError(f"{name} is {repr(value) if plain else kind}; give {what}")


def integer(name: str, value: Unchecked, least: int) -> int:
    """An integer of at least `least`; True and 3.0 are none."""
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, np.integer)):
        raise InputError(f"{name} is {value!r}; give an integer, {least} or more")
    if value < least:
        raise InputError(f"{name} is {value}; give {least} or more")
    return int(value)


def integers(name: str, values: Unchecked, least: int) -> tuple[int, ...]:
    """Several integers of at least `least`, or a single one; `name` is that of one."""
    several = isinstance(values, Iterable) and not isinstance(values, str)
    return tuple(integer(name, value, least) for value in (values if several else (values,)))


def numbers(name: str, values: Unchecked, unit: str, count: int | None = None) -> tuple[float, ...]:
    """Finite numbers in a row, `count` of them."""
    row = isinstance(values, (tuple, list, range, np.ndarray)) and getattr(values, "ndim", 1) == 1
    if not row or len(values) != (count or len(values)):
        amount = f"{count} numbers" if count else "numbers"
        raise InputError(f"{name} is {values!r}; give {amount} [{unit}] in a row, as (0, 1, 2)")
    return tuple(finite(f"a part of {name}", value, unit) for value in values)


def one_of(name: str, value: Unchecked, allowed: tuple[str, ...]) -> str:
    """One of the allowed words."""
    if not isinstance(value, str) or value not in allowed:
        raise InputError(f"{name} is {value!r}; give {' or '.join(map(repr, allowed))}")
    return value
