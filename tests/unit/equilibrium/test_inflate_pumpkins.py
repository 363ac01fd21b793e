"""`inflate` on one gore: it finds the state from the drawn shape without help."""

import math

import numpy as np
import pytest
from builders import pumpkin
from hypothesis import given, settings
from hypothesis import strategies as st

from lobefem.equilibrium.firmer_slack import firmer
from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.pumpkin_measures import measure
from lobefem.errors import InputError
from lobefem.geometry.gore import ConstantRadius, FlatLobe
from lobefem.geometry.pumpkin_curve import PumpkinCurve
from lobefem.geometry.station_table import StationTable
from lobefem.model.cables import Tendons
from lobefem.model.dead_weight import DeadWeight
from lobefem.model.film import Isotropic
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.tension_field import TensionField

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


def heavy(gores, R0, **given):
    """Film of 38 um whose gas lifts 1.8 times its weight and that of the tendons."""
    film = 920 * 9.81 * 38e-6
    weight = 1.5 * film * math.pi**2 * R0**2
    gas = GasPressure(gradient=1.8 * weight / (2.7458 * R0**3))
    parts = [DeadWeight(film=film, cables=0.4 * math.pi * film * R0 / gores)]
    tendons = Tendons(EA=65e3 * R0**2 / gores, foreshortening=given.pop("foreshortening", 0.0))
    film = TensionField(E=300e6, nu=0.4, thickness=38e-6, slack_stiffness=1e-5)
    return pumpkin(
        film=film, gas=gas, gores=gores, R0=R0, fitting=0.03 * R0, tendons=tendons, parts=parts, **given
    )


@pytest.mark.slow
@settings(max_examples=12, derandomize=True, deadline=None, database=None)
@given(
    flat=st.booleans(),
    gores=st.integers(8, 300),
    angle=st.floats(15, 90),
    foreshortening=st.floats(-0.01, 0.04),
    pressure=st.floats(0, math.log10(2000)).map(lambda power: 10**power),
    R0=st.sampled_from([2.0, 5.0, 57.0]),
)
def test_film_with_weight_is_inflated_whatever_the_design(flat, gores, angle, foreshortening, pressure, R0):
    balloon = heavy(gores, R0, angle=angle, flat=flat, foreshortening=foreshortening, divisions=(16, 4))
    state = inflate(balloon, pressure)
    assert state.converged
    assert state.relative_residual < 1e-7
    assert 0.8 < state.volume / (gores * balloon.reference_volume) < 2


@pytest.mark.slow
@pytest.mark.parametrize(
    ("gores", "angle", "radius", "pressure", "order"), [(160, 60, 5.0, 3.3, 2), (8, 20, 2.0, 1.0, 1)]
)
def test_slack_film_with_weight_under_little_pressure(gores, angle, radius, pressure, order):
    """On fine meshes the drawn shape, lower pressures and balloons without weight lead nowhere."""
    lobes = ConstantRadius(math.radians(angle))
    balloon = heavy(gores, radius, lobes=lobes, divisions=(48, 8), order=order)
    state = inflate(balloon, pressure, nested=True)
    assert state.converged
    assert state.steps[-1] == pressure


def test_slack_film_is_made_firmer_in_three_steps():
    shares = [one.film.slack_stiffness for one in firmer(pumpkin())]
    assert shares == [1e-2, 1e-3, 1e-4]
    own = TensionField(slack_stiffness=1e-3)
    assert [one.film.slack_stiffness for one in firmer(pumpkin(film=own))] == [1e-2]
    assert firmer(pumpkin(film=Isotropic())) == []


@pytest.mark.serial
def test_the_bulge_of_gores_that_are_drawn_flat_has_a_radius():
    """Half of the circle's curvature beside a fitting, where the film is flat: never not a number."""
    balloon = pumpkin(lobes=FlatLobe(), divisions=(8, 4))
    state = inflate(balloon, 100.0)
    grid = balloon.surface.recipe.grid
    drawn = balloon.surface.recipe.gore.position(grid.s, grid.xi)
    node = np.argmin(np.linalg.norm(drawn[:, None] - balloon.X[None], axis=2), axis=1)
    x = (balloon.X + state.displacement)[node].reshape(grid.rows, grid.columns, 3)
    a, b, c = x[:, 0], x[:, grid.columns // 2], x[:, -1]
    sides = np.linalg.norm([b - a, c - b, c - a], axis=2).prod(axis=0)
    circle = 2 * np.linalg.norm(np.cross(b - a, c - a), axis=1) / sides  # its curvature
    assert circle[0] < 1e-6 * circle[1]
    assert measure(state).bulge_radius == pytest.approx(2 / (circle[1:] + circle[:-1]), rel=1e-6)


@pytest.mark.slow
def test_a_table_of_one_share_is_that_share():
    states = []
    for share in (0.01, lambda x: np.full(len(x), 0.01)):
        tendons = Tendons(EA=1e5, foreshortening=share)
        balloon = pumpkin(gores=16, angle=45, tendons=tendons, divisions=(12, 4))
        states.append(inflate(balloon, 100.0))
    assert states[0].volume == pytest.approx(states[1].volume, rel=1e-10)
    assert measure(states[0]).tendon_tension == pytest.approx(measure(states[1]).tendon_tension, rel=1e-8)


@pytest.mark.slow
def test_the_length_that_is_taken_counts_not_where_it_is_taken():
    """Film of next to no stiffness along the gore leaves stiff tendons free to be as long as they are."""
    states = []
    for table in ((0.01, 0.01, 0.01), (0.0, 0.02, 0.0)):  # both 1 % shorter in all
        curve = PumpkinCurve(5.0, 0.25)
        tendons = Tendons(EA=1e6, foreshortening=StationTable(curve, (0.0, 0.5, 1.0), table))
        states.append(inflate(pumpkin(gores=16, angle=60, tendons=tendons, divisions=(24, 4)), 100.0))
    even, amid = states
    assert even.volume == pytest.approx(amid.volume, rel=5e-3)
    # nothing else than the tendons' total length is alike: the mean tension is that of the balloon's size
    assert even.hoop_tension[0] == pytest.approx(amid.hoop_tension[0], rel=0.02)


def test_a_function_that_gives_no_shares_is_refused():
    with pytest.raises(InputError, match="values are not all between"):
        pumpkin(tendons=Tendons(foreshortening=lambda x: x[:, 2]))
