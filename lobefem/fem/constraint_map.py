"""The map q -> u from free unknowns to nodal displacements, in parallel.

q holds the displacement components of the free nodes (where they are owned) and, at the end of the
last rank, the plates' parameters y. Nodes on a rim follow their plate, held components keep their
value. On one sector of a cyclic surface the nodes of its far cut may be tied to those of its near one, so
that the sector deforms as all others do. A guide (`lobefem.fem.prescribed_motion`) may take seams along as
rigid rings and push nodes outwards. For an energy of u the reduced residual is J^T r and the reduced tangent
J^T K J plus the curvature of the map, which acts on y alone: no row of a Dirichlet condition is left
anywhere, so the same products serve Newton's method and eigenproblems.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from lobefem.fem.cyclic_symmetry import SymmetricMotion, Ties
from lobefem.fem.prescribed_motion import PrescribedMotion, PushedNodes
from lobefem.fem.rigid_plates import PlateMotion, rotation
from lobefem.typing import Array, Function, Space, Vec

from mpi4py import MPI
from petsc4py import PETSc

__all__ = ["ConstraintMap"]


class ConstraintMap:
    """q -> u of one balloon.

    Args:
        V: vector function space (three components).
        X: positions of its nodes at rest, ghosts included (nodes, 3) [m].
        motion: the plates' motion, a guide that leads it, a `SymmetricMotion`, or None.
        rims: block indices of the nodes, owned or ghosts, of each rigid ring: bottom rim, top rim and
            the guide's seams.
        held: unrolled indices of held displacement components (owned or ghosts).
        values: their values [m].
        ties: nodes that follow others; those of rigid rings and held ones do not.

    Attributes:
        local_size, size: unknowns q on this rank and in all.
        whole_nodes: whether q is made of nodes free in x, y and z, and of nothing else.
        turned: whether some nodes have components in axes of their own.
        tied: whether some nodes follow others, so that J adds rows of K.

    Collective.
    """

    def __init__(
        self,
        V: Space,
        X: Array,
        motion: PlateMotion | PrescribedMotion | SymmetricMotion | None,
        rims: tuple[npt.NDArray[np.int32], ...],
        held: npt.NDArray[np.int32],
        values: Array,
        ties: Ties | None = None,
    ) -> None:
        self.comm = V.mesh.comm
        self.motion = motion
        index_map = V.dofmap.index_map
        self.owned = 3 * index_map.size_local
        free = np.ones(self.owned, dtype=bool)
        self._rims, self._arms = [], []
        for k, nodes in enumerate(rims):
            nodes = nodes[nodes < index_map.size_local]
            self._rims.append(nodes)
            self._arms.append(X[nodes] - motion.centres[k])  # type: ignore[union-attr]
            free[(3 * nodes[:, None] + np.arange(3)).ravel()] = False
        mine = (held < self.owned) & free[np.minimum(held, self.owned - 1)] if self.owned else held < 0
        self._held, self._values = held[mine], values[mine]
        free[self._held] = False
        self._push(motion.pushed if isinstance(motion, PrescribedMotion) else None, free)
        self._tie(ties, free)
        self.free = np.flatnonzero(free).astype(np.int32)
        self.num_parameters = motion.size if motion is not None else 0
        self._has_parameters = self.comm.rank == self.comm.size - 1
        self.local_size = self.free.size + (self.num_parameters if self._has_parameters else 0)
        offset = self.comm.exscan(self.local_size) or 0
        self.size = self.comm.allreduce(self.local_size)
        self._offset = offset
        whole = not self.num_parameters and free.reshape(-1, 3).all(axis=1).sum() * 3 == self.free.size
        self.turned = bool(self.comm.allreduce(self._pushed.size, op=MPI.SUM))
        self.whole_nodes = bool(self.comm.allreduce(bool(whole), op=MPI.LAND))
        self.parameter_columns = np.arange(self.size - self.num_parameters, self.size, dtype=PETSc.IntType)
        self._jacobian: Any = None
        self._jacobian_w: Array | None = None

    def _push(self, pushed: PushedNodes | None, free: npt.NDArray[np.bool_]) -> None:
        """Take the outward component of pushed nodes out of `free`.

        Where the other nodes have x, y and z these have their radial, hoop and axial components.
        """
        self._pushed: npt.NDArray[np.int32] = np.empty(0, dtype=np.int32)
        self._frames, self._push_terms = np.empty((0, 3, 3)), np.empty((3, 0))
        if pushed is None:
            return
        mine = pushed.nodes < self.owned // 3
        mine[mine] = free.reshape(-1, 3)[pushed.nodes[mine]].all(axis=1)
        self._pushed, self._frames = pushed.nodes[mine], pushed.frames[mine]
        first = np.zeros(len(mine)) if pushed.first is None else pushed.first
        self._push_terms = np.stack([first[mine], pushed.linear[mine], pushed.quadratic[mine]])
        free[3 * self._pushed] = False

    def _tie(self, ties: Ties | None, free: npt.NDArray[np.bool_]) -> None:
        """Take the components of tied nodes out of `free`."""
        self._far: npt.NDArray[np.int64] = np.empty((0, 3), dtype=np.int64)
        self._near, self._rotation = self._far, np.eye(3)
        if ties is not None:
            mine = free.reshape(-1, 3)[ties.far].all(axis=1)
            self._far, self._near = (3 * n[mine][:, None] + np.arange(3) for n in (ties.far, ties.near))
            self._rotation = ties.rotation
        free[self._far] = False
        self.tied = bool(self._far.size)

    # --- q and its plate parameters -------------------------------------------------------------

    def create_vector(self) -> Any:
        """A PETSc vector q, zero (the reference state). Collective."""
        q = PETSc.Vec().createMPI((self.local_size, self.size), comm=self.comm)
        q.set(0.0)
        return q

    def parameters(self, q: Vec) -> Array:
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

    def displace(self, q: Vec, u: Function) -> tuple[Array, Array, Array]:
        """Write u(q) into the function `u`, ghosts included; returns `plate_parameters`. Collective."""
        w, dw, d2w = self.plate_parameters(self.parameters(q))
        array = u.x.array
        array[self.free] = q.array_r[: self.free.size]
        array[self._held] = self._values
        for k, (nodes, arms) in enumerate(zip(self._rims, self._arms, strict=True)):
            R, _, _ = rotation(w[6 * k + 3 : 6 * k + 6])
            motion = w[6 * k : 6 * k + 3] + arms @ (R - np.eye(3)).T
            array[3 * nodes[:, None] + np.arange(3)] = motion
        if self._pushed.size:
            at = 3 * self._pushed[:, None] + np.arange(3)
            s = self.motion.parameter  # type: ignore[union-attr]
            local = array[at]
            local[:, 0] = np.array([1.0, s, s**2]) @ self._push_terms
            array[at] = np.einsum("nk,nkj->nj", local, self._frames)
        array[self._far] = array[self._near] @ self._rotation.T
        u.x.scatter_forward()
        return w, dw, d2w

    def unknowns(self, u: Function, w: Array) -> Any:
        """The q of a displacement that keeps to the map: the inverse of `displace`. Collective.

        Args:
            u: displacement function.
            w: motion of the plates (12 numbers, or more with a guide's seams).
        """
        q = self.create_vector()
        with q as array:
            array[: self.free.size] = self._in_frames(u.x.array[: self.owned])[self.free]
            if self._has_parameters and self.motion is not None:
                array[self.free.size :] = self.motion.coordinates(w[:12])
        return q

    def _in_frames(self, r: Array) -> Array:
        """A nodal vector with the pushed nodes' components in their frames."""
        if not self._pushed.size:
            return r
        r = r.copy()
        at = 3 * self._pushed[:, None] + np.arange(3)
        r[at] = np.einsum("nkj,nj->nk", self._frames, r[at])
        return r

    def push_force(self, r: Array) -> float:
        """Force conjugate to the guide's parameter on the pushed nodes [N]. Collective.

        Args:
            r: owned part of the nodal residual.
        """
        s = self.motion.parameter if isinstance(self.motion, PrescribedMotion) else 0.0
        rate = np.array([0.0, 1.0, 2.0 * s]) @ self._push_terms
        return float(self.comm.allreduce(float(self._in_frames(r)[3 * self._pushed] @ rate)))

    def rigid_motions(self, x: Array) -> list[Any]:
        """The film's six rigid motions in q at nodal positions x (nodes, 3), orthonormal. Collective.

        Multigrid's near null space: free nodes alone move, for plates cannot go along with all six.
        """
        motions: list[Any] = []
        for k in range(6):
            e = np.eye(3)[k % 3]
            field = np.broadcast_to(e, x.shape) if k < 3 else np.cross(e, x)
            v = self.create_vector()
            with v as array:
                array[: self.free.size] = self._in_frames(field.reshape(-1)[: self.owned])[self.free]
            for other in motions:
                v.axpy(-v.dot(other), other)
            v.normalize()
            motions.append(v)
        return motions

    # --- residual -------------------------------------------------------------------------------

    def plate_forces(self, r: Array, w: Array) -> tuple[Array, Array]:
        """Gradient and curvature in w of sum r . u(w) over the rings. Collective.

        Args:
            r: owned part of the nodal residual.
            w: plate parameters.
        """
        n = len(w)
        gradient, curvature = np.zeros(n), np.zeros((n, n))
        sums = np.zeros((n // 6, 3, 4))
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

    def reduce(self, r: Array, w_gradient: Array, dw: Array, out: Vec) -> None:
        """Write J^T r into `out`: free components as they are, plates from the gradient in w."""
        if self.tied:
            r = r.copy()
            r[self._near] += r[self._far] @ self._rotation
        with out as array:
            array[: self.free.size] = self._in_frames(r)[self.free]
            if self._has_parameters:
                array[self.free.size :] = dw.T @ w_gradient

    # --- tangent --------------------------------------------------------------------------------

    @property
    def numbers(self) -> npt.NDArray[np.int64]:
        """Number in q of each component of this rank's nodes, -1 of those that are no unknowns (owned,)."""
        numbers = np.full(self.owned, -1)
        numbers[self.free] = self._offset + np.arange(self.free.size)
        return numbers

    def axes_of_nodes(self) -> Array:
        """The axes of the components of each of this rank's nodes in q, as rows (nodes, 3, 3)."""
        axes = np.broadcast_to(np.eye(3), (self.owned // 3, 3, 3)).copy()
        axes[self._pushed] = self._frames
        return axes

    def ring_of_nodes(self) -> Array:
        """Ring of each of this rank's nodes, -1 for none, and its arm there [m] (nodes, 4)."""
        found = np.full((self.owned // 3, 4), -1.0)
        for k, (nodes, arms) in enumerate(zip(self._rims, self._arms, strict=True)):
            found[nodes, 0], found[nodes, 1:] = k, arms
        return found

    def ring_derivative(self, k: int, arms: Array, w: Array, dw: Array) -> Array:
        """Derivative by y of the nodes on a ring (n, 3, y).

        Args:
            k: number of the ring.
            arms: from its centre to the nodes at rest (n, 3) [m].
            w: of `plate_parameters`.
            dw: of `plate_parameters`.
        """
        _, dR, _ = rotation(w[6 * k + 3 : 6 * k + 6])
        turned: Array = np.einsum("aij,nj->nia", dR, arms) @ dw[6 * k + 3 : 6 * k + 6]
        return turned + dw[6 * k : 6 * k + 3]

    def jacobian(self, w: Array, dw: Array) -> Any:
        """J = du/dq as a PETSc matrix, its pattern kept from call to call. Collective."""
        # the tangent, the mass and every mode of a state ask for the same one
        if self._jacobian_w is not None and np.array_equal(self._jacobian_w, w):
            return self._jacobian
        n = self.num_parameters
        counts = np.zeros(self.owned, dtype=PETSc.IntType)
        counts[self.free] = 1
        counts[3 * self._pushed[:, None] + np.arange(3)] = 2
        counts[self._far] = 3
        for nodes in self._rims:
            counts[3 * nodes[:, None] + np.arange(3)] = n
        rows = np.concatenate([[0], np.cumsum(counts)]).astype(PETSc.IntType)
        columns = np.empty(rows[-1], dtype=PETSc.IntType)
        entries = np.ones(rows[-1])
        column = self.numbers.astype(PETSc.IntType)
        columns[rows[self.free]] = column[self.free]
        at = 3 * self._pushed[:, None] + np.arange(3)
        pairs = rows[at][..., None] + np.arange(2)
        columns[pairs] = column[at[:, 1:]][:, None, :]
        entries[pairs] = self._frames[:, 1:].transpose(0, 2, 1)
        columns[rows[self._far][..., None] + np.arange(3)] = column[self._near][:, None, :]
        entries[rows[self._far][..., None] + np.arange(3)] = self._rotation
        for k, (nodes, arms) in enumerate(zip(self._rims, self._arms, strict=True)):
            block = self.ring_derivative(k, arms, w, dw)
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
