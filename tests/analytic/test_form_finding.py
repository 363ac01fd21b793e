"""Form finding (paper figs 8-10): the inflated cylinder, its closed form, and its use as a design."""

import numpy as np
import pytest

from lobefem.equilibrium.form_finding import find_form, row_means
from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.state import ideal_state
from lobefem.fem.balloon import Balloon
from lobefem.geometry.isotensoid import Isotensoid
from lobefem.geometry.natural_shape import NaturalShape
from lobefem.geometry.stacks import cylinder, lobed_cylinder
from lobefem.model.cables import Hoops
from lobefem.model.end_plates import EndPlates
from lobefem.model.film import Isotropic
from lobefem.model.fixed_wrinkles import FixedWrinkles
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.tension_field import TensionField
from lobefem.stability.linear_buckling import critical_pressure
from lobefem.stability.modes import find_modes

pytestmark = pytest.mark.serial

DESIGN = Isotensoid.from_edge_radius()
RADIUS, LENGTH = 2.0, DESIGN.height
PAPER = (0.75, 10.0, 37.5)  # [Pa], figs 9a-c


def formed(pressure, divisions=(24, 32), **mesh):
    return find_form(cylinder(RADIUS, LENGTH, divisions, **mesh), pressure)


@pytest.fixture(scope="module")
def forms():
    return {p: formed(p) for p in PAPER}


def balloon(surface, film=None, *, plates=None, load="film"):
    parts = [GasPressure(load), Hoops(), plates or EndPlates()]
    return Balloon(surface, film or FixedWrinkles(), parts, prestressed=True)


@pytest.mark.parametrize("pressure", PAPER)
def test_three_shapes_of_the_cylinder(forms, pressure):
    """Nodes within 0.5 % of R0 of the elliptic meridian, N_phi R within 0.5 %, no hoop stress."""
    form = forms[pressure]
    exact = NaturalShape.inflated(RADIUS, LENGTH, form.Et, pressure)
    s = exact.stations(24)
    state = form.state
    X = state.balloon.V.tabulate_dof_coordinates()
    x = X + state.displacement
    belongs = s[np.rint(X[:, 2] / LENGTH * 24).astype(int)]
    off = np.hypot(
        np.hypot(x[:, 0], x[:, 1]) - exact.radius(belongs), x[:, 2] - LENGTH / 2 - exact.z(belongs)
    )
    assert off.max(initial=0.0) < 1.5e-3 * exact.R0  # the facets of 32 divisions hold 0.6 % less gas
    assert form.distance < 1e-4 * exact.R0
    tension = form.tension / pressure
    assert np.ptp(tension) < 0.005 * tension.mean()
    np.testing.assert_allclose(tension, exact.meridional_tension, rtol=0.01)
    # none at all along the fibres' own hoops; the plane facets turn against the fibres by a little
    assert np.abs(form.N_theta).max() < 0.01 * form.N_phi.max()
    assert np.abs(state.stress_resultants().x.array.reshape(-1, 3)[:, 1:]).max(initial=0.0) < 1e-9


def test_37_5_pascals_form_the_isotensoid(forms):
    """Paper fig. 9c: E t is chosen so; fig. 10: sigma_phi along s within 1 % of eq. 4."""
    form = forms[37.5]
    assert form.Et == pytest.approx(187.49, abs=0.01)
    s = form.s / form.shape.arc_length * DESIGN.arc_length
    np.testing.assert_allclose(form.shape.radius(form.s), DESIGN.radius(s), atol=0.005 * DESIGN.R0)
    eq_4 = 37.5 * DESIGN.radius(s) / (2 * np.sin(DESIGN.angle(s)))
    np.testing.assert_allclose(form.N_phi, eq_4, rtol=0.01)


def test_shapes_of_less_pressure_are_no_isotensoids(forms):
    """Taller than the isotensoid through their rims would be; only that one needs no bar."""
    radii = [forms[p].shape.R0 for p in PAPER]
    np.testing.assert_allclose(radii, [2.410, 3.060, 3.809], rtol=2e-3)
    excess = [forms[p].shape.axial_excess / (np.pi * RADIUS**2) for p in PAPER]
    assert excess[0] > excess[1] > 10 * abs(excess[2])


@pytest.mark.parametrize(
    ("mesh", "order"),
    [({}, 2), ({"cell": "quadrilateral"}, 2), ({"cell": "quadrilateral", "order": 2}, 4)],
    ids=["P1", "Q1", "Q2"],
)
def test_the_form_converges_to_the_closed_form(comm, mesh, order):
    along = np.array([6, 12] if "order" in mesh else [8, 16])
    errors = [abs(formed(37.5, (n, 2 * n), comm=comm, **mesh).shape.R0 / DESIGN.R0 - 1) for n in along]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.35)


@pytest.mark.parametrize("film", [FixedWrinkles(), TensionField(), Isotropic()])
@pytest.mark.parametrize("pressure", [0.75, 37.5])
def test_form_then_analyse(forms, film, pressure):
    """At 5 Pa the formed lobe is in equilibrium as it is, up to the mesh: a second-order residual."""
    residuals = []
    for divisions in ((12, 16), (24, 32)):
        surface = forms[pressure].surface(1, divisions)
        state = ideal_state(balloon(surface, film, plates=EndPlates(support="fixed")), 5.0)
        residuals.append(state.relative_residual)
    assert residuals[1] < 0.01
    assert residuals[1] < 0.3 * residuals[0]


def test_stress_of_the_formed_lobe_at_5_pascals(forms):
    """Fig. 10 at the paper's 5 Pa, in equilibrium with the design's film: N_phi within 1 % of eq. 4."""
    surface = forms[37.5].surface()
    state = inflate(balloon(surface, plates=EndPlates(support="fixed")), 5.0)
    assert state.converged
    assert state.max_displacement < 0.005 * DESIGN.R0
    (N,) = row_means(state)
    s = DESIGN.stations(24)
    s = (s[1:] + s[:-1]) / 2
    np.testing.assert_allclose(N[:, 0], DESIGN.meridional_resultant(5.0, DESIGN.radius(s)), rtol=0.01)
    np.testing.assert_allclose(N[:, 0] * DESIGN.radius(s), (N[:, 0] * DESIGN.radius(s)).mean(), rtol=0.0025)
    assert np.abs(N[:, 1:]).max() < 0.01 * N[:, 0].max()


@pytest.mark.parametrize("pressure", [0.75, 10.0, 37.5])
@pytest.mark.parametrize("load", ["film", "closed"])
@pytest.mark.parametrize("bar", [True, 2.15e9], ids=["rigid", "elastic"])
def test_a_stack_of_formed_lobes_is_in_equilibrium(forms, pressure, load, bar):
    """Hoops and bar carry what free bodies say, also where the film pulls harder than the gas pushes."""
    shape = forms[pressure].shape
    residuals = []
    for divisions in ((8, 16), (16, 32)):
        stack = balloon(forms[pressure].surface(3, divisions), plates=EndPlates(bar=bar), load=load)
        state = ideal_state(stack, 5.0)
        residuals.append(state.relative_residual)
        np.testing.assert_allclose(state.hoop_tension, shape.seam_tension(5.0), rtol=1e-12)
    assert residuals[1] < 0.55 * residuals[0]  # first order, from the facets at plates and seams
    gas = np.pi * RADIUS**2
    pull = gas + shape.axial_excess
    expected = -5.0 * (pull if load == "film" else shape.axial_excess)
    assert state.bar_force == pytest.approx(expected, abs=0.02 * 5.0 * pull)


def test_modes_and_critical_pressure_are_those_of_the_isotensoid(forms):
    """Formed on 24 x 32 and analysed on 12 x 16, beside the exact isotensoid on the same mesh."""
    found = balloon(forms[37.5].surface(1, (12, 16)))
    exact = balloon(lobed_cylinder(1, (12, 16)))
    values = [find_modes(ideal_state(b, 5.0), 5).values.real for b in (found, exact)]
    np.testing.assert_allclose(values[0], values[1], rtol=0.01)
    pressures = [critical_pressure(b).pressure for b in (found, exact)]
    assert pressures[0] == pytest.approx(pressures[1], rel=0.01)
