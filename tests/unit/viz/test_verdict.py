"""What results say of stability, in sentences."""

import pytest

from lobefem.viz.verdict import FIXED_WRINKLES, verdict

pytestmark = pytest.mark.serial

MESH = {"divisions": (24, 32), "film": "isotropic"}
FOUND = {"critical_pressure": 4420.3, "harmonic": 7, "kind": "local", "state": "ideal", **MESH}
ALL = {"command": "harmonics", **MESH}


def chart(*pressures):
    return [{"harmonic": n, "critical_pressure": p, "kind": "local"} for n, p in enumerate(pressures)]


@pytest.mark.parametrize(
    ("results", "said"),
    [
        ({"command": "critical", **FOUND},
         "Stable up to 4420 Pa. Above that the film buckles locally (7 waves around)."),
        ({"command": "critical", **FOUND, "only_harmonic": 7},
         "Stable in harmonic 7 (no other was looked at) up to 4420 Pa. Above that"),
        ({"command": "critical", **FOUND, "state": "inflated"}, "Stable up to 4420 Pa. Above that"),
        ({"command": "critical", **FOUND, "point": "limit point"},
         "Stable up to 4420 Pa. That is a limit point: above it"),
        ({"command": "critical", **FOUND, "bounds": [100.0, 250.5]},
         "Stable below 100 Pa, unstable above 250.5 Pa. Between them the film model gives no answer"),
        ({"command": "critical", **FOUND, "bounds": (100.0, None)},
         "Stable below 100 Pa, no upper bound found. Above that the film model gives no answer"),
        ({"command": "critical", **FOUND, "critical_pressure": None,
          "reason": "no instability found up to 20 kPa"},
         "No instability found up to 20 kPa."),
        ({"command": "critical", **FOUND, "critical_pressure": 0.0, "reason": "unstable at any pressure"},
         "Unstable at any pressure."),
        ({"command": "critical", **FOUND, "critical_pressure": 0.0, "reason": "unstable at any pressure",
          "only_harmonic": 7}, "Unstable at any pressure in harmonic 7 (no other was looked at)."),
        ({"command": "critical", **FOUND, "critical_pressure": 0.0, "bounds": [0.0, 250.5]},
         "Unstable above 250.5 Pa. Below that the film model gives no answer in this"),
        ({"command": "critical", **FOUND, "critical_pressure": 0.0, "bounds": [0.0, None]},
         "Whether the balloon is stable, the film model gives no answer in this shape; use"),
        ({**ALL, "critical_pressure": 0.0, "harmonic": 1, "chart": chart(10.0, 0.0)},
         "Unstable at any pressure in harmonic 1."),
        ({"command": "critical", **FOUND, "critical_pressure": 290608.0}, "Stable up to 290.6 kPa"),
        ({**ALL, "critical_pressure": 9.0, "harmonic": 1, "chart": chart(*[9.0] * 17)},
         "Stable up to 9 Pa. Above that the film buckles locally (1 wave around)."),
        ({**ALL, "critical_pressure": 9.0, "harmonic": 1, "chart": chart(10.0, 9.0)},
         "Stable in the 2 harmonics that were looked at up to 9 Pa"),
        ({**ALL, "critical_pressure": None, "harmonic": 0, "chart": chart(None, None)},
         "Stable at any pressure in the 2 harmonics that were looked at."),
        ({"command": "mesh-study", "verdict": ["It falls."]}, "It falls."),
        ({"command": "inflate", "converged": True, "pressure": 5.0},
         "Equilibrium found at 5 Pa. Run lobefem modes"),
        ({"command": "perturb", "outcome": "returned", "reason": "at rest", "distance": 4e-13},
         "The balloon returned to its shape after release (stable, within 0.001 mm)."),
        ({"command": "perturb", "outcome": "distorted under the constraint"},
         "The balloon is still held in this"),
    ],
)  # fmt: skip
def test_the_first_sentence(results, said):
    assert verdict(results)[0].startswith(said)


@pytest.mark.parametrize(
    ("results", "said"),
    [
        ({"film": "isotropic"}, "Mesh: not checked (24 x 32 divisions). Add --mesh-study for an error bar."),
        ({"film": "fixed-wrinkles"}, "Mesh: not checked (24 x 32 divisions). Add --mesh-study for an error"),
        ({"divisions": None}, "Mesh: not checked. Repeat with a finer one."),
        ({"command": "harmonics"}, "Mesh: not checked (24 x 32 divisions). Repeat with --divisions 36x48"),
        (
            {"sides": {}, "state": "ideal"},
            "not checked (24 x 32 divisions). For a study of the mesh use --state",
        ),
    ],
)
def test_a_mesh_that_was_not_checked_is_named(results, said):
    sentences = verdict({"command": "critical", **FOUND, **results})
    assert sentences[1].startswith(said) or said in sentences[1]
    wrinkles = [sentence for sentence in sentences if "goes to zero as it is refined" in sentence]
    assert len(wrinkles) == (results.get("film") == "fixed-wrinkles")


MESHES = [
    {"divisions": [n, n], "critical_pressure": p} for n, p in ((12, 2700.0), (18, 2460.0), (28, 2350.0))
]
CONVERGES = {"mesh_behaviour": "converges", "mesh_limit": 2275.6}


@pytest.mark.parametrize(
    ("study", "said", "mesh"),
    [
        (
            CONVERGES | {"mesh_error": 0.0376, "mesh_asymptotic": True},
            "Stable up to 2276 Pa ± 3.8 %. Above that the film buckles locally (7 waves around).",
            "Mesh: checked, ± 3.8 % (3 meshes, the finest of 28 x 28 divisions).",
        ),
        (
            CONVERGES | {"mesh_error": 1e-6, "mesh_asymptotic": False},
            "Stable up to 2276 Pa ± 0.01 %.",
            "Mesh: checked, ± 0.01 % (3 meshes, the finest of 28 x 28 divisions; they do not follow one law",
        ),
        (
            {"mesh_behaviour": "falls", "mesh_error": None, "mesh_limit": 0.0},
            "There is no critical pressure to quote: it falls as the mesh is refined, with no limit in "
            "sight (2700 Pa, 2460 Pa and 2350 Pa on 12 x 12, 18 x 18 and 28 x 28 divisions).",
            "Mesh: checked on 3 meshes, the finest of 28 x 28 divisions: no limit in sight, so do not",
        ),
        (
            {"mesh_behaviour": "open", "mesh_error": None, "mesh_limit": None},
            "There is no critical pressure to quote yet: it has not converged (2700 Pa, 2460 Pa and 2350 Pa",
            "Mesh: checked on 3 meshes, the finest of 28 x 28 divisions, which do not show a limit.",
        ),
    ],
)
def test_a_mesh_study_gives_the_answer_its_error_bar(study, said, mesh):
    found = {"command": "critical", **FOUND, "film": "tension-field"}
    first, *rest = verdict(found | {"meshes": MESHES} | study)
    assert first.startswith(said)
    assert any(sentence.startswith(mesh) for sentence in rest)


def test_seams_without_hoops_are_named_where_there_is_no_limit():
    results = {"command": "critical", **FOUND, "film": "tension-field", "mesh_behaviour": "falls"}
    first = verdict(results | {"meshes": MESHES, "lobes": 3, "hoops": None})[0]
    assert first.endswith("Only film holds the seams, in a band one cell wide: give the balloon hoops.")
    assert "hoops" not in verdict(results | {"meshes": MESHES, "lobes": 3, "hoops": 2e9})[0]


def test_no_instability_on_any_mesh_is_said():
    rows = [row | {"critical_pressure": None} for row in MESHES]
    results = {"command": "critical", "critical_pressure": None, "reason": "no instability found",
               "meshes": rows, "mesh_behaviour": "open", "mesh_error": None}  # fmt: skip
    assert "Mesh: checked, the same on 3 meshes, the finest of 28 x 28 divisions." in verdict(results)


def test_eigenvalues_have_their_error_bars():
    entry = {"pressure": 500.0, "stable": True, "modes": [], "mesh_asymptotic": True}
    rows = [{"divisions": [n, n], "lowest": [v]} for n, v in ((12, 1.2), (18, 1.1), (28, 1.05))]
    results = {"command": "modes", "mesh_behaviour": "converges", "mesh_error": 0.04, "meshes": rows}
    bar = entry | {"mesh_behaviour": "converges", "mesh_error": 0.04, "mesh_limit": 1.02}
    sentences = verdict(results | {"pressures": [bar]})
    assert sentences[0] == "Stable at 500 Pa."
    assert sentences[1] == "Lowest eigenvalue at 500 Pa: 1.02 Pa/m ± 4 %."
    assert "Mesh: checked, ± 4 % (3 meshes, the finest of 28 x 28 divisions)." in sentences
    rows[2]["lowest"] = [-0.3]
    (said,) = [s for s in verdict(results | {"pressures": [bar]}) if "depends on the mesh" in s]
    assert said.endswith("the lowest eigenvalue is 1.2, 1.1 and -0.3 Pa/m from coarse to fine.")
    falls = entry | {"mesh_behaviour": "falls", "mesh_error": None, "mesh_limit": None}
    rows[2]["lowest"] = [0.9]
    assert (
        "1.2, 1.1 and 0.9 Pa/m. It falls, with no limit in sight."
        in verdict(results | {"pressures": [falls]})[1]
    )


def test_pressures_of_modes():
    low = {"pressure": 500.0, "stable": True, "modes": []}
    high = {"pressure": 2000.0, "stable": False, "modes": [{"kind": "sway", "harmonic": 1}]}
    results = {"command": "modes", "pressures": [low, low | {"pressure": 1000.0}, high], **MESH}
    said = ["Stable at 500 Pa, 1000 Pa.", "Unstable at 2000 Pa: the stack sways sideways."]
    mesh = "Mesh: not checked (24 x 32 divisions). Add --mesh-study for an error bar."
    assert verdict(results | {"lobes": 3}) == [*said, mesh]
    undecided = low | {"pressure": 700.0, "stable": False, "verdict": "undecided"}
    assert verdict(results | {"pressures": [undecided]})[0] == (
        "At 700 Pa the lower bound of the lowest eigenvalue is negative, the upper one positive: the film "
        "model gives no answer in this shape; use --state inflated."
    )
    warned = results | {"film": "fixed-wrinkles", "warnings": [FIXED_WRINKLES]}
    assert verdict(warned) == [said[0], "Unstable at 2000 Pa: the balloon sways sideways.", mesh]
    assert verdict(warned | {"warnings": []})[-1].startswith("With fixed wrinkles the critical pressure")


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"strength": 1.7e8, "strength_pressure": 3900.0},
         "The film reaches its strength of 170 MPa at about 3900 Pa, before the balloon turns unstable"),
        ({"strength": None}, "The film is stressed to 245 MPa at most there; compare that with its strength"),
        ({"strength": 4.9e8, "strength_pressure": None},
         "The film is stressed to 245 MPa at most there, 50 % of its strength."),
    ],
)  # fmt: skip
def test_what_breaks_first_is_named(more, said):
    sentences = verdict({"command": "critical", **FOUND, "max_stress": 2.45e8, **more})
    first = next(k for k, sentence in enumerate(sentences) if sentence.startswith(said))
    assert first == (0 if more.get("strength_pressure") else 1)
    assert sum("strength" in sentence for sentence in sentences) == 1


def test_film_that_breaks_first_is_held_against_the_limit_of_a_mesh_study():
    results = {"command": "critical", **FOUND, "strength": 1.7e8, "strength_pressure": 3900.0}
    said = verdict(results | {"mesh_behaviour": "converges", "mesh_limit": 5400.0, "mesh_error": 0.02})
    assert said[0].endswith("before the balloon turns unstable at 5400 Pa ± 2 %.")
    assert said[1].startswith("Stable up to 5400 Pa ± 2 %.")


def test_stress_of_a_pumpkin_that_is_nowhere_stable_has_its_pressure():
    found = {"critical_pressure": 0.0, "stable": [], "searched_from": 50.0, "searched_to": 200.0}
    said = verdict({"command": "critical", "gores": 64, "harmonic": 3, "max_stress": 2e6, **found})
    assert any(sentence.startswith("The film is stressed to 2 MPa at most at 200 Pa") for sentence in said)


def test_film_that_breaks_at_a_pressure_is_named():
    entry = {"pressure": 500.0, "stable": True, "modes": [], "max_stress": 3e8}
    said = (
        "The film is stressed to 300 MPa at most at 500 Pa, beyond its strength of 170 MPa: it breaks before."
    )
    results = {"strength": 1.7e8, **MESH}
    assert said in verdict({"command": "modes", "pressures": [entry], **results})
    assert said in verdict({"command": "inflate", "converged": True, **entry, **results})


def test_where_the_gas_presses_is_said_where_it_matters():
    critical = {"command": "critical", **FOUND, "support": "clamped"}
    assert "--load closed" in verdict(critical | {"load": "film"})[-1]
    bar = verdict(critical | {"load": "closed", "bar": "rigid"})[-1]
    assert bar.endswith("if yours has none, add --bar none.")
    for other in ({"load": "closed"}, {"load": "closed", "bar": None}, {"load": "film", "support": "fixed"}):
        assert "--bar none" not in " ".join(verdict(critical | other))
        assert "--load closed" not in " ".join(verdict(critical | other))


@pytest.mark.parametrize(
    ("real", "imag", "swings"),
    [(0.23, 47.0, True), (2.0, 0.004, False), (1e-7, 2e-7, False), (-1.0, 9.0, False)],
)
def test_complex_pairs_that_swing_are_named(real, imag, swings):
    modes = [{"real": real, "imag": imag}, {"real": 90.0, "imag": 0.0}]
    entry = {"pressure": 9000.0, "stable": real > 0, "modes": modes}
    said = " ".join(verdict({"command": "modes", "pressures": [entry], **MESH}))
    assert ("flutter" in said) is swings


@pytest.mark.parametrize(
    "results",
    [
        {},
        {"command": "sweep"},
        {"command": "critical", "error": "no"},
        {"command": "critical"},
        {"command": "modes", "pressures": 3},
        {"command": "modes", "pressures": [{"stable": True}, 4]},
        {"command": "perturb", "outcome": []},
        {"command": "mesh-study", "verdict": "x"},
        {"command": "inflate", "pressure": "5"},
    ],
)
def test_nothing_is_said_where_nothing_is_known(results):
    assert verdict(results) == []
