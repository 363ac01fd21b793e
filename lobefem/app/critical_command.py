"""Commands on a design beyond single states: critical pressures in all their forms."""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import partial
from itertools import pairwise
from typing import Any

from lobefem.app import advice
from lobefem.app.states_command import FIELDS, UNCHECKED, Outcome, borne, check_state, failure, summary
from lobefem.equilibrium.state import Equilibrium, ideal_state
from lobefem.errors import InputError, SolveError
from lobefem.io.design import Design
from lobefem.io.run_folder import RunFolder
from lobefem.io.xdmf import Snapshot
from lobefem.progress import Progress, plain
from lobefem.stability.harmonic_buckling import HarmonicPressures, Row, harmonic_pressures
from lobefem.stability.linear_buckling import CriticalPressure, critical_pressure
from lobefem.stability.mesh_convergence import DIVISIONS, MeshStudy
from lobefem.stability.mesh_convergence import mesh_study as study_meshes
from lobefem.stability.nonlinear_buckling import SEARCH_END, critical_point
from lobefem.stability.one_sided import (
    has_kink,
    one_sided_charts,
    one_sided_pressures,
    slack_critical_pressure,
)
from lobefem.typing import Comm
from lobefem.units import pascals
from lobefem.viz.verdict import FIXED_WRINKLES, KINK

__all__ = ["critical", "harmonics", "mesh_study", "reached"]

_HIGH_HARMONICS = (
    "with fixed wrinkles only the critical pressures of low harmonics converge as the mesh is refined; from "
    "about n = 7 on they go to zero"
)


def critical(
    design: Design,
    *,
    state: str = "ideal",
    harmonic: int | None = None,
    limit: float | None = None,
    near: float | None = None,
    comm: Comm | None = None,
    progress: Progress | None = None,
    folder: RunFolder | None = None,
) -> Outcome:
    """The lowest critical pressure, of the held ideal geometry or along the inflated equilibria. Collective.

    Args:
        design: what to look at; its own pressure does not matter.
        state: "ideal" or "inflated".
        harmonic: look among modes of this circumferential harmonic only; of the ideal state.
        limit: pressure at which a search along inflated states gives up [Pa].
        near: a pressure near the answer, of a coarser mesh for example, at which that search begins [Pa].
        comm: MPI communicator (default: all ranks).
        progress: called with a line of text now and then.
        folder: where to keep the stable states of a path, and to go on from.

    Raises:
        InputError: an option that does not go with the state, or an ideal state asked of a cylinder.
    """
    check_state(state, design)
    results = summary("critical", design) | {"state": state} | UNCHECKED
    outcome = Outcome(results)
    if design.film.law == "fixed-wrinkles":
        results["warnings"].append(FIXED_WRINKLES)
    if state == "inflated":
        if harmonic is not None:
            raise InputError("--harmonic looks at the ideal state; leave it out with --state inflated")
        _along_path(outcome, design, SEARCH_END if limit is None else limit, near, comm, progress, folder)
        return outcome
    if limit is not None:
        raise InputError("--limit is for the search along inflated states; add --state inflated")
    results["warnings"] += advice.of_built_in(design)
    balloon = design.balloon(design.surface(comm), prestressed=True)
    if progress is not None:
        progress("critical pressure")
    try:
        if has_kink(balloon):
            results["warnings"].append(KINK)
            sides = one_sided_pressures(balloon, harmonic=harmonic)
            found = sides.wrinkled
            results["bounds"] = [_number(p) for p in sides.bounds]
            results["sides"] = {
                name: _number(getattr(sides, name).pressure) for name in ("wrinkled", "mean", "taut")
            }
        elif design.film.law in FIELDS:
            found = slack_critical_pressure(balloon, harmonic=harmonic)
        else:
            found = critical_pressure(balloon, harmonic=harmonic)
    except SolveError as error:
        outcome.error = error
        results |= {"critical_pressure": None} | failure(error)
        return outcome
    results |= _critical(found, harmonic) | {"only_harmonic": harmonic}
    if found.pressure == 0.0 and results.get("bounds", [0.0, 0.0])[1] != 0.0:
        results["reason"] = "the lower bound is zero, and between the bounds the film model gives no answer"
    results["warnings"] += advice.of_pressures(design, [results["critical_pressure"]])
    if results["critical_pressure"]:
        _borne(results, ideal_state(balloon, found.pressure))
    if design.film.strength is not None and found.pressure > 0:
        # the ideal state's stress is proportional to the pressure
        reached = design.film.strength / ideal_state(balloon, 1.0).max_stress().value
        results["strength_pressure"] = reached if reached <= found.pressure else None
    if found.mode is not None:
        outcome.snapshots.append(Snapshot(balloon, found.pressure, None, (found.mode,)))
    return outcome


def _critical(found: CriticalPressure, harmonic: int | None) -> dict[str, Any]:
    mode = found.mode
    data: dict[str, Any] = {
        "critical_pressure": _number(found.pressure),
        "harmonic": harmonic if mode is None else mode.harmonic,
        "divisions": found.divisions,
        "kind": None if mode is None else mode.kind,
        "residual": None if mode is None else mode.residual,
        "pressures": found.pressures,
    }
    if mode is None:
        never = "stable at any pressure that the film can bear"
        data["reason"] = "unstable at any pressure" if found.pressure == 0.0 else never
    return data


def _along_path(
    outcome: Outcome,
    design: Design,
    limit: float,
    near: float | None,
    comm: Comm,
    progress: Progress | None,
    folder: RunFolder | None,
) -> None:
    """The first loss of stability along the inflated equilibria, into an outcome."""
    results = outcome.results
    if design.film.setup == "load-path":
        raise InputError(
            "film.setup = 'load-path' sets up the stress of one pressure, and a search goes through many; "
            "leave it out, or look at one with lobefem modes --state inflated"
        )
    balloon = design.balloon(design.surface(comm))
    strength = design.film.strength
    stresses = {0.0: 0.0}  # by pressure, on the way

    def keep(state: Equilibrium, notes: dict[str, Any]) -> None:
        if strength is not None:
            stresses[state.pressure] = state.max_stress().value
        if folder is not None:
            folder.keep(state, notes)

    try:
        found = critical_point(
            balloon,
            start=min(100.0, limit / 20),
            limit=limit,
            near=near,
            resume=None if folder is None else folder.kept(balloon),
            keep=keep,
            progress=plain(progress),
        )
    except SolveError as error:
        outcome.error = error
        results |= {"critical_pressure": None} | failure(error)
        last = error.state
        if last is not None:
            outcome.snapshots.append(Snapshot(balloon, last.pressure, last))
        return
    mode = found.mode
    results |= {
        "critical_pressure": _number(found.pressure),
        "harmonic": None if mode is None else mode.harmonic,
        "divisions": found.divisions,
        "kind": None if mode is None else mode.kind,
        "residual": None if mode is None else mode.residual,
        "point": found.point,
        "projection": found.projection,
        "bracket": [_number(p) for p in found.bracket],
        "visited": [list(pair) for pair in found.visited],
        "limit": limit,
    }
    _borne(results, found.state)
    if strength is not None:
        stresses[found.state.pressure] = results["max_stress"]
        results["strength_pressure"] = reached(stresses, strength)
    results["warnings"] += advice.of_pressures(design, [results["critical_pressure"]])
    if mode is None:
        results["reason"] = f"no instability found up to {pascals(limit)}, the end of the search (--limit)"
    modes = () if mode is None else (mode,)
    outcome.snapshots.append(Snapshot(balloon, found.state.pressure, found.state, modes))


def _borne(results: dict[str, Any], state: Equilibrium) -> None:
    """Add stress, tension and force in film, hoops and bar to the results. Collective."""
    results |= {"hoop_tension": state.hoop_tension, "bar_force": state.bar_force} | borne(state)


def reached(stresses: dict[float, float], strength: float) -> float | None:
    """The pressure at which the film's stress reaches its strength, by lines between those known."""
    for (p, low), (q, high) in pairwise(sorted(stresses.items())):
        if low < strength <= high:
            return p + (strength - low) / (high - low) * (q - p)
    return None


def harmonics(
    design: Design,
    *,
    harmonics: tuple[int, ...] | None = None,
    limit: float | None = None,
    comm: Comm | None = None,
    progress: Progress | None = None,
    folder: RunFolder | None = None,
) -> Outcome:
    """The critical pressure of each harmonic of the held ideal geometry, from one sector. Collective.

    Args:
        design: what to look at; its own pressure does not matter.
        harmonics: which; by default all that the mesh has.
        limit: none, for nothing is searched here.
        comm: MPI communicator (default: all ranks).
        progress: called with a line of text now and then.
        folder: where to keep each harmonic, and to go on from.

    Raises:
        InputError: an ideal state asked of a cylinder, an unstructured mesh, a harmonic it lacks, or
            tension-field film with hoop slack, whose tangent is not linear in the pressure.
    """
    check_state("ideal", design)
    if limit is not None:
        raise InputError("--limit is for searches along inflated states; leave it out of this ideal state")
    results = summary("harmonics", design)
    results["warnings"] += advice.of_built_in(design)
    if design.film.law in FIELDS and design.film.hoop_slack:
        raise InputError(
            f"film.hoop_slack = {design.film.hoop_slack:g} makes a tangent not linear in the pressure; "
            "look at one harmonic at a time with lobefem critical --harmonic N"
        )
    if design.film.law == "fixed-wrinkles":
        results["warnings"].append(_HIGH_HARMONICS)
    outcome = Outcome(results)
    balloon = design.balloon(design.surface(comm, sector=True), prestressed=True)
    upper: HarmonicPressures | None = None
    known = [_kept_rows(folder, side) for side in range(3)]

    def keep(side: int, rows: dict[int, Row]) -> None:
        known[side] |= rows
        if folder is not None:
            folder.keep_step(f"tangent {side}", {str(n): _kept_row(row) for n, row in known[side].items()})

    try:
        if has_kink(balloon):
            results["warnings"].append(KINK)
            chart, upper, _ = one_sided_charts(
                balloon, harmonics, comm=comm, known=known, keep=keep, progress=progress
            )
        else:
            chart = harmonic_pressures(
                balloon, harmonics, comm=comm, known=known[0], keep=partial(keep, 0), progress=progress
            )
    except SolveError as error:
        outcome.error = error
        rows = [(n, *row) for n, row in sorted(known[0].items())]  # those that were found stay
        results |= {"critical_pressure": None, "chart": _rows(rows)} | failure(error)
        return outcome
    results |= {
        "critical_pressure": _number(chart.pressure),
        "harmonic": chart.lowest,
        "divisions": chart.divisions,
        "chart": _rows(zip(chart.harmonics, chart.pressures, chart.kinds, chart.residuals, strict=True)),
    }
    if upper is not None:
        for row, pressure in zip(results["chart"], upper.pressures, strict=True):
            row["upper_bound"] = pressure
        results["bounds"] = [_number(chart.pressure), _number(upper.pressure)]
    outcome.figures["critical_pressures.png"] = lambda: _chart_figure(chart)
    return outcome


def _rows(rows: Iterable[tuple[int, float, str, float]]) -> list[dict[str, Any]]:
    """A chart's rows as plain data."""
    keys = ("harmonic", "critical_pressure", "kind", "residual")
    return [dict(zip(keys, row, strict=True)) for row in rows]


def _kept_row(row: Row) -> list[Any]:
    """A row as JSON has it: no pressure and no residual are null."""
    pressure, kind, residual = row
    return [_number(pressure), kind, _number(residual)]


def _kept_rows(folder: RunFolder | None, side: int) -> dict[int, Row]:
    kept = None if folder is None else folder.kept_step(f"tangent {side}")
    return {int(n): _row_of(*row) for n, row in (kept or {}).items()}


def _kept_chart(data: dict[str, Any]) -> HarmonicPressures:
    rows = [_row_of(*row) for row in data["rows"]]
    along, around = data["divisions"]
    return HarmonicPressures(
        harmonics=tuple(data["harmonics"]),
        pressures=tuple(pressure for pressure, _, _ in rows),
        kinds=tuple(kind for _, kind, _ in rows),
        residuals=tuple(residual for _, _, residual in rows),
        divisions=(along, around),
        lobes=data["lobes"],
    )


def _row_of(pressure: float | None, kind: str, residual: float | None) -> Row:
    return (
        math.inf if pressure is None else float(pressure),
        kind,
        math.nan if residual is None else float(residual),
    )


def mesh_study(
    design: Design,
    *,
    divisions: tuple[tuple[int, int], ...] | None = None,
    comm: Comm | None = None,
    progress: Progress | None = None,
    folder: RunFolder | None = None,
) -> Outcome:
    """Study the critical pressure of the fixed ideal geometry under mesh refinement. Collective.

    Args:
        design: what to look at; its own divisions do not matter.
        divisions: of the meshes, three or more (default: from 18 x 24 to 96 x 128).
        comm: MPI communicator (default: all ranks).
        progress: called with a line of text before each mesh.
        folder: where to keep each mesh's chart, and to go on from.

    Raises:
        InputError: a film or a mesh that such a study cannot take.
    """
    check_state("ideal", design)
    results = summary("mesh-study", design)
    results["warnings"] += advice.of_built_in(design)
    outcome = Outcome(results)

    def balloon(pair: tuple[int, int]) -> Any:
        one = design.with_overrides({"mesh.divisions": list(pair)})
        return one.balloon(one.surface(comm, sector=True), prestressed=True)

    known = [] if folder is None else folder.kept_step("meshes") or []
    charts = [_kept_chart(chart) for chart in known]

    def keep(chart: HarmonicPressures) -> None:
        rows = zip(chart.pressures, chart.kinds, chart.residuals, strict=True)
        known.append(
            {
                "divisions": chart.divisions,
                "lobes": chart.lobes,
                "harmonics": chart.harmonics,
                "rows": [_kept_row(row) for row in rows],
            }
        )
        if folder is not None:
            folder.keep_step("meshes", known)

    try:
        study = study_meshes(
            balloon, divisions or DIVISIONS, comm=comm, known=charts, keep=keep, progress=progress
        )
    except SolveError as error:
        outcome.error = error
        results |= {"meshes": _meshes(map(_kept_chart, known))} | failure(error)
        return outcome
    results |= {
        "meshes": _meshes(study.charts),
        "lowest": vars(study.lowest),
        "low_harmonics": {n: vars(one) for n, one in study.low.items()},
        "continuum_of_one_lobe": [vars(one) for one in study.continuum],
        "published": study.published,
        "published_around": study.published_around,
        "verdict": list(study.verdict),
        "mesh_error": _number(study.lowest.error),
        "mesh_behaviour": study.lowest.behaviour,
    }
    outcome.figures["mesh_study.png"] = lambda: _study_figure(study)
    return outcome


def _meshes(charts: Iterable[HarmonicPressures]) -> list[dict[str, Any]]:
    return [{"divisions": c.divisions, "critical_pressure": c.pressure, "harmonic": c.lowest} for c in charts]


def _number(p: float) -> float | None:
    return p if math.isfinite(p) else None


def _chart_figure(chart: HarmonicPressures) -> Any:
    from lobefem.viz.study_figures import (
        harmonic_pressures_figure,
    )  # Matplotlib only where something is drawn

    return harmonic_pressures_figure(chart)


def _study_figure(study: MeshStudy) -> Any:
    from lobefem.viz.study_figures import refinement

    return refinement(study)
