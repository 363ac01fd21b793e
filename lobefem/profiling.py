"""Times of a run, stage by stage, each exclusive of those within it.

Factorisations and triangular solves are PETSc's, by its own log; all other stages are marked in the code
with `timed` or `stage`, whose clock stops while another stage, or one of those of PETSc, runs. So the
stages add up to the whole. Nothing is measured before `start`: marks cost then one comparison.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import wraps
from typing import Any

__all__ = ["OTHER", "STAGES", "Profile", "stage", "start", "stop", "timed"]

SYMBOLIC, NUMERIC, TRIANGULAR = "symbolic factorisation", "numeric factorisation", "triangular solves"

OTHER = "everything else"

_EVENTS = {
    SYMBOLIC: ("MatLUFactorSym", "MatCholFctrSym"),
    NUMERIC: ("MatLUFactorNum", "MatCholFctrNum"),
    TRIANGULAR: ("MatSolve", "MatSolveTranspos", "MatMatSolve"),
}

_SOLVE = ("residual", "energy", "tangent", SYMBOLIC, NUMERIC, TRIANGULAR, "eigensolver", "contact", "solver")

STAGES = ("import", "mesh", "form compilation", "set-up", *_SOLVE, "output", OTHER)

_profile: Profile | None = None


@dataclass
class Profile:
    """Seconds and calls of each stage on this rank.

    Attributes:
        seconds: by stage, exclusive of other stages.
        calls: by stage.
    """

    seconds: dict[str, float] = field(default_factory=lambda: dict.fromkeys(STAGES, 0.0))
    calls: dict[str, int] = field(default_factory=lambda: dict.fromkeys(STAGES, 0))
    _open: list[str] = field(default_factory=lambda: [OTHER])
    _since: float = field(default_factory=time.perf_counter)
    _logged: dict[str, Any] | None = None

    @property
    def whole(self) -> float:
        """Seconds of all stages: the whole process so far."""
        return sum(self.seconds.values())

    @property
    def solve(self) -> float:
        """Seconds of the solution: assembly, factorisations, solves and what steers them."""
        return sum(self.seconds[name] for name in _SOLVE)

    @property
    def floor(self) -> float:
        """Seconds of the numeric factorisations and triangular solves alone."""
        return self.seconds[NUMERIC] + self.seconds[TRIANGULAR]

    def update(self) -> None:
        """Give the time since the last update to the stage that is open, and to PETSc's in it."""
        now = time.perf_counter()
        passed = now - self._since
        self._since = now
        for name, (seconds, calls) in self._new_in_log().items():
            self.seconds[name] += seconds
            self.calls[name] += calls
            passed -= seconds
        self.seconds[self._open[-1]] += passed

    def enter(self, name: str) -> None:
        """Open a stage; the one that was open waits."""
        self.update()
        self._open.append(name)
        self.calls[name] += 1

    def leave(self) -> None:
        """Close the stage that is open."""
        self.update()
        self._open.pop()

    def _new_in_log(self) -> dict[str, tuple[float, int]]:
        """Times that PETSc has logged since the last call, once it is there."""
        petsc = sys.modules.get("petsc4py.PETSc")
        if petsc is None or not hasattr(petsc, "Log"):  # it is not there, or on its way
            return {}
        if self._logged is None:
            petsc.Log.begin()
            # an earlier profile of this process may have begun it
            self._logged = {
                name: (logged, *_totals(logged))
                for name, logged in (
                    (name, [petsc.Log.Event(event) for event in events]) for name, events in _EVENTS.items()
                )
            }
        news = {}
        for name, (events, seconds, calls) in self._logged.items():
            total, count = _totals(events)
            self._logged[name] = events, total, count
            news[name] = total - seconds, count - calls
        return news

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON: seconds and calls by stage, the whole, the solve and its floor."""
        self.update()
        return {
            "stages": {name: {"seconds": self.seconds[name], "calls": self.calls[name]} for name in STAGES},
            "whole": self.whole,
            "solve": self.solve,
            "floor": self.floor,
        }


def _totals(events: list[Any]) -> tuple[float, int]:
    """Seconds and calls of PETSc's events so far."""
    infos = [event.getPerfInfo() for event in events]
    return sum(i["time"] for i in infos), sum(i["count"] for i in infos)


def start() -> Profile:
    """Measure from now on; what passed since the process began counts as import."""
    global _profile
    _profile = Profile()
    _profile.seconds["import"] = _age()
    return _profile


def stop() -> None:
    """Measure no longer."""
    global _profile
    _profile = None


@contextmanager
def stage(name: str) -> Iterator[None]:
    """A context whose time is counted as a stage of its own."""
    profile = _profile
    if profile is None:
        yield
        return
    profile.enter(name)
    try:
        yield
    finally:
        profile.leave()


def timed[**P, R](name: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Decorate a function whose calls are a stage of their own."""

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        @wraps(function)
        def measured(*args: P.args, **kwargs: P.kwargs) -> R:
            if _profile is None:
                return function(*args, **kwargs)
            with stage(name):
                return function(*args, **kwargs)

        return measured

    return decorate


def _age() -> float:
    """Seconds since this process began; 0 where the system does not tell."""
    try:
        with open("/proc/self/stat", encoding="ascii") as stream:
            ticks = int(stream.read().rpartition(")")[2].split()[19])
        return time.clock_gettime(time.CLOCK_BOOTTIME) - ticks / os.sysconf("SC_CLK_TCK")
    except (OSError, AttributeError, ValueError):
        return 0.0
