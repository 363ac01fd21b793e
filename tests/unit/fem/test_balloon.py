"""Energy, residual and tangent in the unknowns q: Taylor tests, symmetry, invariance, errors."""

from functools import partial

import builders
import numpy as np
import pytest
from states import nodes, taylor_rates, unknowns, wavy
from taylor import PRESSURE, STEPS, gradient_and_curvature, moved, state_and_direction

from lobefem.errors import InputError
from lobefem.fem.balloon import Balloon
from lobefem.fem.functionals import nodal_areas
from lobefem.fem.rigid_plates import rotation
from lobefem.geometry.isotensoid import Isotensoid
from lobefem.geometry.stacks import cylinder, lobed_cylinder
from lobefem.linalg import petsc
from lobefem.model.cables import Cables
from lobefem.model.end_plates import EndPlates, PlateLoad
from lobefem.model.film import Isotropic
from lobefem.model.fixed_wrinkles import FixedWrinkles
from lobefem.model.gas_pressure import GasPressure, film_volume
from lobefem.model.supports import Fixed
from lobefem.model.tension_field import TensionField

import ufl
from dolfinx import fem
from mpi4py import MPI

ELASTIC_BAR = 3e6
PLATES = [
    pytest.param(EndPlates("clamped", bar=True), id="clamped-rigid"),
    pytest.param(EndPlates("clamped", bar=ELASTIC_BAR), id="clamped-elastic"),
    pytest.param(EndPlates("clamped", bar=False), id="clamped-nobar"),
    pytest.param(EndPlates("pinned", bar=True), id="pinned-rigid"),
    pytest.param(EndPlates("pinned", bar=ELASTIC_BAR), id="pinned-elastic"),
    pytest.param(EndPlates("pinned", bar=False), id="pinned-nobar"),
    pytest.param(EndPlates("fixed", lift=0.02), id="fixed"),
]
LAWS = [
    pytest.param(Isotropic(), False, id="isotropic"),
    pytest.param(TensionField(slack_stiffness=1e-4), False, id="tension-field"),
    pytest.param(FixedWrinkles(), True, id="fixed-wrinkles"),
]


# a hoop of the film's own stiffness: the paper's would drown the film in round-off
stack = partial(builders.stack, lobes=4, divisions=(2, 5), shape=Isotensoid(4.2 / 1.1), EA=2e5)


@pytest.mark.parametrize("plates", PLATES)
@pytest.mark.parametrize(("film", "prestressed"), LAWS)
def test_taylor_of_the_closed_potential(comm, film, prestressed, plates):
    """E(q + h d) = E + h r.d + h^2/2 d.K d + O(h^3): orders 2 and 3 of the remainders."""
    balloon = stack(comm, film, "closed", plates=plates, prestressed=prestressed)
    q, d = state_and_direction(balloon)
    r, Kd = gradient_and_curvature(balloon, q, d)
    energy, _ = balloon.energy(q)
    slope, curvature = r.dot(d), Kd.dot(d)

    def second(h):
        return balloon.energy(moved(q, h, d))[0] - energy - h * slope

    def third(h):
        return second(h) - h**2 / 2 * curvature

    np.testing.assert_allclose(taylor_rates(second, STEPS), 2, atol=0.15)
    np.testing.assert_allclose(taylor_rates(third, STEPS), 3, atol=0.25)
    assert petsc.asymmetry(balloon.tangent(q)) < 1e-13


@pytest.mark.parametrize("plates", PLATES)
@pytest.mark.parametrize(("film", "prestressed"), LAWS)
@pytest.mark.parametrize("load", ["film", "closed"])
def test_taylor_of_the_residual(comm, load, film, prestressed, plates):
    """r(q + h d) = r + h K d + O(h^2)."""
    balloon = stack(comm, film, load, plates=plates, prestressed=prestressed)
    q, d = state_and_direction(balloon)
    r, Kd = gradient_and_curvature(balloon, q, d)

    def first(h):
        new = r.duplicate()
        balloon.residual(moved(q, h, d), new)
        new.axpy(-1.0, r)
        return new.norm()

    def second(h):
        new = r.duplicate()
        balloon.residual(moved(q, h, d), new)
        new.axpy(-1.0, r)
        new.axpy(-h, Kd)
        return new.norm()

    np.testing.assert_allclose(taylor_rates(first, STEPS), 1, atol=0.1)
    np.testing.assert_allclose(taylor_rates(second, STEPS), 2, atol=0.1)
    # a second tangent elsewhere and a third back here: nothing of the first is left in it
    balloon.tangent(moved(q, 1.0, d))
    again = q.duplicate()
    balloon.tangent(q).mult(d, again)
    again.axpy(-1.0, Kd)
    assert again.norm() < 1e-14 * Kd.norm()


@pytest.mark.parametrize("plates", PLATES)
def test_film_load_has_the_frozen_energy(comm, plates):
    """With the plates' own load frozen at q, the energy's gradient at q is the film residual."""
    balloon = stack(comm, Isotropic(), "film", plates=plates)
    q, d = state_and_direction(balloon)
    r, _ = gradient_and_curvature(balloon, q, d)
    balloon.freeze_plates(q)
    energy, _ = balloon.energy(q)

    def second(h):
        return balloon.energy(moved(q, h, d))[0] - energy - h * r.dot(d)

    np.testing.assert_allclose(taylor_rates(second, STEPS), 2, atol=0.15)


@pytest.mark.parametrize("cell", ["triangle", "quadrilateral"])
def test_taylor_on_quadratic_geometry(comm, cell):
    plates = EndPlates("clamped", bar=True)
    balloon = stack(comm, Isotropic(), "closed", plates=plates, divisions=(2, 5), cell=cell, order=2)
    balloon.set_loads(PRESSURE)
    x = nodes(balloon)
    q, d = unknowns(balloon, 0.03 * wavy(x, 1, 2.0), 0.02), unknowns(balloon, 0.01 * wavy(x, 2), 0.01)
    r, Kd = gradient_and_curvature(balloon, q, d)
    energy, _ = balloon.energy(q)

    def third(h):
        quadratic = energy + h * r.dot(d) + h**2 / 2 * Kd.dot(d)
        return balloon.energy(moved(q, h, d))[0] - quadratic

    np.testing.assert_allclose(taylor_rates(third, STEPS / 4), 3, atol=0.3)


# --- the load's symmetry -----------------------------------------------------------------------


@pytest.mark.parametrize("rims", ["clamped", "fixed"])
def test_asymmetry_of_film_pressure_is_its_edge_term(comm, rims):
    """L(u, v) - L(v, u) = p closed integral over the edge of (v x u) . tau ds, on the current edge.

    L(u, v) = D(p int v . n da)[u], tau along the edge with the film on its left (n outwards).
    """
    balloon = stack(comm, Isotropic(), "film", plates=EndPlates("clamped"), divisions=(4, 6))
    x = nodes(balloon)
    V, mesh = balloon.V, balloon.mesh
    state, u, v = fem.Function(V), fem.Function(V), fem.Function(V)
    for function, seed in ((state, 1), (u, 2), (v, 3)):
        function.x.array[:] = (0.1 * wavy(x, seed, 2.0)).ravel()
    if rims == "fixed":  # nothing moves at the edge: L is symmetric
        for name in ("rim_bottom", "rim_top"):
            at = 3 * balloon.edge_nodes(name)[:, None] + np.arange(3)
            u.x.array[at] = v.x.array[at] = 0.0
    f, f_u, f_v = (ufl.Identity(3) + ufl.grad(state), ufl.grad(u), ufl.grad(v))
    m, h = balloon.frame.m, balloon.frame.h

    def area_vector_rate(gradient):
        return ufl.cross(gradient * m, f * h) + ufl.cross(f * m, gradient * h)

    load = (
        PRESSURE
        * (ufl.dot(v, area_vector_rate(f_u)) - ufl.dot(u, area_vector_rate(f_v)))
        * ufl.dx(metadata={"quadrature_degree": 3})
    )
    edge = ufl.dot(f, ufl.cross(ufl.CellNormal(mesh), ufl.FacetNormal(mesh)))
    work = PRESSURE * ufl.dot(ufl.cross(v, u), edge) * ufl.ds(metadata={"quadrature_degree": 3})
    left, right = balloon.integrate(load), balloon.integrate(work)
    scale = PRESSURE * balloon.reference_area * 0.01
    assert abs(left - right) < 1e-13 * scale
    assert abs(right) > 1e-6 * scale if rims == "clamped" else abs(left) < 1e-13 * scale


@pytest.mark.parametrize(("load", "symmetric"), [("film", False), ("closed", True)])
def test_only_film_pressure_on_moving_plates_is_not_symmetric(comm, load, symmetric):
    balloon = stack(comm, Isotropic(), load, plates=EndPlates("clamped"))
    q, _ = state_and_direction(balloon)
    skew = petsc.asymmetry(balloon.tangent(q))
    assert skew < 1e-12 if symmetric else skew > 1e-6
    held = stack(comm, Isotropic(), load, plates=EndPlates("fixed"))
    q, _ = state_and_direction(held)
    assert petsc.asymmetry(held.tangent(q)) < 1e-12


# --- frame indifference ------------------------------------------------------------------------


@pytest.mark.parametrize("film", [Isotropic(), TensionField(slack_stiffness=1e-4), FixedWrinkles()])
def test_a_rigid_motion_changes_no_energy_and_turns_the_residual(comm, film):
    """Full nodal vectors, no plates: energy unchanged, the residual turns with the film."""
    prestressed = isinstance(film, FixedWrinkles)
    balloon = stack(comm, film, "film", plates=EndPlates("clamped"), prestressed=prestressed)
    balloon.set_loads(PRESSURE, PRESSURE if prestressed else 0.0)
    x = nodes(balloon)
    R = rotation(np.array([0.7, -1.1, 2.3]))[0]
    u = 0.03 * wavy(x, 4, 2.0)

    def evaluate(displacement):
        balloon.u.x.array[:] = displacement.ravel()
        elastic = comm.allreduce(fem.assemble_scalar(balloon.forms.elastic), op=MPI.SUM)
        return elastic, balloon.assembly.residual().reshape(-1, 3).copy()

    before, r = evaluate(u)
    after, turned = evaluate((x + u) @ R.T - x + np.array([1.0, -2.0, 0.5]))
    assert after == pytest.approx(before, rel=1e-11)
    scale = np.sqrt(comm.allreduce((r**2).sum(), op=MPI.SUM))
    difference = np.sqrt(comm.allreduce(((turned - r @ R.T) ** 2).sum(), op=MPI.SUM))
    assert difference < 1e-10 * scale


def test_enclosed_volume_does_not_feel_a_rigid_motion(comm):
    """Film and plates together, moved by one rotation and translation, in finite steps."""
    balloon = stack(comm, Isotropic(), "closed", plates=EndPlates("clamped", bar=False))
    x, motion = nodes(balloon), balloon.motion
    theta, shift = np.array([0.4, 1.3, -0.8]), np.array([2.0, 1.0, -3.0])
    R = rotation(theta)[0]
    balloon.u.x.array[:] = (x @ (R - np.eye(3)).T + shift).ravel()
    w = np.concatenate([np.concatenate([(R - np.eye(3)) @ c + shift, theta]) for c in motion.centres])
    change = comm.allreduce(fem.assemble_scalar(balloon.forms.volume), op=MPI.SUM)
    change += motion.volume_change(w)[0]
    assert abs(change) < 1e-11 * balloon.reference_volume


def test_reference_volume_is_that_of_the_closed_facets(comm):
    surface = cylinder(2.0, 5.0, (3, 12), comm=comm)
    balloon = Balloon(surface, Isotropic(), [EndPlates()])
    polygon = 12 / 2 * 4.0 * np.sin(2 * np.pi / 12)
    assert balloon.reference_volume == pytest.approx(5 * polygon, rel=1e-13)
    assert balloon.motion.volume == pytest.approx(5 * polygon / 3, rel=1e-13)
    X = ufl.SpatialCoordinate(surface.mesh)
    film = balloon.integrate(film_volume(X, balloon.frame) * ufl.dx)
    assert film == pytest.approx(2 / 3 * 5 * polygon, rel=1e-13)


# --- mass --------------------------------------------------------------------------------------


def test_mass_of_a_rigid_translation(comm):
    """All of a pinned stack moved along x has 1/2 v.B v with the film's area, or its nodes."""
    balloon = stack(comm, Isotropic(), "closed", plates=EndPlates("clamped", bar=False), divisions=(4, 6))
    ones = np.zeros_like(nodes(balloon))
    ones[:, 0] = 1.0
    q = balloon.map.create_vector()
    e = unknowns(balloon, ones, np.array([1.0, 0, 0, 0, 0, 0]))
    Be = e.duplicate()
    balloon.mass(q, "nodal").mult(e, Be)
    total = balloon.V.dofmap.index_map.size_global
    assert Be.dot(e) == pytest.approx(total - 6, rel=1e-13)  # the bottom rim is held
    ones[balloon.edge_nodes("rim_bottom")] = 0.0
    f = fem.Function(balloon.V)
    f.x.array[:] = ones.ravel()
    expected = balloon.integrate(ufl.inner(f, f) * ufl.dx)
    balloon.mass(q, "unit").mult(e, Be)
    assert Be.dot(e) == pytest.approx(expected, rel=1e-13)
    assert balloon.integrate(fem.Constant(balloon.mesh, 1.0) * ufl.dx) == pytest.approx(
        comm.allreduce(nodal_areas(balloon).sum(), op=MPI.SUM), rel=1e-13
    )


# --- what does not go together -----------------------------------------------------------------


def test_errors_of_parts_that_do_not_go_together(comm):
    surface = lobed_cylinder(1, (2, 4), comm=comm)
    for parts, text in (
        ([GasPressure(), GasPressure()], "a balloon takes one GasPressure, not 2"),
        ([EndPlates(), EndPlates()], "a balloon takes one EndPlates, not 2"),
        (
            ["hoop"],
            "'hoop' is no part of a balloon; use one of GasPressure, Cables, EndPlates, PlateLoad, Fixed, "
            "FreeBody, SelfContact",
        ),
        ([Fixed("rim")], r"no edge group 'rim' on this surface; it has \["),
        ([Fixed("lobe_1")], r"no edge group 'lobe_1' on this surface; it has \["),
        ([Cables(on=("seam_9",))], r"no edge group 'seam_9' on this surface; it has \["),
    ):
        with pytest.raises(InputError, match=text):
            Balloon(surface, Isotropic(), parts)
    with pytest.raises(InputError, match=r"hoop_slack = -0.1 must be a strain in"):
        Balloon(surface, Isotropic(), prestressed=True, hoop_slack=-0.1)
    with pytest.raises(InputError, match=r"^hoop_slack is '1e-3'; give a number$"):
        Balloon(surface, Isotropic(), prestressed=True, hoop_slack="1e-3")
    with pytest.raises(
        InputError, match=r"^hoop_slack = 0.001 is part of a built-in stress and there is none;"
    ):
        Balloon(surface, Isotropic(), hoop_slack=1e-3)
    flat = cylinder(2.0, 4.0, (2, 4), comm=comm)
    with pytest.raises(InputError, match="prestress needs an isotensoid or a formed lobe; this"):
        Balloon(flat, Isotropic(), prestressed=True)
    flat = type("Open", (), {**vars(flat), "groups": {"rim_top": (1, 202)}})
    with pytest.raises(InputError, match="end plates need the edge group 'rim_bottom', which this"):
        Balloon(flat, Isotropic(), [EndPlates()])


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"components": 2}, r"^held components are 2; give some of 0, 1 and 2, as \(2,\)$"),
        ({"components": (0, 3)}, r"^held components are \(0, 3\); give some of 0, 1 and 2"),
        ({"components": (-1,)}, r"^a held component is -1; give 0 or more$"),
        ({"components": (1.0,)}, r"^a held component is 1.0; give an integer, 0 or more$"),
        (
            {"on": ("rim_top",)},
            r"^film is held on \('rim_top',\); give an edge group's name or a function",
        ),
        ({"displacement": 0.1}, r"^a held displacement is 0.1; give a function of x or None$"),
    ],
)
def test_held_parts_that_make_no_sense_are_refused(arguments, text):
    with pytest.raises(InputError, match=text):
        Fixed(**{"on": "rim_top", **arguments})


def test_held_components_take_their_displacement(comm):
    surface = cylinder(1.0, 2.0, (3, 6), comm=comm)

    def stretch(x):
        return np.array([0 * x[0], 0.1 * x[1], 0.01 * x[2]])

    held = [Fixed("rim_top", (2,), stretch), Fixed("rim_top"), Fixed("rim_bottom", (0, 1), stretch)]
    balloon = Balloon(surface, Isotropic(), held)
    balloon.set_unknowns(balloon.map.create_vector())
    u, x = balloon.u.x.array.reshape(-1, 3), nodes(balloon)
    top, bottom = np.isclose(x[:, 2], 2), np.isclose(x[:, 2], 0)
    # the first of two parts counts, and what none gives is zero
    np.testing.assert_allclose(u[top], np.tile([0, 0, 0.02], (top.sum(), 1)), atol=1e-16)
    np.testing.assert_allclose(u[bottom, 1], 0.1 * x[bottom, 1], atol=1e-16)
    np.testing.assert_array_equal(u[~top & ~bottom], 0)


def test_plate_load_has_its_work_as_energy_and_itself_as_residual(comm):
    surface = cylinder(1.0, 2.0, (3, 6), comm=comm)
    load = PlateLoad((1.0, 2.0, 3.0), (4.0, 5.0, 6.0))
    plates = EndPlates("clamped", bar=False)
    bare, loaded = (Balloon(surface, Isotropic(), [plates, *extra]) for extra in ((), (load,)))
    y = np.array([0.01, -0.02, 0.03, 0.04, -0.05, 0.06])
    q = unknowns(bare, 0 * nodes(bare), y)
    r, s = q.duplicate(), q.duplicate()
    bare.residual(q, r)
    loaded.residual(q, s)
    r.axpy(-1.0, s)
    np.testing.assert_allclose(bare.map.parameters(r), [1, 2, 3, 4, 5, 6], atol=1e-8)
    work = bare.energy(q)[0] - loaded.energy(q)[0]
    assert work == pytest.approx(y @ [1, 2, 3, 4, 5, 6], abs=1e-8)
    assert loaded.strain_energy() == bare.strain_energy()


@pytest.mark.parametrize("parts", [[], [EndPlates("fixed")]])
def test_plate_load_needs_a_plate_that_moves(comm, parts):
    with pytest.raises(InputError, match=r"^PlateLoad\(.* needs EndPlates of which the top one moves"):
        Balloon(cylinder(1.0, 2.0, (3, 6), comm=comm), Isotropic(), [*parts, PlateLoad()])


@pytest.mark.parametrize("load", ["closed", "film"])
def test_the_predicted_tangent_leaves_out_what_is_quadratic_in_the_last_step(comm, load):
    """d.(K_predicted - K) d = -4 c of the strain energy's term c s^4 along a step s d, its fourth difference.

    E(u + s d) has the term s^2 q(d)/2, so that c is the integral of q : C q/8; the volume is a cubic.
    """
    balloon = stack(comm, Isotropic(), load, plates=EndPlates("fixed"), prestressed=True)
    balloon.set_loads(PRESSURE, PRESSURE)
    q = unknowns(balloon, 0.05 * wavy(nodes(balloon), 1))
    d = unknowns(balloon, 0.3 * wavy(nodes(balloon), 2))

    def curvature(before):
        Kd = d.duplicate()
        balloon.tangent(q, iteration=True, before=before).mult(d, Kd)
        return Kd.dot(d)

    def energy(s):
        balloon.set_unknowns(moved(q, s, d))
        return balloon.strain_energy()

    fourth = sum(w * energy(s) for w, s in zip((1, -4, 6, -4, 1), range(-2, 3), strict=True)) / 24
    exact = curvature(None)
    assert curvature(q) == pytest.approx(exact, rel=1e-12)
    assert fourth > 1e-3 * abs(exact)
    assert curvature(moved(q, -1.0, d)) - exact == pytest.approx(-4 * fourth, rel=1e-6)


def test_a_residual_is_assembled_anew_where_anything_changed(comm):
    """The tangent takes the last residual's nodal forces only at the same displacement and loads."""
    plates = EndPlates("pinned")
    one, other = (stack(comm, Isotropic(), "closed", plates=plates, prestressed=True) for _ in range(2))
    q = unknowns(one, 0.05 * wavy(nodes(one), 1), 0.02)
    r = q.duplicate()
    for u, loads in ((1.0, (1e3, 0.0)), (1.0, (2e3, 0.0)), (1.0, (2e3, 1e3)), (0.5, (2e3, 1e3))):
        one.set_loads(*loads)
        at = moved(q, u - 1.0, q)
        one.residual(at, r)
        fresh = stack(comm, Isotropic(), "closed", plates=plates, prestressed=True) if u != 1.0 else other
        fresh.set_loads(*loads)
        difference = one.tangent(at).copy()
        difference.axpy(-1.0, fresh.tangent(at))
        assert difference.norm() == 0.0
