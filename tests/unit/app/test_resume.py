"""Runs that were stopped go on with what they kept and end as if nothing had been; Ctrl-C stops at once."""

import json
import os
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import pytest

from lobefem.app import cli
from lobefem.io.run_folder import RunFolder

ROOT = Path(__file__).parents[3]
SINGLE, CYLINDER = (str(ROOT / "meshes" / name) for name in ("single.toml", "cylinder.toml"))
MODES = ("modes", SINGLE, "--divisions", "4x8", "--count", "2", "--pressure", "50", "--pressure", "100")
STUDY = ("--mesh-study", "--meshes", "4x8,6x12,8x16")
TENSION = ("--film", "tension-field", "--support", "fixed")

alone = pytest.mark.serial  # starts processes, which ranks of an MPI run must not


@pytest.fixture
def keeps(monkeypatch):
    """Counts what runs keep; `stop` is the number at which one is interrupted."""

    class Keeps:
        number, stop = 0, 0

    def counted(method):
        def keep(*arguments):
            method(*arguments)
            Keeps.number += 1
            if Keeps.number == Keeps.stop:
                raise KeyboardInterrupt

        return keep

    for name in ("keep", "keep_modes", "keep_step"):
        monkeypatch.setattr(RunFolder, name, counted(getattr(RunFolder, name)))
    return Keeps


def plain(results):
    """Results as pytest compares them to ten digits; how they were found may differ."""
    if isinstance(results, dict):
        other = ("versions", "iterations", "steps", "residual", "relative_residual", "state_residual")
        return {key: plain(value) for key, value in results.items() if key not in other}
    if isinstance(results, list):
        return [plain(value) for value in results]
    return pytest.approx(results, rel=1e-8, abs=1e-12) if isinstance(results, float) else results


@pytest.mark.slow
@pytest.mark.parametrize(
    ("stop", "arguments"),
    [
        (1, ("inflate", CYLINDER, "--divisions", "4x8")),
        (1, (*MODES, "--state", "inflated")),
        (3, ("critical", SINGLE, "--divisions", "4x8", "--state", "inflated", "--limit", "50")),
        (2, ("critical", SINGLE, "--mesh-study", "--meshes", "4x12,6x16,8x20")),
        (2, ("critical", SINGLE, *STUDY, "--state", "inflated", "--limit", "50")),
        (2, ("modes", SINGLE, *STUDY, "--count", "2", "--pressure", "5", "--pressure", "6")),
        (2, ("harmonics", SINGLE, "--divisions", "4x12", *TENSION)),
    ],
)
def test_a_run_that_was_stopped_ends_alike(lobefem_json, capfd, comm, keeps, shared_path, stop, arguments):
    whole, code = lobefem_json(*arguments, "--out", shared_path / "whole")
    assert code == 0
    total = keeps.number
    folder = str(shared_path / "run")
    keeps.number, keeps.stop = 0, stop
    assert cli.main([*arguments, "--out", folder]) == 130
    words = comm.bcast(capfd.readouterr().err, root=0)
    assert f"interrupted; the last accepted step is in {folder}" in words
    assert not (shared_path / "run" / "results.json").exists()
    keeps.number, keeps.stop = 0, 0
    again, code = lobefem_json(*arguments, "--out", folder, "--resume")
    assert code == 0
    assert plain(again) == plain(whole) or again == plain(whole)
    # the state that a path goes on from is kept once more
    assert keeps.number <= total - stop + 1


@pytest.mark.slow
def test_a_mesh_study_that_has_ended_is_the_same_study(lobefem_json, refused, shared_path):
    """Its folder holds the design of the finest mesh, and the run was begun with another one."""
    study = ("modes", SINGLE, *STUDY, "--count", "2", "--pressure", "5", "--out", str(shared_path / "run"))
    first, code = lobefem_json(*study)
    assert code == 0
    again, code = lobefem_json(*study, "--resume")
    assert code == 0
    assert plain(again) == plain(first)
    code, words = refused(*study, "--lobes", "2", "--resume")
    assert (code, "is of another design (lobes = 1); resume it with its" in words) == (2, True)


@pytest.mark.slow
def test_only_the_same_study_goes_on_and_other_versions_are_told(refused, lobefem_json, comm, shared_path):
    folder = str(shared_path / "run")
    assert lobefem_json(*MODES, "--out", folder)[1] == 0
    for other, message in [
        (("--count", "1"), f"the run in '{folder}' is of another study, with count '2'; repeat its command"),
        (("--lobes", "2"), f"the run in '{folder}' is of another design (lobes = 1); resume it with its"),
        (("--overwrite",), "--resume goes on with a run and --overwrite replaces it; give one of them"),
    ]:
        code, words = refused(*MODES, *other, "--out", folder, "--resume")
        assert code == 2
        assert message in words
    code, words = refused(*MODES, "--resume")
    assert (code, words) == (2, "lobefem: --resume goes on with the run in --out; give that folder\n")
    code, words = refused(*MODES, "--out", folder)
    assert "is not empty; give another --out, or --overwrite, or --resume to go on with its run" in words
    # what is refused later than the folder was begun leaves no folder, and an earlier run as it was
    code, words = refused(*MODES, "--count", "100000", "--out", str(shared_path / "new"))
    assert (code, (shared_path / "new").exists()) == (2, False)
    code, words = refused(*MODES, "--count", "100000", "--out", folder, "--overwrite")
    assert (code, (shared_path / "run" / "results.json").exists()) == (2, True)
    comm.Barrier()
    file = shared_path / "run" / "run.json"
    if comm.rank == 0:  # of another version, killed while it wrote
        run = json.loads(file.read_text())
        run["versions"]["lobefem"] = "0.0.1"
        file.write_text(json.dumps(run))
        (file.parent / ".run.json-abc").write_text("half")
        (file.parent / ".fields-abc").mkdir()
    comm.Barrier()
    results, code = lobefem_json(*MODES, "--out", folder, "--resume")
    assert code == 0
    assert "made with other versions: lobefem 0.0.1 then and" in results["warnings"][-1]
    assert not [path.name for path in file.parent.iterdir() if path.name.startswith(".")]
    comm.Barrier()
    if comm.rank == 0:
        file.write_text("[1]")
    comm.Barrier()
    code, words = refused(*MODES, "--out", folder, "--resume")
    assert code == 2
    assert "says nothing of a run" in words


# --- signals ------------------------------------------------------------------------------------


def start(*command):
    environment = os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    return subprocess.Popen(
        [sys.executable, *command], env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


@pytest.mark.slow
@alone
@pytest.mark.parametrize(("number", "word"), [(signal.SIGINT, "interrupted"), (signal.SIGTERM, "terminated")])
def test_a_signal_stops_at_the_last_step_and_says_where(tmp_path, number, word):
    folder = tmp_path / "run"
    sweep = [part for p in range(1, 400) for part in ("--pressure", str(p))]
    command = ("modes", SINGLE, "--divisions", "4x8", "--count", "1", *sweep, "--out", str(folder))
    process = start("-m", "lobefem", *command)
    while process.poll() is None and not (folder / "modes-2.npz").exists():
        time.sleep(0.02)
    process.send_signal(number)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 128 + number
    assert out == ""
    assert err == (
        f"lobefem: {word}; the last accepted step is in {folder}, the same command with --resume goes on "
        "from it\n"
    )
    assert (folder / "design.toml").exists()
    assert not (folder / "results.json").exists()


@alone
def test_a_second_signal_waits_for_nothing():
    program = """
        from itertools import repeat
        from lobefem.app.process import Stop
        Stop().install()
        print("ready", flush=True)
        sum(repeat(1, 10**13))  # as a factorisation does, this looks at no signal
    """
    process = start("-c", textwrap.dedent(program))
    assert process.stdout.readline() == "ready\n"
    time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    time.sleep(0.2)
    assert process.poll() is None
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=60)
    assert process.returncode == -signal.SIGINT
