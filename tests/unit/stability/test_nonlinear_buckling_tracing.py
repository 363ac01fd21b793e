"""Paths: modes along them, and where they lose stability, against closed forms and a linear pencil."""

import inspect
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq
from states import nodes, unknowns

from lobefem import (
    Balloon,
    EndPlates,
    Fixed,
    FixedWrinkles,
    GasPressure,
    Hoops,
    Isotropic,
    critical_pressure,
    find_modes,
    ideal_state,
    inflate,
    lobed_cylinder,
)
from lobefem.errors import ConvergenceError, InputError
from lobefem.stability import nonlinear_buckling, tracing
from lobefem.stability.nonlinear_buckling import CriticalPoint, critical_point
from lobefem.stability.tracing import trace

sys.path.insert(0, str(Path(__file__).parents[2] / "analytic"))
from flatfilm import film_surface

SIDES, RADIUS, FILM = 6, 1.0, Isotropic(E=1e9, nu=0.3, thickness=1e-4)
C = 1e5 / (1 - 0.3**2)


def pyramid(comm, height, load="closed"):
    """A roof of six triangles with its base held: three degrees of freedom, the apex."""
    angle = 2 * np.pi * np.arange(SIDES) / SIDES
    base = np.column_stack([RADIUS * np.cos(angle), RADIUS * np.sin(angle), 0 * angle])
    points = np.concatenate([base, [[0, 0, height]]])
    cells = [(k, (k + 1) % SIDES, SIDES) for k in range(SIDES)]
    surface = film_surface(comm, points, cells)
    return Balloon(surface, FILM, [GasPressure(load), Fixed(lambda x: x[2] < 0.5 * height)])


INRADIUS, EDGE = RADIUS * np.cos(np.pi / SIDES), 2 * RADIUS * np.sin(np.pi / SIDES)


def roof_pressure(h, height):
    """Pressure at which the apex stands at h: triangles stretched along their slant height only.

    E_22 = (h^2 - h0^2)/(2 s0^2), U = n (b s0/2) C E_22^2/2, V = n (b d/2) h/3, p = U'/V'.
    """
    slant = np.hypot(INRADIUS, height)
    return 3 * slant * C * h * (h**2 - height**2) / (2 * slant**4 * INRADIUS)


def sideways_stiffness(h, height, step=1e-4):
    """d2U/dx2 of the apex at (0, 0, h), from strains of the six triangles' edges; V has no part in it."""

    def energy(x):
        total = 0.0
        for k in range(SIDES):
            a, b = (
                RADIUS * np.array([np.cos(t), np.sin(t), 0]) for t in 2 * np.pi * np.array([k, k + 1]) / SIDES
            )
            metric = []
            for apex in (np.array([0, 0, height]), np.array([x, 0, h])):
                edges = np.array([b - a, apex - a])
                metric.append(edges @ edges.T)
            first = np.linalg.cholesky(metric[0])
            strain = (np.linalg.inv(first) @ metric[1] @ np.linalg.inv(first).T - np.eye(2)) / 2
            density = C / 2 * ((1 - 0.3) * (strain**2).sum() + 0.3 * np.trace(strain) ** 2)
            total += np.sqrt(np.linalg.det(metric[0])) / 2 * density
        return total

    return (energy(step) - 2 * energy(0.0) + energy(-step)) / step**2


@pytest.mark.slow
@pytest.mark.parametrize("load", ["closed", "film"])
def test_a_shallow_roof_snaps_at_its_limit_point(comm, load):
    height = 0.15
    exact = roof_pressure(height / np.sqrt(3), height)
    found = critical_point(pyramid(comm, height, load), start=0.5 * exact, limit=2 * exact)
    assert found.pressure == pytest.approx(exact, rel=1e-4)
    assert found.point == "limit point"
    assert found.projection == pytest.approx(1, abs=1e-6)
    stable, end = found.bracket
    assert stable > exact > end
    assert end - stable == pytest.approx(0, abs=1e-3 * abs(exact))
    # the state is still on the rising branch, not on the other side
    assert 0 < found.state.volume < pyramid(comm, height).reference_volume
    assert found.mode.kind in ("sway", "global")
    assert all(value > 0 for p, value in found.visited if abs(p) < abs(exact))


@pytest.mark.slow
def test_a_steep_roof_goes_sideways_first(comm):
    height = 2.0
    h = brentq(sideways_stiffness, 0.6 * height, height, args=(height,))
    assert h > height / np.sqrt(3)  # before the limit point
    exact = roof_pressure(h, height)
    found = critical_point(pyramid(comm, height), start=0.5 * exact, limit=2 * exact)
    assert found.pressure == pytest.approx(exact, rel=1e-5)
    assert found.point == "bifurcation"
    assert found.projection < 1e-6
    stable, unstable = found.bracket
    assert stable >= found.pressure >= unstable
    assert stable - unstable <= 1e-3 * abs(exact)
    phi = np.abs(found.mode.displacement)
    assert comm.allreduce(phi[:, 2].max(initial=0.0)) < 1e-6  # the longest is 1: sideways


def test_a_path_that_ends_before_its_time_is_no_limit_point(comm, monkeypatch):
    """The solver fails at half of the limit pressure, where the eigenvalue is far from zero."""
    height = 0.15
    exact = roof_pressure(height / np.sqrt(3), height)

    def failing(balloon, pressure, *, start=None, **options):
        if pressure < 0.5 * exact:
            raise ConvergenceError("line search failed", state=start, pressure=pressure)
        return inflate(balloon, pressure, start=start, **options)

    for module in (nonlinear_buckling, tracing):
        monkeypatch.setattr(module, "inflate", failing)
    with pytest.raises(ConvergenceError, match="but not at a limit point") as caught:
        critical_point(pyramid(comm, height), start=0.05 * exact, limit=2 * exact)
    assert caught.value.state.pressure == pytest.approx(0.5 * exact, rel=1e-3)
    assert caught.value.data["pressure"] < 0.5 * exact


def test_where_the_state_jumps_the_path_does_not_go_on(comm, monkeypatch):
    """The solver finds another equilibrium beyond half of the limit pressure: no step leads there."""
    height = 0.15
    exact = roof_pressure(height / np.sqrt(3), height)
    monkeypatch.setattr(nonlinear_buckling, "jumped", lambda before, after: after.pressure < 0.5 * exact)
    with pytest.raises(ConvergenceError, match="but not at a limit point") as caught:
        critical_point(pyramid(comm, height), start=0.05 * exact, limit=2 * exact)
    assert caught.value.state.pressure == pytest.approx(0.5 * exact, rel=2e-3)


def test_to_the_roofs_other_side_is_a_jump(comm):
    """From one equilibrium to that inside out, and from it on; along either side is none."""
    height = 0.15
    exact = roof_pressure(height / np.sqrt(3), height)
    balloon = pyramid(comm, height)
    near = [inflate(balloon, share * exact) for share in (0.5, 0.6)]
    through = unknowns(balloon, nodes(balloon) * [0, 0, -2.5])
    inverted = replace(near[0], unknowns=through.array_r.copy())
    far = [inflate(balloon, share * exact, start=inverted) for share in (0.5, 0.6)]
    assert all(one.volume < -0.5 * two.volume for one, two in zip(far, near, strict=True))
    for before, after, jump in (
        (near[0], near[1], False),
        (near[1], near[0], False),
        (far[0], far[1], False),
        (near[0], far[1], True),
        (far[0], near[1], True),
    ):
        assert nonlinear_buckling.jumped(before, after) is jump


def test_each_state_of_a_trace_starts_from_the_one_before(comm, monkeypatch):
    starts = []

    def watched(balloon, pressure, *, start=None, **options):
        starts.append(start)
        return inflate(balloon, pressure, start=start, **options)

    monkeypatch.setattr(tracing, "inflate", watched)
    found = trace(pyramid(comm, 0.15), [10.0, 20.0, 30.0], count=1, state="inflated")
    assert starts[0] is None
    assert all(start is state for start, state in zip(starts[1:], found.states[:-1], strict=True))


def test_each_state_of_a_search_starts_from_a_stable_one(comm, monkeypatch):
    starts = []

    def watched(balloon, pressure, *, start=None, **options):
        starts.append((pressure, start))
        return inflate(balloon, pressure, start=start, **options)

    for module in (nonlinear_buckling, tracing):
        monkeypatch.setattr(module, "inflate", watched)
    height = 2.0
    exact = roof_pressure(brentq(sideways_stiffness, 0.6 * height, height, args=(height,)), height)
    found = critical_point(pyramid(comm, height), start=0.9 * exact, limit=2 * exact)
    assert found.point == "bifurcation"
    (_, first), *rest = starts
    assert first is None
    # pressures are negative: a stable state bears less
    assert all(start is not None and start.pressure >= found.bracket[0] for _, start in rest)


def test_a_roof_pulled_outwards_stays_stable(comm):
    found = critical_point(pyramid(comm, 0.15), start=10.0, limit=1000.0, growth=10.0)
    assert found.pressure == np.inf
    assert found.mode is found.point is found.projection is None
    assert [p for p, _ in found.visited] == [10.0, 100.0, 1000.0]
    assert found.state.pressure == 1000.0


def lobe(load="closed", film=FixedWrinkles(), prestressed=True, divisions=(6, 16), lobes=1, **mesh):  # noqa: B008
    surface = lobed_cylinder(lobes, **({"divisions": divisions} | mesh))
    parts = [GasPressure(load), Hoops(), EndPlates(bar=True)]
    return Balloon(surface, film, parts, prestressed=prestressed)


@pytest.mark.parametrize("load", ["closed", "film"])
def test_the_ideal_path_has_the_pencils_critical_pressure(load):
    balloon = lobe(load)
    pencil = critical_pressure(balloon)
    found = critical_point(balloon, state="ideal", start=0.5 * pencil.pressure, limit=1e6)
    assert found.pressure == pytest.approx(pencil.pressure, rel=1e-5)
    assert (found.mode.harmonic, found.mode.kind) == (pencil.mode.harmonic, "local")
    assert found.point == "bifurcation"
    assert found.projection < 1e-8
    assert found.divisions == (6, 16)


@pytest.mark.slow
def test_the_inflated_path_loses_stability_between_two_states_of_its_own():
    """An independent search: the sign of the lowest eigenvalue of equilibria found from rest."""
    balloon = lobe()
    found = critical_point(balloon, start=15000.0, limit=1e6)
    assert found.point == "bifurcation"
    assert found.mode.kind == "local"
    for factor, negative in ((1 - 2e-5, False), (1 + 2e-5, True)):
        state = inflate(balloon, factor * found.pressure)
        assert (find_modes(state, 1)[0].value.real < 0) is negative
    assert found.pressure != pytest.approx(critical_pressure(balloon).pressure, rel=1e-3)


def test_trace_of_ideal_states_is_their_modes_and_branches():
    balloon = lobe("film", divisions=(4, 10), lobes=2)
    found = trace(balloon, [1000.0, 8000.0, 25000.0], count=8)
    assert found.pressures.tolist() == [1000, 8000, 25000]
    for modes in found.modes:
        again = find_modes(ideal_state(balloon, modes.state.pressure), 8)
        np.testing.assert_allclose(modes.values, again.values)
    (sway,) = (b for b in found.branches if (b.kind, b.harmonic, b.rank) == ("sway", 1, 0))
    assert sway.pressures.tolist() == [1000, 8000, 25000]
    lowest = [[m[i].kind for i in at] for m, at in zip(found.modes, sway.members, strict=True)]
    assert lowest == [["sway", "sway"]] * 3


def test_trace_of_inflated_states_of_an_unstressed_film():
    """Isotropic film that the gas really deforms, on an unstructured mesh: all stable, all rising."""
    balloon = lobe(film=Isotropic(), prestressed=False, divisions=None, layout="unstructured", size=1.0)
    lines = []
    found = trace(
        balloon, [50.0, 200.0, 500.0], count=6, state="inflated", mass="nodal", progress=lines.append
    )
    states = [inflate(balloon, p) for p in (50.0, 200.0, 500.0)]
    for warm, cold in zip(found.states, states, strict=True):
        assert warm.volume == pytest.approx(cold.volume, rel=1e-9)
    assert np.diff([s.volume for s in found.states]).min() > 0.0
    assert all(m.stable and m.mass == "nodal" for m in found.modes)
    whole = [b for b in found.branches if len(b.pressures) == 3]
    assert len(whole) >= 3
    for branch in whole[:3]:
        assert (np.diff(branch.values) > 0).all()
    assert any(line.startswith("modes at 200 Pa") for line in lines)


def test_a_trace_that_fails_carries_what_was_reached(comm, monkeypatch):
    def failing(balloon, pressure, *, start=None, **options):
        if pressure > 25:
            raise ConvergenceError("line search failed", state=start)
        return inflate(balloon, pressure, start=start, **options)

    monkeypatch.setattr(tracing, "inflate", failing)
    with pytest.raises(ConvergenceError) as caught:
        trace(pyramid(comm, 0.15), [10.0, 20.0, 30.0], count=3, state="inflated")
    reached = caught.value.data["trace"]
    assert reached.pressures.tolist() == [10, 20]
    assert caught.value.state is reached.states[-1]
    assert all(len(b.pressures) == 2 for b in reached.branches)


def test_unclear_steps_are_halved(monkeypatch):
    balloon = lobe(divisions=(4, 8))
    monkeypatch.setattr(tracing, "unclear", lambda a, b: b.state.pressure <= 2000)
    found = trace(balloon, [1000.0, 2000.0, 4000.0], count=1, refinements=2)
    assert found.pressures.tolist() == [1000, 1250, 1500, 1750, 2000, 4000]


def test_the_pressure_to_quote_has_one_name_for_both_states(comm):
    """`critical_pressure` with state="inflated" is `critical_point` up to 20 kPa."""
    roof = pyramid(comm, 0.15)  # which gas from inside only stretches
    found = critical_pressure(roof, state="inflated", limit=1000.0)
    assert isinstance(found, CriticalPoint)
    assert found.pressure == np.inf
    assert found.state.pressure == 1000.0
    assert inspect.signature(critical_point).parameters["limit"].default == 20e3
    for wrong, said in [
        ({"state": "inflated", "harmonic": 2}, "harmonic and full are for the ideal state"),
        ({"limit": 10.0}, "limit is that of a search along inflated states; add state='inflated'"),
        ({"state": "flat"}, "state 'flat' is unknown; use 'ideal' or 'inflated'"),
    ]:
        with pytest.raises(InputError, match=said):
            critical_pressure(roof, **wrong)


@pytest.mark.slow
def test_turns_that_a_pinned_support_leaves_are_no_loss_of_stability(comm):
    """Four inflated lobes sway at the same pressure, whether the bottom plate is held or free to tilt."""
    found = {}
    for support in ("clamped", "pinned"):
        surface = lobed_cylinder(4, (6, 8), comm=comm)
        parts = [GasPressure("closed"), Hoops(), EndPlates(support=support)]
        found[support] = critical_point(Balloon(surface, Isotropic(), parts), start=2000.0, limit=9000.0)
    held, free = found["clamped"], found["pinned"]
    assert free.mode.kind == held.mode.kind == "sway"
    assert free.pressure == pytest.approx(held.pressure, rel=1e-6)
    assert free.point == held.point == "bifurcation"
    assert np.sort(np.abs(find_modes(free.state, 5).values))[1] < 1e-6 * free.visited[0][1]


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.9, 0.99, 1.02, 1.2])
def test_a_search_near_the_answer_finds_the_one_from_far_below(comm, share):
    """Above the steep roof's bifurcation states are unstable, so that the search begins further down."""
    height = 2.0
    exact = roof_pressure(brentq(sideways_stiffness, 0.6 * height, height, args=(height,)), height)
    found = critical_point(pyramid(comm, height), start=0.1 * exact, limit=2 * exact, near=share * exact)
    assert found.pressure == pytest.approx(exact, rel=1e-5)
    assert found.point == "bifurcation"
    stable, unstable = found.bracket
    assert stable > exact > unstable


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.95, 1.01, 1.3])
def test_a_search_near_a_limit_point_does_not_begin_beyond_it(comm, share):
    """Above its limit point a shallow roof has another, snapped state, which is stable."""
    height = 0.15
    exact = roof_pressure(height / np.sqrt(3), height)
    found = critical_point(pyramid(comm, height), start=0.1 * exact, limit=2 * exact, near=share * exact)
    assert found.point == "limit point"
    assert found.pressure == pytest.approx(exact, rel=1e-4)


def test_paths_refuse_what_they_cannot_do(comm):
    free = pyramid(comm, 0.15)
    with pytest.raises(InputError, match=r"^state 'flat' is unknown; use 'ideal' or 'inflated'$"):
        trace(free, [1.0], state="flat")
    with pytest.raises(InputError, match="the ideal state needs a prestressed balloon"):
        critical_point(free, state="ideal", limit=2.0)
    for pressures in ([], [1.0, 1.0], [1.0, 3.0, 2.0]):
        with pytest.raises(InputError, match="must rise or fall"):
            trace(free, pressures, count=1, state="inflated")
    for pressures in (1000.0, "5 Pa", np.ones((2, 2))):
        with pytest.raises(InputError, match=r"(?s)^the path of pressures is .*; give numbers \[Pa\] in"):
            trace(free, pressures, count=1, state="inflated")
    for pressures in ([np.nan], ["5 Pa"]):
        with pytest.raises(InputError, match=r"^a part of the path of pressures is .*; give a .*number"):
            trace(free, pressures, count=1, state="inflated")
    with pytest.raises(InputError, match="refinements = -1 must be 0 or more"):
        trace(free, [1.0], count=1, state="inflated", refinements=-1)
    for start, limit in ((1.0, 0.5), (-1.0, 2.0), (0.0, 1.0), (1.0, np.inf)):
        with pytest.raises(InputError, match="must have the same sign"):
            critical_point(free, start=start, limit=limit)
    with pytest.raises(InputError, match=r"growth = 1\.0 must be above 1"):
        critical_point(free, limit=2.0, growth=1.0)
    with pytest.raises(InputError, match=r"near = -1\.0 Pa must be a pressure of the sign of start = 1 Pa"):
        critical_point(free, limit=2.0, near=-1.0)
    snap = roof_pressure(2 / np.sqrt(3), 2.0)
    # unstable there, and at a tenth of it not
    low = critical_point(pyramid(comm, 2.0), start=0.999 * snap, limit=2 * snap)
    same = critical_point(pyramid(comm, 2.0), start=0.01 * snap, limit=2 * snap)
    assert low.pressure == pytest.approx(same.pressure, rel=1e-3)
    assert abs(low.visited[0][0]) < abs(snap) / 5


def test_turns_are_no_modes_of_a_path(comm):
    parts = [GasPressure("closed"), Hoops(), EndPlates(support="pinned")]
    state = inflate(Balloon(lobed_cylinder(2, (4, 6), comm=comm), Isotropic(), parts), 1000.0)
    every, own = find_modes(state, 5), nonlinear_buckling.without_turns(state, 3)
    assert np.abs(every.values[:2]).max() < 1e-6 < own.values.real.min()
    np.testing.assert_allclose(own.values, every.values[2:5], rtol=1e-6)
