"""Film of which modulus and thickness vary over the surface."""

import numpy as np
import pytest

from lobefem.equilibrium.inflation import inflate
from lobefem.errors import InputError
from lobefem.model.film import Isotropic
from lobefem.model.fixed_wrinkles import FixedWrinkles
from lobefem.model.tension_field import TensionField
from lobefem.stability.cyclic import sector_balloon
from lobefem.stability.modes import find_modes
from tests.builders import stack

import dolfinx
import ufl

LAWS = (Isotropic, TensionField)


def surface():
    return stack().surface


@pytest.mark.parametrize("law", LAWS)
def test_a_function_of_one_value_is_the_number(law):
    one = surface()
    numbers = inflate(stack(film=law(E=2e8, thickness=1e-4), surface=one, support="fixed"), 50.0)
    E, t = (one.by_region({"lobe_1": v, "lobe_2": v}) for v in (2e8, 1e-4))
    functions = inflate(stack(film=law(E=E, thickness=t), surface=one, support="fixed"), 50.0)
    assert functions.volume == pytest.approx(numbers.volume, rel=1e-12)
    assert functions.strain_energy == pytest.approx(numbers.strain_energy, rel=1e-9)
    assert "E = varies" in str(functions.balloon)
    # the share that is wrinkled is asked for as well
    assert functions.taut_area == pytest.approx(numbers.taut_area, rel=1e-9, abs=1e-9)
    values = [find_modes(state, 1)[0].value.real for state in (numbers, functions)]
    assert values[0] == pytest.approx(values[1], rel=1e-6)


def test_a_stiff_lobe_strains_less():
    """Twice the thickness is twice the modulus, and the lobe that has it stretches half as much."""
    one = surface()
    energies = []
    for film in (
        TensionField(E=one.by_region({"lobe_1": 2e8, "lobe_2": 1e8}), thickness=1e-4),
        TensionField(E=1e8, thickness=one.by_region({"lobe_1": 2e-4, "lobe_2": 1e-4})),
    ):
        state = inflate(stack(film=film, surface=one, support="fixed"), 50.0)
        balloon = state.balloon
        state.restore()
        density = film.energy(balloon.forms.strain, balloon.forms.number)
        shares = [
            balloon.comm.allreduce(
                dolfinx.fem.assemble_scalar(dolfinx.fem.form(density * balloon.measure(name)))
            )
            for name in ("lobe_1", "lobe_2")
        ]
        assert shares[0] < 0.7 * shares[1]
        energies.append(shares)
    assert np.allclose(energies[0], energies[1], rtol=1e-6)


def test_a_smooth_expression_of_the_place():
    one = surface()
    E = 1e8 * (1 + ufl.SpatialCoordinate(one.mesh)[2])
    assert inflate(stack(film=TensionField(E=E), surface=one, support="fixed"), 10.0).converged


def test_functions_that_cannot_be_are_refused():
    one, other = surface(), surface()
    E = one.by_region({"lobe_1": 1e8, "lobe_2": 2e8})
    with pytest.raises(InputError, match="film E is a function, and FixedWrinkles film takes a number"):
        FixedWrinkles(E=E)
    with pytest.raises(InputError, match="a function on another mesh"):
        stack(film=TensionField(E=E), surface=other)
    with pytest.raises(InputError, match=r"no region 'lobe_3' on this surface; it has \['lobe_1'"):
        one.by_region({"lobe_3": 1.0})
    with pytest.raises(InputError, match=r"some cells are in none of the regions \['lobe_1'\]"):
        one.by_region({"lobe_1": 1.0})
    with pytest.raises(InputError, match="film thickness is not positive everywhere"):
        TensionField(thickness=one.by_region({"lobe_1": 0.0, "lobe_2": 1e-4}))
    with pytest.raises(InputError, match=r"film E has the shape \(3,\)"):
        TensionField(E=ufl.SpatialCoordinate(one.mesh))
    balloon = stack(film=TensionField(E=E), surface=one)
    with pytest.raises(InputError, match="functions of its own stays on its surface"):
        balloon.remeshed(other)
    with pytest.raises(InputError, match="film that is the same everywhere"):
        sector_balloon(balloon)
