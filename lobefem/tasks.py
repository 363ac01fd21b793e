"""What the command line does with a design, as plain data.

A solve that fails is part of the outcome: what was reached before it is kept and can be stored.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import lobefem
from lobefem.branches import follow
from lobefem.design import Design
from lobefem.equilibrium import Equilibrium, ideal_state
from lobefem.equilibrium import inflate as find_equilibrium
from lobefem.errors import InputError, SolveError
from lobefem.kink import has_kink, one_sided_modes
from lobefem.stability import Mode, Modes, find_modes
from lobefem.storage import Snapshot

__all__ = [
    "KINK",
    "SCHEMA",
    "STATES",
    "Outcome",
    "Progress",
    "check_state",
    "failure",
    "inflate",
    "mode_data",
    "modes",
    "summary",
]

SCHEMA = 1  # of the results; a change that a reader must know of raises it
STATES = ("ideal", "inflated")
Progress = Callable[[str], None]

_VERDICT = (
    "whether film with fixed wrinkles is stable at a pressure is a property of the mesh: refined, it turns "
    "unstable at any; see lobefem critical with several --divisions"
)
KINK = (
    "the ideal state of tension-field film lies on the border of taut and wrinkled, where its tangent "
    "jumps: what is shown is the wrinkled side, a lower bound, beside the mean of both sides, an upper one"
)
_NO_SLACK = "isotropic film has no slack part, so slack_stiffness has no effect"
_EQUILIBRIUM = (
    "converged", "reason", "iterations", "residual", "relative_residual", "pressure", "prestress",
    "volume", "strain_energy", "max_displacement", "bar_force", "hoop_tension", "taut_area",
    "wrinkled_area", "slack_area", "num_dofs", "steps",
)  # fmt: skip


@dataclass
class Outcome:
    """What a command found.

    Attributes:
        results: plain data in SI units, for JSON.
        snapshots: what can be drawn of it.
        error: the failure that ended it early, None where there was none.
        figures: by file name, what draws each of them, for rank 0.
    """

    results: dict[str, Any]
    snapshots: list[Snapshot] = field(default_factory=list)
    error: SolveError | None = None
    figures: dict[str, Callable[[], Any]] = field(default_factory=dict)


def inflate(design: Design, *, comm: Any = None, progress: Progress | None = None) -> Outcome:
    """The equilibrium at the design's one pressure. Collective.

    Raises:
        InputError: a design of several pressures.
    """
    pressures = design.pressure.value
    if len(pressures) != 1:
        raise InputError(
            f"inflate takes one pressure, not {_list(pressures)}; give one, e.g. --pressure {pressures[-1]:g}"
        )
    outcome = Outcome(summary("inflate", design) | dict.fromkeys(_EQUILIBRIUM))
    balloon = design.balloon(design.surface(comm))
    state: Equilibrium | None
    try:
        state = find_equilibrium(balloon, pressures[0], progress=progress)
    except SolveError as error:
        outcome.error, state = error, getattr(error, "state", None)
    if state is not None:
        outcome.results |= {key: getattr(state, key) for key in _EQUILIBRIUM}
        outcome.snapshots.append(Snapshot(balloon, state.pressure, state))
    if outcome.error is not None:
        outcome.results |= failure(outcome.error)
    return outcome


def modes(
    design: Design,
    *,
    state: str = "ideal",
    count: int = 8,
    mass: str = "unit",
    harmonics: tuple[int, ...] | None = None,
    comm: Any = None,
    progress: Progress | None = None,
) -> Outcome:
    """The lowest modes at each of the design's pressures, in the order given. Collective.

    Args:
        design: what to look at.
        state: "ideal" for the held isotensoid with prestress in proportion to the pressure,
            "inflated" for the equilibrium, each found from the one before.
        count: modes a pressure.
        mass: "unit" or "nodal".
        harmonics: look at modes of these harmonics only, each from one sector.
        comm: MPI communicator (default: all ranks).
        progress: called with a line of text now and then.

    Raises:
        InputError: an ideal state asked of a cylinder.
    """
    check_state(state, design)
    results = summary("modes", design) | {"state": state, "mass": mass, "pressures": []}
    if design.film.law == "fixed-wrinkles":
        results["warnings"].append(_VERDICT)
    if state == "ideal" and design.film.law == "tension-field" and not design.film.hoop_slack:
        results["warnings"].append(KINK)
    outcome = Outcome(results)
    balloon = design.balloon(design.surface(comm), prestressed=True if state == "ideal" else None)
    two_sided = state == "ideal" and has_kink(balloon)
    previous: Equilibrium | None = None
    for pressure in design.pressure.value:
        try:
            if state == "ideal":
                held = ideal_state(balloon, pressure)
            else:
                held = previous = find_equilibrium(balloon, pressure, start=previous, progress=progress)
            if progress is not None:
                progress(f"modes at {pressure:g} Pa")
            sides = None
            if two_sided:
                sides = one_sided_modes(balloon, pressure, count, mass=mass, harmonics=harmonics)
                found = sides.wrinkled
            else:
                found = find_modes(held, count, mass=mass, harmonics=harmonics)
        except SolveError as error:
            outcome.error = error
            results |= failure(error)
            last = getattr(error, "state", None)
            if last is not None and last is not previous:
                outcome.snapshots.append(Snapshot(balloon, last.pressure, last))
            return outcome
        results["pressures"].append(
            {
                "pressure": pressure,
                "modes": [mode_data(mode) for mode in found.modes],
                "stable": found.stable,
                "symmetric": found.symmetric,
                "asymmetry": found.asymmetry,
                "num_negative": found.num_negative,
                "state_residual": held.relative_residual,
                "volume": held.volume,
            }
        )
        if sides is not None:
            results["pressures"][-1] |= {
                "mean_modes": [mode_data(mode) for mode in sides.mean.modes],
                "taut_modes": [mode_data(mode) for mode in sides.taut.modes],
                "bounds": sides.bounds,
            }
        outcome.snapshots.append(Snapshot(balloon, pressure, held, found.modes))
    results["branches"] = _branches(outcome.snapshots, mass)
    return outcome


def _branches(snapshots: list[Snapshot], mass: str) -> list[dict[str, Any]]:
    """The modes of different pressures as curves, likeness deciding which goes on as which. Collective."""
    sweep = {
        s.pressure: Modes(s.state, mass, True, 0.0, None, s.modes) for s in snapshots if s.state is not None
    }
    if len(sweep) < 2:
        return []
    return [
        vars(b) | {"pressures": b.pressures.tolist(), "values": b.values.tolist()}
        for b in follow(list(sweep.values()))
    ]


def check_state(state: str, design: Design) -> None:
    """Refuse an unknown kind of state, or one that the design lacks, with an InputError."""
    if state not in STATES:
        raise InputError(f"state {state!r} is unknown; use ideal or inflated")
    if state == "ideal" and not design.has_ideal_state:
        raise InputError(
            "a cylinder has no ideal state, for it carries no pressure as it is drawn; use "
            "lobefem modes --state inflated, or the kind 'isotensoid' or 'formed'"
        )


def summary(command: str, design: Design) -> dict[str, Any]:
    """What every result says about its origin."""
    warnings = []
    if design.film.law == "isotropic" and design.film.slack_stiffness:
        warnings.append(_NO_SLACK)
    return {
        "schema": SCHEMA,
        "command": command,
        "version": lobefem.__version__,
        "film": design.film.law,
        "load": design.pressure.load,
        "support": design.plates.support,
        "lobes": design.shape.lobes,
        "divisions": design.mesh.divisions,
        "warnings": warnings,
    }


def mode_data(mode: Mode) -> dict[str, Any]:
    """What results say of a mode."""
    return {
        "real": mode.value.real,
        "imag": mode.value.imag,
        "residual": mode.residual,
        "harmonic": mode.harmonic,
        "kind": mode.kind,
        "harmonics": mode.harmonics,
    }


def failure(error: SolveError) -> dict[str, Any]:
    """What results say of a solve that failed."""
    reason = error.data.get("reason", type(error).__name__)
    return {"converged": False, "reason": reason, "error": str(error)}


def _list(pressures: tuple[float, ...]) -> str:
    return ", ".join(f"{p:g}" for p in pressures) + " Pa"
