"""The stability demo on coarse meshes."""

import json
import re
import sys

import numpy as np
import pytest
from loading import load

from mpi4py import MPI

pytestmark = pytest.mark.serial

PRESSURES = (100.0, 1000.0, 4000.0)


@pytest.fixture(scope="module")
def demo():
    return load("stability")


@pytest.fixture(scope="module")
def numbers(demo, out):
    return demo.run((6, 12), PRESSURES, out, around=(12, 16))


def branch(numbers, case, kind, harmonic):
    (found,) = [
        b
        for b in numbers["cases"][case]["branches"]
        if (b["kind"], b["harmonic"], b["rank"]) == (kind, harmonic, 0)
    ]
    assert found["pressures"] == list(PRESSURES)
    return np.array(found["values"])


@pytest.mark.parametrize("law", ["fixed-wrinkles", "isotropic"])
@pytest.mark.parametrize("size", ["single", "stack"])
@pytest.mark.parametrize(("kind", "harmonic"), [("sway", 1), ("twist", 0)])
def test_global_modes_rise_with_the_pressure(numbers, size, law, kind, harmonic):
    values = branch(numbers, f"{size}, {law}", kind, harmonic)
    assert (values > 0).all()
    assert (np.diff(values) > 0).all()


def test_twist_of_one_lobe(numbers):
    # 157 Pa/m on 24 x 32; the coarse mesh is 70 % stiffer, but no other mode is near
    at_1000 = branch(numbers, "single, fixed-wrinkles", "twist", 0)[1]
    assert 157 < at_1000 < 350


def test_the_stack_sways_far_more_softly_than_one_lobe(numbers):
    one = branch(numbers, "single, fixed-wrinkles", "sway", 1)
    four = branch(numbers, "stack, fixed-wrinkles", "sway", 1)
    assert (one > 10 * four).all()


def test_film_load_on_moving_plates_has_complex_sway_pairs(numbers):
    shown = numbers["cases"]["stack, fixed-wrinkles"]["shown"]
    assert shown["asymmetry"] > 1e-4
    lowest, partner = shown["modes"][:2]
    assert lowest["kind"] == "sway"
    assert lowest["imag"] == -partner["imag"] > 0


@pytest.mark.parametrize("case", ["single, fixed-wrinkles", "stack, isotropic"])
def test_curves_pass_through_the_full_models_eigenvalues(numbers, case):
    shown = numbers["cases"][case]["shown"]
    assert max(mode["residual"] for mode in shown["modes"]) < 1e-5
    at = PRESSURES.index(shown["pressure"])
    values = {
        (b["harmonic"], round(b["values"][at], 3)): b["values"][at]
        for b in numbers["cases"][case]["branches"]
    }
    for mode in shown["modes"][:8]:
        same = [v for (n, _), v in values.items() if n == mode["harmonic"]]
        nearest = min(same, key=lambda v: abs(v - mode["real"]))
        assert nearest == pytest.approx(mode["real"], rel=1e-6)


def test_critical_pressure_falls_as_the_mesh_is_refined_around(numbers):
    coarse, fine = (row["stack"] for row in numbers["mesh_study"])
    assert fine < 0.5 * coarse


def test_isotropic_film_has_no_critical_pressure(numbers):
    assert numbers["cases"]["single, isotropic"]["critical_pressure"] is None
    assert numbers["cases"]["stack, isotropic"]["critical_pressure"] is None


def test_all_figures_are_there_and_not_empty(numbers, out):
    for case in ("single_fixed-wrinkles", "single_isotropic", "stack_fixed-wrinkles", "stack_isotropic"):
        for figure in ("eigenvalues", "modes"):
            data = (out / f"{case}_{figure}.png").read_bytes()
            assert data.startswith(b"\x89PNG")
            assert len(data) > 50_000
        assert (out / case / "fields.xdmf").stat().st_size > 1000
        assert (out / case / "fields.h5").stat().st_size > 10_000
    picture = out / "stack_modes_3d.png"
    assert picture.exists() == numbers["picture"]
    assert not numbers["picture"] or picture.stat().st_size > 20_000
    report = (out / "report.html").read_text(encoding="utf-8")
    assert report.count("fixed wrinkles the critical pressure depends on the mesh") == 1
    assert report.count("<img ") == 4 * (4 + 2)  # modes, stress, taut and wrinkled


def test_table_and_json_hold_what_was_returned(numbers, out):
    assert json.loads((out / "stability.json").read_text(encoding="utf-8")) == numbers
    table = (out / "table.md").read_text(encoding="utf-8")
    for row in numbers["paper"]:
        assert f"| {row['paper']} | {row['here']} | {row['verdict']} |" in table


def test_verdicts_follow_the_numbers(demo, numbers):
    words = sys.modules["paper_words"]
    changed = json.loads(json.dumps(numbers))
    case = changed["cases"]["single, fixed-wrinkles"]
    sway = next(b for b in case["branches"] if b["kind"] == "sway" and b["rank"] == 0)
    sway["values"].reverse()
    case["critical_pressure"], case["critical_harmonic"] = 4610.0, 7
    before = {row.paper: row.verdict for row in words.compare(numbers)}
    after = {row.paper: row.verdict for row in words.compare(changed)}
    rising = "single lobe, wrinkled: global modes become more stable as p grows"
    assert (before[rising], after[rising]) == ("agrees", "differs")
    crossing = "single lobe, wrinkled: stable up to about 4600 Pa"
    assert before[crossing] != after[crossing] == "agrees within 10 %"


def test_demo_refuses_unreadable_divisions(demo, capsys):
    with pytest.raises(SystemExit) as exit_:
        demo.main(["--divisions", "24"])
    assert exit_.value.code == 2
    assert "give two integers such as 24x32" in capsys.readouterr().err


def test_demo_reports_an_impossible_mesh_in_one_sentence(demo, shared_path, capsys):
    assert demo.main(["--divisions", "1x32", "--out", str(shared_path)]) == 2
    if MPI.COMM_WORLD.rank == 0:
        assert re.search(r"demo: .*divisions.*1", capsys.readouterr().err)


def test_modes_have_the_same_numbers_in_pictures_and_tables(numbers, out, comm):
    """Of those that are stored, and drawn; the report shows the paper's words as well."""
    if comm.rank:
        return
    for case, found in numbers["cases"].items():
        folder = out / case.replace(", ", "_")
        stored = json.loads((folder / "results.json").read_text())["stored_modes"]
        table = found["shown"]["modes"]
        assert len(stored) == 4
        for mode in stored:
            assert table[mode["number"] - 1]["real"] == mode["real"]
    text = (out / "report.html").read_text(encoding="utf-8")
    assert "Beside the paper&#39;s words" in text
    assert "stable up to about 4600 Pa" in text
