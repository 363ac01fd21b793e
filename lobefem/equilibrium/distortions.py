"""Distortions to impose on a balloon: a push on its tip, a bend, a twist, a wave (paper sec. 6)."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from lobefem import checks
from lobefem.errors import InputError
from lobefem.fem.balloon import Balloon
from lobefem.fem.prescribed_motion import (
    BendMotion,
    PrescribedMotion,
    PushedNodes,
    TipMotion,
    TwistMotion,
    WaveMotion,
)
from lobefem.fem.rigid_plates import PlateMotion
from lobefem.typing import Array, Unchecked

__all__ = ["Bend", "Distortion", "Tip", "Twist", "Wave", "require_distortion"]


class Distortion(ABC):
    """A distortion with its amount.

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
    def prescribed(self, balloon: Balloon) -> PrescribedMotion:
        """The prescribed motion, at the parameter 0. Collective."""

    def begin(self, motion: PrescribedMotion, displacement: Array, parameter: float) -> PrescribedMotion:
        """The prescribed motion that is at a parameter where the film is; by default as it is.

        Args:
            motion: of `prescribed`.
            displacement: nodal displacements, ghosts included, (nodes, 3) [m].
            parameter: s there.
        """
        return motion

    def check(self, balloon: Balloon) -> None:
        """Refuse a balloon that cannot be distorted so, on all ranks, with an InputError."""
        if balloon.motion is None:
            raise InputError(f"{self} needs a balloon with EndPlates")
        if not balloon.motion.moving:
            raise InputError(f"{self} needs a top plate that moves; use support 'clamped' or 'pinned'")


def require_distortion(distortion: Unchecked) -> None:
    """Refuse what is no distortion, or the class of one, with an InputError."""
    if not isinstance(distortion, Distortion):
        told = f"the class {distortion.__name__}" if isinstance(distortion, type) else repr(distortion)
        raise InputError(f"distortion is {told}; give one such as Tip(0.1)")


@dataclass(frozen=True)
class Tip(Distortion):
    """The top centre is pushed sideways, along x (paper fig. 21a); plate and bar turn freely.

    Here and below x, y, z are a balloon's on the z axis; on another one e1, e2, e3 of
    `lobefem.fem.prescribed_motion`.

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

    def prescribed(self, balloon: Balloon) -> PrescribedMotion:
        """A `TipMotion`."""
        return TipMotion(_motion(balloon))


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

    def check(self, balloon: Balloon) -> None:
        """Refuse plates that cannot move, and lobes without the seams that are to lie on the arc."""
        super().check(balloon)
        if hasattr(balloon.surface.recipe, "gore"):
            raise InputError(
                f"{self} needs seams, and the gores of a pumpkin have none; use --harmonic-seed or --cleft"
            )

    def prescribed(self, balloon: Balloon) -> PrescribedMotion:
        """A `BendMotion` of all seams."""
        motion, lobes = _motion(balloon), balloon.surface.num_lobes
        heights = motion.length * np.arange(1, lobes) / lobes
        centres = motion.centres[0] + heights[:, None] * motion.direction
        return BendMotion(motion, tuple(f"seam_{k}" for k in range(1, lobes)), centres)


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

    def prescribed(self, balloon: Balloon) -> PrescribedMotion:
        """A `TwistMotion`."""
        return TwistMotion(_motion(balloon))


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

    def prescribed(self, balloon: Balloon) -> PrescribedMotion:
        """A `WaveMotion` of the equators' nodes. Collective."""
        motion, n = _motion(balloon), self.n
        owned = balloon.V.dofmap.index_map.size_local
        angle, height, radius, frames = balloon.axis.cylindrical(balloon.X[:owned])
        lobe = motion.length / balloon.surface.num_lobes
        bottom = (motion.centres[0] - balloon.axis.origin) @ motion.direction
        above = (height - bottom) / lobe - 0.5  # the lowest equator, in lobes
        nodes = np.flatnonzero(np.abs(above - np.round(above)) < 1e-6).astype(np.int32)
        radius = radius[nodes]
        shrink = (n**2 - 1) ** 2 / (4 * n**2 * radius) if n else np.zeros_like(radius)
        pushed = PushedNodes(nodes, frames[nodes], np.cos(n * angle[nodes]), -shrink)
        return WaveMotion(motion, self.kind, pushed)


def _motion(balloon: Balloon) -> PlateMotion:
    assert balloon.motion is not None  # by `Distortion.check`
    return balloon.motion


def _below(name: str, value: float, limit: float) -> None:
    if abs(checks.finite(name, value, "degrees")) >= limit:
        raise InputError(f"{name} is {value} degrees; give less than {limit}")
