"""What is measured on a displaced film: strain's share, turns, true stresses."""

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from states import nodes, wavy

from lobefem.equilibrium.displacement_control import constrain
from lobefem.equilibrium.distortions import Tip
from lobefem.fem import functionals, rigid_motions
from lobefem.fem.balloon import Balloon
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.model.cables import Hoops
from lobefem.model.end_plates import EndPlates
from lobefem.model.film import Isotropic
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.kinematics import tangent_frame

from mpi4py import MPI

sys.path.insert(0, str(Path(__file__).parents[2] / "analytic"))
from flatfilm import square


def stack(comm, support="pinned", lobes=2, divisions=(4, 8)):
    surface = lobed_cylinder(lobes, divisions, comm=comm)
    return Balloon(surface, Isotropic(), [GasPressure(), Hoops(), EndPlates(support)])


# --- share of strain ----------------------------------------------------------------------------

GRADIENTS = {
    "simple shear": ([[0, 1, 0], [0, 0, 0], [0, 0, 0]], 0.5),
    "pure shear": ([[0, 1, 0], [1, 0, 0], [0, 0, 0]], 1.0),
    "stretch along": ([[1, 0, 0], [0, 0, 0], [0, 0, 0]], 1.0),
    "stretch across": ([[0, 0, 0], [0, 1, 0], [0, 0, 0]], 1.0),
    "turn in the plane": ([[0, -1, 0], [1, 0, 0], [0, 0, 0]], 0.0),
    "tilt": ([[0, 0, 0], [0, 0, 0], [1, 2, 0]], 0.0),
    "tilted stretch": ([[1, 0, 0], [0, 0, 0], [0, 3, 0]], 0.1),
}


@pytest.fixture
def flat(comm):
    surface = square(comm, 1.0, 3)
    return Balloon(surface, Isotropic(), frame=tangent_frame(surface.mesh, (0.6, 0.8, 0)))


@pytest.mark.parametrize("name", GRADIENTS)
def test_share_of_strain_in_an_even_displacement_gradient(flat, name):
    gradient, share = GRADIENTS[name]
    u = nodes(flat) @ np.array(gradient, dtype=float).T
    assert functionals.straining_share(flat, u, 0 * u) == pytest.approx(share, abs=1e-12)
    # a real and an imaginary part count by their squares
    assert functionals.straining_share(flat, 0 * u, 7 * u) == pytest.approx(share, abs=1e-12)
    turned = nodes(flat)[:, [1, 0, 2]] * [-2, 2, 0]
    size = np.square(gradient).sum()
    expected = share * size / (size + 8)
    assert functionals.straining_share(flat, u, turned) == pytest.approx(expected, abs=1e-12)


def test_nothing_moved_strains_nothing(flat):
    zero = np.zeros_like(nodes(flat))
    assert functionals.straining_share(flat, zero, zero) == 0.0


# --- turns that a support leaves ----------------------------------------------------------------


@pytest.mark.parametrize("axis", [(1, 0, 0), (0.6, -0.8, 0)])
def test_a_turn_is_told_from_what_is_nearly_one(comm, axis):
    balloon = stack(comm)
    x = nodes(balloon)
    displaced = 0.3 * wavy(x, 2, 2.0)
    turn = np.cross(axis, x + displaced - balloon.motion.centres[0])
    turn /= functionals.largest(balloon, turn)
    around = np.arctan2(x[:, 1], x[:, 0])
    wave = np.cos(2 * around)[:, None] * x * [1, 1, 0]
    wave /= functionals.largest(balloon, wave)
    assert rigid_motions.is_turn(balloon, displaced, turn)
    assert rigid_motions.is_turn(balloon, displaced, turn + 1e-4 * wave)
    assert not rigid_motions.is_turn(balloon, displaced, turn + 0.05 * wave)
    assert not rigid_motions.is_turn(balloon, displaced, wave)
    # one about the bottom plate's centre, of the film where it is
    assert not rigid_motions.is_turn(balloon, np.zeros_like(x), turn)
    assert not rigid_motions.is_turn(balloon, displaced, turn + 0.05 * np.array([0, 0, 1]))
    assert rigid_motions.num_turns(balloon) == 2


def test_a_clamped_support_leaves_no_turn(comm):
    balloon = stack(comm, "clamped")
    turn = np.cross((1, 0, 0), nodes(balloon) - balloon.motion.centres[0])
    assert not rigid_motions.is_turn(balloon, 0 * turn, turn)
    assert rigid_motions.num_turns(balloon) == 0


@pytest.mark.parametrize("angle", [-0.4, 1e-3, 2.5])
def test_the_turn_between_two_shapes_is_taken_out(comm, angle):
    axis = np.array([0.6, 0.8, 0.0])
    for support, turns in (("pinned", True), ("clamped", False)):
        balloon = stack(comm, support)
        x, centre = nodes(balloon), balloon.motion.centres[0]
        one = 0.1 * wavy(x, 3, 2.0)
        turned = Rotation.from_rotvec(angle * axis).apply(x + one - centre) + centre - x
        distance, rotation = rigid_motions.distance_of(balloon, one, turned)
        way = functionals.largest(balloon, turned - one)
        assert rotation == pytest.approx(abs(angle) if turns else 0.0, abs=1e-12)
        assert distance == pytest.approx(0.0 if turns else way, abs=1e-12)


def test_under_a_constraint_no_turn_is_free(comm):
    """A pinned stack's largest displacement leaves its tilt out; held aside it has a tilt of its own."""
    balloon = stack(comm)
    held = constrain(balloon, Tip(0.3))
    turn = 0.01 * np.cross((1, 0, 0), nodes(balloon) - balloon.motion.centres[0])
    assert rigid_motions.largest_of_state(held, turn) == functionals.largest(balloon, turn)
    assert rigid_motions.largest_of_state(balloon, turn) < 0.1 * functionals.largest(balloon, turn)


# --- true stresses ------------------------------------------------------------------------------


def true_stresses(balloon, displacement):
    """Cell means of (N_phi, N_theta, N_phitheta) of this rank's cells."""
    balloon.u.x.array[:] = displacement.ravel()
    return functionals.true_resultants(balloon).x.array.reshape(-1, 3).copy()


def test_true_stresses_lie_along_the_axis_meridians_of_where_the_film_is(comm):
    balloon = stack(comm)
    x = nodes(balloon)
    stretched = x * [0.02, 0.02, 0.05] + 0.05 * wavy(x, 5, 2.0)
    N = true_stresses(balloon, stretched)
    size = comm.allreduce(np.abs(N).max(initial=0.0), op=MPI.MAX)
    # turned about the axis the film carries the same
    turned = Rotation.from_rotvec([0, 0, 0.7]).apply(x + stretched) - x
    np.testing.assert_allclose(true_stresses(balloon, turned), N, rtol=0, atol=1e-9 * size)
    # beside the axis meridian and hoop are others, the stress is not
    beside = true_stresses(balloon, stretched + np.array([0.8, 0, 0]))
    np.testing.assert_allclose(beside[:, :2].sum(axis=1), N[:, :2].sum(axis=1), rtol=0, atol=1e-9 * size)
    assert comm.allreduce(np.abs(beside - N).max(initial=0.0), op=MPI.MAX) > 1e-3 * size


def test_true_stresses_are_per_length_of_the_strained_film(comm):
    """Film stretched by 1 + e the same both ways: N = S (1 + e)^2/(1 + e)^2, S by its strain."""
    balloon, e = stack(comm), 0.2
    N = true_stresses(balloon, e * nodes(balloon))
    film, strain = balloon.film, ((1 + e) ** 2 - 1) / 2
    expected = film.Et / (1 - film.nu) * strain
    np.testing.assert_allclose(N[:, :2], expected, rtol=1e-12)
    np.testing.assert_allclose(N[:, 2], 0, atol=1e-9 * expected)
