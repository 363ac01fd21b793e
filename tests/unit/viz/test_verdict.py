"""What results say of stability, in sentences."""

import pytest

from lobefem.viz.verdict import verdict

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
         "Stable below 4420 Pa, unstable from there on in a local mode of harmonic 7."),
        ({"command": "critical", **FOUND, "only_harmonic": 7},
         "Stable in harmonic 7, which alone was looked at, below 4420 Pa, unstable from there"),
        ({"command": "critical", **FOUND, "state": "inflated"}, "Stable as its pressure rises below 4420 Pa"),
        ({"command": "critical", **FOUND, "point": "limit point"}, "Stable up to 4420 Pa, a limit point;"),
        ({"command": "critical", **FOUND, "bounds": [100.0, 250.5]},
         "Stable below 100 Pa, unstable above 250.5 Pa; between"),
        ({"command": "critical", **FOUND, "bounds": (100.0, None)}, "Stable below 100 Pa, no upper bound"),
        ({"command": "critical", **FOUND, "critical_pressure": None, "reason": "stable up to 20000 Pa"},
         "Stable up to 20000 Pa."),
        ({"command": "critical", **FOUND, "critical_pressure": 0.0, "reason": "unstable at any pressure"},
         "Unstable at any pressure."),
        ({"command": "critical", **FOUND, "critical_pressure": 0.0, "reason": "unstable at any pressure",
          "only_harmonic": 7}, "Unstable at any pressure in harmonic 7, which alone was looked at."),
        ({"command": "critical", **FOUND, "critical_pressure": 0.0, "bounds": [0.0, 250.5]},
         "Unstable above 250.5 Pa; below, this film's law does not tell whether the balloon is stable."),
        ({"command": "critical", **FOUND, "critical_pressure": 0.0, "bounds": [0.0, None]},
         "This film's law does not tell whether the balloon is stable."),
        ({**ALL, "critical_pressure": 0.0, "harmonic": 1, "chart": chart(10.0, 0.0)},
         "Unstable at any pressure in harmonic 1."),
        ({"command": "critical", **FOUND, "critical_pressure": 290608.0}, "Stable below 290.6 kPa"),
        ({**ALL, "critical_pressure": 9.0, "harmonic": 1, "chart": chart(*[9.0] * 17)},
         "Stable below 9 Pa, unstable from there on in a local mode of harmonic 1."),
        ({**ALL, "critical_pressure": 9.0, "harmonic": 1, "chart": chart(10.0, 9.0)},
         "Stable in the 2 harmonics that were looked at below 9 Pa"),
        ({**ALL, "critical_pressure": None, "harmonic": 0, "chart": chart(None, None)},
         "Stable at any pressure in the 2 harmonics that were looked at."),
        ({"command": "mesh-study", "verdict": ["It falls."]}, "It falls."),
        ({"command": "inflate", "converged": True, "pressure": 5.0}, "In equilibrium at 5 Pa."),
        ({"command": "perturb", "outcome": "returned", "reason": "at rest"},
         "Let go, the balloon returns: at rest."),
        ({"command": "perturb", "outcome": "distorted under the constraint"}, "Held distorted;"),
    ],
)  # fmt: skip
def test_the_first_sentence(results, said):
    assert verdict(results)[0].startswith(said)


@pytest.mark.parametrize(
    ("film", "said"),
    [
        ("fixed-wrinkles", "That pressure is the mesh's (24 × 32 divisions), not the balloon's"),
        ("isotropic", "compare with a finer one (--divisions or --mesh-study)."),
        ("tension-field", "compare with a finer one (--divisions)."),
    ],
)
def test_whose_a_critical_pressure_is(film, said):
    (_, whose) = verdict({"command": "critical", **FOUND, "film": film})
    assert said in whose


def test_pressures_of_modes():
    low = {"pressure": 500.0, "stable": True, "modes": []}
    high = {"pressure": 2000.0, "stable": False, "modes": [{"kind": "sway", "harmonic": 1}]}
    results = {"command": "modes", "pressures": [low, low | {"pressure": 1000.0}, high], **MESH}
    said = ["Stable at 500 Pa, 1000 Pa.", "Unstable at 2000 Pa in a sway mode of harmonic 1."]
    assert verdict(results) == said
    undecided = low | {"pressure": 700.0, "stable": False, "verdict": "undecided"}
    assert verdict(results | {"pressures": [undecided]}) == [
        "At 700 Pa this film's law does not tell whether the balloon is stable: only the lower bound of its "
        "lowest eigenvalue is negative."
    ]
    results["film"] = "fixed-wrinkles"
    assert verdict(results)[0].startswith("Stable on this mesh (24 × 32 divisions) at 500")


def test_where_the_gas_presses_is_said_where_it_matters():
    critical = {"command": "critical", **FOUND, "support": "clamped"}
    assert "--load closed" in verdict(critical | {"load": "film"})[-1]
    for other in ({"load": "closed"}, {"load": "film", "support": "fixed"}):
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
