"""The closed-form shape against known numbers, quadrature, an ODE and equilibrium."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp

from lobefem.errors import InputError
from lobefem.geometry.isotensoid import MAX_TRUNCATION, Isotensoid

pytestmark = pytest.mark.serial

# the same examples on every rank, and no shared database
same_everywhere = settings(derandomize=True, database=None, deadline=None, max_examples=40)
shapes = st.builds(Isotensoid, R0=st.floats(1e-3, 1e3), truncation=st.floats(0.01, MAX_TRUNCATION))


def test_unit_shape_has_the_published_numbers():
    unit = Isotensoid(1.0)
    assert unit.edge_radius == pytest.approx(0.52507, abs=5e-6)
    assert math.degrees(unit.edge_angle) == pytest.approx(16.004, abs=5e-4)
    assert unit.arc_length == pytest.approx(1.56367, abs=5e-6)
    assert unit.volume == pytest.approx(2.69456, abs=5e-6)
    assert unit.height == 1.1
    assert unit.half_height == 0.55


def test_the_closed_surface_is_the_limit_of_the_truncated_one():
    # towards the pole R -> 0, and arc length, height and volume reach the whole meridian's
    nearly = Isotensoid(1.0, MAX_TRUNCATION)
    left = nearly.edge_radius  # dz = R^2 ds near the pole, with ds = -dR to leading order
    assert nearly.half_height + left**3 / 3 == pytest.approx(0.59907, abs=5e-6)
    assert nearly.arc_length / 2 + left == pytest.approx(1.31103, abs=5e-6)
    assert nearly.volume == pytest.approx(2.74581, abs=5e-6)


def test_paper_design():
    lobe = Isotensoid.from_edge_radius()
    assert lobe.edge_radius == pytest.approx(2.0, rel=1e-15)
    assert pytest.approx(3.80900, abs=5e-6) == lobe.R0
    assert lobe.height == pytest.approx(4.18990, abs=5e-6)
    assert lobe.arc_length == pytest.approx(5.9560, abs=5e-5)
    assert 4 * lobe.volume == pytest.approx(595.64, abs=1e-2)
    assert lobe == Isotensoid.from_edge_radius(2.0, 0.55)


def test_meridian_solves_its_differential_equation():
    # dz/ds = (R/R0)^2 and dR/ds = -sqrt(1 - (R/R0)^4); the square root is singular at the
    # equator, so integrate the angle instead: d(phi)/ds = 2 R / R0^2 * dR/ds / cos(phi)
    lobe = Isotensoid(2.5, 0.58)
    s = np.linspace(0.0, lobe.arc_length / 2, 41)
    solution = solve_ivp(
        lambda _, y: [-math.cos(y[2]), math.sin(y[2]), -2.0 * y[0] / lobe.R0**2],
        (0.0, s[-1]),
        [lobe.R0, 0.0, math.pi / 2],
        t_eval=s,
        rtol=1e-12,
        atol=1e-13,
        method="DOP853",
    )
    np.testing.assert_allclose(lobe.radius(s), solution.y[0], rtol=0, atol=1e-10)
    np.testing.assert_allclose(lobe.z(s), solution.y[1], rtol=0, atol=1e-10)
    np.testing.assert_allclose(lobe.angle(s), solution.y[2], rtol=0, atol=1e-10)


@same_everywhere
@given(shape=shapes)
def test_volume_area_and_arc_by_quadrature(shape):
    half = shape.arc_length / 2

    def over_meridian(f):
        return 2.0 * quad(f, 0.0, half, epsabs=0, epsrel=1e-12)[0]

    volume = over_meridian(lambda s: math.pi * shape.radius(s) ** 2 * shape.slope(s)[1])
    area = over_meridian(lambda s: 2.0 * math.pi * float(shape.radius(s)))
    assert shape.volume == pytest.approx(volume, rel=1e-11)
    assert shape.area == pytest.approx(area, rel=1e-11)
    assert over_meridian(lambda s: float(shape.slope(s)[1])) == pytest.approx(shape.height, rel=1e-11)


@same_everywhere
@given(shape=shapes, factor=st.floats(0.1, 10.0))
def test_scaling(shape, factor):
    scaled = Isotensoid(factor * shape.R0, shape.truncation)
    for name, power in (
        ("edge_radius", 1),
        ("height", 1),
        ("arc_length", 1),
        ("area", 2),
        ("volume", 3),
        ("edge_angle", 0),
    ):
        assert getattr(scaled, name) == pytest.approx(factor**power * getattr(shape, name), rel=1e-12)
    s = shape.stations(7)
    # the arc of a stretched lobe may end a last bit short of the stretched arc
    np.testing.assert_allclose(scaled.radius(scaled.stations(7)), factor * shape.radius(s), rtol=1e-11)
    assert scaled.seam_tension(3.0) == pytest.approx(factor**2 * shape.seam_tension(3.0))


@same_everywhere
@given(shape=shapes, edge_radius=st.floats(1e-2, 1e2))
def test_edge_radius_round_trip(shape, edge_radius):
    again = Isotensoid.from_edge_radius(shape.edge_radius, shape.truncation)
    assert pytest.approx(shape.R0, rel=1e-13) == again.R0
    given_edge = Isotensoid.from_edge_radius(edge_radius, shape.truncation)
    assert given_edge.edge_radius == pytest.approx(edge_radius, rel=1e-14)


def test_tangent_is_the_derivative_and_a_unit_vector():
    lobe = Isotensoid.from_edge_radius()
    s, h = lobe.stations(40)[1:-1], 1e-5
    radial, axial = lobe.slope(s)
    np.testing.assert_allclose(radial, (lobe.radius(s + h) - lobe.radius(s - h)) / (2 * h), atol=1e-9)
    np.testing.assert_allclose(axial, (lobe.z(s + h) - lobe.z(s - h)) / (2 * h), atol=1e-9)
    np.testing.assert_allclose(radial**2 + axial**2, 1.0, rtol=1e-14)
    np.testing.assert_allclose(np.sin(lobe.angle(s)), (lobe.radius(s) / lobe.R0) ** 2, rtol=1e-14)


def test_angle_is_accurate_next_to_the_equator():
    # there phi = pi/2 - sqrt 2 a = pi/2 - 2 s / R0, where arcsin would round to pi/2
    lobe = Isotensoid(1.0)
    assert math.pi / 2 - float(lobe.angle(1e-9)) == pytest.approx(2e-9, rel=1e-6)
    assert float(lobe.angle(0.0)) == pytest.approx(math.pi / 2, rel=1e-15)


def test_film_ring_is_in_equilibrium_without_hoop_stress():
    """Axial: d(2 pi R N sin phi) = p dA of the ring's projection; normal: N k = p."""
    lobe, p = Isotensoid.from_edge_radius(), 37.5
    s, h = lobe.stations(60)[1:-1], 1e-4

    def axial_pull(s):
        R = lobe.radius(s)
        return 2.0 * math.pi * R * lobe.meridional_resultant(p, R) * np.sin(lobe.angle(s))

    # pressure on the closed cap above any cut: the film's pull is p times the area of the cut
    np.testing.assert_allclose(axial_pull(s), p * math.pi * lobe.radius(s) ** 2, rtol=1e-13)

    # radially, per radian: d(R N dR/ds)/ds = -p R dz/ds, with no hoop term
    def radial_pull(s):
        R = lobe.radius(s)
        return R * lobe.meridional_resultant(p, R) * lobe.slope(s)[0]

    derivative = (radial_pull(s + h) - radial_pull(s - h)) / (2 * h)
    np.testing.assert_allclose(derivative, -p * lobe.radius(s) * lobe.slope(s)[1], rtol=1e-6)


def test_seam_and_plate_forces_are_free_body_facts():
    lobe, p = Isotensoid.from_edge_radius(), 5.0
    N = float(lobe.meridional_resultant(p, lobe.edge_radius))
    hoop = 2.0 * N * math.cos(lobe.edge_angle) * lobe.edge_radius
    assert lobe.seam_tension(p) == pytest.approx(hoop, rel=1e-13)
    plate = 2.0 * math.pi * lobe.edge_radius * N * math.sin(lobe.edge_angle)
    assert lobe.plate_force(p) == pytest.approx(plate, rel=1e-13)
    assert lobe.plate_force(p) == pytest.approx(p * math.pi * 4.0, rel=1e-13)
    # cut by a plane through the axis: pressure on the cut = films' pull there (none: no hoop
    # stress) + both edges' share; each edge carries half a hoop's tension on either side
    section = 2.0 * quad(lambda s: float(lobe.radius(s) * lobe.slope(s)[1]), 0, lobe.arc_length / 2)[0]
    assert 2.0 * p * section == pytest.approx(2.0 * lobe.seam_tension(p), rel=1e-9)


def test_equator_resultant():
    lobe = Isotensoid(4.0)
    assert float(lobe.meridional_resultant(10.0, 4.0)) == pytest.approx(20.0)


def test_stations_are_equal_steps_of_arc_between_the_edges():
    lobe = Isotensoid.from_edge_radius()
    s = lobe.stations(24)
    assert s.shape == (25,)
    assert np.ptp(np.diff(s)) < 1e-14
    assert s[12] == 0.0
    np.testing.assert_array_equal(s, -s[::-1])
    np.testing.assert_allclose(lobe.z(s[[0, -1]]), [-lobe.half_height, lobe.half_height], rtol=1e-14)
    np.testing.assert_allclose(lobe.radius(s[[0, -1]]), 2.0, rtol=1e-14)


def test_functions_keep_the_shape_of_their_argument():
    lobe = Isotensoid(1.0)
    s = np.linspace(-0.5, 0.5, 6).reshape(2, 3)
    for values in (lobe.radius(s), lobe.z(s), lobe.angle(s), *lobe.slope(s)):
        assert np.shape(values) == (2, 3)
    assert np.shape(lobe.radius(0.1)) == ()
    assert lobe.meridional_resultant(1.0, lobe.radius(s)).shape == (2, 3)


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf, "2", None, True, 1j])
def test_bad_radius_is_refused(bad):
    with pytest.raises(InputError, match="equator radius R0 is"):
        Isotensoid(bad)
    with pytest.raises(InputError, match="edge radius is"):
        Isotensoid.from_edge_radius(bad)


@pytest.mark.parametrize("bad", [0.0, -0.1, 0.5991, 1.0, math.nan, "x"])
def test_bad_truncation_is_refused(bad):
    with pytest.raises(InputError, match=r"truncation \|z\|/R0 is"):
        Isotensoid(1.0, bad)
    with pytest.raises(InputError, match=r"truncation \|z\|/R0 is"):
        Isotensoid.from_edge_radius(2.0, bad)


def test_bad_arguments_of_the_functions_are_refused():
    lobe = Isotensoid(1.0)
    for s in (0.8, -0.8, math.nan, [0.0, 0.79]):
        with pytest.raises(InputError, match=r"outside the lobe; give -0\.781833 m"):
            lobe.radius(s)
    for radius in (0.0, -1.0, math.nan, [1.0, 0.0]):
        with pytest.raises(InputError, match="not a positive number of metres"):
            lobe.meridional_resultant(1.0, radius)
    for method in (lobe.seam_tension, lobe.plate_force):
        with pytest.raises(InputError, match="pressure is nan; give a finite number"):
            method(math.nan)
    for count in (0, -3, 2.0, True):
        with pytest.raises(InputError, match="steps along the meridian is"):
            lobe.stations(count)
