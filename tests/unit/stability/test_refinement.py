"""Limits under mesh refinement and their error bars."""

import math

import numpy as np
import pytest

from lobefem.errors import InputError
from lobefem.stability.refinement import trend

pytestmark = pytest.mark.serial

H = 1 / np.array([1.0, 2.0, 4.0, 8.0])


def test_a_limit_and_its_order_are_found():
    found = trend(H, 100 + 50 * H**2)
    assert found.behaviour == "converges"
    assert (found.limit, found.order) == pytest.approx((100, 2), rel=1e-5)
    assert found.uncertainty < 1e-3


def test_an_uncertain_limit_covers_the_true_one():
    found = trend(H, 100 + 50 * H**2 + 30 * H**4)
    assert found.behaviour == "converges"
    assert 0 < abs(found.limit - 100) < found.uncertainty


def test_a_fall_has_no_limit():
    found = trend(H, 7e3 * H**5)
    assert (found.behaviour, found.limit) == ("falls", 0.0)
    assert found.order == pytest.approx(5)
    assert trend(H, [5.0, 3.0, 1.0, 0.0]).behaviour == "falls"


@pytest.mark.parametrize(
    "pressures",
    [
        10 + 90 * H,
        [3.0, 9.0, 2.0, 8.0],
        [100.0, 140.0, 96.0, 100.0],  # the finest lies near the fit, the others do not
        [math.inf, math.inf, 5.0, 4.0],
        [0.0, 1.0, 10.0, 100.0],
    ],
)
def test_what_the_meshes_do_not_tell_stays_open(pressures):
    found = trend(H, pressures)
    assert found.behaviour == "open"
    assert math.isnan(found.limit)


def test_harmonics_that_a_coarse_mesh_lacks_are_left_out():
    assert trend(H, [math.inf, *(100 + 50 * H**2)[1:]]).limit == pytest.approx(100)


# --- error bars ---------------------------------------------------------------------------------


@pytest.mark.parametrize("order", [0.8, 1.0, 1.6, 2.0])
@pytest.mark.parametrize("ratio", [1.5, 2.0])
def test_three_meshes_give_limit_order_and_the_whole_way_to_it_as_error(order, ratio):
    h = ratio ** -np.arange(3.0)
    values = 100 + 8 * h**order
    found = trend(h, values)
    assert found.behaviour == "converges"
    assert found.asymptotic
    assert (found.limit, found.order) == pytest.approx((100, order), rel=1e-4)
    assert found.error == pytest.approx(values[-1] / 100 - 1, rel=1e-2)


def test_mesh_sizes_need_no_constant_ratio():
    h = 1 / np.array([24.0, 32.0, 60.0])
    found = trend(h, 5 - 300 * h**2)
    assert (found.limit, found.order) == pytest.approx((5, 2), rel=1e-4)


@pytest.mark.parametrize("seed", range(6))
def test_the_bar_covers_the_limit_of_what_follows_no_single_power(seed):
    rng = np.random.default_rng(seed)
    h = 1.5 ** -np.arange(3.0)
    a, b = rng.uniform(0.5, 1.5, 2)
    found = trend(h, 100 + 5 * a * h + 5 * b * h**2 + rng.normal(0, 0.01, 3))
    assert found.behaviour == "converges"
    assert abs(found.limit - 100) < found.error * found.limit < 10


def test_a_difference_that_is_small_by_luck_makes_no_small_error():
    """Orders above those of the cells are not believed."""
    h = np.array([1.0, 0.5, 0.25])
    found = trend(h, [110.0, 101.0, 100.9])
    assert found.order > 5
    assert not found.asymptotic
    assert found.error == pytest.approx(3 * 0.1 / 3 / found.limit, rel=1e-6)


def test_values_that_swing_have_the_error_of_their_swing():
    found = trend(H[:3], [100.0, 99.0, 99.5])
    assert (found.behaviour, found.limit, found.asymptotic) == ("converges", 99.5, False)
    assert found.error == pytest.approx(3 / 99.5)
    assert math.isnan(found.order)


def test_values_that_do_not_move_have_no_error():
    found = trend(H[:3], [7.0, 7.0, 7.0])
    assert (found.behaviour, found.limit, found.error) == ("converges", 7.0, 0.0)


@pytest.mark.parametrize(
    ("meshes", "values"),
    [
        (((24, 32), (32, 48), (48, 72)), (278.6, 179.6, 110.1)),
        (((24, 32), (32, 48), (48, 72), (64, 96), (96, 128)), (278.6, 179.6, 110.1, 79.2, 53.2)),
        (((24, 32), (36, 48), (54, 72)), (278.57, 164.93, 101.49)),
    ],
)
def test_three_lobes_without_hoops_have_no_limit(meshes, values):
    """Critical pressures of lobefem itself: film holds the seams in a band one cell wide, ever softer."""
    found = trend([1 / np.sqrt(a * b) for a, b in meshes], values)
    assert (found.behaviour, found.limit) == ("falls", 0.0)
    assert 1 < found.order < 1.5
    assert math.isnan(found.error)


def test_a_limit_far_below_the_finest_mesh_stays_open():
    assert trend(H[:3], 30 + 70 * H[:3]).behaviour == "open"
    assert trend(H[:3], 50 + 50 * H[:3] ** 0.4).behaviour == "open"  # slow, whatever its limit


def test_the_limit_of_an_eigenvalue_may_be_negative():
    found = trend(H[:3], 2 * H[:3] - 3, signed=True)
    assert (found.behaviour, found.limit) == ("converges", pytest.approx(-3))
    falling = [3.0, 2.0, 0.9]
    assert trend(H[:3], falling, signed=True).behaviour == "falls"
    assert trend(H[:3], falling[::-1], signed=True).behaviour == "open"
    assert trend(H[:3], [1.0, 0.2, 0.0], signed=True).behaviour != "falls"


def test_sizes_that_do_not_fall_are_refused():
    with pytest.raises(InputError, match="do not fall"):
        trend([1.0, 1.0, 0.5], [1.0, 2.0, 3.0])
