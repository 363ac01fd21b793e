"""Compiled forms as numbers: integrals, nodal vectors and matrices.

All are assembled into DOLFINx's own storage, of which PETSc then gets what it solves with: entry by
entry into PETSc's matrices takes twice as long.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from lobefem.linalg import dolfinx_compat
from lobefem.typing import Array, Expr, Form, Integers, Mesh

import ufl
from dolfinx import fem, la
from mpi4py import MPI
from petsc4py import PETSc

__all__ = ["NodalMatrix", "NodalVector", "PickedMatrix", "integral", "together", "total", "totals"]

_AT_ONCE = 8192  # blocks whose entries fit into a core's own cache


def integral(mesh: Mesh, expression: Expr) -> float:
    """The integral of a UFL expression with its measure, over all ranks. Collective."""
    return total(mesh, dolfinx_compat.form(expression))


def total(mesh: Mesh, form: Form) -> float:
    """The value of a compiled scalar form, over all ranks. Collective."""
    return float(mesh.comm.allreduce(fem.assemble_scalar(form), op=MPI.SUM))


def together(mesh: Mesh, *integrals: tuple[Any, Any]) -> Any:
    """Several integrals as one compiled form, for `totals`: it is made hardly later than the form of one.

    Args:
        mesh: of the film.
        integrals: of UFL expression and measure; those over the same cells or edges with the same
            quadrature degree.
    """
    W = fem.functionspace(mesh, ("DG", 0, (len(integrals),)))
    one = ufl.TestFunction(W)
    terms = [f * one[k] * measure for k, (f, measure) in enumerate(integrals)]
    return dolfinx_compat.form(sum(terms[1:], terms[0]))


def totals(mesh: Mesh, form: Form) -> Array:
    """The values of the integrals `together` in a form, over all ranks. Collective."""
    found: Array = fem.assemble_vector(form).array.reshape(-1, form.function_spaces[0].dofmap.index_map_bs)
    return np.asarray(mesh.comm.allreduce(found.sum(axis=0)))


class NodalVector:
    """A linear form's vector: one number for each component at each node.

    Args:
        form: compiled; any other one on its space can be assembled.
    """

    def __init__(self, form: Form) -> None:
        dofmap = form.function_spaces[0].dofmap
        self._vector = la.vector(dofmap.index_map, dofmap.index_map_bs)
        self._size = dofmap.index_map.size_local * dofmap.index_map_bs

    def assemble(self, form: Form) -> Array:
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
    """A bilinear form's matrix of one space: a 3 x 3 block for each pair of nodes with a common cell.

    Args:
        form: compiled; any other one on its space can be assembled.

    Attributes:
        comm: communicator of the mesh.
        nodes: that this rank owns.
        first: number of the first of them among those of all ranks.
    """

    def __init__(self, form: Form) -> None:
        self._csr = fem.create_matrix(form, la.BlockMode.compact)
        nodes = self._csr.index_map(0)
        self.nodes, self.first = nodes.size_local, nodes.local_range[0]
        # the one under which `_petsc.tidy` looks for what is to be freed
        self.comm = form.mesh.comm
        self._whole: PickedMatrix | None = None

    def assemble(self, form: Form) -> None:
        """Assemble a form in place of what was there. Collective."""
        self._csr.data[:] = 0.0
        fem.assemble_matrix(self._csr, form)
        self._csr.scatter_reverse()

    @property
    def blocks(self) -> Array:
        """Those of this rank's rows (blocks, 3, 3), row by row."""
        return self._csr.data[: 9 * self._csr.indptr[self.nodes]].reshape(-1, 3, 3)

    @cached_property
    def rows(self) -> npt.NDArray[np.int64]:
        """Row of each block: a node of this rank (blocks,)."""
        return np.repeat(np.arange(self.nodes), np.diff(self._csr.indptr[: self.nodes + 1]))

    @property
    def columns(self) -> npt.NDArray[np.int32]:
        """Column of each block, ascending in its row: first the nodes of this rank, then others (blocks,)."""
        return self._csr.indices[: self._csr.indptr[self.nodes]]

    def at_columns(self, values: npt.NDArray[Any]) -> Array:
        """Values of all columns (columns, n) from those at the nodes of each rank (nodes, n). Collective."""
        width = values.shape[1]
        spread = la.vector(self._csr.index_map(1), width, dtype=np.float64)
        spread.array[: width * self.nodes] = values.ravel()
        spread.scatter_forward()
        return spread.array.reshape(-1, width)

    def whole(self) -> Any:
        """All of it as a PETSc matrix, overwritten by the next call. Collective."""
        if self._whole is None:
            components = np.arange(3 * self.nodes)
            self._whole = PickedMatrix(self, 3 * self.first + components, len(components))
        return self._whole.fill(self.blocks)


class PickedMatrix:
    """Rows and columns of some components of a nodal matrix as a PETSc matrix, and further entries.

    PETSc works with the very arrays that are filled here.

    Args:
        nodal: the matrix to pick from, or one of the same pattern.
        numbers: of each component of this rank's nodes in the PETSc matrix, ascending, the first rows of
            this rank; -1 for those that are left out.
        size: rows of the PETSc matrix on this rank.
        further: rows on this rank and columns (entries,) of further entries, by row and column; in its row
            each comes after all that is picked.

    Attributes:
        matrix: of PETSc.

    Collective.
    """

    def __init__(
        self,
        nodal: NodalMatrix,
        numbers: Integers,
        size: int,
        further: tuple[Integers, Integers] = (np.empty(0, np.int64), np.empty(0, np.int64)),
    ) -> None:
        comm = nodal.comm
        first = comm.exscan(size) or 0
        numbers = numbers.reshape(-1, 3)
        of_columns = nodal.at_columns(numbers).astype(np.int64)  # floating point is exact up to 2^53
        chosen = (numbers.max(axis=1) >= 0)[nodal.rows] & (of_columns.max(axis=1) >= 0)[nodal.columns]
        here = nodal.columns < nodal.nodes
        further_here = (further[1] >= first) & (further[1] < first + size)
        self._parts = []
        for within in (True, False) if comm.size > 1 else (True,):
            blocks, mine = np.flatnonzero(chosen & (here == within)), np.flatnonzero(further_here == within)
            if not within:  # nodes of other ranks come in any order
                column = of_columns.max(axis=1)[nodal.columns[blocks]]
                blocks = blocks[np.lexsort((column, nodal.rows[blocks]))]
            self._parts.append(
                _Part(nodal, blocks, numbers, of_columns, size, further, mine, first if within else 0)
            )
        self.matrix: Any = PETSc.Mat()
        csr = tuple((part.pointers, part.columns, part.values) for part in self._parts)
        # PETSc's own communicator: the mesh's ends with the mesh, and copies of the matrix may live longer
        lender: Any = PETSc.IS()
        lender.createStride(0, comm=comm)
        sizes = ((size, None), (size, None))
        self.matrix.createAIJWithArrays(sizes, csr if comm.size > 1 else csr[0], comm=lender.comm)
        lender.destroy()
        self.matrix.setAttr("arrays", csr)

    def fill(self, blocks: Array, further: Array | None = None) -> Any:
        """Give the PETSc matrix other values and return it. Collective.

        Args:
            blocks: of a nodal matrix of the same pattern, maybe in other axes (blocks, 3, 3).
            further: values of the further entries.
        """
        for part in self._parts:
            np.take(blocks.reshape(-1), part.places, out=part.values, mode="clip")
            if further is not None:
                part.values[part.ends] = further[part.which]
        if len(self._parts) > 1:
            self.matrix.getDiagonalBlock().stateIncrease()
        self.matrix.stateIncrease()
        return self.matrix


class _Part:
    """CSR arrays of the columns that this rank owns, or of all others.

    Args:
        nodal: the matrix to pick from.
        blocks: that have a part in it, row by row, in a row by ascending columns.
        numbers: of each component of this rank's nodes, -1 for those that are left out (nodes, 3).
        of_columns: of the columns' components (columns, 3).
        size: rows.
        further: rows and columns of other entries.
        which: of those are in this part.
        first: column to count from.

    Attributes:
        pointers, columns, values: the arrays.
        places: of the values among all entries of the blocks; any one for the others.
        ends: where the further entries are.
    """

    def __init__(
        self,
        nodal: NodalMatrix,
        blocks: Integers,
        numbers: Integers,
        of_columns: Integers,
        size: int,
        further: tuple[Integers, Integers],
        which: Integers,
        first: int,
    ) -> None:
        self.which = which
        end_rows, end_columns = further[0][which], further[1][which]
        row, column = nodal.rows[blocks], nodal.columns[blocks]
        taken, kept = numbers >= 0, of_columns >= 0
        before: Integers = np.cumsum(kept, axis=1) - kept
        width = kept.sum(axis=1)[column]  # of each block, which it has in each of its node's rows
        in_row = np.bincount(row, width, nodal.nodes).astype(np.int64)
        start = np.cumsum(width) - width - (np.cumsum(in_row) - in_row)[row]
        counts = np.zeros(size, dtype=np.int64)
        counts[: taken.sum()] = np.repeat(in_row, 3)[taken.ravel()]
        ends = np.bincount(end_rows, minlength=size)
        self.pointers = np.concatenate([[0], np.cumsum(counts + ends)]).astype(PETSc.IntType)
        self.ends = np.cumsum(counts)[end_rows] + np.arange(len(end_rows))
        self.columns = np.empty(self.pointers[-1], dtype=PETSc.IntType)
        self.places = np.zeros(self.pointers[-1], dtype=np.intp)
        self.values = np.empty(self.pointers[-1])
        self.columns[self.ends] = end_columns - first
        begin = np.zeros(taken.shape, dtype=np.int64)
        begin[taken] = self.pointers[: taken.sum()]
        complete = taken[row].all() and kept[column].all()
        for begins in range(0, len(blocks), _AT_ONCE):
            some = slice(begins, begins + _AT_ONCE)
            r, c, block = row[some], column[some], 9 * blocks[some]
            for i, j in np.ndindex(3, 3):
                at = begin[r, i] + start[some] + before[c, j]
                there = slice(None) if complete else taken[r, i] & kept[c, j]
                self.places[at[there]] = block[there] + (3 * i + j)
                self.columns[at[there]] = of_columns[c[there], j] - first
