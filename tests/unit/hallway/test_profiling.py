"""Stages exclude each other and add up to the whole."""

import json
import time

import pytest

from lobefem import profiling
from lobefem.app.cli import main
from lobefem.equilibrium.inflation import inflate
from lobefem.fem.balloon import Balloon
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.model.end_plates import EndPlates
from lobefem.model.film import Isotropic
from lobefem.model.gas_pressure import GasPressure


@pytest.fixture
def profile():
    yield profiling.start()
    profiling.stop()


def test_stages_exclude_each_other(profile):
    @profiling.timed("residual")
    def inner():
        time.sleep(0.02)

    before = time.perf_counter()
    with profiling.stage("tangent"):
        time.sleep(0.01)
        inner()
        inner()
    passed = time.perf_counter() - before
    profile.update()
    seconds = profile.seconds
    assert seconds["residual"] >= 0.04
    assert 0.01 <= seconds["tangent"] <= passed - seconds["residual"] + 1e-3
    assert profile.calls["residual"] == 2
    assert profile.calls["tangent"] == 1


def test_a_failure_closes_its_stage(profile):
    with pytest.raises(ValueError, match="stop"), profiling.stage("mesh"):
        raise ValueError("stop")
    assert profile._open == [profiling.OTHER]


def test_counts_of_a_solve(comm, profile):
    parts = [GasPressure("closed"), EndPlates("fixed")]
    state = inflate(Balloon(lobed_cylinder(1, (6, 8), comm=comm), Isotropic(), parts), 5.0)
    profile.update()
    assert profile.calls["numeric factorisation"] == state.iterations
    assert profile.calls["symbolic factorisation"] == 1
    assert profile.calls["triangular solves"] == state.iterations
    assert profile.calls["mesh"] == 1
    assert 0 < profile.floor < profile.solve < profile.whole


def test_a_second_profile_counts_from_its_start(comm, profile):
    parts = [GasPressure("closed"), EndPlates("fixed")]
    balloon = Balloon(lobed_cylinder(1, (6, 8), comm=comm), Isotropic(), parts)
    first = inflate(balloon, 5.0)
    profile.update()
    second = profiling.start()
    state = inflate(balloon, 10.0, start=first)
    second.update()
    assert second.calls["numeric factorisation"] == state.iterations


def test_nothing_is_measured_before_start():
    before = profiling.Profile()
    with profiling.stage("mesh"):
        pass
    assert before.calls["mesh"] == 0


def test_command_line(comm, shared_path, capfd):
    design = shared_path / "d.toml"
    if comm.rank == 0:
        design.write_text('[mesh]\ndivisions = [4, 6]\n[film]\nlaw = "isotropic"\n[pressure]\nvalue = 5\n')
    comm.Barrier()
    out = shared_path / "r.json"
    code = main(["inflate", str(design), "--profile", "--json", str(out)])
    profiling.stop()
    assert code == 0
    comm.Barrier()
    profile = json.loads(out.read_text())["profile"]
    assert profile["stages"]["tangent"]["calls"] > 0
    assert profile["whole"] == pytest.approx(sum(s["seconds"] for s in profile["stages"].values()))
    text = capfd.readouterr().err
    assert ("numeric factorisation" in text) == (comm.rank == 0)
    assert ("Floor" in text) == (comm.rank == 0)
