"""The demos run on coarse meshes, and the README's example as it is printed there."""

import importlib.util
import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

ROOT = Path(__file__).parents[1]
PRESSURES = (100.0, 1000.0, 4000.0)


def load(name):
    spec = importlib.util.spec_from_file_location(f"demo_{name}", ROOT / "demos" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def demo():
    return load("stability")


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    return MPI.COMM_WORLD.bcast(tmp_path_factory.mktemp("demo"), root=0)


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


@pytest.fixture(scope="module")
def paths(demo, tmp_path_factory):
    """The demo of held and inflated states, and where it wrote to."""
    folder = MPI.COMM_WORLD.bcast(tmp_path_factory.mktemp("paths"), root=0)
    return load("eigenvalues").run((4, 24), (500.0, 4000.0, 16000.0), folder, around=(), count=24), folder


def rank_zero(numbers, state, case, kind, harmonic):
    (found,) = [
        b
        for b in numbers[state]["cases"][case]["branches"]
        if (b["kind"], b["harmonic"], b["rank"]) == (kind, harmonic, 0)
    ]
    return found


@pytest.mark.parametrize("state", ["held", "inflated"])
@pytest.mark.parametrize("size", ["single", "stack"])
def test_global_modes_of_held_and_of_inflated_lobes_rise(paths, state, size):
    for kind, harmonic in (("sway", 1), ("twist", 0)):
        branch = rank_zero(paths[0], state, f"{size}, fixed-wrinkles", kind, harmonic)
        assert branch["pressures"][:2] == [500, 4000]
        assert (np.array(branch["values"]) > 0).all()
        assert (np.diff(branch["values"]) > 0).all()


@pytest.mark.parametrize("size", ["single", "stack"])
def test_inflated_wrinkled_film_crosses_near_the_held_one_and_below(paths, size):
    held, inflated = (paths[0][s]["cases"][f"{size}, fixed-wrinkles"] for s in ("held", "inflated"))
    assert 0.8 * held["critical_pressure"] < inflated["critical_pressure"] < held["critical_pressure"]
    assert inflated["critical_harmonic"] == held["critical_harmonic"]
    assert inflated["point"] == "bifurcation"
    assert inflated["projection"] < 1e-6
    stable, unstable = inflated["bracket"]
    assert stable <= inflated["critical_pressure"] <= unstable
    # the curve of that harmonic says the same
    local = rank_zero(paths[0], "inflated", f"{size}, fixed-wrinkles", "local", held["critical_harmonic"])
    assert local["values"][-1] < 0


def test_isotropic_film_that_the_gas_stretches_has_no_local_mode(paths):
    """One lobe stays stable; a stack that bulges enough goes sideways as a whole."""
    single, stack = (paths[0]["inflated"]["cases"][f"{size}, isotropic"] for size in ("single", "stack"))
    assert single["critical_pressure"] is None
    assert min(min(b["values"]) for b in single["branches"]) > 0
    assert stack["critical_harmonic"] == 1
    assert paths[0]["held"]["cases"]["stack, isotropic"]["critical_pressure"] > 1e5
    assert not any(b["kind"] == "local" for case in (single, stack) for b in case["branches"])


def test_each_redrawn_figure_stands_beside_the_papers_words(paths):
    numbers, folder = paths
    text = (folder / "eigenvalues.md").read_text(encoding="utf-8")
    for figure in (13, 15, 17, 19):
        for state in ("held", "inflated"):
            assert (folder / f"fig{figure}_{state}.png").read_bytes().startswith(b"\x89PNG")
            assert f"](fig{figure}_{state}.png)" in text
            for row in numbers[state]["paper"]:
                assert row["here"] in text
    sections = text.split("## Fig. ")[1:]
    assert [s[:2] for s in sections] == ["13", "15", "17", "19"]
    assert "4600 Pa" in sections[0]
    assert "3000 Pa" in sections[2]


def test_demo_refuses_unreadable_divisions(demo, capsys):
    with pytest.raises(SystemExit) as exit_:
        demo.main(["--divisions", "24"])
    assert exit_.value.code == 2
    assert "give two integers such as 24x32" in capsys.readouterr().err


def test_demo_reports_an_impossible_mesh_in_one_sentence(demo, shared_path, capsys):
    assert demo.main(["--divisions", "1x32", "--out", str(shared_path)]) == 2
    if MPI.COMM_WORLD.rank == 0:
        assert re.search(r"demo: .*divisions.*1", capsys.readouterr().err)


# --- form finding -------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def forming():
    return load("form_finding")


@pytest.fixture(scope="module")
def formed_out(tmp_path_factory):
    return MPI.COMM_WORLD.bcast(tmp_path_factory.mktemp("form"), root=0)


@pytest.fixture(scope="module")
def formed(forming, formed_out):
    return forming.run((16, 24), formed_out, between=(3.0,), stack=2)


def test_forms_agree_with_the_paper_where_it_agrees_with_itself(formed):
    verdicts = [row["verdict"] for row in formed["paper"]]
    assert verdicts[1:] == [
        "agrees",
        "agrees",
        "differs: no isotensoid of 5 m fits between these rims",
        "agrees",
    ]
    assert "E t = 187.5 N/m" in formed["paper"][0]["here"]
    errors = [f["off_exact"] for f in formed["forms"]]
    assert max(errors) < 0.003  # of R0
    assert [f["pressure"] for f in formed["forms"]] == [0.75, 10.0, 37.5]


def test_formed_lobes_have_the_isotensoids_modes(formed):
    for name in ("1 lobe", "2 lobes"):
        a, b = formed["formed"][name], formed["isotensoid"][name]
        assert a["critical_pressure"] == pytest.approx(b["critical_pressure"], rel=0.01)
        for mine, exact in zip(a["modes"], b["modes"], strict=True):
            assert mine["kind"] == exact["kind"]
            assert mine["value"] == pytest.approx(exact["value"], rel=0.02)


def test_forms_are_drawn_and_told(formed, formed_out):
    for figure in ("shapes", "stress"):
        data = (formed_out / f"{figure}.png").read_bytes()
        assert data.startswith(b"\x89PNG")
        assert len(data) > 50_000
    table = (formed_out / "table.md").read_text(encoding="utf-8")
    assert "| 1 lobe, sway 1 [Pa/m] |" in table
    for row in formed["paper"]:
        assert f"| {row['paper']} | {row['here']} | {row['verdict']} |" in table
    saved = json.loads((formed_out / "form_finding.json").read_text(encoding="utf-8"))
    assert saved["forms"][2]["m"] == formed["forms"][2]["m"]


def test_verdicts_on_forms_follow_the_numbers(forming, formed):
    changed = json.loads(json.dumps(formed))
    changed["forms"][2] |= {"off_exact": 0.01, "arc_length": 5.1, "sigma_error_at_5_pascals": 0.02}
    verdicts = [row.verdict for row in forming.compare(changed)]
    assert verdicts[2:] == ["differs", "agrees", "differs"]


def test_form_demo_refuses_bad_divisions_in_one_sentence(forming, shared_path, capsys):
    with pytest.raises(SystemExit) as exit_:
        forming.main(["--divisions", "24"])
    assert exit_.value.code == 2
    assert forming.main(["--divisions", "1x32", "--out", str(shared_path)]) == 2
    if MPI.COMM_WORLD.rank == 0:
        assert re.search(r"demo: .*divisions.*1", capsys.readouterr().err)


def test_tip_displacement_softens_and_stays_stable(shared_path):
    """Fig. 22's shape on a coarse stack of two: stiff at first, soft beyond, never falling."""
    demo = load("tip_displacement")
    numbers = demo.run([(8, 12)], 0.3, shared_path, lobes=2)
    (found,) = numbers["curves"].values()
    slopes = np.diff(found["reaction"]) / np.diff(found["parameter"])
    assert (slopes > 0).all()
    assert slopes[0] > 10 * slopes[-1]
    assert (np.diff(found["volume"]) < 0).all()
    assert max(found["residual"]) < 1e-7
    if MPI.COMM_WORLD.rank == 0:
        assert json.loads((shared_path / "tip_displacement.json").read_text())["lobes"] == 2
        assert (shared_path / "tip_displacement.png").stat().st_size > 10_000
        assert "N/m at first" in demo.words(numbers)[0]


def test_readme_example_runs_as_printed(capsys):
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL)
    namespace = {}
    exec(compile(block, "README.md", "exec"), namespace)
    modes = namespace["modes"]
    assert [m.kind for m in modes.modes[:3]] == ["sway", "sway", "twist"]
    # the figures in the README's comments
    assert modes[0].value.real == pytest.approx(2.01, abs=0.01)
    assert modes[2].value.real == pytest.approx(11.4, abs=0.1)
    assert namespace["critical"].pressure == pytest.approx(4420, abs=1)
    assert namespace["critical"].mode.harmonic == 7


@pytest.fixture(scope="module")
def released(tmp_path_factory):
    folder = MPI.COMM_WORLD.bcast(tmp_path_factory.mktemp("release"), root=0)
    return load("release").run((4, 6), 2, 1.0, folder), folder


def test_a_leaning_stack_returns_and_its_ledger_closes(released):
    numbers, folder = released
    assert numbers["outcome"] == "returned"
    assert numbers["ledger"]["error"] < 0.01
    assert numbers["lowest"] > 0
    assert (folder / "release.png").stat().st_size > 20_000
    assert json.loads((folder / "release.json").read_text(encoding="utf-8"))["outcome"] == "returned"


def test_less_damping_takes_a_stopped_release_farther(released):
    stopped = released[0]["stopped"]
    assert [row["damping"] for row in stopped] == [10.0, 1.0, 0.1]
    tops = [abs(row["top"][0]) for row in stopped]
    assert tops[0] > 2 * tops[1] > 2 * tops[2]
    assert stopped[0]["outcome"] == "not an equilibrium"
    assert stopped[2]["outcome"] == "returned"
