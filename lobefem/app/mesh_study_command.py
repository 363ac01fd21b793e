"""`--mesh-study` and `--tolerance`: a command on finer and finer meshes, its answer with an error bar.

The results are those on the finest mesh, with the limit that all of them show together. Everything that a
command can compute on one mesh can be studied so; `lobefem.app.critical_command.mesh_study` has the quicker
study of all harmonics of an ideal state.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from lobefem.app import pumpkin_stability
from lobefem.app.critical_command import critical
from lobefem.app.states_command import Outcome, failure, modes
from lobefem.errors import InputError
from lobefem.io.design import Design
from lobefem.io.run_folder import RunFolder
from lobefem.outcomes import RIGID
from lobefem.progress import Progress, part, said
from lobefem.stability.refinement import Trend, trend
from lobefem.typing import Comm, Mass
from lobefem.viz.mesh_verdict import percent

__all__ = ["MESHES", "Request", "critical_on_meshes", "finer", "fitted", "modes_on_meshes"]

MESHES = 3  # of a study, the design's own the coarsest

MOST = 5  # of a study that refines until a tolerance is met: the fifth costs some 100 times the first

_FACTOR = 1.5  # from mesh to mesh

Rows = list[dict[str, Any]]


@dataclass(frozen=True)
class Request:
    """The options of a study.

    Attributes:
        meshes: divisions, three or more from coarse to fine; None for the design's own and finer ones.
        tolerance: half width of the error bar that will do, relative; None for a fixed number of meshes.
    """

    meshes: tuple[tuple[int, int], ...] | None = None
    tolerance: float | None = None

    def __post_init__(self) -> None:
        if self.meshes is not None and len(self.meshes) < MESHES:
            raise InputError(
                f"a mesh study of {len(self.meshes)} mesh(es) shows no trend; give {MESHES} or more --meshes"
            )


def finer(design: Design) -> Design:
    """The design on a mesh that is finer by a factor of 1.5 both ways, with even divisions."""
    if design.shape.kind == "mesh":
        raise InputError(
            "a mesh of your own cannot be refined here; run the command on several meshes and compare them "
            "with lobefem report FOLDER"
        )
    if design.mesh.divisions is None:
        assert design.mesh.size is not None  # of an unstructured mesh
        return design.with_overrides({"mesh.size": design.mesh.size / _FACTOR})
    return design.with_overrides(
        {"mesh.divisions": [2 * round(_FACTOR * n / 2) for n in design.mesh.divisions]}
    )


def critical_on_meshes(
    design: Design,
    request: Request,
    *,
    state: str = "inflated",
    harmonic: int | None = None,
    limit: float | None = None,
    comm: Comm | None = None,
    progress: Progress | None = None,
    folder: RunFolder | None = None,
) -> Outcome:
    """The critical pressure under mesh refinement. Collective.

    On each mesh the search begins near the coarser one's answer.

    Args:
        design: with the coarsest mesh, where the request names none.
        request: the meshes, or the tolerance.
        state: as `critical` takes it, and so the next two.
        harmonic: of the ideal state.
        limit: of a search along inflated states [Pa].
        comm: MPI communicator (default: all ranks).
        progress: called with a line of text now and then.
        folder: where to keep the answers of the meshes, and to go on from.

    Raises:
        InputError: an option that does not go with the state, or a mesh that cannot be refined.
    """

    def run(one: Design, rows: Rows, report: Progress | None) -> Outcome:
        near = (rows[-1]["critical_pressure"] or None) if rows else None
        command = pumpkin_stability.critical if one.is_pumpkin else critical
        return command(
            one, state=state, harmonic=harmonic, limit=limit, near=near, comm=comm, progress=report
        )

    def row(results: Mapping[str, Any]) -> dict[str, Any]:
        return {key: results.get(key) for key in ("critical_pressure", "harmonic", "kind")}

    def judge(h: Sequence[float], rows: Rows) -> dict[str, Any]:
        pressures = [r["critical_pressure"] for r in rows]
        found = trend(h, [math.inf if p is None else p for p in pressures], highest=2.0 * design.mesh.order)
        return fitted(found)

    return _study(design, request, run, row, judge, progress, folder)


def modes_on_meshes(
    design: Design,
    request: Request,
    *,
    state: str = "ideal",
    count: int = 8,
    mass: Mass = "unit",
    harmonics: tuple[int, ...] | None = None,
    comm: Comm | None = None,
    progress: Progress | None = None,
    folder: RunFolder | None = None,
) -> Outcome:
    """The lowest eigenvalue at each of the design's pressures under mesh refinement. Collective.

    Args:
        design: with the coarsest mesh, where the request names none.
        request: the meshes, or the tolerance.
        state: as `modes` takes it, and so the next three.
        count: modes a pressure.
        mass: "unit" or "nodal".
        harmonics: look at modes of these only.
        comm: MPI communicator (default: all ranks).
        progress: called with a line of text now and then.
        folder: where to keep the answers of the meshes, and to go on from.

    Raises:
        InputError: an option that does not go with the state, or a mesh that cannot be refined.
    """

    def run(one: Design, rows: Rows, report: Progress | None) -> Outcome:
        command = pumpkin_stability.modes if one.is_pumpkin else modes
        return command(
            one, state=state, count=count, mass=mass, harmonics=harmonics, comm=comm, progress=report
        )

    def row(results: Mapping[str, Any]) -> dict[str, Any]:
        return {"lowest": [_lowest(entry) for entry in results["pressures"]]}

    def judge(h: Sequence[float], rows: Rows) -> dict[str, Any]:
        columns = zip(*(r["lowest"] for r in rows), strict=True)
        fits = [fitted(trend(h, column, signed=True, highest=2.0 * design.mesh.order)) for column in columns]
        worst = max(fits, key=_badness)
        return {**worst, "fits": fits}

    outcome = _study(design, request, run, row, judge, progress, folder)
    fits = outcome.results.pop("fits", None)
    for key in ("mesh_limit", "mesh_order", "mesh_asymptotic"):
        outcome.results.pop(key, None)  # they are of one pressure each
    for entry, fit in zip(outcome.results["pressures"], fits or (), strict=False):
        entry |= fit
    return outcome


def _lowest(entry: Mapping[str, Any]) -> float:
    own = [mode["real"] for mode in entry["modes"] if mode["kind"] != RIGID]
    return float(own[0]) if own else math.inf


def _badness(fit: Mapping[str, Any]) -> tuple[int, float]:
    """Order of fits from good to bad."""
    return ("converges", "open", "falls").index(fit["mesh_behaviour"]), fit["mesh_error"] or 0.0


def fitted(found: Trend) -> dict[str, Any]:
    """The keys of the results that say what meshes show."""
    converges = found.behaviour == "converges"
    return {
        "mesh_error": found.error if converges and math.isfinite(found.error) else None,
        "mesh_behaviour": found.behaviour,
        "mesh_limit": found.limit if math.isfinite(found.limit) else None,
        "mesh_order": found.order if math.isfinite(found.order) else None,
        "mesh_asymptotic": found.asymptotic,
    }


def _study(
    design: Design,
    request: Request,
    run: Callable[[Design, Rows, Progress | None], Outcome],
    row: Callable[[Mapping[str, Any]], dict[str, Any]],
    judge: Callable[[Sequence[float], Rows], dict[str, Any]],
    progress: Progress | None,
    folder: RunFolder | None,
) -> Outcome:
    """A command on finer and finer meshes. Collective.

    Args:
        design: with the coarsest mesh, where the request names none.
        request: the meshes, or the tolerance.
        run: the command on one mesh, with the rows of the coarser ones.
        row: of the table of meshes, from results.
        judge: from mesh sizes and rows, the keys for the results.
        progress: called with a line of text now and then.
        folder: where to keep the rows, and to go on from.
    """
    designs = _designs(design, request)
    known: Rows = [] if folder is None else folder.kept_step("meshes") or []
    rows: Rows = []
    outcome, fit = Outcome({}), {}
    # nested dissection takes about the number of cells to the power 5/4
    costs = np.cumsum([0.0, *(_size(one) ** -2.5 for one in designs[:MESHES])])
    done = np.append(costs / costs[-1], np.ones(len(designs)))
    for number, one in enumerate(designs, 1):
        mesh = {"divisions": one.mesh.divisions, "size": one.mesh.size}
        last = number >= (len(designs) if request.tolerance is None else MESHES)
        if number <= len(known) and not last:
            rows.append({**known[number - 1], **mesh})
            continue
        if progress is not None:
            progress(said(f"mesh study: {_name(one)}", done[number - 1]))
        outcome = run(one, rows, part(progress, done[number - 1], done[number]))
        outcome.design = one
        if outcome.error is not None:
            return _failed(outcome, rows)
        rows.append({**mesh, **row(outcome.results)})
        if folder is not None:
            folder.keep_step("meshes", rows)
        if last:
            fit = judge([_size(one) for one in designs[:number]], rows)
            error = fit["mesh_error"]
            if request.tolerance is not None and (
                (error is not None and error <= request.tolerance) or fit["mesh_behaviour"] == "falls"
            ):
                break
    outcome.results |= fit | {"meshes": rows, "mesh_tolerance": request.tolerance}
    outcome.results["warnings"] += _not_met(fit, request.tolerance, rows)
    return outcome


def _designs(design: Design, request: Request) -> list[Design]:
    """The design on each mesh, from coarse to fine."""
    if request.meshes is not None:
        finer(design)  # an InputError where there are no divisions to be had
        given = [design.with_overrides({"mesh.divisions": list(pair)}) for pair in request.meshes]
        for coarse, fine in pairwise(given):
            if _size(fine) >= _size(coarse):  # said before the first mesh is computed, not after the last
                raise InputError(
                    f"--meshes: {_name(fine)} are no finer than {_name(coarse)}; give meshes from coarse "
                    "to fine"
                )
        return given
    designs = [design]
    while len(designs) < (MESHES if request.tolerance is None else MOST):
        designs.append(finer(designs[-1]))
    return designs


def _size(design: Design) -> float:
    """Mesh size in any unit."""
    if design.mesh.divisions is None:
        return float(design.mesh.size or 1.0)
    along, around = design.mesh.divisions
    return 1 / math.sqrt(along * around)


def _name(design: Design) -> str:
    if design.mesh.divisions is None:
        return f"size {design.mesh.size:.3g} m"
    return "{} x {} divisions".format(*design.mesh.divisions)


def _failed(outcome: Outcome, rows: Rows) -> Outcome:
    """The outcome of a study that could not be ended: the answers of coarser meshes stay."""
    assert outcome.error is not None
    outcome.results |= {"meshes": rows} | failure(outcome.error)
    return outcome


def _not_met(fit: Mapping[str, Any], tolerance: float | None, rows: Rows) -> list[str]:
    """A sentence on a tolerance that is not met."""
    if tolerance is None or (fit["mesh_error"] is not None and fit["mesh_error"] <= tolerance):
        return []
    asked = f"the tolerance of {percent(tolerance)} is not met"
    if fit["mesh_behaviour"] == "falls":
        return [f"{asked} and cannot be: the answer falls as the mesh is refined, with no limit in sight"]
    if fit["mesh_error"] is None:
        return [f"{asked}: {len(rows)} meshes do not show whether there is a limit; give finer --meshes"]
    return [
        f"{asked} by {len(rows)} meshes, whose error bar is {percent(fit['mesh_error'])}; begin with finer "
        "--divisions or give finer --meshes"
    ]
