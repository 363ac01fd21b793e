"""Tendon curves of pumpkin balloons: closed forms of the isotensoid, natural shapes of the literature."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from lobefem.errors import InputError
from lobefem.geometry.natural_curve import NaturalCurve
from lobefem.geometry.pumpkin_curve import PumpkinCurve

G = 9.80665


def test_pumpkin_from_pole_to_pole():
    curve = PumpkinCurve(1.0, 1e-9)
    assert curve.arc_length == pytest.approx(2.6220576, abs=1e-7)
    assert curve.height == pytest.approx(1.1981402, abs=1e-7)
    assert curve.volume == pytest.approx(2.7458122, abs=1e-7)
    assert curve.area == pytest.approx(math.pi**2, rel=1e-9)
    assert curve.tension(10.0, 64) == pytest.approx(10 * math.pi / 64)


@pytest.mark.parametrize(
    "curve",
    [
        PumpkinCurve(5.0, (0.15, 0.4)),
        NaturalCurve(payload=100.0, gradient=0.1, pressure=2.0, film_weight=0.05, fitting_radii=(0.1, 0.3)),
    ],
    ids=["pumpkin", "natural"],
)
def test_a_curve_agrees_with_its_own_integrals(curve):
    L = curve.arc_length
    assert curve.z(0.0) == pytest.approx(0, abs=1e-9)
    assert curve.z(L) == pytest.approx(curve.height, rel=1e-9)
    np.testing.assert_allclose(curve.radius([0.0, L]), curve.fitting_radii, rtol=1e-7)
    assert pytest.approx(curve.radius(np.linspace(0, L, 20001)).max(), rel=1e-7) == curve.R0
    for exact, integrand in (
        (curve.volume, lambda s: math.pi * float(curve.radius(s)) ** 2 * float(curve.slope(s)[1])),
        (curve.area, lambda s: 2 * math.pi * float(curve.radius(s))),
    ):
        assert quad(integrand, 0, L, epsrel=1e-9)[0] == pytest.approx(exact, rel=1e-7)
    s, h = np.linspace(0.05, 0.95, 7) * L, 1e-4 * L
    dr, dz = curve.slope(s)
    np.testing.assert_allclose(dr**2 + dz**2, 1, rtol=1e-12)
    np.testing.assert_allclose((curve.radius(s + h) - curve.radius(s - h)) / (2 * h), dr, atol=1e-6)
    np.testing.assert_allclose((curve.z(s + h) - curve.z(s - h)) / (2 * h), dz, atol=1e-6)
    turned = np.diff([np.unwrap(np.arctan2(*curve.slope(x)[::-1])) for x in (s - h, s + h)], axis=0)[0]
    np.testing.assert_allclose(turned / (2 * h), curve.curvature(s), rtol=1e-5)


def test_pumpkin_of_a_length_or_a_volume():
    radii = (0.1, 0.2)
    assert PumpkinCurve.of_tendon_length(10.0, radii).arc_length == pytest.approx(10, rel=1e-12)
    assert PumpkinCurve.of_volume(100.0, radii).volume == pytest.approx(100, rel=1e-12)


@pytest.mark.parametrize(
    ("sigma", "numbers"),
    [
        (0.0, (50.149, 1.99441, 0.65218, 1.28421, 1.0)),
        (0.2, (58.886, 2.35043, 0.81333, 1.40675, 1.78385)),
        (0.4, (67.920, 2.87047, 1.03599, 1.59121, 3.43819)),
    ],
)
def test_natural_shapes_without_pressure_at_the_nadir(sigma, numbers):
    W, b = 100.0, 0.1
    lam = (W / b) ** (1 / 3)
    curve = NaturalCurve(payload=W, gradient=b, film_weight=sigma * b * lam / (2 * math.pi) ** (1 / 3))
    theta, *lengths, volume = numbers
    assert math.degrees(curve.bottom_angle) == pytest.approx(theta, abs=6e-4)
    found = np.array([curve.arc_length, curve.R0, curve.height]) / lam
    np.testing.assert_allclose(found, lengths, rtol=4e-5)  # the radius is the largest of a table
    assert curve.volume / lam**3 == pytest.approx(volume, abs=6e-6)
    # the lift bears payload and film
    assert b * curve.volume == pytest.approx(W + curve.film_weight * curve.area, rel=1e-9)


@pytest.mark.parametrize(
    ("pressure", "theta", "slenderness"), [(1, 69.330, 2.79755), (4, 82.275, 2.67646), (16, 87.844, 2.63601)]
)
def test_weightless_natural_shapes_approach_the_isotensoid(pressure, theta, slenderness):
    lam = 10.0
    curve = NaturalCurve(payload=100.0, gradient=0.1, pressure=pressure * 0.1 * lam)
    assert math.degrees(curve.bottom_angle) == pytest.approx(theta, abs=1e-3)
    # the rounded figure of the largest pressure is 3e-5 off; its limit is 2.62206
    assert curve.arc_length / curve.R0 == pytest.approx(slenderness, rel=3e-5)


def test_superpressure_balloon_of_18_8_million_cubic_feet():
    """Its film averages 0.0466 kg/m^2 with the cap; figures of another integration to 0.03 %."""
    curve = NaturalCurve(
        payload=2273 * G, gradient=0.084887, pressure=170.0, film_weight=0.0466 * G,
        tendon_weight=280 * 0.015205 * G, fitting_weights=(64.1 * G, 91.4 * G), fitting_radii=(0.1, 0.35),
    )  # fmt: skip
    assert curve.arc_length + 0.1 + 0.35 == pytest.approx(151.80, rel=3e-4)  # from pole to pole
    assert pytest.approx(115.58, rel=3e-4) == 2 * curve.R0
    assert curve.height == pytest.approx(69.94, rel=3e-4)
    assert curve.volume == pytest.approx(532_766, rel=4e-4)
    np.testing.assert_allclose(curve.tension([0, curve.arc_length]) / 280, [6500, 6547], rtol=4e-4)


def test_a_cap_of_two_layers():
    """The published gore is 150.27 m long from pole to pole, the balloon 114.5 m wide and 68.96 m high."""
    w = 38.1e-6 * 920 * G
    curve = NaturalCurve(
        payload=2273 * G, gradient=0.084887, pressure=170.0, film_weight=w, cap_weight=w, cap_length=52.9,
        tendon_weight=280 * 0.015205 * G, fitting_weights=(64.1 * G, 91.4 * G), fitting_radii=(0.1, 0.35),
    )  # fmt: skip
    assert curve.arc_length + 0.45 == pytest.approx(150.27, rel=4e-3)
    assert pytest.approx(114.5, rel=4e-3) == 2 * curve.R0
    assert curve.height == pytest.approx(68.96, rel=8e-3)
    L = curve.arc_length
    cap = quad(lambda s: 2 * math.pi * float(curve.radius(s)), L - 52.9, L, epsrel=1e-9)[0]
    weight = w * (curve.area + cap) + curve.tendon_weight * L + (2273 + 64.1 + 91.4) * G
    assert curve.gradient * curve.volume == pytest.approx(weight, rel=1e-7)


def test_bad_input_is_refused_in_one_sentence():
    with pytest.raises(InputError, match=r"^the fitting radius 2 m is not smaller than the equator"):
        PumpkinCurve(1.0, (0.1, 2.0))
    with pytest.raises(InputError, match=r"^the fitting radius is \(1, 2, 3\); give one number or two"):
        PumpkinCurve(1.0, (1, 2, 3))
    with pytest.raises(InputError, match=r"^the tendon length 0.1 m is too small for fittings of"):
        PumpkinCurve.of_tendon_length(0.1, (0.1, 0.3))
    with pytest.raises(InputError, match=r"^an arc length lies beyond the fittings; give 0 <= s <= "):
        PumpkinCurve(1.0, 0.1).radius(-0.1)
    with pytest.raises(InputError, match=r"^the pressure gradient is 0; give a positive number"):
        NaturalCurve(payload=1.0, gradient=0)
    with pytest.raises(InputError, match=r"^the film's weight is -1; give zero or more \[N/m\^2\]$"):
        NaturalCurve(payload=1.0, gradient=1.0, film_weight=-1)
