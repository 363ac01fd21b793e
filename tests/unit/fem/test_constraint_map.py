"""The map q -> u and its products, against dense algebra and finite differences, on any ranks."""

import numpy as np
import pytest
from states import nodes, unknowns, wavy

from lobefem.fem.balloon import Balloon
from lobefem.fem.functionals import displacement_of
from lobefem.fem.rigid_plates import rotation
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.model.end_plates import EndPlates
from lobefem.model.film import Isotropic
from lobefem.model.supports import Fixed

from petsc4py import PETSc

PLATES = [
    EndPlates("clamped", True),
    EndPlates("pinned", True),
    EndPlates("pinned", False),
    EndPlates("fixed", lift=0.01),
]


def make(comm, plates, *held):
    return Balloon(lobed_cylinder(1, (3, 7), comm=comm), Isotropic(), [plates, *held])


def gathered(comm, local):
    return np.concatenate(comm.allgather(np.asarray(local)))


@pytest.mark.parametrize("plates", PLATES, ids=str)
def test_unknowns_are_counted_once(comm, plates):
    balloon = make(comm, plates)
    total = 3 * 7 * 4
    assert balloon.map.size == total - 2 * 3 * 7 + balloon.motion.size
    assert comm.allreduce(balloon.map.local_size) == balloon.map.size
    assert balloon.map.create_vector().getSize() == balloon.map.size
    y = np.arange(1.0, balloon.motion.size + 1)
    q = unknowns(balloon, np.zeros_like(nodes(balloon)), y)
    np.testing.assert_array_equal(balloon.map.parameters(q), y)  # on every rank
    if balloon.motion.size:
        np.testing.assert_array_equal(gathered(comm, q.array_r)[-balloon.motion.size :], y)


@pytest.mark.parametrize("plates", PLATES, ids=str)
def test_rims_move_as_rigid_bodies_and_the_rest_as_told(comm, plates):
    balloon = make(comm, plates)
    x = nodes(balloon)
    y = np.linspace(-0.4, 0.7, balloon.motion.size)
    field = 0.1 * wavy(x, 1)
    balloon.set_unknowns(unknowns(balloon, field, y))
    u = balloon.u.x.array.reshape(-1, 3)  # ghosts too
    w, _, _ = balloon.motion.evaluate(y)
    inner = np.ones(len(x), dtype=bool)
    for k, name in enumerate(("rim_bottom", "rim_top")):
        rim = balloon.edge_nodes(name)
        inner[rim] = False
        C, d, R = balloon.motion.centres[k], w[6 * k :][:3], rotation(w[6 * k + 3 :][:3])[0]
        np.testing.assert_allclose(x[rim] + u[rim], C + d + (x[rim] - C) @ R.T, rtol=0, atol=1e-13)
    np.testing.assert_allclose(u[inner], field[inner], rtol=0, atol=1e-15)


@pytest.mark.parametrize("plates", PLATES, ids=str)
def test_jacobian_is_the_maps_derivative(comm, plates):
    balloon = make(comm, plates)
    x = nodes(balloon)
    y = np.linspace(-0.4, 0.7, balloon.motion.size)
    dy = np.linspace(1, -2, balloon.motion.size)
    q, d = unknowns(balloon, 0.1 * wavy(x, 1), y), unknowns(balloon, wavy(x, 2), dy)
    exact = displacement_of(balloon, q, d)
    h = 1e-3

    def at(t):
        p = q.copy()
        p.axpy(t, d)
        balloon.set_unknowns(p)
        return balloon.u.x.array.reshape(-1, 3).copy()

    difference = (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h)
    np.testing.assert_allclose(exact, difference, rtol=0, atol=1e-10)


@pytest.mark.parametrize("plates", PLATES[:3], ids=str)
def test_reduced_residual_and_tangent_are_products_with_the_jacobian(comm, plates):
    """J^T r and J^T K J (film entries), by PETSc's own products with an explicit J."""
    balloon = make(comm, plates)
    balloon.set_loads(100.0)
    x = nodes(balloon)
    y = np.linspace(-0.2, 0.3, balloon.motion.size)
    q = unknowns(balloon, 0.02 * wavy(x, 1, 2.0), y)
    reduced = q.duplicate()
    balloon.residual(q, reduced)
    w, dw, _ = balloon.map.plate_parameters(y)
    J = balloon.map.jacobian(w, dw)
    product, nodal = J.createVecs()
    nodal.array[:] = balloon.assembly.residual()
    J.multTranspose(nodal, product)
    n = balloon.map.free.size
    np.testing.assert_allclose(reduced.array_r[:n], product.array_r[:n], rtol=1e-14)
    # the plates' entries lack the gas on the plates themselves, which is not on the film
    plates_load = -100.0 * dw.T @ balloon.motion.volume_change(w)[1]
    tail = gathered(comm, product.array_r)[-balloon.motion.size :] + plates_load
    found = gathered(comm, reduced.array_r)[-balloon.motion.size :]
    np.testing.assert_allclose(found, tail, rtol=1e-10, atol=1e-9)
    K = balloon.assembly.tangent().whole()
    JT = PETSc.Mat().createTranspose(J)
    d, product = unknowns(balloon, wavy(x, 3), 0.0), q.duplicate()
    Jd, KJd = K.createVecs()
    J.mult(d, Jd)
    K.mult(Jd, KJd)
    JT.mult(KJd, product)
    direct = q.duplicate()
    balloon.tangent(q).mult(d, direct)
    scale = max(np.abs(gathered(comm, direct.array_r)))
    # d leaves the plates alone, so that their curvature has no part in it
    np.testing.assert_allclose(direct.array_r, product.array_r, rtol=0, atol=1e-13 * scale)


def test_held_components_stay_and_are_no_unknowns(comm):
    shape = lobed_cylinder(1, (3, 7), comm=comm)
    middle = shape.shape.height / 3
    held = Fixed(lambda x: np.abs(x[2] - middle) < 1.0, (0, 2))
    balloon = make(comm, EndPlates("fixed"), held)
    x = nodes(balloon)
    on = np.abs(x[:, 2] - middle) < 1.0
    owned = balloon.V.dofmap.index_map.size_local
    count = comm.allreduce(int(on[:owned].sum()))
    assert count == 7
    assert balloon.map.size == 3 * 14 - 2 * count
    balloon.set_unknowns(unknowns(balloon, np.ones_like(x)))
    u = balloon.u.x.array.reshape(-1, 3)
    np.testing.assert_array_equal(u[on], np.broadcast_to([0.0, 1.0, 0.0], u[on].shape))


def test_held_edge_by_name_and_a_rim_that_follows_its_plate(comm):
    """A plate's rim is the plate's: a hold on it adds nothing."""
    alone = make(comm, EndPlates("clamped"))
    both = make(comm, EndPlates("clamped"), Fixed("rim_bottom"))
    assert both.map.size == alone.map.size
    surface = lobed_cylinder(1, (3, 7), comm=comm)
    named = Balloon(surface, Isotropic(), [Fixed("rim_bottom"), Fixed("rim_top", (2,))])
    assert named.map.size == 3 * 28 - 21 - 7


def test_rigid_motions_of_free_film_strain_nothing(comm):
    balloon = Balloon(lobed_cylinder(1, (3, 7), comm=comm), Isotropic())
    K = balloon.tangent(balloon.map.create_vector())  # without load
    motions = balloon.map.rigid_motions(balloon.V.tabulate_dof_coordinates())
    for k, v in enumerate(motions):
        assert (K * v).norm() < 1e-12 * K.norm()
        assert [v.dot(w) for w in motions] == pytest.approx(np.eye(6)[k], abs=1e-12)
