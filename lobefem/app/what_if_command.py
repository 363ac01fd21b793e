"""`lobefem critical --what-if`: the critical pressure with other assumptions, to see what decides."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from lobefem.app.states_command import Outcome
from lobefem.errors import InputError
from lobefem.io.design import Design
from lobefem.io.run_folder import RunFolder
from lobefem.progress import Progress, part, said

__all__ = ["changes", "what_if"]

Run = Callable[[Design, Progress | None, RunFolder | None], Outcome]


def changes(design: Design) -> list[tuple[str, dict[str, Any]]]:
    """The other assumptions that are tried on a design, in words and as keys.

    Bar and load are left out where they have no part in the answer.
    """
    found: list[tuple[str, dict[str, Any]]] = []
    if design.has_plates and design.plates.support != "fixed":
        bar = design.plates.bar
        found += [("no bar", {"plates.bar": False})] if bar else []
        found += [("a rigid bar", {"plates.bar": True})] if bar is not True else []
        other = {"closed": "film", "film": "closed"}[design.pressure.load]
        found.append((f"load {other}", {"pressure.load": other}))
    for words, factor in (("half the film stiffness", 0.5), ("double the film stiffness", 2.0)):
        found.append((words, {"film.E": factor * design.film.modulus}))
    return found


def what_if(
    design: Design, run: Run, *, progress: Progress | None = None, folder: RunFolder | None = None
) -> Outcome:
    """The critical pressure of a design, with a table of those with other assumptions. Collective.

    Args:
        design: what to look at.
        run: finds the critical pressure of a design.
        progress: called with a line of text now and then.
        folder: of the design as given; the answers of the others are kept in its run.json.

    Raises:
        InputError: a pumpkin, which has neither bar nor hoops and sensitivities of its own.
    """
    if design.is_pumpkin:
        raise InputError(
            "--what-if tries the bar and the load of stacked lobes; lobefem sensitivities tells what a "
            "pumpkin's stability depends on"
        )
    tried = changes(design)
    share = 1 / (len(tried) + 1)
    outcome = run(design, part(progress, 0.0, share), folder)
    if outcome.error is not None:
        return outcome
    known: list[dict[str, Any]] = [] if folder is None else folder.kept_step("what if") or []
    rows = [{"change": "as given", "settings": {}} | _answer(outcome.results)]
    for number, (words, settings) in enumerate(tried, 1):
        if number <= len(known):
            rows.append(known[number - 1])
            continue
        if progress is not None:
            progress(said(f"what if: {words}", number * share))
        other = run(
            design.with_overrides(settings), part(progress, number * share, (number + 1) * share), None
        )
        error = None if other.error is None else str(other.error)
        rows.append({"change": words, "settings": settings} | _answer(other.results) | {"error": error})
        if folder is not None:
            folder.keep_step("what if", rows[1:])
    outcome.results["what_if"] = rows
    return outcome


def _answer(results: dict[str, Any]) -> dict[str, Any]:
    keys = ("critical_pressure", "harmonic", "kind", "max_stress")
    return {key: results.get(key) for key in keys} | {"error": None}
