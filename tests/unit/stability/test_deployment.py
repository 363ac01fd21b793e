"""Clefted balloons released at pressures in turn."""

import builders
import pytest

from lobefem.equilibrium.clefts import HarmonicSeed
from lobefem.equilibrium.displacement_control import distort, release_start
from lobefem.equilibrium.full_model import full_state
from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.sealed_gas import seal
from lobefem.errors import InputError
from lobefem.stability.deployment import deploy


@pytest.fixture(scope="module")
def seeded():
    from mpi4py import MPI

    gore, whole = (builders.pumpkin(MPI.COMM_WORLD, divisions=(6, 4), full=full) for full in (False, True))

    def symmetric(pressure):
        return full_state(inflate(gore, pressure), whole)

    start = release_start(distort(symmetric(100.0), HarmonicSeed(2, 0.2), steps=2).state)
    return start, symmetric


@pytest.mark.slow
def test_a_stable_pumpkin_deploys_at_the_first_pressure(seeded):
    start, symmetric = seeded
    found = deploy(start, (150.0, 300.0), symmetric)
    assert found.deployed_from == 150.0
    (end,) = found.released  # no need to look farther
    assert end.outcome == "returned"
    assert end.state.volume == pytest.approx(found.symmetric[0].volume, rel=1e-9)
    assert "deploys at 150 Pa" in str(found)


def test_what_is_refused(seeded):
    start, symmetric = seeded
    for wrong in ((), (100.0, 50.0, 60.0), (0.0, 50.0), (50.0, 50.0)):
        with pytest.raises(InputError, match="give positive ones that rise or fall"):
            deploy(start, wrong, symmetric)
    sealed = seal(symmetric(100.0))
    with pytest.raises(InputError, match="its pressure follows"):
        deploy(sealed, (100.0,), symmetric)
