"""Gas whose pressure rises along the axis: buoyancy, levels, a potential whose derivatives are right."""

import numpy as np
import pytest
from builders import pumpkin, stack
from states import nodes, unknowns, wavy
from taylor import assert_derivatives

from lobefem.equilibrium.inflation import inflate
from lobefem.linalg import petsc
from lobefem.model.film import Isotropic
from lobefem.model.gas_pressure import GasPressure

KINDS = ("stack", "pumpkin", "quadratic gore")


def with_gas(balloon, **gas):
    """The balloon with gas of its own."""
    others = [part for part in balloon.components if not isinstance(part, GasPressure)]
    return balloon.with_changes(components=[GasPressure(**gas), *others])


def balloon_of(kind, comm, **gas):
    if kind == "stack":
        drawn = stack(comm, support="pinned", bar=False)
    else:
        order = 2 if kind == "quadratic gore" else 1
        drawn = pumpkin(comm, Isotropic(), order=order, full=order == 1, divisions=(4, 4))
    return with_gas(drawn, **gas)


def anywhere(balloon, seed=3):
    return unknowns(balloon, 0.03 * wavy(nodes(balloon), seed, 2.0), 0.02)


def upward_force(balloon, q):
    """Force of the gas on film and plates along the axis [N].

    The film's inner forces have none; what is left of the nodal residual is the gas's.
    """
    r = q.duplicate()
    balloon.residual(q, r)
    force = np.array(balloon.assembly.residual()).reshape(-1, 3)[: balloon.map.owned // 3].sum(axis=0)
    on_film = balloon.comm.allreduce(force) @ balloon.axis.direction
    gradient, hessian = np.zeros(12), np.zeros((12, 12))
    balloon.plate_forces.add_to(gradient, hessian, balloon.w)
    plates = (gradient[:3] + gradient[6:9]) @ balloon.axis.direction
    return -(on_film + plates)


@pytest.mark.parametrize("kind", KINDS)
def test_buoyancy_is_the_gradient_times_the_volume(comm, kind):
    for gradient in (0.0, 40.0, -7.0):
        balloon = balloon_of(kind, comm, gradient=gradient, level=1.3)
        balloon.set_loads(300.0)
        q = anywhere(balloon)
        force = upward_force(balloon, q)
        scale = 300.0 * balloon.reference_area
        assert force == pytest.approx(gradient * balloon.volume(), rel=1e-9, abs=1e-10 * scale)


@pytest.mark.parametrize("kind", KINDS)
def test_a_level_is_a_shift_of_the_pressure(comm, kind):
    found = []
    for level, pressure in ((0.0, 300.0 - 40.0 * 0.7), (0.7, 300.0)):
        balloon = balloon_of(kind, comm, gradient=40.0, level=level)
        balloon.set_loads(pressure)
        q = anywhere(balloon)
        r = q.duplicate()
        balloon.residual(q, r)
        found.append((balloon.energy(q)[0], r))
    (low, r_low), (high, r_high) = found
    assert low == pytest.approx(high, rel=1e-10)
    r_low.axpy(-1, r_high)
    assert r_low.norm() < 1e-10 * r_high.norm()


@pytest.mark.parametrize("kind", KINDS)
def test_the_gas_has_a_potential(comm, kind):
    """Energy, residual and tangent by differences; the gas is the larger part of them."""
    balloon = balloon_of(kind, comm, gradient=3e5, level=0.4).with_changes(film=Isotropic(E=1e6))
    balloon.set_loads(1e5)
    q = anywhere(balloon)
    d = unknowns(balloon, wavy(nodes(balloon), 5, 2.0), 0.5)
    assert_derivatives(balloon, q, d, 1e-4)
    assert petsc.asymmetry(balloon.tangent(q)) < 1e-12


def test_seams_of_a_stack_are_pulled_more_where_the_pressure_is_larger(comm):
    """Both rims held, so that the stack is its own mirror image: upside down for falling pressure."""
    drawn = stack(comm, lobes=4, support="fixed")
    height = drawn.motion.length
    found = [inflate(with_gas(drawn, gradient=b, level=height / 2), 2e4) for b in (0.0, 500.0, -500.0)]
    even, up, down = np.array([state.hoop_tension for state in found])
    np.testing.assert_allclose(up, down[::-1], rtol=1e-7)
    assert up[0] < even[0] < up[-1]
    assert found[1].volume == pytest.approx(found[2].volume, rel=1e-9)
