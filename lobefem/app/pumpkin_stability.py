"""Commands on pumpkins' stability: modes and critical pressures from one gore, each harmonic by itself."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property, partial
from typing import Any

from lobefem.app import advice
from lobefem.app.critical_command import reached
from lobefem.app.states_command import UNCHECKED, Outcome, borne, check_state, failure, mode_data, summary
from lobefem.equilibrium.full_model import spread_state
from lobefem.equilibrium.inflation import inflate as find_equilibrium
from lobefem.equilibrium.state import Equilibrium
from lobefem.errors import InputError, SolveError
from lobefem.fem.balloon import Balloon
from lobefem.io.design import Design
from lobefem.io.run_folder import RunFolder
from lobefem.io.xdmf import Snapshot
from lobefem.progress import Progress, part, said
from lobefem.stability.all_gores import full_mode
from lobefem.stability.gore_buckling import GorePressures, critical_pressures
from lobefem.stability.gore_path import Eigenvalues
from lobefem.stability.mode_records import Mode, Modes
from lobefem.stability.modes import find_modes
from lobefem.typing import Comm, Mass
from lobefem.units import pascals

from mpi4py import MPI

__all__ = ["critical", "harmonics", "modes", "search_end"]

_STRAIN = 0.05  # beyond which a linear law is none of plastic film


class _Gore:
    """One gore of a design, and all gores of it for files and pictures."""

    def __init__(self, design: Design, comm: Comm) -> None:
        self.design, self.comm = design, MPI.COMM_WORLD if comm is None else comm
        self.balloon: Balloon = design.balloon(design.surface(self.comm, sector=True))

    @cached_property
    def whole(self) -> Balloon:
        """The balloon of all gores. Collective."""
        return self.design.balloon(self.design.surface(self.comm))

    def snapshot(self, state: Equilibrium, found: tuple[Mode, ...] = ()) -> Snapshot:
        """A state and modes of one gore in all of them. Collective."""
        of_all = tuple(full_mode(self.balloon, mode, self.whole) for mode in found)
        return Snapshot(self.whole, state.pressure, spread_state(state, self.whole), of_all)


def _chosen(design: Design, harmonics: tuple[int, ...] | None, option: str) -> tuple[int, ...]:
    """The harmonics to look at, all by default; refuse those that a pumpkin lacks."""
    gores = design.shape.gores
    assert gores is not None
    last = gores // 2
    high = [n for n in harmonics or () if n > last]
    if high:
        raise InputError(
            f"{option}: {gores} gores have the harmonics 0 to {last}, not {high[0]}; leave {option} out for "
            "all"
        )
    return tuple(range(last + 1)) if harmonics is None else harmonics


def _summary(command: str, design: Design, harmonics: tuple[int, ...]) -> dict[str, Any]:
    about = {"state": "inflated", "gores": design.shape.gores, "looked_at": list(harmonics)}
    return summary(command, design) | about


def modes(
    design: Design,
    *,
    state: str = "inflated",
    count: int = 8,
    mass: Mass = "unit",
    harmonics: tuple[int, ...] | None = None,
    comm: Comm | None = None,
    progress: Progress | None = None,
    folder: RunFolder | None = None,
) -> Outcome:
    """The lowest modes of a pumpkin's equilibrium at each pressure; each is kept. Collective.

    Args:
        design: of a pumpkin.
        state: "inflated".
        count: modes a pressure, of all gores.
        mass: "unit" or "nodal".
        harmonics: look at these only; by default at all, from 0 to half the number of gores.
        comm: the ranks that share the harmonics (default: all).
        progress: called with a line of text now and then.
        folder: where to keep each pressure's modes, and to go on from.

    Raises:
        InputError: an ideal state, or harmonics that there are not.
    """
    check_state(state, design)
    looked_at = _chosen(design, harmonics, "--harmonics")
    pressures = design.pressure.value
    results = _summary("modes", design, looked_at) | {"mass": mass, "pressures": []} | UNCHECKED
    outcome, gore = Outcome(results), _Gore(design, comm)
    previous: Equilibrium | None = None
    for number, pressure in enumerate(pressures, 1):
        say = part(progress, (number - 1) / len(pressures), number / len(pressures))
        kept = None if folder is None else folder.kept_modes(number, gore.balloon)
        if kept is not None:
            previous, found = kept[0], kept[1]
            results["pressures"].append(dict(kept[2]))
        else:
            held = None
            try:
                held = find_equilibrium(gore.balloon, pressure, start=previous, nested=True, progress=say)
                if say is not None:
                    say(said(f"modes at {pressure:g} Pa", 0.2))
                lowest = find_modes(held, count, mass=mass, harmonics=looked_at, comm=gore.comm)
            except SolveError as error:
                outcome.error = error
                results |= failure(error)
                last = error.state or held
                if last is not None:
                    outcome.later.append(partial(gore.snapshot, last))
                return outcome
            previous, found = held, lowest.modes
            entry = _entry(held, lowest)
            results["pressures"].append(entry)
            if folder is not None:
                folder.keep_modes(number, held, found, entry)
        outcome.later.append(partial(gore.snapshot, previous, found))
    outcome.figures["eigenvalues.png"] = lambda: _spectrum(results)
    return outcome


def _entry(state: Equilibrium, lowest: Modes) -> dict[str, Any]:
    """Entry of one pressure in the results."""
    return {
        "pressure": state.pressure,
        "modes": [mode_data(mode) for mode in lowest.modes],
        "by_harmonic": [{"harmonic": n, "lowest": value} for n, value in lowest.by_harmonic],
        "stable": lowest.stable,
        "verdict": "stable" if lowest.stable else "unstable",
        "symmetric": lowest.symmetric,
        "asymmetry": lowest.asymmetry,
        "num_negative": lowest.num_negative,
        "state_residual": state.relative_residual,
        "volume": state.volume,
        "hoop_tension": state.hoop_tension,
        "bar_force": state.bar_force,
    } | borne(state)


# --- critical pressures -------------------------------------------------------------------------
def search_end(design: Design) -> float:
    """Default end of a search [Pa]: film or tendons strained by 5 %, or twice the design's pressure."""
    import numpy as np

    s: Any = np.linspace(0.0, design.curve.arc_length, 201)
    lobe = np.asarray(design.gore.bulge_radius(s))
    film, tendons, gores = design.film, design.tendons, design.shape.gores
    assert gores is not None
    radius = float(np.asarray(design.curve.radius(s)).max())
    modulus = film.modulus if film.E2 is None else film.E2
    by_film = _STRAIN * modulus * film.thickness / float(lobe[np.isfinite(lobe)].max(initial=1e-3 * radius))
    by_tendons = _STRAIN * tendons.EA * gores / (math.pi * radius**2)
    return float(f"{max(min(by_film, by_tendons), 2 * max(design.pressure.value)):.3g}")


def critical(
    design: Design,
    *,
    state: str = "inflated",
    harmonic: int | None = None,
    limit: float | None = None,
    near: float | None = None,
    comm: Comm | None = None,
    progress: Progress | None = None,
    folder: RunFolder | None = None,
) -> Outcome:
    """The pressure at which a pumpkin, stable before, becomes unstable in some harmonic. Collective.

    Args:
        design: of a pumpkin; its own pressure matters for the default of `limit` only.
        state: "inflated".
        harmonic: look at this one only.
        limit: pressure at which the search gives up [Pa] (default: `search_end`).
        near: a pressure near the answer, of a coarser mesh for example, below which the search begins [Pa].
        comm: the ranks that share the harmonics (default: all).
        progress: called with a line of text now and then.
        folder: where to keep states and eigenvalues, and to go on from.

    Raises:
        InputError: an ideal state, or a harmonic that there is not.
    """
    check_state(state, design)
    only = None if harmonic is None else (harmonic,)
    looked_at = _chosen(design, only, "--harmonic")
    results = _summary("critical", design, looked_at) | {"only_harmonic": harmonic} | UNCHECKED
    start = None if not near else 0.6 * near
    return _searched(results, design, looked_at, limit, True, comm, progress, folder, start)


def harmonics(
    design: Design,
    *,
    harmonics: tuple[int, ...] | None = None,
    limit: float | None = None,
    comm: Comm | None = None,
    progress: Progress | None = None,
    folder: RunFolder | None = None,
) -> Outcome:
    """The critical pressure of each harmonic of a pumpkin along its inflated path. Collective.

    Args:
        design: of a pumpkin.
        harmonics: look at these only; by default at all.
        limit: pressure at which the search gives up [Pa] (default: `search_end`).
        comm: the ranks that share the harmonics (default: all).
        progress: called with a line of text now and then.
        folder: where to keep states and eigenvalues, and to go on from.

    Raises:
        InputError: harmonics that there are not.
    """
    looked_at = _chosen(design, harmonics, "--harmonics")
    results = _summary("harmonics", design, looked_at)
    return _searched(results, design, looked_at, limit, False, comm, progress, folder)


def _searched(
    results: dict[str, Any],
    design: Design,
    looked_at: tuple[int, ...],
    limit: float | None,
    first: bool,
    comm: Comm,
    progress: Progress | None,
    folder: RunFolder | None,
    start: float | None = None,
) -> Outcome:
    """A search along the inflated path, into an outcome."""
    outcome, gore, strength = Outcome(results), _Gore(design, comm), design.film.strength
    end = search_end(design) if limit is None else limit
    stresses = {0.0: 0.0}  # by pressure, on the way
    last: list[Equilibrium] = []

    def keep(state: Equilibrium, known: Eigenvalues) -> None:
        last[:] = [state]
        stresses[state.pressure] = state.max_stress().value
        if folder is not None:
            folder.keep(state, {})
            folder.keep_step("eigenvalues", [[p, list(row.items())] for p, row in known.items()])

    rows = None if folder is None else folder.kept_step("eigenvalues")
    try:
        found = critical_pressures(
            gore.balloon,
            looked_at,
            up_to=end,
            start=None if start is None or start >= end else start,
            first=first,
            comm=gore.comm,
            known={p: {int(n): value for n, value in row} for p, row in rows or ()},
            keep=keep,
            progress=progress,
        )
    except SolveError as error:
        outcome.error = error
        results |= {"critical_pressure": None} | failure(error)
        state = error.state or (last[0] if last else None)
        if state is not None:
            outcome.later.append(partial(gore.snapshot, state))
        return outcome
    results |= _found(found, end) | {"limit": end}
    state = found.state or find_equilibrium(gore.balloon, found.searched_to)
    peaks = borne(state)
    results |= {"hoop_tension": state.hoop_tension, "bar_force": state.bar_force} | peaks
    if strength is not None:
        stresses[state.pressure] = peaks["max_stress"]
        results["strength_pressure"] = reached(stresses, strength)
    results["warnings"] += advice.of_pressures(design, [results["critical_pressure"]])
    outcome.later.append(partial(gore.snapshot, state, () if found.mode is None else (found.mode,)))
    outcome.figures |= _figures(results)
    return outcome


def _found(found: GorePressures, up_to: float) -> dict[str, Any]:
    """Entries of a search up to a pressure in the results."""
    mode = found.mode
    data: dict[str, Any] = {
        "critical_pressure": found.pressure,
        "harmonic": found.harmonic,
        "kind": None if mode is None else mode.kind,
        "residual": None if mode is None else mode.residual,
        "point": found.point,
        "stable": [list(stretch) for stretch in found.stable],
        "searched_from": found.visited[0],
        "searched_to": found.searched_to,
        "crossings": [crossing._asdict() for crossing in found.crossings],
        "chart": [
            {"harmonic": n, "critical_pressure": found[n], "stable_from": _gained(found, n)}
            for n in found.harmonics
        ],
        "visited": [[p, min(row)] for p, row in zip(found.visited, found.eigenvalues, strict=True)],
        "curves": [{"harmonic": n, "values": list(found.chart(n))} for n in found.harmonics],
    }
    if found.pressure == 0.0:
        begin, end = pascals(found.visited[0]), pascals(found.searched_to)
        early = "ever less stable, so the search ended there" if found.searched_to < up_to else ""
        why = found.ended or early
        data["reason"] = f"unstable at all pressures from {begin} to {end}{'; ' + why if why else ''}"
    elif found.pressure is None:
        to = f"no instability found up to {pascals(found.searched_to)}"
        data["reason"] = found.ended or f"{to}, the end of the search; --up-to moves it"
    return data


def _gained(found: GorePressures, harmonic: int) -> float | None:
    """The pressure at which a harmonic that is unstable at the path's start gains stability [Pa]."""
    if found.chart(harmonic)[0] > 0:
        return None
    return next((c.pressure for c in found.crossings if c.harmonic == harmonic and not c.lost), None)


def _spectrum(results: dict[str, Any]) -> Any:
    from lobefem.viz.harmonic_curves import spectrum  # Matplotlib only where something is drawn

    return spectrum(results)


def _figures(results: dict[str, Any]) -> dict[str, Callable[[], Any]]:
    def by_pressure() -> Any:
        from lobefem.viz.harmonic_curves import eigenvalues

        return eigenvalues(results)

    def by_harmonic() -> Any:
        from lobefem.viz.harmonic_curves import critical_pressures as draw

        return draw(results)

    figures: dict[str, Callable[[], Any]] = {"eigenvalues.png": by_pressure}
    return figures | ({"critical_pressures.png": by_harmonic} if len(results["chart"]) > 1 else {})
