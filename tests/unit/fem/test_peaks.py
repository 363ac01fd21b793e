"""The film's largest stress and strain, and where they are."""

import builders
import numpy as np
import pytest

from lobefem import Balloon, EndPlates, FixedWrinkles, GasPressure, cylinder, ideal_state, inflate
from lobefem.fem.peaks import largest_stress


def test_the_ideal_lobe_bears_most_at_its_rims():
    """N_m = p R0^2/(2 R) is largest where R is smallest; the strain is that over E t, nothing in hoops."""
    balloon = builders.stack(lobes=1, divisions=(24, 12), film=FixedWrinkles(), prestressed=True)
    state = ideal_state(balloon, 1000.0)
    shape, film = balloon.surface.shape, balloon.film
    stress, strain = state.max_stress(), state.max_strain()
    R = np.hypot(*stress.place[:2])
    # the mean over a cell of flat facets, whose middle is within the circle through its nodes
    assert shape.edge_radius * 0.95 < R < shape.edge_radius * 1.1
    assert stress.value == pytest.approx(1000.0 * shape.R0**2 / (2 * R) / film.thickness, rel=0.03)
    assert strain.value == pytest.approx(stress.value / film.E, rel=1e-3)
    rows = shape.height / 24
    assert stress.place[2] < rows  # of the two rims, the lower
    assert strain.place == stress.place


def test_peaks_are_those_of_the_fields(comm):
    state = inflate(builders.stack(), 100.0)
    resultants = state.true_resultants().x.array.reshape(-1, 3)
    major = [np.linalg.eigvalsh([[xx, xy], [xy, yy]]).max() for xx, yy, xy in resultants]
    largest = max(comm.allgather(max(major))) / state.balloon.film.thickness
    assert state.max_stress().value == pytest.approx(largest, rel=1e-12)
    # plane stress: a strain is no more than the stress over E, and no less than that of equal stresses
    film = state.balloon.film
    assert (1 - film.nu) * largest / film.E < state.max_strain().value < 1.001 * largest / film.E


def test_the_stress_of_a_stretched_tube_is_the_true_one(comm):
    """A tube drawn out by a: E (a^2 - 1)/2 along it, pushed forward by a over the hoop's own stretch b."""
    surface = cylinder(2.0, 4.0, (2, 9), cell="quadrilateral", comm=comm)
    film = FixedWrinkles(E=1e6, thickness=1e-4)
    balloon = Balloon(surface, film, [GasPressure("film"), EndPlates(support="fixed", lift=1.0)])
    a, b = 1.25, 1.5
    balloon.u.x.array[:] = (balloon.X * [b - 1, b - 1, a - 1]).ravel()
    assert largest_stress(balloon).value == pytest.approx(1e6 * a * (a**2 - 1) / 2 / b, rel=1e-12)
