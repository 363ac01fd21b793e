"""Self-contact: derivatives, reach, the step that stays free, and the map from plates to facets."""

import math
from dataclasses import replace

import builders
import numpy as np
import pytest
from states import nodes, taylor_rates, unknowns, wavy

from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.newton import free_share
from lobefem.errors import ConvergenceError, InputError
from lobefem.fem.balloon import Balloon
from lobefem.fem.contact_mesh import Gathering, film_facets
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.linalg import petsc
from lobefem.model.end_plates import EndPlates
from lobefem.model.film import Isotropic
from lobefem.model.self_contact import SelfContact
from lobefem.stability.modes import find_modes

from mpi4py import MPI

MESHES = [
    pytest.param({}, id="triangles"),
    pytest.param({"cell": "quadrilateral"}, id="quadrilaterals"),
    pytest.param({"order": 2}, id="triangles-2"),
    pytest.param({"cell": "quadrilateral", "order": 2}, id="quadrilaterals-2"),
]


def stack(comm, plates=None, part=None, **mesh):
    parts = [] if part is False else [part or SelfContact()]
    return builders.stack(comm, EA=2e5, plates=plates or EndPlates("pinned"), parts=parts, **mesh)


def pinched(balloon, share=0.6):
    """q with the film on both sides of the seam brought together to about `share` of the activation.

    Heights above and below the seam shrink towards it; what was flat there stays flat.
    """
    x = nodes(balloon)
    height = balloon.surface.shape.height
    z = x[:, 2] - height
    factor = share * balloon.contact.activation / balloon.contact.rest_gap
    u = np.zeros_like(x)
    u[:, 2] = (factor - 1) * z * np.exp(-((z / (0.35 * height)) ** 4))
    return unknowns(balloon, u)


@pytest.mark.parametrize("kw", MESHES)
def test_nothing_is_felt_at_rest(comm, kw):
    """The default activation lies below every gap at rest, and energy and force are exactly zero."""
    balloon = stack(comm, **kw)
    contact = balloon.contact
    balloon.set_unknowns(balloon.map.create_vector())
    assert 0 < contact.activation == pytest.approx(0.25 * contact.rest_gap)
    assert contact.energy(balloon.u) == 0.0
    assert not contact.gradient(balloon.u).any()
    assert contact.hessian(balloon.u) is None
    report = contact.measure(balloon.u)
    assert (report.force, report.area, report.pairs) == (0.0, 0.0, 0)
    assert report.gap == contact.rest_gap
    assert not contact.intersects(balloon.u)


def test_gap_at_rest_is_that_of_the_wedge_at_a_seam(comm):
    """Two lobes open outwards at a seam: there the diagonals of its two rows of facets pass each other.

    With c, w, s the first step of the mesh outwards, around and in height they run from (0, 0, 0) along
    (c, w, s) and from (0, w, 0) along (c, -w, -s): skew lines at the distance s w/sqrt(s^2 + w^2).
    """
    balloon = stack(comm, divisions=(12, 60))
    shape = balloon.surface.shape
    at = shape.stations(12)
    s = float(shape.z(at[1]) - shape.z(at[0]))
    w = 2 * math.pi * shape.edge_radius / 60
    # the meridian curves: 7 % here, 4 % on a mesh twice as fine
    assert balloon.contact.rest_gap == pytest.approx(s * w / math.hypot(s, w), rel=0.1)


@pytest.mark.parametrize("kw", MESHES)
def test_taylor_of_the_barrier(comm, kw):
    """What the barrier adds to energy, residual and tangent: orders 2 and 3, plates' parameters included."""
    balloon, plain = stack(comm, **kw), stack(comm, part=False, **kw)
    q = pinched(balloon)
    # off the symmetric state, where pairs sit between two kinds and the second derivative jumps
    q.axpy(1.0, unknowns(balloon, 0.1 * balloon.contact.activation * wavy(nodes(balloon), 4)))
    d = unknowns(balloon, 0.02 * balloon.contact.activation * wavy(nodes(balloon), 3), 1e-4)
    for each in (balloon, plain):
        each.set_loads(1e4)

    def barrier(h):
        w = q.copy()
        w.axpy(h, d)
        balloon.set_unknowns(w)
        return balloon.contact.energy(balloon.u)

    e = barrier(0)
    assert balloon.contact.measure(balloon.u).pairs >= 8
    assert 1 < e < math.inf
    slope = curvature = 0.0
    for each, sign in ((balloon, 1), (plain, -1)):
        r, Kd = q.duplicate(), q.duplicate()
        each.residual(q, r)
        each.tangent(q).mult(d, Kd)
        slope, curvature = slope + sign * r.dot(d), curvature + sign * Kd.dot(d)
        variation = balloon.second_variation(q, d, d) - plain.second_variation(q, d, d)
    assert balloon.energy(q)[0] - plain.energy(q)[0] == pytest.approx(e, rel=1e-6)
    assert petsc.asymmetry(balloon.tangent(q)) < 1e-12
    assert variation == pytest.approx(curvature, rel=1e-6)
    steps = 0.5 ** np.arange(4)
    second = taylor_rates(lambda h: barrier(h) - e - h * slope, steps)
    np.testing.assert_allclose(second, 2, atol=0.2)
    third = taylor_rates(lambda h: barrier(h) - e - h * slope - h**2 / 2 * curvature, steps)
    np.testing.assert_allclose(third, 3, atol=0.35)


def test_a_pattern_that_comes_and_goes(comm):
    """One matrix object follows the contact; at rest again it is the tangent without contact."""
    balloon, plain = stack(comm), stack(comm, part=False)
    q, rest = pinched(balloon), balloon.map.create_vector()
    K = balloon.tangent(rest)
    few = K.getInfo()["nz_used"]
    assert balloon.tangent(q) is K or balloon.tangent(q).handle == K.handle
    assert balloon.tangent(q).getInfo()["nz_used"] >= few
    again = balloon.tangent(rest)
    difference = plain.tangent(rest).copy()
    difference.axpy(-1.0, again)
    assert difference.norm() == 0.0


def test_rims_reach_the_plates(comm):
    """A plate is a fan over its rim whose centre follows the rim as the rigid plate does."""
    balloon = stack(comm, EndPlates("clamped", bar=False), divisions=(3, 7))
    rims = tuple(balloon.edge_nodes(n) for n in ("rim_bottom", "rim_top"))
    facets = film_facets(balloon.V, rims)
    q = unknowns(balloon, np.zeros_like(nodes(balloon)), np.array([0.1, -0.2, 0.3, 0.4, 0.5, -0.6]))
    balloon.set_unknowns(q)
    moved = Gathering(balloon.V).gather(balloon.u.x.array)
    if comm.rank:
        return
    assert len(facets.triangles) == 2 * 2 * 3 * 7 + 2 * 7
    x = facets.follow @ facets.x
    top = 2 * balloon.surface.shape.height
    np.testing.assert_allclose(x[-2:], [[0, 0, 0], [0, 0, top]], atol=1e-12)
    corners = x[facets.triangles[-14:]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (normal[:7, 2] < 0).all()  # outwards, like the film's
    assert (normal[7:, 2] > 0).all()
    np.testing.assert_allclose((facets.follow @ moved)[-2:], [[0, 0, 0], [0.1, -0.2, 0.3]], atol=1e-12)


def test_quadratic_cells_become_the_triangles_between_their_nodes(comm):
    for cell, per_cell in (("triangle", 4), ("quadrilateral", 8)):
        surface = lobed_cylinder(1, (3, 6), cell=cell, order=2, comm=comm)
        balloon = Balloon(surface, Isotropic(), [EndPlates("fixed")])
        facets = film_facets(balloon.V, ())
        if comm.rank:
            continue
        x = facets.x[facets.triangles]
        assert len(x) == per_cell * 3 * 6 * (2 if cell == "triangle" else 1)
        area = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]) / 2
        sizes = np.linalg.norm(area, axis=1)
        assert sizes.sum() == pytest.approx(balloon.surface.shape.area, rel=0.06)
        assert sizes.min() > 0.2 * sizes.mean()
        outwards = x.mean(axis=1) * [1, 1, 0]
        assert (np.einsum("ci,ci->c", area, outwards) > 0).all()


def test_steps_stop_before_the_film_touches(comm):
    """A step that turns the film inside out is cut; the share that is left is free of intersections."""
    balloon = stack(comm)
    rest = balloon.map.create_vector()
    step = pinched(balloon, share=-1.0)
    through = rest.copy()
    through.axpy(1.0, step)
    balloon.set_unknowns(through)
    assert balloon.contact.intersects(balloon.u)
    assert balloon.energy(through)[0] == math.inf
    share = free_share(balloon, rest, step)
    assert 0.1 < share < 0.999
    cut = rest.copy()
    cut.axpy(share, step)
    balloon.set_unknowns(cut)
    assert not balloon.contact.intersects(balloon.u)
    small = rest.copy()
    small.axpy(1e-3, step)
    assert free_share(balloon, rest, small) == 1.0


@pytest.mark.parametrize("seed", range(4))
def test_steps_that_no_search_looks_at_leave_a_part_of_the_gap(comm, seed):
    """Just below the limit of what is not searched the film stays apart, and the search says the same."""
    balloon = stack(comm)
    contact, q = balloon.contact, pinched(balloon, 0.5)
    balloon.set_unknowns(q)
    before = contact.gap(balloon.u)
    assert before < contact.activation
    rng = np.random.default_rng(seed)
    step = q.duplicate()
    whole = rng.uniform(-1, 1, step.getSize())
    begin, end = step.getOwnershipRange()
    step.array[:] = whole[begin:end]
    balloon.map.displace(step, balloon.u)
    way = np.linalg.norm(balloon.u.x.array.reshape(-1, 3), axis=1).max(initial=0.0)
    step.scale(0.99 * 0.8 * before / 2 / comm.allreduce(way, op=MPI.MAX))
    assert free_share(balloon, q, step) == 1.0
    start, end = q.copy(), q.copy()
    end.axpy(1.0, step)
    balloon.set_unknowns(end)
    there = balloon.u.x.array.copy()
    balloon.set_unknowns(start)
    assert contact.free_share(balloon.u, there, away=0.0) == 1.0
    q.axpy(1.0, step)
    balloon.set_unknowns(q)
    assert not contact.intersects(balloon.u)
    assert contact.gap(balloon.u) > 0.2 * before


def test_no_accepted_step_intersects(comm, monkeypatch):
    """Every residual of an inflation that closes the wedge at the seam is of a film that does not cross."""
    balloon = stack(comm, EndPlates("pinned", bar=1e4), divisions=(6, 12))
    pressed = crossed = 0
    residual = balloon.residual

    def watched(q, out):
        nonlocal pressed, crossed
        residual(q, out)
        crossed += balloon.contact.intersects(balloon.u)
        pressed += balloon.contact.measure(balloon.u).pairs > 0

    monkeypatch.setattr(balloon, "residual", watched)
    start = inflate(balloon, 0.0)
    q = pinched(balloon, 0.3)
    state = inflate(balloon, 500.0, start=replace(start, unknowns=q.array_r.copy()))
    assert state.converged
    assert pressed > 0
    assert crossed == 0


def test_a_start_that_intersects_is_refused(comm):
    balloon = stack(comm)
    rest = inflate(balloon, 0.0)
    bad = replace(rest, unknowns=pinched(balloon, share=-1.0).array_r.copy())
    with pytest.raises(ConvergenceError, match=r"^the film intersects itself where inflate starts") as caught:
        inflate(balloon, 5.0, start=bad)
    assert caught.value.state is bad
    assert caught.value.data["reason"] == "film intersects itself"


def test_bad_numbers(comm):
    with pytest.raises(InputError, match=r"activation distance"):
        SelfContact(activation=0.0)
    with pytest.raises(InputError, match=r"stiffness"):
        SelfContact(stiffness=math.inf)
    with pytest.raises(InputError, match=r"^the contact's activation distance 1 m reaches over the smallest"):
        stack(comm, part=SelfContact(activation=1.0))


def test_stiffness_follows_the_pressure_unless_given(comm):
    balloon, fixed = stack(comm), stack(comm, part=SelfContact(stiffness=7.0))
    for p, k in ((0.0, 1.0), (5.0, 5.0), (-300.0, 300.0)):
        balloon.set_loads(p)
        fixed.set_loads(p)
        assert (balloon.contact.stiffness, fixed.contact.stiffness) == (k, 7.0)
    # film with built-in stress presses with that, where the gas does not
    for p, p0, k in ((5.0, 60.0, 60.0), (-5.0, -60.0, 60.0), (80.0, 60.0, 80.0)):
        balloon.set_loads(p, p0)
        assert balloon.contact.stiffness == k


def test_film_that_touches_itself_has_no_single_harmonics(comm):
    balloon = stack(comm)
    rest = inflate(balloon, 5.0)
    assert {m.harmonic for m in find_modes(rest, 2, harmonics=[2]).modes} == {2}
    pressed = replace(rest, unknowns=pinched(balloon).array_r.copy())
    with pytest.raises(
        InputError, match=r"^the film touches itself, so harmonics are coupled; leave harmonics"
    ):
        find_modes(pressed, 2, harmonics=[2])


def test_gap_force_and_energy_are_those_of_the_serial_run(comm):
    """The same numbers on one rank and on all."""
    for kw in ({}, {"order": 2}):
        whole, alone = stack(comm, **kw), stack(MPI.COMM_SELF, **kw)
        for balloon in (whole, alone):
            balloon.set_loads(100.0)
            balloon.set_unknowns(pinched(balloon))
        a, b = whole.contact.measure(whole.u), alone.contact.measure(alone.u)
        assert a.pairs == b.pairs >= 8
        for name in ("gap", "force", "area", "energy"):
            assert getattr(a, name) == pytest.approx(getattr(b, name), rel=1e-9)
        q, q1 = pinched(whole), pinched(alone)
        v = whole.tangent(q).norm()
        assert v == pytest.approx(alone.tangent(q1).norm(), rel=1e-9)


def test_the_list_of_near_pairs_serves_while_the_film_moves_little(comm):
    """Energy, forces and free share along a way, by a list from its beginning and by a new one each time."""
    balloon = stack(comm)
    contact = balloon.contact
    start, end = (pinched(balloon, share) for share in (3.0, 0.5))
    for s in np.linspace(0, 1, 9):
        q = start.copy()
        q.scale(1 - s)
        q.axpy(s, end)
        far = q.copy()
        far.axpy(-1.0, end)
        far.scale(-3.0)
        for step, size in ((far, 1.0), (far, 1e-2)):
            step.scale(size)
            share = free_share(balloon, q, step)
            contact._candidates = None
            assert free_share(balloon, q, step) == pytest.approx(share, rel=1e-9)
        balloon.set_unknowns(q)
        contact._found.clear()
        force, energy = contact.gradient(balloon.u), contact.energy(balloon.u)
        kept = contact._candidates
        contact._found.clear()
        contact._candidates = None
        assert contact.energy(balloon.u) == pytest.approx(energy, rel=1e-12)
        np.testing.assert_allclose(contact.gradient(balloon.u), force, rtol=1e-9, atol=1e-12)
        contact._candidates = kept
    assert energy > 0.01
