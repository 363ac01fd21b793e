"""`Balloon`: surface, film and parts put together as energy, residual and tangent in q.

All that has an energy is written once as an energy; residual and tangent are its derivatives. Only
the `film` pressure, and a film law written as a stress, are residuals of their own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from lobefem import _dolfinx

# isort: split
import basix.ufl
import ufl
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

from lobefem.cables import Cords
from lobefem.constraints import ConstraintMap
from lobefem.contact import Contact, SelfContact
from lobefem.errors import InputError
from lobefem.films import Film
from lobefem.forms import WeakForms
from lobefem.guides import Guide
from lobefem.imp import PrescribedPath
from lobefem.kinematics import Frame, revolved_frame, true_resultants
from lobefem.loads import GasPressure, film_volume
from lobefem.lobe import Lobe
from lobefem.plates import EndPlates, PlateLoad, PlateMotion

__all__ = ["Balloon", "Held"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Held:
    """Displacement components that are given, zero by default, for films without plates.

    Args:
        on: name of an edge group, or a function of coordinates x (3, n) that marks nodes (n,).
        components: which of 0, 1, 2 are held.
        displacement: a function of coordinates x (3, n) that gives the displacements (3, n) [m] at
            which they are held; where parts overlap the first one counts.
    """

    on: str | Callable[[Array], npt.NDArray[np.bool_]]
    components: tuple[int, ...] = (0, 1, 2)
    displacement: Callable[[Array], Array] | None = None


_PARTS = (GasPressure, Cords, EndPlates, PlateLoad, Held, SelfContact)


class Balloon:
    """A film surface with its load, cords, plates and supports.

    Args:
        surface: where the film lies (`lobefem.surface`).
        film: its law.
        parts: at most one `GasPressure` (default "closed"), any number of `Cords` and `Held`, at
            most one `EndPlates`, with moving ones at most one `PlateLoad`, at most one `SelfContact`.
        prestressed: build the lobe's own stress into the film, N_phi = p0 R0^2/(2 R) for an isotensoid
            (paper eq. 4), and the matching tension into the cords; p0 is the `prestress` of a state.
        hoop_slack: hoop slack s >= 0 of a film with built-in stress (strain).
        load_path: a state found with a `PrescribedPath` film on this surface; its stress is built into
            the film, which carries it in that state's shape (paper sec. 4).
        frame: the film's frame; by default that of a surface of revolution about the axis.
        quadrature_degree: for the film's energy; by default exact for the element where it can be.

    Raises:
        InputError: parts that do not go together.

    Collective.
    """

    def __init__(
        self,
        surface: Any,
        film: Film,
        parts: Sequence[Any] = (),
        *,
        prestressed: bool = False,
        hoop_slack: float = 0.0,
        load_path: Any = None,
        frame: Frame | None = None,
        quadrature_degree: int | None = None,
    ) -> None:
        self.surface, self.film, self.prestressed = surface, film, prestressed
        self.parts, self.hoop_slack, self.quadrature_degree = tuple(parts), hoop_slack, quadrature_degree
        self.given_frame, self.load_path = frame, load_path
        self.cords = tuple(p for p in parts if isinstance(p, Cords))
        self.held = tuple(p for p in parts if isinstance(p, Held))
        self.load: GasPressure = _single(parts, GasPressure) or GasPressure()
        self.plates: EndPlates | None = _single(parts, EndPlates)
        contact: SelfContact | None = _single(parts, SelfContact)
        unknown = [p for p in parts if not isinstance(p, _PARTS)]
        if unknown:
            names = ", ".join(kind.__name__ for kind in _PARTS)
            raise InputError(f"{unknown[0]!r} is no part of a balloon; use one of {names}")
        if not 0 <= hoop_slack < 1:
            raise InputError(f"hoop_slack = {hoop_slack} must be a strain in [0, 1), such as 1e-3")
        if prestressed and not isinstance(surface.shape, Lobe):
            raise InputError("prestress needs an isotensoid or a formed lobe; this surface is another shape")
        if load_path is not None:
            if prestressed:
                raise InputError("the film gets its stress from the load path or by prestress, not from both")
            if not isinstance(load_path.balloon.film, PrescribedPath):
                raise InputError(
                    f"load_path is a state of {type(load_path.balloon.film).__name__} film; give one that "
                    "was inflated with PrescribedPath film"
                )
            if load_path.balloon.mesh is not surface.mesh:
                raise InputError("load_path is a state on another mesh; build both balloons on one surface")
        self.mesh = surface.mesh
        self.comm = self.mesh.comm
        # degree of geometry and displacement, from the nodes of a cell
        self.order = {3: 1, 4: 1, 6: 2, 9: 2}[_dolfinx.geometry_dofmap(self.mesh).shape[1]]
        element = basix.ufl.element("Lagrange", self.mesh.basix_cell(), self.order, shape=(3,))
        self.V = fem.functionspace(self.mesh, element)
        self.u = fem.Function(self.V, name="displacement")
        self.pressure = fem.Constant(self.mesh, 0.0)
        self.prestress = fem.Constant(self.mesh, 0.0)
        self.frame = frame if frame is not None else revolved_frame(self.mesh, surface.axis)
        self.motion = self._plate_motion()
        self._plate_load = self._dead_load(_single(parts, PlateLoad))
        self.free: Balloon | None = None
        self.map = self._constraint_map()
        self.contact = self._self_contact(contact) if contact is not None else None
        self.forms = WeakForms(self, hoop_slack, quadrature_degree, load_path)
        self._frozen = self.motion.area_vectors if self.motion else np.zeros((2, 3))
        self._tangents: dict[int, Any] = {}
        self._residual_at: dict[str, Array] = {}  # shared with the balloon under a guide, as the vector is
        self._mass: Any = None
        self.reference_area = self.integrate(fem.Constant(self.mesh, 1.0) * self.forms.dx)
        X = ufl.SpatialCoordinate(self.mesh)
        self.reference_volume = self.integrate(film_volume(X, self.frame) * self.forms.dx)
        self.reference_volume += self.motion.volume if self.motion else 0.0

    # --- construction ---------------------------------------------------------------------------

    def _plate_motion(self) -> PlateMotion | None:
        """The plates' motion; the rims' areas come from the mesh, A = |closed integral of X x t|/2."""
        if self.plates is None:
            return None
        missing = [n for n in ("rim_bottom", "rim_top") if n not in self.surface.groups]
        if missing:
            raise InputError(f"end plates need the edge group '{missing[0]}', which this surface lacks")
        axis = np.asarray(self.surface.axis, dtype=float)
        ds = ufl.Measure("ds", domain=self.mesh, subdomain_data=self.surface.edges)
        X = ufl.SpatialCoordinate(self.mesh)
        t = ufl.cross(ufl.CellNormal(self.mesh), ufl.FacetNormal(self.mesh))
        e = ufl.as_vector(list(axis))
        numbers = []
        for name in ("rim_bottom", "rim_top"):
            measure = ds(self.surface.groups[name][1])
            area = self.integrate(ufl.dot(ufl.cross(X, t), e) / 2 * measure)
            length = self.integrate(fem.Constant(self.mesh, 1.0) * measure)
            height = self.integrate(ufl.dot(X, e) * measure)
            if length == 0.0:
                raise InputError(f"edge group '{name}' is empty: there is no rim to close by a plate")
            numbers.append((height / length * axis, abs(area)))
        plates = self.plates
        if not isinstance(plates.bar, bool):  # a sector has its share of the plates and of their bar
            plates = replace(plates, bar=plates.bar / self.surface.copies)
        return PlateMotion(plates, np.array([c for c, _ in numbers]), np.array([a for _, a in numbers]))

    def _constraint_map(self, guide: Guide | None = None) -> ConstraintMap:
        rims = ("rim_bottom", "rim_top") if self.motion else ()
        rings = (*rims, *(guide.seams if guide else ()))
        dofs, values = [np.empty(0, dtype=np.int32)], [np.empty(0)]
        x = self.V.tabulate_dof_coordinates().T
        for part in self.held:
            if callable(part.on):
                nodes = fem.locate_dofs_geometrical(self.V, part.on)
            else:
                nodes = self.edge_nodes(part.on)
            given = np.zeros((3, nodes.size)) if part.displacement is None else part.displacement(x[:, nodes])
            dofs += [3 * nodes + c for c in part.components]
            values += [given[c] for c in part.components]
        fixed, first = np.unique(np.concatenate(dofs), return_index=True)
        fixed, given = fixed.astype(np.int32), np.concatenate(values)[first]
        nodes = tuple(self.edge_nodes(name) for name in rings)
        return ConstraintMap(self.V, guide or self.motion, nodes, fixed, given)

    def under(self, guide: Guide) -> Balloon:
        """This balloon led by a guide: another map, the same film, forms and matrices. Collective.

        The two share their displacement and loads; `Equilibrium.activate` puts in those of a state.
        """
        led = copy(self)
        led._residual_vector, led._full_tangent = self._residual_vector, self._full_tangent
        led.map, led._tangents, led.free = self._constraint_map(guide), {}, self
        return led

    def adopt(self, other: Balloon) -> Any:
        """The q with the displacement in which `other`, the same film with another map, is. Collective."""
        return self.map.unknowns(other.u, other._w)

    @property
    def guide(self) -> Guide | None:
        """What leads this balloon."""
        return self.map.motion if isinstance(self.map.motion, Guide) else None

    def _self_contact(self, part: SelfContact) -> Contact:
        rims = tuple(self.edge_nodes(n) for n in ("rim_bottom", "rim_top")) if self.motion else ()

        def pressure() -> float:
            return max(abs(float(self.pressure.value)), abs(float(self.prestress.value)))

        return Contact(part, self.V, rims, pressure)

    def _dead_load(self, load: PlateLoad | None) -> Array:
        """Forces and moments (12,) on both plates, conjugate to w [N, N m]."""
        if load is None:
            return np.zeros(12)
        if self.motion is None or not self.motion.moving:
            raise InputError(f"{load} needs EndPlates of which the top one moves, as with support 'clamped'")
        return np.concatenate([np.zeros(6), load.force, load.moment])

    def edge_nodes(self, group: str) -> npt.NDArray[np.int32]:
        """Node indices, owned and ghosts, of an edge group. Collective."""
        if group not in self.surface.groups:
            raise InputError(f"no edge group '{group}' on this surface; it has {sorted(self.surface.groups)}")
        facets = self.surface.edges.find(self.surface.groups[group][1])
        return fem.locate_dofs_topological(self.V, 1, facets)

    @cached_property
    def _residual_vector(self) -> Any:
        return _dolfinx.create_vector(self.forms.residual)

    @cached_property
    def _full_tangent(self) -> Any:
        return _dolfinx.create_matrix(self.forms.tangent)

    # --- what a solver asks for -----------------------------------------------------------------

    def integrate(self, expression: Any) -> float:
        """The integral of a UFL expression with its measure, over all ranks. Collective."""
        return float(self.comm.allreduce(fem.assemble_scalar(_dolfinx.form(expression)), op=MPI.SUM))

    def set_loads(self, pressure: float, prestress: float = 0.0) -> None:
        """Set the gas pressure and the pressure p0 of the built-in stress [Pa]."""
        self.pressure.value, self.prestress.value = pressure, prestress

    @property
    def _plate_pressure(self) -> float:
        closed = self.load.convention == "closed"
        return float(self.pressure.value) if closed else 0.0

    @property
    def _bar_built_in(self) -> float:
        """Force in an elastic bar at its reference length: what the plates' gas leaves of the film's pull."""
        if self.motion is None or not self.prestressed:
            return 0.0
        # the film's pull on a plate is p0 A and its excess over that; with `closed` load the gas bears p0 A
        area = 0.0 if self.load.convention == "closed" else float(np.linalg.norm(self.motion.area_vectors[1]))
        return -float(self.prestress.value) * (area + self.surface.shape.axial_excess)

    def volume(self) -> float:
        """Volume enclosed by film and plates [m^3] in the present displacement. Collective."""
        change = self.comm.allreduce(fem.assemble_scalar(self.forms.volume))
        change += self.motion.volume_change(self._w)[0] if self.motion else 0.0
        return self.reference_volume + change

    def place(self, q: Any) -> None:
        """Put the displacement of q into `u`. Collective."""
        self._w, _, _ = self.map.displace(q, self.u)

    def load_norm(self, q: Any) -> float:
        """Norm of the pressure's reduced nodal forces p dV/dq at q [N, N m]. Collective."""
        self.place(q)
        g = _dolfinx.create_vector(self.forms.load)
        with g.localForm() as local:
            local.set(0.0)
        fem.petsc.assemble_vector(g, self.forms.load)
        g.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)
        out = self.map.create_vector()
        _, dw, _ = self.map.plate_parameters(self.map.parameters(q))
        self.map.reduce(g.array_r, self.map.plate_forces(g.array_r, self._w)[0], dw, out)
        return abs(float(self.pressure.value)) * out.norm()

    def bar_force(self) -> float | None:
        """Force in the bar [N] at the last residual; None without a bar or with both rims held."""
        if self.map.motion is None:
            return None
        return self.map.motion.bar_force(self._w, self._top_force, self._bar_built_in)

    def cord_tensions(self) -> tuple[float, ...]:
        """Mean tension of each cord group over its reference length [N]. Collective."""
        one = fem.Constant(self.mesh, 1.0)
        return tuple(
            self.integrate(tension * measure) / self.integrate(one * measure)
            for _, tension, measure in self.forms.cords
        )

    def region_areas(self) -> tuple[float, float, float]:
        """Reference areas of taut, wrinkled and slack film [m^2]. Collective."""
        taut, wrinkled, slack = self.film.regions(self.forms.strain, self.forms.number)
        return tuple(self.integrate(region * self.forms.dx) for region in (taut, wrinkled, slack))  # type: ignore[return-value]

    def stress_resultants(self) -> Any:
        """Cell means of (N_m, N_h, N_mh) [N/m] in the present displacement. Collective."""
        S = self.film.stress(self.forms.strain, self.forms.number)
        N = ufl.as_vector([S[0, 0], S[1, 1], S[0, 1]])
        return self._cell_means(N, "stress resultants")

    def true_resultants(self) -> Any:
        """Cell means of the true (N_phi, N_theta, N_phitheta) [N/m] in the present displacement.

        Cauchy's, per current length, in the current surface's own frame of meridian and hoop; they
        differ from `stress_resultants`, which are per reference length, where the film strains much.

        Collective.
        """
        S = self.film.stress(self.forms.strain, self.forms.number)
        N = true_resultants(S, self.u, self.mesh, self.surface.axis, self.frame)
        return self._cell_means(N, "true stress resultants")

    def _cell_means(self, expression: Any, name: str) -> Any:
        W = fem.functionspace(self.mesh, ("DG", 0, expression.ufl_shape))
        v = ufl.TestFunction(W)
        mean = fem.Function(W, name=name)
        area = fem.Function(W)
        ones = ufl.as_vector([1.0] * expression.ufl_shape[0])
        for target, f in ((mean, expression), (area, ones)):
            fem.petsc.assemble_vector(target.x.petsc_vec, _dolfinx.form(ufl.inner(f, v) * self.forms.dx))
            target.x.scatter_forward()
        mean.x.array[:] /= area.x.array
        return mean

    def freeze_plates(self, q: Any) -> None:
        """Keep the plates' area vectors at q for the energies that follow. Collective."""
        if self.motion is not None:
            w, _, _ = self.map.plate_parameters(self.map.parameters(q))
            self._frozen = self.motion.turned_area_vectors(w)

    def energy(self, q: Any) -> tuple[float, float]:
        """Potential energy at q [J]: of strain, -p (V - V of the reference shape), dead load. Collective.

        With a `SelfContact` the barrier's energy is added: infinite where the film intersects itself.

        The `film` load differs from `closed` by a force p A n(theta) on each plate's centre, which has
        no potential; here it keeps the direction of the last `freeze_plates`, so that the energy's
        gradient is the residual at that point.

        Returns:
            the energy, and the size of the terms whose sum it is (for its round-off).

        Raises:
            InputError: the film's stress is no energy's gradient.
        """
        if not self.forms.has_energy:
            raise InputError(f"{type(self.film).__name__} film has no energy; switch to TensionField film")
        self.place(q)
        elastic = self.comm.allreduce(fem.assemble_scalar(self.forms.elastic))
        volume = self.comm.allreduce(fem.assemble_scalar(self.forms.volume))
        if self.motion is not None:
            elastic += self.motion.bar_energy(self._w, self._bar_built_in)[0]
            volume += self.motion.volume_change(self._w)[0]
            if self.load.convention == "film":
                volume -= float((self._frozen * self._w[:12].reshape(2, 6)[:, :3]).sum())
        work = float(self.pressure.value) * volume + float(self._plate_load @ self._w[:12])
        barrier = self.contact.energy(self.u) if self.contact is not None else 0.0
        return elastic - work + barrier, abs(elastic) + abs(work)

    def strain_energy(self) -> float | None:
        """Strain energy of film, cords and bar [J] in the present displacement. Collective.

        None for a film whose stress is no energy's gradient.
        """
        if not self.forms.has_energy:
            return None
        bar = self.motion.bar_energy(self._w, self._bar_built_in)[0] if self.motion else 0.0
        return self.comm.allreduce(fem.assemble_scalar(self.forms.elastic)) + bar

    def _plate_terms(self, nodal: Array) -> tuple[Array, Array]:
        """Gradient and Hessian in w of all that acts on the plates, and on a guide's seams."""
        gradient, hessian = self.map.plate_forces(nodal, self._w)
        if self.motion is not None:
            _, g, h = self.motion.volume_change(self._w)
            gradient[:12] -= self._plate_pressure * g + self._plate_load
            hessian[:12, :12] -= self._plate_pressure * h
            self._top_force = gradient[6:9].copy()
            _, g, h = self.motion.bar_energy(self._w, self._bar_built_in)
            gradient[:12] += g
            hessian[:12, :12] += h
        return gradient, hessian

    def _assemble_residual(self) -> Array:
        """The nodal residual at `u`, kept for the tangent that is asked for next. Collective."""
        r = self._residual_vector
        key = np.append(self.u.x.array, (self.pressure.value, self.prestress.value))
        kept = self._residual_at.get("key")
        if self.comm.allreduce(kept is not None and np.array_equal(kept, key), op=MPI.LAND):
            return r.array_r
        self._residual_at.clear()
        with r.localForm() as local:
            local.set(0.0)
        fem.petsc.assemble_vector(r, self.forms.residual)
        r.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)
        if self.contact is not None:
            r.array[:] += self.contact.gradient(self.u)
        self._residual_at["key"] = key
        return r.array_r

    def residual(self, q: Any, out: Any) -> None:
        """Write the reduced residual at q [N, N m] into `out`. Collective."""
        self._w, dw, _ = self.map.displace(q, self.u)
        r = self._assemble_residual()
        gradient, _ = self._plate_terms(r)
        self.map.reduce(r, gradient, dw, out)

    def reaction(self, q: Any) -> float:
        """The force conjugate to the guide's parameter at q, 0 without a guide [N or N m]. Collective."""
        w, _, _ = self.map.displace(q, self.u)
        self._w = w
        r = self._assemble_residual()
        gradient, _ = self._plate_terms(r)
        if self.guide is None:
            return 0.0
        return float(gradient @ self.guide.rate(self.map.parameters(q))) + self.map.push_force(r)

    def tangent(self, q: Any, slot: int = 0, *, iteration: bool = False, before: Any = None) -> Any:
        """The reduced tangent at q as a PETSc matrix, overwritten by the next call. Collective.

        Args:
            q: unknowns.
            slot: calls with another slot keep a matrix of their own.
            iteration: True for the matrix that the film wants in Newton's method, maybe a secant.
            before: the unknowns before the last Newton step, for a matrix with the stress that is
                linear in that step (`WeakForms.predicted`); with `iteration` only.
        """
        form = self.forms.iteration if iteration else self.forms.tangent
        if before is not None:
            form, increment = self.forms.predicted, self.forms.increment
            self.map.displace(before, increment)
        self._w, dw, d2w = self.map.displace(q, self.u)
        if before is not None:
            increment.x.array[:] = self.u.x.array - increment.x.array
        K = _dolfinx.assemble_matrix(self._full_tangent, form)
        J = self.map.jacobian(self._w, dw)
        reduced = K.ptap(J, result=self._tangents.get(slot))
        if self.map.num_parameters:
            self.map.add_parameter_block(reduced, self._parameter_block(dw, d2w))
        self._tangents[slot] = reduced
        if self.contact is not None:
            return self.contact.add_hessian(reduced, J, self.u, slot)
        return reduced

    def free_share(self, q: Any, step: Any) -> float:
        """Share (0, 1] of a step from q that the film can go without touching itself. Collective.

        Nodes are taken to move straight; on a plate that turns they do so to first order.
        """
        if self.contact is None:
            return 1.0
        end = q.copy()
        end.axpy(1.0, step)
        self.place(end)
        end.destroy()
        there = self.u.x.array.copy()
        self.place(q)
        return self.contact.free_share(self.u, there)

    def held_pencil(self, low: float = 0.0, high: float = 1e5) -> tuple[Any, Any]:
        """K_m and K_g of K(p) = K_m + p K_g at the reference shape, its stress proportional to p.

        Args:
            low: pressure [Pa] of one of the two tangents that it is made from.
            high: that of the other. Where K is linear in p they do not matter; a high one keeps the
                round-off of K_m's 1e9 N/m out of the difference.

        Collective.
        """
        q = self.map.create_vector()
        self.set_loads(low, low)
        K_m = self.tangent(q).copy()
        self.set_loads(high, high)
        K_g = self.tangent(q).copy()
        K_g.axpy(-1.0, K_m)
        K_g.scale(1 / (high - low))
        if low:
            K_m.axpy(-low, K_g)
        return K_m, K_g

    def second_variation(self, q: Any, dv: Any, dq: Any) -> float:
        """The second variation dv . K(q) dq, integrated over the film without assembling K [J]. Collective.

        Stiff hoops put entries of 1e9 N/m into K; their round-off alone moves the softest
        eigenvalues in the eighth digit. The integral forms strains first and keeps all of them.
        """
        self._w, dw, d2w = self.map.displace(q, self.u)
        J = self.map.jacobian(self._w, dw)
        for target, direction in ((self.forms.directions[0], dv), (self.forms.directions[1], dq)):
            J.mult(direction, target.x.petsc_vec)
            target.x.scatter_forward()
        value = self.comm.allreduce(fem.assemble_scalar(self.forms.second_variation))
        if self.contact is not None:
            value += self.contact.second_variation(
                self.u, *(direction.x.petsc_vec for direction in self.forms.directions)
            )
        if self.map.num_parameters:
            a, b = self.map.parameters(dv), self.map.parameters(dq)
            value += float(a @ self._parameter_block(dw, d2w) @ b)
        return value

    def _parameter_block(self, dw: Array, d2w: Array) -> Array:
        """The part of the tangent on the plates' parameters alone.

        That is the curvature of the map and all that has its energy in w.
        """
        gradient, hessian = self._plate_terms(self._assemble_residual())
        return dw.T @ hessian @ dw + np.einsum("w,wab->ab", gradient, d2w)

    def displacement_of(self, q: Any, dq: Any) -> Array:
        """Nodal displacements du = J dq, ghosts included, (nodes, 3) [m]. Collective."""
        w, dw, _ = self.map.plate_parameters(self.map.parameters(q))
        du = fem.Function(self.V)
        self.map.jacobian(w, dw).mult(dq, du.x.petsc_vec)
        du.x.scatter_forward()
        return du.x.array.reshape(-1, 3).copy()

    def straining_share(self, real: Array, imag: Array) -> float:
        """Share of strain in a displacement gradient, |sym grad phi|^2/|grad phi|^2 in the film's plane.

        Args:
            real: nodal displacements (nodes, 3); ghosts are taken from their owners.
            imag: their imaginary part.

        Collective.
        """
        sums = np.zeros(2)
        for part in (real, imag):
            self.forms.directions[0].x.array[:] = part.ravel()
            self.forms.directions[0].x.scatter_forward()
            sums += [fem.assemble_scalar(form) for form in self.forms.straining]
        strain, gradient = self.comm.allreduce(sums)
        return float(strain / gradient) if gradient else 0.0

    def largest(self, displacement: npt.NDArray[Any]) -> float:
        """Largest nodal displacement [m]. Collective."""
        square = (np.abs(displacement) ** 2).sum(axis=1).max(initial=0.0)
        return float(np.sqrt(self.comm.allreduce(square, op=MPI.MAX)))

    def nodal_areas(self) -> Array:
        """Area [m^2] lumped to each node that this rank owns, positive for any element. Collective."""
        # integrals of quadratic shape functions vanish at vertices: take those of their squares
        diagonal = self.mass_matrix().getDiagonal().array_r[::3]
        return diagonal / self.comm.allreduce(diagonal.sum()) * self.reference_area

    def mass_matrix(self) -> Any:
        """Consistent mass of unit areal density on all nodal displacements [m^2]. Collective."""
        if self._mass is None:
            self._mass = fem.petsc.assemble_matrix(self.forms.mass)
            self._mass.assemble()
        return self._mass

    def mass(self, q: Any, kind: str = "unit") -> Any:
        """B of the eigenproblem in q: J^T M J or J^T J with the map's Jacobian at q. Collective.

        Args:
            q: unknowns.
            kind: "unit" for the consistent mass of unit areal density [m^2], "nodal" for the
                identity on nodal displacements (the paper's).
        """
        w, dw, _ = self.map.plate_parameters(self.map.parameters(q))
        J = self.map.jacobian(w, dw)
        if kind == "nodal":
            return J.transposeMatMult(J)
        return self.mass_matrix().ptap(J)


def _single(parts: Sequence[Any], kind: type) -> Any:
    found = [p for p in parts if isinstance(p, kind)]
    if len(found) > 1:
        raise InputError(f"a balloon takes one {kind.__name__}, not {len(found)}")
    return found[0] if found else None
