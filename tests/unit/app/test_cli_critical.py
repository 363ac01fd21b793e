"""`lobefem critical` and `lobefem harmonics`: their numbers."""

import json
from pathlib import Path

import numpy as np
import pytest

from lobefem.app import critical_command
from lobefem.app.states_command import KINK
from lobefem.io.design import Design
from lobefem.stability.one_sided import slack_critical_pressure
from lobefem.viz.verdict import verdict

from mpi4py import MPI

MESHES = Path(__file__).parents[3] / "meshes"
SINGLE, STACK4 = str(MESHES / "single.toml"), str(MESHES / "stack4.toml")
COARSE = ("--divisions", "6x10")


def test_the_critical_pressure_depends_on_the_mesh_and_says_so(lobefem_json, capfd):
    pressures = []
    for divisions in ("12x20", "12x26"):
        results, code = lobefem_json("critical", SINGLE, "--divisions", divisions)
        assert code == 0
        assert results["divisions"] == [int(n) for n in divisions.split("x")]
        assert results["kind"] == "local"
        assert results["harmonic"] >= 2
        assert "goes to zero as it is refined" in results["warnings"][0]
        pressures.append(results["critical_pressure"])
    assert pressures[0] > pressures[1] > 0


@pytest.mark.serial
@pytest.mark.slow
def test_one_harmonic_alone_is_no_lower_than_all_of_them(lobefem_json):
    lowest, _ = lobefem_json("critical", SINGLE, "--divisions", "12x20")
    for n in (3, lowest["harmonic"]):
        results, code = lobefem_json("critical", SINGLE, "--divisions", "12x20", "--harmonic", n)
        assert code == 0
        assert results["harmonic"] == n
        assert results["critical_pressure"] >= lowest["critical_pressure"] * (1 - 1e-6)
    assert results["critical_pressure"] == pytest.approx(lowest["critical_pressure"], rel=1e-6)


@pytest.mark.slow
def test_the_chart_of_harmonics_holds_the_critical_pressure(lobefem_json, shared_path):
    folder = shared_path / "chart"
    options = ("--divisions", "12x20")
    chart, code = lobefem_json("harmonics", STACK4, *options, "--out", folder)
    assert code == 0
    full, _ = lobefem_json("critical", STACK4, *options)
    assert chart["critical_pressure"] == pytest.approx(full["critical_pressure"], rel=1e-8)
    assert chart["harmonic"] == full["harmonic"]
    assert [row["harmonic"] for row in chart["chart"]] == list(range(11))
    assert "only the critical pressures of low harmonics converge" in chart["warnings"][0]
    if MPI.COMM_WORLD.rank == 0:
        assert (folder / "critical_pressures.png").read_bytes().startswith(b"\x89PNG")
        assert json.loads((folder / "results.json").read_text()) == chart
    some, _ = lobefem_json("harmonics", STACK4, *options, "--harmonics", "5,2:3")
    assert [row["harmonic"] for row in some["chart"]] == [5, 2, 3]
    assert some["chart"][1]["critical_pressure"] == pytest.approx(chart["chart"][2]["critical_pressure"])


def test_where_the_film_breaks_before_it_buckles(lobefem_json):
    """The pressure of the film's strength, between those of the path; exact in the ideal state."""
    film = ("--set", "film.strength=20 MPa", "--divisions", "4x8", "--film", "tension-field")
    path = ("--load", "closed", "--state", "inflated", "--limit", "6 kPa")
    found, code = lobefem_json("critical", STACK4, *film, *path)
    assert code == 0
    assert found["strength"] == 2e7 < found["max_stress"]
    assert len(found["hoop_tension"]) == 3
    reached = found["strength_pressure"]
    assert 0 < reached < (found["critical_pressure"] or found["limit"])
    there, _ = lobefem_json("inflate", STACK4, *film, "--load", "closed", "--pressure", reached)
    assert there["max_stress"] == pytest.approx(2e7, rel=0.05)
    assert "reaches its strength of 20 MPa" in verdict(found)[0]
    held, _ = lobefem_json("critical", SINGLE, "--divisions", "8x12", "--set", "film.strength=20 MPa")
    share = held["strength_pressure"] / held["critical_pressure"]
    assert share * held["max_stress"] == pytest.approx(2e7)
    weak, _ = lobefem_json("critical", SINGLE, "--divisions", "8x12", "--set", "film.strength=1e14")
    assert weak["strength_pressure"] is None
    stable, _ = lobefem_json("critical", SINGLE, "--divisions", "4x8", "--set", "film.strength=20 MPa")
    assert stable["critical_pressure"] is None
    assert stable["strength_pressure"] == pytest.approx(held["strength_pressure"], rel=0.2)


@pytest.mark.serial
@pytest.mark.slow
def test_the_critical_pressure_along_inflated_states(lobefem_json):
    options = ("--divisions", "12x20", "--limit", "30 kPa")
    found, code = lobefem_json("critical", SINGLE, *options, "--state", "inflated")
    assert code == 0
    held, _ = lobefem_json("critical", SINGLE, "--divisions", "12x20")
    assert found["critical_pressure"] == pytest.approx(held["critical_pressure"], rel=0.05)
    assert found["harmonic"] == held["harmonic"]
    assert found["point"] == "bifurcation"
    assert found["projection"] < 1e-3
    assert found["bracket"][0] <= found["critical_pressure"] <= found["bracket"][1] * (1 + 1e-9)
    low, _ = lobefem_json("critical", SINGLE, "--divisions", "6x10", "--limit", "300", "--state", "inflated")
    assert low["critical_pressure"] is None
    assert low["reason"] == "no instability found up to 300 Pa, the end of the search (--limit)"


@pytest.mark.slow
def test_a_mesh_study_says_that_fixed_wrinkles_have_no_critical_pressure(lobefem_json, shared_path, comm):
    folder = shared_path / "study"
    meshes = ("--meshes", "12x16,18x24,24x32")
    study, code = lobefem_json("critical", SINGLE, "--mesh-study", *meshes, "--out", folder)
    assert code == 0
    assert [row["divisions"] for row in study["meshes"]] == [[12, 16], [18, 24], [24, 32]]
    assert study["published"] == 4600
    assert any("no critical pressure" in sentence for sentence in study["verdict"])
    if comm.rank == 0:
        assert (folder / "mesh_study.png").stat().st_size > 20_000


@pytest.mark.serial
@pytest.mark.slow
def test_tension_field_film_has_bounds_at_its_kink(lobefem_json):
    film = ("--film", "tension-field", "--divisions", "12x20", "--support", "fixed")
    found, code = lobefem_json("critical", SINGLE, *film)
    assert code == 0
    sides = found["sides"]
    assert sides["wrinkled"] < sides["mean"] < sides["taut"]
    assert found["bounds"] == [sides["wrinkled"], sides["mean"]]
    chart, _ = lobefem_json("harmonics", SINGLE, *film)
    assert chart["bounds"][0] == pytest.approx(sides["wrinkled"], rel=1e-6)
    # null where no pressure makes the taut side unstable
    bounds = [(row["critical_pressure"], row["upper_bound"]) for row in chart["chart"] if row["kind"]]
    assert all(upper is None or lower <= upper for lower, upper in bounds)
    modes, _ = lobefem_json("modes", SINGLE, *film, "--count", "2")
    entry = modes["pressures"][0]
    assert entry["modes"][0]["real"] < entry["mean_modes"][0]["real"] < entry["taut_modes"][0]["real"]
    assert entry["verdict"] == "stable"
    between = str((sides["wrinkled"] + sides["mean"]) / 2)
    modes, _ = lobefem_json("modes", SINGLE, *film, "--count", "2", "--pressure", between)
    assert modes["pressures"][0]["bounds"][0] < 0 < modes["pressures"][0]["bounds"][1]
    assert modes["pressures"][0]["verdict"] == "undecided"
    assert "only a lower and an upper bound" in modes["warnings"][0]


@pytest.fixture
def slack_design(comm, shared_path):
    """The single lobe of tension-field film that hangs slack in its hoops."""
    file = shared_path / "slack.toml"
    if comm.rank == 0:
        text = Path(SINGLE).read_text(encoding="utf-8")
        wanted = 'law = "tension-field"\nhoop_slack = 1e-3\n'
        assert text.count('law = "fixed-wrinkles"') == 1
        file.write_text(text.replace('law = "fixed-wrinkles"', wanted), encoding="utf-8")
    comm.Barrier()
    return str(file)


def test_film_with_hoop_slack_has_one_tangent(lobefem_json, comm, slack_design):
    options = ("--divisions", "12x20", "--support", "fixed")
    found, code = lobefem_json("critical", slack_design, *options)
    assert code == 0
    assert not {"bounds", "sides"} & set(found)
    assert KINK not in found["warnings"]
    design = Design.load(slack_design, comm).with_overrides(
        {"mesh.divisions": "12x20", "plates.support": "fixed"}
    )
    balloon = design.balloon(design.surface(comm), prestressed=True)
    expected = slack_critical_pressure(balloon)
    assert found["critical_pressure"] == pytest.approx(expected.pressure, rel=1e-8)
    assert found["harmonic"] == expected.mode.harmonic
    without, _ = lobefem_json("critical", SINGLE, *options, "--film", "tension-field")
    assert KINK in without["warnings"]
    assert found["critical_pressure"] < without["sides"]["wrinkled"] * (1 - 1e-6)


def test_modes_of_film_with_hoop_slack_are_of_one_tangent(lobefem_json, comm, slack_design):
    options = (*COARSE, "--support", "fixed", "--count", "2")
    found, code = lobefem_json("modes", slack_design, *options)
    assert code == 0
    (entry,) = found["pressures"]
    assert not {"mean_modes", "taut_modes", "bounds"} & set(entry)
    assert KINK not in found["warnings"]
    wrinkled, _ = lobefem_json("modes", SINGLE, *options, "--film", "tension-field")
    assert KINK in wrinkled["warnings"]
    one, other = entry["modes"][0]["real"], wrinkled["pressures"][0]["modes"][0]["real"]
    assert one < other * (1 - 1e-6)  # slack film is softer in shear


@pytest.mark.parametrize(
    ("pressure", "reason"),
    [
        (np.inf, "stable at any pressure that the film can bear"),
        (0.0, "unstable at any pressure"),
    ],
)
def test_no_critical_pressure_is_said_in_words(lobefem_json, monkeypatch, pressure, reason):
    from lobefem.stability.linear_buckling import CriticalPressure

    monkeypatch.setattr(
        critical_command,
        "critical_pressure",
        lambda balloon, harmonic: CriticalPressure(pressure, None, (), (6, 10)),
    )
    results, code = lobefem_json("critical", SINGLE, *COARSE)
    assert code == 0
    assert results["critical_pressure"] == (None if pressure else 0.0)
    assert results["reason"] == reason
    assert results["kind"] is None


@pytest.mark.parametrize("mean", [250.0, np.inf])
def test_a_lower_bound_of_zero_is_no_instability(lobefem_json, monkeypatch, mean):
    from lobefem.stability.linear_buckling import CriticalPressure
    from lobefem.stability.one_sided import OneSidedPressures

    sides = OneSidedPressures(*(CriticalPressure(p, None, (), (6, 10)) for p in (0.0, mean, np.inf)))
    monkeypatch.setattr(critical_command, "one_sided_pressures", lambda balloon, harmonic: sides)
    results, code = lobefem_json("critical", SINGLE, *COARSE, "--film", "tension-field")
    assert code == 0
    assert results["bounds"] == [0.0, mean if np.isfinite(mean) else None]
    assert "between the bounds the film model gives no answer" in results["reason"]
    assert "the film model gives no answer in this shape" in verdict(results)[0]
