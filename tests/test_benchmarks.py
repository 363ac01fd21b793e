"""The comparison of programs runs on the coarsest mesh, and its answers are right; times do not matter."""

import json
import re

import numpy as np
import pytest

from benchmarks import cost_model, pumpkin_evolver, pumpkins, scaling, scaling_report
from benchmarks.compare import PROGRAMS, attempt, medians, run
from benchmarks.problem import CASES, EXACT, MESHES, Answer, Case, film
from benchmarks.programs import Job
from benchmarks.report import exponent, write_report

COARSE = MESHES[0]
pytestmark = pytest.mark.serial


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("program", PROGRAMS)
def test_answers_are_right(program, case):
    module = PROGRAMS[program]
    if why := module.missing() or module.unable(Case(case, COARSE)):
        pytest.skip(why)
    record = attempt(program, Case(case, COARSE), 300)
    assert record["right"], record["reason"]
    assert record["volume_error"] < 1e-9
    assert record["iterations"] >= 3
    assert 1 < record["memory"] < 2000
    if program == "lobefem":
        assert record["profile"]["stages"]["numeric factorisation"]["calls"] <= record["iterations"]
    if program == "lobefem, Newton":
        assert record["profile"]["stages"]["numeric factorisation"]["calls"] == record["iterations"]


def test_the_mesh_is_that_of_the_exact_answers():
    case = Case("wrinkled", COARSE)
    mesh = film(case)
    assert case.unknowns == mesh.points.size - 3 * (len(mesh.bottom) + len(mesh.top))
    # within what the film bulges by
    assert mesh.volume(0 * mesh.points) == pytest.approx(EXACT["taut", COARSE][0], rel=1e-3)
    assert mesh.volume(mesh.start(case)) > mesh.volume(0 * mesh.points)


def test_a_wrong_answer_does_not_count():
    case = Case("taut", COARSE)
    volume, displacement = EXACT["taut", COARSE]
    assert Answer(volume, displacement, 4).right(case)
    assert not Answer(volume * (1 + 2e-7), displacement, 4).right(case)
    assert not Answer(volume, displacement * 1.001, 4).right(case)
    assert not Answer(float("nan"), displacement, 4).right(case)


def test_a_process_that_hangs_is_ended(tmp_path):
    record = run(Job(["sh", "-c", "sleep 60 & wait"]), tmp_path, 0.3)
    assert record["code"] is None
    assert record["seconds"] < 30


def test_the_report(tmp_path):
    records = [
        {
            "program": program,
            "case": "taut",
            "divisions": divisions,
            "unknowns": Case("taut", divisions).unknowns,
            "right": factor > 0,
            "reason": "" if factor > 0 else "no answer",
            "seconds": factor * Case("taut", divisions).unknowns ** 1.5,
            "memory": 10.0,
            "cpu": 1.0,
            "volume_error": 1e-10,
            "displacement_error": 1e-9,
            "iterations": 4,
        }
        | ({"profile": {"solve": 3.0, "floor": floor, "stages": {}}} if floor else {})
        for program, factor, floor in (
            ("lobefem", 2.0, 2.0),
            ("lobefem, Newton", 3.0, 4.0),
            ("NGSolve", 6.0, 0.0),
            ("Kratos", 0.0, 0.0),
        )
        for divisions in MESHES[:2]
        for _ in range(3)
    ]
    rows = medians(records)
    json.dumps(rows)
    assert exponent([row for row in rows if row["program"] == "NGSolve"]) == pytest.approx(1.5)
    first = records[0] | {"profile": {"stages": {"form compilation": {"seconds": 31.4}}}}
    write_report(tmp_path, rows, [first])
    text = (tmp_path / "results.md").read_text()
    assert re.search(r"\| 24x32 \| 2208 \| NGSolve \| \d+\.\d+ \| 3.00 \|", text)
    assert re.search(r"\| lobefem \| .* \| 1.50 x its floor, 0.75 x Newton's \|", text)
    assert re.search(r"\| Kratos \|  \|  .* no answer \|", text)
    assert "Time grows as a power of the unknowns: lobefem 1.50" in text
    assert "the first run, taut, took 31.4 s" in text
    assert (tmp_path / "scaling.png").stat().st_size > 1000


def record(unknowns, ranks):
    """A run of known laws: linear but for N^1.5 flops and N log N solves; two ranks are twice as fast."""
    N, P = unknowns, ranks
    parts = {"residual": 1e-6 * N / P, "tangent": 2e-6 * N / P, "symbolic": 1e-6 * N}
    parts["solve"] = 1e-9 * N * np.log2(N) / P
    parts |= {"numeric": 1e-7 * N**1.5 / 1e3 / P, "compressed": 0.5e-7 * N**1.5 / 1e3 / P}
    spent = 3 * (parts["residual"] + parts["tangent"]) + 2 * parts["symbolic"] + 60 * parts["solve"]
    spent += 2 * parts["numeric"] + 2 * parts["compressed"] + 5e-6 * N / P
    return {
        "divisions": [N, N], "load": "closed", "ranks": P, "unknowns": N, "newton": 4, "tangents": 3,
        "factorisations": 2, "symbolic": 2, "solves": 60, "start": {"cpu": 1.0, "seconds": 1.0},
        "whole": {"cpu": 1.0 + spent, "seconds": 1.0 + spent}, "memory": P * 100 + N / 1000,
        "parts": {name: {"cpu": value} for name, value in parts.items()},
        "steps": {name: {"cpu": 1.0} for name in ("mesh", "set-up", "inflate", "modes")},
        "factors": {"entries": 5.0 * N * np.log2(N), "flops": 0.1 * N**1.5, "front": 0.01 * N**0.5},
    }  # fmt: skip


def test_the_cost_model_finds_the_laws_of_its_runs(tmp_path):
    runs = [record(N, P) for N in (10**4, 10**5, 10**6) for P in (1, 2)]
    model = cost_model.fit(runs, latency=0.0, bandwidth=np.inf)
    assert model.flops[1] == pytest.approx(1.5)
    for P in (1, 2):  # on two ranks the analysis stays as long as it was
        assert model.run(10**7, P)["whole"] == pytest.approx(record(10**7, P)["whole"]["cpu"], rel=1e-6)
    assert model.run(10**6, 1)["memory"] == pytest.approx(1100 * 2**20, rel=1e-6)
    # latency tells where there is little left to do
    slow = cost_model.fit(runs, latency=1e-3).run(10**4, 4096)["whole"]
    assert slow > model.run(10**4, 4096)["whole"] + 10
    assert scaling_report.exponent([r for r in runs if r["ranks"] == 1]) == pytest.approx(1.0, abs=0.2)


def test_a_scaling_run_tells_time_memory_and_the_same_answer(tmp_path):
    found = scaling.run((6, 8), "closed", 1, True, 100)
    assert found["unknowns"] == 3 * (4 * 6 - 1) * 8 + 5  # two rims follow their plates
    assert found["tangents"] >= 2
    assert found["lowest"][0] == pytest.approx(found["lowest"][1], rel=1e-6)  # a pair of sways
    assert all(row["residual"] < 1e-4 for row in found["solvers"])
    kept = scaling.with_fastest([found], found | {"whole": {"cpu": 1e9}})
    assert kept == [found]
    scaling_report.write_report(tmp_path, [found])
    assert f"| {found['unknowns']} | 1 |" in (tmp_path / "scaling.md").read_text()


@pytest.mark.slow
@pytest.mark.serial
def test_pumpkin_of_surface_evolver():
    if not pumpkin_evolver.executable():
        pytest.skip("Surface Evolver is not there")
    size = 12, (8, 2)
    other = pumpkin_evolver.by_evolver(*size)
    for full in (False, True):
        ours = pumpkin_evolver.by_lobefem(*size, full)
        assert ours["volume"] == pytest.approx(other["volume"], rel=1e-5)
        assert ours["eigenvalue"] == pytest.approx(other["eigenvalue"], rel=1e-6)


def test_one_gore_and_the_full_model_of_the_pumpkins_are_the_same_balloon():
    one, full = (pumpkins.run(part, (4, 2)) for part in ("sector-8", "full-8"))
    assert one["answer"] == pytest.approx(full["answer"], rel=1e-6)
    assert one["memory"] >= one["above"] >= 0


def test_the_extrapolation_follows_a_power_law():
    assert pumpkins.extrapolated([8, 16, 32], [1.0, 3.0, 12.0]) == pytest.approx(12.0 * (280 / 32) ** 2)
