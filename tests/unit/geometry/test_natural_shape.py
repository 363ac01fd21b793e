"""Lobes without hoop stress: closed form against the isotensoid, their differential equation, shooting."""

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import fsolve

from lobefem.errors import InputError
from lobefem.geometry.isotensoid import Isotensoid
from lobefem.geometry.natural_shape import NaturalShape, isotensoid_stiffness

pytestmark = pytest.mark.serial

DESIGN = Isotensoid.from_edge_radius()
LOBES = [
    NaturalShape.between_rims(2.0, 4.19, 0.05),
    NaturalShape.between_rims(2.0, 4.19, 0.5),
    NaturalShape.between_rims(2.0, 4.19, 0.6),
    NaturalShape.between_rims(4.0, 2.0, 1.0),
    NaturalShape.between_rims(10.0, 1.0, 4.0),
]
each_lobe = pytest.mark.parametrize("lobe", LOBES, ids=lambda lobe: f"m={lobe.m}")


def test_the_isotensoid_is_one_of_them():
    lobe = NaturalShape.between_rims(2.0, DESIGN.height)
    for name in (
        "R0", "edge_radius", "half_height", "height", "arc_length", "area", "volume", "meridional_tension",
    ):  # fmt: skip
        assert getattr(lobe, name) == pytest.approx(getattr(DESIGN, name), rel=1e-13), name
    assert lobe.axial_excess == DESIGN.axial_excess == 0.0
    assert lobe.seam_tension(5.0) == pytest.approx(DESIGN.seam_tension(5.0), rel=1e-13)
    s = DESIGN.stations(8)
    np.testing.assert_allclose(lobe.stations(8), s, rtol=1e-13)
    s = 0.999 * s
    for name in ("radius", "z", "slope", "angle"):
        np.testing.assert_allclose(getattr(lobe, name)(s), getattr(DESIGN, name)(s), rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(
        lobe.meridional_resultant(5.0, lobe.radius(s)), DESIGN.meridional_resultant(5.0, DESIGN.radius(s))
    )


@each_lobe
def test_meridian_solves_its_differential_equation(lobe):
    """R' = -cos phi, z' = sin phi and the film's balance of forces normal to it, phi' = -R/c."""
    c, half = lobe.meridional_tension, lobe.arc_length / 2
    path = solve_ivp(
        lambda s, y: [-np.cos(y[2]), np.sin(y[2]), -y[0] / c],
        (0.0, half),
        [lobe.R0, 0.0, np.pi / 2],
        rtol=1e-11,
        atol=1e-12,
        dense_output=True,
    )
    s = np.linspace(0.0, half, 9)
    R, z, phi = path.sol(s)
    np.testing.assert_allclose(lobe.radius(s), R, rtol=1e-8)
    np.testing.assert_allclose(lobe.z(s), z, rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(lobe.angle(s), phi, rtol=1e-7)
    np.testing.assert_allclose(np.hypot(*lobe.slope(s)), 1.0, rtol=1e-12)
    assert lobe.half_height == pytest.approx(z[-1], rel=1e-8)
    assert lobe.edge_radius == pytest.approx(R[-1], rel=1e-8)


@each_lobe
def test_area_volume_and_free_bodies_by_quadrature(lobe):
    half = lobe.arc_length / 2
    area, _ = quad(lambda s: 2 * math.pi * lobe.radius(s), -half, half)
    volume, _ = quad(lambda s: math.pi * lobe.radius(s) ** 2 * lobe.slope(s)[1], -half, half)
    assert lobe.area == pytest.approx(area, rel=1e-10)
    assert lobe.volume == pytest.approx(volume, rel=1e-10)
    p, R = 7.0, lobe.edge_radius
    N, phi = float(lobe.meridional_resultant(p, R)), float(lobe.angle(half))
    pull = 2 * math.pi * R * N * math.sin(phi)
    assert pull - p * math.pi * R**2 == pytest.approx(p * lobe.axial_excess, abs=1e-9 * pull)
    assert lobe.seam_tension(p) == pytest.approx(2 * N * math.cos(phi) * R, rel=1e-9)


def test_the_family_is_smooth_where_the_parameter_passes_one():
    below, above = (NaturalShape.between_rims(4.0, 2.0, m) for m in (1 - 1e-8, 1 + 1e-8))
    for name in ("R0", "arc_length", "volume", "area", "meridional_tension"):
        assert getattr(below, name) == pytest.approx(getattr(above, name), rel=1e-7), name


@pytest.mark.parametrize("pressure", [0.75, 10.0, 37.5, 60.0])
def test_inflated_cylinder_by_shooting(pressure):
    """The film's balance integrated from the equator, in the cylinder's own coordinate.

    Unknown are the equator radius and the stretch; hit must be the rim, which is held.
    """
    radius, length = 2.0, DESIGN.height
    Et = isotensoid_stiffness(radius, length)
    lobe = NaturalShape.inflated(radius, length, Et, pressure)

    def miss(unknown):
        R0, stretch = unknown
        c = radius * Et * stretch * (stretch**2 - 1) / 2 / pressure
        path = solve_ivp(
            lambda s, y: [-np.cos(y[2]), np.sin(y[2]), -y[0] / c],
            (0.0, stretch * length / 2),
            [R0, 0.0, np.pi / 2],
            rtol=1e-11,
            atol=1e-12,
        )
        return path.y[0, -1] - radius, path.y[1, -1] - length / 2

    widest, stretch = fsolve(miss, [1.02 * lobe.R0, 1.01 * lobe.arc_length / length], xtol=1e-12)
    found = lobe.R0, lobe.arc_length / length
    assert found == pytest.approx((widest, stretch), rel=1e-8)
    assert lobe.edge_radius == pytest.approx(radius, rel=1e-12)
    assert lobe.height == pytest.approx(length, rel=1e-12)


def test_stiffness_with_which_a_pressure_forms_the_isotensoid():
    radius, length = DESIGN.edge_radius, DESIGN.height
    stretch = DESIGN.arc_length / length
    assert stretch == pytest.approx(1.4215, abs=1e-4)  # 42 % along the meridian
    Et = isotensoid_stiffness(radius, length, 37.5)
    assert Et == pytest.approx(37.5 * DESIGN.R0**2 / (radius * stretch * (stretch**2 - 1)), rel=1e-12)
    assert Et == pytest.approx(187.49, abs=0.005)
    assert NaturalShape.inflated(radius, length, Et, 37.5).m == pytest.approx(0.5, abs=1e-12)
    # a film twice as stiff takes the same shape at twice the pressure
    assert NaturalShape.inflated(radius, length, 2 * Et, 75.0).m == pytest.approx(0.5, abs=1e-12)
    # the paper's 4.2 m are the design's 4.19 m, rounded
    paper = NaturalShape.between_rims(2.0, 4.2)
    assert paper.half_height / paper.R0 == pytest.approx(0.55, abs=3e-4)


def test_a_barely_pressurised_cylinder_stays_one():
    lobe = NaturalShape.inflated(2.0, 4.0, 200.0, 1e-9)
    # b^3 = 3 p L^4/(64 E t), the bulge of an almost flat film
    bulge = lobe.R0 - lobe.edge_radius
    assert bulge == pytest.approx((3 * 1e-9 * 4.0**4 / (64 * 200.0)) ** (1 / 3), rel=1e-3)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: NaturalShape(-1.0, 0.5, 1.0), "equator radius R0 is -1.0; give a positive"),
        (lambda: NaturalShape(1.0, 0.0, 1.0), "parameter m is 0.0; give a positive"),
        (lambda: NaturalShape(1.0, 0.5, 2.0), "argument is 2.0; with m = 0.5 give less than 1.85407"),
        (
            lambda: NaturalShape.between_rims(2.0, 4.0, 0.9),
            "with m = 0.9 the film bulges over rims of radius 2",
        ),
        (lambda: NaturalShape.between_rims(0.0, 4.0), "the radius is 0.0; give a positive number"),
        (
            lambda: NaturalShape.inflated(2.0, 4.19, 187.5, 100.0),
            "at 100 Pa a film of E t = 187.5 N/m bulges",
        ),
        (lambda: NaturalShape.inflated(2.0, 4.19, 1e12, 1e-15), "1e-15 Pa hardly bulge a film of E t = 1e"),
        (lambda: NaturalShape.inflated(2.0, 4.19, 187.5, -5.0), "the forming pressure is -5.0; give a pos"),
        (lambda: isotensoid_stiffness(2.0, 4.19, 0.0), "the forming pressure is 0.0; give a positive"),
        (lambda: LOBES[0].radius(3.0), "an arc length lies outside the lobe; give -"),
        (lambda: LOBES[0].meridional_resultant(5.0, 0.0), "a radius is not a positive number of metres"),
    ],
)
def test_what_cannot_be_is_refused(make, message):
    with pytest.raises(InputError) as caught:
        make()
    assert message in str(caught.value)
