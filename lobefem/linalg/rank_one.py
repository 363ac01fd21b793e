"""A sparse matrix and one of rank one, as an operator: their sum would have no zero entry."""

from __future__ import annotations

import math
from typing import Any

from lobefem.typing import Mat, Vec

from petsc4py import PETSc

__all__ = ["RankOneSum"]


class RankOneSum:
    """A + factor v v^T as PETSc's `MatLRC`, of which a solver factorises A alone.

    With A's factors for a preconditioner GMRES is done after two steps: the operator that it sees is the
    identity and a matrix of rank one.
    """

    def __init__(self) -> None:
        self._sum: Any = None
        self._column: Any = None

    def set(self, A: Mat, factor: float, vector: Vec) -> Any:
        """The sum, the same object for every call with the same A. Collective.

        Args:
            A: whose later values the sum has, too.
            factor: not below 0.
            vector: v.
        """
        if self._column is None:
            sizes = (vector.getSizes(), (None, 1))
            self._column = PETSc.Mat().createDense(sizes, comm=A.getComm())
            self._column.setUp()
        self._column.getDenseArray()[:, 0] = math.sqrt(factor) * vector.array_r
        self._column.assemble()
        if self._sum is None or self._sum.getLRCMats()[0].handle != A.handle:
            one = PETSc.Vec().createWithArray([1.0], comm=PETSc.COMM_SELF)
            self._sum = PETSc.Mat().createLRC(A, self._column, one, self._column)
        return self._sum
