"""`lobefem optimise`: derivatives of a search's quantities, its optimum, its folder."""

import json
from pathlib import Path

import numpy as np
import pytest

from lobefem.app import cli, search_file
from lobefem.app.optimise_command import begin
from lobefem.app.search_ranking import feasible

pytestmark = pytest.mark.serial

PUMPKIN = Path(__file__).parents[3] / "meshes" / "pumpkin.toml"

SEARCH = f"""
design = "{PUMPKIN}"
goal = "mass"
harmonics = []
[set]
"mesh.divisions" = [8, 2]
"mesh.order" = 1
[vary]
"shape.half_angle" = ["40 deg", "65 deg"]
"tendons.foreshortening" = [0.0, 0.01]
[widths]
stations = [0.5]
range = [0.95, 1.05]
[limits]
max_stress = "0.75 MPa"
volume = "336 m^3"
"""


@pytest.fixture
def file(tmp_path):
    (tmp_path / "search.toml").write_text(SEARCH)
    return tmp_path / "search.toml"


@pytest.mark.slow
def test_gradients_are_those_of_solved_designs(file):
    file.write_text(
        SEARCH.replace("[set]", '[set]\n"shape.gores" = 128').replace(
            "harmonics = []", 'harmonics = [4]\nsearch_to = "500 Pa"'
        )
    )
    plan = search_file.load(file)
    solved = begin(plan, file.parent / "out", resume=False, overwrite=False)
    x = np.array([np.radians(52), 0.003, 1.01])
    record = solved(0, x, gradients=True)
    assert not record.fault
    assert 0 < record.values["p_4"] < 500
    for k in range(3):
        step = 1e-5 * (plan.high - plan.low)[k] * np.eye(3)[k]
        low, high = solved(0, x - step), solved(0, x + step)
        for name, gradient in record.gradients.items():
            expected = (high.values[name] - low.values[name]) / (2 * step[k])
            assert gradient[k] == pytest.approx(expected, rel=1e-3, abs=1e-6), name


@pytest.mark.slow
def test_the_optimum_beats_random_designs_and_is_found_again(file, tmp_path, capsys):
    """The lightest film that holds so much under a stress limit, from three starts, beside random designs."""
    out = tmp_path / "out"
    command = ["optimise", str(file), "--out", str(out)]
    assert cli.main([*command, "--random", "20", "--quiet"]) == 0
    results = json.loads((out / "results.json").read_text())
    masses = [run["best"]["values"]["mass"] for run in results["runs"]]
    assert len(masses) == 3
    assert max(masses) < 1.001 * min(masses)
    assert results["best"]["values"]["mass"] == pytest.approx(min(masses), rel=1e-3)
    kept = [json.loads(path.read_text()) for path in (out / "designs").glob("*.json")]
    assert len(kept) == results["designs"] > 20
    # none that was looked at keeps the limits and is lighter
    sound = [one["values"] for one in kept if not one["fault"]]
    sound = [v for v in sound if v["max_stress"] <= 0.75e6 and v["volume"] >= 336.0]
    assert min(v["mass"] for v in sound) > 0.998 * min(masses)
    for name in (
        "designs.csv",
        "pareto.png",
        "search.toml",
        "best/design/design.toml",
        "best/design/gore.dxf",
    ):
        assert (out / name).stat().st_size > 0
    # all is known: nothing is solved again
    before = {path: path.stat().st_mtime_ns for path in (out / "designs").glob("*.json")}
    assert cli.main([*command, "--random", "20", "--resume", "--json", "-"]) == 0
    assert json.loads(capsys.readouterr().out)["best"] == results["best"]
    assert before == {path: path.stat().st_mtime_ns for path in (out / "designs").glob("*.json")}


def test_a_folder_in_use_is_refused(file, tmp_path, refused):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "notes.txt").write_text("mine")
    for options, message in (
        ((), "is not empty; go on with --resume, replace it with --overwrite"),
        (("--resume",), "holds no search to go on with; leave out --resume"),
        (("--resume", "--overwrite"), "--resume goes on with a search and --overwrite replaces it"),
    ):
        code, said = refused("optimise", file, "--out", tmp_path / "out", *options)
        assert code == 2
        assert message in said


def test_a_design_that_cannot_be_is_a_fault(file, tmp_path):
    file.write_text(SEARCH.replace("[0.95, 1.05]", "[0.5, 1.05]"))
    plan = search_file.load(file)
    solved = begin(plan, tmp_path / "out", resume=False, overwrite=False)
    record = solved(0, np.array([0.8, 0.0, 0.5]))
    assert "less than the half chord" in record.fault
    assert not feasible(plan, record)


@pytest.mark.parametrize("command", ["optimise", "sweep"])
def test_a_file_for_json_that_cannot_be_is_refused_before_anything_is_solved(capfd, tmp_path, file, command):
    if command == "sweep":
        file.write_text(f'command = "inflate"\ndesign = "{PUMPKIN}"\n[vary]\nshape.gores = [8, 9]\n')
    out = tmp_path / "out"
    code = cli.main([command, str(file), "--out", str(out), "--json", str(tmp_path / "none" / "x.json")])
    assert code == 2
    assert (
        capfd.readouterr().err == f"lobefem: '{tmp_path / 'none'}' cannot be written to; give another place\n"
    )
    assert not out.exists()
