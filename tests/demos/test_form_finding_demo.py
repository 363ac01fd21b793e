"""The form-finding demo on a coarse mesh."""

import json
import re

import pytest
from loading import load

from mpi4py import MPI

pytestmark = pytest.mark.serial


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
