"""Figures and sentences of a pumpkin's stability, from results."""

import numpy as np
import pytest

from lobefem.viz import harmonic_curves, pumpkin_verdict

pytestmark = pytest.mark.serial


def searched(**changes):
    """Results of a search in which n = 1 gains stability and n = 3 loses it."""
    p = [50.0, 100.0, 200.0]
    values = {0: [1.0, 2.0, 4.0], 1: [-0.1, 0.2, 0.5], 3: [2.0, 1.0, -1.0], 32: [1e3, 2e3, 4e3]}
    return {
        "command": "critical", "gores": 64, "looked_at": list(range(33)), "kind": "global", "harmonic": 3,
        "critical_pressure": 150.0, "point": "bifurcation", "stable": [[66.0, 150.0]],
        "searched_from": 50.0, "searched_to": 200.0,
        "visited": [[x, min(row)] for x, row in zip(p, zip(*values.values(), strict=True), strict=True)],
        "curves": [{"harmonic": n, "values": row} for n, row in values.items()],
        "crossings": [{"pressure": 66.0, "harmonic": 1, "lost": False},
                      {"pressure": 150.0, "harmonic": 3, "lost": True}],
        "chart": [{"harmonic": n, "critical_pressure": 150.0 if n == 3 else None,
                   "stable_from": 66.0 if n == 1 else None} for n in values],
    } | changes  # fmt: skip


def lines(figure):
    (axes,) = figure.axes
    return {line.get_label(): np.array(line.get_data()) for line in axes.lines}


def test_eigenvalues_against_pressure():
    drawn = lines(harmonic_curves.eigenvalues(searched()))
    assert drawn["$n$ = 3"].tolist() == [[50.0, 100.0, 200.0], [2.0, 1.0, -1.0]]
    assert {"$n$ = 1", "$n$ = 3"} <= set(drawn)


def test_the_harmonics_that_cross_are_named_first():
    assert harmonic_curves.named_harmonics(searched(), most=2) == [1, 3]
    assert harmonic_curves.named_harmonics(searched(crossings=[]), most=2) == [1, 3]
    assert harmonic_curves.named_harmonics(searched(crossings=[]), most=1) == [3]


def test_critical_pressures_by_harmonic():
    drawn = lines(harmonic_curves.critical_pressures(searched()))
    assert drawn["stability lost"].ravel().tolist() == [3, 150.0]
    assert drawn["stability gained"].ravel().tolist() == [1, 66.0]
    assert drawn["stable up to 200 Pa"][0].tolist() == [0, 1, 32]


@pytest.mark.parametrize("lowest", [-0.1, 0.1])
def test_lowest_eigenvalues_by_harmonic(lowest):
    entry = {
        "pressure": 50.0,
        "by_harmonic": [{"harmonic": 0, "lowest": 5.0}, {"harmonic": 1, "lowest": lowest}],
    }
    drawn = lines(harmonic_curves.spectrum({"gores": 64, "mass": "unit", "pressures": [entry]}))
    assert drawn["50 Pa"].tolist() == [[0, 1], [5.0, lowest]]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({}, ["Unstable below 66 Pa in harmonic 1 (sideways).",
              "Stable up to 150 Pa. Above that the balloon buckles as a whole (3 waves around)."]),
        ({"stable": [[50.0, 150.0]], "point": "limit point", "harmonic": 0, "kind": "global"},
         ["Stable up to 150 Pa. That is a limit point: above it there is no equilibrium nearby, and the "
          "balloon buckles as a whole (0 waves around)."]),
        ({"stable": [[50.0, 150.0], [180.0, 200.0]]},
         ["Stable up to 150 Pa. Above that the balloon buckles as a whole (3 waves around).",
          "Stable again from 180 Pa to 200 Pa."]),
        ({"stable": [], "critical_pressure": 0.0},
         ["Unstable at all pressures from 50 Pa to 200 Pa, most of all in harmonic 3."]),
        ({"stable": [[50.0, 200.0]], "critical_pressure": None, "reason": "no instability found"},
         ["Stable up to 200 Pa: no instability found."]),
        ({"stable": [[50.0, 200.0]], "critical_pressure": None,
          "reason": "no instability found up to 200 Pa, the end of the search; --up-to moves it"},
         ["Stable up to 200 Pa, the end of the search; --up-to moves it."]),
        ({"stable": [], "critical_pressure": 0.0,
          "reason": "unstable at all pressures from 50 Pa to 200 Pa; no equilibrium found above 200 Pa"},
         ["Unstable at all pressures from 50 Pa to 200 Pa, most of all in harmonic 3; no equilibrium found "
          "above 200 Pa."]),
        ({"stable": [], "critical_pressure": 0.0, "only_harmonic": 3, "looked_at": [3]},
         ["Unstable in harmonic 3 (no other was looked at) at all pressures from 50 Pa to 200 Pa."]),
        ({"looked_at": [3, 4], "stable": [[50.0, 150.0]]},
         ["Stable in the 2 harmonics that were looked at up to 150 Pa. Above that the balloon buckles as a "
          "whole (3 waves around)."]),
        ({"stable": "damaged"}, []),
        ({"searched_to": None}, []),
    ],
)  # fmt: skip
def test_sentences(changes, said):
    assert pumpkin_verdict.critical(searched(**changes)) == said
