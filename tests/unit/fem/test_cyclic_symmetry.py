"""One gore stands for all: its equilibrium is the full model's."""

import math
from dataclasses import replace

import numpy as np
import pytest
from builders import pumpkin

from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.solver_options import NewtonOptions
from lobefem.errors import InputError
from lobefem.fem.balloon import Balloon
from lobefem.fem.cyclic_symmetry import about_axis
from lobefem.model.cables import Tendons
from lobefem.model.dead_weight import DeadWeight
from lobefem.model.end_plates import PlateLoad
from lobefem.model.film import Isotropic
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.orthotropic import OrthotropicTensionField
from lobefem.model.tension_field import TensionField

PLAIN = Isotropic(E=300e6, nu=0.4, thickness=38e-6)
FIELD = TensionField(E=300e6, nu=0.4, thickness=38e-6, slack_stiffness=1e-5)
ORTHOTROPIC = OrthotropicTensionField(
    E1=212.5e6, E2=246.6e6, nu12=0.58, thickness=38e-6, slack_stiffness=1e-5
)
SHORT = Tendons(EA=1e5, foreshortening=0.02)
WEIGHTS = {
    "gas": GasPressure(gradient=2.0, level=0.5),
    "parts": [DeadWeight(film=0.35, cables=0.5), PlateLoad((0.0, 0.0, -8.0))],
}

# mesh, film, what else there is
CASES = {
    "taut quadrilaterals": (8, "quadrilateral", 1, PLAIN, {}),
    "wrinkled quadratic quadrilaterals": (8, "quadrilateral", 2, FIELD, {}),
    "wrinkled triangles": (12, "triangle", 1, FIELD, {"tendons": SHORT}),
    "quadratic triangles, flat gores": (8, "triangle", 2, FIELD, {"flat": True}),
    "flat gores, heavy": (12, "quadrilateral", 1, FIELD, {"flat": True, "tendons": SHORT, **WEIGHTS}),
    "orthotropic": (8, "quadrilateral", 1, ORTHOTROPIC, {"flat": True, **WEIGHTS}),
}


@pytest.mark.parametrize("case", CASES)
def test_one_gore_is_the_whole_balloon(comm, case):
    gores, cell, order, film, given = CASES[case]
    one, whole = (
        pumpkin(
            comm, film, gores=gores, cell=cell, order=order, divisions=(8, 4 // order), full=full, **given
        )
        for full in (False, True)
    )
    gore, full = (inflate(balloon, 100.0, options=NewtonOptions(rtol=1e-11)) for balloon in (one, whole))
    for name in ("volume", "strain_energy", "taut_area", "wrinkled_area", "slack_area"):
        expected = getattr(full, name)
        assert getattr(gore, name) == pytest.approx(expected, rel=1e-9, abs=1e-9 * full.volume), name
    assert len(full.hoop_tension) == gores
    np.testing.assert_allclose(full.hoop_tension, gore.hoop_tension[0], rtol=1e-9)
    assert one.reference_volume * gores == pytest.approx(whole.reference_volume, rel=1e-12)
    assert one.reference_area * gores == pytest.approx(whole.reference_area, rel=1e-12)
    if film is FIELD and given.get("flat"):
        assert full.wrinkled_area > 0.1 * whole.reference_area
    if film is PLAIN:
        assert gore.max_displacement == pytest.approx(full.max_displacement, rel=1e-8)


@pytest.mark.parametrize("order", [1, 2])
def test_the_far_cut_does_what_the_near_one_does(order):
    balloon = pumpkin(gores=8, order=order, divisions=(8, 4), flat=True, tendons=SHORT)
    state = inflate(balloon, 100.0)
    balloon.set_unknowns(state.vector())
    turn = about_axis(np.array([0.0, 0.0, 1.0]), 2 * math.pi / 8)
    u = balloon.u.x.array.reshape(-1, 3)
    near, far = (balloon.edge_nodes(name) for name in ("tendon_1", "tendon_2"))
    near, far = (some[np.argsort(balloon.X[some, 2])] for some in (near, far))
    np.testing.assert_allclose(balloon.X[far], balloon.X[near] @ turn.T, atol=1e-12)
    np.testing.assert_allclose(u[far], u[near] @ turn.T, atol=1e-12)
    assert np.abs(u[near]).max() > 1e-3
    assert np.abs(u[near, 1]).max() < 1e-8  # a tendon stays in its plane


def test_a_gore_of_another_count_is_refused():
    balloon = pumpkin(gores=8)
    surface = replace(balloon.surface, copies=9, cyclic_order=9)
    with pytest.raises(InputError, match="one of 9 equal sectors, and no edge of it is another one rotated"):
        Balloon(surface, PLAIN, balloon.components)


def test_rotation_about_an_axis():
    axis = np.array([2.0, -1.0, 2.0]) / 3
    turn = about_axis(axis, 0.7)
    np.testing.assert_allclose(turn @ axis, axis)
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-15)
    assert np.trace(turn) == pytest.approx(1 + 2 * math.cos(0.7))
    across = np.cross(axis, [1.0, 0, 0])
    assert axis @ np.cross(across, turn @ across) > 0
