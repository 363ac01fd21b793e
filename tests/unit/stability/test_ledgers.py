"""Where the energy of a ramp goes: dead loads, film in contact, what an earlier run has written down."""

import math
from dataclasses import asdict, replace
from types import SimpleNamespace

import numpy as np
import pytest

from lobefem.app.perturb_command import _perturbed
from lobefem.equilibrium.distortions import Bend, Tip
from lobefem.equilibrium.energy_ledger import Ledger
from lobefem.equilibrium.state import Checkpoint
from lobefem.fem.balloon import Balloon
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.model.cables import Hoops
from lobefem.model.end_plates import EndPlates, PlateLoad
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.self_contact import SelfContact
from lobefem.model.tension_field import TensionField
from lobefem.stability.perturbation import Perturbed, Point, perturb


def stack(comm, *parts, load="closed", lobes=2, divisions=(4, 8)):
    surface = lobed_cylinder(lobes, divisions, comm=comm)
    parts = [GasPressure(load), Hoops(), EndPlates(), *parts]
    return Balloon(surface, TensionField(), parts, prestressed=True)


@pytest.mark.parametrize("load", ["closed", "film"])
def test_a_dead_load_works_in_a_ramp(comm, load):
    side, push = 5.0, 20.0
    balloon = stack(comm, PlateLoad((side, 0.0, -push)), load=load, lobes=1)
    end = perturb(balloon, 5.0, Tip(0.3), steps=8).ramp[-1]
    free = perturb(stack(comm, load=load, lobes=1), 5.0, Tip(0.3), steps=8).ramp[-1]
    assert end.ledger.error < 0.01
    # a rigid bar bears it: the shape is the same, and so is the work that it takes, done by two forces
    assert end.ledger.strain == pytest.approx(free.ledger.strain, rel=1e-2)
    assert end.ledger.constraint == pytest.approx(free.ledger.constraint, rel=1e-3)
    slope = 0.3 / np.sqrt(balloon.motion.length**2 - 0.3**2)
    assert free.reaction - end.reaction == pytest.approx(side + push * slope, rel=2e-2)


@pytest.mark.parametrize("load", ["closed", "film"])
def test_a_ledger_begins_at_the_pressurised_balloon_and_closes(comm, load):
    """Under `film` load the plates' way is no work of the gas: a bend turns the top plate beyond its way."""
    found = perturb(stack(comm, load=load), 5.0, Bend(6.0), steps=6)
    first, end = found.ramp[0].ledger, found.ramp[-1].ledger
    assert abs(first.strain) < 0.01 * found.original.strain_energy
    assert max(map(abs, asdict(first).values())) < 1e-4 * end.constraint
    assert end.error < 0.01
    volume = 5.0 * (found.ramp[-1].volume - found.original.volume)
    assert (abs(end.pressure - volume) > 0.03 * abs(volume)) is (load == "film")


def test_film_in_contact_has_energy(comm):
    """A bent stack of two lobes closes the wedge at its seam."""
    rest_gap = stack(comm, SelfContact()).contact.rest_gap
    balloon = stack(comm, SelfContact(activation=0.9 * rest_gap, stiffness=200.0))
    found = perturb(balloon, 5.0, Bend(6.0), steps=6, let_go=True)
    end = found.ramp[-1]
    assert end.contact_force > 0
    assert end.ledger.contact > 0
    assert end.ledger.error < 0.01
    gaps = [p.gap for p in found.ramp]
    assert min(gaps) == end.gap < 0.9 * rest_gap
    k = next(k for k, p in enumerate(found.ramp) if p.contact_force > 0)
    assert found.ramp[k - 1].parameter < found.first_contact < found.ramp[k].parameter
    # let go, the film gives back what contact has taken
    first, last = found.history[len(found.ramp)], found.history[-1]
    assert found.released.outcome == "returned"
    assert 0 < first.ledger.contact <= end.ledger.contact * (1 + 1e-6)
    assert abs(last.ledger.contact) < 1e-6 * end.ledger.contact
    assert last.contact_force == 0
    assert last.ledger.error < 0.02


def point(parameter, gap, force, time=None):
    other = {"reaction": 0.0, "volume": 1.0, "mid_hoop_displacement": 0.0, "residual": 0.0}
    return Point(parameter=parameter, gap=gap, contact_force=force, time=time, ledger=Ledger(), **other)


@pytest.mark.parametrize(
    ("steps", "parameter"),
    [
        ([(1.0, 0.3, 0), (2.0, 0.1, 5)], 1.75),
        ([(0.0, 0.5, 0), (1.0, 0.3, 0), (2.0, 0.1, 5), (3.0, 0.05, 9)], 1.75),
        ([(-1.0, 0.3, 0), (-2.0, 0.1, 5)], -1.75),
        ([(1.0, 0.15, 0), (2.0, 0.1, 5)], 1.0),
        ([(1.0, 0.2, 0), (2.0, 0.15 - 1e-12, 5)], 2.0),
        ([(1.0, 0.12, 4), (2.0, 0.1, 5)], 1.0),  # from the beginning
        ([(1.0, 0.3, 0), (2.0, 0.2, 0)], None),
    ],
)
def test_first_contact_is_where_the_gap_reached_the_activation_distance(steps, parameter):
    contact = SimpleNamespace(activation=0.15)
    original = SimpleNamespace(balloon=SimpleNamespace(contact=contact))
    history = (*(point(*step) for step in steps), point(steps[-1][0], 0.01, 99, time=1.0))
    found = Perturbed(Bend(5.0), original, None, None, history)
    expected = parameter if parameter is None else pytest.approx(parameter, rel=1e-9)
    assert found.first_contact == expected
    assert len(found.ramp) == len(steps)


@pytest.mark.parametrize("degrees", [True, False])
def test_what_is_told_of_a_history(degrees):
    """Parameters in the option's unit; the smallest gap, not the last; volumes of what they are called."""
    contact = SimpleNamespace(activation=0.15)
    original = SimpleNamespace(balloon=SimpleNamespace(contact=contact), volume=8.0)
    ledger = Ledger(strain=3.0, contact=1.0, pressure=-2.0, constraint=10.0, damping=3.9)
    steps = [point(0.0, 0.3, 0), point(0.5, 0.1, 5), point(1.0, 0.2, 5)]
    end = replace(steps[-1], reaction=7.0, volume=6.0, residual=1e-9, ledger=ledger)
    found = _perturbed(Perturbed(Bend(30.0), original, None, None, (*steps[:-1], end)), degrees)
    one = math.degrees(1.0) if degrees else 1.0
    assert found["first_contact"] == pytest.approx(0.375 * one)
    assert [p["parameter"] for p in found["history"]] == pytest.approx([0.0, 0.5 * one, one])
    assert found["smallest_gap"] == 0.1
    assert (found["volume_original"], found["volume_imposed"], found["volume_final"]) == (8.0, 6.0, 6.0)
    assert (found["imposed_ratio"], found["reaction"], found["residual"]) == (0.75, 7.0, 1e-9)
    assert found["energy"] == asdict(ledger) | {"closure": ledger.closure, "error": ledger.error}
    assert found["history"][-1]["ledger"] == asdict(ledger)


def test_a_resumed_ramp_goes_on_with_the_ledger_that_it_had(comm):
    """Damping of snaps and work before a stop are not lost."""
    kept = []
    balloon = stack(comm, lobes=1)
    whole = perturb(balloon, 5.0, Tip(0.2), steps=4, keep=lambda *given: kept.append(given))
    state, notes = kept[len(kept) // 2]
    history = [dict(p) for p in notes["history"]]
    earlier = dict(history[-1]["ledger"])
    history[-1]["ledger"] = earlier | {
        "damping": earlier["damping"] + 0.25,
        "constraint": earlier["constraint"] + 0.5,
        "pressure": earlier["pressure"] - 0.125,
    }
    resume = Checkpoint(
        balloon, state.pressure, state.prestress, state.unknowns, notes | {"history": history}
    )
    again = perturb(balloon, 5.0, Tip(0.2), steps=4, resume=resume)
    one, other = (found.ramp[-1].ledger for found in (whole, again))
    for name, more in (("damping", 0.25), ("constraint", 0.5), ("pressure", -0.125), ("strain", 0.0)):
        assert getattr(other, name) == pytest.approx(getattr(one, name) + more, rel=2e-2), name
    # what was written down before is there as it was
    assert [asdict(p) for p in again.history[: len(history)]] == history


def test_a_ledgers_error_is_over_its_largest_term():
    for name, sign in (("strain", -1), ("contact", -1), ("pressure", 1), ("constraint", 1), ("damping", -1)):
        ledger = replace(Ledger(), **{name: 2.0})
        assert (ledger.closure, ledger.error) == (2.0 * sign, 1.0)
    balanced = Ledger(strain=3.0, contact=1.0, pressure=-2.0, constraint=10.0, damping=4.0, euler=9.0)
    assert balanced.closure == 0.0
    assert np.isclose(replace(balanced, damping=3.5).error, 0.05)
