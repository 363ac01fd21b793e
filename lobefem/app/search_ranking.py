"""Which of a search's designs keep the limits, and which is the best of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from lobefem.app.search_designs import Record
from lobefem.app.search_file import LIMITS, Search

__all__ = ["SIGN", "Ended", "best_of", "feasible", "margin", "margins", "score"]

_TOLERANCE = 1e-3  # of a limit, by which a design may miss it

SIGN = {"critical_pressure": 1.0, "volume": 1.0, "mass": -1.0}  # 1 for a goal to be made large


@dataclass(frozen=True)
class Ended:
    """The end of one run of the optimiser.

    Attributes:
        choice: index of the choice.
        start: number of the start.
        best: the best feasible design that the run has seen, None without one.
        message: what SciPy says.
    """

    choice: int
    start: int
    best: Record | None
    message: str


def margins(plan: Search, values: Mapping[str, float]) -> dict[str, float]:
    """Of each limit by how much of itself it is kept; of the critical pressure one a harmonic."""
    found: dict[str, float] = {}
    for name, limit in plan.limits.items():
        sign = LIMITS[name][1]
        keys = [f"p_{n}" for n in plan.harmonics] if name == "critical_pressure" else [name]
        found |= {key: sign * (1 - values[key] / limit) for key in keys}
    return found


def margin(plan: Search, record: Record) -> float:
    """The smallest of the margins, 1 without limits."""
    return min(margins(plan, record.values).values(), default=1.0)


def feasible(plan: Search, record: Record) -> bool:
    """True if a design was solved and keeps the limits."""
    return not record.fault and margin(plan, record) >= -_TOLERANCE


def score(plan: Search, record: Record) -> float:
    """The goal, the larger the better."""
    return SIGN[plan.goal] * record.values[plan.goal]


def best_of(plan: Search, records: Sequence[Record]) -> Record | None:
    """The best feasible design."""
    sound = [record for record in records if feasible(plan, record)]
    return max(sound, key=lambda record: score(plan, record)) if sound else None
