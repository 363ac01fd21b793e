"""The command on a distortion: impose it, release it, and report it as plain data."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import partial
from typing import Any

from lobefem.app import advice
from lobefem.app.states_command import Outcome, failure, summary
from lobefem.equilibrium.distortions import Distortion
from lobefem.equilibrium.full_model import full_state
from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.sealed_gas import seal
from lobefem.equilibrium.state import Equilibrium, State
from lobefem.errors import EigenError, InputError, SolveError
from lobefem.fem.balloon import Balloon
from lobefem.io.design import Design
from lobefem.io.run_folder import RunFolder
from lobefem.io.xdmf import Snapshot
from lobefem.outcomes import UNKNOWN
from lobefem.progress import Progress
from lobefem.stability.modes import find_modes
from lobefem.stability.perturbation import Perturbed, Point
from lobefem.stability.perturbation import perturb as impose
from lobefem.typing import Comm
from lobefem.units import in_degrees
from lobefem.viz.frames import keep_frame

__all__ = ["perturb"]


def perturb(
    design: Design,
    distortion: Distortion,
    *,
    let_go: bool = False,
    contact: bool = True,
    steps: int = 20,
    damping: float = 1.0,
    comm: Comm | None = None,
    progress: Progress | None = None,
    folder: RunFolder | None = None,
) -> Outcome:
    """Pressurise, distort by a ramp, and release (paper sec. 6); every accepted step is kept. Collective.

    Film of lobes carries their own stress from the start, in closed form ("initial stress") or as the
    prescribed load path has found it.

    Args:
        design: what to distort, at its one pressure.
        distortion: what to impose.
        let_go: whether to release it.
        contact: whether film and plates may touch, not pass through each other.
        steps: increments of the ramp.
        damping: of the release, as a multiple of `lobefem.equilibrium.gradient_flow.damping_scale`.
        comm: MPI communicator (default: all ranks).
        progress: called with a line of text now and then.
        folder: where to keep the steps, and to go on from.

    Raises:
        InputError: a design of several pressures, a distortion that it cannot take, or a run to go on
            with that is of another study.
    """
    pressures = design.pressure.value
    if len(pressures) != 1 or pressures[0] <= 0:
        given = " and ".join(f"{p:g} Pa" for p in pressures)
        raise InputError(f"perturb takes one pressure above 0, not {given}; give --pressure 5, say")
    if design.film.law == "load-path":
        raise InputError(
            "film.law = 'load-path' is a way to a stress and has no energy; distort the film that takes "
            "over: --film tension-field --setup load-path"
        )
    amount, unit = in_degrees(distortion.parameter, distortion.unit)
    degrees = unit != distortion.unit
    results = summary("perturb", design) | {
        "distortion": distortion.kind,
        "parameter": amount,
        "unit": unit,
        "reaction_unit": distortion.reaction_unit,
        "pressure": pressures[0],
        "contact": contact,
        "release": let_go,
    }
    results["warnings"] += advice.of_distortion(design) + advice.of_built_in(design)
    outcome = Outcome(results)
    built_in = True if design.has_ideal_state else None
    balloon = design.balloon(design.surface(comm), prestressed=built_in, contact=contact)
    original = None
    if design.is_pumpkin or design.pressure.gas == "isothermal":
        original = _original(design, balloon, comm, results, progress)
        balloon = original.balloon
    resume, keep = None, None
    if folder is not None:
        resume, keep = folder.kept(balloon), partial(_keep, folder)
    found: Perturbed | None = None
    try:
        found = impose(
            balloon, pressures[0], distortion, let_go=let_go, steps=steps, damping=damping,
            original=original, resume=resume, keep=keep, progress=progress,
        )  # fmt: skip
    except SolveError as error:
        outcome.error = error
        last = error.state
        if last is not None:
            outcome.snapshots.append(Snapshot(last.balloon, last.pressure, last))
        results |= failure(error) | {"history": _points(error.data.get("points", ()), degrees)}
        return outcome
    results |= _perturbed(found, degrees)
    results["warnings"] += advice.of_ledger(results["energy"]["error"])
    if results["outcome"] == UNKNOWN:
        results["warnings"].append(results["reason"])
    rest = None if found.released is None else found.released.state
    if folder is not None and rest is not None:
        last = len(found.history) - 1
        keep_frame(folder.path, last, rest, (*_ends([vars(p) for p in found.history]), last))
    try:  # what judges the end takes nothing away from how it was reached
        if found.released is not None:
            results["min_eigenvalue"] = found.released.lowest
            if found.released.modes is not None:
                results["eigenvalues"] = [mode.value.real for mode in found.released.modes.modes]
        elif found.imposed is not None:
            results["min_eigenvalue"] = find_modes(found.imposed, 2).lowest
    except EigenError as error:
        results["warnings"].append(f"the lowest eigenvalue at the end is not known: {error}")
    if rest is not None:
        results |= _against(found.original, rest)
    for state in (found.imposed, None if found.released is None else found.released.state):
        if state is not None:
            outcome.snapshots.append(Snapshot(state.balloon, state.pressure, state))
    outcome.figures["history.png"] = lambda: _history_figure(found, results)
    return outcome


def _original(
    design: Design, balloon: Balloon, comm: Comm, results: dict[str, Any], progress: Progress | None
) -> Equilibrium:
    """The pressurised balloon of a design: of all gores that in which they are alike, the gas sealed in.

    How stable it is against every harmonic goes to the results. Collective.
    """
    gas, value = design.pressure, design.pressure.value[0]
    if design.is_pumpkin:
        gore = inflate(
            design.balloon(design.surface(comm, sector=True)), value, nested=True, progress=progress
        )
        modes = find_modes(gore, 1, harmonics=range(gore.balloon.surface.copies // 2 + 1))
        results["gores"] = design.shape.gores
        results["symmetric_eigenvalue"] = modes.lowest
        results["symmetric_harmonic"] = min(modes.modes, key=lambda mode: mode.value.real).harmonic
        state = full_state(gore, balloon)
    else:
        state = inflate(balloon, value, progress=progress)
    return seal(state, gas.ambient) if gas.gas == "isothermal" else state


def _against(original: Equilibrium, end: Equilibrium) -> dict[str, Any]:
    """Differences of a state from the original one, and its contact. Collective."""
    first, last = (state.balloon.energy(state.restore())[0] for state in (original, end))
    contact = end.balloon.contact
    report = None if contact is None else contact.measure(end.balloon.u)
    closed = end.balloon.load.convention == "closed"
    return {
        "pressure_final": end.pressure,
        "volume_deficit": 1 - end.volume / original.volume,
        "energy_above": last - first if closed else None,
        "contact_force": None if report is None else report.force,
        "contact_area": None if report is None else report.area,
    }


def _keep(folder: RunFolder, state: State, notes: Mapping[str, Any]) -> None:
    folder.keep(state, notes)
    keep_frame(folder.path, notes["point"], state, _ends(notes["history"]))


def _ends(history: Sequence[Mapping[str, Any]]) -> tuple[int, ...]:
    """The number of the ramp's last point, once there is a release."""
    ramp = sum(point["time"] is None for point in history)
    return (ramp - 1,) if ramp < len(history) else ()


def _perturbed(found: Perturbed, degrees: bool) -> dict[str, Any]:
    """A perturbation as plain data, its parameter in the option's unit."""
    released, end = found.released, found.ramp[-1]
    rest = found.history[-1]
    state = None if released is None else released.state
    final = end.volume if released is None else (rest.volume if state is None else state.volume)
    return {
        "volume_original": found.original.volume,
        "volume_imposed": end.volume,
        "volume_final": final,
        "imposed_ratio": end.volume / found.original.volume,
        "reaction": end.reaction,
        "outcome": "distorted under the constraint" if released is None else released.outcome,
        "reason": "" if released is None else released.reason,
        "min_eigenvalue": None,
        "residual": rest.residual if state is None else state.relative_residual,
        "first_contact": _shown(found.first_contact, degrees),
        "smallest_gap": min((p.gap for p in found.history if p.gap is not None), default=None),
        "distance": None if released is None else released.distance,
        "rotation": None if released is None else released.rotation,
        "energy": asdict(rest.ledger) | {"closure": rest.ledger.closure, "error": rest.ledger.error},
        "history": _points(found.history, degrees),
    }


def _points(history: Sequence[Point], degrees: bool) -> list[dict[str, Any]]:
    """The steps of a perturbation as plain data."""
    return [
        {
            "parameter": _shown(p.parameter, degrees),
            "reaction": p.reaction,
            "volume": p.volume,
            "mid_hoop_displacement": p.mid_hoop_displacement,
            "contact_force": p.contact_force,
            "time": p.time,
            "residual": p.residual,
            "ledger": asdict(p.ledger),
        }
        for p in history
    ]


def _shown(parameter: float | None, degrees: bool) -> float | None:
    return math.degrees(parameter) if degrees and parameter is not None else parameter


def _history_figure(found: Perturbed, results: dict[str, Any]) -> Any:
    from lobefem.viz.study_figures import perturbation

    return perturbation(found.history, unit=results["unit"], reaction_unit=results["reaction_unit"])
