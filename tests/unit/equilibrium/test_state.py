"""A state's loads and unknowns, put back into its balloon."""

import numpy as np
import pytest

from lobefem.equilibrium.displacement_control import distort
from lobefem.equilibrium.distortions import Tip
from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.state import Equilibrium, State
from lobefem.fem.balloon import Balloon
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.io.checkpoints import load_state, save_state
from lobefem.model.cables import Hoops
from lobefem.model.end_plates import EndPlates
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.tension_field import TensionField


@pytest.fixture
def tipped(comm):
    """An equilibrium under a prescribed motion, and the free one."""
    parts = [GasPressure("closed"), Hoops(EA=1e6), EndPlates("clamped")]
    balloon = Balloon(lobed_cylinder(2, (4, 8), comm=comm), TensionField(slack_stiffness=1e-3), parts)
    rest = inflate(balloon, 50.0)
    return distort(rest, Tip(0.05), steps=1).state, rest


def test_a_state_is_what_an_equilibrium_has_without_its_measurements(tipped):
    for measured in tipped:
        state = State(
            measured.balloon, measured.pressure, 0.0, measured.unknowns, parameter=measured.parameter
        )
        assert isinstance(measured, Equilibrium)
        assert isinstance(measured, State)
        np.testing.assert_array_equal(state.displacement, measured.displacement)
        with pytest.raises(ValueError, match="read-only"):
            state.displacement[:] = 0.0


def test_a_state_is_restored_with_its_loads_and_parameter(tipped):
    for measured, other in (tipped, tipped[::-1]):
        balloon = measured.balloon
        state = State(balloon, 40.0, 3.0, measured.unknowns, parameter=measured.parameter)
        other.restore()
        if balloon.prescribed is not None:
            balloon.prescribed.parameter = 0.0
        q = state.restore()
        assert (float(balloon.pressure.value), float(balloon.prestress.value)) == (40.0, 3.0)
        np.testing.assert_array_equal(q.array_r, measured.unknowns)
        np.testing.assert_array_equal(balloon.u.x.array.reshape(-1, 3), measured.displacement)


def test_to_look_at_a_displacement_moves_nothing(tipped):
    moved, _ = tipped
    moved.restore()
    before = moved.balloon.u.x.array.copy()
    state = State(moved.balloon, 50.0, 0.0, moved.unknowns, parameter=0.0)
    assert state.displacement.shape == moved.displacement.shape
    np.testing.assert_array_equal(moved.balloon.u.x.array, before)
    assert moved.balloon.prescribed.parameter == moved.parameter == pytest.approx(0.05)


def test_a_state_read_back_is_restored_like_any_other(tipped, shared_path):
    moved, rest = tipped
    for name, measured in (("rest", rest), ("moved", moved)):
        measured.restore()
        save_state(shared_path / f"{name}.npz", measured)
        kept = load_state(shared_path / f"{name}.npz", measured.balloon)
        assert isinstance(kept, State)
        measured.balloon.set_loads(1.0)
        kept.restore()
        assert float(measured.balloon.pressure.value) == 50.0
        np.testing.assert_allclose(kept.displacement, measured.displacement, rtol=0, atol=1e-15)
        np.testing.assert_allclose(
            measured.balloon.u.x.array.reshape(-1, 3), measured.displacement, rtol=0, atol=1e-15
        )
