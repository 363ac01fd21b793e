"""`lobefem optimise`: the best design of a pumpkin by SciPy's SLSQP on adjoint sensitivities."""

from __future__ import annotations

import math
import shutil
from pathlib import Path
from typing import Any

import numpy as np

from lobefem.app.search_designs import Record, Solved
from lobefem.app.search_file import LIMITS, Search
from lobefem.app.search_ranking import SIGN, Ended, best_of, feasible, margin, score
from lobefem.errors import InputError
from lobefem.files import replace
from lobefem.progress import Progress
from lobefem.typing import Array

__all__ = ["begin", "search"]

_SEED = 22
_MOST, _RUNS = 15, 4  # iterations of SLSQP, and runs from where the last one ended
_SAFE = 1.0005  # by which the smooth measure of the stress is made larger, half of a limit's tolerance


def begin(search: Search, folder: Path, *, resume: bool, overwrite: bool) -> Solved:
    """Make a folder the search's own; what solves its designs and keeps them there.

    Raises:
        InputError: it holds something and is neither to be gone on with nor to be replaced.
    """
    try:
        if folder.exists() and not folder.is_dir():
            raise InputError(f"'{folder}' is a file, not a folder; give another --out")
        ours = (folder / "search.toml").is_file()
        if resume and not ours:
            raise InputError(f"'{folder}' holds no search to go on with; leave out --resume")
        if not (resume or overwrite) and folder.is_dir() and any(folder.iterdir()):
            raise InputError(f"'{folder}' is not empty; go on with --resume, replace it with --overwrite")
        if overwrite and ours:
            for name in ("designs", "best"):
                shutil.rmtree(folder / name, ignore_errors=True)
        (folder / "designs").mkdir(parents=True, exist_ok=True)
        replace(folder / "search.toml", search.text)
    except OSError as error:
        raise InputError(f"'{folder}': {error.strerror or error}; give another place") from None
    return Solved(search, folder / "designs")


def search(
    plan: Search, solved: Solved, *, starts: int, random: int, progress: Progress | None = None
) -> list[Ended]:
    """Run the optimiser from each start for each choice, and look at random designs.

    Args:
        plan: what to search for.
        solved: designs that are known, and become so.
        starts: the first is the middle of all ranges, the others are random.
        random: number of random designs for comparison.
        progress: called with a line of text after each design.
    """
    rng = np.random.default_rng(_SEED)
    span = plan.high - plan.low
    points = [np.full(plan.size, 0.5), *(rng.uniform(size=(starts - 1, plan.size)))]
    rng = np.random.default_rng(_SEED + 1)
    drawn = [(int(rng.integers(len(plan.choices))), rng.uniform(size=plan.size)) for _ in range(random)]
    ended = [
        _optimise(plan, solved, choice, start, y, progress)
        for choice in range(len(plan.choices))
        for start, y in enumerate(points[:starts])
    ]
    for k, (choice, y) in enumerate(drawn):
        record = solved(choice, plan.low + y * span)
        _tell(plan, progress, f"random design {k + 1} of {random}", record)
    return ended


def _tell(plan: Search, progress: Progress | None, what: str, record: Record) -> None:
    if progress is not None:
        goal = record.values.get(plan.goal)
        progress(
            f"{what}: " + (record.fault or f"{plan.goal} {goal:.5g}, margin {margin(plan, record):+.3g}")
        )


class _Problem:
    """One choice's problem in parameters from 0 to 1, and with the goal of a critical pressure its lowest.

    The lowest of several critical pressures has corners, so that a further unknown, which is to be large,
    lies below the logarithms of all of them: a critical pressure may rise tenfold within a few degrees.
    """

    def __init__(self, plan: Search, solved: Solved, choice: int) -> None:
        self.plan, self._solved, self._choice = plan, solved, choice
        self._span = plan.high - plan.low
        self.lifted = plan.goal == "critical_pressure"
        self.scale = 1.0
        self.smooth = 1.0  # largest stress over the smooth measure that stands for it
        self.seen: list[Record] = []

    def record(self, z: Array, *, gradients: bool = False) -> Record:
        y = np.asarray(z[: self.plan.size])
        record = self._solved(self._choice, self.plan.low + y * self._span, gradients=gradients)
        if not gradients:
            self.seen.append(record)
        return record

    def goal(self, z: Array) -> float:
        """Objective to be minimised."""
        if self.lifted:
            return -float(z[-1])
        record = self.record(z)
        return 10.0 if record.fault else -score(self.plan, record) / self.scale

    def goal_gradient(self, z: Array) -> Array:
        """Its derivative."""
        found = np.zeros(len(z))
        if self.lifted:
            found[-1] = -1.0
            return found
        record = self.record(z, gradients=True)
        if record.gradients is not None:
            found[:] = -SIGN[self.plan.goal] * record.gradients[self.plan.goal] * self._span / self.scale
        return found

    def limits(self, z: Array) -> Array:
        """Constraints, not negative if kept: margins, and logarithms of critical pressures."""
        record = self.record(z)
        if record.fault:
            return np.full(len(self._rows()), -1.0)
        found = []
        for key, limit, sign in self._rows():
            value = record.values[key]
            if sign:
                found.append(sign * (1 - value / limit))
            else:
                found.append(math.log(value) - (math.log(limit) if limit else float(z[-1])))
        return np.array(found)

    def limits_gradient(self, z: Array) -> Array:
        """Its derivative (limits, unknowns)."""
        rows = self._rows()
        found = np.zeros((len(rows), len(z)))
        record = self.record(z, gradients=True)
        for row, (key, limit, sign) in enumerate(rows):
            if record.gradients is not None:
                factor = -sign / limit if sign else 1 / record.values[key]
                found[row, : self.plan.size] = factor * record.gradients[key] * self._span
            if not sign and not limit:
                found[row, -1] = -1.0
        return found

    def _rows(self) -> list[tuple[str, float, int]]:
        """Quantity, limit and sign of each row; critical pressures have none, and no limit in the goal."""
        rows = []
        pressures = [f"p_{n}" for n in self.plan.harmonics]
        for name, limit in self.plan.limits.items():
            if name == "critical_pressure":
                rows += [(key, limit, 0) for key in pressures]
            else:
                smooth = name == "max_stress"  # of the largest of many, which has corners
                key = "stress_norm" if smooth else name
                rows.append((key, limit / self.smooth if smooth else limit, LIMITS[name][1]))
        return rows + [(key, 0.0, 0) for key in pressures] if self.lifted else rows

    @property
    def constraints(self) -> list[dict[str, Any]]:
        """The limits as SciPy takes them."""
        if not self._rows():
            return []
        return [{"type": "ineq", "fun": self.limits, "jac": self.limits_gradient}]


def _optimise(
    plan: Search, solved: Solved, choice: int, start: int, y: Array, progress: Progress | None
) -> Ended:
    """One run of SLSQP, started again where it ended until that no longer helps."""
    from scipy.optimize import minimize

    named = ", ".join(f"{key} = {value}" for key, value in plan.choices[choice].items())
    what = f"{named + ', ' if named else ''}start {start + 1}"
    problem = _Problem(plan, solved, choice)
    first = problem.record(y)
    _tell(plan, progress, what, first)
    if first.fault:
        return Ended(choice, start, None, first.fault)
    problem.scale = abs(first.values[plan.goal])
    message, known = "", -math.inf
    for _ in range(_RUNS):
        z, bounds = y, [(0.0, 1.0)] * plan.size
        values = problem.record(y).values
        problem.smooth = _SAFE * values["max_stress"] / values["stress_norm"]
        if problem.lifted:
            z = np.append(y, math.log(values["critical_pressure"]))
            bounds = [*bounds, (-math.inf, math.inf)]
        found = minimize(
            problem.goal,
            z,
            jac=problem.goal_gradient,
            bounds=bounds,
            constraints=problem.constraints,
            method="SLSQP",
            callback=lambda z: _tell(plan, progress, what, problem.record(z)),
            options={"maxiter": _MOST, "ftol": 1e-4},
        )
        message = str(found.message)
        end, y = problem.record(found.x), np.clip(found.x[: plan.size], 0.0, 1.0)
        if end.fault:
            break
        reached = score(plan, end)
        if feasible(plan, end) and abs(reached - known) <= 1e-3 * abs(reached):
            break
        known = reached
    return Ended(choice, start, best_of(plan, problem.seen), message)
