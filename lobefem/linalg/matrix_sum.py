"""The sum of a matrix and of one whose non-zero pattern comes and goes, in one matrix."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from lobefem.typing import Array, Mat

from mpi4py import MPI
from petsc4py import PETSc

__all__ = ["PatternedSum"]

# entries over those of A at which a pattern begins afresh
_MOST = 1.1

Csr = tuple[npt.NDArray[Any], npt.NDArray[Any], Array]


class PatternedSum:
    """A + k B, A of one pattern for ever, in a matrix that stays the same object.

    Its pattern is that of A and of all B so far: where B fits in, the places of its entries are looked up,
    which is faster than PETSc's sum of two patterns, and a factorisation's symbolic part serves on. When
    those that came and went make a tenth of it, it begins afresh.

    Attributes:
        matrix: the sum.
        new_pattern: whether the last `set` changed its pattern.
    """

    def __init__(self) -> None:
        self.matrix: Any = None
        self.new_pattern = False
        self._rows: Any = None
        self._columns: Any = None
        self._keys: npt.NDArray[np.int64] = np.empty(0, dtype=np.int64)
        self._places: Any = None  # of A's entries

    def set(self, A: Mat, B: Mat | None = None, factor: float = 1.0) -> Any:
        """Sum A and factor B, a matrix of the same sizes or None; returns `matrix`. Collective."""
        of_a = A.getValuesCSR()
        of_b = None if B is None else B.getValuesCSR()
        width = A.getSize()[1]
        b_keys = np.empty(0, dtype=np.int64) if of_b is None else _keys(of_b, width)
        if self.matrix is None or len(self._keys) > _MOST * len(of_a[2]):
            self._keys = _keys(of_a, width)
            self._places = np.arange(len(self._keys))
            fits = False
        else:
            fits = True
        places = np.searchsorted(self._keys, b_keys)
        missing = self._keys[np.minimum(places, len(self._keys) - 1)] != b_keys
        fits = fits and not missing.any()
        self.new_pattern = not A.comm.tompi4py().allreduce(fits, op=MPI.LAND)
        if self.new_pattern:
            self._keys = np.insert(self._keys, places[missing], b_keys[missing])
            # each entry of A moves on by the new ones before it
            self._places = self._places + np.searchsorted(places[missing], self._places, side="right")
            places = np.searchsorted(self._keys, b_keys)
            counts = np.bincount(self._keys // width, minlength=len(of_a[0]) - 1)
            self._rows = np.concatenate([[0], np.cumsum(counts)]).astype(PETSc.IntType)
            self._columns = (self._keys % width).astype(PETSc.IntType)
        values = np.zeros(len(self._keys))
        values[self._places] = of_a[2]
        if of_b is not None:
            values[places] += factor * of_b[2]
        csr = (self._rows, self._columns, values)
        if self.matrix is None:
            self.matrix = PETSc.Mat().createAIJ(A.getSizes(), csr=csr, comm=A.comm)
        elif self.new_pattern:
            self.matrix.setPreallocationCSR(csr)
        else:
            self.matrix.setValuesCSR(*csr)
            self.matrix.assemble()
        return self.matrix


def _keys(csr: Csr, width: int) -> npt.NDArray[np.int64]:
    """One number an entry, ascending: its row on this rank times `width`, plus its column."""
    rows, columns, _ = csr
    row = np.repeat(np.arange(len(rows) - 1, dtype=np.int64), np.diff(rows))
    return row * width + columns
