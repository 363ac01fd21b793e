"""Film cut flat, with weight, found by way of balloons without."""

import math

import pytest

from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.simpler_balloons import simpler, stretched
from lobefem.fem.balloon import Balloon
from lobefem.geometry.gore import ConstantAngle, Gore
from lobefem.geometry.pumpkin import PumpkinRecipe
from lobefem.geometry.pumpkin_curve import PumpkinCurve
from lobefem.model.cables import Tendons
from lobefem.model.dead_weight import DeadWeight
from lobefem.model.end_plates import EndPlates, PlateLoad
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.tension_field import TensionField


def balloon(gores, angle, *, flat=True, weight=0.3, shortening=0.0):
    gore = Gore(PumpkinCurve(5.0, (0.25, 0.25)), gores, ConstantAngle(math.radians(angle)))
    recipe = PumpkinRecipe(gore, (16, 6))
    surface = recipe.surface()
    film = TensionField(E=3e8, nu=0.4, thickness=38e-6, slack_stiffness=1e-5)
    parts = [
        GasPressure(gradient=0.1 if weight else 0.0),
        Tendons(foreshortening=shortening),
        EndPlates(bar=False),
    ]
    if weight:
        parts += [DeadWeight(film=weight, cables=0.1), PlateLoad(force=(0.0, 0.0, -1.0))]
    return Balloon(surface, film, parts, pattern=recipe.pattern(surface) if flat else None)


def test_what_is_simpler():
    drawn, cut = simpler(balloon(8, 30))
    assert drawn.pattern is None
    assert cut.pattern is not None
    for one in (drawn, cut):
        assert not any(isinstance(part, DeadWeight | PlateLoad) for part in one.components)
        assert one.load.gradient == 0
    plain = balloon(8, 30, flat=False, weight=0.0)
    assert simpler(plain) == [plain]  # for its tendons: it starts stretched


def test_the_stretched_shape():
    one = balloon(8, 30, flat=False, weight=0.0)
    state = stretched(one)
    assert not state.converged
    # stretched by a thousandth; the rims of 25 cm keep their radius
    assert state.volume == pytest.approx(8 * one.reference_volume * 1.001**3, rel=1e-5)


def test_many_deep_gores_start_from_the_stretched_shape():
    """From the drawn shape itself Newton's method leads nowhere in the first step, nor in those of 1/4."""
    one = balloon(300, 15, weight=0.0, flat=False)
    state = inflate(one, 1.0)
    assert state.converged
    assert state.steps == (1.0,)
    assert state.volume == pytest.approx(344.11, rel=1e-4)


@pytest.mark.parametrize(
    ("gores", "angle", "pressure", "shortening"),
    [(8, 15, 100.0, 0.0), (16, 60, 2000.0, 0.04), (128, 45, 2000.0, -0.01), (300, 90, 2000.0, 0.0)],
)
def test_flat_gores_with_weight(gores, angle, pressure, shortening):
    state = inflate(balloon(gores, angle, shortening=shortening), pressure)
    assert state.converged
    assert state.relative_residual < 1e-7
    assert state.volume > 300
