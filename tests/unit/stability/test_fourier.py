"""Circumferential harmonics of nodal fields, and the names of modes."""

from dataclasses import replace

import numpy as np
import pytest
from states import unknowns

from lobefem.equilibrium.inflation import inflate
from lobefem.fem.balloon import Balloon
from lobefem.fem.cylindrical import cylindrical
from lobefem.fem.functionals import largest
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.linalg.slepc import Pair
from lobefem.model.end_plates import EndPlates
from lobefem.model.film import Isotropic
from lobefem.model.fixed_wrinkles import FixedWrinkles
from lobefem.model.gas_pressure import GasPressure
from lobefem.stability.fourier import dominant, spectrum
from lobefem.stability.linear_buckling import critical_pressure
from lobefem.stability.mode_kinds import kind_of
from lobefem.stability.mode_records import make_mode
from lobefem.stability.modes import find_modes

from mpi4py import MPI


def make(comm, around=16, lobes=2, **kw):
    mesh = {"divisions": (4, around)} if kw.get("layout") != "unstructured" else {}
    return Balloon(lobed_cylinder(lobes, comm=comm, **mesh, **kw), Isotropic(), [EndPlates()])


def field(balloon, component, shape):
    """A displacement along one cylindrical direction (0 radial, 1 hoop, 2 axial), ghosts zero."""
    angle, height, frame = cylindrical(balloon)
    u = np.zeros((len(balloon.u.x.array) // 3, 3), dtype=complex)
    u[: len(angle)] = shape(angle, height)[:, None] * frame[:, component]
    return u


def power_of(balloon, u):
    return spectrum(balloon, u.real, u.imag)


def test_cylindrical_frame(comm):
    balloon = make(comm)
    angle, height, frame = cylindrical(balloon)
    x = balloon.V.tabulate_dof_coordinates()[: len(angle)]
    radius = np.hypot(x[:, 0], x[:, 1])
    np.testing.assert_allclose(radius[:, None] * frame[:, 0, :2], x[:, :2], rtol=0, atol=1e-14)
    np.testing.assert_allclose(height, x[:, 2])
    np.testing.assert_allclose(np.arctan2(x[:, 1], x[:, 0]), angle)
    eye = np.broadcast_to(np.eye(3), frame.shape)
    np.testing.assert_allclose(frame @ frame.transpose(0, 2, 1), eye, rtol=0, atol=1e-14)
    np.testing.assert_allclose(np.cross(frame[:, 0], frame[:, 1]), frame[:, 2], rtol=0, atol=1e-14)


@pytest.mark.parametrize("component", [0, 1, 2])
@pytest.mark.parametrize("n", [0, 1, 2, 7, 8])
def test_a_pure_harmonic_is_found_alone(comm, n, component):
    balloon = make(comm)
    power = power_of(balloon, field(balloon, component, lambda a, z: np.cos(n * a) * (1 + z)))
    assert power.sum() == pytest.approx(1)
    assert power[n] == pytest.approx(1, abs=1e-12)


@pytest.mark.parametrize("around", [7, 8, 9, 16])
def test_two_harmonics_share_by_their_energy(comm, around):
    """Also on an odd number of sectors, whose highest harmonic is no alias of itself."""
    balloon = make(comm, around)
    power = power_of(balloon, field(balloon, 0, lambda a, z: np.cos(a) + 2 * np.sin(3 * a)))
    np.testing.assert_allclose(power[[1, 3]], [0.2, 0.8], rtol=1e-12)


def test_a_mode_names_all_harmonics_with_a_tenth_of_it(comm):
    """Strongest first; the largest displacement of the whole is 1."""
    balloon = make(comm)
    parts = {2: 0.25, 3: 0.59, 5: 0.12, 4: 0.04}

    def shape(a, z):
        # nodes on the rims belong to the plates, which stay
        inside = np.sin(np.pi * z / balloon.motion.length)
        return inside * sum(np.sqrt(part) * np.cos(n * a + n) for n, part in parts.items())

    x = unknowns(balloon, field(balloon, 0, shape).real)
    pair = Pair(complex(7.0), x, x.duplicate())
    pair.y.set(0.0)
    mode = make_mode(balloon, balloon.map.create_vector(), pair, 1e-9)
    assert (mode.value, mode.residual) == (7.0, 1e-9)
    assert (mode.harmonic, mode.harmonics) == (3, (3, 2, 5))
    assert largest(balloon, mode.displacement) == pytest.approx(1, rel=1e-12)


def test_the_last_harmonic_of_an_even_ring_is_counted_once(comm):
    balloon = make(comm, 8)
    power = power_of(balloon, field(balloon, 0, lambda a, z: np.cos(4 * a) + np.sqrt(2) * np.cos(a)))
    # cos(4 a) is 1 in square at the nodes, sqrt 2 cos(a) too
    np.testing.assert_allclose(power[[1, 4]], [0.5, 0.5], rtol=1e-12)


def test_a_rotating_field_counts_real_and_imaginary_part(comm):
    balloon = make(comm)
    u = field(balloon, 0, lambda a, z: np.exp(1j * 3 * a) + np.exp(-1j * 2 * a))
    np.testing.assert_allclose(power_of(balloon, u)[[2, 3]], [0.5, 0.5], rtol=1e-12)


def test_alternating_diagonals_keep_all_harmonics_of_the_ring(comm):
    """The sector is two cells wide there, but a ring still tells N/2 harmonics apart."""
    balloon = make(comm, 16, diagonals="alternating")
    for n in (1, 5, 7):
        power = power_of(balloon, field(balloon, 0, lambda a, z, n=n: np.cos(n * a)))
        assert np.argmax(power) == n
    height = balloon.surface.shape.height
    film_mesh = field(balloon, 1, lambda a, z: np.cos(7 * a) * np.sin(np.pi * z / height) ** 2)
    assert label_of(balloon, film_mesh) == "local"


@pytest.mark.parametrize("order", [1, 2])
def test_unstructured_mesh_finds_the_dominant_harmonic(comm, order):
    balloon = make(comm, layout="unstructured", size=0.5, order=order)
    for n in (0, 1, 4):
        power = power_of(balloon, field(balloon, 0, lambda a, z, n=n: np.cos(n * a)))
        # scattered nodes in a height class are no ring: other harmonics get something too
        assert np.argmax(power) == n
        assert power[n] > 1.5 * np.sort(power)[-2]


def test_quadratic_cells_see_harmonics_of_their_mid_side_nodes(comm):
    balloon = make(comm, 8, order=2)
    power = power_of(balloon, field(balloon, 0, lambda a, z: np.cos(6 * a)))
    assert np.argmax(power) == 6


def label_of(balloon, u):
    return kind_of(balloon, u, dominant(power_of(balloon, u))[0])


def test_names(comm):
    balloon = make(comm, 16, lobes=2)
    seam = balloon.surface.shape.height

    def film_mesh(a, z):
        return np.cos(5 * a) * np.sin(np.pi * z / seam) ** 2

    x = np.zeros((len(balloon.u.x.array) // 3, 3), dtype=complex)
    x[:, 0] = 1.0
    assert label_of(balloon, x) == "sway"
    assert label_of(balloon, field(balloon, 1, lambda a, z: z)) == "twist"
    assert label_of(balloon, field(balloon, 0, lambda a, z: np.ones_like(a))) == "global"
    assert label_of(balloon, field(balloon, 2, lambda a, z: z)) == "global"
    # the film's pattern of fixed wrinkles: hoopwise, with a radial part
    assert label_of(balloon, field(balloon, 1, film_mesh) + 0.3 * field(balloon, 0, film_mesh)) == "local"
    # a ring made oval without stretching it, u = cos 2a, v = -sin(2a)/2
    oval = field(balloon, 0, lambda a, z: np.cos(2 * a)) - field(balloon, 1, lambda a, z: np.sin(2 * a) / 2)
    assert label_of(balloon, oval) == "global"


@pytest.mark.parametrize("n", [65, 70, 75])
def test_harmonics_run_to_half_the_nodes_on_a_ring(comm, n):
    balloon = make(comm, 150, lobes=1)
    power = power_of(balloon, field(balloon, 0, lambda a, z: np.cos(n * a)))
    assert len(power) == 76
    assert power[n] == pytest.approx(1, abs=1e-12)


@pytest.mark.parametrize("n", [65, 70, 72])
def test_a_mode_of_a_single_harmonic_has_its_name(n):
    balloon = make(MPI.COMM_SELF, 144, lobes=1)
    mode = find_modes(inflate(balloon, 10.0), 1, harmonics=n)[0]
    assert (mode.harmonic, mode.harmonics) == (n, (n,))
    assert mode.kind in ("local", "global")
    strained = Balloon(balloon.surface, FixedWrinkles(), [GasPressure("film"), EndPlates()], prestressed=True)
    assert critical_pressure(strained, harmonic=n).mode.harmonic == n


def test_nodes_of_one_height_are_a_ring_on_any_mesh(comm):
    """Evenly spaced, they cannot tell n from N - n, N + n, ...: the lowest is the name."""
    for around in (12, 16):
        surface = lobed_cylinder(2, (4, around), comm=comm)
        balloon = Balloon(replace(surface, divisions=None, cyclic_order=None), Isotropic(), [EndPlates()])
        for n in (0, 1, around // 2):
            power = power_of(balloon, field(balloon, 0, lambda a, z, n=n: np.cos(n * a)))
            assert len(power) == around // 2 + 1
            assert power[n] == pytest.approx(1, abs=1e-12)
            assert dominant(power)[0] == n


def test_of_equal_aliases_the_lowest_is_the_name():
    power = np.zeros(65)
    power[[1, 11, 13, 23]] = 0.25 + np.array([0, 1e-12, 2e-12, -1e-12])
    assert dominant(power)[0] == 1
    assert sorted(dominant(power)[:4]) == [1, 11, 13, 23]
    power[13] = 0.26
    assert dominant(power)[0] == 13


def test_a_grid_that_was_shaken_by_hand_keeps_its_harmonics(comm):
    """Its nodes are at heights of their own then."""
    surface = lobed_cylinder(2, (6, 16), comm=comm)
    x = surface.mesh.geometry.x
    x += 1e-4 * np.sin(1e3 * x[:, ::-1])  # of the place alone, so that ghosts are where their owners are
    balloon = Balloon(surface, Isotropic(), [EndPlates()])
    power = power_of(balloon, field(balloon, 0, lambda a, z: np.cos(3 * a)))
    assert dominant(power)[0] == 3
    assert power[3] > 0.8
