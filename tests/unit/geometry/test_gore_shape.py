"""A gore between its tendons: closed forms of lobes, its length, its flat pattern, what is refused."""

import math
from dataclasses import dataclass

import numpy as np
import pytest

from lobefem.errors import InputError
from lobefem.geometry.gore import ConstantAngle, ConstantRadius, FlatLobe, Gore, TabulatedWidth
from lobefem.geometry.pumpkin_curve import PumpkinCurve

CURVE = PumpkinCurve(5.0, (0.15, 0.4))
LOBES = {
    "flat": FlatLobe(),
    "angle": ConstantAngle(math.radians(60)),
    "half circle": ConstantAngle(math.pi / 2),
    "radius": ConstantRadius(math.radians(75)),
    "table": TabulatedWidth((0.0, 0.4, 1.0), (0.12, 0.65, 0.2)),
}


@pytest.fixture(params=LOBES)
def gore(request):
    return Gore(CURVE, 32, LOBES[request.param])


def across(gore, s, count=2001):
    """Points of the gore across it at one station (count, 3)."""
    return gore.position(np.full(count, s), np.linspace(-1, 1, count))


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.93, 1.0])
def test_a_lobe_is_an_arc_between_two_tendons(gore, share):
    s = share * CURVE.arc_length
    x, alpha, h = across(gore, s), float(gore.half_angle(np.array(s))), float(gore.half_chord(np.array(s)))
    r, z = float(CURVE.radius(s)), float(CURVE.z(s))
    assert h == pytest.approx(r * math.sin(math.pi / 32), rel=1e-14)
    far = 2 * math.pi / 32
    np.testing.assert_allclose(x[0], [r, 0, z], atol=1e-12)
    np.testing.assert_allclose(x[-1], [r * math.cos(far), r * math.sin(far), z], atol=1e-12)
    middle = (x[0] + x[-1]) / 2
    rise = x[1000] - middle
    assert np.linalg.norm(rise) == pytest.approx(h * math.tan(alpha / 2), rel=1e-12, abs=1e-12)
    width = np.linalg.norm(np.diff(x, axis=0), axis=1).sum() / 2
    w = float(gore.half_width(np.array(s)))
    if alpha < math.pi / 2:
        assert width == pytest.approx(w, rel=1e-6)
    else:  # a gore that is wider is drawn as half a circle, and the rest of it lies in folds
        assert width == pytest.approx(h * math.pi / 2, rel=1e-6)
        assert width <= w * (1 + 1e-6)
    if alpha > 0:
        rho = float(gore.bulge_radius(np.array(s)))
        assert (math.sin(alpha), min(w, h * math.pi / 2)) == pytest.approx((h / rho, rho * alpha), rel=1e-12)
        centre = middle - rise / np.linalg.norm(rise) * rho * math.cos(alpha)
        np.testing.assert_allclose(np.linalg.norm(x - centre, axis=1), rho, rtol=1e-11)
    # it bulges outwards in the plane normal to the tendons' middle
    dr, dz = CURVE.slope(s)
    radial = np.array([math.cos(far / 2), math.sin(far / 2), 0])
    normal = dz * radial - dr * np.array([0, 0, 1.0])
    np.testing.assert_allclose(rise, h * math.tan(alpha / 2) * normal, atol=1e-12)


def test_kinds_of_lobes():
    s = np.linspace(0, CURVE.arc_length, 101)
    assert np.ptp(Gore(CURVE, 32, LOBES["radius"]).bulge_radius(s)) < 1e-12
    equator = np.array(CURVE.equator)
    assert Gore(CURVE, 32, LOBES["radius"]).half_angle(equator) == pytest.approx(math.radians(75), abs=1e-3)
    np.testing.assert_allclose(Gore(CURVE, 32, LOBES["angle"]).half_angle(s), math.radians(60))
    assert np.all(np.isinf(Gore(CURVE, 32, FlatLobe()).bulge_radius(s)))
    table = Gore(CURVE, 32, LOBES["table"])
    widths = table.half_width(CURVE.arc_length * np.array(LOBES["table"].stations))
    np.testing.assert_allclose(widths, LOBES["table"].half_widths, rtol=1e-12)


def test_length_of_the_centre_line(gore):
    s = np.linspace(0, CURVE.arc_length, 20001)
    x = gore.position(s, np.zeros(len(s)))
    steps = np.linalg.norm(np.diff(x, axis=0), axis=1)
    assert gore.centre_length == pytest.approx(steps.sum(), rel=1e-7)
    np.testing.assert_allclose(gore.along(s[1:]), np.cumsum(steps), rtol=1e-6, atol=1e-8)
    assert gore.along(np.array(0.0)) == pytest.approx(0, abs=1e-12)


def test_the_centre_line_is_longer_than_the_tendon():
    """By 2 H sin(pi/N) tan(alpha/2), kappa d over the height, and terms of 1/N^2.

    The terms are those of d'^2 and of the chord's middle, which is nearer to the axis than a tendon.
    """
    alpha, counts = math.radians(60), np.array([64, 128, 256, 512])
    excess = [Gore(CURVE, n, ConstantAngle(alpha)).centre_length - CURVE.arc_length for n in counts]
    formula = 2 * CURVE.height * np.sin(np.pi / counts) * math.tan(alpha / 2)
    error = np.abs(excess / formula - 1)
    assert error[-1] < 5e-3
    np.testing.assert_allclose(np.log2(error[:-1] / error[1:]), 1, atol=0.02)


def test_a_flat_gore(gore):
    s = np.array([0.0, 0.3, 1.0]) * CURVE.arc_length
    x, y = gore.pattern(s, np.array([-1.0, 0.5, 1.0])).T
    np.testing.assert_allclose(x, gore.along(s))
    np.testing.assert_allclose(y, gore.half_width(s) * [-1, 0.5, 1])


@dataclass(frozen=True)
class Cone:
    """A straight tendon, from a radius of 1 m to one of 2 m."""

    arc_length: float = 4.0

    def radius(self, s):
        return 1 + np.asarray(s) / 4

    def z(self, s):
        return np.asarray(s) * math.sqrt(15) / 4

    def slope(self, s):
        return 0.25 + 0 * np.asarray(s), math.sqrt(15) / 4 + 0 * np.asarray(s)


@pytest.mark.parametrize("angle", [0.0, 1.0])
def test_the_centre_line_of_a_straight_tendon_is_straight(angle):
    gore = Gore(Cone(), 8, ConstantAngle(angle))
    ends = gore.position(np.array([0.0, 4.0]), np.zeros(2))
    assert gore.centre_length == pytest.approx(np.linalg.norm(ends[1] - ends[0]), rel=1e-13)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: ConstantAngle(math.radians(91)), "half angle of a lobe is 91 degrees"),
        (lambda: ConstantRadius(-0.1), "half angle of a lobe is -5.73 degrees"),
        (lambda: TabulatedWidth((0.0, 1.0), (0.1,)), "as many half-widths as stations"),
        (lambda: TabulatedWidth((0.0, 0.9), (0.1, 0.1)), "ascend from 0 to 1"),
        (lambda: TabulatedWidth((0.0, 1.0), (0.1, -0.1)), "must be positive"),
        (lambda: Gore(CURVE, 2, FlatLobe()), "number of gores"),
        (
            lambda: Gore(CURVE, 32, TabulatedWidth((0.0, 1.0), (0.1, 0.1))),
            "less than the half chord of 0.4",
        ),
    ],
)
def test_what_is_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()
