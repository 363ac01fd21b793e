"""Gores: the half-widths of a table beside the arcs that are drawn."""

import math

import numpy as np
import pytest

from lobefem.errors import InputError
from lobefem.geometry.gore import Gore, TabulatedWidth
from lobefem.geometry.pumpkin_curve import PumpkinCurve

GORES = 16


def gore(extra):
    """A gore as wide as half a circle of its chord at the equator; at the fittings `extra` more [m]."""
    curve = PumpkinCurve(5.0, (0.25, 0.25))
    share = np.linspace(0.0, 1.0, 41)
    chord = curve.radius(curve.arc_length * share) * math.sin(math.pi / GORES)
    widths = 1.2 * chord + extra * np.cos(math.pi * share) ** 2
    return Gore(curve, GORES, TabulatedWidth(tuple(share), tuple(widths))), widths


def test_a_table_wider_than_half_a_circle_is_drawn_as_one_and_keeps_its_width():
    wide, widths = gore(0.5)
    s = wide.curve.arc_length * np.linspace(0.0, 1.0, 41)
    np.testing.assert_allclose(wide.half_width(s), widths, rtol=1e-12)
    assert wide.half_angle(s)[0] == pytest.approx(math.pi / 2, rel=1e-12)
    # the pattern has the table's width, the drawn arc that of half a circle at the most
    assert wide.pattern(s, np.ones(41))[0, 1] == pytest.approx(widths[0], rel=1e-12)
    crown = wide.position(s[:1], np.zeros(1))[0]
    ends = wide.position(np.repeat(s[0], 2), np.array([-1.0, 1.0]))
    rise = np.linalg.norm(crown - ends.mean(axis=0))
    assert rise == pytest.approx(wide.half_chord(s[:1])[0], rel=1e-12)
    assert wide.half_angle(s).max() <= math.pi / 2


def test_a_table_within_half_a_circle_is_drawn_as_wide_as_it_is_cut():
    fitting, widths = gore(0.0)
    s = fitting.curve.arc_length * np.linspace(0.0, 1.0, 41)
    alpha = fitting.half_angle(s)
    np.testing.assert_allclose(fitting.bulge_radius(s) * alpha, widths, rtol=1e-12)


def test_a_table_narrower_than_the_chord_is_refused():
    with pytest.raises(InputError, match=r"less than the half chord .* wider gores"):
        gore(-0.03)
