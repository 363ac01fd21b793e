"""`inflate` on one gore: it finds the state from the drawn shape without help."""

import pytest
from builders import pumpkin

from lobefem.equilibrium.inflation import inflate
from lobefem.model.cables import Tendons

# cut flat or as drawn, gores, half angle [degrees], foreshortening, pressure [Pa]
HARD = [
    (False, 64, 15, 0.04, 1.0),
    (False, 300, 15, 0.04, 1.0),
    (False, 8, 90, 0.04, 2000.0),
    (True, 8, 15, -0.01, 1.0),
    (True, 8, 90, 0.04, 2000.0),
    (True, 64, 15, 0.04, 1.0),
    (True, 64, 60, -0.01, 1.0),
    (True, 64, 90, 0.04, 1.0),
    (True, 64, 90, 0.0, 2000.0),
    (True, 300, 15, 0.04, 1.0),
    (True, 300, 60, 0.0, 1.0),
    (True, 300, 90, -0.01, 1.0),
    (True, 300, 90, 0.0, 2000.0),
]


@pytest.mark.slow
@pytest.mark.parametrize(("flat", "gores", "angle", "foreshortening", "pressure"), HARD)
def test_one_gore_is_inflated_from_its_drawn_shape(flat, gores, angle, foreshortening, pressure):
    tendons = Tendons(EA=1e5, foreshortening=foreshortening)
    balloon = pumpkin(gores=gores, angle=angle, flat=flat, tendons=tendons, divisions=(16, 4))
    steps = []
    state = inflate(balloon, pressure, on_step=steps.append)
    assert state.converged
    assert state.pressure == steps[-1].pressure == pressure
    assert state.relative_residual < 1e-7
    # the gas has done work on the drawn balloon or the tendons have pulled it in
    volume = gores * balloon.reference_volume
    assert (0.98 - 4 * max(foreshortening, 0.0)) * volume < state.volume < 1.6 * volume
    assert state.hoop_tension[0] > 0
