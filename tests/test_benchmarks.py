"""The comparison of programs runs on the coarsest mesh, and its answers are right; times do not matter."""

import json
import re

import pytest
from mpi4py import MPI

from benchmarks.compare import PROGRAMS, attempt, medians, run
from benchmarks.problem import CASES, EXACT, MESHES, Answer, Case, film
from benchmarks.programs import Job
from benchmarks.report import exponent, write_report

COARSE = MESHES[0]
serial = pytest.mark.skipif(MPI.COMM_WORLD.size > 1, reason="starts processes of its own")


@serial
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


@serial
def test_a_process_that_hangs_is_ended(tmp_path):
    record = run(Job(["sh", "-c", "sleep 60 & wait"]), tmp_path, 0.3)
    assert record["code"] is None
    assert record["seconds"] < 30


@serial
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
        for program, factor in (("lobefem", 2.0), ("NGSolve", 6.0), ("Kratos", 0.0))
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
    assert re.search(r"\| Kratos \|  \|  .* no answer \|", text)
    assert "lobefem: time grows as unknowns^1.50" in text
    assert "the first run, taut, took 31.4 s" in text
    assert (tmp_path / "scaling.png").stat().st_size > 1000
