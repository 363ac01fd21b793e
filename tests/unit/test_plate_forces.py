"""Dead loads on plates: what the bar feels of them."""

import numpy as np
import pytest

from lobefem.balloon import Balloon
from lobefem.cables import Hoops
from lobefem.equilibrium import inflate
from lobefem.films import Isotropic
from lobefem.loads import GasPressure
from lobefem.plates import EndPlates, PlateLoad
from lobefem.surface import lobed_cylinder


def inflated(comm, load, bar, *parts):
    surface = lobed_cylinder(2, (4, 6), comm=comm)
    balloon = Balloon(surface, Isotropic(), [GasPressure(load), Hoops(), EndPlates(bar=bar), *parts])
    return inflate(balloon, 50.0, rtol=1e-11)


@pytest.mark.parametrize("load", ["closed", "film"])
@pytest.mark.parametrize("pull", [30.0, -200.0])
def test_a_rigid_bar_bears_a_dead_load_along_it(comm, load, pull):
    without, pulled = inflated(comm, load, True), inflated(comm, load, True, PlateLoad((0, 0, pull)))
    assert pulled.bar_force - without.bar_force == pytest.approx(pull, rel=1e-6)
    np.testing.assert_allclose(pulled.displacement, without.displacement, atol=1e-9)


def test_an_elastic_bar_and_the_film_share_a_dead_load(comm):
    """The bar's part is its stiffness times the plate's way; a stiff bar bears nearly all."""
    pull = 30.0
    for EA, least, most in ((1e4, 0.01, 0.95), (1e8, 0.99, 1.0)):
        without, pulled = inflated(comm, "closed", EA), inflated(comm, "closed", EA, PlateLoad((0, 0, pull)))
        tops = []
        for state in (without, pulled):
            state.activate()
            tops.append(state.balloon._w[8])
        gained = pulled.bar_force - without.bar_force
        assert gained == pytest.approx(EA / pulled.balloon.motion.length * (tops[1] - tops[0]), rel=1e-3)
        assert least * pull < gained < most * pull
