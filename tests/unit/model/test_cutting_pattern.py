"""Film that is cut flat."""

import pytest
from builders import isotensoid_pumpkin as pumpkin

from lobefem.equilibrium.inflation import inflate


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
