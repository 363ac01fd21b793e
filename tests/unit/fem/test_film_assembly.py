"""The assembly that a balloon shares with the same balloon under another map."""

import numpy as np
import pytest
from states import nodes, unknowns, wavy

from lobefem.equilibrium.displacement_control import constrain
from lobefem.equilibrium.distortions import Tip
from lobefem.fem.balloon import Balloon
from lobefem.geometry.stacks import lobed_cylinder, sector_of
from lobefem.model.cables import Hoops
from lobefem.model.dead_weight import DeadWeight
from lobefem.model.end_plates import EndPlates
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.tension_field import TensionField


def make(comm, surface=None):
    surface = surface or lobed_cylinder(2, (4, 8), comm=comm)
    parts = [GasPressure(gradient=8.0), Hoops(EA=1e6), EndPlates("clamped"), DeadWeight(film=3.0)]
    balloon = Balloon(surface, TensionField(slack_stiffness=1e-3), parts)
    balloon.set_loads(50.0)
    return balloon


def state(balloon, seed):
    return unknowns(balloon, 0.01 * wavy(nodes(balloon), seed, 2.0), 0.01)


def test_a_constrained_and_an_untied_balloon_share_the_assembly(comm):
    balloon = make(comm)
    constrained = constrain(balloon, Tip(0.1))
    assert constrained.assembly is balloon.assembly
    assert constrained.free is balloon
    sector = make(comm, sector_of(balloon.surface))
    assert sector.untied().assembly is sector.assembly
    assert balloon.untied() is balloon
    assert make(comm).assembly is not balloon.assembly


def test_what_one_balloon_assembles_is_not_taken_for_the_others(comm):
    """Free and constrained, in turn in states and loads of their own, as if each were alone."""
    balloon, alone = make(comm), make(comm)
    constrained = constrain(balloon, Tip(0.1))
    constrained.prescribed.parameter = 0.1
    q, own = state(balloon, 1), state(constrained, 2)
    r, expected = q.duplicate(), q.duplicate()
    for pressure in (50.0, 70.0):
        balloon.set_loads(pressure)
        alone.set_loads(pressure)
        balloon.residual(q, r)
        constrained.residual(own, own.duplicate())
        constrained.tangent(own)
        for _ in range(2):  # assembled and kept
            balloon.residual(q, r)
            alone.residual(q, expected)
            r.axpy(-1.0, expected)
            assert r.norm() == 0
        difference = balloon.tangent(q).copy()
        difference.axpy(-1.0, alone.tangent(q))
        assert difference.norm() == 0
    assert constrained.energy(own)[0] != balloon.energy(q)[0]


def test_plates_are_where_the_balloon_put_them(comm):
    balloon = make(comm)
    np.testing.assert_array_equal(balloon.w, np.zeros(12))
    assert balloon.volume() == pytest.approx(balloon.reference_volume, rel=1e-14)
    balloon.set_unknowns(state(balloon, 1))
    w, _, _ = balloon.map.plate_parameters(np.full(balloon.map.num_parameters, 0.01))
    np.testing.assert_array_equal(balloon.w, w)


def test_energies_add_up_to_the_balloons(comm):
    """Without the plates' part: both rims are held."""
    surface = lobed_cylinder(2, (4, 8), comm=comm)
    parts = [GasPressure(gradient=8.0), Hoops(EA=1e6), EndPlates("fixed"), DeadWeight(film=3.0)]
    balloon = Balloon(surface, TensionField(slack_stiffness=1e-3), parts)
    balloon.set_loads(50.0)
    energy, _ = balloon.energy(state(balloon, 1))
    film = balloon.assembly
    assert min(abs(part) for part in (film.elastic(), film.volume(), film.moment(), film.raised())) > 1e-6
    assert film.barrier() == 0
    total = film.elastic() - 50.0 * film.volume() - film.moment() + film.raised()
    assert energy == pytest.approx(total, rel=1e-12)
