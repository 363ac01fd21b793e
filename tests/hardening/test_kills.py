"""kill -9 at random times, on one rank and on two: the folder is sound, and every run ends alike."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from broken import EXAMPLES, SINGLE

from lobefem.io.design import Design

CHAINS, KILLS = (("one", "two"), 25) if EXAMPLES else (("one",), 2)
STUDY = [
    "perturb", SINGLE, "--film", "tension-field", "--pressure", "5", "--load", "closed", "--lobes", "2",
    "--no-contact", "--release",
]  # fmt: skip
LENGTH = ["--divisions", "6x8", "--bend", "4", "--steps", "6"] if EXAMPLES else [
    "--divisions", "4x6", "--bend", "2", "--steps", "2"
]  # fmt: skip
MPIRUN = shutil.which("mpirun", path=f"{Path(sys.executable).parent}:{os.environ.get('PATH', '')}")
ENVIRONMENT = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2]), "OMP_NUM_THREADS": "1"}

pytestmark = pytest.mark.serial  # starts processes, which ranks of an MPI run must not


def start(folder, ranks):
    """One run, which goes on with what is in the folder."""
    launcher = [] if ranks == 1 else [MPIRUN, "-n", str(ranks)]
    command = [*launcher, sys.executable, "-m", "lobefem", *STUDY, *LENGTH, "--out", str(folder)]
    command += ["--resume"] if (folder / "design.toml").exists() else []
    return subprocess.Popen(
        command,
        env=ENVIRONMENT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )


def finish(run):
    _, words = run.communicate(timeout=600)
    assert run.returncode == 0, words


def kill(run):
    """Kill a run's processes, the launcher last."""
    for process in [*_descendants(run.pid), run.pid]:
        with suppress(ProcessLookupError):
            os.kill(process, signal.SIGKILL)
    run.communicate()


def _descendants(parent):
    children = {}
    for entry in Path("/proc").iterdir():
        try:
            fields = (entry / "stat").read_text().rpartition(")")[2].split()
            children.setdefault(int(fields[1]), []).append(int(entry.name))
        except (OSError, ValueError, IndexError):
            continue
    found = list(children.get(parent, []))
    for child in found:
        found += children.get(child, [])
    return found


def require_sound(folder):
    """Whatever is there is complete."""
    if (folder / "design.toml").exists() and (folder / "run.json").exists():
        Design.load(folder / "design.toml")
    for path in folder.glob("*.json"):
        json.loads(path.read_text())
    for path in folder.glob("*.npz"):
        with np.load(path) as file:
            assert all(file[name] is not None for name in file.files)


def test_every_killed_run_goes_on_and_ends_alike(tmp_path):
    """Chains of runs side by side; each run is on one rank or on two, whatever the last one was on."""
    counts = (1, 2) if MPIRUN else (1,)
    durations = {}
    for ranks in counts:
        begin = time.monotonic()
        finish(start(tmp_path / f"whole-{ranks}", ranks))
        durations[ranks] = time.monotonic() - begin
    whole = json.loads((tmp_path / "whole-1" / "results.json").read_text())

    def chain(name, seed):
        """Kill half of the runs; each that gets through makes way for a new one. The folders of all."""
        rng = np.random.default_rng(seed)
        folders = [tmp_path / name]
        kills = 0
        while kills < KILLS:
            ranks = int(rng.choice(counts))
            run = start(folders[-1], ranks)
            try:
                run.wait(rng.uniform(0.3, 1.0) * durations[ranks])
            except subprocess.TimeoutExpired:
                kill(run)
                kills += 1
                require_sound(folders[-1])
            else:
                finish(run)
                folders.append(tmp_path / f"{name}-{kills}")
        finish(start(folders[-1], int(rng.choice(counts))))
        return folders

    with ThreadPoolExecutor(len(CHAINS)) as pool:
        folders = [f for found in pool.map(chain, CHAINS, (1, 2)) for f in found]
    expected = np.load(tmp_path / "whole-1" / "state.npz")["displacement"]
    for folder in [*folders, *(tmp_path / f"whole-{ranks}" for ranks in counts)]:
        results = json.loads((folder / "results.json").read_text())
        assert results["outcome"] == whole["outcome"]
        assert results["volume_final"] == pytest.approx(whole["volume_final"], rel=1e-9)
        assert np.abs(np.load(folder / "state.npz")["displacement"] - expected).max() < 1e-6
        assert not [path for path in folder.iterdir() if path.name.startswith(".")]
