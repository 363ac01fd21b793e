"""The map q -> u from free unknowns to nodal displacements, in parallel.

q holds the displacement components of the free nodes (where they are owned) and, at the end of the
last rank, the plates' parameters y. Nodes on a rim follow their plate, held components keep their
value. For an energy of u the reduced residual is J^T r and the reduced tangent J^T K J plus the
curvature of the map, which acts on y alone: no row of a Dirichlet condition is left anywhere, so the
same products serve Newton's method and eigenproblems.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from lobefem import _dolfinx  # noqa: F401  (the stack, before PETSc)

# isort: split
from petsc4py import PETSc

from lobefem.plates import PlateMotion, rotation

__all__ = ["ConstraintMap"]

Array = npt.NDArray[np.float64]


class ConstraintMap:
    """q -> u of one balloon.

    Args:
        V: vector function space (three components).
        motion: the plates' motion, or None.
        rims: block indices of the nodes, owned or ghosts, of bottom and top rim.
        held: unrolled indices of held displacement components (owned or ghosts).
        values: their values [m].

    Attributes:
        local_size, size: unknowns q on this rank and in all.

    Collective.
    """

    def __init__(
        self,
        V: Any,
        motion: PlateMotion | None,
        rims: tuple[npt.NDArray[np.int32], ...],
        held: npt.NDArray[np.int32],
        values: Array,
    ) -> None:
        self.comm = V.mesh.comm
        self.motion = motion
        index_map = V.dofmap.index_map
        self.owned = 3 * index_map.size_local
        self._start = 3 * index_map.local_range[0]
        x = V.tabulate_dof_coordinates()
        free = np.ones(self.owned, dtype=bool)
        self._rims, self._arms = [], []
        for k, nodes in enumerate(rims):
            nodes = nodes[nodes < index_map.size_local]
            self._rims.append(nodes)
            self._arms.append(x[nodes] - motion.centres[k])  # type: ignore[union-attr]
            free[(3 * nodes[:, None] + np.arange(3)).ravel()] = False
        mine = (held < self.owned) & free[np.minimum(held, self.owned - 1)] if self.owned else held < 0
        self._held, self._values = held[mine], values[mine]
        free[self._held] = False
        self.free = np.flatnonzero(free).astype(np.int32)
        self.num_parameters = motion.size if motion is not None else 0
        self._has_parameters = self.comm.rank == self.comm.size - 1
        self.local_size = self.free.size + (self.num_parameters if self._has_parameters else 0)
        offset = self.comm.exscan(self.local_size) or 0
        self.size = self.comm.allreduce(self.local_size)
        self._offset = offset
        self.parameter_columns = np.arange(self.size - self.num_parameters, self.size, dtype=PETSc.IntType)
        self._jacobian: Any = None
        self._jacobian_w: Array | None = None

    # --- q and its plate parameters -------------------------------------------------------------

    def create_vector(self) -> Any:
        """A PETSc vector q, zero (the reference state). Collective."""
        q = PETSc.Vec().createMPI((self.local_size, self.size), comm=self.comm)
        q.set(0.0)
        return q

    def parameters(self, q: Any) -> Array:
        """The plates' parameters y in q, on every rank. Collective."""
        y = np.zeros(self.num_parameters)
        if self.num_parameters:
            if self._has_parameters:
                y[:] = q.array_r[self.free.size :]
            self.comm.Bcast(y, root=self.comm.size - 1)
        return y

    def plate_parameters(self, y: Array) -> tuple[Array, Array, Array]:
        """w, dw/dy and d2w/dy2 of both plates."""
        if self.motion is None:
            return np.zeros(12), np.zeros((12, 0)), np.zeros((12, 0, 0))
        return self.motion.evaluate(y)

    def displace(self, q: Any, u: Any) -> tuple[Array, Array, Array]:
        """Write u(q) into the function `u`, ghosts included; returns `plate_parameters`. Collective."""
        w, dw, d2w = self.plate_parameters(self.parameters(q))
        array = u.x.array
        array[self.free] = q.array_r[: self.free.size]
        array[self._held] = self._values
        for k, (nodes, arms) in enumerate(zip(self._rims, self._arms, strict=True)):
            R, _, _ = rotation(w[6 * k + 3 : 6 * k + 6])
            motion = w[6 * k : 6 * k + 3] + arms @ (R - np.eye(3)).T
            array[3 * nodes[:, None] + np.arange(3)] = motion
        u.x.scatter_forward()
        return w, dw, d2w

    # --- residual -------------------------------------------------------------------------------

    def plate_forces(self, r: Array, w: Array) -> tuple[Array, Array]:
        """Gradient (12,) and curvature (12, 12) in w of sum r . u(w) over the rims. Collective.

        Args:
            r: owned part of the nodal residual.
            w: plate parameters.
        """
        gradient, curvature = np.zeros(12), np.zeros((12, 12))
        sums = np.zeros((2, 3, 4))
        for k, (nodes, arms) in enumerate(zip(self._rims, self._arms, strict=True)):
            force = r[3 * nodes[:, None] + np.arange(3)]
            sums[k, :, 0] = force.sum(axis=0)
            sums[k, :, 1:] = force.T @ arms
        sums = self.comm.allreduce(sums)
        for k in range(len(self._rims)):
            d, t = slice(6 * k, 6 * k + 3), slice(6 * k + 3, 6 * k + 6)
            _, dR, d2R = rotation(w[t])
            gradient[d] = sums[k, :, 0]
            gradient[t] = np.einsum("aij,ij->a", dR, sums[k, :, 1:])
            curvature[t, t] = np.einsum("abij,ij->ab", d2R, sums[k, :, 1:])
        return gradient, curvature

    def reduce(self, r: Array, w_gradient: Array, dw: Array, out: Any) -> None:
        """Write J^T r into `out`: free components as they are, plates from the gradient in w."""
        with out as array:
            array[: self.free.size] = r[self.free]
            if self._has_parameters:
                array[self.free.size :] = dw.T @ w_gradient

    # --- tangent --------------------------------------------------------------------------------

    def jacobian(self, w: Array, dw: Array) -> Any:
        """J = du/dq as a PETSc matrix, its pattern kept from call to call. Collective."""
        # the tangent, the mass and every mode of a state ask for the same one
        if self._jacobian_w is not None and np.array_equal(self._jacobian_w, w):
            return self._jacobian
        n = self.num_parameters
        counts = np.zeros(self.owned, dtype=PETSc.IntType)
        counts[self.free] = 1
        for nodes in self._rims:
            counts[3 * nodes[:, None] + np.arange(3)] = n
        rows = np.concatenate([[0], np.cumsum(counts)]).astype(PETSc.IntType)
        columns = np.empty(rows[-1], dtype=PETSc.IntType)
        entries = np.ones(rows[-1])
        columns[rows[self.free]] = self._offset + np.arange(self.free.size)
        for k, (nodes, arms) in enumerate(zip(self._rims, self._arms, strict=True)):
            _, dR, _ = rotation(w[6 * k + 3 : 6 * k + 6])
            block = np.einsum("aij,nj->nia", dR, arms) @ dw[6 * k + 3 : 6 * k + 6]
            block += dw[6 * k : 6 * k + 3]
            at = rows[3 * nodes[:, None] + np.arange(3)][..., None] + np.arange(n)
            columns[at] = self.parameter_columns
            entries[at] = block
        if self._jacobian is None:
            sizes = ((self.owned, None), (self.local_size, None))
            self._jacobian = PETSc.Mat().createAIJ(sizes, csr=(rows, columns, entries), comm=self.comm)
        else:
            self._jacobian.setValuesCSR(rows, columns, entries)
            self._jacobian.assemble()
        self._jacobian_w = w.copy()
        return self._jacobian

    def add_parameter_block(self, matrix: Any, block: Array) -> None:
        """Add a dense block (size of y) to the plates' rows and columns. Collective."""
        if not self.num_parameters:
            return
        # on all ranks: assembly is collective only where the pattern may grow
        matrix.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, False)
        if self._has_parameters:
            c = self.parameter_columns
            matrix.setValues(c, c, block, addv=PETSc.InsertMode.ADD_VALUES)
        matrix.assemble()
