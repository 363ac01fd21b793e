"""Film laws, each one an energy per reference area in terms of the Green-Lagrange strain.

A law declares what it can do, and is asked: whether it has an energy, which tangents it has where it pulls
one way alone, which shares of the isotropic stiffness are left there.

Strains are 2x2 in the film's frame (first axis the meridian, second the hoop); energies are in
J/m^2 and stress resultants N = stress x thickness in N/m. Material numbers reach the energy through
`number`, by default `float`; a `Balloon` passes one that makes UFL constants, so that a compiled form
serves every material.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

from lobefem import checks
from lobefem.errors import InputError
from lobefem.typing import Expr, Scalar, Unchecked

import ufl

__all__ = ["Film", "Isotropic", "require_energy", "require_film", "require_one_tangent", "require_pressure"]

Number = Callable[[float], Any]

_ROUND_OFF = 1e-9  # of a principal stress, over the other one


@dataclass(frozen=True)
class Film(ABC):
    """A thin elastic film.

    Args:
        E: Young's modulus [Pa], a number; of laws that allow it also a function on the surface's mesh, or
            another scalar in UFL.
        nu: Poisson's ratio, -1 < nu <= 0.5.
        thickness: film thickness t [m], as E.

    Raises:
        InputError: a number out of its range, or a function where the law takes numbers only.

    Collective if given functions.
    """

    E: float = 3.5e9
    nu: float = 0.3
    thickness: float = 5e-5

    def __post_init__(self) -> None:
        self._check("E", "Pa")
        self._check("thickness", "m")
        if not -1 < checks.finite("film nu", self.nu, "") <= 0.5:
            raise InputError(f"film nu = {self.nu} must lie in (-1, 0.5]; plastics have 0.3 to 0.5")

    # as a design file has it
    name: ClassVar[str] = ""
    # whether the stress is the gradient of `energy`
    has_energy: ClassVar[bool] = True
    # whether it can be pressed, so that it carries pressure from outside
    bears_compression: ClassVar[bool] = True
    # whether wrinkles turn with the strain: the shear stiffness depends on the stress then
    turns: ClassVar[bool] = False
    # whether unstrained film has a tangent
    has_tangent_at_rest: ClassVar[bool] = True
    # whether the law leads from unstressed film to a stress that another one takes over, by `removed_strain`
    leads_to_stress: ClassVar[bool] = False
    # whether the law knows a direction of its own, so that its strain varies with the frame
    directional: ClassVar[bool] = False
    # whether residuals come from `stress`, written with a modulus matrix, not from `energy`
    by_stress: ClassVar[bool] = False
    # whether E and thickness may vary over the film
    may_vary: ClassVar[bool] = False

    def _check(self, name: str, unit: str) -> None:
        """Refuse a modulus or thickness that is not positive, or varies where the law has no place for it."""
        value: Any = getattr(self, name)
        if not isinstance(value, ufl.core.expr.Expr):
            checks.positive(f"film {name}", value, unit)
            return
        if not self.may_vary:
            raise InputError(
                f"film {name} is a function, and {type(self).__name__} film takes a number; use "
                "TensionField or Isotropic film, or an average"
            )
        if value.ufl_shape:
            raise InputError(f"film {name} has the shape {value.ufl_shape}; give a scalar function [{unit}]")
        if hasattr(value, "x"):
            bad = int((~(value.x.array > 0)).sum())
            if value.function_space.mesh.comm.allreduce(bad):
                raise InputError(f"film {name} is not positive everywhere; give a function above 0 [{unit}]")

    @property
    def varying(self) -> tuple[Any, ...]:
        """Those of modulus and thickness that vary over the film."""
        return tuple(v for v in (self.E, self.thickness) if isinstance(v, ufl.core.expr.Expr))

    @property
    def Et(self) -> float:
        """Membrane stiffness E t [N/m]."""
        return self.E * self.thickness

    @property
    def shares(self) -> tuple[float, float] | None:
        """Shares of the isotropic hoop and shear stiffness in film that pulls along the meridian alone.

        Of a law with one-sided tangents there, those of the wrinkled one. None where there are none.
        """
        return None

    @property
    def one_sided(self) -> tuple[Film, Film, Film] | None:
        """Laws with the wrinkled, the mean and the taut tangent of film that pulls one way alone.

        None for a law with one tangent there.
        """
        return None

    @abstractmethod
    def energy(self, strain: Expr, number: Number = float) -> Any:
        """Strain energy per reference area [J/m^2] of a 2x2 strain in the film's frame.

        None for a law whose stress is no energy's gradient.
        """

    def stress(self, strain: Expr, number: Number = float) -> Any:
        """Stress resultants S = dw/dE [N/m], 2x2 in the film's frame (second Piola-Kirchhoff)."""
        strain = ufl.variable(strain)
        return ufl.sym(ufl.diff(self.energy(strain, number), strain))

    def prestrain(self, resultant: Expr, number: Number = float, hoop_slack: float = 0.0) -> Any:
        """The strain E0 (2x2) that carries the meridional `resultant` [N/m] with no hoop stress.

        E0 = diag(N/(E t), -nu N/(E t) - s), s >= 0 the hoop slack (paper sec. 4.1, initial stress).
        """
        e = resultant / number(self.Et)
        slack = number(hoop_slack) if hoop_slack else 0
        return ufl.as_matrix([[e, 0], [0, -number(self.nu) * e - slack]])

    def regions(self, strain: Expr, number: Number = float) -> tuple[Any, Any, Any]:
        """Indicators (1 or 0) of taut, wrinkled and slack film at a strain.

        Paper sec. 4: taut where the minor principal stress of the isotropic law is positive,
        slack where no principal strain is, wrinkled in between. Film that pulls one way alone, as in the
        ideal isotensoid, is on the border, and wrinkled: round-off does not decide.
        """
        e1, e2 = _principal(strain)
        taut = ufl.conditional(ufl.ge(e2 + number(self.nu) * e1, _ROUND_OFF * abs(e1)), 1.0, 0.0)
        slack = ufl.conditional(ufl.le(e1, 0), 1.0, 0.0) * (1 - taut)
        return taut, 1 - taut - slack, slack


def _principal(strain: Expr) -> tuple[Any, Any]:
    """Principal values of a symmetric 2x2 tensor, major first."""
    mean = (strain[0, 0] + strain[1, 1]) / 2
    radius = ufl.sqrt(((strain[0, 0] - strain[1, 1]) / 2) ** 2 + strain[0, 1] ** 2)
    return mean + radius, mean - radius


def _plane_stress(strain: Expr, stiffness: Scalar, nu: Scalar) -> Any:
    """Plane-stress St Venant-Kirchhoff energy, C/2 [(1-nu) E:E + nu tr(E)^2], C = E t/(1-nu^2)."""
    trace = strain[0, 0] + strain[1, 1]
    square = strain[0, 0] ** 2 + strain[1, 1] ** 2 + 2 * strain[0, 1] ** 2
    return stiffness / (2 * (1 - nu**2)) * ((1 - nu) * square + nu * trace**2)


@dataclass(frozen=True)
class Isotropic(Film):
    """Plane-stress St Venant-Kirchhoff film, in tension and in compression (paper eq. 10)."""

    name: ClassVar[str] = "isotropic"
    may_vary: ClassVar[bool] = True

    @property
    def shares(self) -> tuple[float, float]:
        """All of it."""
        return 1.0, 1.0

    def energy(self, strain: Expr, number: Number = float) -> Any:
        """E t/(2(1 - nu^2)) [(1 - nu) E:E + nu (tr E)^2]."""
        return _plane_stress(strain, number(self.Et), number(self.nu))


def _check_share(share: float) -> None:
    if not 0 <= checks.finite("slack_stiffness", share, "") < 1:
        raise InputError(
            f"slack_stiffness = {share} must lie in [0, 1); 1e-6 is usual, 1e-4 helps convergence"
        )


def require_film(film: Unchecked) -> None:
    """Refuse what is no film law, or the class of one, with an InputError."""
    if isinstance(film, type) and issubclass(film, Film):
        raise InputError(f"film is the class {film.__name__}; make one of it, {film.__name__}()")
    if not isinstance(film, Film):
        raise InputError(f"film is {film!r}, which is no film law; give one, such as TensionField()")


def require_energy(film: Film) -> None:
    """Refuse film without an energy where a ledger of it is kept, with an InputError."""
    if not film.has_energy:
        raise InputError(
            f"{type(film).__name__} film has no energy to balance in a perturbation or a release; use "
            "TensionField or IMP"
        )


def require_pressure(film: Film, pressure: float) -> None:
    """Refuse a gas pressure [Pa] that is no number, or suction on tension-only film, with an InputError."""
    if checks.finite("pressure", pressure, "Pa") < 0 and not film.bears_compression:
        raise InputError(
            f"pressure = {pressure} Pa is suction, which {type(film).__name__} film cannot carry; give 0 or "
            "more"
        )


def require_one_tangent(film: Film, hoop_slack: float) -> None:
    """Refuse film whose tangent jumps where it pulls one way alone, as in a held lobe, with an InputError."""
    if film.one_sided is not None and not hoop_slack:
        raise InputError(
            f"the ideal state of {type(film).__name__} film lies on the border of taut and wrinkled, where "
            "its tangent jumps; use one_sided_modes, one_sided_pressures or one_sided_charts of "
            "lobefem.stability.one_sided "
            "for bounds, or look at the inflated state"
        )
