"""Damped motion of a balloon by PETSc TS.

c B dq/dt + r(q) = 0: damping in proportion to the mass B of unit areal density, no inertia (Abaqus's
STABILIZE in a static step, which the paper used, adds the same forces c M v). By implicit Euler with
adaptive steps h. Newton's method solves them without a line search: almost inextensible film and hoops
make the energy a narrow curved valley, in which a search creeps. Its tangent has the stress that the last
step predicted (`WeakForms.predicted`), which takes a third of the iterations. A step that does not
converge, or not to a lower energy E(q) + c/(2 h)|q - q_n|_B^2, is made shorter instead, and the next one
is as long as Newton's method is likely to manage.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lobefem.equilibrium import newton
from lobefem.equilibrium.energy_ledger import Ledger, measure
from lobefem.equilibrium.operator import Operator
from lobefem.fem.balloon import Balloon
from lobefem.fem.functionals import middle_nodes, stiffness_scale
from lobefem.linalg import petsc
from lobefem.log import logger
from lobefem.typing import SNES, TS, Array, Mat, Vec

from petsc4py import PETSc

__all__ = ["GradientFlow", "Record", "damping_scale"]

PREFIX = "lobefem_release_"

_OPTIONS = {
    "ts_adapt_type": "basic",
    "ts_adapt_clip": "0.1,3",
    "ts_adapt_scale_solve_failed": 0.5,
    "snes_linesearch_type": "basic",
}

# Newton iterations of a step of the right length, and those after which it is taken again by half
_WANTED, _FAILED = 6, 10

# iterations by which the residual of a solve that will succeed lies below that of its first step
_FALLING = 4


@dataclass(frozen=True)
class Record:
    """An accepted step: what was measured at its end.

    Attributes:
        number: of the step, 0 for the start.
        time: at its end [s].
        step, next_step: its length and what the next one is to be [s].
        iterations: Newton iterations in all.
        residual: norm of the unbalanced forces, those that hold the start included [N, N m].
        relative_residual: the same over the norm of the pressure's nodal forces, or without pressure over
            that of the start's residual.
        volume: enclosed by film and plates [m^3].
        strain_energy: of film, cables and bar [J].
        contact_energy: [J].
        middle: displacement (3,) of the centre of the ring at half the height, a hoop where the number
            of lobes is even [m].
        top: displacement (3,) of the top plate's centre [m]; None without plates.
        ledger: from the start to here.
    """

    number: int
    time: float
    step: float
    next_step: float
    iterations: int
    residual: float
    relative_residual: float
    volume: float
    strain_energy: float
    contact_energy: float
    middle: tuple[float, float, float]
    top: tuple[float, float, float] | None
    ledger: Ledger


def damping_scale(balloon: Balloon) -> float:
    """Unit of damping c [Pa s/m]: p/sqrt(A) times one second, A the film's area.

    A mode with the eigenvalue lambda = p/sqrt(A), the stiffness scale of a pressurised film, then
    decays with the time constant c/lambda = 1 s.
    """
    return stiffness_scale(balloon, float(balloon.pressure.value))


_WHY: Any = PETSc.TS.ConvergedReason

_REASONS: dict[int, str] = {
    _WHY.CONVERGED_USER: "settled",
    _WHY.CONVERGED_TIME: "end of time",
    _WHY.CONVERGED_ITS: "too many steps",
    _WHY.DIVERGED_NONLINEAR_SOLVE: "no solution of a step",
    _WHY.DIVERGED_STEP_REJECTED: "no step small enough",
}

OnStep = Callable[[Record, Array], None]


class GradientFlow:
    """The damped motion of a balloon under its present loads.

    Args:
        balloon: with its loads set.
        q: where it starts; moved by `run`.
        damping: c [Pa s/m].
        tolerance: of the error of a step, root mean square over the unknowns, angles as lengths [m].
        settled: relative residual at which the motion has ended.
        ledger: what to go on from.
        close: residual of a step's solution over that of its beginning.
        fade: time in which the forces that held the start die away, linearly [s]; None: gone at once.
        on_step: called with each record and this rank's unknowns at the beginning of its step.

    Collective.
    """

    def __init__(
        self,
        balloon: Balloon,
        q: Vec,
        *,
        damping: float,
        tolerance: float,
        settled: float,
        ledger: Ledger,
        close: float = 0.03,
        fade: float | None = None,
        on_step: OnStep | None = None,
    ) -> None:
        self.balloon, self.q, self.fade = balloon, q, fade
        self.damping, self.tolerance, self.settled = damping, tolerance, settled
        self.ledger, self.on_step, self._close = ledger, on_step, close
        self.history: list[Record] = []
        self._middle = middle_nodes(balloon)
        self._r, self._force, self._held, self._change, self._work, self._begin, self._last = (
            q.duplicate() for _ in range(7)
        )
        self._holding = 0.0  # share of the held forces at the end of the present step
        self._mass: Any = None
        self._shift = 0.0
        self._earlier = 0
        self._start_norm = self._first_norm = self._energy = 0.0
        self._failures = 0  # of solves, before the present step
        self._redo: Record | None = None
        symmetric = newton.has_symmetric_load(balloon, q)
        self.ts = ts = PETSc.TS().create(balloon.comm)
        ts.setOptionsPrefix(PREFIX)
        ts.setType(PETSc.TS.Type.BEULER)
        ts.setIFunction(self._function, self._r)
        # hoops make nearly all of the round-off, and their stiffness stays; that of the reference shape, and
        # the load there, are the same for a run that goes on from another place
        at_rest = balloon.map.create_vector()
        self._load = balloon.load_norm(at_rest)
        self._stiffness = balloon.tangent(at_rest).getDiagonal()
        at_rest.destroy()
        if not self._load:  # as for Newton's method, what is out of balance at the start
            balloon.residual(q, self._r)
            self._load = self._r.norm() or 1.0
        self._operator = Operator(balloon)
        K = balloon.tangent(q)
        ts.setIJacobian(self._tangent, self._operator.at(q, K), K)
        ts.setPreStep(self._before)
        ts.setPostStep(self._after)
        self._lengths = newton.lengths(balloon)
        atol = self._lengths.copy()
        atol.reciprocal()
        atol.scale(tolerance)
        ts.setTolerances(rtol=0.0, atol=atol)
        atol.destroy()
        # a failed solve halves the step: forty in a row leave 1e-12 of it
        ts.setMaxSNESFailures(10**6)
        ts.setMaxStepRejections(40)
        ts.setErrorIfStepFails(False)
        snes = ts.getSNES()
        snes.setTolerances(max_it=_FAILED)
        snes.setConvergenceTest(self._converged)
        petsc.set_direct_solver(snes.getKSP(), symmetric, exact=balloon.gas is None)
        with petsc.options(PREFIX, _OPTIONS):
            ts.setFromOptions()
        self._separation = newton.Separation(snes, balloon, self._r, symmetric, limited=True)

    # --- the equation ---------------------------------------------------------------------------

    def _function(self, ts: TS, t: float, x: Vec, xdot: Vec, f: Vec) -> None:
        self.balloon.residual(x, f)
        self._mass.mult(xdot, self._work)
        f.axpy(self.damping, self._work)
        self._holding = self._share(t)
        f.axpy(-self._holding, self._held)

    def _share(self, time: float) -> float:
        """Remaining share, at a time, of the forces that held the start."""
        return max(1.0 - time / self.fade, 0.0) if self.fade is not None else 0.0

    def _tangent(self, ts: TS, t: float, x: Vec, xdot: Vec, shift: float, J: Mat, P: Mat) -> None:
        self._shift = shift
        if ts.getSNES().getIterationNumber() == 0:
            self._begin.copy(self._last)
        K = self.balloon.tangent(x, iteration=True, before=self._last)
        x.copy(self._last)
        newton.follow_pattern(ts.getSNES(), self.balloon)
        K.axpy(self.damping * shift, self._mass, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
        self._operator.at(x, K)

    def _converged(self, snes: SNES, its: int, norms: tuple[float, float, float]) -> int | None:
        """SNES's test; a solution that lies higher in energy than the step's beginning is refused.

        Whole Newton steps can end at film turned inside out. An accepted step has lowered
        E(q) + c/(2 h)|q - q_n|_B^2, as the true motion does, to a millionth of p V or to its round-off.

        What is left unbalanced is borne for one step, and shows in the ledger; equilibrium at the end is
        found without that. Where contact passes from facet to facet its force jumps a little, and to the
        last digit Newton's method would go to and fro between both sides for ever.
        """
        norm, why = norms[2], PETSc.SNES.ConvergedReason
        if not math.isfinite(norm) or (its and self._separation.share < newton.STUCK):
            return why.DIVERGED_DTOL
        if its == 0:
            self._start_norm = norm
        elif its == 1:
            self._first_norm = norm
        elif its >= _FALLING and norm > self._first_norm:
            return why.DIVERGED_DTOL
        x = snes.getSolution()
        floor = newton.round_off(self._stiffness, x) if its else 0.0
        if norm > max(0.1 * self.settled * self._load, self._close * self._start_norm, floor):
            return None
        x.copy(self._change)
        self._change.axpy(-1.0, self._begin)
        self._mass.mult(self._change, self._work)
        energy, size = self.balloon.energy(x)
        energy += self.damping * self._shift / 2 * self._work.dot(self._change)
        energy -= self._holding * self._held.dot(self._change)
        slack = 1e-6 * abs(float(self.balloon.pressure.value)) * self.balloon.reference_volume
        slack = max(slack, 1e-12 * size)  # round-off, as in a line search
        return why.CONVERGED_FNORM_ABS if energy <= self._energy + slack else why.DIVERGED_LOCAL_MIN

    # --- steps ----------------------------------------------------------------------------------

    def run(
        self, history: Sequence[Record] = (), max_steps: int = 1000, end_time: float | None = None
    ) -> str:
        """Move until settled, to a time or for a number of steps; says in words why it ended. Collective.

        Args:
            history: records of an earlier run, whose last step started from q: it is taken again.
            max_steps: in all.
            end_time: [s].
        """
        ts, q = self.ts, self.q
        self._open()
        if history and history[-1].number > 0:
            self.history = list(history[:-1])
            self._redo = history[-1]
            ts.setTime(history[-2].time)
            ts.setTimeStep(self._redo.step)
        else:
            first = self._first_step()
            self._record(0, 0.0, 0.0, first, self.ledger)
            ts.setTimeStep(first)
        last = self.history[-1]
        if last.relative_residual <= self.settled and self._redo is None and self.fade is None:
            return "settled"
        ts.setMaxSteps(max(max_steps - last.number, 0))
        ts.setMaxTime(1e100 if end_time is None else end_time)
        final: Any = PETSc.TS.ExactFinalTime
        ts.setExactFinalTime(final.STEPOVER if end_time is None else final.MATCHSTEP)
        try:
            ts.solve(q)
        except PETSc.Error as error:
            # what a callback raised, Ctrl-C above all, is the cause of PETSc's own error
            raise (error.__cause__ or error) from None
        reason: Any = ts.getConvergedReason()
        return _REASONS.get(reason, "the time step failed")

    def _first_step(self) -> float:
        """Time in which the first velocity, with the mass lumped, makes a change of the tolerance."""
        if self.fade is not None:
            return 1e-3 * self.fade  # all is balanced at first
        self._mass.getDiagonal(self._work)
        self._change.pointwiseDivide(self._force, self._work)
        self._change.pointwiseMult(self._change, self._lengths)
        speed = self._change.norm() / math.sqrt(self._change.getSize()) / self.damping
        return self.tolerance / speed if speed else 1.0

    def _open(self) -> None:
        """The start as the beginning of a step: mass, force, energies."""
        self._begin_at(self.q)
        self.balloon.residual(self.q, self._force)
        if self.fade is not None:
            self._force.copy(self._held)
            self._force.set(0.0)
        self._force.scale(-1.0)  # of the damping, as it will be at once
        self._state = measure(self.balloon, self.q)

    def _begin_at(self, q: Vec) -> None:
        """Take q as the beginning of a step, with its mass and its energy."""
        q.copy(self._begin)
        if self._mass is None or self.balloon.map.num_parameters:
            if self._mass is not None:
                self._mass.destroy()
            # the plates' rotation changes it a little from step to step
            self._mass = self.balloon.mass(q)
        self.balloon.freeze_plates(q)
        self._energy = self.balloon.energy(q)[0]

    def _before(self, ts: TS) -> None:
        self._begin_at(ts.getSolution())
        self._failures = ts.getSNESFailures()

    def _after(self, ts: TS) -> None:
        """Balance and record an accepted step."""
        x = ts.getSolution()
        old, state = self._state, measure(self.balloon, x)
        x.copy(self._change)
        self._change.axpy(-1.0, self._begin)
        self._mass.mult(self._change, self._work)
        self._work.scale(self.damping * self._shift)
        euler = self._work.dot(self._change)
        damping = (self._force.dot(self._change) + euler) / 2
        faded = (self._share(ts.getTime() - 1 / self._shift) + self._holding) / 2
        held = faded * self._held.dot(self._change)
        self._work.copy(self._force)
        if stuck := not self._change.norm():
            # the step underflowed: what is unbalanced is there still
            self.balloon.residual(x, self._force)
            self._force.scale(-1.0)
            self._force.axpy(self._holding, self._held)
        self._state = state
        # Newton's reach limits the steps, not their error; where it just ended they do not grow
        share = _WANTED / max(ts.getSNES().getIterationNumber(), 1)
        if ts.getSNESFailures() > self._failures:
            share = min(share, 1.0)
        ts.setTimeStep(min(ts.getTimeStep(), share / self._shift))
        redo, self._redo = self._redo, None
        if redo is not None:
            self.history.append(redo)
            self.ledger = redo.ledger
            self._earlier = redo.iterations - ts.getSNESIterations()
            ts.setTimeStep(redo.next_step)
        else:
            ledger = self.ledger.after(self.balloon, old, state, held=held, damping=damping, euler=euler)
            self._record(self.history[-1].number + 1, ts.getTime(), 1 / self._shift, ts.getTimeStep(), ledger)
        if stuck:
            ts.setConvergedReason(PETSc.TS.ConvergedReason.DIVERGED_STEP_REJECTED)
        elif self.history[-1].relative_residual <= self.settled and not self._share(ts.getTime()):
            ts.setConvergedReason(PETSc.TS.ConvergedReason.CONVERGED_USER)

    def _record(self, number: int, time: float, step: float, next_step: float, ledger: Ledger) -> None:
        self.ledger, state, balloon = ledger, self._state, self.balloon
        residual = self._force.norm()
        iterations = self._earlier + self.ts.getSNESIterations()
        ring = balloon.u.x.array.reshape(-1, 3)[self._middle]
        sums = balloon.comm.allreduce(np.append(ring.sum(axis=0), len(ring)))
        x, y, z = (sums[:3] / sums[3]).tolist()
        record = Record(
            number=number,
            time=time,
            step=step,
            next_step=next_step,
            iterations=iterations,
            residual=residual,
            relative_residual=residual / self._load,
            volume=state.volume,
            strain_energy=state.strain,
            contact_energy=state.contact,
            middle=(x, y, z),
            top=tuple(state.centres[1].tolist()) if balloon.motion is not None else None,
            ledger=ledger,
        )
        self.history.append(record)
        logger.info("release %g s: |r| = %.2e, V = %.6g m^3", time, residual, state.volume)
        if self.on_step is not None:
            self.on_step(record, self._begin.array_r.copy())

    def destroy(self) -> None:
        """Free the PETSc objects and with them the references to the balloon."""
        self.ts.destroy()
        for v in (
            self._r, self._force, self._held, self._change, self._work, self._begin, self._last, self._mass,
            self._stiffness, self._lengths,
        ):  # fmt: skip
            v.destroy()
