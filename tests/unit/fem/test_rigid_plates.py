"""Plates: finite rotations, the bar, the enclosed volume, and their derivatives."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from lobefem.errors import InputError
from lobefem.fem.boundary_conditions import plate_motion
from lobefem.fem.rigid_plates import PlateMotion, rotation
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.geometry.surface_checks import examine
from lobefem.model.end_plates import EndPlates, PlateLoad

H = 1e-3


def central(f, x, i):
    e = np.zeros_like(x)
    e[i] = H
    # fourth order: its error is 1e-13 of the fifth derivative
    return (8 * (f(x + e) - f(x - e)) - (f(x + 2 * e) - f(x - 2 * e))) / (12 * H)


def check_derivatives(f, x, n):
    """value, gradient and Hessian of f against fourth-order differences; derivative axes lead or trail."""
    value, first, second = f(x)
    value = np.asarray(value)
    for i in range(n):
        d = central(lambda y: np.asarray(f(y)[0]), x, i)
        np.testing.assert_allclose(first(i), d, rtol=0, atol=1e-9 * (1 + np.abs(d).max()))
        for j in range(n):
            d = central(lambda y, i=i: np.asarray(f(y)[1](i)), x, j)
            np.testing.assert_allclose(second(i, j), d, rtol=0, atol=1e-8 * (1 + np.abs(d).max()))


THETAS = [
    (0, 0, 0),
    (1e-9, 0, 2e-9),
    (0.3, -0.2, 0.1),
    (0, 0, math.pi),
    (2.5, -1.5, 3.0),
    (0, 6.2, 0),
]


@pytest.mark.parametrize("theta", THETAS)
def test_rotation_is_that_of_its_vector(theta):
    R, _, _ = rotation(np.array(theta))
    np.testing.assert_allclose(R, Rotation.from_rotvec(theta).as_matrix(), rtol=0, atol=1e-13)


@pytest.mark.parametrize("theta", THETAS)
def test_derivatives_of_the_rotation(theta):
    def f(t):
        R, dR, d2R = rotation(t)
        return R, lambda a: dR[a], lambda a, b: d2R[a, b]

    check_derivatives(f, np.array(theta, dtype=float), 3)


def test_taylor_of_the_rotation():
    theta, d = np.array([0.7, -0.4, 1.1]), np.array([0.2, 0.3, -0.5])
    R, dR, d2R = rotation(theta)
    first, second = np.einsum("a,aij->ij", d, dR), np.einsum("a,b,abij->ij", d, d, d2R)
    steps = 0.1 * 0.5 ** np.arange(5)
    for order, terms in ((1, ()), (2, (first,)), (3, (first, second / 2))):
        left = []
        for h in steps:
            rest = rotation(theta + h * d)[0] - R
            rest = rest - sum(h ** (k + 1) * term for k, term in enumerate(terms))
            left.append(np.linalg.norm(rest))
        np.testing.assert_allclose(np.log2(np.divide(left[:-1], left[1:])), order, atol=0.1)


def motion(plates, direction=(0, 0, 1)):
    e = np.array(direction, dtype=float) / np.linalg.norm(direction)
    return PlateMotion(plates, np.array([0.3 * e, 4.5 * e]), np.array([12.0, 11.0]))


ALL = [EndPlates(support, bar) for support in ("clamped", "pinned", "fixed") for bar in (True, 3e6, False)]
NAMES = {
    ("clamped", True): ["bar_tilt_1", "bar_tilt_2"],
    ("clamped", False): ["top_x", "top_y", "top_z"],
    ("pinned", True): ["bottom_tilt_1", "bottom_tilt_2", "bar_tilt_1", "bar_tilt_2"],
    ("pinned", False): ["bottom_tilt_1", "bottom_tilt_2", "top_x", "top_y", "top_z"],
}


@pytest.mark.parametrize("plates", ALL, ids=str)
def test_free_parameters_are_named(plates):
    m = motion(plates)
    if plates.support == "fixed":
        assert m.names == ()
        assert not m.moving
    else:
        turns = ["rotation_x", "rotation_y", "rotation_z"]
        expected = NAMES[plates.support, plates.bar is True] + [f"top_{n}" for n in turns]
        assert list(m.names) == expected
        assert m.moving
    assert m.size == len(m.names)


@pytest.mark.parametrize("direction", [(0, 0, 1), (0, 1, 0), (1, -2, 0.5)])
@pytest.mark.parametrize("plates", ALL[:6], ids=str)
def test_derivatives_of_the_plates_motion(plates, direction):
    m = motion(plates, direction)

    def f(y):
        w, dw, d2w = m.evaluate(y)
        return w, lambda i: dw[:, i], lambda i, j: d2w[:, i, j]

    check_derivatives(f, np.random.default_rng(1).uniform(-0.6, 0.6, m.size), m.size)
    w, _, _ = m.evaluate(np.zeros(m.size))
    np.testing.assert_array_equal(w, 0)


@pytest.mark.parametrize("direction", [(0, 0, 1), (1, -2, 0.5)])
@pytest.mark.parametrize("support", ["clamped", "pinned"])
def test_supports_and_rigid_bar_hold_what_they_say(support, direction):
    m = motion(EndPlates(support, True), direction)
    y = np.random.default_rng(2).uniform(-1, 1, m.size)
    w, dw, _ = m.evaluate(y)
    np.testing.assert_array_equal(w[:3], 0)
    if support == "clamped":
        np.testing.assert_array_equal(w[3:6], 0)
    else:
        assert abs(w[3:6] @ m.direction) < 1e-15  # no spin
        assert np.linalg.matrix_rank(dw[3:6]) == 2
    top = m.centres[1] + w[6:9]
    assert np.linalg.norm(top - m.centres[0]) == pytest.approx(m.length, rel=1e-14)
    assert np.linalg.norm(w[6:9]) > 0.1
    assert np.linalg.matrix_rank(dw) == m.size


@pytest.mark.parametrize("direction", [(0, 0, 1), (1, -2, 0.5)])
@pytest.mark.parametrize("plates", ALL, ids=str)
def test_parameters_are_found_again_in_the_motion(plates, direction):
    m = motion(plates, direction)
    y = np.random.default_rng(5).uniform(-0.8, 0.8, m.size)
    np.testing.assert_allclose(m.coordinates(m.evaluate(y)[0]), y, rtol=0, atol=1e-14)
    np.testing.assert_array_equal(m.coordinates(np.zeros(12)), 0)


def test_fixed_plates_lift_along_the_axis():
    m = PlateMotion(EndPlates("fixed", lift=0.004), np.array([[0, 0, 0], [0, 0, 4.0]]), np.ones(2))
    w, dw, _ = m.evaluate(np.empty(0))
    np.testing.assert_array_equal(w, [0] * 8 + [0.004] + [0] * 3)
    assert dw.shape == (12, 0)


@pytest.mark.parametrize("direction", [(0, 0, 1), (1, -2, 0.5)])
def test_derivatives_of_the_plates_volume(direction):
    m = motion(EndPlates("pinned", False), direction)

    def f(w):
        value, gradient, hessian = m.volume_change(w)
        return value, lambda i: gradient[i], lambda i, j: hessian[i, j]

    w = np.random.default_rng(3).uniform(-0.8, 0.8, 12)
    check_derivatives(f, w, 12)
    assert m.volume_change(np.zeros(12))[0] == 0
    assert m.volume == pytest.approx((11.0 * 4.5 - 12.0 * 0.3) / 3)
    # against the definition, A R n . (C + d)/3
    areas = m.turned_area_vectors(w)
    whole = sum(a @ (c + d) for a, c, d in zip(areas, m.centres, w.reshape(4, 3)[::2], strict=True)) / 3
    assert m.volume + m.volume_change(w)[0] == pytest.approx(whole, rel=1e-13)
    np.testing.assert_allclose(np.linalg.norm(areas, axis=1), [12.0, 11.0], rtol=1e-14)


def test_derivatives_of_the_elastic_bar():
    m = motion(EndPlates("pinned", 3e6), (1, -2, 0.5))

    def f(w):
        value, gradient, hessian = m.bar_energy(w, -4e5)
        return value / 1e6, lambda i: gradient[i] / 1e6, lambda i, j: hessian[i, j] / 1e6

    w = np.random.default_rng(4).uniform(-0.5, 0.5, 12)
    check_derivatives(f, w, 12)
    x = m.length * m.direction + w[6:9] - w[:3]
    stretch = np.linalg.norm(x) - m.length
    force = -4e5 + 3e6 / m.length * stretch
    assert m.bar_force(w, np.zeros(3), -4e5) == pytest.approx(force, rel=1e-13)
    np.testing.assert_allclose(m.bar_energy(w, -4e5)[1][6:9], force * x / np.linalg.norm(x))


def test_bar_force_of_a_rigid_bar_balances_the_rest():
    m = motion(EndPlates("clamped", True))
    w, _, _ = m.evaluate(np.zeros(m.size))
    # energy falls by 7 N along +z: the rest pulls the plate up, the bar in tension holds it
    assert m.bar_force(w, np.array([1.0, 2.0, -7.0]), 0.0) == pytest.approx(7.0)
    assert motion(EndPlates("clamped", False)).bar_force(w, np.ones(3), 0.0) is None
    assert motion(EndPlates("fixed", True)).bar_force(w, np.ones(3), 0.0) is None


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"support": "welded"}, r"^support 'welded' is unknown; use one of clamped, pinned, fixed$"),
        ({"bar": -1.0}, r"^bar stiffness EA is -1.0; give a positive number \[N\]$"),
        ({"bar": math.nan}, r"^bar stiffness EA is nan; give a finite number \[N\]$"),
        ({"bar": "rigid"}, r"^bar is 'rigid'; give True, False, or its stiffness EA \[N\]$"),
        ({"bar": None}, r"^bar is None; give True, False, or its stiffness EA \[N\]$"),
        ({"support": "fixed", "lift": math.inf}, r"^lift is inf; give a finite number \[m\]$"),
        ({"support": "fixed", "lift": "4 mm"}, r"^lift is '4 mm'; give a number \[m\]$"),
        ({"lift": 0.01}, r"^lift = 0.01 m needs support 'fixed'.*'clamped'"),
    ],
)
def test_errors(arguments, text):
    with pytest.raises(InputError, match=text):
        EndPlates(**arguments)


def test_plate_load_takes_three_finite_numbers():
    for bad in ((0, 0), 5.0, "123", None, np.array(5.0), np.eye(3)):
        with pytest.raises(InputError, match=r"(?s)^a plate's force is .*; give 3 numbers \[N\] in a row"):
            PlateLoad(force=bad)
    for bad in ((0, math.nan, 0), ("1", "2", "3")):
        with pytest.raises(InputError, match=r"^a part of a plate's moment is .*; give a .*number \[N m\]$"):
            PlateLoad(moment=bad)
    assert PlateLoad(force=np.array([0.0, 0.0, 1.0])).moment == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("length", [6.5, 40.0, 1e9])
def test_a_turn_beyond_a_whole_one(length):
    """Where a Newton step goes astray: no overflow, and a rotation with its derivatives as before."""
    theta = length * np.array([0.6, 0.0, -0.8])
    R, dR, d2R = rotation(theta)
    np.testing.assert_allclose(R, Rotation.from_rotvec(theta).as_matrix(), atol=1e-6)
    if length < 100:
        h = 1e-5
        for i in range(3):
            e = h * np.eye(3)[i]
            after, before = rotation(theta + e), rotation(theta - e)
            np.testing.assert_allclose((after[0] - before[0]) / (2 * h), dR[i], atol=1e-8)
            np.testing.assert_allclose((after[1] - before[1]) / (2 * h), d2R[i], atol=1e-8)


@pytest.mark.parametrize("order", [1, 2])
def test_plates_lie_in_the_planes_of_their_rims(comm, order):
    """On curved edges the mean height is that only where it and the length have one quadrature rule."""
    surface = lobed_cylinder(3, (3, 7), order=order, comm=comm)
    motion = plate_motion(surface, EndPlates(), examine(surface, True))
    expected = [[0.0, 0.0, 0.0], [0.0, 0.0, 3 * surface.shape.height]]
    np.testing.assert_allclose(motion.centres, expected, rtol=1e-14, atol=1e-13)
