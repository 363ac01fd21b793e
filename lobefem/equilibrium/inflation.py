"""`inflate`: the equilibrium of a balloon under gas pressure, by PETSc SNES."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, cast

import numpy as np

from lobefem import checks
from lobefem.equilibrium.bulge import bulged
from lobefem.equilibrium.firmer_slack import firmer
from lobefem.equilibrium.grid_sequencing import coarser_balloon, interpolate
from lobefem.equilibrium.newton import REASONS, Newton
from lobefem.equilibrium.simpler_balloons import simpler, stretched
from lobefem.equilibrium.solver_options import NEWTON, NewtonOptions
from lobefem.equilibrium.state import Equilibrium, record
from lobefem.errors import ConvergenceError, InputError
from lobefem.fem.balloon import Balloon
from lobefem.linalg import petsc
from lobefem.log import logger
from lobefem.model.film import require_pressure
from lobefem.profiling import timed
from lobefem.progress import said
from lobefem.typing import Vec

__all__ = ["inflate"]

Progress = Callable[[str], None]

PREFIX = "lobefem_inflate_"

_SIMPLE_STEP = 0.01  # smallest pressure step of a simpler balloon, as a share of the whole

_COARSE_RTOL = 1e-4  # of a start; another mesh's discretisation is off by more

# pressures over the one that is asked for, at which what is not at rest as drawn is tried in turn: under a
# small one slack film has next to no stiffness and weight bears on it, under a large one it is pulled far
_FIRST = (1.0, 10.0, 100.0, 0.5, 0.1, 0.01, 1000.0)


@timed("solver")
def inflate(
    balloon: Balloon,
    pressure: float,
    *,
    prestress: float | None = None,
    start: Equilibrium | None = None,
    options: NewtonOptions = NEWTON,
    on_step: Callable[[Equilibrium], None] | None = None,
    nested: bool = False,
    raise_on_failure: bool = True,
    progress: Progress | None = None,
) -> Equilibrium:
    """The equilibrium at a pressure: one SNES solve, or pressure steps when that one fails.

    Where film is cut flat or the balloon has weight, a solve from the drawn shape that fails is followed by
    one by way of firmer slack film (`lobefem.equilibrium.firmer_slack`), and by one from the equilibrium of
    a simpler balloon (`lobefem.equilibrium.simpler_balloons`). Pressure steps begin without pressure, where
    the reference shape is at rest. That of a cutting pattern, of foreshortened cables, of weight and under
    hydrostatic gas is not: there they begin at the first of some pressures, larger and smaller ones, whose
    equilibrium is found from it.

    Newton's method with MUMPS; its line search minimises the potential energy. The `film` load on
    moving plates has none: there the search freezes the plates' own share over each step.

    Args:
        balloon: what to inflate.
        pressure: gas pressure [Pa]; of a sealed gas (`GasAccess.with_gas`) a guess, which that of its law
            replaces. Such a balloon is solved in one go.
        prestress: pressure whose meridional stress is built in [Pa]; by default `pressure` for a
            prestressed balloon and 0 otherwise.
        start: state to start from (default: the reference shape, drawn along with a lifted rim; of film
            with a load path's stress that state, in whose shape it carries it).
        options: of Newton's method.
        on_step: called on all ranks with the equilibrium after each pressure step.
        nested: without a start, look first for the equilibrium on meshes half as fine and start from there
            (`lobefem.equilibrium.grid_sequencing`), where that saves time. It leads to the same state, on a
            fine mesh several times sooner; where it leads nowhere the reference shape is the start. Film on a
            surface that runs around no axis starts from its reference shape, then bulged as a soap film.
        raise_on_failure: False to return the last state that was found where there is none at the pressure,
            with `converged` False and the reason.
        progress: called with a line of text after each solve.

    Raises:
        InputError: a pressure that is no number, suction on film that carries tension only, or an option
            that PETSc refuses.
        ConvergenceError: no equilibrium found; its `state` is the last one that was.

    Collective.
    """
    checks.having("balloon", balloon, "reference_area", "a Balloon")
    checks.having("options", options, "petsc_options", "NewtonOptions(...)")
    require_pressure(balloon.film, pressure)
    if start is not None:
        checks.having("start", start, "vector", "a state, such as inflate found")
    if prestress is None:
        prestress = pressure if balloon.prestressed else 0.0
    if checks.finite("prestress", prestress, "Pa") and not balloon.prestressed:
        raise InputError(f"prestress = {prestress} Pa needs a balloon with prestressed=True")
    if start is not None and start.balloon.map.size != balloon.map.size:
        raise InputError(
            f"the start has {start.balloon.map.size} unknowns and this balloon {balloon.map.size}; start "
            "from a state on the same mesh with the same supports"
        )
    if balloon.gas is not None:
        options = replace(options, min_step=1.0)  # a smaller pressure would be the same load
    try:
        with petsc.options(PREFIX, options.petsc_options):
            return _inflated(balloon, pressure, prestress, start, options, nested, on_step, progress)
    except ConvergenceError as error:
        if raise_on_failure:
            raise
        reason = error.data.get("reason", str(error))
        last = error.state
        if last is None:
            balloon.set_loads(0.0, 0.0)
            last = record(balloon, balloon.map.create_vector(), False, reason, 0, ())
        return replace(last, converged=False, reason=reason)


def _inflated(
    balloon: Balloon,
    pressure: float,
    prestress: float,
    start: Equilibrium | None,
    options: NewtonOptions,
    nested: bool,
    on_step: Callable[[Equilibrium], None] | None,
    progress: Progress | None,
) -> Equilibrium:
    """`inflate` with checked arguments."""
    path = cast("Equilibrium | None", balloon.load_path)
    if start is None and path is not None and path.balloon.map.size == balloon.map.size:
        start = path
    q = start.vector() if start is not None else _drawn_along(balloon)
    _check_start(balloon, q, start)
    guesses: list[Callable[[], Any]] = []
    begin = q
    if start is None and not balloon.surface.of_revolution:
        guesses = [q.copy, lambda: bulged(balloon), lambda: bulged(balloon, 2.0)]
    elif nested and start is None:
        finer = _from_coarser(balloon, pressure, prestress, options, progress)
        if finer is not None:
            begin, guesses = finer, [lambda: finer]
    simple = simpler(balloon) if start is None and begin is q else []
    if simple and not guesses:
        guesses = [q.copy]
    firm = firmer(balloon) if simple else []
    balloon.set_loads(pressure, prestress)
    # film compressed as drawn, and hoop fibres of one gore, are unstable on the way to a stable state
    turned = balloon.map.tied or (start is None and not _rests_as_drawn(balloon))
    solver = Newton(balloon, begin, options, PREFIX, turned=turned)
    try:
        iterations, reason, guess = 0, 0, q
        for guessed in guesses:
            guess = guessed()
            reason, count = solver.solve(guess)
            iterations += count
            _tell(pressure, reason, count, solver.norm, progress)
            if reason > 0:
                break
        if reason <= 0 and firm:
            guess = _through(firm, q, pressure, prestress, options.max_iterations, progress)
            reason, count = solver.solve(guess)
            iterations += count
            _tell(pressure, reason, count, solver.norm, progress)
        found = _from_simpler(simple, pressure, prestress, progress) if reason <= 0 else None
        if found is not None:
            found.copy(guess)
            balloon.set_loads(pressure, prestress)
            reason, count = solver.solve(guess)
            iterations += count
            _tell(pressure, reason, count, solver.norm, progress)
        if reason > 0:
            state = record(balloon, guess, True, REASONS[reason], iterations, (pressure,))
            if on_step is not None:
                on_step(state)
            return state
        spent = 0
        if start is None and not _rests_as_drawn(balloon):
            start = _first(balloon, solver, q, pressure, prestress, firm, options.max_iterations, progress)
            if start is not None and start.pressure == pressure:
                if on_step is not None:
                    on_step(start)
                return start
            spent = start.iterations if start is not None else 0
        return _step(
            balloon, solver, q, start, pressure, prestress, options.min_step, on_step, progress, spent
        )
    finally:
        solver.destroy()


def _from_coarser(
    balloon: Balloon,
    pressure: float,
    prestress: float,
    options: NewtonOptions,
    progress: Progress | None,
) -> Any:
    """Unknowns to start from, the equilibrium on a mesh half as fine; None where none was found."""
    coarse = coarser_balloon(balloon, options.nest_above)
    if coarse is None:
        return None
    q = _from_coarser(coarse, pressure, prestress, options, progress)
    if q is None:
        q = _drawn_along(coarse)
    coarse.set_loads(pressure, prestress)
    solver = Newton(coarse, q, replace(options, rtol=_COARSE_RTOL), PREFIX, turned=coarse.map.tied)
    try:
        reason, count = solver.solve(q)
        _tell(pressure, reason, count, solver.norm, progress, coarse)
    finally:
        solver.destroy()
    return interpolate(coarse, q, balloon) if reason > 0 else None


def _through(
    firm: list[Balloon], q: Vec, pressure: float, prestress: float, steps: int, progress: Progress | None
) -> Any:
    """Unknowns to which balloons with firmer slack film lead from q, each from where the one before came to.

    They need not be equilibria: what is left over is where slack film is, and is the next one's.
    """
    guess = q.copy()
    for balloon in firm:
        balloon.set_loads(pressure, prestress)
        solver = Newton(balloon, guess, NewtonOptions(_COARSE_RTOL, steps), PREFIX, turned=True)
        try:
            reason, count = solver.solve(guess)
            _tell(pressure, reason, count, solver.norm, progress)
        finally:
            solver.destroy()
    return guess


def _from_simpler(simple: list[Balloon], pressure: float, prestress: float, progress: Progress | None) -> Any:
    """Unknowns of the last of these balloons at the pressure, each from the one before; None without."""
    state = None
    for balloon in simple:
        try:
            state = stretched(balloon) if state is None else state
            state = inflate(
                balloon,
                pressure,
                prestress=prestress,
                start=state,
                options=NewtonOptions(min_step=_SIMPLE_STEP),
                progress=progress,
            )
        except ConvergenceError:
            break
    return state.vector() if state is not None and state.converged else None


def _tell(
    pressure: float,
    reason: int,
    count: int,
    norm: float,
    progress: Progress | None,
    coarse: Balloon | None = None,
    share: float = 0.0,
) -> None:
    """Say how a solve ended, and what share of the work is done."""
    on = f" on {'x'.join(map(str, coarse.surface.divisions or ()))}" if coarse is not None else ""
    say = f"inflate {pressure:.6g} Pa{on}: {REASONS[reason]} after {count} iterations, |r| = {norm:.2e}"
    logger.info(say)
    if progress is not None:
        progress(said(say, share))


def _check_start(balloon: Balloon, q: Vec, start: Equilibrium | None) -> None:
    """Refuse a film that intersects itself: contact keeps it free of that, and cannot undo it."""
    if balloon.contact is None:
        return
    balloon.set_unknowns(q)
    if balloon.contact.intersects(balloon.u):
        raise ConvergenceError(
            "the film intersects itself where inflate starts; move plates and distortions in smaller steps",
            state=start,
            reason="film intersects itself",
        )


def _drawn_along(balloon: Balloon) -> Any:
    """Unknowns to start from: the reference shape, its nodes drawn along evenly with a lifted rim.

    Moved alone, the rim would strain the film next to it a hundred times more than the film bears in the
    end; Newton's method needs some steps more to forget that.
    """
    q = balloon.map.create_vector()
    motion = balloon.motion
    if motion is not None and motion.plates.lift:
        free = balloon.map.free
        x = balloon.X[: balloon.map.owned // 3]
        share = (x - motion.centres[0]) @ motion.direction / motion.length
        q.array[: free.size] = np.outer(share, motion.plates.lift * motion.direction).ravel()[free]
    return q


def _rests_as_drawn(balloon: Balloon) -> bool:
    """True if the reference shape is in equilibrium without pressure."""
    loaded = balloon.weight.film or balloon.weight.cables or balloon.load.gradient
    shortened = any(cable.shortened for cable in balloon.cables)
    return not loaded and not shortened and balloon.pattern is None


def _first(
    balloon: Balloon,
    solver: Newton,
    q: Any,
    end: float,
    prestress: float,
    firm: list[Balloon],
    steps: int,
    progress: Progress | None,
) -> Equilibrium | None:
    """The first equilibrium that is found from unknowns q at one of some pressures; q is that then.

    At larger pressures also by way of balloons with firmer slack film.
    """
    begin, iterations = q.copy(), 0
    for share in _FIRST if end else _FIRST[:1]:
        for through in (False, True) if share > 1.0 and firm else (False,):
            if through:
                _through(firm, begin, share * end, prestress, steps, progress).copy(q)
            balloon.set_loads(share * end, prestress)
            reason, count = solver.solve(q)
            iterations += count
            _tell(share * end, reason, count, solver.norm, progress, share=float(reason > 0 and share == 1.0))
            if reason > 0:
                return record(balloon, q, True, REASONS[reason], iterations, (share * end,))
            begin.copy(q)
    return None


def _step(
    balloon: Balloon,
    solver: Newton,
    q: Vec,
    start: Equilibrium | None,
    end: float,
    prestress: float,
    min_step: float,
    on_step: Callable[[Equilibrium], None] | None,
    progress: Progress | None,
    iterations: int,
) -> Equilibrium:
    """One step to the end, halved when it fails and doubled when it does not.

    Steps down are even in the pressure's logarithm: a balloon softens as it loses pressure.
    """
    begin = start.pressure if start is not None else 0.0
    falling = 0.0 < end < begin

    def at(share: float) -> float:
        return float(begin * (end / begin) ** share) if falling else begin + share * (end - begin)

    last, share, step = q.copy(), 0.0, 1.0
    visited: list[float] = []
    while True:
        target = min(1.0, share + step)
        p = at(target)
        balloon.set_loads(p, prestress)
        reason, count = solver.solve(q)
        iterations += count
        _tell(p, reason, count, solver.norm, progress, share=target if reason > 0 else share)
        if reason > 0:
            visited.append(p)
            if target == 1.0 or on_step is not None:
                state = record(balloon, q, True, REASONS[reason], iterations, tuple(visited))
                if on_step is not None:
                    on_step(state)
                if target == 1.0:
                    return state
            share, step = target, 2 * step
            q.copy(last)
            continue
        last.copy(q)
        step = (target - share) / 2
        if step < min_step or begin == end:  # no steps between equal pressures
            balloon.set_loads(at(share), prestress)
            last_state = start
            if visited:
                last_state = record(balloon, q, True, "last converged", iterations, tuple(visited))
            raise ConvergenceError(
                f"inflate stopped at {at(share):.6g} Pa of {end:.6g} Pa "
                f"({REASONS[reason]}, |r| = {solver.norm:.1e}); try slack_stiffness >= 1e-4, a "
                "prestressed film, or a start that is not flat",
                state=last_state,
                pressure=p,
                residual=solver.norm,
                reason=REASONS[reason],
            )
