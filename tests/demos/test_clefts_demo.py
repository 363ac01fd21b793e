"""The demo of clefts on a coarse mesh: a stable design deploys, an unstable one stays clefted."""

import json

import pytest
from loading import load

from lobefem.equilibrium.clefts import HarmonicSeed

from mpi4py import MPI

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    folder = MPI.COMM_WORLD.bcast(tmp_path_factory.mktemp("clefts"), root=0)
    cases = (("angle", 100.0, HarmonicSeed(4, 0.4), False), ("angle", 400.0, HarmonicSeed(4, 0.1), False))
    return load("clefts").run((10, 4), out=folder, cases=cases, steps=4), folder


def test_the_stable_design_deploys(found):
    row = found[0]["cases"][0]
    assert row["symmetric_eigenvalue"] > 0
    assert row["outcome"] == "returned"
    assert row["distance"] < 1e-6
    assert abs(row["volume_deficit"]) < 1e-8
    assert row["contact_force"] == 0
    assert row["ledger_error"] < 0.01


def test_the_unstable_design_stays_clefted(found):
    row = found[0]["cases"][1]
    assert row["symmetric_eigenvalue"] < 0
    assert row["symmetric_harmonic"] == 4
    assert row["outcome"] == "distorted and stable"
    assert min(row["eigenvalues"]) > 0
    assert row["energy_above"] < 0  # downhill from a shape that is unstable
    assert row["volume_deficit"] < 0  # which encloses less
    assert row["contact_force"] > 0
    assert row["gap"] > 0
    assert row["ledger_error"] < 0.01
    assert row["distance"] > 0.1


def test_damping_has_no_say_and_at_low_pressure_it_deploys(found):
    numbers = found[0]
    row = numbers["cases"][1]
    for other in numbers["damped"]:
        assert other["outcome"] == "distorted and stable"
        assert other["lowest"] == pytest.approx(row["eigenvalues"][0], rel=1e-6)
        assert other["volume_gained"] == pytest.approx(-row["volume_deficit"], rel=1e-6)
    lowered = numbers["lowered"]
    assert 200 <= lowered["deployed_from"] < 320
    assert (
        lowered["pressures"][0]["symmetric_eigenvalue"] < 0 < lowered["pressures"][-1]["symmetric_eigenvalue"]
    )
    assert lowered["pressures"][-1]["distance"] < 1e-6


def test_the_demo_writes_what_it_found(found):
    numbers, folder = found
    assert json.loads((folder / "clefts.json").read_text(encoding="utf-8")) == numbers
    assert (folder / "clefts.png").stat().st_size > 10_000
    assert (folder / "table.md").read_text(encoding="utf-8").count("harmonic seed of m = 4") == 2
