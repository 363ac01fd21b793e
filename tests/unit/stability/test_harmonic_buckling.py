"""The chart of critical pressures by harmonics."""

import dataclasses
import math
from functools import partial

import builders
import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp

from lobefem.errors import InputError
from lobefem.fem.balloon import Balloon
from lobefem.io.design import Design
from lobefem.linalg import dolfinx_compat  # noqa: F401
from lobefem.linalg.banded import Band, lowest, most_negative
from lobefem.model.end_plates import EndPlates
from lobefem.model.film import Isotropic
from lobefem.model.fixed_wrinkles import FixedWrinkles
from lobefem.stability.cyclic import Sector
from lobefem.stability.harmonic_buckling import (
    FixedShapePencil,
    OneHarmonic,
    harmonic_pressures,
    stable_below,
)
from lobefem.stability.linear_buckling import critical_pressure
from lobefem.stability.modes import find_modes

build = partial(builders.stack, load="film", lobes=1, divisions=(12, 20), prestressed=True)


def test_the_lowest_of_the_chart_is_the_full_models():
    balloon = build(film=FixedWrinkles(), lobes=2)
    full = critical_pressure(balloon, full=True)
    chart = harmonic_pressures(balloon)
    assert chart.harmonics == tuple(range(11))
    assert chart.pressure == pytest.approx(full.pressure, rel=1e-8)
    assert chart.lowest == full.mode.harmonic
    assert chart.kinds[chart.lowest] == full.mode.kind == "local"
    assert chart[3] == pytest.approx(critical_pressure(balloon, harmonic=3).pressure, rel=1e-10)
    assert np.nanmax(chart.residuals) < 1e-8


def test_a_sector_alone_gives_the_chart_of_the_whole():
    whole, sector = (
        harmonic_pressures(build(film=FixedWrinkles(), lobes=2, sector=alone), [1, 4, 2])
        for alone in (False, True)
    )
    assert whole.harmonics == sector.harmonics == (1, 4, 2)
    assert np.allclose(whole.pressures, sector.pressures, rtol=1e-12)
    assert dataclasses.replace(whole, pressures=(), residuals=()) == dataclasses.replace(
        sector, pressures=(), residuals=()
    )


def test_isotropic_film_is_stable_in_low_harmonics_up_to_high_pressures():
    chart = harmonic_pressures(build(film=Isotropic(), load="closed", support="fixed", order=2), range(6))
    assert min(chart.pressures) > 1e5


def test_with_complex_eigenvalues_the_real_part_decides():
    """n = 1 under `film` load on moving plates."""
    balloon = build(film=FixedWrinkles(), lobes=3, divisions=(12, 16))
    p = harmonic_pressures(balloon, [1])[1]
    assert 1e5 < p < 1e6
    from lobefem.equilibrium.state import ideal_state

    below, above = (
        find_modes(ideal_state(balloon, factor * p), 2, harmonics=[1]).values[0].real
        for factor in (0.99, 1.01)
    )
    assert below > 0 > above


def test_a_single_harmonic_needs_no_list():
    balloon = build(film=FixedWrinkles(), divisions=(4, 8))
    one, listed = harmonic_pressures(balloon, 2), harmonic_pressures(balloon, [2])
    assert (one.harmonics, one.pressures) == (listed.harmonics, listed.pressures) == ((2,), (one.pressure,))


def test_requests_that_make_no_sense_are_refused():
    balloon = build(film=FixedWrinkles(), divisions=(4, 8))
    with pytest.raises(InputError, match="no harmonics are given"):
        harmonic_pressures(balloon, [])
    with pytest.raises(InputError, match="harmonic = 9: a mesh of 8 equal sectors"):
        harmonic_pressures(balloon, [9])
    with pytest.raises(InputError, match=r"^a harmonic is 2.5; give an integer, 0 or more$"):
        harmonic_pressures(balloon, [2.5])
    with pytest.raises(InputError, match="prestressed=True"):
        harmonic_pressures(Balloon(balloon.surface, Isotropic(), [EndPlates()]))


@pytest.mark.parametrize("hint", [None, 50.0, 700.0, 1e5])
def test_the_bracket_finds_the_critical_pressure_from_any_hint(hint):
    below = stable_below(lambda p: p < 777.0, 1e6, hint)
    assert 777 / 1.1 <= below < 777


def test_the_bracket_says_never_and_always():
    assert stable_below(lambda p: True, 1e6) == np.inf
    assert stable_below(lambda p: False, 1e6, 10.0) == 0.0
    # 1.05e6 is beyond the limit, though a search in steps would pass both at once
    assert stable_below(lambda p: p < 1.05e6, 1e6) == np.inf
    assert 0.9e6 < stable_below(lambda p: p < 0.999e6, 1e6) < 0.999e6


@pytest.mark.parametrize(("load", "lobes", "n"), [("closed", 1, 3), ("film", 3, 1)])
def test_a_pressure_just_beyond_the_limit_is_none(load, lobes, n):
    """Stable a little below the limit, and critical a little above it."""
    pencil = FixedShapePencil(
        Sector(build(film=FixedWrinkles(), load=load, lobes=lobes, divisions=(12, 16))), n
    )
    (found,) = pencil.solve().pressures
    for share, expected in ((0.999, math.inf), (0.92, math.inf), (1.001, found)):
        pencil.limit = share * found
        assert pencil.solve().pressures == (pytest.approx(expected, rel=1e-9),)


def test_any_fault_on_one_rank_ends_all(comm, monkeypatch):
    """Each rank solves harmonics of its own: the others would wait for one that is lost."""
    balloon = build(film=FixedWrinkles(), divisions=(4, 8))

    def solve(self, count, hint):
        if self._harmonic % comm.size == comm.size - 1:
            raise ZeroDivisionError("lost")
        return OneHarmonic((1.0,), None, math.nan)

    monkeypatch.setattr(FixedShapePencil, "solve", solve)
    with pytest.raises(ZeroDivisionError, match="lost"):
        harmonic_pressures(balloon, range(2 * comm.size))


def test_small_pencils_that_round_off_makes_singular(monkeypatch):
    """LAPACK's dense Cholesky can refuse what its banded one takes; the answer is the same without it."""
    rng = np.random.default_rng(1)
    X, Y = (rng.normal(size=(12, 12)) + 1j * rng.normal(size=(12, 12)) for _ in range(2))
    A, B = (sp.csr_matrix(Z @ Z.conj().T + np.eye(12)) for Z in (X, Y))
    G = sp.csr_matrix(X + X.conj().T)
    band = Band(abs(A) + abs(B))
    solve = band.factor(band.pack(B))

    def found():
        return lowest(A, B, 3, 1e-3, True)[:2], most_negative(G, B, solve, 3)

    expected = found()

    def refuse(*args, **options):
        raise np.linalg.LinAlgError("not positive definite")

    monkeypatch.setattr(scipy.linalg, "eigh", refuse)
    for (values, vectors), (other, _), K in zip(found(), expected, (A, G), strict=True):
        np.testing.assert_allclose(values, other, rtol=1e-10)
        np.testing.assert_allclose(K @ vectors, B @ vectors * values, atol=1e-9 * abs(K).max())


def test_a_tiny_balloon_that_may_tilt(comm):
    """A pinned stack's tilt is a zero mode: nothing but round-off is left of one harmonic's stiffness."""
    tables = {
        "shape": {"edge_radius": 0.00013428566685708826, "truncation": 0.27455994568654496},
        "mesh": {"divisions": [4, 6]},
        "film": {"law": "isotropic", "E": 1e6, "nu": 0, "thickness": 1.3428566685708828e-07},
        "hoops": {"EA": 1.8032640323252896e-05},
        "plates": {"support": "pinned"},
    }
    pressures = []
    for size in (1.0, 100.0):
        tables["shape"]["edge_radius"] *= size
        tables["film"]["thickness"] *= size
        tables["hoops"]["EA"] *= size**2
        design = Design.parse(tables)
        pressures.append(harmonic_pressures(design.balloon(design.surface(comm), prestressed=True)).pressures)
    np.testing.assert_allclose(*pressures, rtol=1e-5, atol=1e-6)
