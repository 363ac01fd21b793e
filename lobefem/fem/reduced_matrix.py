"""The reduced tangent J^T K J of a constraint map, written into one PETSc matrix without a product.

J picks the free components as they are, or in axes of their own, and moves each ring's nodes with the few
parameters of the plates. So the matrix has the free rows and columns of K, and as a border a few more for
the parameters, to which the nodes next to the rings contribute alone. PETSc's product of three matrices
takes a third as long as the assembly of K itself, and no less on two ranks.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from lobefem.fem.constraint_map import ConstraintMap
from lobefem.linalg.assembly import NodalMatrix, PickedMatrix
from lobefem.typing import Array, Integers

from mpi4py import MPI
from petsc4py import PETSc

__all__ = ["Reduction", "reduction"]


def reduction(nodal: NodalMatrix, constraints: ConstraintMap) -> Reduction | Product:
    """J^T K J of a map: its entries picked from K, or where nodes follow others a product. Collective."""
    return (Product if constraints.tied else Reduction)(nodal, constraints)


class Product:
    """J^T K J by PETSc's product of three matrices, for maps whose tied nodes add rows of K to others.

    Args:
        nodal: K, or a matrix of the same pattern.
        constraints: the map.
    """

    def __init__(self, nodal: NodalMatrix, constraints: ConstraintMap) -> None:
        self._map = constraints
        self._result: Any = None

    def fill(self, nodal: NodalMatrix, w: Array, dw: Array, block: Array | None = None) -> Any:
        """The matrix with the present values, overwritten by the next call. Collective."""
        J = self._map.jacobian(w, dw)
        self._result = nodal.whole().PtAP(J, result=self._result)
        if block is not None:
            if self._map.comm.rank == self._map.comm.size - 1:
                at = self._map.parameter_columns
                self._result.setValues(at, at, block, addv=PETSc.InsertMode.ADD_VALUES)
            self._result.assemble()
        return self._result


class Reduction:
    """J^T K J of one map, its pattern found once.

    Args:
        nodal: K, or a matrix of the same pattern.
        constraints: the map.

    Collective.
    """

    def __init__(self, nodal: NodalMatrix, constraints: ConstraintMap) -> None:
        self._turned = _Turned(nodal, constraints) if constraints.turned else None
        self._border = _Border(nodal, constraints) if constraints.num_parameters else None
        further = () if self._border is None else (self._border.places,)
        self._picked = PickedMatrix(nodal, constraints.numbers, constraints.local_size, *further)

    def fill(self, nodal: NodalMatrix, w: Array, dw: Array, block: Array | None = None) -> Any:
        """The matrix with the present values, overwritten by the next call. Collective.

        Args:
            nodal: K.
            w: motion of the rings, of `ConstraintMap.plate_parameters`.
            dw: its derivative.
            block: to add to the parameters' rows and columns.
        """
        K = nodal.blocks if self._turned is None else self._turned.blocks(nodal)
        return self._picked.fill(K, None if self._border is None else self._border.values(K, w, dw, block))


class _Turned:
    """K with some nodes' components in axes of their own."""

    def __init__(self, nodal: NodalMatrix, constraints: ConstraintMap) -> None:
        axes = nodal.at_columns(constraints.axes_of_nodes().reshape(-1, 9)).reshape(-1, 3, 3)
        others = np.abs(axes - np.eye(3)).max(axis=(1, 2)) > 0
        self._at = np.flatnonzero(others[nodal.rows] | others[nodal.columns])
        self._left = axes[nodal.rows[self._at]]
        self._right = axes[nodal.columns[self._at]].transpose(0, 2, 1)

    def blocks(self, nodal: NodalMatrix) -> Array:
        """Those of this rank's rows (blocks, 3, 3)."""
        K = nodal.blocks.copy()
        K[self._at] = self._left @ K[self._at] @ self._right
        return K


class _Border:
    """Rows and columns of the parameters y, which are the last rank's last ones.

    With B the derivative of a ring's node by y and K_ij a block of K, they consist of K_ij B_j at the free
    nodes i, B_i^T K_ij at the free nodes j, and B_i^T K_ij B_j.

    Attributes:
        places: rows on this rank and columns of its entries.
    """

    def __init__(self, nodal: NodalMatrix, constraints: ConstraintMap) -> None:
        self._map, self._comm = constraints, nodal.comm
        self._last = nodal.comm.size - 1
        n = constraints.num_parameters
        numbers = constraints.numbers.reshape(-1, 3)
        # of all columns: the components' numbers, the ring (-1: none) and the arm on it
        of_columns = nodal.at_columns(np.hstack([numbers, constraints.ring_of_nodes()]))
        ring = of_columns[:, 3].astype(np.int64)
        on_rings = np.flatnonzero(ring >= 0)
        # of the nodes on rings, in the order of their columns
        self._rings = [(k, np.flatnonzero(ring[on_rings] == k)) for k in np.unique(ring[on_rings])]
        self._arms = of_columns[on_rings, 4:]
        place = np.cumsum(ring >= 0) - 1
        of_columns = of_columns[:, :3].astype(np.int64)
        rows, columns = nodal.rows, nodal.columns
        ring_row, ring_column = (ring >= 0)[rows], (ring >= 0)[columns]
        free_row, free_column = (numbers.max(axis=1) >= 0)[rows], (of_columns.max(axis=1) >= 0)[columns]

        # K_ij B_j, summed for each i
        self._right = np.flatnonzero(free_row & ring_column)
        self._right_column = place[columns[self._right]]
        nodes, self._right_first = np.unique(rows[self._right], return_index=True)
        at = numbers[nodes].ravel()
        self._right_kept = at >= 0
        first = nodal.comm.exscan(constraints.local_size) or 0
        own_rows = np.repeat(at[self._right_kept] - first, n)
        own_columns = np.tile(constraints.parameter_columns, self._right_kept.sum())

        # B_i^T K_ij, summed for each j here and then over the ranks
        left = np.flatnonzero(ring_row & free_column)
        self._left = left[np.argsort(columns[left], kind="stable")]
        self._left_row = place[rows[self._left]]
        nodes, self._left_first = np.unique(columns[self._left], return_index=True)
        gathered = nodal.comm.gather(of_columns[nodes].ravel(), root=self._last)

        self._both = np.flatnonzero(ring_row & ring_column)
        self._both_row, self._both_column = place[rows[self._both]], place[columns[self._both]]

        self._bottom = np.empty(0, dtype=np.int64)
        if gathered is not None:
            found = np.concatenate(gathered)
            self._gathered = found >= 0
            self._bottom, self._bottom_of = np.unique(found[self._gathered], return_inverse=True)
            whole = np.append(self._bottom, constraints.parameter_columns)
            own_rows = np.append(own_rows, np.repeat(constraints.free.size + np.arange(n), len(whole)))
            own_columns = np.append(own_columns, np.tile(whole, n))
        self.places: tuple[Integers, Integers] = own_rows, own_columns

    def values(self, K: Array, w: Array, dw: Array, block: Array | None) -> Array:
        """Values at `places`. Collective.

        Args:
            K: blocks of this rank's rows (blocks, 3, 3).
            w: motion of the rings.
            dw: its derivative.
            block: to add where both are parameters.
        """
        n = self._map.num_parameters
        B = np.empty((len(self._arms), 3, n))
        for k, nodes in self._rings:
            B[nodes] = self._map.ring_derivative(k, self._arms[nodes], w, dw)
        right = _sums(K[self._right] @ B[self._right_column], self._right_first)
        left = _sums(B[self._left_row].transpose(0, 2, 1) @ K[self._left], self._left_first)
        both = B[self._both_row].transpose(0, 2, 1) @ K[self._both] @ B[self._both_column]
        corner = self._comm.reduce(both.sum(axis=0), op=MPI.SUM, root=self._last)
        gathered = self._comm.gather(left.transpose(0, 2, 1).reshape(-1, n), root=self._last)
        own = right.reshape(-1, n)[self._right_kept].ravel()
        if gathered is None:
            return own
        bottom = np.zeros((n, len(self._bottom) + n))
        np.add.at(bottom.T, self._bottom_of, np.concatenate(gathered)[self._gathered])
        bottom[:, len(self._bottom) :] = corner if block is None else corner + block
        return np.append(own, bottom)


def _sums(terms: Array, first: Integers) -> Array:
    """Sums of terms (n, a, b) from each of some first ones to before the next."""
    return np.add.reduceat(terms, first) if len(first) else terms
