"""Displacement control: a balloon distorted by a prescribed motion, and let go of it again."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from lobefem import checks
from lobefem.equilibrium.distortions import Distortion, require_distortion
from lobefem.equilibrium.inflation import Progress
from lobefem.equilibrium.ramp import PREFIX, Increment, OnStep, Ramp
from lobefem.equilibrium.solver_options import RAMP, NewtonOptions
from lobefem.equilibrium.state import Equilibrium, State, record
from lobefem.errors import InputError
from lobefem.fem.balloon import Balloon
from lobefem.linalg import petsc

__all__ = ["Distorted", "constrain", "distort", "release_start"]


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
    options: NewtonOptions = RAMP,
    on_step: OnStep | None = None,
    progress: Progress | None = None,
) -> Distorted:
    """Impose a distortion by a ramp of its parameter, pressure and prestress held.

    Each increment is one SNES solve from an extrapolation of the last ones. One that fails, or ends at an
    unstable equilibrium (by the inertia of a symmetric tangent), is halved; after two that do not the
    next is twice as large, up to the first size. Newton's steps are taken in full, with the stress that
    the last one predicted: where wrinkles come and go a line search on the energy crawls from kink to
    kink. Where one of an eighth of the regular size fails, film buckles: there the balloon goes over to
    another equilibrium by damped motion (`lobefem.equilibrium.gradient_flow`; a film without an energy
    cannot), and the increment's `damping` says what that took of the energy.

    Args:
        start: equilibrium of the free balloon, or of one under the same kind of distortion: from
            there the ramp goes on, or back.
        distortion: what to impose.
        begin: the parameter at which the start is, where it cannot say so itself: a state of the free
            balloon read from a file (see `release_start`).
        steps: increments of the whole ramp, if none fails.
        first: size of the first increment as a share of the others. A pressurised stack resists most
            at first.
        options: of Newton's method.
        on_step: called with each increment and its equilibrium, on all ranks.
        progress: called with a line of text after each solve.

    Raises:
        InputError: the balloon cannot be distorted so, or is under another distortion.
        ConvergenceError: an increment of `options.min_step` failed; `state` is the last equilibrium and
            `data` holds its `parameter` and the `history`.

    Collective.
    """
    checks.having("start", start, "balloon", "a state, from inflate")
    checks.having("options", options, "petsc_options", "NewtonOptions(...)")
    require_distortion(distortion)
    checks.integer("steps", steps, 1)
    checks.positive("first", first, "")
    s = getattr(start, "parameter", 0.0) if begin is None else checks.finite("begin", begin, distortion.unit)
    balloon = constrain(start.balloon, distortion, start, s)
    q = _transfer(start, balloon, s)
    with petsc.options(PREFIX, options.petsc_options):
        ramp = Ramp(balloon, q, options, (distortion.kind, distortion.unit), progress)
        try:
            state = ramp.run(start, distortion.parameter, steps, first, on_step)
            return Distorted(distortion, state, tuple(ramp.history))
        finally:
            ramp.destroy()


def constrain(
    balloon: Balloon, distortion: Distortion, start: State | None = None, parameter: float = 0.0
) -> Balloon:
    """The balloon under a distortion, at the parameter 0: the same film with another map. Collective.

    Args:
        balloon: free, or under a distortion of the same kind.
        distortion: what to impose.
        start: a state of the free balloon, from which a distortion counts that need not count from rest.
        parameter: where that state is.

    Raises:
        InputError: it cannot be distorted so, or is under another distortion.
    """
    distortion.check(balloon)
    if balloon.prescribed is None:
        motion = distortion.prescribed(balloon)
        if start is not None:
            motion = distortion.begin(motion, start.displacement, parameter)
        return balloon.with_prescribed(motion)
    if balloon.prescribed.kind != distortion.kind:
        raise InputError(f"the balloon is under a {balloon.prescribed.kind}; release it before {distortion}")
    return balloon


def _transfer(state: Equilibrium, balloon: Balloon, parameter: float) -> Any:
    """The q of a balloon with the displacement of a state of the same film, under a guide or free of it."""
    old = state.balloon
    for one in (old, balloon):
        if one.prescribed is not None:
            one.prescribed.parameter = parameter
    old.set_loads(state.pressure, state.prestress)
    old.set_unknowns(state.vector())
    return balloon.unknowns_of(old)


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
