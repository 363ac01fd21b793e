"""Tendons: tension only, their length at rest, which of a gore's two counts."""

import numpy as np
import pytest
from builders import pumpkin
from states import nodes, unknowns

from lobefem.equilibrium.inflation import inflate
from lobefem.fem.functionals import cable_tensions
from lobefem.model.cables import Cables, Tendons
from lobefem.model.film import Isotropic

SOFT = Isotropic(E=1e-3, nu=0.4, thickness=38e-6)


@pytest.mark.parametrize("full", [False, True])
@pytest.mark.parametrize("f", [-0.01, 0.0, 0.04])
def test_energy_and_tension_of_tendons_at_the_drawn_shape(comm, full, f):
    balloon = pumpkin(comm, SOFT, full=full, order=2, tendons=Tendons(EA=1e5, foreshortening=f))
    balloon.set_unknowns(balloon.map.create_vector())
    length = balloon.surface.recipe.gore.curve.arc_length * (8 if full else 1)
    stretch = 1 / (1 - f)
    e = (stretch**2 - 1) / 2 if f > 0 else 0.0
    rest = length * (1 - f)
    assert balloon.strain_energy() == pytest.approx(1e5 / 2 * e**2 * rest, rel=1e-3, abs=1e-9)
    tensions = cable_tensions(balloon)
    assert len(tensions) == (8 if full else 1)
    np.testing.assert_allclose(tensions, 1e5 * e * stretch, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("order", [1, 2])
def test_a_slack_tendon_is_no_tendon(comm, order):
    """Inside its drawn place it has neither energy nor force nor stiffness; outside it pulls."""
    film = Isotropic(300e6, 0.4, 38e-6)
    for factor in (-0.01, 0.01):
        found = []
        for EA in (1e-9, 1e5):
            balloon = pumpkin(comm, film, order=order, tendons=Tendons(EA=EA))
            x = nodes(balloon)
            # towards the middle of the axis, with the top fitting
            q = unknowns(balloon, factor * x, factor * x[:, 2].max() * np.array([1.0, 0.0]))
            r = q.duplicate()
            balloon.residual(q, r)
            found.append((balloon.energy(q)[0], r.norm(), balloon.tangent(q).norm()))
        none, tendon = np.array(found)
        if factor < 0:
            np.testing.assert_allclose(tendon, none, rtol=1e-9)
        else:
            assert tendon[0] > 1.1 * none[0]


def test_tendons_too_long_bear_nothing_and_do_not_disturb():
    film = Isotropic(E=300e6, nu=0.4, thickness=38e-6)
    long = Tendons(EA=1e5, foreshortening=-0.3)
    states = [inflate(pumpkin(film=film, tendons=tendons), 200.0) for tendons in (long, Tendons(EA=1e-6))]
    assert states[0].hoop_tension == (0.0,)
    assert states[0].volume == pytest.approx(states[1].volume, rel=1e-9)
    assert states[0].strain_energy == pytest.approx(states[1].strain_energy, rel=1e-6)


def test_tendons_that_tighten_as_the_film_stretches():
    """Slack at a small pressure, taut at a large one, through zero tension on the way."""
    balloon = pumpkin(tendons=Tendons(EA=1e5, foreshortening=-0.01), film=Isotropic(300e6, 0.4, 38e-6))
    tension, state = [], None
    for pressure in (5.0, 50.0, 200.0, 1000.0):
        state = inflate(balloon, pressure, start=state)
        tension.append(state.hoop_tension[0])
    assert tension[0] == 0.0
    assert 0 < tension[-2] < tension[-1]


def test_a_gore_counts_its_first_tendon():
    one, whole = (pumpkin(full=full).surface for full in (False, True))
    assert Tendons().groups(one) == ("tendon_1",)
    assert Tendons().groups(whole) == tuple(f"tendon_{k}" for k in range(1, 9))
    assert Cables(on=("tendon_*",)).groups(one) == ("tendon_1", "tendon_2")


def test_foreshortening_is_a_number_or_a_function_of_points():
    points = np.array([[1.0, 0.0, 0.2], [2.0, 0.0, 0.4]])
    assert Tendons(foreshortening=0.02).shares(points).tolist() == [0.02, 0.02]
    rising = Tendons(foreshortening=lambda x: x[:, 2] / 10)
    assert rising.shares(points) == pytest.approx([0.02, 0.04])
    assert rising.shortened
    assert not Tendons().shortened
