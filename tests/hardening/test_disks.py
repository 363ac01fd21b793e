"""A disk that is full, or may not be written to: one sentence, no half-written file, results shown."""

import json
import resource
import subprocess

import numpy as np
import pytest
from broken import EXAMPLES, SINGLE, cases, fault_of_sentence, leftovers, run
from hypothesis import strategies as st

COMMAND = ["modes", SINGLE, "--divisions", "4x6", "--count", "2"]

pytestmark = pytest.mark.serial  # changes what the whole process may write


def require_sound(folder, code, out, err):
    """One sentence, results nevertheless, and every file complete or absent."""
    words = [line for line in err.splitlines() if not line.startswith("lobefem: warning: ")]
    assert code == 2
    assert fault_of_sentence("\n".join(words) + "\n") == "", err
    assert not leftovers(folder)
    for path in folder.rglob("*.json"):
        json.loads(path.read_text())
    for path in folder.rglob("*.npz"):
        with np.load(path) as file:
            assert all(file[name] is not None for name in file.files)
    assert (folder / "fields.xdmf").exists() == (folder / "fields.h5").exists()
    if (folder / "state.npz").exists():  # the computation was over
        assert "stable" in out


@cases(0.005, 4, limit=st.integers(1000, 150_000))
def test_a_file_that_cannot_grow(tmp_path_factory, limit):
    """A limit of the size of each file stands for a full disk: it needs no rights."""
    folder = tmp_path_factory.mktemp("run")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, before[1]))
    try:
        code, out, err = run([*COMMAND, "--out", folder])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    if code == 0:
        assert json.loads((folder / "results.json").read_text())["pressures"]
        return
    require_sound(folder, code, out, err)


@pytest.fixture
def small_disk(tmp_path):
    """Mounts a disk of a given size [kB]; where that is not allowed the test is skipped."""
    mounted = []

    def mount(size):
        place = tmp_path / f"disk-{size}"
        place.mkdir()
        options = ["-t", "tmpfs", "-o", f"size={size}k", "tmpfs"]
        done = subprocess.run(["mount", *options, str(place)], capture_output=True, check=False)
        if done.returncode:
            pytest.skip("mounting is not allowed here")
        mounted.append(place)
        return place

    yield mount
    for place in mounted:
        subprocess.run(["umount", "-l", str(place)], check=True)


def test_a_full_disk(small_disk):
    for size in range(4, 204, 8) if EXAMPLES else (12, 60):
        disk = small_disk(size)
        code, out, err = run([*COMMAND, "--out", disk / "run", "--json", disk / "x.json"])
        if code == 0:
            assert size > 100
            continue
        require_sound(disk, code, out, err)


@pytest.mark.parametrize("target", ["/dev/full", "/proc/x", "/dev/null/x"])
def test_places_that_take_nothing(target):
    code, _, err = run([*COMMAND, "--json", target])
    assert code == 2
    assert fault_of_sentence("".join(line for line in err.splitlines(True) if "warning" not in line)) == ""
