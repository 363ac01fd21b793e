"""Tension-field film: the relaxed energy of film that wrinkles and carries no compression (paper eq. 11)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar

from lobefem.model.film import Film, Isotropic, Number, _check_share, _plane_stress, _principal
from lobefem.typing import Expr

import ufl

__all__ = ["TensionField", "WrinkledField"]


@dataclass(frozen=True)
class TensionField(Film):
    """Tension-only film by its relaxed energy (Pipkin 1986, Steigmann 1990).

    w = E t/2 <e1>^2 + E t/(2(1 - nu^2)) <e2 + nu e1>^2 in the principal strains e1 >= e2. Its gradient
    is the three-way test of Stein and Hedgepeth (paper eqs. 10-11): taut, wrinkled or slack. The
    energy is C1 only, so the tangent jumps between the three.

    Args:
        slack_stiffness: share k of the isotropic energy that is blended in, (1 - k) w + k w_iso, so
            that slack film keeps a tangent; film in compression carries at most that share.
    """

    slack_stiffness: float = 1e-6
    name: ClassVar[str] = "tension-field"
    bears_compression: ClassVar[bool] = False
    turns: ClassVar[bool] = True
    may_vary: ClassVar[bool] = True

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_share(self.slack_stiffness)

    @property
    def shares(self) -> tuple[float, float] | None:
        """`slack_stiffness` and all of the shear stiffness, on the wrinkled side."""
        return self.slack_stiffness, 1.0

    @property
    def one_sided(self) -> tuple[Film, Film, Film] | None:
        """Half of the isotropic energy blended into the wrinkled one has the mean of both tangents."""
        material: dict[str, Any] = {"E": self.E, "nu": self.nu, "thickness": self.thickness}
        wrinkled = WrinkledField(**material, slack_stiffness=self.slack_stiffness)
        return (
            wrinkled,
            replace(wrinkled, slack_stiffness=(1 + self.slack_stiffness) / 2),
            Isotropic(**material),
        )

    def energy(self, strain: Expr, number: Number = float) -> Any:
        """(1 - k) w + k w_iso."""
        relaxed = self._relaxed(strain, number)
        if not self.slack_stiffness:
            return relaxed
        share = number(self.slack_stiffness)
        isotropic = _plane_stress(strain, number(self.Et), number(self.nu))
        return (1 - share) * relaxed + share * isotropic

    def _relaxed(self, strain: Expr, number: Number) -> Any:
        """The relaxed energy w, written state by state.

        The taut state is the isotropic energy and needs no root: unstrained film, e1 = e2 = 0,
        counts as taut, and the root's singular derivative is never reached.
        """
        stiffness, nu = number(self.Et), number(self.nu)
        isotropic = _plane_stress(strain, stiffness, nu)
        mean = (strain[0, 0] + strain[1, 1]) / 2
        square = ((strain[0, 0] - strain[1, 1]) / 2) ** 2 + strain[0, 1] ** 2
        # e2 + nu e1 = (1 + nu) mean - (1 - nu) radius >= 0, without the root
        taut = ufl.And(ufl.ge(mean, 0), ufl.ge(((1 + nu) * mean) ** 2, (1 - nu) ** 2 * square))
        # the untaken branch is evaluated too: keep its root away from 0/0
        major = mean + ufl.sqrt(ufl.conditional(taut, 1.0, square))
        wrinkled = ufl.conditional(ufl.gt(major, 0), stiffness / 2 * major**2, 0.0)
        return ufl.conditional(taut, isotropic, wrinkled)


@dataclass(frozen=True)
class WrinkledField(TensionField):
    """The tension field's wrinkled state alone, w = E t/2 <e1>^2, continued where the film is taut.

    For one-sided tangents at the boundary between the two (`lobefem.stability.one_sided`). No larger than the
    tension field's own energy, for it leaves out E t/(2(1 - nu^2)) <e2 + nu e1>^2.
    """

    has_tangent_at_rest: ClassVar[bool] = False  # it depends on the direction of the pull

    @property
    def one_sided(self) -> None:
        """None: it is one of the sides."""

    def _relaxed(self, strain: Expr, number: Number) -> Any:
        mean = (strain[0, 0] + strain[1, 1]) / 2
        square = ((strain[0, 0] - strain[1, 1]) / 2) ** 2 + strain[0, 1] ** 2
        strained = ufl.gt(square, 0)
        # the untaken branch is evaluated too: keep its root away from 0/0
        major = mean + ufl.conditional(strained, ufl.sqrt(ufl.conditional(strained, square, 1.0)), 0.0)
        return ufl.conditional(ufl.gt(major, 0), number(self.Et) / 2 * major**2, 0.0)

    def regions(self, strain: Expr, number: Number = float) -> tuple[Any, Any, Any]:
        """Wrinkled everywhere but where no principal strain is positive: slack there."""
        major, _ = _principal(strain)
        slack = ufl.conditional(ufl.le(major, 0), 1.0, 0.0)
        return 0 * slack, 1 - slack, slack
