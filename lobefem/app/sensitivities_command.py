"""`lobefem sensitivities`: what a small change of each parameter of a pumpkin does, from one gore."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from lobefem.app.states_command import Outcome, failure, summary
from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.solver_options import NewtonOptions
from lobefem.equilibrium.state import Equilibrium
from lobefem.errors import ConvergenceError, InputError, SolveError
from lobefem.fem.balloon import Balloon
from lobefem.io.design import Design
from lobefem.io.run_folder import RunFolder
from lobefem.io.xdmf import Snapshot
from lobefem.progress import Progress, plain
from lobefem.stability.gore_buckling import critical_pressures
from lobefem.stability.sensitivities import Adjoint, critical_sensitivity
from lobefem.stability.sensitivity_record import Sensitivity
from lobefem.typing import Array, Comm

__all__ = ["sensitivities"]

# of a parameter by its name in `Sensitivity.by`: what it is called, and the change that a row is for
_NUMBERS = {
    "E": ("film modulus", "+1 %", 0.01),
    "thickness": ("film thickness", "+1 %", 0.01),
    "EA": ("tendon EA", "+1 %", 0.01),
    "foreshortening": ("foreshortening", "+0.001", 0.001),
    "pressure": ("pressure", "+1 %", 0.01),
}

# keys of the design whose change moves the surface: no form has their derivative
_KEYS = {"shape.half_angle": "half angle", "shape.fitting_radius": "fitting radius"}

_SMALL = 1e-6  # relative change of such a key, half of the way between two balloons

_STATIONS = (0.1, 0.3, 0.5, 0.7, 0.9)  # middles of the fifths of a gore


def sensitivities(
    design: Design,
    *,
    harmonic: int | None,
    limit: float | None = None,
    comm: Comm | None = None,
    progress: Progress | None = None,
    folder: RunFolder | None = None,
) -> Outcome:
    """Volume, film area, stress, tension and stability by the parameters of a design. Collective.

    Args:
        design: of a pumpkin, at one pressure.
        harmonic: n of the eigenvalue and of the critical pressure.
        limit: highest pressure at which the critical one is looked for [Pa], ten times the design's by
            default.
        comm: MPI communicator (default: all ranks).
        progress: called with a line of text now and then.
        folder: of the run.

    Raises:
        InputError: no harmonic, a design without gores or of several pressures, or one to be kept by
            several ranks.
    """
    if not design.is_pumpkin:
        raise InputError(
            f"lobefem sensitivities looks at pumpkins, and this design is of the kind {design.shape.kind!r}; "
            "give one like meshes/pumpkin.toml"
        )
    if harmonic is None:
        raise InputError(
            "sensitivities are those of one harmonic; give it, --harmonic 4 say, and try its neighbours"
        )
    assert design.shape.gores is not None
    last = design.shape.gores // 2
    if harmonic > last:
        raise InputError(
            f"--harmonic: {design.shape.gores} gores have the harmonics 0 to {last}, not {harmonic}; give "
            "one of them"
        )
    if isinstance(design.tendons.foreshortening, tuple):
        raise InputError(
            "tendons.foreshortening varies along the tendons, and sensitivities are by one number; give one"
        )
    pressures = design.pressure.value
    if len(pressures) != 1:
        raise InputError("sensitivities are those at one pressure; give one, --pressure '100 Pa' say")
    if folder is not None and folder.comm.size > 1:
        raise InputError("one gore is kept by one process; start it without mpirun, or without --out")
    (pressure,) = pressures
    up_to = 10 * pressure if limit is None else limit
    if up_to <= pressure:
        raise InputError(
            f"--limit is {up_to:g} Pa, and the design's pressure {pressure:g} Pa; give a higher one"
        )
    found: dict[str, Any] = {"pressure": pressure, "gores": design.shape.gores, "harmonic": harmonic}
    keys = ("critical_pressure", "quantities", "parameters")
    outcome = Outcome(summary("sensitivities", design) | found | dict.fromkeys(keys))
    balloon = design.balloon(design.surface(comm, sector=True))
    said: Callable[[str], Any] = (lambda text: None) if progress is None else progress
    try:
        state = inflate(balloon, pressure, nested=True, options=NewtonOptions(rtol=1e-11), progress=progress)
        outcome.snapshots.append(Snapshot(balloon, pressure, state))
        said("sensitivities of the state")
        adjoint = Adjoint(state)
        quantities = [
            adjoint.volume(),
            adjoint.film_area(),
            adjoint.max_stress(),
            adjoint.tendon_tension(),
            adjoint.eigenvalue(harmonic),
        ]
        near, said_why = _critical_state(state, harmonic, quantities[-1].value > 0, up_to, comm, progress)
        if near is not None:
            said("sensitivities of the critical pressure")
            quantities.append(critical_sensitivity(near, harmonic))
            outcome.results["critical_pressure"] = quantities[-1].value
        else:
            outcome.results["warnings"].append(
                f"harmonic {harmonic} {said_why}, so there is no critical pressure to differentiate; look at "
                "its eigenvalue"
            )
        outcome.results["quantities"] = {one.quantity: one.value for one in quantities}
        outcome.results["parameters"] = _parameters(design, balloon, quantities, comm)
    except SolveError as error:
        outcome.error = error
        outcome.results |= failure(error)
    return outcome


def _critical_state(
    state: Equilibrium, harmonic: int, stable: bool, up_to: float, comm: Comm, progress: Progress | None
) -> tuple[Equilibrium | None, str]:
    """A state at which the harmonic loses its stability, or None and why there is none. Collective."""
    options: dict[str, Any] = {"comm": comm, "progress": plain(progress)}
    if stable:
        path = critical_pressures(state, [harmonic], up_to=up_to, **options)
        return path.state, f"loses no stability up to {path.searched_to:g} Pa (--limit looks further)"
    pressure = state.pressure
    try:
        path = critical_pressures(state.balloon, [harmonic], up_to=pressure, start=pressure / 4, **options)
    except ConvergenceError:
        return None, f"is unstable at {pressure:g} Pa and no state below was found"
    return path.state, f"is unstable at all pressures below {pressure:g} Pa that were tried"


def _row(called: str, step: str, changes: dict[str, float]) -> dict[str, Any]:
    return {"name": called, "step": step, "changes": changes}


def _parameters(
    design: Design, balloon: Balloon, quantities: Sequence[Sensitivity], comm: Comm
) -> list[dict[str, Any]]:
    """A row a parameter, those that do most for the stability first."""
    rows = [
        _row(called, step, {one.quantity: size * one.by.get(name, 0.0) for one in quantities})
        for name, (called, step, size) in _NUMBERS.items()
    ]
    if balloon.pattern is not None:
        for called, growth in _widths(balloon):
            wider = balloon.surface.recipe.widening(balloon.surface, growth)
            rows.append(_row(called, "+1 %", {one.quantity: one.along(wider) for one in quantities}))
    for key, called in _KEYS.items():
        section, _, name = key.partition(".")
        value = getattr(getattr(design, section), name)
        if value is None:
            continue
        low, high = (
            _balloon(design.with_overrides({key: _scaled(value, 1 + sign * _SMALL)}), comm)
            for sign in (-1, 1)
        )
        share = 0.01 / (2 * _SMALL)
        rows.append(
            _row(called, "+1 %", {one.quantity: share * one.between(low, high) for one in quantities})
        )
    stability = quantities[-1].quantity
    return sorted(rows, key=lambda row: -abs(row["changes"][stability]))


def _widths(balloon: Balloon) -> list[tuple[str, Callable[[Array], Array]]]:
    """Changes of width by a hundredth: of the gore's whole half-width, and about each station."""
    gore = balloon.surface.recipe.gore

    def hat(share: Array, middle: float) -> Array:
        return np.asarray(np.maximum(1 - abs(share - middle) / 0.2, 0.0))

    def growth(share: Array, middle: float | None) -> Array:
        part = 1.0 if middle is None else hat(share, middle)
        return np.asarray(0.01 * part * gore.half_width(share * gore.curve.arc_length))

    found: list[tuple[str, Callable[[Array], Array]]] = [("half-width", partial(growth, middle=None))]
    return found + [(f"half-width at {s:g}", partial(growth, middle=s)) for s in _STATIONS]


def _balloon(design: Design, comm: Comm) -> Balloon:
    return design.balloon(design.surface(comm, sector=True))


def _scaled(value: Any, factor: float) -> Any:
    return tuple(factor * one for one in value) if isinstance(value, (tuple, list)) else factor * value
