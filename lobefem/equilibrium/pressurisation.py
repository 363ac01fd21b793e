"""`pressurise`: equilibria along a row of pressures, one after the other."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.state import Equilibrium
from lobefem.fem.balloon import Balloon

__all__ = ["pressurise"]


def pressurise(balloon: Balloon, pressures: Iterable[float], **how: Any) -> Iterator[Equilibrium]:
    """Equilibria at pressures in a row, each found from the one before.

    With `raise_on_failure=False` the state that did not converge is the last one.

    Args:
        balloon: what to inflate.
        pressures: [Pa], looked at one by one: a generator may choose the next one by what it has seen.
        **how: of `inflate`; `start` is of the first one.

    Yields:
        the state at each pressure.

    Raises:
        InputError, ConvergenceError: see `inflate`.

    Collective.
    """
    state = how.pop("start", None)
    for pressure in pressures:
        state = inflate(balloon, pressure, start=state, **how)
        yield state
        if not state.converged:
            return
