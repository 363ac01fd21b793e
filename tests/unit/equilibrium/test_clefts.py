"""Seeds of clefts on all gores of a pumpkin: what they move, what they give back, what they refuse."""

import builders
import numpy as np
import pytest

from lobefem.equilibrium.clefts import Cleft, HarmonicSeed
from lobefem.equilibrium.displacement_control import distort
from lobefem.equilibrium.full_model import full_state
from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.sealed_gas import seal
from lobefem.equilibrium.state import Checkpoint
from lobefem.errors import InputError
from lobefem.model.dead_weight import DeadWeight
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.self_contact import SelfContact
from lobefem.stability.perturbation import perturb

PRESSURE = 200.0


def pumpkin(comm, full=True, contact=True, gores=8, divisions=(6, 4)):
    parts = [SelfContact(stiffness=PRESSURE)] if contact and full else []
    return builders.pumpkin(comm, gores=gores, divisions=divisions, full=full, parts=parts)


@pytest.fixture(scope="module")
def symmetric():
    from mpi4py import MPI

    whole = pumpkin(MPI.COMM_WORLD)
    return full_state(inflate(pumpkin(MPI.COMM_WORLD, full=False), PRESSURE), whole)


def tendon_nodes(balloon):
    """Nodes of tendons that this rank owns, without those of the fittings."""
    names = [f"tendon_{k + 1}" for k in range(balloon.surface.num_lobes)]
    nodes = np.unique(np.concatenate([balloon.edge_nodes(name) for name in names]))
    rims = np.concatenate([balloon.edge_nodes(name) for name in ("nadir", "apex")])
    return np.setdiff1d(nodes[nodes < balloon.V.dofmap.index_map.size_local], rims)


def along(balloon, nodes):
    """Share of a tendon's length below each of some of its nodes: rows of the mesh are even."""
    rows = np.round(balloon.X[nodes][:, 2], 6)
    everywhere = np.unique(np.concatenate(balloon.comm.allgather(rows)))
    return (1 + np.searchsorted(everywhere, rows)) / (len(everywhere) + 1)


def test_a_harmonic_seed_moves_tendons_around_the_axis(comm, symmetric):
    found = distort(symmetric, HarmonicSeed(2, 0.1), steps=2)
    balloon = found.state.balloon
    nodes = tendon_nodes(balloon)
    angle, _, _, frames = balloon.axis.cylindrical(balloon.X[nodes])
    t = along(balloon, nodes)
    around = np.einsum("nj,nj->n", found.state.displacement[nodes], frames[:, 1])
    expected = 0.1 * np.sin(2 * angle) * np.sin(2 * np.pi * t)
    np.testing.assert_allclose(around, expected, atol=1e-6)
    assert found.reaction > 0
    assert abs(found.history[0].reaction) < 1e-4 * found.reaction


def test_a_cleft_begins_where_the_pressure_has_moved_the_tendons(comm, symmetric):
    found = distort(symmetric, Cleft(0.2, 90.0, 60.0), steps=2)
    balloon = found.state.balloon
    nodes = tendon_nodes(balloon)
    angle, _, _, frames = balloon.axis.cylindrical(balloon.X[nodes])
    t = along(balloon, nodes)
    change = (found.state.displacement - symmetric.displacement)[nodes]
    outwards = np.einsum("nj,nj->n", change, frames[:, 0])
    off = np.angle(np.exp(1j * (angle - np.radians(30.0) * np.sin(np.pi * (t - 0.5)))))
    inside = np.abs(off) < np.radians(44.9)
    pulled = -0.2 * np.cos(2 * off[inside]) ** 2 * np.sin(np.pi * t[inside])
    np.testing.assert_allclose(outwards[inside], pulled, atol=1e-6)
    assert comm.allreduce(int(inside.sum())) > 5
    assert found.history[0].reaction == pytest.approx(0.0, abs=1e-4 * found.reaction)
    assert found.history[0].volume == pytest.approx(symmetric.volume, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [HarmonicSeed(2, 0.3), Cleft(0.4, 90.0)], ids=["harmonic", "cleft"])
@pytest.mark.parametrize("sealed", [False, True], ids=["given", "sealed"])
def test_a_stable_pumpkin_deploys_and_a_stopped_run_ends_alike(comm, symmetric, seed, sealed):
    original = seal(symmetric, 500.0) if sealed else symmetric
    balloon, kept = original.balloon, []

    def keep(state, notes):
        assert not balloon.contact.intersects(np.ascontiguousarray(state.displacement).ravel())
        kept.append((state, notes))

    run = {"let_go": True, "steps": 6, "original": original}
    found = perturb(balloon, PRESSURE, seed, keep=keep, **run)
    end = found.released
    assert end.outcome == "returned"
    assert end.lowest > 0
    assert end.distance < 1e-6
    assert end.state.volume == pytest.approx(original.volume, rel=1e-9)
    assert end.state.pressure == pytest.approx(PRESSURE, rel=1e-8)
    assert end.ledger.error < 0.01
    state, notes = next(one for one in kept if one[1]["phase"] == "release" and len(one[1]["records"]) == 3)
    stopped = Checkpoint(balloon, state.pressure, state.prestress, state.unknowns, notes, {})
    again = perturb(balloon, PRESSURE, seed, resume=stopped, **run)
    assert len(again.history) == len(found.history)
    np.testing.assert_allclose(again.released.state.displacement, end.state.displacement, atol=1e-9)
    assert again.history[-1].time == pytest.approx(found.history[-1].time, rel=1e-6)


def test_what_is_no_seed_is_refused(comm, symmetric):
    for wrong, message in (
        (HarmonicSeed(5, 0.1), "8 gores have harmonics up to 4"),
        (HarmonicSeed(4, 3.0), "would close a gore of 2.55 m by 6 m; give an amplitude below 1.27 m"),
        (Cleft(6.0), "reaches the axis"),
        (Cleft(0.1, 45.0), "less than two gores of 8; give a width of 90 degrees"),
    ):
        with pytest.raises(InputError, match=message):
            distort(symmetric, wrong)
    with pytest.raises(InputError, match="width is 0"):
        Cleft(0.1, 0.0)
    with pytest.raises(InputError, match="one of a pumpkin's tendons"):
        distort(inflate(builders.stack(comm), 5.0), HarmonicSeed(2, 0.1))


@pytest.mark.slow
def test_weight_works_in_a_ramp_and_in_a_release(comm):
    """What goes up and down again has cost nothing, and is no energy of contact."""
    parts = [DeadWeight(film=1.0, cables=1.0)]
    gas = GasPressure("closed", gradient=1.0)
    gore, whole = (
        builders.pumpkin(
            comm, gas=gas, divisions=(6, 4), full=full, parts=[*parts, *([SelfContact()] * full)]
        )
        for full in (False, True)
    )
    original = full_state(inflate(gore, PRESSURE), whole)
    found = perturb(whole, PRESSURE, HarmonicSeed(2, 0.3), let_go=True, steps=8, original=original)
    assert found.ramp[-1].ledger.error < 0.01
    ledger = found.released.ledger
    assert found.released.outcome == "returned"
    assert ledger.error < 0.01
    assert abs(ledger.contact) < 1e-9
    assert abs(ledger.strain) < 1e-3 * ledger.damping
    assert ledger.constraint == pytest.approx(ledger.damping, rel=0.01)
