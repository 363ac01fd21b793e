"""What the bar between the plates bears: dead loads, the gas, and the film's built-in pull."""

from dataclasses import replace

import numpy as np
import pytest

from lobefem.equilibrium.displacement_control import distort
from lobefem.equilibrium.distortions import Tip
from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.solver_options import RAMP, NewtonOptions
from lobefem.equilibrium.state import ideal_state
from lobefem.fem.balloon import Balloon
from lobefem.geometry.natural_shape import NaturalShape
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.model.cables import Hoops
from lobefem.model.end_plates import EndPlates, PlateLoad
from lobefem.model.film import Isotropic
from lobefem.model.gas_pressure import GasPressure


def inflated(comm, load, bar, *parts):
    surface = lobed_cylinder(2, (4, 6), comm=comm)
    balloon = Balloon(surface, Isotropic(), [GasPressure(load), Hoops(), EndPlates(bar=bar), *parts])
    return inflate(balloon, 50.0, options=NewtonOptions(rtol=1e-11))


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
            state.restore()
            tops.append(state.balloon.w[8])
        gained = pulled.bar_force - without.bar_force
        assert gained == pytest.approx(EA / pulled.balloon.motion.length * (tops[1] - tops[0]), rel=1e-3)
        assert least * pull < gained < most * pull


def test_a_bar_that_leans_bears_a_dead_load_by_its_slope(comm):
    """Held aside by F along x, the top plate is pulled by P along z: N = P/cos of the bar's lean."""
    shift, pull = 0.3, 30.0
    tips = []
    for parts in ((), (PlateLoad((0, 0, pull)),)):
        start = inflated(comm, "closed", True, *parts)
        tips.append(
            distort(
                start,
                Tip(shift),
                steps=1,
                options=replace(RAMP, rtol=1e-11),
            )
        )
    without, pulled = tips
    length = pulled.state.balloon.motion.length
    cosine = np.sqrt(1 - (shift / length) ** 2)
    assert pulled.state.bar_force - without.state.bar_force == pytest.approx(pull / cosine, rel=1e-4)
    assert pulled.reaction - without.reaction == pytest.approx(pull * shift / length / cosine, rel=1e-4)


@pytest.mark.parametrize("load", ["closed", "film"])
@pytest.mark.parametrize(
    "shape", [None, NaturalShape.between_rims(2.0, 4.19, 0.3)], ids=["isotensoid", "formed"]
)
def test_a_bar_bears_what_the_gas_leaves_of_the_films_built_in_pull(comm, load, shape):
    """Of an isotensoid the gas on a plate balances it; a rigid bar finds the same by the nodes' forces."""
    pressure, forces = 100.0, []
    for bar in (2.15e9, True):
        surface = lobed_cylinder(1, (24, 16), shape=shape, cell="quadrilateral", comm=comm)
        balloon = Balloon(surface, Isotropic(), [GasPressure(load), EndPlates(bar=bar)], prestressed=True)
        forces.append(ideal_state(balloon, pressure).bar_force)
    area = np.linalg.norm(balloon.motion.area_vectors[1])
    excess = surface.shape.axial_excess
    assert (excess == pytest.approx(0.0, abs=1e-9)) is (shape is None)
    expected = -pressure * ((0.0 if load == "closed" else area) + excess)
    assert forces[0] == pytest.approx(expected, rel=1e-9, abs=1e-9 * pressure * area)
    assert forces[1] == pytest.approx(expected, abs=0.08 * pressure * area)  # of this mesh
