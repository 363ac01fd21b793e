"""Seeds of clefts on all gores of a pumpkin: harmonics of its tendons, and a gap along an S line.

Both move tendons and leave the film between them to itself. In the mode of harmonic m in which a pumpkin
turns unstable, groups of its tendons go up and others down, and above and below the equator they move
around the axis to opposite sides, by a sin(m theta) sin(2 pi s/L): lines of closed gores have the shape of
an S. An S-cleft is what flights have shown: a few gores pulled in along a line that winds around the axis
from one fitting to the other.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from lobefem import checks
from lobefem.equilibrium.distortions import Distortion
from lobefem.errors import InputError
from lobefem.fem.balloon import Balloon
from lobefem.fem.prescribed_motion import PrescribedMotion, PushedNodes, WaveMotion
from lobefem.typing import Array, Indices

__all__ = ["Cleft", "HarmonicSeed"]


class _OfTendons(Distortion):
    """A distortion that pushes the nodes of tendons."""

    unit: ClassVar[str] = "m"
    reaction_unit: ClassVar[str] = "N"

    def check(self, balloon: Balloon) -> None:
        """Refuse what is no pumpkin with all its gores."""
        if balloon.motion is None or not hasattr(balloon.surface.recipe, "gore"):
            raise InputError(f"{self} is one of a pumpkin's tendons; use bend, twist or wave")
        if balloon.surface.copies > 1:
            raise InputError(f"{self} is one of all gores, and this is one of them; use full_state")

    def prescribed(self, balloon: Balloon) -> PrescribedMotion:
        """A `WaveMotion` of the tendons' nodes. Collective."""
        assert balloon.motion is not None  # by `check`
        names = (f"tendon_{k + 1}" for k in range(balloon.surface.num_lobes))
        found = np.unique(np.concatenate([balloon.edge_nodes(name) for name in names]))
        rims = np.concatenate([balloon.edge_nodes(name) for name in ("rim_bottom", "rim_top")])
        owned = balloon.V.dofmap.index_map.size_local
        nodes: Indices = np.setdiff1d(found[found < owned], rims).astype(np.int32)
        angle, _, _, frames = balloon.axis.cylindrical(balloon.X[nodes])
        curve = _gore(balloon).curve
        s = np.linspace(0.0, curve.arc_length, 20001)
        # gores are meshed with the curve's own z
        along = np.interp(balloon.X[nodes] @ balloon.motion.direction, curve.z(s), s / curve.arc_length)
        push, first = self._push(balloon, angle, along)
        pushed = np.flatnonzero(np.abs(push) > 1e-6)
        # the axis along which a node is pushed first; on the others it is free
        frames = np.roll(frames, -first, axis=1)
        return WaveMotion(
            balloon.motion,
            self.kind,
            PushedNodes(nodes[pushed], frames[pushed], push[pushed], np.zeros(len(pushed))),
        )

    def begin(self, motion: PrescribedMotion, displacement: Array, parameter: float) -> PrescribedMotion:
        """The motion that counts from where the pressure has moved the tendons to."""
        pushed = motion.pushed
        assert pushed is not None
        now = np.einsum("nj,nj->n", displacement[pushed.nodes], pushed.frames[:, 0])
        motion.pushed = replace(pushed, first=now - parameter * pushed.linear)
        return motion

    @abstractmethod
    def _push(self, balloon: Balloon, angle: Array, along: Array) -> tuple[Array, int]:
        """Displacement of nodes per unit of the parameter, and its direction: 0 outwards, 1 around."""


@dataclass(frozen=True)
class HarmonicSeed(_OfTendons):
    """Tendons move around the axis by a sin(m theta) sin(2 pi s/L), s along them; else they are free.

    Args:
        n: harmonic m, at least 2 and at most half the number of gores.
        amplitude: a [m]; the reaction is the force conjugate to it [N].
    """

    n: int
    amplitude: float

    def __post_init__(self) -> None:
        checks.integer("the seed's harmonic", self.n, 2)
        checks.finite("the seed's amplitude", self.amplitude, "m")

    @property
    def parameter(self) -> float:
        """The amplitude [m]."""
        return self.amplitude

    @property
    def kind(self) -> str:
        """With its m."""
        return f"harmonic seed of m = {self.n}"

    def check(self, balloon: Balloon) -> None:
        """Refuse a harmonic that the tendons do not have, and an amplitude at which they would meet."""
        super().check(balloon)
        gores, curve = balloon.surface.num_lobes, _gore(balloon).curve
        if 2 * self.n > gores:
            raise InputError(f"{self}: {gores} gores have harmonics up to {gores // 2}; give a lower one")
        chord = 2 * float(curve.radius(curve.arc_length / 4)) * math.sin(math.pi / gores)
        closing = 2 * abs(self.amplitude) * math.sin(math.pi * self.n / gores)
        if closing >= chord:
            raise InputError(
                f"{self} would close a gore of {chord:.3g} m by {closing:.3g} m; give an amplitude below "
                f"{chord / closing * abs(self.amplitude):.3g} m"
            )

    def _push(self, balloon: Balloon, angle: Array, along: Array) -> tuple[Array, int]:
        return np.sin(self.n * angle) * np.sin(2 * math.pi * along), 1


@dataclass(frozen=True)
class Cleft(_OfTendons):
    """Tendons along an S line are pulled in towards the axis; sideways they are free.

    The line's azimuth is (turn/2) sin(pi (t - 1/2)), t from 0 at the bottom of a tendon to 1 at its top.
    Tendons less than half the width away from it are pulled in by depth cos^2, most at half their length.

    Args:
        depth: of the middle tendon [m], positive inwards; the reaction is the force conjugate to it [N].
        width: angle of the cleft around the axis [degrees].
        turn: angle between the line's ends [degrees]; 0 is a straight cleft.
    """

    depth: float
    width: float = 45.0
    turn: float = 90.0

    kind: ClassVar[str] = "cleft"

    def __post_init__(self) -> None:
        checks.finite("the cleft's depth", self.depth, "m")
        checks.finite("the cleft's turn", self.turn, "degrees")
        if not 0 < checks.finite("the cleft's width", self.width, "degrees") <= 180:
            raise InputError(f"the cleft's width is {self.width} degrees; give one above 0, up to 180")

    @property
    def parameter(self) -> float:
        """The depth [m]."""
        return self.depth

    def check(self, balloon: Balloon) -> None:
        """Refuse a depth beyond the axis, and a width without a tendon."""
        super().check(balloon)
        gores, radius = balloon.surface.num_lobes, _gore(balloon).curve.R0
        if abs(self.depth) >= radius:
            raise InputError(f"{self} reaches the axis; give a depth below {radius:g} m")
        if self.width < 720 / gores:
            raise InputError(
                f"{self} has less than two gores of {gores}; give a width of {720 / gores:g} degrees or more"
            )

    def _push(self, balloon: Balloon, angle: Array, along: Array) -> tuple[Array, int]:
        line = math.radians(self.turn) / 2 * np.sin(math.pi * (along - 0.5))
        off = np.angle(np.exp(1j * (angle - line))) / math.radians(self.width)  # -1/2 to 1/2 within it
        inside = np.abs(off) < 0.5
        return -np.where(inside, np.cos(math.pi * off) ** 2, 0.0) * np.sin(math.pi * along), 0


def _gore(balloon: Balloon) -> Any:
    recipe: Any = balloon.surface.recipe
    return recipe.gore
