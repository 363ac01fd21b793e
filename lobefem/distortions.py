"""`distort`: a balloon's shape changed by a temporary constraint, and `release_start` without it.

Paper sec. 6: pressurise, distort, release. A distortion has one parameter, ramped in increments; at
each the balloon is in equilibrium under the constraint, and the force that this takes is returned.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from lobefem import checks
from lobefem._snes import REASONS, Newton
from lobefem.balloon import Balloon
from lobefem.equilibrium import Equilibrium, Progress, record
from lobefem.errors import ConvergenceError, InputError
from lobefem.guides import BendGuide, Guide, PushedNodes, TipGuide, TwistGuide, WaveGuide
from lobefem.harmonics import cylindrical
from lobefem.log import logger
from lobefem.plates import PlateMotion

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


class Distortion(ABC):
    """What is imposed, with its amount.

    Attributes:
        parameter: the amount [`unit`].
        unit: "m" or "rad".
        reaction_unit: of the conjugate force, "N" or "N m".
        kind: in words; two distortions of one kind differ in their amount alone.
    """

    unit: ClassVar[str]
    reaction_unit: ClassVar[str]

    @property
    @abstractmethod
    def parameter(self) -> float:
        """The amount, in `unit`."""

    @property
    @abstractmethod
    def kind(self) -> str:
        """In words, such as "bend"."""

    @abstractmethod
    def guide(self, balloon: Balloon) -> Guide:
        """What leads the balloon, at the parameter 0. Collective."""

    def check(self, balloon: Balloon) -> None:
        """Refuse a balloon that cannot be distorted so, on all ranks, with an InputError."""
        if balloon.motion is None:
            raise InputError(f"{self} needs a balloon with EndPlates")
        if not balloon.motion.moving:
            raise InputError(f"{self} needs a top plate that moves; use support 'clamped' or 'pinned'")


@dataclass(frozen=True)
class Tip(Distortion):
    """The top centre is pushed sideways, along x (paper fig. 21a); plate and bar turn freely.

    Args:
        displacement: delta [m]; the reaction is the force along x [N].
    """

    displacement: float
    unit: ClassVar[str] = "m"
    reaction_unit: ClassVar[str] = "N"
    kind: ClassVar[str] = "tip displacement"

    def __post_init__(self) -> None:
        checks.finite("the tip's displacement", self.displacement, "m")

    @property
    def parameter(self) -> float:
        """The displacement [m]."""
        return self.displacement

    def check(self, balloon: Balloon) -> None:
        """Refuse plates that cannot move, and a displacement that a rigid bar does not reach."""
        super().check(balloon)
        motion = balloon.motion
        if motion is not None and motion.rigid_bar and abs(self.displacement) >= motion.length:
            raise InputError(
                f"the tip's displacement is {self.displacement} m; give less than the bar's "
                f"{motion.length:g} m"
            )

    def guide(self, balloon: Balloon) -> Guide:
        """A `TipGuide`."""
        return TipGuide(_motion(balloon))


@dataclass(frozen=True)
class Bend(Distortion):
    """The axis bent to an arc whose chord keeps its length, in the x-z plane (paper fig. 21b).

    Hoops stay circular, normal to the axis and at even steps along it, as do the plates. The end
    plates turn by -psi and psi; a clamped bottom plate stays and the top one turns by 2 psi.

    Args:
        degrees: half-angle psi of the arc [degrees], less than 90; the reaction is the moment
            conjugate to psi [N m].
    """

    degrees: float
    unit: ClassVar[str] = "rad"
    reaction_unit: ClassVar[str] = "N m"
    kind: ClassVar[str] = "bend"

    def __post_init__(self) -> None:
        _below("the bend's half-angle", self.degrees, 90)

    @property
    def parameter(self) -> float:
        """The angle [rad]."""
        return math.radians(self.degrees)

    def guide(self, balloon: Balloon) -> Guide:
        """A `BendGuide` of all seams."""
        motion, lobes = _motion(balloon), balloon.surface.num_lobes
        heights = motion.length * np.arange(1, lobes) / lobes
        centres = motion.centres[0] + heights[:, None] * motion.direction
        return BendGuide(motion, tuple(f"seam_{k}" for k in range(1, lobes)), centres)


@dataclass(frozen=True)
class Twist(Distortion):
    """The top plate is turned about the axis; it may tilt.

    Args:
        degrees: angle [degrees], less than 360; the reaction is the moment [N m].
    """

    degrees: float
    unit: ClassVar[str] = "rad"
    reaction_unit: ClassVar[str] = "N m"
    kind: ClassVar[str] = "twist"

    def __post_init__(self) -> None:
        _below("the twist", self.degrees, 360)

    @property
    def parameter(self) -> float:
        """The angle [rad]."""
        return math.radians(self.degrees)

    def guide(self, balloon: Balloon) -> Guide:
        """A `TwistGuide`."""
        return TwistGuide(_motion(balloon))


@dataclass(frozen=True)
class Wave(Distortion):
    """Each lobe's equator is displaced outwards by a cos(n theta); its nodes slide sideways freely.

    The seams are left alone: a wave there would have to stretch the hoops. So that the film is not
    stretched either, the equator, a circle of radius R, shrinks by a^2 (n^2 - 1)^2/(4 n^2 R): its length
    is kept to second order.

    Args:
        n: circumferential harmonic; 0 is a swelling, without the shrinkage.
        amplitude: a [m]; the reaction is the force conjugate to it [N].
    """

    n: int
    amplitude: float
    unit: ClassVar[str] = "m"
    reaction_unit: ClassVar[str] = "N"

    def __post_init__(self) -> None:
        checks.integer("the wave's n", self.n, 0)
        checks.finite("the wave's amplitude", self.amplitude, "m")

    @property
    def parameter(self) -> float:
        """The amplitude [m]."""
        return self.amplitude

    @property
    def kind(self) -> str:
        """With its n."""
        return f"wave of n = {self.n}"

    def check(self, balloon: Balloon) -> None:
        """Refuse a mesh without nodes on the equators, or too coarse for n."""
        if balloon.motion is None:
            raise InputError(f"{self} needs a balloon with EndPlates")
        divisions = balloon.surface.divisions
        if divisions is None or divisions[0] * balloon.order % 2:
            raise InputError(
                f"{self} needs nodes on the lobes' equators; use a structured mesh with an even number "
                "of divisions along the meridian"
            )
        if 2 * self.n > divisions[1] * balloon.order:
            raise InputError(
                f"{self} is too short for {divisions[1]} divisions around the axis; try {4 * self.n} of them"
            )

    def guide(self, balloon: Balloon) -> Guide:
        """A `WaveGuide` of the equators' nodes. Collective."""
        motion, n = _motion(balloon), self.n
        angle, height, frames = cylindrical(balloon)
        lobe = motion.length / balloon.surface.num_lobes
        above = (height - motion.centres[0] @ motion.direction) / lobe - 0.5  # the lowest equator, in lobes
        nodes = np.flatnonzero(np.abs(above - np.round(above)) < 1e-6).astype(np.int32)
        x = balloon.V.tabulate_dof_coordinates()[nodes]
        radius = np.einsum("nj,nj->n", x, frames[nodes, 0])
        shrink = (n**2 - 1) ** 2 / (4 * n**2 * radius) if n else np.zeros_like(radius)
        pushed = PushedNodes(nodes, frames[nodes], np.cos(n * angle[nodes]), -shrink)
        return WaveGuide(motion, self.kind, pushed)


def _motion(balloon: Balloon) -> PlateMotion:
    assert balloon.motion is not None  # by `Distortion.check`
    return balloon.motion


def _below(name: str, value: float, limit: float) -> None:
    if abs(checks.finite(name, value, "degrees")) >= limit:
        raise InputError(f"{name} is {value} degrees; give less than {limit}")


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
            progress(say)
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
