"""A sealed gas in a balloon: Taylor tests of its potential, and what is refused."""

from functools import partial

import builders
import numpy as np
import pytest
from states import taylor_rates
from taylor import STEPS, gradient_and_curvature, moved, state_and_direction

from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.sealed_gas import fill, seal
from lobefem.errors import InputError
from lobefem.model.film import Isotropic
from lobefem.model.gas_pressure import SealedGas
from lobefem.model.self_contact import SelfContact
from lobefem.model.tension_field import TensionField

stack = partial(builders.stack, divisions=(4, 8))


@pytest.mark.parametrize(
    "build",
    [
        pytest.param(partial(stack, film=Isotropic(E=1e6), EA=1e4), id="stack"),
        pytest.param(
            partial(
                stack, film=TensionField(E=1e6, slack_stiffness=1e-3), support="pinned", bar=False, EA=1e4
            ),
            id="pinned-stack",
        ),
        pytest.param(
            partial(builders.pumpkin, film=Isotropic(E=1e7), full=True, gores=6, divisions=(4, 2)),
            id="pumpkin",
        ),
        pytest.param(
            partial(builders.pumpkin, film=Isotropic(E=1e7), gores=6, divisions=(4, 2)),
            id="gore",
            marks=pytest.mark.serial,
        ),
    ],
)
def test_taylor_of_the_potential(comm, build):
    """Orders 2 and 3 of the energy's remainders, and 2 of the residual's, with the part of rank one."""
    balloon = build(comm)
    volume = balloon.surface.copies * balloon.reference_volume
    sealed = balloon.with_gas(SealedGas.of(1e3, volume, ambient=1e8))
    q, d = state_and_direction(sealed)
    d.scale(0.2)  # no tendon turns slack on the way
    r, Kd = gradient_and_curvature(sealed, q, d)
    gas = sealed.gas_stiffness(q)
    curvature = Kd.dot(d) + gas.along(d, d)
    assert abs(gas.along(d, d)) > 1e-3 * abs(curvature)  # or nothing is tested
    Kd.axpy(gas.factor * gas.vector.dot(d), gas.vector)
    start, slope = sealed.energy(q)[0], r.dot(d)
    ends = {h: sealed.energy(moved(q, h, d))[0] - start for h in STEPS[:3]}
    assert np.abs(taylor_rates(lambda h: ends[h] - h * slope, STEPS[:3]) - 2).max() < 0.05
    # at the third step what is left is the round-off of the energy of so high an ambient pressure
    assert taylor_rates(lambda h: ends[h] - h * slope - h**2 / 2 * curvature, STEPS[:2]) == pytest.approx(
        3, abs=0.1
    )

    def change(h):
        new = q.duplicate()
        sealed.residual(moved(q, h, d), new)
        new.axpy(-1.0, r)
        new.axpy(-h, Kd)
        return new.norm()

    assert np.abs(taylor_rates(change, STEPS[:3]) - 2).max() < 0.05


def test_a_gas_that_cannot_be_sealed_is_refused(comm):
    with pytest.raises(InputError, match="amount of sealed gas"):
        SealedGas(0.0)
    with pytest.raises(InputError, match="ambient pressure is -1"):
        SealedGas(1.0, -1.0)
    with pytest.raises(InputError, match="presses on film and plates"):
        stack(comm, load="film").with_gas(SealedGas(1.0))
    with pytest.raises(InputError, match="stiffness of the contact follows"):
        stack(comm, parts=[SelfContact()]).with_gas(SealedGas(1.0))
    state = inflate(stack(comm), 5.0)
    with pytest.raises(InputError, match="seal its gas in first"):
        fill(state, 3.0)
    with pytest.raises(InputError, match="there is no gas to seal in"):
        seal(inflate(stack(comm), 0.0))
