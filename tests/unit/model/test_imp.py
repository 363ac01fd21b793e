"""IMP and its prescribed load path: the law at a point, and a balloon made of it."""

import math
from dataclasses import replace

import builders
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from laws import ET, NU, STATES, at, plane_stress, stress, three_way, turn, values, wrinkled_stress
from laws import strains as some_strains
from states import nodes, unknowns, wavy

from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.solver_options import NewtonOptions
from lobefem.errors import InputError
from lobefem.fem.balloon import Balloon
from lobefem.fem.functionals import region_areas
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.linalg import petsc
from lobefem.model.cables import Hoops
from lobefem.model.end_plates import EndPlates, PlateLoad
from lobefem.model.film import Isotropic
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.imp import IMP, PrescribedPath
from lobefem.model.tension_field import TensionField
from lobefem.stability.cyclic import sector_balloon

import ufl

RATIOS = {"taut": (-0.9 * NU, 0.999), "wrinkled": (-5, -1.1 * NU), "slack": (1.001, 5)}


@st.composite
def strains(draw, states=STATES):
    """A strain of one state, its principal values clear of the borders, in any direction."""
    state = draw(st.sampled_from(states))
    major = 10 ** draw(st.floats(-7, -1)) * (-1 if state == "slack" else 1)
    minor = major * draw(st.floats(*RATIOS[state]))
    strain = turn(np.diag([major, minor]), draw(st.floats(0, math.pi)))
    assert three_way(strain) == state
    return state, strain


STRESS = {"taut": plane_stress, "wrinkled": wrinkled_stress, "slack": np.zeros_like}
few = settings(deadline=None, max_examples=40, derandomize=True)


@pytest.mark.slow
@pytest.mark.serial
@few
@given(strains())
def test_imp_is_the_gradient_of_the_tension_field_energy(case):
    state, strain = case
    scale = ET * np.abs(strain).max()
    law, field = IMP(slack_stiffness=0), TensionField(slack_stiffness=0)
    s = stress(law, strain)
    np.testing.assert_allclose(s, stress(field, strain), rtol=0, atol=1e-12 * scale)
    np.testing.assert_allclose(s, STRESS[state](strain), rtol=0, atol=1e-12 * scale)  # eqs. 10, 11
    assert values(law, strain, [0]) == values(field, strain, [0])


@pytest.mark.serial
@pytest.mark.parametrize("state", STATES)
def test_derivative_of_the_stress_is_the_tension_fields_tangent(state):
    for strain, _ in some_strains(state, 2):
        found, expected = at(IMP(slack_stiffness=0), strain), at(TensionField(slack_stiffness=0), strain)
        np.testing.assert_allclose(found[2], expected[2], rtol=0, atol=1e-11 * ET)


@pytest.mark.slow
@pytest.mark.serial
@few
@given(strains(), strains())
def test_secant_holds_the_modulus(case, other):
    """secant(E, H) = D(E) H: linear in H, S at H = E, and symmetric as eqs. 10 and 11 are."""
    (_, E), (_, H) = case, other
    law = IMP(slack_stiffness=1e-3)

    def secant(a, b):
        S = law.secant(ufl.as_matrix(a.tolist()), ufl.as_matrix(b.tolist()))
        return np.array([[float(S[i, j](())) for j in range(2)] for i in range(2)])

    size = ET * np.abs(E).max()
    np.testing.assert_allclose(secant(E, E), stress(law, E), rtol=0, atol=1e-12 * size)
    both = size * np.abs(H).max()
    assert (secant(E, H) * E).sum() == pytest.approx((secant(E, E) * H).sum(), rel=0, abs=1e-12 * both)
    double = secant(E, 2 * H + E) - 2 * secant(E, H) - secant(E, E)
    np.testing.assert_allclose(double, 0, atol=1e-12 * ET * (np.abs(H).max() + np.abs(E).max()))


@pytest.mark.serial
@few
@given(strains(), st.sampled_from([0.0, 1e-8, 1e-6, 1e-3]), st.sampled_from([TensionField, IMP]))
def test_compression_is_at_most_the_slack_stiffness_share(case, share, kind):
    _, strain = case
    scale = ET * np.abs(strain).max()
    compression = max(0.0, -np.linalg.eigvalsh(plane_stress(strain))[0])
    carried = -np.linalg.eigvalsh(stress(kind(slack_stiffness=share), strain))[0]
    assert carried <= share * compression + 1e-12 * scale


@pytest.mark.serial
@few
@given(strains())
def test_prescribed_path_is_imp_without_the_hoop_stress_of_taut_film(case):
    state, strain = case
    expected = STRESS[state](strain)
    if state == "taut":
        expected[1, 1] = 0
    atol = 1e-12 * ET * np.abs(strain).max()
    np.testing.assert_allclose(stress(PrescribedPath(slack_stiffness=0), strain), expected, rtol=0, atol=atol)


@pytest.mark.serial
def test_prescribed_path_is_no_gradient_and_jumps():
    law = PrescribedPath(slack_stiffness=0)
    C = at(law, np.diag([1e-3, 1e-4]))[2]
    assert C[0, 0, 1, 1] == pytest.approx(NU * ET / (1 - NU**2), rel=1e-12)
    assert C[1, 1, 0, 0] == 0
    assert law.energy(ufl.as_matrix([[1e-3, 0], [0, 0]])) is None
    # taut | wrinkled: no jump where the wrinkles run along the meridian; else S_22 goes to zero
    for angle, jump in ((0.0, 0.0), (0.4, 1e-3 * ET * math.sin(0.4) ** 2)):
        minor = -NU * 1e-3
        wrinkled, taut = (stress(law, turn(np.diag([1e-3, minor + h]), angle)) for h in (-1e-12, 1e-12))
        difference = wrinkled - taut
        np.testing.assert_allclose(difference, [[0, 0], [0, jump]], rtol=1e-6, atol=1e-6)


@pytest.mark.slow
@pytest.mark.serial
@few
@given(
    st.floats(-6, -2), st.floats(-5, 0.999), st.sampled_from([0.0, 1e-6, 1e-3]), st.sampled_from([0, 1e-4])
)
def test_the_standard_law_takes_over_what_the_path_carries(size, ratio, share, slack):
    """E + E0 under the tension-field law has the path's stress at E, taut or wrinkled."""
    strain = np.diag([10**size, ratio * 10**size])
    path, law = PrescribedPath(slack_stiffness=share), TensionField(slack_stiffness=share)
    E0 = path.removed_strain(ufl.as_matrix(strain.tolist()), hoop_slack=slack)
    E0 = np.array([[float(E0[i, j](())) for j in range(2)] for i in range(2)])
    if ratio < -NU:
        np.testing.assert_array_equal(E0, 0)
    found = stress(law, strain + E0)
    # film that hangs slack in its hoops loses the share of their stress
    largest = np.abs(strain).max()
    atol = ET * (1e-12 * largest + (1.5 * share * (slack + largest) if slack else 0))
    np.testing.assert_allclose(found, stress(path, strain), rtol=0, atol=atol)


# --- balloons ------------------------------------------------------------------------------------


def stack(comm, film, surface=None, load="film", EA=2.15e9, **given):
    given = {"support": "pinned", "bar": EA, "cell": "quadrilateral", **given}
    return builders.stack(comm, film, load, surface=surface, EA=EA, **given)


def strained(balloon):
    """Unknowns with film of all three states."""
    balloon.set_loads(2e4)
    q = unknowns(balloon, 0.03 * wavy(nodes(balloon), 12, 2.0), 0.02)
    balloon.set_unknowns(q)
    assert min(region_areas(balloon)) > 1
    return q


@pytest.mark.slow
def test_residual_and_tangent_are_those_of_the_tension_field(comm):
    surface = lobed_cylinder(2, (4, 8), cell="quadrilateral", comm=comm)
    found = []
    for film in (TensionField(), IMP(), IMP(tangent="secant")):
        balloon = stack(comm, film, surface, load="closed", EA=2e5)
        q = strained(balloon)
        r = q.duplicate()
        balloon.residual(q, r)
        found.append((r, balloon.tangent(q).copy(), balloon.tangent(q, iteration=True).copy()))
        assert petsc.asymmetry(found[-1][1]) < 1e-12
    (r, K, _), *others = found
    for other, tangent, iteration in others:
        other.axpy(-1.0, r)
        assert other.norm() < 1e-11 * r.norm()
        iteration.axpy(-1.0, tangent)
        tangent.axpy(-1.0, K)
        assert tangent.norm() < 1e-11 * K.norm()
    # the last one iterates with the secant, which is another matrix
    assert iteration.norm() > 1e-2 * K.norm()


def test_tangent_of_the_prescribed_path_is_its_residuals_derivative(comm):
    # a hoop of the film's own stiffness and a load with a potential: what is left is the film's
    balloon = stack(comm, PrescribedPath(), load="closed", EA=2e5)
    q = strained(balloon)
    d = unknowns(balloon, wavy(nodes(balloon), 5), 0.5)
    Kd, errors = q.duplicate(), []
    balloon.tangent(q).mult(d, Kd)
    for h in (1e-7, 1e-8):
        sides = []
        for step in (-h, h):
            moved, r = q.copy(), q.duplicate()
            moved.axpy(step, d)
            balloon.residual(moved, r)
            sides.append(r)
        sides[1].axpy(-1.0, sides[0])
        sides[1].axpy(-2 * h, Kd)
        errors.append(sides[1].norm() / (2 * h * Kd.norm()))
    assert min(errors) < 1e-6
    assert petsc.asymmetry(balloon.tangent(q)) > 1e-3


def test_prescribed_path_sets_up_meridional_stress_and_the_standard_law_keeps_it(comm):
    balloon = stack(comm, PrescribedPath())
    path = inflate(balloon, 5.0)
    assert path.steps == (5.0,)
    assert path.strain_energy is None
    with pytest.raises(InputError, match=r"^PrescribedPath film has no energy; switch to TensionField film"):
        balloon.energy(path.vector())

    def resultants(state):
        return state.stress_resultants().x.array.reshape(-1, 3).copy()

    N = resultants(path)
    assert N[:, 0].min() > 9
    assert np.abs(N[:, 1]).max() < 1e-4  # the share of the hoop stress that is left out
    kept = stack(comm, TensionField(), balloon.surface, load_path=path)
    state = inflate(kept, 5.0, start=path)
    assert state.converged
    # a shear stress inside the facets keeps the two from agreeing to the last digit
    np.testing.assert_allclose(resultants(state)[:, 0], N[:, 0], rtol=5e-3)
    np.testing.assert_allclose(resultants(state)[:, 1], 0, atol=5e-3 * N[:, 0].max())
    assert state.volume == pytest.approx(path.volume, rel=1e-6)
    # without the built-in strain the hoop stress comes back
    bare = inflate(stack(comm, TensionField(), balloon.surface), 5.0, start=path)
    assert resultants(bare)[:, 1].min() > 1


def test_hoop_slack_is_part_of_a_load_paths_stress(comm):
    """Film that took over a path hangs slack in its hoops by what it was told, where it is taut."""
    path = inflate(stack(comm, PrescribedPath()), 5.0)
    means = []
    for slack in (0.0, 1e-3):
        balloon = stack(comm, TensionField(), path.balloon.surface, load_path=path, hoop_slack=slack)
        balloon.u.x.array[:] = path.displacement.ravel()
        strain, dx = balloon.forms.strain, balloon.dx
        means.append([balloon.integrate(strain[i, i] * dx) / balloon.reference_area for i in range(2)])
    (along, hoop), (same, less) = means
    assert same == pytest.approx(along, rel=1e-12)
    taut = path.taut_area / path.balloon.reference_area
    assert taut > 0.1
    assert less - hoop == pytest.approx(-1e-3 * taut, rel=1e-6)


def test_where_all_film_is_taut_the_secant_is_the_tangent(comm):
    """Eq. 10's modulus does not depend on the strain; the stress stiffens the film in both."""
    surface = lobed_cylinder(2, (4, 8), cell="quadrilateral", comm=comm)
    balloon = Balloon(surface, IMP(tangent="secant"), [GasPressure("closed"), Hoops(2e5)])
    q = unknowns(balloon, 0.02 * nodes(balloon))
    balloon.set_loads(100.0)
    balloon.set_unknowns(q)
    assert region_areas(balloon)[0] == pytest.approx(balloon.reference_area)
    tangent, secant = balloon.tangent(q).copy(), balloon.tangent(q, iteration=True).copy()
    secant.axpy(-1.0, tangent)
    assert secant.norm() < 1e-11 * tangent.norm()


def test_secant_needs_more_iterations_than_the_consistent_tangent(comm):
    path = inflate(stack(comm, PrescribedPath()), 5.0)
    surface, counts, volumes = path.balloon.surface, [], []
    for tangent in ("consistent", "secant"):
        balloon = stack(comm, IMP(tangent=tangent), surface, load_path=path, hoop_slack=1e-4)
        state = inflate(balloon, 5.0, start=path, options=NewtonOptions(max_iterations=100))
        assert state.steps == (5.0,)
        counts.append(state.iterations)
        volumes.append(state.volume)
    assert counts[1] > 2 * counts[0]
    assert volumes[1] == pytest.approx(volumes[0], rel=1e-9)


def test_load_path_must_fit(comm):
    surface = lobed_cylinder(2, (2, 4), comm=comm)
    path = inflate(stack(comm, PrescribedPath(slack_stiffness=1e-3), surface), 1.0)
    with pytest.raises(InputError, match=r"^the film gets its stress from the load path or by prestress"):
        stack(comm, TensionField(), surface, load_path=path, prestressed=True)
    with pytest.raises(InputError, match=r"^load_path is a state on another mesh"):
        stack(comm, TensionField(), divisions=(2, 4), load_path=path)
    other = replace(path, balloon=stack(comm, Isotropic(), surface))
    with pytest.raises(
        InputError, match=r"^load_path is a state of Isotropic film; give one .* PrescribedPath"
    ):
        stack(comm, TensionField(), surface, load_path=other)
    for film, text in (
        (TensionField(E=2e9), r"E = 3500000000\.0, and this film has 2000000000\.0"),
        (TensionField(nu=0.2), r"nu = 0\.3, and this film has 0\.2"),
        (Isotropic(thickness=2e-5), r"thickness = 5e-05, and this film has 2e-05"),
    ):
        with pytest.raises(InputError, match=rf"^load_path is of film with {text}; give both the same$"):
            stack(comm, film, surface, load_path=path)
    film = PrescribedPath(slack_stiffness=1e-3)
    for built_in in ({"prestressed": True}, {"load_path": path}):
        with pytest.raises(InputError, match=r"^PrescribedPath film finds its stress from unstressed film"):
            stack(comm, film, surface, **built_in)
    with pytest.raises(InputError, match=r"^load_path is a float; give a state"):
        stack(comm, TensionField(), surface, load_path=5.0)


def test_a_single_harmonic_has_no_load_path(comm):
    surface = lobed_cylinder(2, (2, 4), comm=comm)
    path = inflate(stack(comm, PrescribedPath(slack_stiffness=1e-3), surface), 1.0)
    for balloon in (
        stack(comm, TensionField(), surface, load_path=path),
        Balloon(surface, TensionField(), [EndPlates(), PlateLoad((0, 0, 1))]),
    ):
        with pytest.raises(InputError, match=r"^a single harmonic is of the shape as drawn; leave load_path"):
            sector_balloon(balloon)


@pytest.mark.serial
def test_tangent_is_one_of_two_words():
    with pytest.raises(InputError, match=r"^tangent is 'newton'; give 'consistent' or 'secant'"):
        IMP(tangent="newton")
