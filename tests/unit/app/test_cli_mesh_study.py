"""Mesh studies of inflated states and of modes, from the command line; the designs of a newcomer's trial.

Three lobes of 1.2 m edge radius, 25 micron Mylar (4.5 GPa), tension-field film, closed load, with the rigid
bar that is there by default and without, with hoops of aluminium (20 x 20 mm) and without.
"""

from pathlib import Path

import pytest

from lobefem.io.design import Design
from lobefem.io.run_reader import load_run
from lobefem.viz.mesh_verdict import percent
from lobefem.viz.verdict import verdict

pytestmark = pytest.mark.serial

ROOT = Path(__file__).parents[3]
SINGLE = str(ROOT / "meshes" / "single.toml")
TRIAL = """
[shape]
kind = "isotensoid"
lobes = 3
edge_radius = 1.2
[film]
law = "tension-field"
E = "4.5 GPa"
thickness = "25 um"
[pressure]
load = "closed"
"""
HOOPS = """
[hoops]
EA = "28 MN"
"""


COARSE = ("--state", "inflated", "--mesh-study", "--meshes", "6x8,8x12,12x18")
FINER = ("--meshes", "8x10,12x16,18x24")


@pytest.fixture
def trial(shared_path):
    def write(text):
        path = shared_path / "trial.toml"
        path.write_text(text)
        return str(path)

    return write


# --- the trial's designs ------------------------------------------------------------------------


@pytest.mark.slow
def test_the_trials_answer_has_an_error_bar_that_covers_the_fine_meshes(lobefem_json, trial, capfd):
    """The trial found 5681, 5555 and 5497 Pa on 24 x 32 to 48 x 72, and would quote 5.45 kPa."""
    results, code = lobefem_json("critical", trial(TRIAL + HOOPS), *COARSE[:3], *FINER)
    assert code == 0
    assert [row["divisions"] for row in results["meshes"]] == [[8, 10], [12, 16], [18, 24]]
    assert [row["kind"] for row in results["meshes"]] == ["sway"] * 3
    assert (results["mesh_behaviour"], results["divisions"]) == ("converges", [18, 24])
    assert results["critical_pressure"] == results["meshes"][-1]["critical_pressure"]
    assert results["mesh_limit"] == pytest.approx(5450, rel=results["mesh_error"])
    assert 0.01 < results["mesh_error"] < 0.1
    first, *rest = verdict(results)
    assert first.startswith("Stable up to 55")
    assert " Pa ± 7.9 %. Above that the stack sways sideways." in first
    text = " ".join(rest)
    assert "Mesh: checked, ± 7.9 % (3 meshes, the finest of 18 x 24 divisions)." in text
    assert "The film is stressed to 2" in text
    assert "This run has a rigid bar along the axis" in text


@pytest.mark.slow
@pytest.mark.parametrize("hoops", ["", HOOPS])
def test_without_the_bar_no_instability_is_found_on_any_mesh(lobefem_json, trial, hoops):
    options = ("--bar", "none", *COARSE, "--limit", "8 kPa")
    results, code = lobefem_json("critical", trial(TRIAL + hoops), *options)
    assert code == 0
    assert [row["critical_pressure"] for row in results["meshes"]] == [None] * 3
    sentences = verdict(results)
    assert sentences[0] == "No instability found up to 8000 Pa, the end of the search (--limit)."
    assert "Mesh: checked, the same on 3 meshes, the finest of 12 x 18 divisions." in sentences


@pytest.mark.slow
def test_without_hoops_there_is_no_number(lobefem_json, trial):
    results, code = lobefem_json("critical", trial(TRIAL), *COARSE)
    assert code == 0
    assert results["mesh_error"] is None
    assert results["mesh_behaviour"] in ("falls", "open")
    first = verdict(results)[0]
    assert first.startswith("There is no critical pressure to quote")
    assert first.endswith("Only film holds the seams, in a band one cell wide: give the balloon hoops.")


@pytest.mark.slow
def test_without_hoops_a_study_of_fine_meshes_says_that_it_falls(lobefem_json, trial):
    """Half a minute: 279, 165 and 101 Pa on 24 x 32, 36 x 48 and 54 x 72 divisions."""
    results, code = lobefem_json("critical", trial(TRIAL), "--state", "inflated", "--tolerance", "2%")
    assert code == 0
    assert [row["divisions"] for row in results["meshes"]] == [[24, 32], [36, 48], [54, 72]]
    assert (results["mesh_behaviour"], results["mesh_error"]) == ("falls", None)
    assert results["meshes"][0]["critical_pressure"] == pytest.approx(278.6, rel=1e-3)
    assert "it falls as the mesh is refined, with no limit in sight" in verdict(results)[0]
    assert results["warnings"][-1] == (
        "the tolerance of 2 % is not met and cannot be: the answer falls as the mesh is refined, with no "
        "limit in sight"
    )


# --- studies ------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_study_begins_with_the_designs_mesh_and_has_the_answers_of_single_runs(lobefem_json, trial):
    """Each search begins near the coarser mesh's answer, which changes nothing in the answer."""
    path = trial(TRIAL + HOOPS)
    results, code = lobefem_json("critical", path, *COARSE[:2], "--mesh-study", "--divisions", "6x8")
    assert code == 0
    assert [row["divisions"] for row in results["meshes"]] == [[6, 8], [8, 12], [12, 18]]
    for row in results["meshes"]:
        mesh = "x".join(map(str, row["divisions"]))
        alone, _ = lobefem_json("critical", path, *COARSE[:2], "--divisions", mesh)
        assert row["critical_pressure"] == pytest.approx(alone["critical_pressure"], rel=2e-4)
        assert (alone["mesh_error"], alone["mesh_behaviour"]) == (None, None)
        assert f"Mesh: not checked ({row['divisions'][0]} x" in " ".join(verdict(alone))


@pytest.mark.slow
def test_a_tolerance_is_met_or_that_it_is_not_is_said(lobefem_json, trial):
    path = trial(TRIAL + HOOPS)
    options = ("--state", "inflated", "--divisions", "6x8", "--tolerance")
    results, code = lobefem_json("critical", path, *options, "30%")
    assert code == 0
    assert results["mesh_error"] <= results["mesh_tolerance"] == 0.3
    number = len(results["meshes"])
    assert 3 <= number <= 5
    assert not any("tolerance" in warning for warning in results["warnings"])
    meshes = ("--meshes", "6x8,8x12,12x18")
    results, code = lobefem_json("critical", path, "--state", "inflated", "--tolerance", "0.1%", *meshes)
    assert code == 0
    assert results["warnings"][-1].startswith("the tolerance of 0.1 % is not met by 3 meshes, whose")


@pytest.mark.slow
def test_eigenvalues_have_their_limit_at_each_pressure(lobefem_json, trial, shared_path):
    folder = shared_path / "run"
    pressures = ("--pressure", "500", "--pressure", "1 kPa", "--count", "2", "--out", folder)
    results, code = lobefem_json("modes", trial(TRIAL + HOOPS), *COARSE[:3], *FINER, *pressures)
    assert code == 0
    worst = max(entry["mesh_error"] for entry in results["pressures"])
    assert results["mesh_error"] == worst
    for k, entry in enumerate(results["pressures"]):
        column = [row["lowest"][k] for row in results["meshes"]]
        assert column[-1] == min(mode["real"] for mode in entry["modes"])
        assert entry["mesh_limit"] == pytest.approx(column[-1], rel=1.01 * entry["mesh_error"] + 1e-9)
    assert f"Mesh: checked, ± {percent(worst)} (3 meshes" in " ".join(verdict(results))
    # the fields are those of the finest mesh
    assert Design.load(folder / "design.toml").mesh.divisions == (18, 24)
    assert load_run(folder).results["divisions"] == [18, 24]


def test_what_cannot_be_refined_is_refused(refused):
    code, words = refused("critical", SINGLE, "--state", "inflated", "--mesh-study", "--meshes", "6x8,8x12")
    assert (code, "a mesh study of 2 mesh(es) shows no trend" in words) == (2, True)


@pytest.mark.slow
def test_an_unstructured_mesh_is_refined_by_its_size(lobefem_json, trial):
    path = trial(TRIAL + HOOPS + "[mesh]\nlayout = 'unstructured'\nsize = 0.5\n")
    results, code = lobefem_json("modes", path, *COARSE[:3], "--pressure", "500", "--count", "2")
    assert code == 0
    assert [row["size"] for row in results["meshes"]] == pytest.approx([0.5, 1 / 3, 2 / 9])
