"""Guides: what they prescribe, what they leave free, and their derivatives."""

import math

import numpy as np
import pytest
from test_rigid_plates import ALL, central, check_derivatives, motion

from lobefem.fem.prescribed_motion import BendMotion, TipMotion, TwistMotion
from lobefem.fem.rigid_plates import rotation
from lobefem.model.end_plates import EndPlates

pytestmark = pytest.mark.serial

MOVING = [plates for plates in ALL if plates.support != "fixed"]
SEAMS = ("seam_1", "seam_2", "seam_3")
DIRECTIONS = [(0, 0, 1), (1, -2, 0.5)]


def bend(m):
    heights = m.length * np.array([0.25, 0.5, 0.75])
    return BendMotion(m, SEAMS, m.centres[0] + heights[:, None] * m.direction)


GUIDES = {"tip": TipMotion, "twist": TwistMotion, "bend": bend}


def lead(name, plates, direction=(0, 0, 1)):
    m = motion(plates, direction)
    return m, GUIDES[name](m)


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("plates", MOVING, ids=str)
@pytest.mark.parametrize("name", GUIDES)
def test_derivatives(name, plates, direction):
    m, prescribed = lead(name, plates, direction)
    prescribed.parameter = 0.4
    y = np.random.default_rng(1).uniform(-0.5, 0.5, prescribed.size)

    def in_y(y):
        w, dw, d2w = prescribed.evaluate(y)
        return w, lambda i: dw[:, i], lambda i, j: d2w[:, i, j]

    check_derivatives(in_y, y, prescribed.size)

    def in_s(s):
        prescribed.parameter = float(s[0])
        return prescribed.evaluate(y)[0]

    for s in (0.0, 0.4, -0.7):
        difference = central(in_s, np.array([s]), 0)
        prescribed.parameter = s
        np.testing.assert_allclose(prescribed.rate(y), difference, rtol=0, atol=1e-10)
    assert len(prescribed.names) == prescribed.size == (0 if name == "bend" else m.size - 1)
    assert len(set(prescribed.names)) == prescribed.size


@pytest.mark.parametrize("plates", MOVING, ids=str)
@pytest.mark.parametrize("name", ["tip", "twist"])
def test_guide_and_the_free_rest_span_the_plates_motion(name, plates):
    """No freedom is lost but one: y and s together reach what the plates' own parameters do."""
    m, prescribed = lead(name, plates)
    prescribed.parameter = 0.3
    y = np.random.default_rng(2).uniform(-0.5, 0.5, prescribed.size)
    w, dw, _ = prescribed.evaluate(y)
    both = np.column_stack([dw, prescribed.rate(y)])
    assert np.linalg.matrix_rank(both) == m.size
    own = m.coordinates(w)
    _, tangent, _ = m.evaluate(own)
    np.testing.assert_allclose(m.evaluate(own)[0], w, rtol=0, atol=1e-14)
    assert np.linalg.matrix_rank(np.column_stack([both, tangent]), tol=1e-10) == m.size
    np.testing.assert_allclose(prescribed.coordinates(w), y, rtol=0, atol=1e-14)


@pytest.mark.parametrize("plates", MOVING, ids=str)
def test_tip_moves_its_centre_sideways_and_keeps_the_bar(plates):
    m, prescribed = lead("tip", plates)
    prescribed.parameter = -0.8
    y = np.random.default_rng(3).uniform(-0.5, 0.5, prescribed.size)
    w, _, _ = prescribed.evaluate(y)
    assert w[6] == pytest.approx(-0.8, abs=1e-15)
    if plates.bar is True:
        top = m.length * m.direction + w[6:9]
        assert np.linalg.norm(top) == pytest.approx(m.length, rel=1e-15)
        assert w[7] == y[prescribed.names.index("top_sideways")]


def test_twist_turns_the_top_plate():
    _, prescribed = lead("twist", EndPlates("clamped"))
    prescribed.parameter = 2.0
    w, _, _ = prescribed.evaluate(np.zeros(prescribed.size))
    np.testing.assert_allclose(w, [0] * 11 + [2.0], rtol=0, atol=1e-15)
    w, _, _ = prescribed.evaluate(np.linspace(0.1, 0.4, prescribed.size))
    assert w[11] == pytest.approx(2.0, abs=1e-15)


@pytest.mark.parametrize("psi", [1e-9, 0.13, -0.26, 1.2])
def test_bend_is_the_formula_of_an_arc(psi):
    """Centres at rho (cos a - cos psi, sin a + sin psi), rho = L/(2 sin psi), a = psi (2 i/N - 1)."""
    m, prescribed = lead("bend", EndPlates("pinned"))
    prescribed.parameter = psi
    w = prescribed.evaluate(np.empty(0))[0].reshape(-1, 6)
    # rings: bottom and top rim, then the seams
    alpha = psi * (2 * np.array([0, 4, 1, 2, 3]) / 4 - 1)
    rho = m.length / (2 * math.sin(psi))
    centres = prescribed.centres - m.centres[0] + w[:, :3]
    scale = m.length * 1e-15 / min(abs(psi), 1)
    np.testing.assert_allclose(centres[:, 0], rho * (np.cos(alpha) - np.cos(psi)), rtol=0, atol=scale)
    np.testing.assert_allclose(centres[:, 1], 0, rtol=0, atol=1e-15)
    np.testing.assert_allclose(centres[:, 2], rho * (np.sin(alpha) + np.sin(psi)), rtol=0, atol=scale)
    np.testing.assert_allclose(centres[1], [0, 0, m.length], rtol=0, atol=1e-15)
    for a, turn in zip(alpha, w[:, 3:], strict=True):
        normal = rotation(turn)[0] @ m.direction
        np.testing.assert_allclose(normal, [-math.sin(a), 0, math.cos(a)], rtol=0, atol=1e-15)


@pytest.mark.parametrize("psi", [0.13, -0.4])
def test_bend_of_a_clamped_stack_is_the_same_but_turned_as_a_whole(psi):
    (m, pinned), (_, clamped) = lead("bend", EndPlates("pinned")), lead("bend", EndPlates("clamped"))
    pinned.parameter = clamped.parameter = psi
    one, two = (g.evaluate(np.empty(0))[0].reshape(-1, 6) for g in (pinned, clamped))
    np.testing.assert_allclose(two[0], 0, rtol=0, atol=1e-15)
    R = rotation(np.array([0, -psi, 0]))[0]
    rest = pinned.centres - m.centres[0]
    np.testing.assert_allclose((rest + one[:, :3]) @ R.T, rest + two[:, :3], rtol=0, atol=1e-14)
    for a, b in zip(one[:, 3:], two[:, 3:], strict=True):
        np.testing.assert_allclose(R @ rotation(a)[0], rotation(b)[0], rtol=0, atol=1e-14)


def test_bar_and_tip_force_balance_the_rest():
    m, prescribed = lead("tip", EndPlates("clamped"))
    prescribed.parameter = 0.5
    w, _, _ = prescribed.evaluate(np.zeros(prescribed.size))
    along = (m.length * m.direction + w[6:9]) / m.length
    # energy's gradient at the top centre: 3 N of the guide along x, 7 N of tension in the bar
    assert prescribed.bar_force(w, 3 * np.array([1.0, 0, 0]) - 7 * along, 0.0) == pytest.approx(7.0)
    _, bent = lead("bend", EndPlates("pinned"))
    assert bent.bar_force(w, np.ones(3), 0.0) is None
    _, elastic = lead("bend", EndPlates("pinned", bar=3e6))
    assert elastic.bar_force(np.zeros(12), np.ones(3), -5.0) == -5.0
