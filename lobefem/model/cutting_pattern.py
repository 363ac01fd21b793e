"""Film cut from flat patterns: strain and area by pattern coordinates (UFL).

Gores are cut flat and joined; the surface on which the film is meshed is not free of stress. Pattern
coordinates P (two components, each gore with its own) give the flat place of every point, F = grad x (grad
P)^-1, and with A = dP/ds in the film's frame the Green-Lagrange strain A^-T (E + (I - A^T A)/2) A^-1. The
first pattern axis takes the meridian's place in laws that know a direction.
"""

from __future__ import annotations

from typing import Any

from lobefem.model.kinematics import Frame
from lobefem.typing import Expr

import ufl

__all__ = ["Drawn", "Pattern"]


class Drawn:
    """Film that is free of stress as it was drawn."""

    area: Any = 1

    def strain(self, drawn: Expr) -> Any:
        """The film's strain of the strain of the drawn surface, 2x2."""
        return drawn

    def linear(self, drawn: Expr) -> Any:
        """The part of `strain` that is linear in that of the drawn surface."""
        return drawn

    def resultants(self, film: Any) -> Any:
        """The film's second Piola-Kirchhoff resultants as those of the drawn surface, 2x2."""
        return film


class Pattern(Drawn):
    """Film that is free of stress in its flat pattern.

    Args:
        coordinates: P as a UFL vector of two components [m].
        frame: of the drawn surface.

    Attributes:
        area: of the pattern per area of the drawn surface, whichever side of the film the pattern shows.
    """

    def __init__(self, coordinates: Expr, frame: Frame) -> None:
        gradient = ufl.grad(coordinates)
        along, across = ufl.dot(gradient, frame.m), ufl.dot(gradient, frame.h)
        self._A = ufl.as_matrix([[along[0], across[0]], [along[1], across[1]]])
        self._inverse = ufl.inv(self._A)
        self.area = abs(ufl.det(self._A))  # a pattern may show either face of the film

    def linear(self, drawn: Expr) -> Any:
        """A^-T E A^-1."""
        return ufl.transpose(self._inverse) * drawn * self._inverse

    def strain(self, drawn: Expr) -> Any:
        """A^-T (E + (I - A^T A)/2) A^-1."""
        flat = (ufl.Identity(2) - ufl.transpose(self._A) * self._A) / 2
        return self.linear(drawn + flat)

    def resultants(self, film: Any) -> Any:
        """|det A| A^-1 S A^-T."""
        return self.area * self._inverse * film * ufl.transpose(self._inverse)
