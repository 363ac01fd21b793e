"""One-sided tangents of the tension field at the ideal isotensoid, and its smooth one beside it."""

import pytest
from builders import stack
from states import nodes, unknowns, wavy

from lobefem.equilibrium.state import ideal_state
from lobefem.errors import InputError
from lobefem.linalg import petsc
from lobefem.model.film import Isotropic
from lobefem.model.fixed_wrinkles import FixedWrinkles
from lobefem.model.imp import IMP
from lobefem.model.tension_field import TensionField, WrinkledField
from lobefem.stability.linear_buckling import critical_pressure
from lobefem.stability.one_sided import (
    has_kink,
    one_sided_modes,
    one_sided_pressures,
    slack_critical_pressure,
)

PRESSURE = 1000.0
FILM = TensionField(slack_stiffness=0.0)


def balloon_of(comm, film=FILM, slack=0.0, prestressed=True, divisions=(10, 20)):
    mesh = {"lobes": 1, "divisions": divisions, "cell": "quadrilateral"}
    return stack(comm, film, "film", support="fixed", prestressed=prestressed, hoop_slack=slack, **mesh)


@pytest.fixture(scope="module")
def balloon():
    from mpi4py import MPI

    return balloon_of(MPI.COMM_WORLD)


@pytest.fixture(scope="module")
def pressures(balloon):
    return {n: one_sided_pressures(balloon, harmonic=n) for n in (2, 4, None)}


def tangent_at(balloon, pressure):
    balloon.set_loads(pressure, pressure)
    return balloon.tangent(balloon.map.create_vector()).copy()


def form(matrix, u):
    work = matrix.createVecLeft()
    matrix.mult(u, work)
    return u.dot(work)


def residual(balloon, q):
    out = balloon.map.create_vector()
    balloon.residual(q, out)
    return out


def direction(balloon):
    return unknowns(balloon, wavy(nodes(balloon), 1))


def test_the_energy_grows_between_the_one_sided_tangents(comm, balloon):
    """q[u] from the tension field's own residual: K_w <= q <= K_t and q[u] + q[-u] = K_w + K_t."""
    u = direction(balloon)
    low, high = (
        form(tangent_at(balloon_of(comm, film), PRESSURE), u)
        for film in (WrinkledField(slack_stiffness=0.0), Isotropic())
    )
    balloon.set_loads(PRESSURE, PRESSURE)
    rest = residual(balloon, balloon.map.create_vector())
    growth = []
    for step in (1e-7, -1e-7):
        q = u.copy()
        q.scale(step)
        change = residual(balloon, q)
        change.axpy(-1.0, rest)
        growth.append(change.dot(u) / step)
    assert all(low + 0.1 * (high - low) < q < high - 0.1 * (high - low) for q in growth)
    assert sum(growth) == pytest.approx(low + high, rel=1e-4)


def test_spectra_are_ordered(balloon):
    spectra = one_sided_modes(balloon, PRESSURE, count=4)
    wrinkled, mean, taut = (m.values.real[:4] for m in (spectra.wrinkled, spectra.mean, spectra.taut))
    assert (wrinkled < mean).all()
    assert (mean < taut).all()
    assert spectra.bounds == (wrinkled[0], mean[0])
    # the taut tangent is the isotropic film's
    assert spectra.taut.state.balloon.film == Isotropic()


@pytest.mark.parametrize("share", [0.0, 0.1])
def test_the_mean_tangent_is_the_mean(comm, share):
    one = balloon_of(comm, TensionField(slack_stiffness=share), divisions=(4, 8))
    films = [m.state.balloon.film for m in vars(one_sided_modes(one, PRESSURE, count=1)).values()]
    assert films[0] == WrinkledField(slack_stiffness=share)
    wrinkled, mean, taut = (tangent_at(balloon_of(comm, film, divisions=(4, 8)), PRESSURE) for film in films)
    size = mean.norm()
    mean.scale(2.0)
    mean.axpy(-1.0, wrinkled)
    mean.axpy(-1.0, taut)
    assert mean.norm() < 1e-12 * size


@pytest.mark.parametrize("slack", [0.0, 1e-3])
def test_only_without_slack_the_wrinkled_tangent_is_linear_in_the_pressure(comm, slack):
    one = balloon_of(comm, WrinkledField(slack_stiffness=0.0), slack)
    K = [tangent_at(one, p) for p in (100.0, 200.0, 300.0)]
    size = K[0].norm()
    K[0].axpy(-2.0, K[1])
    K[0].axpy(1.0, K[2])
    assert (K[0].norm() < 1e-12 * size) is (slack == 0.0)


def test_with_slack_the_tangent_is_smooth_and_wrinkled(comm):
    """It is the residual's derivative, from either side, and the wrinkled state's own."""
    one = balloon_of(comm, slack=1e-3)
    K = tangent_at(one, PRESSURE)
    u = direction(one)
    expected = K.createVecLeft()
    K.mult(u, expected)
    rest = residual(one, one.map.create_vector())
    for step in (1e-6, -1e-6):
        q = u.copy()
        q.scale(step)
        change = residual(one, q)
        change.axpy(-1.0, rest)
        change.scale(1 / step)
        change.axpy(-1.0, expected)
        assert change.norm() < 2e-4 * expected.norm()
    other = tangent_at(balloon_of(comm, WrinkledField(slack_stiffness=0.0), 1e-3), PRESSURE)
    other.axpy(-1.0, K)
    assert other.norm() < 1e-12 * K.norm()


@pytest.mark.slow
@pytest.mark.parametrize("harmonic", [2, 4, None])
def test_critical_pressures_are_ordered(pressures, harmonic):
    found = pressures[harmonic]
    assert found.wrinkled.pressure < found.mean.pressure < found.taut.pressure
    assert found.bounds == (found.wrinkled.pressure, found.mean.pressure)


@pytest.mark.slow
def test_the_taut_branch_is_isotropic_and_the_lowest_of_all_is_no_higher(comm, pressures):
    isotropic = critical_pressure(balloon_of(comm, Isotropic()), harmonic=2).pressure
    assert pressures[2].taut.pressure == pytest.approx(isotropic, rel=1e-8)
    for of_all, of_one in zip(pressures[None].bounds, pressures[4].bounds, strict=True):
        assert of_all <= of_one * (1 + 1e-8)


@pytest.mark.slow
def test_critical_pressure_with_slack(comm, pressures):
    """It falls with the slack, tends to the wrinkled branch's, and is where K(p) turns indefinite."""
    previous = pressures[4].wrinkled.pressure
    for slack in (1e-6, 1e-3, 1e-1):
        found = slack_critical_pressure(balloon_of(comm, slack=slack), harmonic=4).pressure
        assert found < previous
        if slack == 1e-6:
            assert found == pytest.approx(previous, rel=1e-5)
        previous = found
    slackened = balloon_of(comm, slack=1e-1)
    lowest = slack_critical_pressure(slackened)
    assert lowest.pressure < previous
    assert lowest.mode.value == 0
    for factor, stable in ((1 - 1e-6, True), (1 + 1e-6, False)):
        assert (petsc.num_negative(tangent_at(slackened, factor * lowest.pressure)) == 0) is stable
    # the pencil that is linear in p misses it
    linear = critical_pressure(slackened, at=(1.0, 1e5)).pressure
    assert abs(linear / lowest.pressure - 1) > 1e-3


def test_wrinkled_field_counts_its_regions(comm):
    state = ideal_state(balloon_of(comm, WrinkledField()), PRESSURE)
    assert state.wrinkled_area == pytest.approx(state.balloon.reference_area)
    unstrained = ideal_state(balloon_of(comm, WrinkledField()), 0.0)
    assert unstrained.slack_area == pytest.approx(state.balloon.reference_area)
    assert unstrained.residual == 0.0


@pytest.mark.parametrize(
    ("film", "slack", "kink"),
    [
        (TensionField(), 0.0, True),
        (IMP(), 0.0, True),
        (TensionField(), 1e-3, False),
        (IMP(), 1e-3, False),
        (Isotropic(), 0.0, False),
        (FixedWrinkles(), 0.0, False),
    ],
)
def test_only_a_tension_field_without_slack_has_two_tangents(comm, film, slack, kink):
    assert has_kink(balloon_of(comm, film, slack, (2, 4))) is kink


def test_refusals(comm, balloon):
    with pytest.raises(InputError, match="FixedWrinkles film has one tangent; use critical_pressure"):
        one_sided_pressures(balloon_of(comm, FixedWrinkles()))
    slackened = balloon_of(comm, slack=1e-3)
    with pytest.raises(InputError, match=r"hoop slack 0\.001 has one tangent; use slack_critical_pressure"):
        one_sided_modes(slackened, PRESSURE)
    with pytest.raises(InputError, match="without hoop slack a tension field has two tangents"):
        slack_critical_pressure(balloon)
    with pytest.raises(InputError, match=r"pressure = 0.0 Pa: unstressed film has no wrinkled tangent"):
        one_sided_modes(balloon, 0.0)
    with pytest.raises(InputError, match="pass prestressed=True"):
        one_sided_pressures(balloon_of(comm, prestressed=False))
