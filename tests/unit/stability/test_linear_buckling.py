"""`critical_pressure`: its limits, and the plates in the test of stability."""

import pytest

from lobefem.fem.balloon import Balloon
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.model.cables import Hoops
from lobefem.model.end_plates import EndPlates, PlateLoad
from lobefem.model.film import Isotropic
from lobefem.model.fixed_wrinkles import FixedWrinkles
from lobefem.model.gas_pressure import GasPressure
from lobefem.stability.harmonic_buckling import pressure_limit
from lobefem.stability.linear_buckling import critical_pressure


def stack(comm, *parts, film=None, lobes=2, load="closed", divisions=(4, 8)):
    surface = lobed_cylinder(lobes, divisions, comm=comm)
    parts = [GasPressure(load), Hoops(), EndPlates(), *parts]
    return Balloon(surface, film or Isotropic(), parts, prestressed=True)


@pytest.mark.parametrize("film", [Isotropic(), FixedWrinkles(E=2e9, thickness=1e-4)])
def test_the_limit_of_all_pressures_strains_the_equator_by_ten(comm, film):
    """N_phi = p R0/2 there."""
    balloon = stack(comm, film=film)
    limit = pressure_limit(balloon)
    assert limit * balloon.surface.shape.R0 / 2 == pytest.approx(10 * film.Et, rel=1e-12)


def test_a_rigid_bar_that_is_pushed_too_hard_topples_at_any_pressure(comm):
    """The plate's own unknowns are unstable there, not the film's."""
    assert critical_pressure(stack(comm, PlateLoad((0, 0, -1e8)))).pressure == 0.0
    free = critical_pressure(stack(comm), full=True).pressure
    # a pull steadies the bar and changes nothing of the film
    assert critical_pressure(stack(comm, PlateLoad((0, 0, 1e3)))).pressure == pytest.approx(free, rel=1e-6)
