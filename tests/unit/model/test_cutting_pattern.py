"""Film cut flat: which face a pattern shows does not matter, and stress is that of the cut film."""

import math

import numpy as np
import pytest
from builders import isotensoid_pumpkin as pumpkin

from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.state import placed_state
from lobefem.fem.balloon import Balloon
from lobefem.geometry.gore import ConstantAngle, FlatLobe, Gore
from lobefem.geometry.pumpkin import PumpkinRecipe
from lobefem.geometry.pumpkin_curve import PumpkinCurve
from lobefem.model.cables import Tendons
from lobefem.model.end_plates import EndPlates
from lobefem.model.film import Isotropic
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.tension_field import TensionField


@pytest.fixture(scope="module")
def recipe():
    gore = Gore(PumpkinCurve(5.0, (0.25, 0.25)), 16, ConstantAngle(math.radians(30)))
    return PumpkinRecipe(gore, (12, 4))


def cut(recipe, scale=(1.0, 1.0), stiffness=3e8):
    surface = recipe.surface()
    pattern = recipe.pattern(surface)
    pattern.x.array.reshape(-1, 2)[:] *= scale
    film = TensionField(E=stiffness, nu=0.4, thickness=38e-6, slack_stiffness=1e-5)
    return Balloon(surface, film, [GasPressure(), Tendons(), EndPlates(bar=False)], pattern=pattern)


def test_either_face_of_a_pattern_is_the_same_film(recipe):
    s = np.linspace(0.0, recipe.gore.curve.arc_length, 4001)
    area = np.trapezoid(2 * recipe.gore.half_width(s), recipe.gore.along(s))
    found = []
    for face in (1.0, -1.0):
        balloon = cut(recipe, (face, 1.0))
        assert balloon.reference_area == pytest.approx(area, rel=1e-5)
        found.append(inflate(balloon, 100.0))
    assert found[0].strain_energy > 0
    assert found[1].volume == pytest.approx(found[0].volume, rel=1e-10)
    assert found[1].strain_energy == pytest.approx(found[0].strain_energy, rel=1e-8)


def test_true_stress_is_that_of_the_film_as_cut():
    """Film cut a tenth too short and pulled straight: N = F S F^T/J with F = diag(1/0.9, 1)."""
    recipe = PumpkinRecipe(Gore(PumpkinCurve(5.0, (0.25, 0.25)), 200, FlatLobe()), (12, 4))
    surface = recipe.surface()
    pattern = recipe.pattern(surface)
    pattern.x.array[::2] *= 0.9
    film = Isotropic(E=3e8, nu=0.4, thickness=38e-6)
    balloon = Balloon(surface, film, [GasPressure(), Tendons(), EndPlates(bar=False)], pattern=pattern)
    N = placed_state(balloon, np.zeros_like(balloon.X)).true_resultants().x.array.reshape(-1, 3)
    along = (1 / 0.9**2 - 1) / 2
    S = film.Et / (1 - film.nu**2) * along * np.array([1, film.nu])
    expected = (S[0] / 0.9, S[1] * 0.9, 0.0)
    middle = surface.mesh.topology.original_cell_index // 4 == 6
    np.testing.assert_allclose(N[middle], np.tile(expected, (4, 1)), atol=2e-3 * expected[0])


def test_film_of_a_flat_gore_has_a_positive_area_and_energy():
    """Whichever face of the film its pattern was drawn on."""
    balloon = pumpkin(24, angle=30.0, flat=True)
    q = balloon.map.create_vector()
    energy = balloon.energy(q)[0]  # of the drawn shape, which a flat piece does not take without strain
    assert energy > 0
    assert balloon.reference_area == pytest.approx(pumpkin(24, angle=30.0).reference_area, rel=0.03)
    balloon.pattern.x.array[1::2] *= -1.0
    mirrored = balloon.with_changes(pattern=balloon.pattern)
    assert mirrored.reference_area == pytest.approx(balloon.reference_area, rel=1e-14)
    assert mirrored.energy(q)[0] == pytest.approx(energy, rel=1e-12)


def test_a_flat_gore_inflates():
    flat, drawn = (inflate(pumpkin(angle=30.0, flat=flat), 300.0) for flat in (True, False))
    assert flat.volume == pytest.approx(drawn.volume, rel=0.05)
    assert flat.strain_energy > 0
