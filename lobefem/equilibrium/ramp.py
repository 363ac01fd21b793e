"""`Ramp`: a guide's parameter taken from one value to another, through stable equilibria.

Newton's method carries the balloon from increment to increment. Where that fails, even for a small one,
there is no equilibrium near by: some film buckles, and the balloon moves to another equilibrium at the
same parameter. That motion is computed as a damped one (`lobefem.equilibrium.gradient_flow`), and what it
takes of the energy is counted.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from lobefem.equilibrium.energy_ledger import Ledger
from lobefem.equilibrium.gradient_flow import GradientFlow, Record, damping_scale
from lobefem.equilibrium.newton import REASONS, Newton, too_far
from lobefem.equilibrium.solver_options import NewtonOptions
from lobefem.equilibrium.state import Equilibrium, record
from lobefem.errors import ConvergenceError
from lobefem.fem.balloon import Balloon
from lobefem.fem.functionals import mid_hoop_displacement, stiffness_scale
from lobefem.fem.prescribed_motion import PrescribedMotion
from lobefem.linalg import petsc
from lobefem.log import logger
from lobefem.progress import said
from lobefem.typing import Vec
from lobefem.units import in_degrees

from petsc4py import PETSc

__all__ = ["Increment", "OnStep", "Ramp"]

PREFIX = "lobefem_distort_"

# the balloon is let move where an increment fails that is this share of a regular one
_SMALL = 1 / 8

# eigenvalues above minus this share of p/sqrt(film area) count as none that is negative
_NEUTRAL = 1e-3

# of the damped motion: error of a step over sqrt(film area), and residual over the load at its end; just
# past a buckling the motion is slow and its residual small
_TOLERANCE, _SETTLED, _MOST_STEPS = 3e-4, 1e-8, 300

_UNSTABLE, _TOUCHES = "unstable", "the film would go too far or touch itself"


@dataclass(frozen=True)
class Increment:
    """One equilibrium on the way.

    Attributes:
        parameter: of the distortion [m or rad].
        reaction: force that the constraint exerts, conjugate to the parameter [N or N m].
        work: done by it since the start [J]; a parabola through the last three reactions is integrated.
        volume: enclosed [m^3].
        strain_energy: [J]; None for a film without an energy.
        mid_hoop_displacement: see the function of that name [m].
        residual: norm of the residual over that of the pressure's nodal forces.
        iterations: of Newton's method.
        damping: work that damped motions took since the start [J], where the balloon went over to
            another equilibrium at the same parameter.
    """

    parameter: float
    reaction: float
    work: float
    volume: float
    strain_energy: float | None
    mid_hoop_displacement: float
    residual: float
    iterations: int
    damping: float = 0.0


OnStep = Callable[[Increment, Equilibrium], None]


class Ramp:
    """The ramp of one guided balloon.

    Args:
        balloon: under its guide, with its loads set.
        q: where it starts; moved by `run`.
        options: of Newton's method, see `distort`.
        words: kind and unit of the parameter, for messages.
        progress: called with a line of text after each solve.

    Collective.
    """

    def __init__(
        self,
        balloon: Balloon,
        q: Vec,
        options: NewtonOptions,
        words: tuple[str, str],
        progress: Callable[[str], None] | None = None,
    ) -> None:
        assert balloon.prescribed is not None  # by `constrain`
        self.balloon, self.q = balloon, q
        self.prescribed: PrescribedMotion = balloon.prescribed
        self.history: list[Increment] = []
        self._kind, self._unit = words
        self._min_step = options.min_step
        self._progress, self._done = progress, 0.0  # a share of the way
        self._newton = Newton(balloon, q, options, PREFIX, "basic", predicted=True)
        # parameter and q of the last two equilibria on one branch
        self._found: list[tuple[float, Any]] = []
        self._on_branch = 0  # equilibria since the last damped motion

    def run(
        self,
        start: Equilibrium,
        end: float,
        steps: int,
        first: float,
        on_step: OnStep | None,
    ) -> Equilibrium:
        """Go from the guide's present parameter to another, see `distort`. Collective."""
        begin, state = self.prescribed.parameter, start
        span = end - begin
        # the start itself comes first: the constraint may move it a little
        share, step, target, passed, failed = 0.0, first / steps, 0.0, 0, 0
        while True:
            lost: float | None = None
            why, count = self._go(begin + target * span)
            small = (target - share) * steps <= (1 + 1e-9) * _SMALL
            # the first one has no line to go along, and may be too large for Newton's method alone
            if why and small and (failed or len(self._found) == 2) and self.balloon.forms.has_energy:
                why, count, lost = self._move(begin + target * span)
            if not why:
                passed, failed, share, self._done = passed + 1, 0, target, target
                if passed > 1:
                    step = min(2 * step, 1 / steps)
                self._on_branch = self._on_branch + 1 if lost is None else 1
                self._found = [*self._found[-1:], (self.prescribed.parameter, self.q.copy())][
                    -self._on_branch :
                ]
                state = record(self.balloon, self.q, True, REASONS[2], count, ())
                self.history.append(self._increment(state, lost))
                if on_step is not None:
                    on_step(self.history[-1], state)
                if share == 1.0 or span == 0.0:
                    return state
            else:
                step, passed, failed = min(step, target - share) / 2, 0, failed + 1
                if step < self._min_step or not self._found:
                    self._give_up(state, begin + share * span, end, why)
                self._back()
            # no remnant of a rounding error at the end
            target = 1.0 if share + step > 1.0 - 1e-6 * step else share + step

    def _give_up(self, state: Equilibrium, at: float, end: float, why: str) -> None:
        here, unit = in_degrees(at, self._unit)
        there, _ = in_degrees(end, self._unit)
        raise ConvergenceError(
            f"the {self._kind} stopped at {here:.6g} {unit} of {there:.6g} {unit} ({why}, |r| = "
            f"{self._newton.norm:.1e}); try more steps, slack_stiffness >= 1e-4, or contact",
            state=state,
            parameter=at,
            history=tuple(self.history),
            residual=self._newton.norm,
            reason=why,
        )

    # --- one increment --------------------------------------------------------------------------

    def _go(self, target: float) -> tuple[str, int]:
        """Newton's method at a parameter: why it found no stable equilibrium, "" if it did; iterations."""
        if self._found and not self._predict(target):
            self._say(_TOUCHES)
            return _TOUCHES, 0
        return self._solve()

    def _solve(self) -> tuple[str, int]:
        reason, count = self._newton.solve(self.q)
        text = REASONS[reason]
        why = "" if reason > 0 else text
        if not why and self._found and not self._is_stable():
            why = text = _UNSTABLE
        self._say(f"{text} after {count} iterations, |r| = {self._newton.norm:.2e}")
        return why, count

    def _say(self, text: str) -> None:
        amount, unit = in_degrees(self.prescribed.parameter, self._unit)
        line = f"{self._kind} {amount:.5g} {unit}: {text}"
        logger.info(line)
        if self._progress is not None:
            self._progress(said(line, self._done))

    def _move(self, target: float) -> tuple[str, int, float]:
        """Damped motion to an equilibrium at a parameter: as `_go`, and the energy that this takes [J].

        The difference of the energies; where the load has no potential the work of the damping less what
        the prediction, from where the motion starts, has put in. That work is a sum over the motion's
        steps, whose error is a share of the energy there: far too much from a prediction far off.
        """
        self._back()
        balloon, q = self.balloon, self.q
        balloon.freeze_plates(q)
        before, _ = balloon.energy(q)
        if not self._predict(target):
            return _TOUCHES, 0, 0.0
        lost = before - balloon.energy(q)[0]
        last = self._drift()
        lost += last.ledger.damping
        why, count = self._solve()
        if not why and balloon.load.convention == "closed":
            lost = before - balloon.energy(q)[0]
        return why, last.iterations + count, lost

    def _drift(self) -> Record:
        """Damped motion until it is at rest: its last record."""
        balloon = self.balloon
        flow = GradientFlow(
            balloon,
            self.q,
            # no path depends on it, and without gas pressure there is nothing to measure it by
            damping=damping_scale(balloon) or 1.0,
            tolerance=_TOLERANCE * math.sqrt(balloon.reference_area),
            settled=_SETTLED,
            ledger=Ledger(),
        )
        try:
            end = flow.run(max_steps=_MOST_STEPS)
            last = flow.history[-1]
        finally:
            flow.destroy()
        self._say(f"damped motion, {end} after {last.number} steps, |r| = {last.residual:.2e}")
        return last

    def _back(self) -> None:
        """Return to the last equilibrium."""
        self.prescribed.parameter, last = self._found[-1]
        last.copy(self.q)

    def _predict(self, target: float) -> bool:
        """Set the guide's parameter, and move q to where it should be: along the last two equilibria.

        Without two, along the linear response -K^-1 dr/ds. Collective.

        Returns:
            whether the film can go there: not too far, and without touching itself.
        """
        balloon, prescribed, q = self.balloon, self.prescribed, self.q
        balloon.set_unknowns(q)
        before, last = balloon.u.x.array.copy(), q.copy()
        change = target - prescribed.parameter
        if len(self._found) == 2:
            (s0, q0), (s1, _) = self._found
            q.axpy(change / (s1 - s0), q)
            q.axpy(-change / (s1 - s0), q0)
        elif change:
            rate, now = q.duplicate(), q.duplicate()
            balloon.residual(q, now)
            prescribed.parameter += 1e-4 * change
            balloon.residual(q, rate)
            prescribed.parameter -= 1e-4 * change
            rate.axpy(-1.0, now)
            K, ksp = balloon.tangent(q), self._newton.snes.getKSP()
            ksp.setOperators(K, K)
            ksp.solve(rate, now)
            q.axpy(-1e4, now)
        prescribed.parameter = target
        last.axpy(-1.0, q)
        if too_far(balloon, last):
            return False
        if balloon.contact is None:
            return True
        balloon.set_unknowns(q)
        return balloon.contact.free_share(before, balloon.u) == 1.0

    def _is_stable(self) -> bool:
        """True if no eigenvalue is negative, by inertia; taken for granted where K is not symmetric."""
        balloon = self.balloon
        if not self._newton.symmetric:
            return True
        K, B = balloon.tangent(self.q).copy(), balloon.mass(self.q)
        scale = stiffness_scale(balloon, float(balloon.pressure.value))
        # rigid motions that the supports leave have eigenvalues of no sign
        K.axpy(_NEUTRAL * scale, B, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
        negative = petsc.num_negative(K)
        K.destroy()
        B.destroy()
        return negative == 0

    def _increment(self, state: Equilibrium, lost: float | None) -> Increment:
        reaction = self.balloon.reaction(self.q)
        before = self.history[-1] if self.history else None
        work = damping = 0.0
        if before is not None:
            points = [(i.parameter, i.reaction) for i in self.history[-2:]]
            # a parabola over a jump would overshoot
            whole = self._on_branch > 2
            gained = _integral([*points[0 if whole else -1 :], (state.parameter, reaction)])
            # the constraint's own work is not lost
            lost = 0.0 if lost is None else max(lost + gained, 0.0)
            work, damping = before.work + gained, before.damping + lost
        return Increment(
            parameter=state.parameter,
            reaction=reaction,
            work=work,
            volume=state.volume,
            strain_energy=state.strain_energy,
            mid_hoop_displacement=mid_hoop_displacement(state.balloon, state.displacement),
            residual=state.relative_residual,
            iterations=state.iterations,
            damping=damping,
        )

    def destroy(self) -> None:
        """Free the PETSc objects and with them the references to the balloon."""
        self._newton.destroy()


def _integral(points: list[tuple[float, float]]) -> float:
    """Integral over the last interval of the polynomial through two or three points (s, F)."""
    s, F = np.array(points).T
    if s[0] == s[-1]:
        return 0.0
    primitive = np.polynomial.Polynomial.fit(s, F, len(s) - 1).integ()
    return float(primitive(s[-1]) - primitive(s[-2]))
