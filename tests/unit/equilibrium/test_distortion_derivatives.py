"""Derivatives of energy, residual and map under each distortion; its force as the energy's rate."""

from functools import partial

import builders
import numpy as np
import pytest
from states import nodes, taylor_rates, unknowns, wavy
from taylor import STEPS, gradient_and_curvature, moved, state_and_direction

from lobefem.equilibrium.displacement_control import constrain
from lobefem.equilibrium.distortions import Bend, Tip, Twist, Wave
from lobefem.fem.functionals import displacement_of

KINDS = [Tip(0.3), Bend(8.0), Twist(15.0), Wave(2, 0.1)]
NAMES = ["tip", "bend", "twist", "wave"]

stack = partial(builders.stack, lobes=3, divisions=(2, 5), EA=2e5)


def under(balloon, distortion, share=1.0):
    led = constrain(balloon, distortion)
    led.prescribed.parameter = share * distortion.parameter
    return led


@pytest.mark.parametrize("support", ["clamped", "pinned"])
@pytest.mark.parametrize("distortion", KINDS, ids=NAMES)
def test_taylor_of_the_potential(comm, distortion, support):
    balloon = under(stack(comm, support=support), distortion)
    q, d = state_and_direction(balloon)
    r, Kd = gradient_and_curvature(balloon, q, d)
    energy, slope, curvature = balloon.energy(q)[0], r.dot(d), Kd.dot(d)

    def second(h):
        return balloon.energy(moved(q, h, d))[0] - energy - h * slope

    np.testing.assert_allclose(taylor_rates(second, STEPS), 2, atol=0.15)
    np.testing.assert_allclose(taylor_rates(lambda h: second(h) - h**2 / 2 * curvature, STEPS), 3, atol=0.25)
    assert balloon.second_variation(q, d, d) == pytest.approx(curvature, rel=1e-9)


@pytest.mark.parametrize("distortion", KINDS, ids=NAMES)
def test_taylor_of_the_residual_of_film_pressure(comm, distortion):
    balloon = under(stack(comm, load="film"), distortion)
    q, d = state_and_direction(balloon)
    r, Kd = gradient_and_curvature(balloon, q, d)

    def second(h):
        new = r.duplicate()
        balloon.residual(moved(q, h, d), new)
        new.axpy(-1.0, r)
        new.axpy(-h, Kd)
        return new.norm()

    np.testing.assert_allclose(taylor_rates(second, STEPS), 2, atol=0.1)


@pytest.mark.parametrize("distortion", KINDS, ids=NAMES)
def test_jacobian_is_the_maps_derivative(comm, distortion):
    balloon = under(stack(comm, support="pinned"), distortion)
    x, n = nodes(balloon), balloon.map.num_parameters
    q = unknowns(balloon, 0.1 * wavy(x, 1), np.linspace(-0.4, 0.7, n))
    d = unknowns(balloon, wavy(x, 2), np.linspace(1, -2, n))
    h = 1e-3

    def at(t):
        balloon.set_unknowns(moved(q, t, d))
        return balloon.u.x.array.reshape(-1, 3).copy()

    difference = (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h)
    np.testing.assert_allclose(displacement_of(balloon, q, d), difference, rtol=0, atol=1e-10)


@pytest.mark.parametrize("plates", [{}, {"support": "pinned", "bar": 3e6}, {"bar": False}], ids=str)
@pytest.mark.parametrize("distortion", KINDS, ids=NAMES)
def test_reaction_is_the_energys_rate(comm, distortion, plates):
    """Any state, no equilibrium: dE/ds with q held."""
    balloon = under(stack(comm, **plates), distortion, 0.5)
    x, s, h = nodes(balloon), distortion.parameter / 2, 1e-3 * distortion.parameter
    q = unknowns(balloon, 0.02 * wavy(x, 1, 2.0), np.linspace(-0.04, 0.07, balloon.map.num_parameters))
    balloon.set_loads(2e4)
    reaction = balloon.reaction(q)

    def energy(t):
        balloon.prescribed.parameter = t
        return balloon.energy(q)[0]

    rate = (8 * (energy(s + h) - energy(s - h)) - (energy(s + 2 * h) - energy(s - 2 * h))) / (12 * h)
    assert reaction == pytest.approx(rate, rel=1e-7)


@pytest.mark.parametrize("distortion", KINDS, ids=NAMES)
def test_unknowns_of_a_displacement(comm, distortion):
    """Of a displacement that keeps to the map q is found again, and the free balloon's has it too."""
    free = stack(comm, support="pinned")
    balloon = under(free, distortion)
    n = balloon.map.num_parameters
    q = unknowns(balloon, 0.1 * wavy(nodes(balloon), 1), np.linspace(-0.3, 0.2, n))
    balloon.set_unknowns(q)
    displacement = balloon.u.x.array.copy()
    np.testing.assert_allclose(balloon.unknowns_of(balloon).array_r, q.array_r, rtol=0, atol=1e-14)
    free.set_unknowns(free.unknowns_of(balloon))
    np.testing.assert_allclose(free.u.x.array, displacement, rtol=0, atol=1e-13)
