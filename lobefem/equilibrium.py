"""`inflate`: the equilibrium of a balloon under gas pressure, by PETSc SNES."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from lobefem import _petsc, _whole, checks, measures
from lobefem._glance import Glance, Glanceable, number
from lobefem._records import Frozen
from lobefem._snes import REASONS, Newton
from lobefem.balloon import Balloon
from lobefem.errors import ConvergenceError, InputError
from lobefem.films import require_pressure
from lobefem.log import logger
from lobefem.nested import coarser_balloon, interpolate
from lobefem.profiling import timed
from lobefem.progress import said

__all__ = [
    "Equilibrium", "ideal_state", "inflate", "placed_state", "record", "require_drawn", "require_whole",
]  # fmt: skip

Array = npt.NDArray[np.float64]
Progress = Callable[[str], None]

PREFIX = "lobefem_inflate_"
_COARSE_RTOL = 1e-4  # of a start; another mesh's discretisation is off by more


@dataclass(frozen=True, repr=False)
class Equilibrium(Frozen, Glanceable):
    """A balloon's state: its own copies of the unknowns, and what was measured on it.

    Attributes:
        balloon: the balloon this is a state of.
        pressure: gas pressure p [Pa].
        prestress: pressure p0 [Pa] whose meridional stress is built into film and cords.
        unknowns: this rank's part of q (see `lobefem.constraints`).
        displacement: this rank's nodal displacements, ghosts included, (nodes, 3) [m].
        converged, reason, iterations: of SNES (all steps together); reason in words.
        residual: norm of the reduced residual [N, N m].
        relative_residual: the same over the norm of the pressure's nodal forces.
        volume: enclosed by film and plates [m^3].
        strain_energy: of film, cords and bar [J], built-in stress included; None for a film whose
            stress is no energy's gradient.
        max_displacement: largest nodal displacement [m], without the tilt that a pinned support leaves free.
        bar_force: [N], tension positive; None without a bar or with both rims held.
        hoop_tension: mean tension of each cord group [N].
        taut_area, wrinkled_area, slack_area: reference areas [m^2].
        num_dofs: displacement components of all nodes.
        steps: pressures at which Newton's method converged on the way [Pa].
        parameter: of the guide that leads the balloon [m or rad], 0 without one.
    """

    balloon: Balloon = field(repr=False)
    pressure: float
    prestress: float
    unknowns: Array = field(repr=False)
    displacement: Array = field(repr=False)
    converged: bool
    reason: str
    iterations: int
    residual: float
    relative_residual: float
    volume: float
    strain_energy: float | None
    max_displacement: float
    bar_force: float | None
    hoop_tension: tuple[float, ...]
    taut_area: float
    wrinkled_area: float
    slack_area: float
    num_dofs: int
    steps: tuple[float, ...] = ()
    parameter: float = 0.0

    def vector(self) -> Any:
        """The unknowns q as a PETSc vector. Collective."""
        q = self.balloon.map.create_vector()
        q.array[:] = self.unknowns
        return q

    def activate(self) -> Any:
        """Put this state's loads and displacement back into its balloon; returns q. Collective."""
        self.balloon.set_loads(self.pressure, self.prestress)
        if self.balloon.guide is not None:
            self.balloon.guide.parameter = self.parameter
        q = self.vector()
        self.balloon.place(q)
        return q

    def stress_resultants(self) -> Any:
        """Cell means of (N_m, N_h, N_mh) [N/m] as a piecewise constant function. Collective."""
        self.activate()
        return measures.stress_resultants(self.balloon)

    def regions(self) -> Any:
        """Shares (taut, wrinkled, slack) of each cell as a piecewise constant function. Collective."""
        self.activate()
        return measures.region_shares(self.balloon)

    def to_pyvista(self) -> Any:
        """The film in this state as a PyVista grid on rank 0, None elsewhere. Collective.

        Points are where the nodes are now. Point data "displacement" [m]; cell data "stress_resultants"
        (N_m, N_h, N_mh) [N/m], "regions" (shares of taut, wrinkled and slack film) and "lobe". Rank 0
        gathers all of it: see `lobefem._whole.gather` for what that takes.
        """
        balloon = self.balloon
        cellwise = {
            "stress_resultants": self.stress_resultants().x.array.reshape(-1, 3),
            "regions": self.regions().x.array.reshape(-1, 3),
            "lobe": balloon.surface.lobe_numbers(),
        }
        nodal = {"displacement": _whole.at_nodes(balloon.V, self.displacement)}
        whole = _whole.gather(balloon.mesh, nodal, cellwise)
        if whole is None:
            return None
        grid = _whole.to_pyvista(whole)
        grid.points = whole.x + whole.nodal["displacement"]
        return grid

    def _glance(self) -> Glance:
        area = self.taut_area + self.wrinkled_area + self.slack_area
        parts = {"taut": self.taut_area, "wrinkled": self.wrinkled_area, "slack": self.slack_area}
        film = ", ".join(f"{100 * part / area:.3g} % {name}" for name, part in parts.items())
        rows = [
            ("volume", number(self.volume, "m^3", 8)),
            ("largest displacement", number(self.max_displacement, "m")),
            ("film", film),
            ("residual over load", f"{self.relative_residual:.1e}"),
            ("iterations", str(self.iterations)),
            ("built-in stress of", number(self.prestress, "Pa")),
            ("strain energy", number(self.strain_energy, "J")),
            ("bar force", number(self.bar_force, "N")),
            ("cord tension", ", ".join(number(t, "N") for t in self.hoop_tension) or "none"),
            ("displacement components", str(self.num_dofs)),
        ]
        return Glance(f"{self.pressure:g} Pa, {self.reason}", tuple(rows))

    def true_resultants(self) -> Any:
        """Cell means of the true (N_phi, N_theta, N_phitheta) [N/m], see `measures`. Collective."""
        self.activate()
        return measures.true_resultants(self.balloon)


def ideal_state(balloon: Balloon, pressure: float) -> Equilibrium:
    """The lobes as they were drawn, geometry held, their stress proportional to the pressure.

    The paper's sec. 5 takes its eigenvalues here. Exact equilibrium up to discretisation, whose
    residual is reported.

    Args:
        balloon: a prestressed balloon.
        pressure: p [Pa].

    Collective.
    """
    require_whole(balloon)
    require_pressure(balloon.film, pressure)
    require_drawn(balloon)
    if not balloon.prestressed:
        raise InputError("the ideal state needs a prestressed balloon; pass prestressed=True")
    balloon.set_loads(pressure, pressure)
    q = balloon.map.create_vector()
    return record(balloon, q, True, "held geometry", 0, ())


def placed_state(balloon: Balloon, displacement: Array) -> Equilibrium:
    """A displacement as a state to start `inflate` from, without load; in equilibrium only by chance.

    Args:
        balloon: what to displace.
        displacement: this rank's nodal displacements, ghosts included, (nodes, 3) [m]; nodes that are
            held or belong to a plate stay where they are.

    Collective.
    """
    balloon.set_loads(0.0)
    q = balloon.map.create_vector()
    with q as array:
        free = balloon.map.free
        array[: free.size] = displacement.reshape(-1)[free]
    return record(balloon, q, False, "placed", 0, ())


@timed("solver")
def inflate(
    balloon: Balloon,
    pressure: float,
    *,
    prestress: float | None = None,
    start: Equilibrium | None = None,
    rtol: float = 1e-8,
    max_iterations: int = 40,
    min_step: float = 1e-3,
    on_step: Callable[[Equilibrium], None] | None = None,
    nested: bool = False,
    keep_tangent: bool = True,
    progress: Progress | None = None,
) -> Equilibrium:
    """The equilibrium at a pressure: one SNES solve, or pressure steps when that one fails.

    Newton's method with MUMPS; its line search minimises the potential energy. The `film` load on
    moving plates has none: there the search freezes the plates' own share over each step.

    Args:
        balloon: what to inflate.
        pressure: gas pressure [Pa].
        prestress: pressure whose meridional stress is built in [Pa]; by default `pressure` for a
            prestressed balloon and 0 otherwise.
        start: state to start from (default: the reference shape, drawn along with a lifted rim; of film
            with a load path's stress that state, in whose shape it carries it).
        rtol: norm of the residual over that of the pressure's nodal forces.
        max_iterations: Newton iterations of one solve.
        min_step: smallest pressure step, as a share of the whole.
        on_step: called on all ranks with the equilibrium after each pressure step.
        nested: without a start, look first for the equilibrium on meshes half as fine and start from there
            (`lobefem.nested`), where that saves time. It leads to the same state, on a fine mesh several
            times sooner; where it leads nowhere the reference shape is the start.
        keep_tangent: on a large mesh, take further steps with a factorised tangent while they cost less than
            a new one; False for Newton's method as it is in books.
        progress: called with a line of text after each solve.

    Raises:
        InputError: a pressure that is no number, or suction on film that carries tension only.
        ConvergenceError: no equilibrium found; its `state` is the last one that was.

    Collective.
    """
    require_whole(balloon)
    require_pressure(balloon.film, pressure)
    for name, value in (("min_step", min_step), ("rtol", rtol)):
        checks.positive(name, value, "")
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
    path = balloon.load_path
    if start is None and path is not None and path.balloon.map.size == balloon.map.size:
        start = path
    q = start.vector() if start is not None else _drawn_along(balloon)
    _check_start(balloon, q, start)
    guess = None
    if nested and start is None:
        guess = _from_coarser(balloon, pressure, prestress, max_iterations, keep_tangent, progress)
    balloon.set_loads(pressure, prestress)
    begin = q if guess is None else guess
    solver = Newton(balloon, begin, rtol, max_iterations, PREFIX, keep=keep_tangent)
    try:
        if guess is not None:
            reason, count = solver.solve(guess)
            _tell(pressure, reason, count, solver.norm, progress)
            if reason > 0:
                state = record(balloon, guess, True, REASONS[reason], count, (pressure,))
                if on_step is not None:
                    on_step(state)
                return state
        return _step(balloon, solver, q, start, pressure, prestress, min_step, on_step, progress)
    finally:
        solver.destroy()


def _from_coarser(
    balloon: Balloon,
    pressure: float,
    prestress: float,
    max_iterations: int,
    keep_tangent: bool,
    progress: Progress | None,
) -> Any:
    """Unknowns to start from, the equilibrium on a mesh half as fine; None where none was found."""
    coarse = coarser_balloon(balloon)
    if coarse is None:
        return None
    q = _from_coarser(coarse, pressure, prestress, max_iterations, keep_tangent, progress)
    if q is None:
        q = _drawn_along(coarse)
    coarse.set_loads(pressure, prestress)
    solver = Newton(coarse, q, _COARSE_RTOL, max_iterations, PREFIX, keep=keep_tangent)
    try:
        reason, count = solver.solve(q)
        _tell(pressure, reason, count, solver.norm, progress, coarse)
    finally:
        solver.destroy()
    return interpolate(coarse, q, balloon) if reason > 0 else None


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
    on = " on {}x{}".format(*coarse.surface.divisions) if coarse is not None else ""
    say = f"inflate {pressure:.6g} Pa{on}: {REASONS[reason]} after {count} iterations, |r| = {norm:.2e}"
    logger.info(say)
    if progress is not None:
        progress(said(say, share))


def _check_start(balloon: Balloon, q: Any, start: Equilibrium | None) -> None:
    """Refuse a film that intersects itself: contact keeps it free of that, and cannot undo it."""
    if balloon.contact is None:
        return
    balloon.place(q)
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


def _step(
    balloon: Balloon,
    solver: Newton,
    q: Any,
    start: Equilibrium | None,
    end: float,
    prestress: float,
    min_step: float,
    on_step: Callable[[Equilibrium], None] | None,
    progress: Progress | None,
) -> Equilibrium:
    """One step to the end, halved when it fails and doubled when it does not."""
    begin = start.pressure if start is not None else 0.0
    last, share, step = q.copy(), 0.0, 1.0
    iterations, visited = 0, []
    while True:
        target = min(1.0, share + step)
        p = begin + target * (end - begin)
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
        step /= 2
        if step < min_step:
            balloon.set_loads(begin + share * (end - begin), prestress)
            last_state = start
            if visited:
                last_state = record(balloon, q, True, "last converged", iterations, tuple(visited))
            raise ConvergenceError(
                f"inflate stopped at {begin + share * (end - begin):.6g} Pa of {end:.6g} Pa "
                f"({REASONS[reason]}, |r| = {solver.norm:.1e}); try slack_stiffness >= 1e-4, a "
                "prestressed film, or a start that is not flat",
                state=last_state,
                pressure=p,
                residual=solver.norm,
                reason=REASONS[reason],
            )


def record(
    balloon: Balloon,
    q: Any,
    converged: bool,
    reason: str,
    iterations: int,
    steps: tuple[float, ...],
) -> Equilibrium:
    """What is measured at q under the balloon's present loads. Collective."""
    _petsc.tidy(balloon.comm)  # what the way here has left
    r = q.duplicate()
    balloon.residual(q, r)
    norm, scale = r.norm(), balloon.load_norm(q)
    bar_force = balloon.bar_force()
    r.destroy()
    displacement = balloon.u.x.array.reshape(-1, 3).copy()
    taut, wrinkled, slack = measures.region_areas(balloon)
    return Equilibrium(
        balloon=balloon,
        pressure=float(balloon.pressure.value),
        prestress=float(balloon.prestress.value),
        unknowns=q.array_r.copy(),
        displacement=displacement,
        converged=converged,
        reason=reason,
        iterations=iterations,
        residual=norm,
        relative_residual=norm / scale if scale else norm,
        volume=balloon.volume(),
        strain_energy=balloon.strain_energy(),
        max_displacement=measures.largest_of_state(balloon, displacement),
        bar_force=bar_force,
        hoop_tension=measures.cord_tensions(balloon),
        taut_area=taut,
        wrinkled_area=wrinkled,
        slack_area=slack,
        num_dofs=3 * balloon.V.dofmap.index_map.size_global,
        steps=steps,
        parameter=balloon.guide.parameter if balloon.guide is not None else 0.0,
    )


def require_whole(balloon: Balloon) -> None:
    """Refuse one sector of a balloon, or no balloon, where a whole one is needed."""
    checks.having("balloon", balloon, "reference_area", "a Balloon")
    if balloon.surface.copies != 1:
        raise InputError("this is one sector of a balloon; mesh the whole surface (sector=False)")


def require_drawn(balloon: Balloon) -> None:
    """Refuse supports that move nodes where the lobes are looked at as they were drawn. Collective."""
    checks.having("balloon", balloon, "reference_area", "a Balloon")
    balloon.place(balloon.map.create_vector())
    moved = measures.largest(balloon, balloon.u.x.array.reshape(-1, 3))
    if moved > 1e-9 * math.sqrt(balloon.reference_area):  # more than round-off
        raise InputError(
            f"the supports move the film by {moved:.3g} m, and the ideal state is that of the lobes as they "
            "were drawn; leave lift or displacement out, or look at the inflated state"
        )
