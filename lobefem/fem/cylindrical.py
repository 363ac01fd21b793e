"""Cylindrical coordinates and frames of the nodes about the surface's axis."""

from __future__ import annotations

from lobefem.fem.balloon import Balloon
from lobefem.typing import Array

__all__ = ["cylindrical"]


def cylindrical(balloon: Balloon) -> tuple[Array, Array, Array]:
    """Cylindrical coordinates and frames of the nodes that this rank owns.

    Returns:
        angle (n,) [rad], height (n,) [m], cylindrical frame (n, 3, 3; rows radial, hoop, axial).
    """
    X = balloon.X[: balloon.V.dofmap.index_map.size_local]
    angle, height, _, frame = balloon.axis.cylindrical(X)
    return angle, height, frame
