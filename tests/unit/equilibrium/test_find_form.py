"""Form finding: what it returns, what it refuses, and the surfaces that it gives."""

import tomllib

import numpy as np
import pytest

from lobefem.equilibrium.form_finding import find_form, row_means
from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.state import ideal_state, placed_state
from lobefem.errors import ConvergenceError, InputError
from lobefem.fem.balloon import Balloon
from lobefem.fem.functionals import stress_resultants, true_resultants
from lobefem.geometry.stacks import cylinder, lobed_cylinder
from lobefem.io.design import Design
from lobefem.model.end_plates import EndPlates
from lobefem.model.fixed_wrinkles import FixedWrinkles
from lobefem.model.gas_pressure import GasPressure

from mpi4py import MPI


@pytest.fixture(scope="module")
def form():
    return find_form(cylinder(2.0, 4.19, (8, 12)), 10.0)


def test_a_form_holds_the_equilibrium_and_its_lobe(form):
    assert form.pressure == form.state.pressure == 10.0
    assert form.state.converged
    assert form.state.steps == (10.0,)  # one solve, from the shallow bulge
    assert form.state.balloon.film.Et == pytest.approx(form.Et)
    assert form.state.balloon.film.slack_stiffness == 0.0
    assert form.s.shape == form.N_phi.shape == form.N_theta.shape == form.tension.shape == (8,)
    np.testing.assert_allclose(form.s, -form.s[::-1], atol=1e-12)
    assert form.shape.edge_radius == pytest.approx(2.0, rel=1e-12)
    assert form.shape.height == pytest.approx(4.19, rel=1e-12)


def test_distance_is_that_of_the_nodes_from_their_places(form):
    x = form.state.balloon.V.tabulate_dof_coordinates() + form.state.displacement
    step = np.rint(form.state.balloon.V.tabulate_dof_coordinates()[:, 2] / 4.19 * 8).astype(int)
    s = form.shape.stations(8)[step]
    off = np.hypot(np.hypot(x[:, 0], x[:, 1]) - form.shape.radius(s), x[:, 2] - 2.095 - form.shape.z(s))
    comm = form.state.balloon.comm
    assert comm.allreduce(off.max(initial=0.0), op=MPI.MAX) == pytest.approx(form.distance, rel=1e-9)


def test_the_form_is_the_same_on_any_number_of_ranks(form):
    alone = find_form(cylinder(2.0, 4.19, (8, 12), comm=MPI.COMM_SELF), 10.0)
    assert form.shape.m == pytest.approx(alone.shape.m, rel=1e-9)
    assert form.distance == pytest.approx(alone.distance, rel=1e-6)
    np.testing.assert_allclose(form.N_phi, alone.N_phi, rtol=1e-9)
    np.testing.assert_allclose(form.N_theta, alone.N_theta, rtol=1e-9)


def test_surfaces_of_a_form_have_its_shape_in_any_number_and_mesh(form, comm):
    one, stack = form.surface(), form.surface(3, (4, 10), cell="quadrilateral", order=2)
    assert (one.num_lobes, one.divisions) == (1, (24, 32))
    assert (stack.num_lobes, stack.divisions) == (3, (4, 10))
    assert one.shape == stack.shape == form.shape
    assert "seam_2" in stack.groups
    x = stack.mesh.geometry.x
    top = comm.allreduce(x[:, 2].max(initial=0.0), op=MPI.MAX)
    assert top == pytest.approx(3 * form.shape.height)
    widest = comm.allreduce(np.hypot(x[:, 0], x[:, 1]).max(initial=0.0), op=MPI.MAX)
    assert widest == pytest.approx(form.shape.R0, rel=1e-12)
    free = form.surface(1, layout="unstructured", size=0.8)
    assert free.divisions is None


def test_a_stiffer_film_gives_a_flatter_lobe(form, comm):
    stiff = find_form(cylinder(2.0, 4.19, (8, 12), comm=comm), 10.0, Et=2 * form.Et)
    assert stiff.Et == 2 * form.Et
    assert 2.0 < stiff.shape.R0 < form.shape.R0
    assert stiff.shape.meridional_tension > form.shape.meridional_tension


def test_a_placed_state_keeps_what_is_held(comm):
    surface = cylinder(2.0, 4.0, (3, 8), comm=comm)
    balloon = Balloon(surface, FixedWrinkles(), [GasPressure("film"), EndPlates(support="fixed")])
    X = balloon.V.tabulate_dof_coordinates()
    state = placed_state(balloon, 0.5 * X)
    inside = (X[:, 2] > 1e-9) & (X[:, 2] < 4.0 - 1e-9)
    np.testing.assert_allclose(state.displacement, 0.5 * X * inside[:, None], atol=1e-14)
    assert (state.converged, state.pressure, state.prestress) == (False, 0.0, 0.0)
    assert state.residual > 0


def test_true_resultants_of_a_stretched_tube(comm):
    """A tube drawn out by a: force per reference width a E t (a^2 - 1)/2 over the hoop's own stretch b."""
    surface = cylinder(2.0, 4.0, (2, 9), cell="quadrilateral", comm=comm)
    film = FixedWrinkles(E=1e6, thickness=1e-4)
    balloon = Balloon(surface, film, [GasPressure("film"), EndPlates(support="fixed", lift=1.0)])
    a, b = 1.25, 1.5
    # all nodes by hand: rims, too
    X = balloon.V.tabulate_dof_coordinates()
    balloon.u.x.array[:] = (X * [b - 1, b - 1, a - 1]).ravel()
    N = true_resultants(balloon).x.array.reshape(-1, 3)
    np.testing.assert_allclose(N[:, 0], 100.0 * a * (a**2 - 1) / 2 / b, rtol=1e-12)
    np.testing.assert_allclose(N[:, 1:], 0.0, atol=1e-12)
    # the second Piola-Kirchhoff resultant knows nothing of the hoop
    S = stress_resultants(balloon).x.array.reshape(-1, 3)
    np.testing.assert_allclose(S[:, 0], 100.0 * (a**2 - 1) / 2, rtol=1e-12)


@pytest.mark.parametrize(
    ("surface", "options", "message"),
    [
        (lambda: lobed_cylinder(1, (4, 6)), {}, "a form is found from a structured cylinder with even rows"),
        (
            lambda: cylinder(layout="unstructured", size=1.0),
            {},
            "a form is found from a structured cylinder with even rows",
        ),
        (lambda: cylinder(2.0, 4.2, (6, 6), grading=0.2), {}, "with even rows; give lobefem.cylinder("),
        (lambda: cylinder(2.0, 4.2, (4, 6)), {"pressure": 100.0}, "at 100 Pa a film of E t = 187.45 N/m bul"),
        (lambda: cylinder(2.0, 4.2, (4, 6)), {"pressure": 0.0}, "the forming pressure is 0.0; give a posi"),
        (lambda: cylinder(2.0, 4.2, (4, 6)), {"Et": -1.0}, "the film's E t is -1.0; give a positive number"),
    ],
)
def test_what_cannot_be_formed_is_refused(surface, options, message):
    with pytest.raises(InputError) as caught:
        find_form(surface(), **options)
    assert message in str(caught.value)


def test_grading_is_the_lobes_and_not_the_cylinders(comm):
    text = "[shape]\nkind = 'formed'\nlobes = 2\nforming_pressure = 20.0\n[mesh]\ndivisions = [12, 8]\n"
    even, graded = (Design.parse(tomllib.loads(f"{text}grading = {g}")).surface(comm) for g in (0.0, 0.3))
    assert graded.shape == even.shape
    assert graded.grading == 0.3


@pytest.mark.slow
def test_a_mesh_too_coarse_for_a_lobe_is_told_with_its_state(comm):
    with pytest.raises(ConvergenceError, match=r"off every lobe without hoop stress; try more div") as caught:
        find_form(cylinder(2.0, 4.19, (2, 3), order=2, comm=comm), 60.0)
    assert caught.value.state.converged
    assert caught.value.data["distance"] > 0.1


def test_the_start_does_not_choose_the_form(form, comm):
    """From another bulge, half as high, Newton's method finds the same equilibrium."""
    balloon = form.state.balloon
    start = placed_state(balloon, form.state.displacement / 2)
    again = inflate(balloon, 10.0, start=start)
    np.testing.assert_allclose(again.displacement, form.state.displacement, atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("mesh", [{}, {"cell": "quadrilateral", "order": 2}, {"diagonals": "alternating"}])
def test_row_means_tell_lobes_and_rows_apart(comm, mesh):
    """The ideal state's N_phi = c p/R falls from each edge to each equator."""
    surface = lobed_cylinder(2, (6, 24), comm=comm, **mesh)
    balloon = Balloon(surface, FixedWrinkles(), [EndPlates()], prestressed=True)
    N = row_means(ideal_state(balloon, 5.0))
    assert N.shape == (2, 6, 3)
    np.testing.assert_allclose(N[0], N[1], atol=1e-9)
    s = surface.shape.stations(6)
    R = surface.shape.radius((s[1:] + s[:-1]) / 2)
    np.testing.assert_allclose(N[0, :, 0], surface.shape.meridional_resultant(5.0, R), rtol=0.03)
    np.testing.assert_allclose(N[:, :, 1], 0.0, atol=1e-12)


def test_row_means_need_rows(comm):
    surface = lobed_cylinder(1, layout="unstructured", size=2.0, comm=comm)
    balloon = Balloon(surface, FixedWrinkles(), [EndPlates()], prestressed=True)
    state = ideal_state(balloon, 5.0)
    with pytest.raises(InputError, match="rows of cells need a structured mesh; give divisions"):
        row_means(state)
