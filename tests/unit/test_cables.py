"""Cords on tagged edges: their energy on a stretched circle, their groups, their errors."""

import math

import numpy as np
import pytest
from states import nodes, unknowns

from lobefem.balloon import Balloon
from lobefem.cables import Cords, Hoops
from lobefem.errors import InputError
from lobefem.films import FixedWrinkles
from lobefem.measures import cord_tensions
from lobefem.surface import lobed_cylinder


def stretched(comm, *cords, factor=1.003, lobes=3, **kw):
    """All nodes moved away from the axis; without plates, so that rims may move too."""
    surface = lobed_cylinder(lobes, (2, 12), comm=comm)
    balloon = Balloon(surface, FixedWrinkles(E=1e-6), cords, **kw)
    q = unknowns(balloon, (factor - 1) * nodes(balloon) * [1, 1, 0])
    balloon.place(q)
    return balloon


PERIMETER = 2 * 12 * 2.0 * math.sin(math.pi / 12)  # of the inscribed polygon, edge radius 2 m


def test_energy_and_tension_of_hoops_on_all_seams(comm):
    balloon = stretched(comm, Hoops(EA=5e6))
    e = (1.003**2 - 1) / 2
    expected = 2 * PERIMETER * 5e6 / 2 * e**2
    assert balloon.strain_energy() == pytest.approx(expected, rel=1e-11)
    # the second Piola force times the stretch
    np.testing.assert_allclose(cord_tensions(balloon), [5e6 * e * 1.003] * 2, rtol=1e-11)


def test_a_cord_on_a_rim_and_one_on_a_single_seam(comm):
    balloon = stretched(comm, Cords(EA=5e6, on=("rim_top",)), Cords(EA=1e6, on=("seam_2",)))
    e = (1.003**2 - 1) / 2
    assert balloon.strain_energy() == pytest.approx(PERIMETER * 6e6 / 2 * e**2, rel=1e-11)
    np.testing.assert_allclose(cord_tensions(balloon), np.array([5e6, 1e6]) * e * 1.003, rtol=1e-11)


def test_built_in_tension_is_the_seams_or_the_one_given(comm):
    for given, expected in ((None, None), (7.0, 7.0)):
        balloon = stretched(comm, Hoops(EA=5e6, tension_per_pressure=given), factor=1.0, prestressed=True)
        balloon.set_loads(0.0, 20.0)
        shape = balloon.surface.shape
        if expected is None:
            expected = shape.R0**2 * math.cos(shape.edge_angle)
        np.testing.assert_allclose(cord_tensions(balloon), [20 * expected] * 2, rtol=1e-13)


def test_one_lobe_has_no_seam_and_needs_no_hoop(comm):
    surface = lobed_cylinder(1, (2, 4), comm=comm)
    assert Hoops().groups(surface) == ()
    assert cord_tensions(Balloon(surface, FixedWrinkles(), [Hoops()])) == ()


def test_groups_are_edges_only_and_each_once(comm):
    surface = lobed_cylinder(3, (2, 4), comm=comm)
    assert Cords(on=("seam_*", "seam_1", "rim_top")).groups(surface) == ("seam_1", "seam_2", "rim_top")
    assert Cords(on=("lobe_*",)).groups(surface) == ()


def test_errors(comm):
    for bad in (0.0, -5.0, math.inf, math.nan):
        with pytest.raises(InputError, match=r"^cord EA = .* must be a positive number of newtons$"):
            Cords(EA=bad)
    surface = lobed_cylinder(2, (2, 4), comm=comm)
    with pytest.raises(
        InputError,
        match=r"^no edge group 'seam_7' on this surface; it has \['seam_1', 'rim_bottom', 'rim_top'\]$",
    ):
        Cords(on=("seam_7",)).groups(surface)
