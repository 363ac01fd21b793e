"""All modes of one harmonic from one sector of a cyclic mesh (docs/theory/harmonics.md).

A structured surface consists of N equal sectors, turned by alpha = 2 pi/N from one to the next. In a
motion of harmonic n sector j does what sector 0 does, turned by j alpha and multiplied by
e^{i n alpha j}. So the motion of one sector of cells follows from the unknowns q_n on its near side
and inside: q = J_n q_n, its far side being the near side turned, times e^{i n alpha}; and with K the
tangent of that one sector's energy

    K_n = N J_n^H K J_n

is the full model's tangent on all motions of harmonic n. Plates enter n = 0 (spin, axial) and n = 1
(sway, tilt) only; hoops lie within the sector. No full model is assembled, let alone factorised.
Eigenvalues of harmonic -n are the conjugates of those of n.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
import scipy.sparse as sp

from lobefem import checks
from lobefem.errors import InputError
from lobefem.fem.balloon import Balloon
from lobefem.fem.cyclic_symmetry import plate_basis
from lobefem.fem.cylindrical import cylindrical
from lobefem.fem.functionals import displacement_of
from lobefem.frozen import Frozen
from lobefem.geometry.orientation import CORNERS
from lobefem.geometry.stacks import sector_of
from lobefem.linalg.banded import as_scipy
from lobefem.linalg.dolfinx_compat import geometry_dofmap
from lobefem.model.end_plates import PlateLoad
from lobefem.model.self_contact import SelfContact
from lobefem.stability.free_rotations import rotations_in_q
from lobefem.typing import Array, ComplexArray, Indices, Integers, Sparse, Vec

from mpi4py import MPI

__all__ = ["Sector", "own_pairs", "sector_balloon"]

_ALIKE = "a single harmonic needs all sectors held alike; leave harmonics out, or hold whole rings of nodes"


def sector_balloon(balloon: Balloon) -> Balloon:
    """One sector of a balloon: the same film and parts on `sector_of` its surface.

    Raises:
        InputError: the surface has no equal sectors, or the film's frame or stress or the plates' load
            is given by hand.
    """
    if balloon.surface.copies != 1:
        return balloon.untied()
    if balloon.prescribed is not None:
        raise InputError(
            f"the balloon is under a {balloon.prescribed.kind}; its modes are of no single harmonic"
        )
    if any(given is not None for given in (balloon.specification.frame, balloon.pattern, balloon.layers)):
        raise InputError("a single harmonic needs film as drawn; leave frame, pattern and layers out")
    if balloon.film.varying:
        raise InputError(
            "a single harmonic needs film that is the same everywhere; give numbers as E and thickness"
        )
    if balloon.extra_energy is not None or balloon.specification.parts.own:
        what = "an extra_energy" if balloon.extra_energy is not None else "a component of your own"
        raise InputError(
            f"{what} need not be the same in all sectors; leave it out, or look at all modes at once"
        )
    if balloon.load_path is not None or any(isinstance(part, PlateLoad) for part in balloon.components):
        raise InputError("a single harmonic is of the shape as drawn; leave load_path and PlateLoad out")
    sector = sector_of(balloon.surface, balloon.axis)
    for cables in balloon.cables:
        wanted = cables.groups(balloon.surface)
        # a sector is meshed anew, without the edges that a user has named
        if not sector.groups.keys() >= set(wanted) or cables.groups(sector) != wanted:
            raise InputError(
                f"cables on {', '.join(cables.on)} lie on edges that one sector lacks; leave harmonics out"
            )
    # film that does not touch itself feels no contact; `restrict` refuses states in which it does
    components = [part for part in balloon.components if not isinstance(part, SelfContact)]
    return balloon.with_changes(surface=sector, components=components).untied()


@dataclass(frozen=True)
class _Places(Frozen):
    """Places of nodes: sector, key within it, distance from the axis, cylindrical frame."""

    sector: Integers
    keys: Integers
    radius: Array
    frame: Array


class Sector:
    """One sector of a balloon and the phases that close it, the same on every rank.

    Args:
        balloon: the sector's, from `sector_balloon`, or a whole one on a cyclic mesh.

    Attributes:
        balloon: the sector's balloon, on this rank alone.
        order: number N of sectors.
        num_slots: nodes that are free in a sector, far side left out.
        columns: nodes on a ring of a sector, far side left out. With several of them, on quadratic cells
            say, K_n holds N - n, N + n, ... too: `share` tells them apart.

    Raises:
        InputError: the surface has no equal sectors, or nodes elsewhere than in them, a node is held in some
            components only, or one in one sector alone.

    Collective.
    """

    def __init__(self, balloon: Balloon) -> None:
        self.balloon = sector_balloon(balloon)
        self.order = self.balloon.surface.cyclic_order or 1  # `sector_balloon` has refused others
        constraint = self.balloon.map
        self._span = float(np.abs(cylindrical(self.balloon)[1]).max())
        places = self._places(self.balloon)
        near = places.sector == 0
        self._table = places.keys[near][_order(places.keys[near])]
        self.num_slots = len(self._table)
        self._far = ~near
        inside = np.unique(np.round(self._table[:, 1], -1))
        self.columns = len(inside)
        self._slot = self._match(places)
        num, params = len(self._slot), constraint.num_parameters
        rows = np.repeat(np.arange(3 * num), 3)
        columns = (3 * self._slot[:, None, None] + np.arange(3)).repeat(3, axis=1)
        entries = np.swapaxes(places.frame, 1, 2)  # Cartesian from cylindrical components
        self._turn = sp.csr_matrix(
            (entries.ravel(), (rows, columns.ravel())), shape=(3 * num + params, 3 * self.num_slots)
        )
        self._compare_shape(balloon)
        if balloon.surface.copies == 1:
            self._compare(balloon)

    @property
    def harmonics(self) -> range:
        """All harmonics of the mesh, 0 to half the number of nodes on a ring."""
        return range(self.columns * self.order // 2 + 1)

    def check(self, harmonic: int) -> None:
        """Refuse a harmonic that the mesh does not have, by an InputError."""
        highest = self.harmonics[-1]
        if checks.integer("a harmonic", harmonic, 0) > highest:
            raise InputError(
                f"harmonic = {harmonic}: a mesh of {self.order} equal sectors has harmonics 0 to "
                f"{highest}; try more divisions around"
            )

    def copies(self, harmonic: int) -> int:
        """Multiplicity in the full model of each eigenvalue of a harmonic: of n and of -n."""
        return 1 if harmonic == 0 or 2 * harmonic == self.columns * self.order else 2

    def share(self, vector: ComplexArray, harmonic: int) -> float:
        """Share of a harmonic, or its opposite, in a vector of K_n: 1 where a ring has one node a sector."""
        if self.columns == 1:
            return 1.0
        field = vector[: 3 * self.num_slots].reshape(-1, 3)
        angle = 2e-6 * np.pi / self.order * self._table[:, 1]
        ring = np.cumsum(np.diff(self._table[:, 0], prepend=self._table[0, 0]) > 3)
        power = 0.0
        twice = 2 * harmonic % self.order == 0 and 2 * harmonic % (self.columns * self.order)
        for n in (harmonic, -harmonic) if twice else (harmonic,):
            part = np.zeros((ring[-1] + 1, 3), dtype=complex)
            np.add.at(part, ring, field * np.exp(-1j * n * angle)[:, None])
            power += float((np.abs(part) ** 2).sum()) / self.columns
        whole = float((np.abs(field) ** 2).sum())
        return power / whole if whole else 1.0  # of the plates alone

    def num_plates(self, harmonic: int) -> int:
        """Number of the plates' unknowns in a harmonic: the last ones of q_n."""
        return int(self.plate_basis(harmonic).shape[1])

    def jacobian(self, harmonic: int) -> Any:
        """J_n: from q_n (cylindrical components of the slots, then plates) to the sector's q.

        Raises:
            InputError: n out of range.
        """
        self.check(harmonic)
        phase = np.ones(self._turn.shape[0], dtype=complex)
        phase[: 3 * len(self._far)][np.repeat(self._far, 3)] = np.exp(2j * np.pi * harmonic / self.order)
        film: Any = sp.diags(phase) @ self._turn
        basis = self.plate_basis(harmonic)
        if not basis.shape[1]:
            return film.tocsr()
        plates: Any = sp.vstack([sp.csr_matrix((3 * len(self._far), basis.shape[1])), sp.csr_matrix(basis)])
        return sp.hstack([film, plates]).tocsr()

    def reduce(self, matrix: Sparse, harmonic: int) -> Any:
        """A_n = N J_n^H A J_n of a SciPy or PETSc matrix in the sector's q, as a SciPy matrix."""
        J = self.jacobian(harmonic)
        return (self.order * (J.conj().T @ as_scipy(matrix) @ J)).tocsr()

    def curvature(self, q: Vec, left: ComplexArray, right: ComplexArray, harmonic: int) -> complex:
        """z^H K_n x, integrated over the film without assembling K (see `Balloon.second_variation`).

        Args:
            q: the sector's q.
            left: z, in q_n.
            right: x, in q_n.
            harmonic: n.
        """
        J = self.jacobian(harmonic)
        vectors = []
        for values in (J @ left, J @ right):
            for part in (values.real, values.imag):
                vectors.append(self.balloon.map.create_vector())
                vectors[-1].array[:] = part
        z_re, z_im, x_re, x_im = vectors
        form = self.balloon.second_variation
        real = form(q, z_re, x_re) + form(q, z_im, x_im)
        imag = form(q, z_re, x_im) - form(q, z_im, x_re)
        return self.order * complex(real, imag)

    def rotation(self, q: Vec, mass: Sparse, harmonic: int) -> ComplexArray | None:
        """The rigid rotation that the supports leave, in q_n; None without one.

        The whole balloon's two make one complex wave of n = 1 and its conjugate.

        Args:
            q: a state of the sector.
            mass: M_n, by which its length is 1.
            harmonic: n.
        """
        turns = rotations_in_q(self.balloon, q) if harmonic == 1 else []
        if not turns:
            return None
        J = self.jacobian(1)
        weights = np.asarray(abs(J).power(2).sum(axis=0)).ravel()  # its columns are orthogonal
        found: ComplexArray = J.conj().T @ (turns[0].array_r + 1j * turns[1].array_r) / weights
        return found / np.sqrt(np.vdot(found, mass @ found).real)

    def displacement(self, vector: ComplexArray, harmonic: int) -> ComplexArray:
        """The sector's nodal displacements (nodes, 3) of a vector q_n, in the reference shape."""
        q = self.jacobian(harmonic) @ vector
        zero = self.balloon.map.create_vector()
        components = []
        for values in (q.real, q.imag):
            dq = self.balloon.map.create_vector()
            dq.array[:] = values
            components.append(displacement_of(self.balloon, zero, dq))
        return components[0] + 1j * components[1]

    def expand(self, whole: Balloon, vector: ComplexArray, harmonic: int) -> tuple[Any, Any]:
        """The whole balloon's q, real and imaginary part, of a vector q_n. Collective.

        Args:
            whole: the balloon that this is a sector of.
            vector: q_n.
            harmonic: n.
        """
        places = self._places(whole)
        local = vector[: 3 * self.num_slots].reshape(-1, 3)[self._match(places)]
        local = local * np.exp(2j * np.pi * harmonic / self.order * places.sector)[:, None]
        values = np.einsum("nij,ni->nj", places.frame, local).ravel()
        if whole.map.num_parameters and whole.comm.rank == whole.comm.size - 1:
            values = np.concatenate([values, self.plate_basis(harmonic) @ vector[3 * self.num_slots :]])
        real, imag = whole.map.create_vector(), whole.map.create_vector()
        real.array[:], imag.array[:] = values.real, values.imag
        return real, imag

    def restrict(self, whole: Balloon, q: Vec) -> Any:
        """The sector's q of a whole balloon's state that is the same in every sector. Collective.

        Raises:
            InputError: the state differs from sector to sector.
        """
        if whole.map.tied:  # the state of one sector: the same film, its cuts untied
            whole.set_unknowns(q)
            return self.balloon.unknowns_of(whole)
        if whole.contact is not None:
            whole.set_unknowns(q)
            if whole.contact.measure(whole.u).pairs:
                raise InputError("the film touches itself, so harmonics are coupled; leave harmonics out")
        places = self._places(whole)
        slot = self._match(places)
        local = np.einsum("nij,nj->ni", places.frame, q.array_r[: 3 * len(slot)].reshape(-1, 3))
        table, count = np.zeros((self.num_slots, 3)), np.zeros(self.num_slots)
        np.add.at(table, slot, local)
        np.add.at(count, slot, 1.0)
        table = whole.comm.allreduce(table) / whole.comm.allreduce(count)[:, None]
        size = float(whole.comm.allreduce(np.abs(local).max(initial=0.0), op=MPI.MAX))
        off = float(whole.comm.allreduce(np.abs(local - table[slot]).max(initial=0.0), op=MPI.MAX))
        # Newton's method leaves 1e-8 of the motion
        if off > 1e-6 * size + 1e-12 * self._span:
            raise InputError(
                f"the state differs from sector to sector by {off:.2g} m, so its modes are not those of "
                "single harmonics; leave harmonics out"
            )
        own = self.balloon.map.create_vector()
        own.array[:] = self._turn @ table.ravel()
        parameters = whole.map.parameters(q)
        if parameters.size:
            own.array[-parameters.size :] = parameters
        return own

    def cut_weights(self) -> Array:
        """Share of the sector in each of its nodes, held ones included: a half on both of its cuts."""
        turns = np.mod(cylindrical(self.balloon)[0], 2 * np.pi) * self.order / (2 * np.pi)
        inside = np.abs(turns - np.round(turns)) > 1e-6
        return np.where(inside, 1.0, 0.5)

    def plate_basis(self, harmonic: int) -> ComplexArray:
        """Plate parameters (rows) that move in a harmonic (columns).

        With n = 0 those along the axis, with n = 1 the pairs across it as x + i y, which is what turns
        with e^{i theta}.
        """
        return plate_basis(self.balloon.motion, self.balloon.axis, harmonic)

    def _places(self, balloon: Balloon) -> _Places:
        """Of the free nodes that this rank owns. Collective."""
        constraint = balloon.map
        nodes = np.unique(constraint.free // 3)
        whole = np.array_equal(constraint.free, (3 * nodes[:, None] + np.arange(3)).ravel())
        if not balloon.comm.allreduce(whole, op=MPI.LAND):
            raise InputError("a single harmonic needs nodes that are free or held in all components")
        return self._lie(balloon, nodes)

    def _lie(self, balloon: Balloon, nodes: Integers | Indices) -> _Places:
        """Of some of the nodes that this rank owns."""
        return self._lie_at(balloon, _own_nodes(balloon)[nodes])

    def _lie_at(self, balloon: Balloon, x: Array) -> _Places:
        angle, height, radius, frame = balloon.axis.cylindrical(x)
        turns = np.mod(angle, 2 * np.pi) * self.order / (2 * np.pi)
        sector = np.floor(turns + 1e-6).astype(np.int64)
        inside = np.round((turns - sector) * 1e6).astype(np.int64)
        keys = np.stack([np.round(height / self._span * 1e7).astype(np.int64), inside], axis=1)
        return _Places(sector % self.order, keys, radius, frame)

    def _compare_shape(self, balloon: Balloon) -> None:
        """Refuse a balloon whose nodes, held or not, or cells are not those of equal sectors. Collective."""
        for what, places in (("nodes", _own_nodes), ("cells", _middles)):
            own, whole = (self._lie_at(one, places(one)) for one in (self.balloon, balloon))
            near = np.flatnonzero(own.sector == 0)
            near = near[_order(own.keys[near])]
            slot = _found(own.keys[near], whole.keys)
            off = (slot < 0) | (np.abs(whole.radius - own.radius[near][slot]) > 1e-7 * self._span)
            if count := balloon.comm.allreduce(int(off.sum())):
                raise InputError(
                    f"a single harmonic needs equal sectors of the shape as drawn, and {count} {what} lie "
                    "elsewhere; leave harmonics out"
                )

    def _compare(self, whole: Balloon) -> None:
        """Refuse a balloon of which one sector holds other nodes than the next. Collective."""
        slot = _found(self._table, self._places(whole).keys)
        count = np.bincount(slot[slot >= 0], minlength=self.num_slots)
        count = whole.comm.allreduce(count)
        if whole.comm.allreduce(bool((slot < 0).any()), op=MPI.LOR) or (count != self.order).any():
            raise InputError(_ALIKE)

    def _match(self, places: _Places) -> Integers:
        """Slot of each node, of one sector or, after `_compare`, of all."""
        slot = _found(self._table, places.keys)
        if (slot < 0).any():
            raise InputError(_ALIKE)
        return slot


def _own_nodes(balloon: Balloon) -> Array:
    """Places of the nodes that this rank owns."""
    return balloon.X[: balloon.V.dofmap.index_map.size_local]


def _middles(balloon: Balloon) -> Array:
    """Means of the corners of the cells that this rank owns: which nodes a cell joins shows in them."""
    mesh = balloon.mesh
    dofmap = geometry_dofmap(mesh)[: mesh.topology.index_map(2).size_local]
    return mesh.geometry.x[dofmap[:, CORNERS[dofmap.shape[1]]]].mean(axis=1)


def _order(keys: Integers) -> Integers:
    """The order of a table of keys."""
    return np.lexsort(keys.T[::-1])


def _found(table: Integers, keys: Integers) -> Integers:
    """Row of an ordered table for each key, -1 where there is none; rounding may have moved a key by one."""
    result = np.full(len(keys), -1, dtype=np.int64)
    weights = np.array([1 << 24, 1])  # one number for a pair, in the order of the table
    codes = table @ weights
    for shift in product((0, -1, 1), repeat=2):
        wanted = (keys + shift) @ weights
        at = np.minimum(np.searchsorted(codes, wanted), len(codes) - 1)
        hit = (codes[at] == wanted) & (result < 0)
        result[hit] = at[hit]
    return result


def own_pairs(
    sector: Sector, harmonic: int, find: Callable[[int], tuple[Any, ...]], count: int, size: int
) -> tuple[Any, ...]:
    """The first `count` eigenpairs that are mostly of a harmonic.

    Args:
        sector: whose problem it is.
        harmonic: n.
        find: count -> values, vectors in columns, and left vectors or None, in order.
        count: how many are wanted; fewer come back where there are fewer.
        size: of the problem.
    """
    wanted = count
    while True:
        values, vectors, *rest = find(min(wanted, size))
        own = [k for k in range(len(values)) if sector.share(vectors[:, k], harmonic) > 0.5][:count]
        if len(own) == count or wanted >= size:
            return (values[own], vectors[:, own], *(None if v is None else v[:, own] for v in rest))
        wanted *= 4
