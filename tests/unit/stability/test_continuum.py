"""Critical pressures without a mesh: against finite elements, and against another code."""

import math

import numpy as np
import pytest

from lobefem import (
    Balloon,
    EndPlates,
    FixedWrinkles,
    GasPressure,
    Isotensoid,
    Isotropic,
    TensionField,
    harmonic_pressures,
    lobed_cylinder,
)
from lobefem.errors import InputError
from lobefem.geometry.flat_cylinder import Cylinder
from lobefem.geometry.natural_shape import NaturalShape
from lobefem.stability.continuum import continuum_pressure, unstable_from

pytestmark = pytest.mark.serial

WRINKLED = FixedWrinkles()
KINK = TensionField(slack_stiffness=0.0)


def test_fixed_wrinkles_of_the_papers_lobe():
    # a code of Fourier series and Legendre polynomials that shares no line with this one gave these
    others = {2: 33817.34, 3: 12934.60, 4: 6818.19, 5: 4156.16, 6: 2746.36}
    for n, pressure in others.items():
        assert continuum_pressure(n, WRINKLED) == pytest.approx(pressure, abs=0.006)
    assert [continuum_pressure(n, WRINKLED) for n in (7, 8, 20, 40)] == [0, 0, 0, 0]
    assert unstable_from(WRINKLED) == 7


def test_wrinkles_that_may_turn_resist_shear_but_not_every_harmonic():
    pressures = [continuum_pressure(n, KINK) for n in range(2, 15)]
    assert (np.diff(pressures[:11]) < 0).all()
    assert pressures[10] > 0 == pressures[11]
    assert unstable_from(KINK) == 13
    # softer than taut film, stiffer than wrinkles that keep their direction
    for n in (2, 4, 6):
        bounds = continuum_pressure(n, WRINKLED), continuum_pressure(n, Isotropic())
        assert bounds[0] < continuum_pressure(n, KINK) < bounds[1]


@pytest.mark.parametrize(("film", "n"), [(WRINKLED, 2), (WRINKLED, 3), (Isotropic(), 2), (Isotropic(), 3)])
def test_finite_elements_converge_to_it(film, n):
    """From above, with the order 2 of linear cells."""
    exact = continuum_pressure(n, film)
    errors = []
    for divisions in ((24, 32), (48, 64)):
        surface = lobed_cylinder(1, divisions, sector=True)
        balloon = Balloon(surface, film, [GasPressure("film"), EndPlates("fixed")], prestressed=True)
        errors.append(harmonic_pressures(balloon, [n])[n] / exact - 1)
    assert 0 < errors[1] < errors[0] < 0.35
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2, abs=0.2)


def test_formed_lobes_too():
    """Their meridians carry another tension than an isotensoid's."""
    shape = NaturalShape.inflated(2.0, 4.19, 187.5, 10.0)
    surface = lobed_cylinder(1, (36, 48), shape=shape, sector=True)
    balloon = Balloon(surface, WRINKLED, [GasPressure("film"), EndPlates("fixed")], prestressed=True)
    exact = continuum_pressure(2, WRINKLED, shape)
    assert exact > 1.5 * continuum_pressure(2, WRINKLED)
    assert harmonic_pressures(balloon, [2])[2] == pytest.approx(exact, rel=0.12)


def test_a_few_polynomials_give_all_digits():
    for film in (WRINKLED, Isotropic(), KINK):
        few, many = (continuum_pressure(4, film, degree=degree) for degree in (12, 32))
        assert few == pytest.approx(many, rel=1e-8)


def test_pressures_scale_with_stiffness_over_size():
    """p = c E t/R0, c a number of shape and harmonic."""
    film = FixedWrinkles(E=7e9, thickness=2e-5)
    scaled = continuum_pressure(3, film, Isotensoid(10.0))
    ratio = film.Et / WRINKLED.Et * Isotensoid.from_edge_radius().R0 / 10.0
    assert scaled == pytest.approx(ratio * continuum_pressure(3, WRINKLED), rel=1e-9)


def test_flatter_lobes_bear_more_harmonics():
    assert unstable_from(WRINKLED, Isotensoid(3.8, 0.3)) > 7


def test_isotropic_film_has_a_lowest_pressure_and_none_in_shallow_harmonics():
    pressures = [continuum_pressure(n, Isotropic()) for n in range(1, 12)]
    assert pressures[0] == math.inf
    assert int(np.argmin(pressures)) + 1 == 7
    assert unstable_from(Isotropic(), highest=12) is None


def test_what_cannot_be_computed_is_refused():
    with pytest.raises(InputError, match="harmonic"):
        continuum_pressure(0, WRINKLED)
    with pytest.raises(InputError, match="film is 'mylar', which is no film law"):
        continuum_pressure(2, "mylar")
    with pytest.raises(InputError, match=r"^shape is Cylinder\(.*; give an Isotensoid, a NaturalShape"):
        continuum_pressure(2, WRINKLED, Cylinder())
