"""Orthotropic film: plane-stress St Venant-Kirchhoff, and its relaxed tension-field energy.

With stretched coordinates along the material axes, e11 = a E11, e22 = E22/a, e12 = E12, a = (E1/E2)^(1/4),
the plane-stress energy becomes that of a film of one modulus and one Poisson's ratio,

    w = E t/(2(1 - nu^2)) (e11^2 + e22^2 + 2 nu e11 e22) + 2 G t e12^2,
    E = sqrt(E1 E2), nu = sqrt(nu12 nu21),

for nu12/E1 = nu21/E2. Only k = G/(E/(2(1 + nu))) tells it from an isotropic one: for k = 1 the relaxed
energy is the isotropic one in stretched strains. Stress goes with the inverse stretches, so that tension
in every direction, tension in one and no tension are the same states in both coordinates.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, ClassVar, NamedTuple

import numpy as np

from lobefem import checks
from lobefem.errors import InputError
from lobefem.model.film import Film, _check_share
from lobefem.typing import Expr, Scalar

import ufl

__all__ = ["Orthotropic", "OrthotropicTensionField"]

Number = Callable[[float], Any]

_ROUND_OFF = 1e-9  # of a principal stress, over the other one
# (fixed-point steps, Newton steps) for the direction of wrinkles, the cheapest first
_SCHEMES = ((1, 2), (2, 2), (2, 3), (4, 3), (8, 3))
_DIRECTION = 1e-13  # error of a direction [rad] that leaves no more than round-off in the stress


class _Stretched(NamedTuple):
    """A strain in stretched material axes by its mean, half its difference and its shear."""

    mean: Any
    difference: Any
    shear: Any


@dataclass(frozen=True, kw_only=True)
class Orthotropic(Film):
    """Plane-stress orthotropic St Venant-Kirchhoff film, in tension and in compression.

    Args:
        E1: Young's modulus along the first material axis [Pa].
        E2: Young's modulus along the second one [Pa].
        nu12: contraction along the second axis over the stretch along the first, under tension along the
            first; nu21 = nu12 E2/E1. Either may exceed 0.5 as long as nu12 nu21 < 1.
        G12: shear modulus [Pa]; by default Huber's E/(2(1 + nu)), E = sqrt(E1 E2), nu = sqrt(nu12 nu21).
        thickness: film thickness t [m].
        angle: of the first material axis from the frame's first (the meridian) to its second (the hoop)
            [rad].

    Attributes:
        E, nu: those of the film in stretched coordinates, E = sqrt(E1 E2) [Pa], |nu| = sqrt(nu12 nu21).

    Raises:
        InputError: a number out of its range.
    """

    E1: float = 3.5e9
    E2: float = 3.5e9
    nu12: float = 0.3
    G12: float | None = None
    thickness: float = 5e-5
    angle: float = 0.0
    E: float = field(init=False, repr=False, compare=False)
    nu: float = field(init=False, repr=False, compare=False)

    name: ClassVar[str] = "orthotropic"
    directional: ClassVar[bool] = True

    def __post_init__(self) -> None:
        checks.positive("film E1", self.E1, "Pa")
        checks.positive("film E2", self.E2, "Pa")
        checks.positive("film thickness", self.thickness, "m")
        checks.finite("film nu12", self.nu12, "")
        checks.finite("the angle of the film's first axis", self.angle, "rad")
        if self.G12 is not None:
            checks.positive("film G12", self.G12, "Pa")
        product = self.nu12 * self.nu21
        if product >= 1 or min(self.nu12, self.nu21) <= -1:
            raise InputError(
                f"film nu12 = {self.nu12} gives nu21 = nu12 E2/E1 = {self.nu21:.4g} and their product "
                f"{product:.4g}; it must be below 1, and both above -1"
            )
        object.__setattr__(self, "E", math.sqrt(self.E1 * self.E2))
        object.__setattr__(self, "nu", math.copysign(math.sqrt(product), self.nu12))

    @property
    def nu21(self) -> float:
        """Poisson's ratio under tension along the second axis, nu12 E2/E1."""
        return self.nu12 * self.E2 / self.E1

    @property
    def shear_ratio(self) -> float:
        """G12 over Huber's estimate E/(2(1 + nu))."""
        return 1.0 if self.G12 is None else self.G12 * 2 * (1 + self.nu) / self.E

    def energy(self, strain: Expr, number: Number = float) -> Any:
        """t/(2(1 - nu12 nu21)) (E1 E11^2 + E2 E22^2 + 2 nu21 E1 E11 E22) + 2 G12 t E12^2."""
        return self._full(self._stretched(strain, number), number)

    def prestrain(self, resultant: Expr, number: Number = float, hoop_slack: float = 0.0) -> Any:
        """The strain that carries the meridional `resultant` [N/m] with no hoop stress, less the slack.

        S : N m m; for material axes along the frame's diag(N/(E1 t), -nu12 N/(E1 t) - s).
        """
        c, s = math.cos(self.angle), math.sin(self.angle)
        G = self.shear_ratio * self.E / (2 * (1 + self.nu))
        e11 = c**2 / self.E1 - s**2 * self.nu21 / self.E2
        e22 = s**2 / self.E2 - c**2 * self.nu12 / self.E1
        e12 = -c * s / (2 * G)
        along = e11 * c**2 + e22 * s**2 - 2 * e12 * c * s
        across = e11 * s**2 + e22 * c**2 + 2 * e12 * c * s
        shear = (e11 - e22) * c * s + e12 * (c**2 - s**2)
        mm, hh, mh = (resultant * number(value / self.thickness) for value in (along, across, shear))
        return ufl.as_matrix([[mm, mh], [mh, hh - (number(hoop_slack) if hoop_slack else 0)]])

    def regions(self, strain: Expr, number: Number = float) -> tuple[Any, Any, Any]:
        """Indicators (1 or 0) of taut, wrinkled and slack film at a strain.

        Taut where the minor principal stress of the plain law is positive, slack where no principal
        strain is, wrinkled in between. Film that pulls one way alone is on the border, and wrinkled:
        round-off does not decide.
        """
        m, d, q = self._stretched(strain, number)
        nu, ratio = number(self.nu), number(self.shear_ratio)
        deviator = (1 - nu) * ufl.sqrt(d**2 + (ratio * q) ** 2)
        pull = (1 + nu) * m
        taut = ufl.conditional(ufl.ge(pull - deviator, _ROUND_OFF * abs(pull + deviator)), 1.0, 0.0)
        slack = ufl.conditional(ufl.le(m + ufl.sqrt(d**2 + q**2), 0), 1.0, 0.0) * (1 - taut)
        return taut, 1 - taut - slack, slack

    def _stretched(self, strain: Expr, number: Number) -> _Stretched:
        """The strain in stretched material axes."""
        E11, E22, E12 = strain[0, 0], strain[1, 1], strain[0, 1]
        if self.angle:
            c, s = number(math.cos(2 * self.angle)), number(math.sin(2 * self.angle))
            mean, half = (E11 + E22) / 2, (E11 - E22) / 2
            turned = c * half + s * E12
            E11, E22, E12 = mean + turned, mean - turned, c * E12 - s * half
        if self.E1 == self.E2:
            return _Stretched((E11 + E22) / 2, (E11 - E22) / 2, E12)
        stretch = number((self.E1 / self.E2) ** 0.25)
        e11, e22 = stretch * E11, E22 / stretch
        return _Stretched((e11 + e22) / 2, (e11 - e22) / 2, E12)

    def _full(self, strain: _Stretched, number: Number) -> Any:
        """E t/(1 - nu^2) ((1 + nu) m^2 + (1 - nu)(d^2 + k q^2))."""
        m, d, q = strain
        nu, ratio = number(self.nu), number(self.shear_ratio)
        return number(self.Et) / (1 - nu**2) * ((1 + nu) * m**2 + (1 - nu) * (d**2 + ratio * q**2))


@dataclass(frozen=True, kw_only=True)
class OrthotropicTensionField(Orthotropic):
    """Orthotropic film without compression, by its relaxed energy.

    Taut film (the plain law's stress is nowhere compressive) has the plain energy, slack film none, and
    wrinkled film the largest of <e(x)>^2/(2 S(x)) over all directions x, e(x) the strain along x and S(x)
    the compliance there: the energy that is left when the film may shorten across x at no cost. The
    direction starts at a fixed-point iteration and ends with Newton steps, all of them part of the energy;
    an inexact one would give a smaller energy, never a larger one.

    Args:
        slack_stiffness: share k of the plain energy that is blended in, (1 - k) w + k w_plain, so that
            slack film keeps a tangent; film in compression carries at most that share.

    Raises:
        InputError: also a shear modulus so far from Huber's that the direction is not found.
    """

    slack_stiffness: float = 1e-6

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_share(self.slack_stiffness)
        if _scheme(self.nu, self.shear_ratio) is None:
            huber = self.E / (2 * (1 + self.nu))
            raise InputError(
                f"film G12 = {self.G12:g} Pa is {self.shear_ratio:.3g} times Huber's {huber:.4g} Pa, and the "
                "direction of wrinkles cannot be followed so far from it; give 0.05 to 8 times"
            )

    # the stress leaves out how the direction turns, which counts for nothing where it is the best one, and
    # which would make the tangent's C code ten times as long
    by_stress: ClassVar[bool] = True
    bears_compression: ClassVar[bool] = False
    tangent: ClassVar[str] = "consistent"

    def energy(self, strain: Expr, number: Number = float) -> Any:
        """(1 - k) w + k w_plain."""
        return self._blend(strain, strain, number)

    def stress(self, strain: Expr, number: Number = float) -> Any:
        """Stress resultants [N/m]: the energy's gradient at the direction of tension, 2x2."""
        varied = ufl.variable(strain)
        return ufl.sym(ufl.diff(self._blend(varied, strain, number), varied))

    def _blend(self, strain: Expr, directing: Expr, number: Number) -> Any:
        """The energy, with the direction that belongs to the `directing` strain, and that one's state."""
        stretched, found = self._stretched(strain, number), self._stretched(directing, number)
        relaxed, plain = self._relaxed(stretched, found, number), self._full(stretched, number)
        if not self.slack_stiffness:
            return relaxed
        share = number(self.slack_stiffness)
        return (1 - share) * relaxed + share * plain

    def _relaxed(self, strain: _Stretched, directing: _Stretched, number: Number) -> Any:
        """The relaxed energy w, written state by state."""
        m, d, q = directing
        nu, ratio = number(self.nu), number(self.shear_ratio)
        square = d**2 + q**2
        # minor stress (1 + nu) m - (1 - nu) sqrt(d^2 + (k q)^2) >= 0, without the root: unstrained and
        # evenly strained film counts as taut, and the root's singular derivative is never reached
        taut = ufl.And(ufl.ge(m, 0), ufl.ge(((1 + nu) * m) ** 2, (1 - nu) ** 2 * (d**2 + (ratio * q) ** 2)))
        strained = ufl.Or(ufl.gt(m, 0), ufl.gt(square, m**2))  # major strain m + sqrt(d^2 + q^2) > 0
        wrinkled = ufl.And(ufl.Not(taut), strained)
        # untaken branches are evaluated too: there the direction is sought for pure stretch
        m, d, q = (ufl.conditional(wrinkled, a, b) for a, b in ((m, 0.0), (d, 1.0), (q, 0.0)))
        R = ufl.sqrt(d**2 + q**2)
        X, Y = _direction(m / R, d / R, q / R, nu, ratio, _scheme(self.nu, self.shear_ratio) or (), ufl.sqrt)
        compliance = 1 + _gamma(nu, ratio) * Y**2
        along = strain.mean + strain.difference * X + strain.shear * Y
        pulled = ufl.conditional(wrinkled, number(self.Et) / 2 * along**2 / compliance, 0.0)
        return ufl.conditional(taut, self._full(strain, number), pulled)


def _gamma(nu: Scalar, ratio: Scalar) -> Any:
    """The gamma of the directional compliance (1 + gamma sin^2 2x)/E of stretched film."""
    return (1 + nu) / 2 * (1 / ratio - 1)


def _direction(
    mean: Scalar,
    C: Scalar,
    S: Scalar,
    nu: Scalar,
    ratio: Scalar,
    scheme: tuple[int, ...],
    sqrt: Callable[[Scalar], Scalar],
) -> Any:
    """Cosine X and sine Y of twice the angle x of the tension of wrinkled film, in stretched axes.

    With the mean strain and the deviator (C, S) over the deviator's size, the strain along x is
    p = mean + C X + S Y, and x makes p^2/(1 + gamma Y^2) largest. A uniaxial stress 2 tau along x and a
    shortening a >= 0 across it add up to that strain where

        mean = (1 - nu) tau - a,   C/X : S/Y = (1 + nu) tau + a : (1 + nu) tau/k + a,

    a fixed-point iteration that starts at the major principal strain. Newton's steps are on the
    derivative of p^2/(1 + gamma Y^2); numbers may be NumPy's or UFL's.
    """
    gamma = _gamma(nu, ratio)
    X, Y = C, S
    fixed, newton = scheme or (0, 0)
    for _ in range(fixed):
        tau = (mean + C * X + S * Y) / (2 * (1 + gamma * Y**2))
        a = (1 - nu) * tau - mean
        a = (a + abs(a)) / 2
        X, Y = C * ((1 + nu) * tau / ratio + a), S * ((1 + nu) * tau + a)
        length = sqrt(X**2 + Y**2)
        X, Y = X / length, Y / length
    for _ in range(newton):
        h = _newton_step(mean, C, S, gamma, X, Y) / 2
        # turned by 2 arctan h, which is h's double to the second order
        X, Y = ((1 - h**2) * X - 2 * h * Y) / (1 + h**2), ((1 - h**2) * Y + 2 * h * X) / (1 + h**2)
    return X, Y


def _newton_step(mean: Scalar, C: Scalar, S: Scalar, gamma: Scalar, X: Scalar, Y: Scalar) -> Any:
    """Newton's step in 2x for 2 p' s - p s' = 0, which makes p^2/s stationary."""
    p, dp = mean + C * X + S * Y, S * X - C * Y
    s, ds, dds = 1 + gamma * Y**2, 2 * gamma * X * Y, 2 * gamma * (X**2 - Y**2)
    return (p * ds - 2 * dp * s) / (2 * (mean - p) * s + dp * ds - p * dds)


@lru_cache
def _scheme(nu: float, ratio: float) -> tuple[int, ...] | None:
    """The cheapest steps that find the direction of all wrinkled strains; None where none do.

    Film of Huber's shear modulus needs none: its direction is the principal strain's.
    """
    if abs(ratio - 1) < 1e-12:
        return ()
    gamma = _gamma(nu, ratio)
    twice = np.linspace(0, 2 * np.pi, 181)
    C, S = np.cos(twice), np.sin(twice)
    border = (1 - nu) / (1 + nu) * np.hypot(C, ratio * S)  # mean strain of film about to be taut
    mean = -1 + (border + 1) * np.linspace(0.01, 1, 40)[:, None]
    largest = np.zeros(mean.shape)
    for X, Y in zip(C, S, strict=True):
        np.maximum(largest, np.maximum(mean + C * X + S * Y, 0) ** 2 / (1 + gamma * Y**2), out=largest)
    for scheme in _SCHEMES:
        with np.errstate(all="ignore"):
            X, Y = _direction(mean, C, S, nu, ratio, scheme, np.sqrt)
            left = np.abs(_newton_step(mean, C, S, gamma, X, Y)).max()
            energy = (mean + C * X + S * Y) ** 2 / (1 + gamma * Y**2)
        if left < _DIRECTION and np.all(energy > (1 - 1e-9) * largest):  # NaN is neither
            return scheme
    return None
