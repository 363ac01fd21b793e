"""Commands on a design whose results are plain data: equilibrium states and their modes.

A solve that fails is part of the outcome: what was reached before it is kept and can be stored.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from lobefem.app import advice, pumpkin_command
from lobefem.equilibrium.full_model import spread_state
from lobefem.equilibrium.inflation import inflate as find_equilibrium
from lobefem.equilibrium.state import Equilibrium, ideal_state
from lobefem.errors import InputError, SolveError
from lobefem.io.design import Design
from lobefem.io.run_folder import RunFolder
from lobefem.io.xdmf import Snapshot
from lobefem.outcomes import UNDECIDED
from lobefem.progress import Progress, part, said
from lobefem.typing import Comm
from lobefem.version import __version__
from lobefem.viz.verdict import FIXED_WRINKLES, KINK

if TYPE_CHECKING:
    from lobefem.fem.balloon import Balloon
    from lobefem.stability.mode_records import Mode
    from lobefem.typing import Mass

__all__ = [
    "FIELDS",
    "SCHEMA",
    "STATES",
    "UNCHECKED",
    "Outcome",
    "borne",
    "check_state",
    "failure",
    "inflate",
    "mode_data",
    "modes",
    "summary",
]

SCHEMA = 1  # of the results; a change that a reader must know of raises it

STATES = ("ideal", "inflated")

UNCHECKED = {"mesh_error": None, "mesh_behaviour": None}  # of results on one mesh

FIELDS = ("tension-field", "imp")  # laws with the tension field's stress

_EQUILIBRIUM = (
    "converged", "reason", "iterations", "residual", "relative_residual", "pressure", "prestress",
    "volume", "strain_energy", "max_displacement", "bar_force", "hoop_tension", "taut_area",
    "wrinkled_area", "slack_area", "num_dofs", "steps",
)  # fmt: skip

_PEAKS = ("max_stress", "max_stress_place", "max_strain", "max_strain_place")


@dataclass
class Outcome:
    """The result of a command.

    Attributes:
        results: plain data in SI units, for JSON.
        snapshots: what can be drawn of it.
        error: the failure that ended it early, None where there was none.
        figures: by file name, what draws each of them, for rank 0.
        later: what makes further snapshots, such as all gores of one, called where they are written.
            Collective.
        design: the one that the snapshots are of, None where it is the one that was asked for.
    """

    results: dict[str, Any]
    snapshots: list[Snapshot] = field(default_factory=list)
    error: SolveError | None = None
    figures: dict[str, Callable[[], Any]] = field(default_factory=dict)
    later: list[Callable[[], Snapshot]] = field(default_factory=list)
    design: Design | None = None


def inflate(
    design: Design,
    *,
    comm: Comm | None = None,
    full: bool = False,
    progress: Progress | None = None,
    folder: RunFolder | None = None,
) -> Outcome:
    """The equilibrium at the design's one pressure; every pressure step is kept. Collective.

    Args:
        design: what to inflate; of a pumpkin one gore, which stands for all.
        full: all gores of a pumpkin.
        comm: MPI communicator (default: all ranks).
        progress: called with a line of text now and then.
        folder: where to keep the steps, and to go on from.

    Raises:
        InputError: a design of several pressures; all gores of what has none; one gore to be kept by several
            ranks.
    """
    pressures = design.pressure.value
    if full and not design.is_pumpkin:
        raise InputError("--full computes all gores of a pumpkin, and this design is none; leave it out")
    one_gore = design.is_pumpkin and not full
    if one_gore and folder is not None and folder.comm.size > 1:
        raise InputError(
            "one gore is kept by one process; start it without mpirun, or give --full or no --out"
        )
    if len(pressures) != 1:
        raise InputError(
            f"inflate takes one pressure, not {_list(pressures)}; give one, e.g. --pressure {pressures[-1]:g}"
        )
    keys = (*_EQUILIBRIUM, "reference_volume", *_PEAKS)
    outcome = Outcome(summary("inflate", design) | dict.fromkeys(keys))
    outcome.results["warnings"] += advice.of_pressures(design, pressures)
    balloon = design.balloon(design.surface(comm, sector=one_gore))
    state: Equilibrium | None
    options: dict[str, Any] = {"progress": progress}
    try:
        if folder is not None:
            options |= {"on_step": lambda state: folder.keep(state, {}), "start": _kept(folder, balloon)}
        if full and options.get("start") is None:
            options["start"] = _all_alike(design, balloon, progress)
        state = find_equilibrium(balloon, pressures[0], nested=True, **options)
    except SolveError as error:
        outcome.error, state = error, error.state
    if state is not None:
        outcome.results |= {key: getattr(state, key) for key in _EQUILIBRIUM} | borne(state)
        outcome.results["reference_volume"] = balloon.surface.copies * balloon.reference_volume
        outcome.snapshots.append(Snapshot(balloon, state.pressure, state))
        if design.is_pumpkin:
            outcome.results |= pumpkin_command.results(design, state)
            outcome.results["warnings"] += pumpkin_command.warnings(outcome.results)
    if outcome.error is not None:
        outcome.results |= failure(outcome.error)
    return outcome


def _all_alike(design: Design, balloon: Balloon, progress: Progress | None) -> Equilibrium:
    """One gore's equilibrium in all gores of a balloon. Collective.

    Raises:
        SolveError: none was found; its state is the last one, of all gores.
    """
    gore = design.balloon(design.surface(sector=True))
    try:
        return spread_state(
            find_equilibrium(gore, design.pressure.value[0], nested=True, progress=progress), balloon
        )
    except SolveError as error:
        if error.state is not None:
            error.state = spread_state(error.state, balloon)
        raise


def _kept(folder: RunFolder, balloon: Any) -> Equilibrium | None:
    """The equilibrium that a run came to. Collective."""
    kept: Any = folder.kept(balloon)
    if kept is None:
        return None
    return find_equilibrium(balloon, kept.pressure, prestress=kept.prestress, start=kept)


def modes(
    design: Design,
    *,
    state: str = "ideal",
    count: int = 8,
    mass: Mass = "unit",
    harmonics: tuple[int, ...] | None = None,
    comm: Comm | None = None,
    progress: Progress | None = None,
    folder: RunFolder | None = None,
) -> Outcome:
    """The lowest modes at each of the design's pressures, in the order given; each is kept. Collective.

    Args:
        design: what to look at.
        state: "ideal" for the held isotensoid with prestress in proportion to the pressure,
            "inflated" for the equilibrium, each found from the one before.
        count: modes a pressure.
        mass: "unit" or "nodal".
        harmonics: look at modes of these harmonics only, each from one sector.
        comm: MPI communicator (default: all ranks).
        progress: called with a line of text now and then.
        folder: where to keep each pressure's modes, and to go on from.

    Raises:
        InputError: an ideal state asked of a cylinder.
    """
    from lobefem.stability.modes import find_modes  # slow to import: inflate does without

    check_state(state, design)
    results = summary("modes", design) | {"state": state, "mass": mass, "pressures": []} | UNCHECKED
    if design.film.law == "fixed-wrinkles":
        results["warnings"].append(FIXED_WRINKLES)
    if state == "ideal":
        results["warnings"] += advice.of_built_in(design)
    if state == "ideal" and design.film.law in FIELDS and not design.film.hoop_slack:
        results["warnings"].append(KINK)
    results["warnings"] += advice.of_pressures(design, design.pressure.value)
    outcome = Outcome(results)
    balloon = design.balloon(design.surface(comm), prestressed=True if state == "ideal" else None)
    two_sided = False
    if state == "ideal" and design.film.law in FIELDS:
        from lobefem.stability import one_sided  # slow to import, as is SciPy with it

        two_sided = one_sided.has_kink(balloon)
    previous: Equilibrium | None = None
    pressures = design.pressure.value
    for number, pressure in enumerate(pressures, 1):
        kept = None if folder is None else folder.kept_modes(number, balloon)
        if kept is not None:
            previous, drawn, entry = kept[0], kept[1], dict(kept[2])
            results["pressures"].append(entry)
            outcome.snapshots.append(Snapshot(balloon, pressure, previous, drawn))
            continue
        held = None
        say = part(progress, (number - 1) / len(pressures), number / len(pressures))
        try:
            if state == "ideal":
                held = ideal_state(balloon, pressure)
            else:
                held = previous = find_equilibrium(
                    balloon, pressure, start=previous, nested=True, progress=part(say, 0.0, 0.5)
                )
            if say is not None:
                say(said(f"modes at {pressure:g} Pa", 0.5 if state == "inflated" else 0.0))
            sides = None
            if two_sided:
                sides = one_sided.one_sided_modes(balloon, pressure, count, mass=mass, harmonics=harmonics)
                found = sides.wrinkled
            else:
                found = find_modes(held, count, mass=mass, harmonics=harmonics)
        except SolveError as error:
            outcome.error = error
            results |= failure(error)
            last = error.state or held  # an equilibrium whose modes fail is one still
            if last is not None and (last is held or last is not previous):
                outcome.snapshots.append(Snapshot(balloon, last.pressure, last))
            return outcome
        entry = {
            "pressure": pressure,
            "modes": [mode_data(mode) for mode in found.modes],
            "stable": found.stable,
            "verdict": "stable" if found.stable else "unstable",
            "symmetric": found.symmetric,
            "asymmetry": found.asymmetry,
            "num_negative": found.num_negative,
            "state_residual": held.relative_residual,
            "volume": held.volume,
            "hoop_tension": held.hoop_tension,
            "bar_force": held.bar_force,
        } | borne(held)
        if sides is not None:
            entry |= {
                "mean_modes": [mode_data(mode) for mode in sides.mean.modes],
                "taut_modes": [mode_data(mode) for mode in sides.taut.modes],
                "bounds": sides.bounds,
            }
            if sides.bounds[0] <= 0 < sides.bounds[1]:
                entry["verdict"] = UNDECIDED
        results["pressures"].append(entry)
        if folder is not None:
            folder.keep_modes(number, held, found.modes, entry)
        outcome.snapshots.append(Snapshot(balloon, pressure, held, found.modes))
    if state == "ideal":
        results["warnings"] += advice.of_balance(max(e["state_residual"] for e in results["pressures"]))
    branches = _branches(outcome.snapshots, mass)
    if branches:
        results["branches"] = branches
    return outcome


def _branches(snapshots: list[Snapshot], mass: Mass) -> list[dict[str, Any]]:
    """The modes of different pressures as curves, likeness deciding which goes on as which. Collective."""
    from lobefem.stability.branch_following import follow
    from lobefem.stability.mode_records import Modes

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
    film = design.film
    if state == "ideal" and "load-path" in (film.law, film.setup):
        key = "law" if film.law == "load-path" else "setup"
        raise InputError(
            f"film.{key} = 'load-path' finds its stress in the inflated state, and the ideal state has "
            "that of the closed form; use lobefem modes --state inflated, or leave it out"
        )
    if state == "ideal" and not design.has_ideal_state:
        raise InputError(
            f"a {design.shape.kind} has no ideal state, for it carries no pressure as it is drawn; use "
            "lobefem modes --state inflated, or the kind 'isotensoid' or 'formed'"
        )


def summary(command: str, design: Design) -> dict[str, Any]:
    """The part of every result that describes its origin."""
    bar = design.plates.bar
    return {
        "schema": SCHEMA,
        "command": command,
        "version": __version__,
        "film": design.film.law,
        "load": design.pressure.load,
        "support": design.plates.support if design.has_plates else None,
        "bar": ("rigid" if bar is True else bar or None) if design.has_plates else None,
        "hoops": design.hoops.EA if design.hoops.enabled and design.shape.kind != "mesh" else None,
        "lobes": design.shape.lobes if design.shape.kind != "mesh" else None,
        "radius": design.size or None,
        "thickness": design.film.thickness,
        "strength": design.film.strength,
        "divisions": design.mesh.divisions,
        "warnings": advice.of_design(design),
    }


def borne(state: Equilibrium) -> dict[str, Any]:
    """Largest stress and strain of a state's film and their places, for the results. Collective."""
    stress, strain = state.max_stress(), state.max_strain()
    return dict(zip(_PEAKS, (stress.value, stress.place, strain.value, strain.place), strict=True))


def mode_data(mode: Mode) -> dict[str, Any]:
    """The entry of a mode in the results."""
    return {
        "real": mode.value.real,
        "imag": mode.value.imag,
        "residual": mode.residual,
        "harmonic": mode.harmonic,
        "kind": mode.kind,
        "harmonics": mode.harmonics,
    }


def failure(error: SolveError) -> dict[str, Any]:
    """The entry of a failed solve in the results."""
    reason = error.data.get("reason", type(error).__name__)
    return {"converged": False, "reason": reason, "error": str(error)}


def _list(pressures: tuple[float, ...]) -> str:
    return ", ".join(f"{p:g}" for p in pressures) + " Pa"
