"""The answer at a glance, from results alone."""

import pytest

from lobefem.viz.headline import headline

pytestmark = pytest.mark.serial

STACK = {"film": "tension-field", "load": "closed", "support": "clamped", "bar": "rigid", "hoops": 2e9,
         "lobes": 4, "divisions": [24, 32]}  # fmt: skip
CRITICAL = {"command": "critical", "critical_pressure": 5497.1, "kind": "sway", "harmonic": 1}


def marks(found):
    return {mark.name: (mark.text, mark.tone) for mark in found.marks}


def test_a_critical_pressure_is_the_number():
    found = headline(
        STACK | CRITICAL | {"max_stress": 2.4e8, "bar_force": 2e4, "hoop_tension": [1.4e4, 1.48e4]}
    )
    assert (found.tone, found.word, found.number, found.value) == ("good", "Stable up to", "5497 Pa", 5497.1)
    assert found.text == "Above that the stack sways sideways."
    assert marks(found) == {
        "Mesh": ("24×32: not checked on a finer one", "open"),
        "Film stress": ("240 MPa; its strength is not given", "open"),
        "Hoops": ("14.8 kN at most", "plain"),
        "Bar": ("rigid, 20 kN: does yours have one?", "open"),
    }


def test_a_number_that_depends_on_the_mesh_is_marked():
    found = headline(STACK | CRITICAL | {"film": "fixed-wrinkles"})
    assert found.tone == "open"
    assert marks(found)["Mesh"][1] == "bad"
    checked = {"mesh_error": 0.011, "mesh_behaviour": "converges", "mesh_limit": 5450.0, "meshes": [{}] * 3}
    found = headline(STACK | CRITICAL | checked)
    assert (found.number, marks(found)["Mesh"]) == ("5450 Pa", ("± 1.1 %, by 3 meshes", "good"))
    falling = {"mesh_behaviour": "falls", "meshes": [{"critical_pressure": p} for p in (278.6, 53.2)]}
    found = headline(STACK | CRITICAL | falling)
    assert (found.tone, found.word, found.number) == ("bad", "Falls with refinement", "below 53.2 Pa")


def test_no_instability_on_any_mesh_is_no_doubt():
    none = {"mesh_behaviour": "open", "meshes": 3 * [{"critical_pressure": None}], "limit": 2e4}
    found = headline(STACK | CRITICAL | none | {"critical_pressure": None})
    assert marks(found)["Mesh"] == ("the same on 3 meshes", "good")


def test_film_that_breaks_comes_first():
    found = headline(STACK | CRITICAL | {"strength": 1.8e8, "strength_pressure": 4100.0})
    assert (found.tone, found.word, found.number) == ("bad", "The film breaks at", "4100 Pa")
    assert "before the balloon becomes unstable at 5497 Pa" in found.text
    # of a mesh study it is the limit, and the bar is the limit's
    bar = {"strength": 1.8e8, "strength_pressure": 4100.0, "mesh_limit": 5300.0, "mesh_error": 0.04}
    found = headline(STACK | CRITICAL | bar)
    assert "becomes unstable at 5300 Pa" in found.text
    assert marks(found)["Mesh"][0].startswith("instability ± 4 %")


def test_a_pumpkin_has_the_limit_of_its_mesh_study():
    path = {"stable": [[50.0, 150.0]], "searched_from": 50.0, "searched_to": 200.0}
    results = {"command": "critical", "gores": 64, "critical_pressure": 150.0, "harmonic": 3} | path
    rows = [{"critical_pressure": p} for p in (170.0, 160.0, 150.0)]
    study = {"meshes": rows, "mesh_behaviour": "converges", "mesh_limit": 140.0, "mesh_error": 0.07}
    assert headline(results | study).number == "140 Pa"
    assert headline(results | study | {"mesh_behaviour": "falls"}).word == "Falls with refinement"


@pytest.mark.parametrize(
    ("results", "tone", "word", "number"),
    [
        ({"critical_pressure": 0}, "bad", "Unstable", "at any pressure"),
        ({"critical_pressure": None, "limit": 2e4}, "good", "No instability up to", "20 kPa"),
        ({"critical_pressure": 300.0, "bounds": [300.0, 900.0]}, "open", "Stable below", "300 Pa"),
        ({"critical_pressure": 0, "bounds": [0, 900.0]}, "open", "Unstable above", "900 Pa"),
        ({"critical_pressure": 0, "bounds": [0, None]}, "open", "Undecided", ""),
        ({"error": "line search failed"}, "bad", "Failed", ""),
        ({"critical_pressure": {}}, "open", "No verdict", ""),
    ],
)
def test_words_of_other_ends_of_a_search(results, tone, word, number):
    found = headline(STACK | {"command": "critical", "kind": "sway", "harmonic": 1} | results)
    assert (found.tone, found.word, found.number) == (tone, word, number)


def entry(pressure, value, verdict=""):
    modes = [{"kind": "sway", "harmonic": 1, "real": value}]
    return {"pressure": pressure, "stable": value > 0, "modes": modes} | (
        {"verdict": verdict} if verdict else {}
    )


@pytest.mark.parametrize(
    ("values", "word", "number", "text"),
    [
        ([(1e3, 2.0), (2e3, 1.0)], "Stable at", "1000 Pa to 2000 Pa", ""),
        (
            [(3e3, -1.0), (1e3, 2.0), (4e3, -2.0)],
            "Unstable from",
            "3000 Pa",
            "unstable between 1000 Pa and 3000 Pa",
        ),
        ([(1e3, -1.0), (2e3, 1.0)], "Unstable at", "1000 Pa", "Stable at 2000 Pa."),
        ([(1e3, 1.0), (2e3, -1.0, "undecided")], "Undecided at", "2000 Pa", "Stable at 1000 Pa."),
    ],
)
def test_pressures_of_modes(values, word, number, text):
    found = headline(STACK | {"command": "modes", "pressures": [entry(*value) for value in values]})
    assert (found.word, found.number) == (word, number)
    assert text in found.text


def test_a_release_and_a_study():
    released = {
        "command": "perturb",
        "outcome": "returned",
        "parameter": 7.5,
        "unit": "degrees",
        "distortion": "bend",
    }
    assert headline(released).number == "after 7.5°"
    study = {
        "command": "mesh-study",
        "lowest": {"behaviour": "converges", "limit": 290e3, "uncertainty": 900.0},
    }
    assert (headline(study).word, headline(study).number) == ("Stable up to", "290 kPa")
    falls = study | {
        "lowest": {"behaviour": "falls"},
        "meshes": [{"critical_pressure": p} for p in (9e3, 2e3)],
    }
    assert (headline(falls).tone, headline(falls).number) == ("bad", "below 2000 Pa")


def test_a_pumpkin_may_be_stable_on_a_stretch_only():
    path = {"gores": 64, "searched_from": 10.0, "searched_to": 900.0, "stable": [[50.0, 800.0]]}
    found = headline(CRITICAL | path | {"critical_pressure": 800.0, "harmonic": 3, "kind": "global"})
    assert (found.word, found.number) == ("Stable from 50 Pa up to", "800 Pa")
    assert found.text.endswith("(3 waves around). Below 50 Pa it is unstable, too.")


def test_points_without_a_critical_pressure_are_no_zeros():
    rows = [{"exit_code": 0, "found": {"critical_pressure": p}} for p in (None, 0.0, 300.0, 500.0, None)]
    failed = {"exit_code": 3, "found": {}}
    found = headline({"command": "sweep", "of": "critical", "rows": [*rows, failed], "failed": 1})
    assert found.text == (
        "Critical pressures from 300 Pa to 500 Pa. 1 of 6 never stable. 2 of 6 stable up to the end of the "
        "search."
    )
