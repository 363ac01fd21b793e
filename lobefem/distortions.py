"""`distort`: a balloon's shape changed by a temporary constraint, and `release_start` without it.

Paper sec. 6: pressurise, distort, release. A distortion has one parameter, ramped in increments; at
each the balloon is in equilibrium under the constraint, and the force that this takes is returned.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from lobefem import checks
from lobefem._snes import REASONS, Newton
from lobefem.balloon import Balloon
from lobefem.distortion_kinds import Bend, Distortion, Tip, Twist, Wave
from lobefem.equilibrium import Equilibrium, Progress, record
from lobefem.errors import ConvergenceError, InputError
from lobefem.guides import Guide
from lobefem.log import logger
from lobefem.progress import said

# isort: split
from mpi4py import MPI

__all__ = [
    "Bend",
    "Distorted",
    "Distortion",
    "Increment",
    "Tip",
    "Twist",
    "Wave",
    "constrain",
    "distort",
    "mid_hoop_displacement",
    "release_start",
]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Increment:
    """One equilibrium on the way.

    Attributes:
        parameter: of the distortion [m or rad].
        reaction: force that the constraint exerts, conjugate to the parameter [N or N m].
        work: done by it since the start [J], by the trapezoidal rule over the increments.
        volume: enclosed [m^3].
        strain_energy: [J]; None for a film without an energy.
        mid_hoop_displacement: see the function of that name [m].
        residual: norm of the residual over that of the pressure's nodal forces.
        iterations: of Newton's method.
    """

    parameter: float
    reaction: float
    work: float
    volume: float
    strain_energy: float | None
    mid_hoop_displacement: float
    residual: float
    iterations: int


PREFIX = "lobefem_distort_"
OnStep = Callable[[Increment, Equilibrium], None]


@dataclass(frozen=True)
class Distorted:
    """A distorted balloon.

    Attributes:
        distortion: what was imposed.
        state: the equilibrium under the constraint; its `balloon` is the constrained one, so that
            `find_modes(state)` gives the modes under it.
        history: the increments, the start first.
    """

    distortion: Distortion
    state: Equilibrium = field(repr=False)
    history: tuple[Increment, ...] = field(repr=False)

    @property
    def reaction(self) -> float:
        """Force that the constraint exerts, conjugate to the parameter [N or N m]."""
        return self.history[-1].reaction


def distort(
    start: Equilibrium,
    distortion: Distortion,
    *,
    begin: float | None = None,
    steps: int = 10,
    first: float = 1.0,
    rtol: float = 1e-8,
    max_iterations: int = 30,
    min_step: float = 1e-4,
    on_step: OnStep | None = None,
    progress: Progress | None = None,
) -> Distorted:
    """Impose a distortion by a ramp of its parameter, pressure and prestress held.

    Each increment is one SNES solve from an extrapolation of the last ones. One that fails is halved;
    after two that do not the next is twice as large, up to the first size. Newton's steps are taken
    in full: where wrinkles come and go a line search on the energy crawls from kink to kink.

    Args:
        start: equilibrium of the free balloon, or of one under the same kind of distortion: from
            there the ramp goes on, or back.
        distortion: what to impose.
        begin: the parameter at which the start is, where it cannot say so itself: a state of the free
            balloon read from a file (see `release_start`).
        steps: increments of the whole ramp, if none fails.
        first: size of the first increment as a share of the others. A pressurised stack resists most
            at first.
        rtol: norm of the residual over that of the pressure's nodal forces.
        max_iterations: Newton iterations of one increment.
        min_step: smallest increment, as a share of the ramp.
        on_step: called with each increment and its equilibrium, on all ranks.
        progress: called with a line of text after each solve.

    Raises:
        InputError: the balloon cannot be distorted so, or is under another distortion.
        ConvergenceError: an increment of `min_step` failed; `state` is the last equilibrium and
            `data` holds its `parameter` and the `history`.

    Collective.
    """
    checks.integer("steps", steps, 1)
    s = getattr(start, "parameter", 0.0) if begin is None else checks.finite("begin", begin, distortion.unit)
    balloon = constrain(start.balloon, distortion)
    q = _transfer(start, balloon, s)
    newton = Newton(balloon, q, rtol, max_iterations, PREFIX, "basic")
    try:
        return _ramp(newton, q, start, distortion, s, steps, first, min_step, on_step, progress)
    finally:
        newton.destroy()


def constrain(balloon: Balloon, distortion: Distortion) -> Balloon:
    """The balloon under a distortion, at the parameter 0: the same film with another map. Collective.

    Raises:
        InputError: it cannot be distorted so, or is under another distortion.
    """
    distortion.check(balloon)
    if balloon.guide is None:
        return balloon.under(distortion.guide(balloon))
    if balloon.guide.kind != distortion.kind:
        raise InputError(f"the balloon is under a {balloon.guide.kind}; release it before {distortion}")
    return balloon


def _transfer(state: Any, balloon: Balloon, parameter: float) -> Any:
    """The q of a balloon with the displacement of a state of the same film, under a guide or free of it."""
    old = state.balloon
    for one in (old, balloon):
        if one.guide is not None:
            one.guide.parameter = parameter
    old.set_loads(state.pressure, state.prestress)
    old.place(state.vector())
    return balloon.adopt(old)


def _ramp(
    newton: Newton,
    q: Any,
    start: Equilibrium,
    distortion: Distortion,
    begin: float,
    steps: int,
    first: float,
    min_step: float,
    on_step: OnStep | None,
    progress: Progress | None,
) -> Distorted:
    balloon, guide = newton.balloon, _guide(newton.balloon)
    history: list[Increment] = []
    found: list[tuple[float, Any]] = []  # parameter and q of the last two equilibria
    state, span = start, distortion.parameter - begin
    # the start itself comes first: the constraint may move it a little
    share, step, target, passed = 0.0, first / steps, 0.0, 0  # passed: increments since one failed
    while True:
        if target > share:
            _predict(newton, q, found, begin + target * span)
        reason, count = newton.solve(q)
        say = (
            f"{distortion.kind} {guide.parameter:.5g} {distortion.unit}: {REASONS[reason]} after {count} "
            f"iterations, |r| = {newton.norm:.2e}"
        )
        logger.info(say)
        if progress is not None:
            progress(said(say, target if reason > 0 else share))
        if reason > 0:
            passed += 1
            if passed > 1:
                step = min(2 * step, 1 / steps)
            share, found = target, [*found[-1:], (guide.parameter, q.copy())]
            state = record(balloon, q, True, REASONS[reason], count, ())
            history.append(_increment(balloon, q, state, history[-1] if history else None))
            if on_step is not None:
                on_step(history[-1], state)
            if share == 1.0 or span == 0.0:
                return Distorted(distortion, state, tuple(history))
        else:
            step, passed = min(step, target - share) / 2, 0
            if step < min_step or not found:
                at = begin + share * span
                raise ConvergenceError(
                    f"the {distortion.kind} stopped at {at:.6g} {distortion.unit} of "
                    f"{distortion.parameter:.6g} {distortion.unit} ({REASONS[reason]}, |r| = "
                    f"{newton.norm:.1e}); try more steps, slack_stiffness >= 1e-4, or contact",
                    state=state,
                    parameter=at,
                    history=tuple(history),
                    residual=newton.norm,
                    reason=REASONS[reason],
                )
            guide.parameter, last = found[-1]
            last.copy(q)
        # no remnant of a rounding error at the end
        target = 1.0 if share + step > 1.0 - 1e-6 * step else share + step


def _guide(balloon: Balloon) -> Guide:
    assert balloon.guide is not None  # by `constrain`
    return balloon.guide


def _predict(newton: Newton, q: Any, found: list[tuple[float, Any]], target: float) -> None:
    """Set the guide's parameter, and move q to where it should be: along the last two equilibria.

    The first increment goes along the linear response -K^-1 dr/ds. Collective.
    """
    balloon, guide = newton.balloon, _guide(newton.balloon)
    change = target - guide.parameter
    if len(found) == 2:
        (s0, q0), (s1, _) = found
        q.axpy(change / (s1 - s0), q)
        q.axpy(-change / (s1 - s0), q0)
    else:
        rate, now = q.duplicate(), q.duplicate()
        balloon.residual(q, now)
        guide.parameter += 1e-4 * change
        balloon.residual(q, rate)
        guide.parameter -= 1e-4 * change
        rate.axpy(-1.0, now)
        K, ksp = balloon.tangent(q), newton.snes.getKSP()
        ksp.setOperators(K, K)
        ksp.solve(rate, now)
        q.axpy(-1e4, now)
    guide.parameter = target


def _increment(balloon: Balloon, q: Any, state: Equilibrium, before: Increment | None) -> Increment:
    reaction, work = balloon.reaction(q), 0.0
    if before is not None:
        work = before.work + (before.reaction + reaction) / 2 * (state.parameter - before.parameter)
    return Increment(
        parameter=state.parameter,
        reaction=reaction,
        work=work,
        volume=state.volume,
        strain_energy=state.strain_energy,
        mid_hoop_displacement=mid_hoop_displacement(state),
        residual=state.relative_residual,
        iterations=state.iterations,
    )


def mid_hoop_displacement(state: Equilibrium) -> float:
    """Displacement along x of the middle hoop's centre [m]; of an odd number of lobes the equator's.

    The mean over the nodes of the ring, or over those nearest to the middle. Collective.
    """
    balloon = state.balloon
    surface, axis = balloon.surface, np.asarray(balloon.surface.axis)
    owned, lobes = balloon.V.dofmap.index_map.size_local, balloon.surface.num_lobes
    if lobes % 2 == 0:
        nodes = balloon.edge_nodes(f"seam_{lobes // 2}")
        nodes = nodes[nodes < owned]
    else:
        height = balloon.V.tabulate_dof_coordinates()[:owned] @ axis
        off = np.abs(height - lobes * surface.shape.height / 2)
        nearest = balloon.comm.allreduce(off.min(initial=np.inf), op=MPI.MIN)
        nodes = np.flatnonzero(off < nearest + 1e-6 * surface.shape.height).astype(np.int32)
    first = balloon.motion.across[0] if balloon.motion is not None else np.eye(3)[0]
    sums = np.array([float((state.displacement[nodes] @ first).sum()), len(nodes)])
    total, count = balloon.comm.allreduce(sums)
    return float(total / count)


def release_start(state: Equilibrium) -> Equilibrium:
    """A distorted state as one of the free balloon, the constraint taken away and nothing moved yet.

    It is no equilibrium: its residual is what the constraint held. A start for `inflate` or a
    release, and what a run keeps on file of a distorted state: `distort` goes on from it with `begin`.

    Raises:
        InputError: the state is under no distortion.

    Collective.
    """
    free = state.balloon.free
    if free is None:
        raise InputError("the state is under no distortion; there is nothing to release")
    q = _transfer(state, free, state.parameter)
    return record(free, q, False, "constraint taken away", 0, ())
