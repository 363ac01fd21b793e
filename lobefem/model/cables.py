"""Cables on edges of the film: hoops on seams, later tendons on gores.

A cable is an elastic line without bending stiffness, bonded to a tagged edge of the mesh, energy
EA/2 e^2 per reference length with e the Green-Lagrange strain of the edge.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from lobefem import checks
from lobefem.errors import InputError
from lobefem.typing import Array

__all__ = ["Cables", "Hoops", "Tendons"]


class NamedEdges(Protocol):
    """A surface, as far as cables ask for it."""

    @property
    def groups(self) -> Mapping[str, tuple[int, int]]:
        """Dimension and value of each group by its name."""

    @property
    def num_lobes(self) -> int:
        """Number of lobes in the stack."""

    @property
    def copies(self) -> int:
        """Number of turned copies that close the surface."""


@dataclass(frozen=True)
class Cables:
    """Elastic cables along the named edges of a surface.

    Args:
        EA: axial stiffness [N]; the paper's 100 x 100 mm steel hoop has 2.15e9.
        on: names of edge groups; a name that ends with * stands for all groups that begin so.
        tension_per_pressure: tension [N] built into the cable per Pa of prestress, None for the
            lobe's own seam tension (R0^2 cos(phi) for isotensoids).
        foreshortening: share by which the cable at rest is shorter than its edge as drawn; or a function of
            points (n, 3) [m] amid the edges at rest that gives it for each of them (n,).
        tension_only: True for a cable that goes slack without resistance.

    Raises:
        InputError: EA is not a positive number, the tension no number, or `on` no names.
    """

    EA: float = 2.15e9
    on: tuple[str, ...] = ("seam_*",)
    tension_per_pressure: float | None = None
    foreshortening: float | Callable[[Array], Any] = 0.0
    tension_only: bool = False

    def __post_init__(self) -> None:
        checks.positive("cable EA", self.EA, "N")
        if self.tension_per_pressure is not None:
            checks.finite("a cable's tension_per_pressure", self.tension_per_pressure, "N/Pa")
        if (
            not callable(self.foreshortening)
            and not -0.5 < checks.finite("a cable's foreshortening", self.foreshortening, "") < 0.5
        ):
            raise InputError(
                f"a cable's foreshortening is {self.foreshortening}; give a share of its length, as 0.02 for "
                "2 %"
            )
        if not isinstance(self.on, (tuple, list)) or not all(isinstance(name, str) for name in self.on):
            raise InputError(f"a cable is on {self.on!r}; give names of edge groups, as ('seam_*',)")

    def groups(self, surface: NamedEdges) -> tuple[str, ...]:
        """Names of the surface's edge groups that carry this cable.

        A single lobe has no seams: "seam_*" then names none.

        Raises:
            InputError: a name that no edge of the surface has, or begins with.
        """
        edges = [name for name, (dim, _) in surface.groups.items() if dim == 1]
        chosen: list[str] = []
        for pattern in self.on:
            found = [
                name
                for name in edges
                if name == pattern or (pattern[-1:] == "*" and name.startswith(pattern[:-1]))
            ]
            if not found and (pattern != "seam_*" or surface.num_lobes > 1):
                raise InputError(f"no edge group '{pattern}' on this surface; it has {edges}")
            chosen += [name for name in found if name not in chosen]
        return tuple(chosen)

    @property
    def shortened(self) -> bool:
        """True if the cable at rest is not as long as its edge everywhere."""
        return callable(self.foreshortening) or self.foreshortening != 0.0

    def shares(self, points: Array) -> Array:
        """Foreshortening of the edges about points (n, 3) [m], (n,)."""
        given = self.foreshortening
        found = given(points) if callable(given) else given
        return np.array(np.broadcast_to(np.asarray(found, dtype=np.float64), len(points)))

    def reduced_stiffness(self, shares: Array) -> Array:
        """EA/(1 - f)^3 [N], which makes the energy per drawn length that of strain from rest."""
        return np.asarray(self.EA / (1 - shares) ** 3)

    @staticmethod
    def reduced_strain(shares: Array) -> Array:
        """Strain (1 - (1 - f)^2)/2 of the drawn edge, to add to that of its displacement."""
        return np.asarray((1 - (1 - shares) ** 2) / 2)


class Hoops(Cables):
    """Stiff hoops on all the seams between lobes (paper fig. 4)."""


@dataclass(frozen=True)
class Tendons(Cables):
    """Tendons between the gores of a pumpkin balloon, which carry tension only.

    Of one gore the tendon on its first cut counts, for the other one is the next gore's.
    """

    EA: float = 1e5
    on: tuple[str, ...] = ("tendon_*",)
    tension_only: bool = True

    def groups(self, surface: NamedEdges) -> tuple[str, ...]:
        """Names of the surface's edge groups that carry this cable: see `Cables.groups`."""
        found = super().groups(surface)
        return found if surface.copies == 1 else found[:1]
