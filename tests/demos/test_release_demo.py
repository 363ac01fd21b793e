"""The demo of a release on a coarse stack of two."""

import json

import pytest
from loading import load

from mpi4py import MPI


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
