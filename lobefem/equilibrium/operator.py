"""The operator of Newton's method: a balloon's tangent, and of a sealed gas what has no sparse matrix."""

from __future__ import annotations

from typing import Any

from lobefem.fem.balloon import Balloon
from lobefem.linalg.rank_one import RankOneSum
from lobefem.typing import Mat, Vec

__all__ = ["Operator"]


class Operator:
    """A matrix with the stiffness of the gas (`GasAccess.gas_stiffness`).

    Args:
        balloon: whose gas.

    Attributes:
        is_matrix: True under a given pressure, where nothing is added.
    """

    def __init__(self, balloon: Balloon) -> None:
        self._balloon, self._sum = balloon, RankOneSum()
        self.is_matrix = balloon.gas is None

    def at(self, q: Vec, K: Mat) -> Any:
        """K itself, or its sum with the gas's stiffness at q, the same object for the same K. Collective."""
        stiffness = self._balloon.gas_stiffness(q)
        return K if stiffness is None else self._sum.set(K, *stiffness)
