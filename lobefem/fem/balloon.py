"""`Balloon`: surface, film and parts put together as energy, residual and tangent in q.

All that has an energy is written once as an energy; residual and tangent are its derivatives. Only
the `film` pressure, and a film law written as a stress, are residuals of their own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import fields, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from lobefem.display import Summarized, Summary
from lobefem.errors import InputError
from lobefem.fem.boundary_conditions import constraint_map, edge_nodes, plate_motion
from lobefem.fem.constraint_map import ConstraintMap
from lobefem.fem.contact_potential import Contact
from lobefem.fem.discretization import Discretization
from lobefem.fem.film_assembly import FilmAssembly
from lobefem.fem.free_body import require_afloat, six_components
from lobefem.fem.gas_access import GasAccess
from lobefem.fem.own_components import further_energy, nodal_forces
from lobefem.fem.plate_loads import PlateForces
from lobefem.fem.prescribed_motion import PrescribedMotion
from lobefem.fem.reduced_matrix import Product, Reduction, reduction
from lobefem.fem.specification import LoadPath, Specification
from lobefem.fem.ufl_access import UflAccess
from lobefem.fem.weak_forms import WeakForms, film_measure
from lobefem.frozen import OnMesh
from lobefem.geometry.surface import Surface
from lobefem.geometry.surface_checks import examine
from lobefem.linalg import petsc
from lobefem.linalg.assembly import integral, together, totals
from lobefem.model.end_plates import PlateLoad
from lobefem.model.film import Film
from lobefem.model.gas_pressure import film_volume
from lobefem.model.kinematics import Frame
from lobefem.model.self_contact import SelfContact
from lobefem.profiling import timed
from lobefem.typing import Array, Expr, Indices, Mass, Vec

from dolfinx import fem

__all__ = ["Balloon"]


class Balloon(GasAccess, Discretization, UflAccess, OnMesh, Summarized):
    """A film surface with its load, cables, plates and supports.

    Args:
        surface: where the film lies (`lobefem.geometry.surface`).
        film: its law.
        components: at most one `GasPressure` (default "closed"), any number of `Cables` and `Fixed`, at
            most one `EndPlates`, with moving ones at most one `PlateLoad`, at most one `SelfContact`; any
            number of one's own (`lobefem.model.components.OwnComponent`); one alone needs no brackets.
        prestressed: build the lobe's own stress into the film, N_phi = p0 R0^2/(2 R) for an isotensoid
            (paper eq. 4), and the matching tension into the cables; p0 is the `prestress` of a state.
        hoop_slack: hoop slack s >= 0 of a film with built-in stress (strain); of one without it 0.
        load_path: a state found with a `PrescribedPath` film on this surface; its stress is built into
            the film, which carries it in that state's shape (paper sec. 4).
        frame: the film's frame; by default that of a surface of revolution about the axis.
        quadrature_degree: for the film's energy; by default exact for the element where it can be.
        pattern: flat coordinates (two components) in which the film is free of stress, as a function of
            the mesh (`lobefem.model.cutting_pattern`) [m]; by default the film is so as it was drawn.
        layers: number of layers of film, as a function of the mesh; by default one everywhere.
        extra_energy: a further energy [J], from the balloon to a UFL form in its `u` and measures: an elastic
            foundation, a spring, another load.

    Attributes:
        specification: these arguments, checked.
        V, u: space and function of the displacement [m].
        dx: measure of the film, with its quadrature rule.
        X: positions of V's nodes at rest, ghosts included (nodes, 3) [m].
        axis: where the surface stands, see `lobefem.geometry.surface.Surface`.
        floating: whether it is a `FreeBody`, of which six components are held without a reaction.
        adrift: whether these are free here: see `afloat`.
        x, direction: of a point of the film from the axis's origin, and the axis, in UFL.
        map: from the unknowns q to u.
        gas: a `SealedGas`, None under a given pressure: see `with_gas`.
        w: displacements [m] and rotations of the two plates as this balloon set them last (12,).
        assembly: vectors and matrices of the film, shared with the same balloon under another map.
        reference_area, reference_volume: of the surface at rest [m^2, m^3].

    Raises:
        InputError: parts that do not go together, or a surface that is not what it claims.

    Collective.
    """

    @timed("set-up")
    def __init__(
        self,
        surface: Surface,
        film: Film,
        components: Sequence[Any] = (),
        *,
        prestressed: bool = False,
        hoop_slack: float = 0.0,
        load_path: LoadPath | None = None,
        frame: Frame | None = None,
        quadrature_degree: int | None = None,
        pattern: Expr | None = None,
        layers: Expr | None = None,
        extra_energy: Callable[[Balloon], Any] | None = None,
    ) -> None:
        given = Specification(
            surface,
            film,
            components,
            prestressed,
            hoop_slack,
            load_path,
            frame,
            quadrature_degree,
            pattern,
            layers,
            extra_energy,
        )
        petsc.tidy(surface.mesh.comm)
        petsc.watch(self, surface.mesh)
        self.specification, parts = given, given.parts
        self.surface, self.film, self.prestressed = surface, film, prestressed
        self.components, self.hoop_slack, self.load_path = given.components, hoop_slack, load_path
        self.pattern, self.layers, self.extra_energy = pattern, layers, extra_energy
        self.cables, self.fixed, self.load = parts.cables, parts.fixed, parts.load
        self.plates, self.weight = parts.plates, parts.weight
        axis = examine(surface, self.plates is not None)
        super().__init__(surface, axis, frame)
        self.motion = plate_motion(surface, self.plates, axis) if self.plates is not None else None
        self.plate_forces = self._plate_forces(parts.plate_load)
        self.free: Balloon | None = None
        tied = axis if surface.copies > 1 else None
        self.floating, self.adrift = parts.free is not None, False
        loose: Indices = np.empty(0, dtype=np.int32)
        if self.floating:
            require_afloat(given)
            loose = six_components(self.V, self.X)
        self.map = constraint_map(self.V, self.X, surface, self.fixed, self.motion, tied=tied, six=loose)
        self.w, _, _ = self.map.plate_parameters(np.zeros(self.map.num_parameters))
        self.contact: Contact | None = (
            self._self_contact(parts.contact) if parts.contact is not None else None
        )
        self.dx = film_measure(given, self)
        self.forms = WeakForms(given, self, self.dx, further_energy(given, self))
        self.assembly = FilmAssembly(
            self.forms, self.pressure, self.prestress, self.contact, nodal_forces(given, self)
        )
        self._tangents: dict[int, Reduction | Product] = {}
        wanted = self.forms.area_of_film * fem.Constant(self.mesh, 1.0), film_volume(self.x, self.frame)
        form = together(self.mesh, *((f, self.dx) for f in wanted))
        self.reference_area, self.reference_volume = map(float, totals(self.mesh, form))
        self.reference_volume += self.motion.volume if self.motion else 0.0

    def remeshed(self, surface: Surface) -> Balloon:
        """The same film and parts on another surface. Collective.

        Raises:
            InputError: a frame, a load path, a pattern, layers or film parameters of its own surface.
        """
        if self.specification.bound_to_mesh:
            raise InputError(
                "film with a frame, a load path, a pattern, layers or functions of its own stays on its "
                "surface"
            )
        return self.with_changes(surface=surface)

    def with_changes(self, **changes: Any) -> Balloon:
        """The balloon of the same arguments but for those given, by their names. Collective."""
        given = replace(self.specification, **changes)
        return Balloon(**{field.name: getattr(given, field.name) for field in fields(given) if field.init})

    def with_prescribed(self, prescribed: PrescribedMotion) -> Balloon:
        """This balloon led by a guide: another map, the same film, forms and matrices. Collective.

        The two share their displacement and loads; `Equilibrium.restore` puts in those of a state.
        """
        maps = constraint_map(self.V, self.X, self.surface, self.fixed, self.motion, prescribed)
        constrained = self._under(maps)
        constrained.free = self
        return constrained

    def untied(self) -> Balloon:
        """This sector with the nodes of both its cuts free, for motions of any harmonic. Collective."""
        if not self.map.tied:
            return self
        return self._under(constraint_map(self.V, self.X, self.surface, self.fixed, self.motion))

    def _under(self, constraints: ConstraintMap) -> Balloon:
        """This balloon under another map: displacement, loads and `assembly` are those of both."""
        other = copy(self)
        petsc.watch(other, self.mesh)
        other.map, other.plate_forces, other._tangents = constraints, copy(self.plate_forces), {}
        return other

    def afloat(self) -> Balloon:
        """This free body with all its nodes free, for its modes. Collective."""
        loose = self._under(constraint_map(self.V, self.X, self.surface, (), None))
        loose.adrift = True
        return loose

    def unknowns_of(self, other: Balloon) -> Any:
        """The q with the displacement in which `other`, the same film with another map, is. Collective."""
        return self.map.unknowns(other.u, other.w)

    def _summary(self) -> Summary:
        return self.specification.summary()

    @property
    def gas_level(self) -> float:
        """Level along the axis at which the gas has the pressure of a state [m]. Collective."""
        return self.lowest + self.load.level

    @property
    def prescribed(self) -> PrescribedMotion | None:
        """The prescribed motion of this balloon, if any."""
        return self.map.motion if isinstance(self.map.motion, PrescribedMotion) else None

    def _plate_forces(self, load: PlateLoad | None) -> PlateForces | None:
        if self.motion is not None:
            # of a sector its share, as its rims' areas and the bar are
            excess = self.surface.lobe.axial_excess / self.surface.copies if self.prestressed else None
            closed = self.load.convention == "closed"
            loads = (closed, self.pressure, self.prestress)
            return PlateForces(self.motion, load, *loads, excess, self.load.gradient, self.gas_level)
        if load is not None:
            raise InputError(f"{load} needs EndPlates of which the top one moves, as with support 'clamped'")
        return None

    def _self_contact(self, part: SelfContact) -> Contact:
        rims = tuple(self.edge_nodes(n) for n in ("rim_bottom", "rim_top")) if self.motion else ()
        loads = (self.pressure, self.prestress)
        return Contact(part, self.V, rims, lambda: max(abs(float(load.value)) for load in loads))

    def edge_nodes(self, group: str) -> npt.NDArray[np.int32]:
        """Node indices, owned and ghosts, of an edge group. Collective."""
        return edge_nodes(self.V, self.surface, group)

    # --- what a solver asks for -----------------------------------------------------------------

    def integrate(self, expression: Expr) -> float:
        """The integral of a UFL expression with its measure, over all ranks. Collective."""
        return integral(self.mesh, expression)

    def set_loads(self, pressure: float, prestress: float = 0.0) -> None:
        """Set the gas pressure and the pressure p0 of the built-in stress [Pa]."""
        self.pressure.value, self.prestress.value = pressure, prestress

    def set_unknowns(self, q: Vec) -> None:
        """Put the displacement of q into `u`. Collective."""
        self.w, _, _ = self.map.displace(q, self.u)

    def bar_force(self) -> float | None:
        """Force in the bar [N] at the last residual; None without a bar or with both rims held."""
        motion, forces = self.map.motion, self.plate_forces
        if motion is None or forces is None:
            return None
        return motion.bar_force(self.w, forces.top_force, forces.bar_built_in)

    def freeze_plates(self, q: Vec) -> None:
        """Keep the plates' area vectors at q for the energies that follow. Collective."""
        if self.plate_forces is not None:
            w, _, _ = self.map.plate_parameters(self.map.parameters(q))
            self.plate_forces.freeze(w)

    @timed("energy")
    def energy(self, q: Vec) -> tuple[float, float]:
        """Potential energy at q [J]: of strain, -p (V - V of the reference shape), dead load. Collective.

        In the place of -p (V - V0) a sealed gas has -m R T ln(V/V0) + p_a (V - V0).

        With a `SelfContact` the barrier's energy is added: infinite where the film intersects itself.

        The `film` load differs from `closed` by a force p A n(theta) on each plate's centre, which has
        no potential; here it keeps the direction of the last `freeze_plates`, so that the energy's
        gradient is the residual at that point.

        Returns:
            the energy, and the size of the terms whose sum it is (for its round-off).

        Raises:
            InputError: the film's stress is no energy's gradient.
        """
        if not self.film.has_energy:
            raise InputError(f"{type(self.film).__name__} film has no energy; switch to TensionField film")
        self.set_unknowns(q)
        elastic, volume = self.assembly.elastic(), self.assembly.volume()
        if self.plate_forces is not None:
            elastic += self.plate_forces.bar_energy(self.w)
            volume += self.plate_forces.volume(self.w)
            volume -= self.plate_forces.centre_volume(self.w)
        work = self.gas_work(self.reference_volume, volume) + self.dead_work()
        return elastic - work + self.assembly.barrier(), abs(elastic) + abs(work)

    def dead_work(self) -> float:
        """Work of what pulls in one direction, in the present displacement [J]. Collective.

        That is of dead loads on a plate, of weight and a further energy, and of the pressure's gradient.
        """
        work = self.assembly.moment() - self.assembly.raised()
        if self.plate_forces is not None:
            work += self.plate_forces.dead_work(self.w) + self.plate_forces.moment_work(self.w)
        return work

    def strain_energy(self) -> float | None:
        """Strain energy of film, cables and bar [J] in the present displacement. Collective.

        None for a film whose stress is no energy's gradient.
        """
        if not self.forms.has_energy:
            return None
        bar = self.plate_forces.bar_energy(self.w) if self.plate_forces else 0.0
        return self.assembly.elastic() + bar

    def _plate_terms(self, nodal: Array) -> tuple[Array, Array]:
        """Gradient and Hessian in w of all that acts on the plates, and on a guide's seams."""
        gradient, hessian = self.map.plate_forces(nodal, self.w)
        if self.plate_forces is not None:
            self.plate_forces.add_to(gradient, hessian, self.w)
        return gradient, hessian

    @timed("residual")
    def residual(self, q: Vec, out: Vec) -> None:
        """Write the reduced residual at q [N, N m] into `out`. Collective."""
        self.w, dw, _ = self.map.displace(q, self.u)
        self.follow_gas()
        r = self.assembly.residual()
        gradient, _ = self._plate_terms(r)
        self.map.reduce(r, gradient, dw, out)

    def reaction(self, q: Vec) -> float:
        """The force conjugate to the guide's parameter at q, 0 without a guide [N or N m]. Collective."""
        self.set_unknowns(q)
        r = self.assembly.residual()
        gradient, _ = self._plate_terms(r)
        if self.prescribed is None:
            return 0.0
        return float(gradient @ self.prescribed.rate(self.map.parameters(q))) + self.map.push_force(r)

    @timed("tangent")
    def tangent(self, q: Vec, slot: int = 0, *, iteration: bool = False, before: Vec | None = None) -> Any:
        """The reduced tangent at q as a PETSc matrix, overwritten by the next call. Collective.

        Of a sealed gas it is that at its pressure, without `gas_stiffness`, which is no sparse matrix.

        Args:
            q: unknowns.
            slot: calls with another slot keep a matrix of their own.
            iteration: True for the matrix that the film wants in Newton's method, maybe a secant.
            before: the unknowns before the last Newton step, for a matrix with the stress that is
                linear in that step (`WeakForms.predicted`); with `iteration` only.
        """
        increment = self.forms.increment
        if before is not None:
            self.map.displace(before, increment)
        self.w, dw, d2w = self.map.displace(q, self.u)
        if before is not None:
            increment.x.array[:] = self.u.x.array - increment.x.array
        self.follow_gas()
        K = self.assembly.tangent(iteration=iteration, predicted=before is not None)
        if slot not in self._tangents:
            self._tangents[slot] = reduction(K, self.map)
        block = self.parameter_block(dw, d2w) if self.map.num_parameters else None
        reduced = self._tangents[slot].fill(K, self.w, dw, block)
        if self.contact is not None:
            return self.contact.add_hessian(reduced, self.map.jacobian(self.w, dw), self.u, slot)
        return reduced

    def second_variation(self, q: Vec, dv: Vec, dq: Vec) -> float:
        """The second variation dv . K(q) dq, integrated over the film without assembling K [J]. Collective.

        Stiff hoops put entries of 1e9 N/m into K; their round-off alone moves the softest
        eigenvalues in the eighth digit. The integral forms strains first and keeps all of them.
        """
        self.w, dw, d2w = self.map.displace(q, self.u)
        J = self.map.jacobian(self.w, dw)
        for target, direction in ((self.forms.directions[0], dv), (self.forms.directions[1], dq)):
            J.mult(direction, target.x.petsc_vec)
            target.x.scatter_forward()
        value = self.assembly.second_variation()
        if self.map.num_parameters:
            a, b = self.map.parameters(dv), self.map.parameters(dq)
            value += float(a @ self.parameter_block(dw, d2w) @ b)
        return value

    def parameter_block(self, dw: Array, d2w: Array) -> Array:
        """The part of the tangent on the plates' parameters alone.

        That is the curvature of the map and all that has its energy in w.
        """
        gradient, hessian = self._plate_terms(self.assembly.residual())
        return dw.T @ hessian @ dw + np.einsum("w,wab->ab", gradient, d2w)

    def mass_matrix(self) -> Any:
        """Consistent mass of unit areal density on all nodal displacements [m^2]. Collective."""
        return self.assembly.mass.whole()

    def mass(self, q: Vec, kind: Mass = "unit") -> Any:
        """B of the eigenproblem in q: J^T M J or J^T J with the map's Jacobian at q. Collective.

        Args:
            q: unknowns.
            kind: "unit" for the consistent mass of unit areal density [m^2], "nodal" for the
                identity on nodal displacements (the paper's).
        """
        w, dw, _ = self.map.plate_parameters(self.map.parameters(q))
        if kind == "nodal":
            J = self.map.jacobian(w, dw)
            return J.transposeMatMult(J)
        return reduction(self.assembly.mass, self.map).fill(self.assembly.mass, w, dw)
