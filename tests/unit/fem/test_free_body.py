"""Closed film that nothing holds: its rigid motions are taken out, and bear nothing."""

from pathlib import Path

import numpy as np
import pytest

from lobefem import (
    Balloon,
    Cables,
    EndPlates,
    Fixed,
    FreeBody,
    GasPressure,
    Surface,
    TensionField,
    find_modes,
    inflate,
    lobed_cylinder,
)
from lobefem.errors import InputError
from lobefem.fem.rigid_motions import distance_of

AIRBEAM = Path(__file__).parents[3] / "meshes" / "airbeam.msh"
FILM = TensionField(E=1e9, thickness=2e-4)


def airbeam(turned=False, load="film", **given):
    """The airbeam without a support; `turned` about all axes and shifted."""
    surface = Surface.from_msh(AIRBEAM)
    if turned:
        q = np.linalg.qr(np.array([[1.0, 2.0, 0.5], [-0.3, 1.0, 2.0], [1.0, -1.0, 0.7]]))[0]
        q *= np.sign(np.linalg.det(q))
        surface.mesh.geometry.x[:] = surface.mesh.geometry.x @ q.T + [3.0, -2.0, 1.0]
    parts = [GasPressure(load), FreeBody(), Cables(2e4, ("tip",), tension_only=True)]
    return Balloon(surface, FILM, parts, **given)


def test_what_holds_the_body_bears_nothing():
    """The forces on all nodes balance, those that were held included."""
    state = inflate(airbeam(), 2e4)
    balloon = state.balloon
    state.restore()
    loose = balloon.afloat()
    assert loose.map.size == balloon.map.size + 6
    q = loose.unknowns_of(balloon)
    r = loose.map.create_vector()
    loose.residual(q, r)
    assert r.norm() < 1e-7 * loose.load_norm(q)


def test_state_and_modes_do_not_depend_on_the_place():
    """Six rigid motions cost nothing; all else is the body's own, and the same for the load of both kinds."""
    states = [inflate(airbeam(turned, load), 2e4) for turned, load in ((False, "film"), (True, "closed"))]
    assert states[0].volume == pytest.approx(states[1].volume, rel=1e-9)
    assert states[0].strain_energy == pytest.approx(states[1].strain_energy, rel=1e-7)
    assert states[0].max_displacement == pytest.approx(states[1].max_displacement, rel=1e-4)
    found = [find_modes(state, 8) for state in states]
    for modes in found:
        assert [mode.rigid for mode in modes.modes] == [True] * 6 + [False] * 2
        assert max(abs(mode.value.real) for mode in modes.modes[:6]) < 1e-9 * modes[6].value.real
        assert modes.num_negative == 0
        assert modes.symmetric
        assert modes.stable
    values = np.array([modes.values.real for modes in found])[:, 6:]
    np.testing.assert_allclose(values[0], values[1], rtol=1e-5)


def test_a_free_beam_is_stiffer_than_one_held_at_its_root():
    """By the ratio of the squares of frequencies of slender beams it would be 40."""
    free = find_modes(inflate(airbeam(), 2e4), 7)
    surface = Surface.from_msh(AIRBEAM)
    held = Balloon(surface, FILM, [GasPressure("film"), Fixed("root")])
    assert free.lowest > 2 * find_modes(inflate(held, 2e4), 1).lowest


def test_a_shift_and_a_turn_are_no_distance():
    state = inflate(airbeam(), 2e4)
    balloon = state.balloon
    x = balloon.X + state.displacement
    angle = 0.3
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    elsewhere = x @ turn.T + [1.0, 2.0, 3.0] - balloon.X
    distance, turned = distance_of(balloon, state.displacement, elsewhere)
    assert distance < 1e-9
    assert turned == pytest.approx(angle, rel=1e-9)


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ([Fixed("root")], "leave Fixed film out"),
        ([FreeBody()], "takes one FreeBody, not 2"),
    ],
)
def test_a_body_that_is_held_is_not_free(parts, words):
    with pytest.raises(InputError, match=words):
        Balloon(Surface.from_msh(AIRBEAM), FILM, [FreeBody(), *parts])


def test_open_film_is_not_free():
    surface = lobed_cylinder(1, (4, 8))
    with pytest.raises(InputError, match="this film has 16 free edges"):
        Balloon(surface, FILM, [FreeBody()])
    with pytest.raises(InputError, match="leave EndPlates out"):
        Balloon(surface, FILM, [FreeBody(), EndPlates()])
