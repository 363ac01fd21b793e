"""Self-contact of film and end plates by the barrier of Incremental Potential Contact, from `ipctk`.

Two parts of the film that come nearer than the activation distance d push each other off with the
energy per area

    w(g) = k d b(g^2/d^2),  b(x) = -(x - 1)^2 ln x  for x < 1, 0 beyond,

g the gap, k the stiffness [Pa] (Li et al. 2020, in the area-weighted form of Li et al. 2023, which
converges as the mesh is refined). It is smooth, zero from g = d on and infinite at g = 0: film that
starts without an intersection never gets one, provided that each step is cut where it would touch.

ipctk works on one process: nodes' positions go to rank 0, forces and Hessian come back.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from lobefem.errors import InputError, MissingDependencyError
from lobefem.fem.contact_mesh import Facets, Gathering, film_facets
from lobefem.geometry.distribute import on_root
from lobefem.linalg.matrix_sum import PatternedSum
from lobefem.model.self_contact import SelfContact
from lobefem.profiling import timed
from lobefem.typing import Array, Function, Mat, Space, Vec

from petsc4py import PETSc

__all__ = ["Contact", "ContactReport"]

# s of `Contact._around` over the activation distance
_REACH = 0.5

# share of a gap that both of its sides together may close without a search for what touches
_AWAY = 0.8

SHARE = 0.25  # of the smallest distance at rest between facets that share no node

_ILLEGAL = "1.6.1"

_GET = f"pip install 'ipctk>=1.6,!={_ILLEGAL}'"

_FAILED = "ipctk failed ({}); try a smaller step"


@dataclass(frozen=True)
class ContactReport:
    """Contact in one state.

    Attributes:
        gap: smallest distance between facets that share no node [m].
        force: sum of the nodal contact forces' sizes over one of the two sides [N].
        area: reference area of one side, lumped to the nodes that a contact force acts on [m^2].
        energy: of the barrier [J].
        pairs: vertex-facet and edge-edge pairs nearer than the activation distance.
    """

    gap: float
    force: float
    area: float
    energy: float
    pairs: int


class Contact:
    """The barrier between the facets of one balloon's film and plates.

    Every method takes nodal displacements, a `dolfinx.fem.Function` or its array, and remembers what
    it found for the last ones.

    Args:
        part: activation distance and stiffness.
        V: vector function space of the displacement.
        rims: nodes (owned or ghosts) of the rims that plates close.
        pressure: () -> the pressure that scales the default stiffness [Pa].

    Attributes:
        rest_gap: smallest distance at rest between facets that share no node [m].
        activation: activation distance [m].
        new_pattern: whether the last `add_hessian` changed its matrix's non-zero pattern.

    Raises:
        InputError: an activation distance that film at rest would feel.
        MissingDependencyError: ipctk is not there.

    Collective.
    """

    def __init__(
        self,
        part: SelfContact,
        V: Space,
        rims: tuple[npt.NDArray[np.int32], ...] = (),
        pressure: Callable[[], float] = lambda: 0.0,
    ) -> None:
        self._ipctk = _import_ipctk()
        self.part, self._pressure = part, pressure
        self.comm = V.mesh.comm
        self._nodes = Gathering(V)
        facets = film_facets(V, rims)
        self._mesh: Any = self._on_root(lambda: self._collision_mesh(facets))
        self._found: dict[str, Any] = {}
        self._sums: dict[tuple[int, int], PatternedSum] = {}
        self._last: Array | None = None
        self._candidates: tuple[Array, Any] | None = None
        self.new_pattern = False
        self.activation = 0.0
        self.rest_gap = self.gap(np.zeros(self._nodes.owned))
        self.activation = SHARE * self.rest_gap if part.activation is None else part.activation
        if self.activation >= self.rest_gap:
            raise InputError(
                f"the contact's activation distance {self.activation:g} m reaches over the smallest gap of "
                f"the film at rest, {self.rest_gap:.3g} m; try {SHARE * self.rest_gap:.2g} m or a finer seam"
            )
        self._found.clear()

    def _collision_mesh(self, facets: Facets | None) -> Any:
        assert facets is not None  # on rank 0
        self._ipctk.set_logger_level(self._ipctk.LoggerLevel.error)
        # sums in the same order in every run; the other cores belong to the other ranks
        self._ipctk.set_num_threads(1)
        rest = facets.follow @ facets.x
        edges = self._ipctk.edges(facets.triangles)
        return self._ipctk.CollisionMesh(rest, edges, facets.triangles, facets.follow)

    def _on_root[T](self, build: Callable[[], T]) -> T | None:
        return on_root(self.comm, build, _FAILED)

    # --- what is near what ----------------------------------------------------------------------

    @property
    def stiffness(self) -> float:
        """Barrier stiffness k [Pa] at the present pressure."""
        return self.part.stiffness if self.part.stiffness is not None else max(self._pressure(), 1.0)

    def _move(self, u: Function) -> None:
        """Forget what was found for other displacements. Collective."""
        whole = self._nodes.gather(_array(u))
        moved = self._last is None or not np.array_equal(whole, self._last) if whole is not None else None
        if self.comm.bcast(moved, root=0):
            if self._found.get("hessian") is not None:
                self._found["hessian"].destroy()
            self._found = {}
            self._last = whole

    def _look_up(self, name: str, build: Callable[[], Any]) -> Any:
        if name not in self._found:
            self._found[name] = build()
        return self._found[name]

    @property
    def _x(self) -> Array:
        """Positions of all collision vertices, on rank 0."""
        return self._look_up("x", lambda: self._mesh.displace_vertices(self._last))

    def _no_pairs(self) -> Any:
        found = self._ipctk.NormalCollisions()
        found.use_area_weighting = True
        found.collision_set_type = self._ipctk.NormalCollisions.IMPROVED_MAX_APPROX
        return found

    def _pairs_within(self, distance: float) -> Any:
        found = self._no_pairs()
        found.build(self._mesh, self._x, distance)
        return found

    def _around(self, x: Array, *others: Array) -> Any:
        """Candidates for contact at x, None where they miss some on the way to other positions. On rank 0.

        The pairs nearer than d + 2 s, d the activation distance, are found by the broad phase once. While
        no node is farther than s from where it was then, every other pair is d apart at least: the list
        (Verlet 1967) holds all that is felt, and all that can touch on a straight way between two such
        positions.
        """
        reach = _REACH * self.activation

        def within(there: Array) -> bool:
            return float(np.square(there - centre).sum(axis=1).max()) <= reach**2

        centre, found = self._candidates or (x, None)
        if found is None or not within(x):
            centre, found = x, self._ipctk.Candidates()
            # each of two boxes is made larger by this
            found.build(self._mesh, x, self.activation / 2 + reach)
            self._candidates = centre, found
        return found if all(map(within, others)) else None

    @property
    def _pairs(self) -> Any:
        def build() -> Any:
            found = self._no_pairs()
            found.build(self._around(self._x), self._mesh, self._x, self.activation)
            return found

        return self._look_up("pairs", build)

    @property
    def _barrier(self) -> Any:
        return self._ipctk.BarrierPotential(self.activation, 1.0, True)

    @property
    def _least(self) -> float:
        """Smallest distance between facets that share no node, at most the activation distance. On rank 0."""
        if self._pairs.empty():
            return self.activation
        return math.sqrt(self._pairs.compute_minimum_distance(self._mesh, self._x))

    # --- energy and its derivatives -------------------------------------------------------------

    @timed("contact")
    def energy(self, u: Function) -> float:
        """Energy of the barrier [J], infinite where the film intersects itself. Collective."""
        self._move(u)

        def build() -> float:
            if self._crossed():
                return math.inf
            return self._barrier(self._pairs, self._mesh, self._x)

        return self.stiffness * self._look_up("energy", lambda: self.comm.bcast(self._on_root(build), root=0))

    @timed("contact")
    def gradient(self, u: Function) -> Array:
        """Gradient of the energy in the displacements that this rank owns (3 nodes,) [N]. Collective."""
        self._move(u)

        def build() -> Array:
            return self._mesh.to_full_dof(self._barrier.gradient(self._pairs, self._mesh, self._x))

        unit = self._look_up("gradient", lambda: self._nodes.scatter(self._on_root(build)))
        return self.stiffness * unit

    @timed("contact")
    def hessian(self, u: Function) -> Any:
        """Hessian of the energy for k = 1 as a PETSc matrix, None where nothing is near. Collective.

        It is exact, as eigenvalues need it; Newton's method took two to three times as many steps
        with the usual projection of each pair's Hessian to its positive part.
        """
        self._move(u)

        def build() -> Any:
            if self._pairs.empty():
                return None
            return self._mesh.to_full_dof(self._barrier.hessian(self._pairs, self._mesh, self._x))

        def assemble() -> Any:
            whole = self._on_root(build)
            if not self.comm.bcast(whole is not None, root=0):
                return None
            rows, columns, values = self._nodes.scatter_rows(whole)
            csr = (rows.astype(PETSc.IntType), columns.astype(PETSc.IntType), values)
            sizes = ((self._nodes.owned, None), (self._nodes.owned, None))
            return PETSc.Mat().createAIJ(sizes, csr=csr, comm=self.comm)

        return self._look_up("hessian", assemble)

    def second_variation(self, u: Function, dv: Vec, du: Vec) -> float:
        """Second variation of the energy along two nodal displacements, PETSc vectors [J]. Collective."""
        H = self.hessian(u)
        if H is None:
            return 0.0
        Hu = H.createVecLeft()
        H.mult(du, Hu)
        return self.stiffness * dv.dot(Hu)

    @timed("contact")
    def add_hessian(self, tangent: Mat, J: Mat, u: Function, slot: int) -> Any:
        """The sum of a reduced tangent and k J^T H J. Collective.

        The same matrix for every call with a slot, whose pattern follows the contact.

        Args:
            tangent: without contact; kept as it is.
            J: the constraint map's Jacobian du/dq.
            u: displacements.
            slot: see `Balloon.tangent`.
        """
        H = self.hessian(u)
        # balloons under a distortion share the contact, each with unknowns of its own
        total = self._sums.setdefault((slot, tangent.getSize()[0]), PatternedSum())
        if H is None:
            matrix = total.set(tangent)
        else:
            reduced = H.ptap(J)
            matrix = total.set(tangent, reduced, self.stiffness)
            reduced.destroy()
        self.new_pattern = total.new_pattern
        return matrix

    # --- steps ----------------------------------------------------------------------------------

    def _crossed(self) -> bool:
        return self._look_up("crossed", lambda: self._ipctk.has_intersections(self._mesh, self._x))

    def intersects(self, u: Function) -> bool:
        """True if an edge of film or plates passes through a facet (ipctk's own test). Collective."""
        self._move(u)
        return self.comm.bcast(self._on_root(self._crossed), root=0)

    @timed("contact")
    def free_share(self, start: Function | Array, end: Function | Array, away: float = _AWAY) -> float:
        """Share of a straight step that the film can go without touching itself. Collective.

        By continuous collision detection, which leaves a part of each gap open.

        Args:
            start: displacements, free of intersections.
            end: displacements at the end of the whole step.
            away: share of the smallest gap that its two sides together may close without a search.

        Returns:
            1 where the whole step is free.
        """
        self._move(start)
        there = self._nodes.gather(_array(end))

        def build() -> float:
            end_x = self._mesh.displace_vertices(there)
            way = float(np.square(end_x - self._x).sum(axis=1).max())
            if 4 * way < away**2 * self._least**2:
                return 1.0
            # additive CCD: the default, tight inclusion, takes seconds where film almost touches
            ccd = self._ipctk.AdditiveCCD()
            # of the end first: its pairs are asked for next
            near = self._around(end_x, self._x)
            if near is not None:
                return near.compute_collision_free_stepsize(self._mesh, self._x, end_x, narrow_phase_ccd=ccd)
            return self._ipctk.compute_collision_free_stepsize(
                self._mesh, self._x, end_x, narrow_phase_ccd=ccd
            )

        return self.comm.bcast(self._on_root(build), root=0)

    # --- report ---------------------------------------------------------------------------------

    def gap(self, u: Function) -> float:
        """Smallest distance between facets that share no node [m]. Collective."""
        self._move(u)

        def build() -> float:
            if self.activation and not self._pairs.empty():
                return self._least
            edges = self._x[self._mesh.edges]
            radius = 0.1 * float(np.linalg.norm(edges[:, 0] - edges[:, 1], axis=1).min())
            reach = float(np.linalg.norm(np.ptp(self._x, axis=0)))
            while (near := self._pairs_within(radius)).empty():
                if radius > reach:
                    return math.inf
                radius *= 1.5
            return math.sqrt(near.compute_minimum_distance(self._mesh, self._x))

        return self._look_up("gap", lambda: self.comm.bcast(self._on_root(build), root=0))

    @timed("contact")
    def measure(self, u: Function) -> ContactReport:
        """Gap, force, area and energy of the contact. Collective."""
        gap, energy = self.gap(u), self.energy(u)

        def build() -> tuple[float, float, int]:
            unit = self._barrier.gradient(self._pairs, self._mesh, self._x).reshape(-1, 3)
            size = np.linalg.norm(unit, axis=1)
            areas = np.asarray(self._mesh.vertex_areas)
            return float(size.sum()) / 2, float(areas[size > 0].sum()) / 2, len(self._pairs)

        force, area, pairs = self.comm.bcast(self._on_root(build), root=0)
        return ContactReport(gap, self.stiffness * force, area, energy, pairs)


def _array(u: Function | Array) -> Array:
    return u if isinstance(u, np.ndarray) else u.x.array


def _import_ipctk() -> Any:
    try:
        import ipctk
    except ImportError as error:
        raise MissingDependencyError(f"self-contact needs ipctk ({error}); run: {_GET}") from error
    if getattr(ipctk, "__version__", "") == _ILLEGAL:
        raise MissingDependencyError(
            f"the wheels of ipctk {_ILLEGAL} end the process on a processor without AVX-512; run: {_GET}"
        )
    return ipctk
