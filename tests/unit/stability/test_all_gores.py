"""The full balloon's state and modes made from those of one sector."""

import numpy as np
import pytest
from builders import isotensoid_pumpkin as pumpkin
from builders import stack

from lobefem.equilibrium.full_model import full_balloon, full_state
from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.solver_options import NewtonOptions
from lobefem.errors import InputError
from lobefem.fem.functionals import largest
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.model.end_plates import EndPlates
from lobefem.stability.all_gores import full_modes
from lobefem.stability.modes import find_modes


@pytest.mark.parametrize("flat", [False, True])
def test_the_full_balloon_of_a_gore(flat):
    gore = pumpkin(divisions=(4, 2), flat=flat, angle=30.0)
    whole, wanted = full_balloon(gore), pumpkin(divisions=(4, 2), flat=flat, angle=30.0, full=True)
    assert whole.reference_volume == pytest.approx(wanted.reference_volume, rel=1e-13)
    assert whole.components == gore.components
    assert whole.film == gore.film
    assert (whole.pattern is not None) is flat


def test_full_state_is_the_full_models_equilibrium():
    state = inflate(pumpkin(), 300.0, options=NewtonOptions(rtol=1e-11))
    full = full_state(state)
    assert full.iterations <= 1
    assert full.balloon.surface.copies == 1
    for name in ("volume", "strain_energy", "pressure", "max_displacement", "taut_area"):
        assert getattr(full, name) == pytest.approx(getattr(state, name), rel=1e-9)
    assert full.hoop_tension == pytest.approx(state.hoop_tension * 8, rel=1e-9)
    assert full.relative_residual < 1e-8


def test_full_state_of_a_stack():
    surface = lobed_cylinder(2, (4, 8), sector=True)
    plates = EndPlates(bar=False)
    state = inflate(stack(surface=surface, plates=plates), 5.0, options=NewtonOptions(rtol=1e-11))
    full = full_state(state, stack(divisions=(4, 8), plates=plates))
    assert full.volume == pytest.approx(state.volume, rel=1e-10)
    assert full.iterations <= 1


def test_full_modes_are_those_of_the_full_model():
    state = inflate(pumpkin(), 300.0, options=NewtonOptions(rtol=1e-11))
    found = find_modes(state, 20, harmonics=range(5))
    full = full_modes(found)
    balloon = full.state.balloon
    q = full.state.restore()
    for mode in full.modes:
        assert largest(balloon, mode.displacement) == pytest.approx(1.0)
        # the film's nodes off the plates, put into q, are an eigenvector of the full model
        dq = balloon.map.create_vector()
        free = balloon.map.free
        dq.array[: free.size] = mode.displacement.ravel()[free]
        if mode.harmonic > 1:  # the plates rest
            K, B = balloon.tangent(q), balloon.mass(q)
            r, b = K.createVecLeft(), K.createVecLeft()
            K.mult(dq, r)
            B.mult(dq, b)
            size = r.norm()
            r.axpy(-mode.value.real, b)
            assert r.norm() < 1e-6 * size
    grid = full.to_pyvista(0)
    assert grid is None or grid.n_points == len(grid.point_data["mode"])


def test_two_of_a_pair_are_independent_waves():
    state = inflate(pumpkin(), 300.0)
    full = full_modes(find_modes(state, 2, harmonics=[2]))
    B = full.state.balloon.mass_matrix()
    x, y = (B.createVecRight() for _ in range(2))
    for vector, mode in zip((x, y), full.modes, strict=True):
        vector.array[:] = mode.displacement.ravel()[: vector.local_size]
    z = B.createVecLeft()
    B.mult(x, z)
    assert abs(z.dot(y)) < 1e-10 * z.dot(x)


def test_what_is_no_sector_is_refused():
    whole = inflate(pumpkin(divisions=(4, 2), full=True), 100.0)
    with pytest.raises(InputError, match="the state is that of a whole balloon"):
        full_state(whole)
    with pytest.raises(InputError, match="the modes are those of a whole balloon"):
        full_modes(find_modes(whole, 1))
    sector = stack(surface=lobed_cylinder(2, (4, 8), sector=True), plates=EndPlates(bar=False))
    with pytest.raises(InputError, match="give the whole balloon"):
        full_state(inflate(sector, 5.0))
    gore = inflate(pumpkin(divisions=(4, 2)), 100.0)
    with pytest.raises(InputError, match=r"\d+ nodes of the whole balloon are no images"):
        full_state(gore, pumpkin(full=True))
    assert np.isfinite(gore.volume)
