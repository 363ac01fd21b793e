"""What the command line does with a design, as plain data.

A solve that fails is part of the outcome: what was reached before it is kept and can be stored.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import lobefem
from lobefem.chart import HarmonicChart, harmonic_chart
from lobefem.critical import critical_pressure
from lobefem.design import Design
from lobefem.equilibrium import Equilibrium, ideal_state
from lobefem.equilibrium import inflate as find_equilibrium
from lobefem.errors import InputError, SolveError
from lobefem.stability import Mode, find_modes
from lobefem.storage import Snapshot

__all__ = ["STATES", "Outcome", "critical", "harmonics", "inflate", "modes"]

SCHEMA = 1  # of the results; a change that a reader must know of raises it
STATES = ("ideal", "inflated")
Progress = Callable[[str], None]

_MESH_DEPENDENT = (
    "the critical pressure of film with fixed wrinkles is a property of the mesh: it tends to 0 "
    "under refinement, so compare several --divisions"
)
_HIGH_HARMONICS = (
    "critical pressures of film with fixed wrinkles converge under refinement in low harmonics only; from "
    "about n = 7 on they tend to 0"
)
_VERDICT = (
    "whether film with fixed wrinkles is stable at a pressure is a property of the mesh: refined, it turns "
    "unstable at any; see lobefem critical with several --divisions"
)
_KINK = (
    "the ideal state of tension-field film lies on the border of taut and wrinkled, where its "
    "tangent jumps; set film.hoop_slack above 0 to choose the wrinkled one"
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
    outcome = Outcome(_summary("inflate", design) | dict.fromkeys(_EQUILIBRIUM))
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
        outcome.results |= _failure(outcome.error)
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
    _check_state(state, design)
    results = _summary("modes", design) | {"state": state, "mass": mass, "pressures": []}
    if design.film.law == "fixed-wrinkles":
        results["warnings"].append(_VERDICT)
    if state == "ideal" and design.film.law == "tension-field" and not design.film.hoop_slack:
        results["warnings"].append(_KINK)
    outcome = Outcome(results)
    balloon = design.balloon(design.surface(comm), prestressed=True if state == "ideal" else None)
    previous: Equilibrium | None = None
    for pressure in design.pressure.value:
        try:
            if state == "ideal":
                held = ideal_state(balloon, pressure)
            else:
                held = previous = find_equilibrium(balloon, pressure, start=previous, progress=progress)
            if progress is not None:
                progress(f"modes at {pressure:g} Pa")
            found = find_modes(held, count, mass=mass, harmonics=harmonics)
        except SolveError as error:
            outcome.error = error
            results |= _failure(error)
            last = getattr(error, "state", None)
            if last is not None and last is not previous:
                outcome.snapshots.append(Snapshot(balloon, last.pressure, last))
            return outcome
        results["pressures"].append(
            {
                "pressure": pressure,
                "modes": [_mode(mode) for mode in found.modes],
                "stable": found.stable,
                "symmetric": found.symmetric,
                "asymmetry": found.asymmetry,
                "num_negative": found.num_negative,
                "state_residual": held.relative_residual,
                "volume": held.volume,
            }
        )
        outcome.snapshots.append(Snapshot(balloon, pressure, held, found.modes))
    return outcome


def critical(
    design: Design,
    *,
    state: str = "ideal",
    harmonic: int | None = None,
    comm: Any = None,
    progress: Progress | None = None,
) -> Outcome:
    """The lowest critical pressure of the held ideal geometry. Collective.

    Args:
        design: what to look at; its own pressure does not matter.
        state: "ideal"; the path of inflated equilibria is not searched for a critical point.
        harmonic: look among modes of this circumferential harmonic only.
        comm: MPI communicator (default: all ranks).
        progress: called with a line of text now and then.

    Raises:
        InputError: a state without a linear pencil, or an ideal state asked of a cylinder.
    """
    _check_state(state, design)
    if state != "ideal":
        raise InputError(
            "critical works on the ideal state only; for inflated ones follow the sign of the "
            "lowest eigenvalue with: lobefem modes --state inflated"
        )
    results = _summary("critical", design) | {"state": state}
    if design.film.law == "fixed-wrinkles":
        results["warnings"].append(_MESH_DEPENDENT)
    if design.film.law == "tension-field" and not design.film.hoop_slack:
        results["warnings"].append(_KINK)
    outcome = Outcome(results)
    balloon = design.balloon(design.surface(comm), prestressed=True)
    try:
        if progress is not None:
            progress("critical pressure")
        found = critical_pressure(balloon, harmonic=harmonic)
    except SolveError as error:
        outcome.error = error
        results |= {"critical_pressure": None} | _failure(error)
        return outcome
    mode = found.mode
    results |= {
        "critical_pressure": found.pressure if math.isfinite(found.pressure) else None,
        "harmonic": harmonic if mode is None else mode.harmonic,
        "divisions": found.divisions,
        "kind": None if mode is None else mode.kind,
        "residual": None if mode is None else mode.residual,
        "pressures": found.pressures,
    }
    if mode is None:
        never = "stable at any pressure that the film can bear"
        results["reason"] = "unstable at any pressure" if found.pressure == 0.0 else never
    else:
        outcome.snapshots.append(Snapshot(balloon, found.pressure, None, (mode,)))
    return outcome


def harmonics(
    design: Design,
    *,
    harmonics: tuple[int, ...] | None = None,
    comm: Any = None,
    progress: Progress | None = None,
) -> Outcome:
    """The critical pressure of each harmonic of the held ideal geometry, from one sector. Collective.

    Args:
        design: what to look at; its own pressure does not matter.
        harmonics: which; by default all that the mesh has.
        comm: MPI communicator (default: all ranks).
        progress: called with a line of text now and then.

    Raises:
        InputError: an ideal state asked of a cylinder, an unstructured mesh, a harmonic it lacks.
    """
    _check_state("ideal", design)
    results = _summary("harmonics", design)
    if design.film.law == "fixed-wrinkles":
        results["warnings"].append(_HIGH_HARMONICS)
    if design.film.law == "tension-field" and not design.film.hoop_slack:
        results["warnings"].append(_KINK)
    outcome = Outcome(results)
    balloon = design.balloon(design.surface(comm, sector=True), prestressed=True)
    try:
        chart = harmonic_chart(balloon, harmonics, comm=comm, progress=progress)
    except SolveError as error:
        outcome.error = error
        results |= {"critical_pressure": None, "chart": []} | _failure(error)
        return outcome
    rows = zip(chart.harmonics, chart.pressures, chart.kinds, chart.residuals, strict=True)
    results |= {
        "critical_pressure": chart.pressure if math.isfinite(chart.pressure) else None,
        "harmonic": chart.lowest,
        "divisions": chart.divisions,
        "chart": [
            {"harmonic": n, "critical_pressure": p, "kind": kind, "residual": residual}
            for n, p, kind, residual in rows
        ],
    }
    outcome.figures["critical_pressures.png"] = lambda: _chart_figure(chart)
    return outcome


def _chart_figure(chart: HarmonicChart) -> Any:
    from lobefem.charts import harmonic_pressures

    return harmonic_pressures(chart)


def _check_state(state: str, design: Design) -> None:
    if state not in STATES:
        raise InputError(f"state {state!r} is unknown; use ideal or inflated")
    if state == "ideal" and not design.has_ideal_state:
        raise InputError(
            "a cylinder has no ideal state, for it carries no pressure as it is drawn; use "
            "lobefem modes --state inflated, or the kind 'isotensoid' or 'formed'"
        )


def _summary(command: str, design: Design) -> dict[str, Any]:
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


def _mode(mode: Mode) -> dict[str, Any]:
    return {
        "real": mode.value.real,
        "imag": mode.value.imag,
        "residual": mode.residual,
        "harmonic": mode.harmonic,
        "kind": mode.kind,
        "harmonics": mode.harmonics,
    }


def _failure(error: SolveError) -> dict[str, Any]:
    reason = error.data.get("reason", type(error).__name__)
    return {"converged": False, "reason": reason, "error": str(error)}


def _list(pressures: tuple[float, ...]) -> str:
    return ", ".join(f"{p:g}" for p in pressures) + " Pa"
