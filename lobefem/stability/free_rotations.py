"""Rigid rotations that the supports leave free, and pencils without them.

A pinned bottom plate tilts about its centre. Turned about that a balloon under gas pressure feels
nothing: its residual turns along, r(R x) = R r(x), so that along such a rotation K t = omega x r, which
is 0 in equilibrium. In the held ideal geometry, which balances up to discretisation only, t . K t is an
error of the mesh, of either sign; no sign of stability. So rotations are known by their vectors and taken
out of an eigenproblem by a constraint: with C = B t,

    [ K    C ] [ x ]            [ B  0 ] [ x ]
    [ C^T  0 ] [ m ]  = lambda  [ 0  0 ] [ m ],

whose finite eigenpairs are those of K on the motions with t . B x = 0. Where K t = 0 these are all other
eigenpairs of K, be it symmetric or not.

A sealed gas adds c f f^T to K, f = dV/dq, which would leave no zero entry. As a further border, C = sqrt(c) f
with -1 in the corner, it keeps the matrix sparse: m is what the gas's pressure changes by. The inertia
counts one negative value more for a border of either kind.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from lobefem.fem.balloon import Balloon
from lobefem.fem.rigid_motions import free_to_rotate
from lobefem.fem.rigid_plates import rotation
from lobefem.linalg.slepc import Pair
from lobefem.typing import Array, Mat, Vec

from petsc4py import PETSc

__all__ = ["FreeRotations", "rotations_in_q"]


def rotations_in_q(balloon: Balloon, q: Vec) -> list[Any]:
    """The rigid rotations about the bottom plate's centre that the supports leave, as changes of q.

    The k-th one turns the plate along its k-th tilt, and all else along with it. None where something
    holds the balloon against them. All six rigid motions of a free body adrift. Collective.
    """
    if balloon.adrift:
        balloon.set_unknowns(q)
        return balloon.map.rigid_motions(balloon.X - balloon.axis.origin + balloon.u.x.array.reshape(-1, 3))
    if not free_to_rotate(balloon):
        return []
    constraint, motion = balloon.map, balloon.motion
    assert motion is not None  # pinned
    balloon.set_unknowns(q)
    w, dw, _ = constraint.plate_parameters(constraint.parameters(q))
    arms = balloon.X + balloon.u.x.array.reshape(-1, 3) - motion.centres[0]
    top = motion.centres[1] + w[6:9] - motion.centres[0]
    found = []
    for axis in motion.across:
        omega = _spins(w[3:6]) @ axis
        rate = np.concatenate(
            [np.zeros(3), axis, np.cross(omega, top), np.linalg.solve(_spins(w[9:12]), omega)]
        )
        t = constraint.create_vector()
        free = constraint.free
        with t as array:
            array[: free.size] = np.cross(omega, arms).ravel()[free]
            if array.size > free.size:
                array[free.size :] = np.linalg.lstsq(dw, rate, rcond=None)[0]
        found.append(t)
    return found


def _spins(theta: Array) -> Array:
    """Angular velocity per rate of a rotation vector (3, 3)."""
    R, dR, _ = rotation(theta)
    return np.array([[W[2, 1], W[0, 2], W[1, 0]] for W in dR @ R.T]).T


class FreeRotations:
    """The free rotations of a balloon at q, and its matrices bordered by them.

    Args:
        balloon: whose rotations they are.
        q: where it is.
        B: symmetric positive definite; the inner product of what is orthogonal to them.

    Attributes:
        vectors: t, orthonormal by B; none where the supports leave none.
        gas: what a sealed gas adds to the tangent, a border more; None under a given pressure.

    Collective.
    """

    def __init__(self, balloon: Balloon, q: Vec, B: Mat) -> None:
        self.vectors: list[Any] = []
        self._columns: list[Any] = []  # B t
        for t in rotations_in_q(balloon, q):
            for other, column in zip(self.vectors, self._columns, strict=True):
                t.axpy(-t.dot(column), other)
            column = B.createVecLeft()
            B.mult(t, column)
            size = np.sqrt(t.dot(column))
            for v in (t, column):
                v.scale(1 / size)
            self.vectors.append(t)
            self._columns.append(column)
        self.gas = balloon.gas_stiffness(q)
        self._corners = [0.0] * len(self.vectors)
        if self.gas is not None:
            column = self.gas.vector.copy()
            column.scale(np.sqrt(self.gas.factor))
            self._columns.append(column)
            self._corners.append(-1.0)

    def __len__(self) -> int:
        return len(self._columns)

    def bordered(self, A: Mat, *, constrained: bool = True) -> Any:
        """A with the borders' rows and columns at its end; A itself where there are none. Collective.

        Args:
            A: a matrix in q.
            constrained: False for rows and columns of zeros.
        """
        if not self._columns:
            return A
        comm, k = A.getComm().tompi4py(), len(self)
        size = A.getSize()[0]
        last = comm.rank == comm.size - 1
        pointers, columns, values = A.getValuesCSR()
        if constrained:
            whole = [comm.gather(c.array_r, root=comm.size - 1) for c in self._columns]
            ends = np.repeat(pointers[1:], k)
            columns = np.insert(columns, ends, np.tile(size + np.arange(k), len(pointers) - 1))
            values = np.insert(values, ends, np.array([c.array_r for c in self._columns]).T.ravel())
            pointers = pointers + k * np.arange(len(pointers))
        for i in range(k if last else 0):  # with a diagonal entry, which a factorisation wants
            row = np.concatenate(whole[i]) if constrained else np.empty(0)
            columns = np.concatenate([columns, np.arange(len(row)), [size + i]])
            values = np.concatenate([values, row, [self._corners[i] if constrained else 0.0]])
            pointers = np.append(pointers, len(columns))
        local = A.getLocalSize()[0] + (k if last else 0)
        csr = [a.astype(PETSc.IntType) for a in (pointers, columns)]
        return PETSc.Mat().createAIJ(((local, None), (local, None)), csr=(*csr, values), comm=A.getComm())

    def cut(self, v: Vec) -> Any:
        """The part in q of a vector of a bordered matrix. Collective."""
        if not self._columns:
            return v
        x = self._columns[0].duplicate()
        x.array[:] = v.array_r[: x.getLocalSize()]
        return x

    def through(self, solve: Any, bordered: Any) -> Any:
        """A solver (b, x) in q made from one of a bordered matrix."""
        if not self._columns:
            return solve
        right, left = bordered.createVecs()

        def constrained(b: Vec, x: Vec) -> None:
            left.set(0.0)
            left.array[: b.getLocalSize()] = b.array_r
            solve(left, right)
            x.array[:] = right.array_r[: x.getLocalSize()]

        return constrained

    def pairs(self, curvature: Callable[[Any, Any], float]) -> list[Pair]:
        """The rotations as eigenpairs of K on their own span. Collective.

        Args:
            curvature: (v, u) -> v . K u; what it tells is the error of an equilibrium that is none.
        """
        if not self.vectors:
            return []
        small = np.array([[curvature(a, b) for b in self.vectors] for a in self.vectors])
        values, combined = np.linalg.eigh((small + small.T) / 2)
        found = []
        for value, share in zip(values, combined.T, strict=True):
            x, y = (self.vectors[0].duplicate() for _ in range(2))
            for v in (x, y):
                v.set(0.0)
            x.maxpy(list(share), self.vectors)
            found.append(Pair(complex(value), x, y))
        return found

    def project(self, r: Vec) -> None:
        """Take out of a residual what the constraint bears, in place. Collective."""
        for t, column in zip(self.vectors, self._columns, strict=False):
            r.axpy(-t.dot(r), column)
