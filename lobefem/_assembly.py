"""Compiled forms as numbers: integrals, nodal vectors and matrices.

All are assembled into DOLFINx's own storage, of which PETSc then gets what it solves with: entry by
entry into PETSc's matrices takes twice as long.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from lobefem import _dolfinx

# isort: split
import ufl
from dolfinx import fem, la
from mpi4py import MPI
from petsc4py import PETSc

__all__ = ["NodalMatrix", "NodalVector", "integral", "together", "total", "totals"]

Array = npt.NDArray[np.float64]


def integral(mesh: Any, expression: Any) -> float:
    """The integral of a UFL expression with its measure, over all ranks. Collective."""
    return total(mesh, _dolfinx.form(expression))


def total(mesh: Any, form: Any) -> float:
    """The value of a compiled scalar form, over all ranks. Collective."""
    return float(mesh.comm.allreduce(fem.assemble_scalar(form), op=MPI.SUM))


def together(mesh: Any, *integrals: tuple[Any, Any]) -> Any:
    """Several integrals as one compiled form, for `totals`: it is made hardly later than the form of one.

    Args:
        mesh: of the film.
        integrals: of UFL expression and measure; those over the same cells or edges with the same
            quadrature degree.
    """
    W = fem.functionspace(mesh, ("DG", 0, (len(integrals),)))
    one = ufl.TestFunction(W)
    terms = [f * one[k] * measure for k, (f, measure) in enumerate(integrals)]
    return _dolfinx.form(sum(terms[1:], terms[0]))


def totals(mesh: Any, form: Any) -> Array:
    """The values of the integrals `together` in a form, over all ranks. Collective."""
    found: Array = fem.assemble_vector(form).array.reshape(-1, form.function_spaces[0].dofmap.index_map_bs)
    return np.asarray(mesh.comm.allreduce(found.sum(axis=0)))


class NodalVector:
    """A linear form's vector: one number for each component at each node.

    Args:
        form: compiled; any other one on its space can be assembled.
    """

    def __init__(self, form: Any) -> None:
        dofmap = form.function_spaces[0].dofmap
        self._vector = la.vector(dofmap.index_map, dofmap.index_map_bs)
        self._size = dofmap.index_map.size_local * dofmap.index_map_bs

    def assemble(self, form: Any) -> Array:
        """Assemble a form in place of what was there; this rank's part of it. Collective."""
        self._vector.array[:] = 0.0
        fem.assemble_vector(self._vector.array, form)
        self._vector.scatter_reverse(la.InsertMode.add)
        return self.array

    @property
    def array(self) -> Array:
        """This rank's part of what was assembled last, without ghosts."""
        return self._vector.array[: self._size]


class NodalMatrix:
    """A bilinear form's matrix of one space.

    Args:
        form: compiled; any other one on its space can be assembled.
    """

    def __init__(self, form: Any) -> None:
        self._csr = csr = fem.create_matrix(form, la.BlockMode.expanded)
        index_map = csr.index_map(0)  # of components, not of nodes
        self._rows, self._first = index_map.size_local, index_map.local_range[0]
        # the one under which `_petsc.tidy` looks for what is to be freed
        self.comm = form.mesh.comm
        self._whole: Any = None

    def assemble(self, form: Any) -> None:
        """Assemble a form in place of what was there. Collective."""
        self._csr.data[:] = 0.0
        fem.assemble_matrix(self._csr, form)
        self._csr.scatter_reverse()

    def whole(self) -> Any:
        """All of it as a PETSc matrix, overwritten by the next call. Collective."""
        if self._whole is None:
            self._whole = self._create(self._first + np.arange(self._rows), self._rows)
        return self._fill(self._whole)

    def picked(self, free: npt.NDArray[np.int32], result: Any = None) -> Any:
        """The rows and columns of some components as a PETSc matrix. Collective.

        Args:
            free: ascending numbers of the components that this rank owns and keeps.
            result: of an earlier call with the same ones, overwritten.
        """
        if result is None:
            numbers = np.full(self._rows, -1)
            numbers[free] = (self.comm.exscan(free.size) or 0) + np.arange(free.size)
            result = self._create(numbers, free.size)
        return self._fill(result)

    def _create(self, numbers: npt.NDArray[np.int64], size: int) -> Any:
        """A PETSc matrix of some rows and columns.

        Args:
            numbers: ascending in that matrix, of each component that this rank owns; -1 of those left out.
            size: its rows on this rank.
        """
        csr = self._csr
        at_columns = la.vector(csr.index_map(1), 1, dtype=np.float64)  # exact up to 2^53
        at_columns.array[: self._rows] = numbers
        at_columns.scatter_forward()
        counts = np.diff(csr.indptr[: self._rows + 1])
        row = np.repeat(np.arange(self._rows), counts)
        columns = at_columns.array.astype(PETSc.IntType)[csr.indices[: len(row)]]
        to_rows = numbers[row].astype(PETSc.IntType)
        kept = (to_rows >= 0) & (columns >= 0)
        counts = np.bincount(row[kept], minlength=self._rows)[numbers >= 0]
        pointers = np.concatenate([[0], np.cumsum(counts)]).astype(PETSc.IntType)
        places = None if kept.all() else np.flatnonzero(kept)
        values = csr.data[: len(row)] if places is None else np.empty(len(places))
        entries: Any = pointers, columns[kept], values
        # PETSc's own communicator: the mesh's ends with the mesh, and copies of the matrix may live longer
        lender: Any = PETSc.IS()
        lender.createStride(0, comm=self.comm)
        matrix: Any = PETSc.Mat()
        sizes = ((size, None), (size, None))
        if self.comm.size == 1:  # PETSc works with these very arrays
            matrix.createAIJWithArrays(sizes, entries, comm=lender.comm)
        elif hasattr(matrix, "setPreallocationCOO"):  # petsc4py 3.23: faster than row by row
            matrix.create(lender.comm)
            matrix.setSizes(sizes)
            matrix.setType(PETSc.Mat.Type.AIJ)
            matrix.setPreallocationCOO(to_rows[kept], columns[kept])
            entries = None, None, values
        else:
            matrix.createAIJ(sizes, csr=entries, comm=lender.comm)
        lender.destroy()
        matrix.setAttr("entries", (*entries, places))
        return matrix

    def _fill(self, matrix: Any) -> Any:
        """Give a matrix that `_create` made the present values. Collective."""
        pointers, columns, values, places = matrix.getAttr("entries")
        if places is not None:
            np.take(self._csr.data, places, out=values)
        if self.comm.size == 1:
            matrix.stateIncrease()
        elif hasattr(matrix, "setValuesCOO"):
            matrix.setValuesCOO(values)
        else:
            matrix.setValuesCSR(pointers, columns, values)
            matrix.assemble()
        return matrix
