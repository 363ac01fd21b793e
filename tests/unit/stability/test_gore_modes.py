"""Modes of all harmonics from the state of one gore, or of one sector of a stack."""

from dataclasses import replace

import numpy as np
import pytest
from builders import isotensoid_pumpkin as pumpkin
from builders import stack

from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.solver_options import NewtonOptions
from lobefem.errors import InputError
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.linalg import petsc
from lobefem.model.end_plates import EndPlates
from lobefem.model.film import Isotropic
from lobefem.model.fixed_wrinkles import FixedWrinkles
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.imp import PrescribedPath
from lobefem.model.orthotropic import Orthotropic, OrthotropicTensionField
from lobefem.model.supports import Fixed
from lobefem.model.tension_field import TensionField
from lobefem.outcomes import RIGID
from lobefem.stability.gore_modes import GoreSector
from lobefem.stability.modes import find_modes

FILM = {"E": 300e6, "nu": 0.4, "thickness": 38e-6}
ORTHOTROPIC = {"E1": 212.5e6, "E2": 246.6e6, "nu12": 0.58, "thickness": 38e-6}

CASES = {
    "quads": {},
    "triangles": {"cell": "triangle", "order": 1, "divisions": (6, 4)},
    "bilinear": {"order": 1, "divisions": (6, 3)},
    "flat": {"flat": True},
    "isotropic, gradient": {"film": Isotropic(**FILM), "gas": GasPressure("closed", gradient=3.0)},
    "wrinkles": {"film": FixedWrinkles(**FILM, slack_stiffness=1e-2)},
    "orthotropic": {"film": Orthotropic(**ORTHOTROPIC)},
    "orthotropic tension field": {
        "film": OrthotropicTensionField(**ORTHOTROPIC, slack_stiffness=1e-4),
        "gores": 12,
        "divisions": (4, 2),
    },
    "fixed plates, film load": {"gas": GasPressure("film"), "plates": EndPlates("fixed", bar=False)},
    "no plates": {"parts": (Fixed("nadir"), Fixed("apex")), "plates": EndPlates("fixed", bar=False)},
}


def both(pressure=300.0, **given):
    """The states of one gore and of the full balloon."""
    gore, full = (pumpkin(**given, full=full) for full in (False, True))
    return inflate(gore, pressure, options=NewtonOptions(rtol=1e-11)), inflate(
        full, pressure, options=NewtonOptions(rtol=1e-11)
    )


@pytest.mark.parametrize("case", CASES)
def test_one_gore_has_the_modes_of_the_full_model(case):
    gore, full = both(**CASES[case])
    order = gore.balloon.surface.copies
    count = {8: 26, 12: 80}[order]  # so many that all harmonics are among them
    wanted = find_modes(full, count)
    found = find_modes(gore, count, harmonics=range(order // 2 + 1))
    assert found.values == pytest.approx(wanted.values, rel=1e-8, abs=1e-8 * abs(wanted.values).max())
    assert {m.harmonic for m in found.modes} == set(range(order // 2 + 1))
    assert found.num_negative == wanted.num_negative
    assert found.symmetric
    assert max(m.residual for m in found.modes) < 1e-6


def test_a_stack_has_the_modes_of_its_sector():
    full = stack(divisions=(6, 10), plates=EndPlates(bar=False))
    surface = lobed_cylinder(2, (6, 10), sector=True)
    sector = stack(surface=surface, plates=EndPlates(bar=False))
    wanted = find_modes(inflate(full, 5.0, options=NewtonOptions(rtol=1e-11)), 20)
    found = find_modes(inflate(sector, 5.0, options=NewtonOptions(rtol=1e-11)), 20, harmonics=range(6))
    assert found.values == pytest.approx(wanted.values, rel=1e-8)
    # a mode of the full mesh counts its harmonic up to half its nodes on a ring, and so does a sector of one
    assert sorted(m.harmonic for m in found.modes) == sorted(m.harmonic for m in wanted.modes)


@pytest.mark.parametrize("mass", ["unit", "nodal"])
def test_single_harmonics_and_both_masses(mass):
    gore, full = both()
    wanted = find_modes(full, 30, mass=mass)
    found = find_modes(gore, 3, mass=mass, harmonics=[2])
    assert [m.harmonic for m in found.modes] == [2, 2, 2]
    assert found.values[0] == found.values[1] != found.values[2]
    assert found.num_negative is None
    for value in found.values:
        assert np.abs(wanted.values / value - 1).min() < 1e-8


@pytest.mark.parametrize("pressure", [1000.0, 3000.0])
def test_negative_eigenvalues_are_counted_by_inertia(pressure):
    """With more pressure in a shape than it balances, waves of all harmonics are unstable."""
    gore, full = (replace(state, pressure=pressure) for state in both())
    q = full.restore()
    negative = petsc.num_negative(full.balloon.tangent(q))
    found = find_modes(gore, negative + 4, harmonics=range(5))
    assert found.num_negative == negative > 6
    assert (found.values.real < 0).sum() == negative
    assert not found.stable


def test_the_second_of_a_pair_is_a_quarter_period_ahead():
    gore, _ = both()
    found = find_modes(gore, 2, harmonics=[3])
    first, second = found.modes
    assert np.abs(second.displacement - first.displacement_imag).max() < 1e-14
    assert np.abs(second.displacement_imag + first.displacement).max() < 1e-14
    amplitude = np.linalg.norm(first.displacement + 1j * first.displacement_imag, axis=1)
    assert amplitude.max() == pytest.approx(1.0)


def test_kinds_are_named():
    gore, _ = both()
    for n, kinds in ((0, {"twist", "global"}), (1, {"sway"}), (3, {"global", "local"})):
        assert {m.kind for m in find_modes(gore, 4, harmonics=[n]).modes} <= kinds


def test_a_pinned_sector_turns_freely():
    surface = lobed_cylinder(1, (6, 8), sector=True)
    state = inflate(
        stack(surface=surface, plates=EndPlates("pinned", bar=False)), 5.0, options=NewtonOptions(rtol=1e-11)
    )
    found = find_modes(state, 6, harmonics=range(5))
    turns = [m for m in found.modes if m.rigid]
    assert [m.kind for m in turns] == [RIGID, RIGID]
    assert {m.harmonic for m in turns} == {1}
    assert found.stable
    assert found.num_negative == 0


def test_harmonics_must_be_given_and_be_there():
    gore, _ = both(gores=8, divisions=(4, 2))
    with pytest.raises(InputError, match=r"one of 8 equal sectors.*give harmonics, such as range\(5\)"):
        find_modes(gore)
    with pytest.raises(InputError, match=r"give harmonics"):
        find_modes(gore, harmonics=[])
    with pytest.raises(InputError, match="harmonic = 5: 8 equal sectors have harmonics 0 to 4"):
        find_modes(gore, harmonics=[5])


def test_what_has_no_symmetric_tangent_is_refused():
    gore = inflate(pumpkin(divisions=(4, 2), gas=GasPressure("film")), 300.0)
    with pytest.raises(InputError, match="harmonic 1 is not symmetric under 'film' pressure on plates that"):
        find_modes(gore, harmonics=[1])
    assert find_modes(gore, 1, harmonics=[3]).asymmetry < 1e-12
    path = replace(gore, balloon=pumpkin(divisions=(4, 2), film=PrescribedPath(**FILM, slack_stiffness=1e-2)))
    with pytest.raises(InputError, match="PrescribedPath film has no symmetric tangent"):
        find_modes(path, harmonics=[2])


def test_cuts_are_held_alike():
    held = pumpkin(divisions=(4, 2), parts=[Fixed("tendon_1", (2,))])
    with pytest.raises(InputError, match="free or held in all components"):
        GoreSector(held)
    with pytest.raises(InputError, match="this is a whole balloon"):
        GoreSector(pumpkin(divisions=(4, 2), full=True))


def test_other_laws_of_the_tension_field_agree():
    """The orthotropic law with equal moduli is the isotropic one, in modes too."""
    equal = {"E1": 300e6, "E2": 300e6, "nu12": 0.4, "thickness": 38e-6}
    values = [
        find_modes(
            inflate(pumpkin(film=film), 300.0, options=NewtonOptions(rtol=1e-11)), 4, harmonics=[0, 2]
        ).values
        for film in (
            TensionField(**FILM, slack_stiffness=1e-4),
            OrthotropicTensionField(**equal, slack_stiffness=1e-4),
        )
    ]
    assert values[1] == pytest.approx(values[0], rel=1e-6)
