"""Film laws: stress and tangent against closed forms, at the strain of a point."""

import math

import numpy as np
import pytest
from laws import ET, NU, STATES, at, plane_stress, strains, turn, wrinkled_stress

from lobefem.errors import InputError
from lobefem.model.film import Isotropic
from lobefem.model.fixed_wrinkles import FixedWrinkles
from lobefem.model.laws import FILMS
from lobefem.model.tension_field import TensionField, WrinkledField

import ufl

pytestmark = pytest.mark.serial


@pytest.mark.slow
@pytest.mark.parametrize("state", STATES)
def test_tension_field_stress_is_the_three_way_test(state):
    stress = {"taut": plane_stress, "wrinkled": wrinkled_stress, "slack": np.zeros_like}[state]
    law = TensionField(slack_stiffness=0)
    for strain, _ in strains(state):
        w, s, _ = at(law, strain)
        scale = ET * np.abs(strain).max()
        np.testing.assert_allclose(s, stress(strain), rtol=0, atol=1e-12 * scale)
        # homogeneous of degree 2, so that w = S : E/2 in every state
        assert w == pytest.approx((s * strain).sum() / 2, rel=1e-12, abs=1e-14 * scale**2 / ET)


@pytest.mark.slow
@pytest.mark.parametrize("state", STATES)
def test_tension_field_tangent_in_principal_axes(state):
    """diag(E t, 0, N1/(2(e1 - e2))) on (11, 22, gamma) when wrinkled: eq. 11 is the secant only."""
    law = TensionField(slack_stiffness=0)
    for strain, angle in strains(state):
        C = turn(at(law, strain)[2], -angle)
        e1, e2 = np.linalg.eigvalsh(strain)[::-1]
        D = np.array([[C[a][b] for b in ((0, 0), (1, 1), (0, 1))] for a in ((0, 0), (1, 1), (0, 1))])
        expected = {
            "taut": ET / (1 - NU**2) * np.array([[1, NU, 0], [NU, 1, 0], [0, 0, (1 - NU) / 2]]),
            "wrinkled": np.diag([ET, 0, ET * e1 / (2 * (e1 - e2))]),
            "slack": np.zeros((3, 3)),
        }[state]
        np.testing.assert_allclose(D, expected, rtol=0, atol=1e-11 * ET)


def test_one_sided_tangents_at_the_boundary_of_taut_and_wrinkled():
    """C_t - C_w = E t/(1 - nu^2) a a^T, a = (nu, 1, 0): both have the isotropic shear stiffness."""
    strain = np.diag([2e-3, -NU * 2e-3])
    energy, stress, C = at(WrinkledField(slack_stiffness=0.0), strain)
    taut_energy, taut_stress, D = at(Isotropic(), strain)
    assert energy == pytest.approx(taut_energy, rel=1e-12)
    np.testing.assert_allclose(stress, taut_stress, atol=1e-12 * ET)
    a = np.diag([NU, 1.0])
    np.testing.assert_allclose(D - C, ET / (1 - NU**2) * np.multiply.outer(a, a), atol=1e-10 * ET)
    assert C[0, 0, 0, 0] == pytest.approx(ET)
    assert C[0, 1, 0, 1] == pytest.approx(ET / (2 * (1 + NU)))


@pytest.mark.slow
def test_wrinkled_field_is_the_tension_field_but_for_taut_film():
    wrinkled, field = WrinkledField(slack_stiffness=1e-3), TensionField(slack_stiffness=1e-3)
    for major, minor, same in ((2e-3, -1e-3, True), (-1e-3, -2e-3, True), (2e-3, 1e-3, False)):
        strain = turn(np.diag([major, minor]), 0.4)
        (w, S, C), (v, T, D) = at(wrinkled, strain), at(field, strain)
        if same:
            assert w == pytest.approx(v, rel=1e-12)
            np.testing.assert_allclose(S, T, atol=1e-12 * ET)
            np.testing.assert_allclose(C, D, atol=1e-10 * ET)
        else:
            assert w < v
    assert np.isfinite(at(wrinkled, np.zeros((2, 2)))[2]).all()


def test_secant_and_tangent_differ_where_the_direction_turns():
    # Et/4 of eq. 11 is the tangent's shear term only where the contraction equals the stretch
    for e2, factor in ((-1e-3, 1 / 4), (-3e-3, 1 / 8), (-0.5e-3, 1 / 3)):
        C = at(TensionField(slack_stiffness=0), np.diag([1e-3, e2]))[2]
        assert C[0, 1, 0, 1] == pytest.approx(ET * factor, rel=1e-12)


@pytest.mark.slow
def test_tension_field_is_continuous_in_stress_between_states():
    law = TensionField(slack_stiffness=0)
    for border, across in (
        (np.diag([1e-3, -NU * 1e-3]), np.diag([0, 1.0])),  # taut | wrinkled
        (np.diag([0.0, -1e-3]), np.diag([1.0, 0])),  # wrinkled | slack
    ):
        low, high = (at(law, border + h * across) for h in (-1e-12, 1e-12))
        np.testing.assert_allclose(low[1], high[1], rtol=0, atol=4e-12 * ET)
        assert np.abs(low[2] - high[2]).max() > 0.5 * ET  # and the tangent jumps


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.0, 1e-6, 1e-4])
def test_unstrained_and_evenly_strained_film_has_no_singular_root(share):
    law = TensionField(slack_stiffness=share)
    isotropic = at(Isotropic(), np.zeros((2, 2)))[2]
    for strain in (np.zeros((2, 2)), 1e-3 * np.eye(2)):
        w, s, C = at(law, strain)
        np.testing.assert_allclose(s, plane_stress(strain), rtol=0, atol=1e-12 * ET)
        np.testing.assert_allclose(C, isotropic, rtol=0, atol=1e-12 * ET)
        assert math.isfinite(w)


@pytest.mark.slow
def test_slack_stiffness_blends_the_isotropic_energy():
    share = 1e-3
    for state in STATES:
        for strain, _ in strains(state, 2):
            blend = at(TensionField(slack_stiffness=share), strain)
            field, isotropic = at(TensionField(slack_stiffness=0), strain), at(Isotropic(), strain)
            for mixed, a, b in zip(blend, field, isotropic, strict=True):
                expected = (1 - share) * a + share * b
                np.testing.assert_allclose(mixed, expected, rtol=0, atol=1e-12 * np.abs(b).max())


def test_isotropic_stress_and_tangent():
    for state in STATES:
        for strain, _ in strains(state, 2):
            _, s, C = at(Isotropic(), strain)
            scale = ET * np.abs(strain).max()
            np.testing.assert_allclose(s, plane_stress(strain), rtol=0, atol=1e-12 * scale)
            np.testing.assert_allclose(np.einsum("abcd,cd->ab", C, strain), s, rtol=0, atol=1e-12 * scale)


def test_fixed_wrinkles_carry_along_the_meridian_only():
    for state in STATES:
        for strain, _ in strains(state, 2):
            w, s, C = at(FixedWrinkles(), strain)
            assert w == pytest.approx(ET * strain[0, 0] ** 2 / 2, rel=1e-12)
            np.testing.assert_allclose(s, [[ET * strain[0, 0], 0], [0, 0]], rtol=1e-12)
            expected = np.zeros((2, 2, 2, 2))
            expected[0, 0, 0, 0] = ET
            np.testing.assert_allclose(C, expected, rtol=1e-12)


def test_fixed_wrinkles_along_the_hoop_carry_there_only():
    """The law along the meridian with the frame's axes exchanged."""
    swap = np.array([[0.0, 1.0], [1.0, 0.0]])
    for share in (0.0, 1e-3):
        along = FixedWrinkles(slack_stiffness=share)
        across = FixedWrinkles(slack_stiffness=share, direction="hoop")
        for state in STATES:
            for strain, _ in strains(state, 2):
                w, s, C = at(along, strain)
                other = at(across, swap @ strain @ swap)
                assert other[0] == pytest.approx(w, rel=1e-12)
                np.testing.assert_allclose(other[1], swap @ s @ swap, rtol=1e-12, atol=1e-12 * abs(s).max())
                np.testing.assert_allclose(other[2], np.flip(C), rtol=1e-12, atol=1e-12 * ET)
    for e, slack in ((1e-3, 0.0), (-1e-3, 1.0)):
        regions = FixedWrinkles(direction="hoop").regions(ufl.as_matrix([[-e, 0], [0, e]]))
        assert [float(region(())) for region in regions] == [0.0, 1.0 - slack, slack]


def test_fixed_wrinkles_along_the_hoop_refuse_meridional_stress():
    film = FixedWrinkles(direction="hoop")
    assert film.shares is None
    with pytest.raises(InputError, match="direction = 'hoop' carries no meridional stress"):
        film.prestrain(1.0)
    with pytest.raises(InputError, match="direction is 'up'; give 'meridian' or 'hoop'"):
        FixedWrinkles(direction="up")


@pytest.mark.slow
def test_frame_does_not_matter_to_the_laws_without_a_direction():
    for law in (Isotropic(), TensionField(slack_stiffness=1e-4)):
        for state in STATES:
            for strain, _ in strains(state, 2):
                w, s, C = at(law, strain)
                for angle in (1.9,):
                    turned = at(law, turn(strain, angle))
                    scale = max(ET * np.abs(strain).max(), 1e-300)
                    assert turned[0] == pytest.approx(w, rel=1e-11)
                    np.testing.assert_allclose(turned[1], turn(s, angle), rtol=0, atol=1e-11 * scale)
                    np.testing.assert_allclose(turned[2], turn(C, angle), rtol=0, atol=1e-11 * ET)


@pytest.mark.parametrize(
    "law", [Isotropic(), FixedWrinkles(), FixedWrinkles(slack_stiffness=1e-3), TensionField()]
)
def test_prestrain_carries_the_meridional_resultant_alone(law):
    N = 1234.5
    E0 = np.array([[float(law.prestrain(N)[i, j](())) for j in range(2)] for i in range(2)])
    _, s, _ = at(law, E0)
    np.testing.assert_allclose(s, [[N, 0], [0, 0]], rtol=1e-12, atol=1e-10)


def test_hoop_slack_leaves_the_resultant_of_a_tension_field():
    law = TensionField(slack_stiffness=0)
    E0 = law.prestrain(1000.0, hoop_slack=2e-3)
    E0 = np.array([[float(E0[i, j](())) for j in range(2)] for i in range(2)])
    assert E0[1, 1] == pytest.approx(-NU * E0[0, 0] - 2e-3, rel=1e-14)
    np.testing.assert_allclose(at(law, E0)[1], [[1000.0, 0], [0, 0]], rtol=1e-12, atol=1e-10)


@pytest.mark.parametrize("name", FILMS)
def test_regions_tell_the_three_states_apart(name):
    law = FILMS[name]()
    for state in STATES:
        for strain, _ in strains(state, 6):
            E = ufl.as_matrix(strain.tolist())
            found = [float(part(())) if hasattr(part, "ufl_shape") else part for part in law.regions(E)]
            assert sum(found) == 1
            if name == "fixed-wrinkles":
                assert found == ([0, 0, 1] if strain[0, 0] < 0 else [0, 1, 0])
            else:
                assert STATES[found.index(1)] == state


@pytest.mark.parametrize("name", ["isotropic", "tension-field"])
@pytest.mark.parametrize("off", [-1e-12, 0.0, 1e-12])
def test_film_that_pulls_one_way_alone_is_wrinkled_whatever_round_off_says(name, off):
    law = FILMS[name]()
    E = ufl.as_matrix([[1e-3, 0.0], [0.0, -1e-3 * (law.nu + off)]])
    assert [float(part(())) if hasattr(part, "ufl_shape") else part for part in law.regions(E)] == [0, 1, 0]


@pytest.mark.parametrize("film", FILMS.values())
def test_bad_numbers_are_refused_in_one_sentence(film):
    for bad in (0.0, -1.0, math.inf, math.nan, "3.5 GPa", None):
        with pytest.raises(InputError, match=r"^film E is .*; give a .*number \[Pa\]$"):
            film(E=bad)
        with pytest.raises(InputError, match=r"^film thickness is .*; give a .*number \[m\]$"):
            film(thickness=bad)
    for bad in (-1.0, 0.51):
        with pytest.raises(InputError, match=r"^film nu = .* must lie in \(-1, 0.5\]"):
            film(nu=bad)
    for bad in (math.nan, "0.3"):
        with pytest.raises(InputError, match=r"^film nu is .*; give a .*number$"):
            film(nu=bad)


@pytest.mark.parametrize("film", [FixedWrinkles, TensionField])
def test_slack_stiffness_out_of_range(film):
    for bad in (-1e-9, 1.0):
        with pytest.raises(InputError, match=r"^slack_stiffness = .* must lie in \[0, 1\); 1e-6 is usual"):
            film(slack_stiffness=bad)
    for bad in (math.nan, "1e-6"):
        with pytest.raises(InputError, match=r"^slack_stiffness is .*; give a .*number$"):
            film(slack_stiffness=bad)


def test_stiffness_of_the_paper_film():
    assert Isotropic().Et == pytest.approx(175e3)
