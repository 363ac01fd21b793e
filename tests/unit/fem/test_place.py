"""A balloon does not care where it stands, nor which way its axis points."""

from dataclasses import replace

import numpy as np
import pytest

from lobefem.equilibrium import grid_sequencing
from lobefem.equilibrium.displacement_control import distort
from lobefem.equilibrium.distortions import Bend, Tip, Twist, Wave
from lobefem.equilibrium.form_finding import find_form
from lobefem.equilibrium.inflation import inflate
from lobefem.fem.balloon import Balloon
from lobefem.fem.functionals import mid_hoop_displacement, true_resultants
from lobefem.geometry.stacks import cylinder, lobed_cylinder
from lobefem.model.cables import Hoops
from lobefem.model.end_plates import EndPlates
from lobefem.model.film import Isotropic
from lobefem.model.fixed_wrinkles import FixedWrinkles
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.supports import Fixed
from lobefem.model.tension_field import TensionField
from lobefem.stability.cyclic import Sector
from lobefem.stability.harmonic_buckling import harmonic_pressures
from lobefem.stability.linear_buckling import critical_pressure
from lobefem.stability.modes import find_modes
from lobefem.stability.sector_modes import modes_of_harmonics
from lobefem.viz import film_mesh

from mpi4py import MPI


def rotation(axis, degrees):
    a, (x, y, z) = np.radians(degrees), np.array(axis) / np.linalg.norm(axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(a) * K + (1 - np.cos(a)) * K @ K


PLACES = {
    "sideways": (np.eye(3), (3.0, 0.0, 0.0)),
    "up": (np.eye(3), (0.0, 0.0, 7.0)),
    "along x": (rotation((0, 1, 0), 90), (0.0, 0.0, 0.0)),
    "about itself": (rotation((0, 0, 1), 100), (0.0, 0.0, 0.0)),
    "anywhere": (rotation((1, 2, -0.5), 77), (-11.0, 2.5, 40.0)),
}


def moved(surface, where):
    """The surface with its nodes taken elsewhere by hand; its axis is for its rims to tell."""
    Q, shift = PLACES[where]
    surface.mesh.geometry.x[:] = surface.mesh.geometry.x @ Q.T + shift
    return replace(surface, axis=None)


def stack(comm, where=None, divisions=(4, 8), film=None, support="clamped", load="closed", **kw):
    built_in = kw.pop("prestressed", False)
    surface = lobed_cylinder(2, divisions, comm=comm, **kw)
    surface = moved(surface, where) if where else surface
    parts = [GasPressure(load), Hoops(), EndPlates(support)]
    return Balloon(surface, film or TensionField(), parts, prestressed=built_in)


@pytest.fixture(scope="module")
def at_home():
    return numbers(MPI.COMM_WORLD, None)


def numbers(comm, where):
    """Numbers of an inflated stack with the names of its modes."""
    state = inflate(stack(comm, where), 5.0)
    modes = find_modes(state, 6)
    found = [state.volume, state.max_displacement, *state.hoop_tension, state.strain_energy, state.bar_force]
    return [*found, *modes.values.real], [(mode.kind, mode.harmonic) for mode in modes.modes]


@pytest.mark.parametrize("where", PLACES)
def test_an_inflated_stack_is_the_same_anywhere(comm, where, at_home):
    found, names = numbers(comm, where)
    np.testing.assert_allclose(found, at_home[0], rtol=1e-8)
    assert names == at_home[1]


def test_the_axis_may_stay_as_given_where_a_surface_is_shifted_alone(comm, at_home):
    surface = lobed_cylinder(2, (4, 8), comm=comm)
    surface.mesh.geometry.x[:, 0] += 3.0
    parts = [GasPressure("closed"), Hoops(), EndPlates()]
    for one in (surface, replace(surface, origin=(3.0, 0.0, 2.0)), replace(surface, axis=(0, 0, 2))):
        state = inflate(Balloon(one, TensionField(), parts), 5.0)
        np.testing.assert_allclose([state.volume, *state.hoop_tension], at_home[0][0:3:2], rtol=1e-9)


@pytest.mark.parametrize("diagonals", ["same", "alternating"])
@pytest.mark.parametrize("load", ["closed", "film"])
def test_single_harmonics_are_those_of_the_full_model_anywhere(comm, diagonals, load):
    """Built-in stress depends on the distance from the axis; plates sway and tilt with n = 1 and 0."""
    kind = {"film": FixedWrinkles(), "prestressed": True, "support": "pinned", "load": load}
    home = stack(comm, diagonals=diagonals, **kind)
    there = stack(comm, "anywhere", diagonals=diagonals, **kind)
    assert there.reference_volume == pytest.approx(home.reference_volume, rel=1e-12)
    charts = [harmonic_pressures(balloon, comm=comm) for balloon in (home, there)]
    np.testing.assert_allclose(charts[1].pressures, charts[0].pressures, rtol=1e-8)
    assert charts[1].kinds == charts[0].kinds
    found = critical_pressure(there)
    assert found.pressure == pytest.approx(critical_pressure(home).pressure, rel=1e-8)
    assert found.pressure == pytest.approx(critical_pressure(there, full=True).pressure, rel=1e-8)


@pytest.mark.parametrize("diagonals", ["same", "alternating"])
@pytest.mark.parametrize("where", ["about itself", "anywhere"])
def test_modes_of_single_harmonics_solve_the_full_problem_anywhere(comm, where, diagonals):
    """Also the vectors: plates and nodes move together as the sector's do."""
    state = inflate(stack(comm, where, film=Isotropic(), diagonals=diagonals), 5.0)
    balloon, q = state.balloon, state.restore()
    K, M = balloon.tangent(q), balloon.mass(q)
    sector = Sector(balloon)
    restricted = sector.restrict(balloon, q)
    sector.balloon.set_loads(state.pressure, state.prestress)
    one = {"mass": "unit", "scale": 1e-2, "comm": comm}
    for found in modes_of_harmonics(sector, restricted, range(4), 9, **one):
        for x in sector.expand(balloon, found.vector, found.harmonic):
            left, right = x.duplicate(), x.duplicate()
            K.mult(x, left)
            M.mult(x, right)
            size = left.norm()
            left.axpy(-found.value.real, right)
            assert left.norm() <= 1e-6 * size  # both zero: n = 0 has no imaginary part


@pytest.mark.parametrize("kind", [Tip(0.02), Twist(2.0), Bend(1.0), Wave(2, 0.01)], ids=str)
def test_distortions_are_the_same_anywhere(comm, kind):
    """What is pushed along x at home is pushed along e1, across the axis, elsewhere."""
    forces = []
    for where in (None, "sideways", "anywhere"):
        state = inflate(stack(comm, where, film=Isotropic()), 5.0)
        found = distort(state, kind, steps=1)
        forces.append(
            [
                found.reaction,
                found.state.strain_energy,
                mid_hoop_displacement(state.balloon, found.state.displacement),
            ]
        )
    np.testing.assert_allclose(forces[1], forces[0], rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(forces[2][:2], forces[0][:2], rtol=1e-6)


def test_held_rims_without_plates_and_their_stresses(comm):
    """The film's part of the volume counts from the axis at the bottom rim."""
    found = []
    for where in (None, "anywhere"):
        surface = lobed_cylinder(1, (4, 9), comm=comm)
        surface = moved(surface, where) if where else surface
        parts = [GasPressure("closed"), Fixed("rim_bottom"), Fixed("rim_top")]
        state = inflate(Balloon(surface, Isotropic(), parts), 5.0)
        N = true_resultants(state.balloon).x.array.reshape(-1, 3)
        found.append([state.volume, state.strain_energy, comm.allreduce(np.abs(N).max(), op=MPI.MAX)])
    np.testing.assert_allclose(found[1], found[0], rtol=1e-8)


def test_the_coarser_mesh_stands_where_the_finer_one_does(comm):
    off = []
    for where in (None, "anywhere"):
        fine = stack(comm, where, (8, 16), Isotropic())
        coarse = grid_sequencing.coarser_balloon(fine, above=0)
        state = inflate(coarse, 5.0)
        exact = inflate(fine, 5.0)
        fine.set_unknowns(grid_sequencing.interpolate(coarse, state.vector(), fine))
        own = fine.map.owned
        error = (fine.u.x.array[:own] - exact.displacement.ravel()[:own]).reshape(-1, 3)
        off.append(comm.allreduce(np.linalg.norm(error, axis=1).max(initial=0.0), op=MPI.MAX))
    assert off[1] == pytest.approx(off[0], rel=1e-5)


def test_a_form_is_found_anywhere(comm):
    forms = []
    for where in (None, "anywhere"):
        surface = cylinder(2.0, 4.19, (6, 9), comm=comm)
        forms.append(find_form(moved(surface, where) if where else surface, 10.0))
    assert pytest.approx(forms[0].shape.R0, rel=1e-9) == forms[1].shape.R0
    assert forms[1].distance == pytest.approx(forms[0].distance, rel=1e-6)


def test_pictures_are_drawn_about_the_axis(comm):
    skins = [film_mesh.gather(stack(comm, where)) for where in (None, "anywhere")]
    if comm.rank == 0:
        assert skins[1].height == pytest.approx(skins[0].height, rel=1e-10)
        assert skins[1].diameter == pytest.approx(skins[0].diameter, rel=0.05)
        for one, other in zip(film_mesh.outline(skins[0]), film_mesh.outline(skins[1]), strict=True):
            np.testing.assert_allclose(other - other[0], one - one[0], atol=1e-9)


def test_nodes_of_a_rim_that_were_moved_by_hand_leave_the_axis_in_its_place(comm):
    surface = lobed_cylinder(1, (4, 8), comm=comm)
    x = surface.mesh.geometry.x
    x[np.isclose(x[:, 2], 0.0) & (x[:, 0] > 1.9)] *= [1.05, 1.0, 1.0]
    for axis in ((0, 0, 1), None):
        found = Balloon(replace(surface, axis=axis), Isotropic(), [EndPlates()]).axis
        np.testing.assert_array_equal(found.origin, 0.0)
        np.testing.assert_array_equal(found.direction, [0, 0, 1])
