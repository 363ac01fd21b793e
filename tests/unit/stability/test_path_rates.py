"""What is asked of single states of a path: how the load grows, and how stiff a mode is."""

import numpy as np
import pytest

from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.state import ideal_state
from lobefem.fem.balloon import Balloon
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.model.cables import Hoops
from lobefem.model.end_plates import EndPlates
from lobefem.model.film import Isotropic
from lobefem.model.fixed_wrinkles import FixedWrinkles
from lobefem.model.gas_pressure import GasPressure
from lobefem.stability import path_rates
from lobefem.stability.modes import find_modes


def stack(comm, film, load="closed", prestressed=True, support="clamped"):
    surface = lobed_cylinder(1, (4, 8), comm=comm)
    parts = [GasPressure(load), Hoops(), EndPlates(support)]
    return Balloon(surface, film, parts, prestressed=prestressed)


def residual(balloon, q, pressure, prestress):
    r = q.duplicate()
    balloon.set_loads(pressure, prestress)
    balloon.residual(q, r)
    return r


@pytest.mark.parametrize("load", ["closed", "film"])
@pytest.mark.parametrize("prestressed", [True, False])
def test_the_load_grows_by_pressure_and_built_in_stress_together(comm, load, prestressed):
    """dr/dp is the residual's difference, which is linear in both."""
    balloon = stack(comm, FixedWrinkles() if prestressed else Isotropic(), load, prestressed)
    state = ideal_state(balloon, 1000.0) if prestressed else inflate(balloon, 1000.0)
    q = state.restore()
    rate = path_rates.load_rate(state, q)
    assert (balloon.pressure.value, balloon.prestress.value) == (state.pressure, state.prestress)
    expected = residual(balloon, q, 1100.0, 1100.0 if prestressed else 0.0)
    expected.axpy(-1.0, residual(balloon, q, 900.0, 900.0 if prestressed else 0.0))
    expected.scale(1 / 200)
    expected.axpy(-1.0, rate)
    assert expected.norm() < 1e-6 * rate.norm()
    gas = residual(balloon, q, 1100.0, state.prestress)
    gas.axpy(-1.0, residual(balloon, q, 900.0, state.prestress))
    gas.scale(1 / 200)
    gas.axpy(-1.0, rate)
    assert (gas.norm() > 1e-2 * rate.norm()) is prestressed


@pytest.mark.parametrize("mass", ["unit", "nodal"])
def test_the_growth_along_a_mode_is_its_eigenvalue(comm, mass):
    """Rayleigh's quotient, with the mass by area whatever the modes' own is."""
    balloon = stack(comm, Isotropic())
    state = inflate(balloon, 1000.0)
    modes = find_modes(state, 4, mass=mass)
    for mode in modes.modes:
        found = path_rates.rayleigh(state, mode.displacement)
        if mass == "unit":
            assert found == pytest.approx(mode.value.real, rel=1e-6)
        else:
            assert found > 0
        assert path_rates.rayleigh(state, -3.0 * mode.displacement) == pytest.approx(found, rel=1e-9)


def test_a_motion_of_all_nodes_has_its_length_by_area(comm):
    balloon = stack(comm, Isotropic())
    shift = np.broadcast_to([0.0, 3.0, 4.0], (len(balloon.X), 3)).copy()
    assert path_rates.length(balloon, shift) == pytest.approx(5 * np.sqrt(balloon.reference_area), rel=1e-12)
