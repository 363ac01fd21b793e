"""Iterative Modified Properties: the film laws of the paper's sec. 4, written with modulus matrices.

On strains (E_11, E_22, 2 E_12) the stress is S = D E, D chosen by a three-way test (Miller and
Hedgepeth 1982, Adler 2000): D_t (eq. 10) where the minor principal stress of D_t E is not negative
(taut), 0 where the major principal strain is not positive (slack), D_w (eq. 11) in between (wrinkled).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, get_args

from lobefem import checks
from lobefem.model.film import Number
from lobefem.model.tension_field import TensionField
from lobefem.typing import Expr, Tangent

import ufl

__all__ = ["IMP", "PrescribedPath"]

TANGENTS: tuple[str, ...] = get_args(Tangent)


@dataclass(frozen=True)
class IMP(TensionField):
    """Tension-only film by eqs. 10 and 11 and the three-way test: the stress of `TensionField`.

    Args:
        tangent: what Newton's method solves with: "consistent", the stress's derivative, or "secant",
            D held. In wrinkled film D leaves out that the wrinkles turn. Modes and critical pressures
            use the derivative either way.
    """

    tangent: Tangent = "consistent"
    name: ClassVar[str] = "imp"
    by_stress: ClassVar[bool] = True

    def __post_init__(self) -> None:
        super().__post_init__()
        checks.one_of("tangent", self.tangent, TANGENTS)

    def stress(self, strain: Expr, number: Number = float) -> Any:
        """S = D(E) E [N/m]."""
        return self.secant(strain, strain, number)

    def secant(self, at: Expr, strain: Expr, number: Number = float) -> Any:
        """D(at) strain [N/m], 2x2, the share `slack_stiffness` of D_t blended in."""
        taut, square = self._test(at, number)
        # the untaken branch is evaluated too: keep its root away from 0/0
        difference = 2 * ufl.sqrt(ufl.conditional(taut, 1.0, square))  # e1 - e2
        P, Q = (at[0, 0] - at[1, 1]) / difference, 2 * at[0, 1] / difference
        D_w = ufl.as_matrix([[2 * (1 + P), 0, Q], [0, 2 * (1 - P), Q], [Q, Q, 1]])
        wrinkled = number(self.Et) / 4 * D_w * _components(strain)
        isotropic = self._taut_modulus(number) * _components(strain)
        carried = self._carried(isotropic)
        open_ = ufl.gt(at[0, 0] + at[1, 1] + difference, 0)  # e1 > 0
        share = number(self.slack_stiffness) if self.slack_stiffness else 0.0
        s = []
        for i in range(3):
            relaxed = ufl.conditional(taut, carried[i], ufl.conditional(open_, wrinkled[i], 0.0))
            s.append((1 - share) * relaxed + share * isotropic[i])
        return ufl.as_matrix([[s[0], s[2]], [s[2], s[1]]])

    def _test(self, strain: Expr, number: Number) -> tuple[Any, Any]:
        """True if the film is taut, and ((e1 - e2)/2)^2.

        The minor principal stress is (1 + nu) mean - (1 - nu) radius; its sign needs no root.
        """
        nu, mean = number(self.nu), (strain[0, 0] + strain[1, 1]) / 2
        square = ((strain[0, 0] - strain[1, 1]) / 2) ** 2 + strain[0, 1] ** 2
        return ufl.And(ufl.ge(mean, 0), ufl.ge(((1 + nu) * mean) ** 2, (1 - nu) ** 2 * square)), square

    def _taut_modulus(self, number: Number) -> Any:
        """D_t, eq. 10 [N/m]."""
        nu = number(self.nu)
        D_t = ufl.as_matrix([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])
        return number(self.Et) / (1 - nu**2) * D_t

    def _carried(self, stress: Expr) -> Any:
        """The stress (S_11, S_22, S_12) that taut film carries, of D_t E."""
        return stress


def _components(strain: Expr) -> Any:
    """(E_11, E_22, 2 E_12)."""
    return ufl.as_vector([strain[0, 0], strain[1, 1], 2 * strain[0, 1]])


@dataclass(frozen=True)
class PrescribedPath(IMP):
    """IMP with a prescribed load path: taut film carries no hoop stress ("modified IMP", sec. 4).

    Where IMP finds the film taut, S_22 := 0 with S_11 and S_12 as they are. It sets up the stress of an
    isotensoid from unstressed film; then a standard law takes over (`Balloon(load_path=...)`).

    The stress is no energy's gradient: in taut film dS_11/dE_22 = nu E t/(1 - nu^2), but
    dS_22/dE_11 = 0. Nor is it continuous: at the border to wrinkled film S_22 jumps to zero unless the
    wrinkles run along the meridian.
    """

    name: ClassVar[str] = "load-path"
    has_energy: ClassVar[bool] = False
    leads_to_stress: ClassVar[bool] = True
    directional: ClassVar[bool] = True

    @property
    def shares(self) -> None:
        """None: its tangent is not symmetric."""

    @property
    def one_sided(self) -> None:
        """None: the stress jumps, not its derivative alone."""

    def energy(self, strain: Expr, number: Number = float) -> None:
        """None: there is no energy."""

    def _carried(self, stress: Expr) -> Any:
        return ufl.as_vector([stress[0], 0.0, stress[2]])

    def removed_strain(self, strain: Expr, number: Number = float, hoop_slack: float = 0.0) -> Any:
        """The strain E0 that takes the hoop stress N_h of taut film away: (nu N_h, -N_h)/(E t).

        Tension-field film with E0 built in carries in the same shape what this law carries, exactly
        where the film is not sheared (a shear stress beside no hoop stress means compression).

        Args:
            strain: of the state that this law found.
            number: makes constants.
            hoop_slack: further hoop slack s >= 0 of the taut film.
        """
        taut, _ = self._test(strain, number)
        share = number(1 - self.slack_stiffness)  # the rest of N_h is carried
        hoop = share * (self._taut_modulus(number) * _components(strain))[1] / number(self.Et)
        slack = number(hoop_slack) if hoop_slack else 0.0
        E0 = [ufl.conditional(taut, e, 0.0) for e in (number(self.nu) * hoop, -hoop - slack)]
        return ufl.as_matrix([[E0[0], 0], [0, E0[1]]])
