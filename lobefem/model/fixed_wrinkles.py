"""Film with a fixed wrinkle direction (paper sec. 3): stiff along one material direction only."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from lobefem.model.film import Film, Number, _check_share, _plane_stress
from lobefem.typing import Expr

import ufl

__all__ = ["FixedWrinkles"]


@dataclass(frozen=True)
class FixedWrinkles(Film):
    """Film wrinkled along the meridian for good (paper sec. 3, eqs. 6-9).

    It is stiff along the wrinkles only, and there in compression too: no hoop and no shear
    stiffness.

    Args:
        slack_stiffness: share of the isotropic energy that is added for the directions without
            stiffness (0, the paper's element, by default).
    """

    slack_stiffness: float = 0.0
    name: ClassVar[str] = "fixed-wrinkles"
    directional: ClassVar[bool] = True

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_share(self.slack_stiffness)

    @property
    def shares(self) -> tuple[float, float]:
        """`slack_stiffness`, both."""
        return self.slack_stiffness, self.slack_stiffness

    def energy(self, strain: Expr, number: Number = float) -> Any:
        """E t/2 (m . E m)^2, m the meridian."""
        wrinkled = number(self.Et) / 2 * strain[0, 0] ** 2
        if not self.slack_stiffness:
            return wrinkled
        share = number(self.slack_stiffness)
        return (1 - share) * wrinkled + share * _plane_stress(strain, number(self.Et), number(self.nu))

    def prestrain(self, resultant: Expr, number: Number = float, hoop_slack: float = 0.0) -> Any:
        """diag(N/(E t), 0); the share's own Poisson stress is zero with -nu N/(E t) in the hoop."""
        if self.slack_stiffness:
            return super().prestrain(resultant, number, hoop_slack)
        return ufl.as_matrix([[resultant / number(self.Et), 0], [0, 0]])

    def regions(self, strain: Expr, number: Number = float) -> tuple[Any, Any, Any]:
        """Wrinkled everywhere but where the meridian is shortened: slack there."""
        slack = ufl.conditional(ufl.lt(strain[0, 0], 0), 1.0, 0.0)
        return 0 * slack, 1 - slack, slack
