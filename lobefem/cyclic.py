"""All modes of one harmonic from one sector of a cyclic mesh (physics: harmonic reduction).

With the unknowns of each node in its own cylindrical frame, a structured surface of N equal sectors
has K coupling sector j to j - 1, j and j + 1 only, the same for every j. A motion of harmonic n is
u_j = e^{i n alpha j} u_0, alpha = 2 pi/N, so that

    K_n = N (K_0 + K_1 e^{i alpha n} + K_-1 e^{-i alpha n})

has all of its modes, from one sector. Plates enter n = 0 (spin, axial) and n = 1 (sway, tilt) only.
In real arithmetic K_n is [[Re, -Im], [Im, Re]]: each eigenvalue twice, as in the full model, where
the second one is that of harmonic -n.
"""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp

from lobefem.balloon import Balloon
from lobefem.errors import InputError
from lobefem.harmonics import cylindrical

# isort: split
from mpi4py import MPI
from petsc4py import PETSc

__all__ = ["CyclicReduction"]

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]


class CyclicReduction:
    """From matrices in a balloon's unknowns q to those of one harmonic, on every rank alone.

    Args:
        balloon: on a structured surface, its film nodes either free or held in all components.

    Raises:
        InputError: the surface has no cyclic order, or a node is held in some components only.

    Collective.
    """

    def __init__(self, balloon: Balloon) -> None:
        order = balloon.surface.cyclic_order
        if order is None:
            raise InputError("a single harmonic needs a cyclic mesh; use mesh layout 'structured'")
        self.balloon, self.order = balloon, int(order)
        self.comm = balloon.comm
        constraint = balloon.map
        nodes = np.unique(constraint.free // 3)
        whole = np.array_equal(constraint.free, (3 * nodes[:, None] + np.arange(3)).ravel())
        if not self.comm.allreduce(whole, op=MPI.LAND):
            raise InputError("a single harmonic needs nodes that are free or held in all components")
        angle, height, frame = cylindrical(balloon)
        self._frame = frame[nodes]  # rows: radial, hoop, axial
        alpha = 2 * np.pi / self.order
        turns = np.mod(angle[nodes], 2 * np.pi) / alpha
        self._sector = np.floor(turns + 1e-6).astype(np.int64)
        inside = np.round((turns - self._sector) * 1e6).astype(np.int64)
        self._sector %= self.order
        span = self.comm.allreduce(np.abs(height).max(initial=0.0), op=MPI.MAX)
        keys = np.stack([np.round(height[nodes] / span * 1e7).astype(np.int64), inside], axis=1)
        first = np.concatenate(self.comm.allgather(keys[self._sector == 0]))
        first = first[np.lexsort(first.T[::-1])]
        self._slot = _match(first, keys)
        if not self.comm.allreduce(bool((self._slot >= 0).all()), op=MPI.LAND):
            raise InputError("the mesh is not the same in every sector; use mesh layout 'structured'")
        self.num_slots = len(first)
        start = constraint.create_vector().getOwnershipRange()[0]
        self._start = start
        # sector and 3 slot + component of every unknown in the sectors next to the first one
        near = (self._sector <= 1) | (self._sector == self.order - 1)
        q = start + 3 * np.flatnonzero(near)
        table = np.stack([q, self._sector[near], self._slot[near]], axis=1)
        angles = np.concatenate(self.comm.allgather(self._frame[near]))
        table = np.concatenate(self.comm.allgather(table))
        at = np.argsort(table[:, 0])
        self._table, self._table_frame = table[at], angles[at]

    def reduce(self, matrix: Any, harmonic: int) -> tuple[Any, int]:
        """The matrix of one harmonic as a PETSc matrix on this rank alone, and its plate parameters.

        Args:
            matrix: a PETSc matrix in q.
            harmonic: n, 0 <= n <= N/2.

        Returns:
            the real matrix (doubled unless n = 0 or N/2) and the number of its last rows of each
            copy that belong to the plates.

        Raises:
            InputError: n out of range.

        Collective.
        """
        if not 0 <= harmonic <= self.order // 2:
            raise InputError(
                f"harmonic = {harmonic}: a mesh of {self.order} equal sectors has harmonics 0 to "
                f"{self.order // 2}; try more divisions around"
            )
        plates = 0
        block: Any = self._film(matrix, harmonic)
        modes = self._plate_basis(harmonic)
        if modes.shape[1]:
            right, left, corner = self._plate_coupling(matrix, harmonic)
            plates = modes.shape[1]
            block = sp.bmat(
                [[block, right @ modes], [modes.conj().T @ left, modes.conj().T @ corner @ modes]], "csr"
            )
        real = harmonic == 0 or 2 * harmonic == self.order
        if not real:
            # plates last in both copies: [film Re, film Im, plates Re, plates Im]
            block = sp.bmat([[block.real, -block.imag], [block.imag, block.real]], "csr")
            size = block.shape[0] // 2
            film = np.arange(size - plates)
            last = np.arange(size - plates, size)
            at = np.concatenate([film, size + film, last, size + last])
            block = block[at][:, at]
        return _petsc_matrix(sp.csr_matrix(block.real if real else block)), plates * (1 if real else 2)

    def expand(self, vector: Array, harmonic: int, plates: int) -> tuple[Any, Any]:
        """The full model's q (real and imaginary part) of an eigenvector of `reduce`. Collective."""
        film = 3 * self.num_slots
        doubled = not (harmonic == 0 or 2 * harmonic == self.order)
        if doubled:
            half = plates // 2
            u = vector[:film] + 1j * vector[film : 2 * film]
            y = vector[2 * film : 2 * film + half] + 1j * vector[2 * film + half :]
        else:
            u, y = vector[:film] + 0j, vector[film:] + 0j
        phase = np.exp(2j * np.pi * harmonic * self._sector / self.order)
        local = u.reshape(-1, 3)[self._slot] * phase[:, None]
        values = np.einsum("nij,ni->nj", self._frame, local).ravel()
        if self.balloon.map.num_parameters and self.comm.rank == self.comm.size - 1:
            basis = self._plate_basis(harmonic)
            tail = basis @ y if basis.shape[1] else np.zeros(self.balloon.map.num_parameters, dtype=complex)
            values = np.concatenate([values, tail])
        real, imag = self.balloon.map.create_vector(), self.balloon.map.create_vector()
        real.array[:], imag.array[:] = values.real, values.imag
        return real, imag

    def _film(self, matrix: Any, harmonic: int) -> Any:
        """N (K_0 + K_1 e^{i alpha n} + K_-1 e^{-i alpha n}) in cylindrical components, on every rank."""
        pointers, columns, values = matrix.getValuesCSR()
        rows = np.flatnonzero(np.repeat(self._sector == 0, 3))
        counts = (pointers[1:] - pointers[:-1])[rows]
        at = np.concatenate([np.arange(pointers[r], pointers[r + 1]) for r in rows]) if rows.size else rows
        row, column, value = np.repeat(rows, counts), columns[at], values[at]
        # unknowns of plates are not in the table
        known = np.searchsorted(self._table[:, 0], column, side="right") - 1
        known = np.maximum(known, 0)
        offset = column - self._table[known, 0]
        film = (offset >= 0) & (offset < 3)
        row, value, known, offset = row[film], value[film], known[film], offset[film]
        node, component = row // 3, row % 3
        step = (self._table[known, 1] + 1) % self.order - 1  # -1, 0, 1
        phase = np.exp(2j * np.pi * harmonic * step / self.order) * self.order
        # rotate both ends into their cylindrical frames: 9 entries for each one
        left, right = self._frame[node][np.arange(len(node)), :, component], self._table_frame[known]
        right = right[np.arange(len(known)), :, offset]
        entries = (value * phase)[:, None, None] * left[:, :, None] * right[:, None, :]
        i = np.broadcast_to((3 * self._slot[node])[:, None, None] + np.arange(3)[:, None], entries.shape)
        j = np.broadcast_to((3 * self._table[known, 2])[:, None, None] + np.arange(3), entries.shape)
        size = 3 * self.num_slots
        mine = sp.coo_matrix((entries.ravel(), (i.ravel(), j.ravel())), shape=(size, size)).tocsr()
        parts = self.comm.allgather((mine.data, mine.indices, mine.indptr))
        return sum(sp.csr_matrix(part, shape=(size, size)) for part in parts)

    def _plate_basis(self, harmonic: int) -> npt.NDArray[np.complex128]:
        """Plate parameters (rows) that move in a harmonic (columns).

        With n = 0 those along the axis, with n = 1 the pairs across it as x + i y, which is what turns
        with e^{i theta}.
        """
        motion = self.balloon.motion
        names = motion.names if motion is not None else ()
        columns: list[npt.NDArray[np.complex128]] = []
        for k, name in enumerate(names):
            column = np.zeros(len(names), dtype=complex)
            if harmonic == 0 and name.endswith("_z"):
                column[k] = 1
            elif harmonic == 1 and name.endswith(("_x", "_1")):
                column[k], column[k + 1] = 1, 1j
            else:
                continue
            columns.append(column)
        return np.array(columns, dtype=complex).reshape(len(columns), len(names)).T

    def _plate_coupling(self, matrix: Any, harmonic: int) -> tuple[Any, Any, Any]:
        """K_fy (film rows projected on the harmonic), K_yf and K_yy, on every rank. Collective."""
        n = self.balloon.map.num_parameters
        size, first = 3 * self.num_slots, self.balloon.map.size - n
        phase = np.exp(-2j * np.pi * harmonic * self._sector / self.order)
        projected = []
        corner = np.zeros((n, n))
        for A in (matrix, matrix.transpose(PETSc.Mat())):
            pointers, columns, values = A.getValuesCSR()
            row = np.repeat(np.arange(len(pointers) - 1), np.diff(pointers))
            plate = columns >= first
            row, column, value = row[plate], columns[plate] - first, values[plate]
            film = row < 3 * len(self._sector)
            if A is matrix:
                corner[row[~film] - 3 * len(self._sector), column[~film]] = value[~film]
            row, column, value = row[film], column[film], value[film]
            node, component = row // 3, row % 3
            local = self._frame[node][np.arange(len(node)), :, component] * (value * phase[node])[:, None]
            block = np.zeros((size, n), dtype=complex)
            for k in range(3):
                np.add.at(block, (3 * self._slot[node] + k, column), local[:, k])
            projected.append(self.comm.allreduce(block))
        return projected[0], projected[1].conj().T, self.comm.allreduce(corner)


def _match(table: Index, keys: Index) -> Index:
    """Row of `table` nearest to each key, -1 for none; rounding may have moved a key by one."""
    result = np.full(len(keys), -1, dtype=np.int64)
    weights = np.array([1 << 24, 1])  # one number for a pair, in the order of the table
    codes = table @ weights
    for shift in product((0, -1, 1), repeat=2):
        wanted = (keys + shift) @ weights
        at = np.minimum(np.searchsorted(codes, wanted), len(codes) - 1)
        hit = (codes[at] == wanted) & (result < 0)
        result[hit] = at[hit]
    return result


def _petsc_matrix(matrix: Any) -> Any:
    matrix.sort_indices()
    result = PETSc.Mat().createAIJ(
        matrix.shape,
        csr=(matrix.indptr.astype(PETSc.IntType), matrix.indices.astype(PETSc.IntType), matrix.data),
        comm=MPI.COMM_SELF,  # type: ignore[arg-type]
    )
    result.assemble()
    return result
