"""The container without an engine: its entry point, a read-only root, what goes into the image."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import tomllib
from fnmatch import fnmatchcase
from pathlib import Path

import pytest

from lobefem.version import __version__

from mpi4py import MPI

ROOT = Path(__file__).parents[1]
ENTRY = ROOT / "docker" / "entry.sh"
SINGLE = str(ROOT / "meshes" / "single.toml")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]

# a launcher's children may not launch: MPICH and Open MPI refuse, or take them for their own
alone = pytest.mark.skipif(
    MPI.COMM_WORLD.size > 1, reason="starts processes, which ranks of an MPI run must not"
)


# --- the entry point ----------------------------------------------------------------------------


def begin(*command, **variables):
    """The command behind the entry point, in a session of its own and without a display."""
    environment = {name: value for name, value in os.environ.items() if name != "DISPLAY"}
    return subprocess.Popen(
        [str(ENTRY), *command], env=environment | {"PYTHONPATH": str(ROOT)} | variables, text=True,
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True,
    )  # fmt: skip


def wait_for(happened, seconds=10):
    end = time.monotonic() + seconds
    while not (done := happened()) and time.monotonic() < end:
        time.sleep(0.02)
    return done


def is_running(pid):
    try:
        return "\nState:\tZ" not in Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return False


@pytest.fixture
def xvfb(tmp_path):
    """Writes an X server that draws nothing; variables that make the entry point find it."""

    def write(program):
        (tmp_path / "bin").mkdir()
        file = tmp_path / "bin" / "Xvfb"
        file.write_text(f"#!/bin/sh\necho $$ >'{tmp_path}/server'\n{program}\n")
        file.chmod(0o755)
        return {"PATH": f"{file.parent}:{os.environ['PATH']}"}

    return write


SERVER = 'echo "a warning" >&2; echo 4711 >&"$2"; exec sleep 60'


@alone
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_command_and_its_display(tmp_path, xvfb, number):
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    process = begin("sh", "-c", 'echo "$DISPLAY"; exec sleep 60', TMPDIR=str(scratch), **xvfb(SERVER))
    assert process.stdout.readline() == ":4711\n"
    server = int((tmp_path / "server").read_text())
    assert is_running(server)
    assert os.getsid(server) != os.getsid(process.pid)  # a Ctrl-C that the command survives spares it
    sent = time.monotonic()
    process.send_signal(number)
    assert process.communicate(timeout=10) == ("", "")
    assert time.monotonic() - sent < 2
    assert process.returncode == -number
    assert wait_for(lambda: not is_running(server))
    assert not list(scratch.iterdir())


@alone
@pytest.mark.parametrize(("number", "word"), [(signal.SIGINT, "interrupted"), (signal.SIGTERM, "terminated")])
def test_lobefem_says_how_to_go_on(tmp_path, xvfb, number, word):
    folder = tmp_path / "run"
    sweep = [part for p in range(1, 400) for part in ("--pressure", str(p))]
    command = ("modes", SINGLE, "--divisions", "4x8", "--count", "1", *sweep, "--out", str(folder))
    process = begin(sys.executable, "-m", "lobefem", *command, **xvfb(SERVER))
    wait_for(lambda: process.poll() is not None or (folder / "modes-2.npz").exists(), 120)
    process.send_signal(number)
    out, err = process.communicate(timeout=10)
    assert process.returncode == 128 + number
    assert out == ""
    said = f"lobefem: {word}; the last accepted step is in {folder}, the same command with --resume goes on"
    assert err.splitlines()[-1].startswith(said)
    assert wait_for(lambda: not is_running(int((tmp_path / "server").read_text())))


@alone
def test_the_command_has_the_display_that_there_is():
    process = begin("sh", "-c", 'echo "$DISPLAY"; exit 7')
    out, err = process.communicate(timeout=30)
    assert (process.returncode, err) == (7, "")
    if shutil.which("Xvfb") is None:
        assert out == "\n"
    else:
        assert re.fullmatch(r":\d+\n", out)
        assert wait_for(lambda: not Path(f"/tmp/.X{out[1:-1]}-lock").exists())


@alone
@pytest.mark.parametrize(
    ("program", "display", "err"),
    [
        (SERVER, ":4711", ""),
        (
            'echo "Fatal server error:" >&2; echo "(EE) no room" >&2; exit 1',
            "",
            "docker/entry.sh: Xvfb did not start, so pictures will fail: (EE) no room\n",
        ),
    ],
)
def test_a_missing_scratch_folder_or_display_ends_nothing(tmp_path, xvfb, program, display, err):
    process = begin("sh", "-c", 'echo "$DISPLAY $TMPDIR"', TMPDIR=str(tmp_path / "missing"), **xvfb(program))
    assert process.communicate(timeout=30) == (f"{display} /dev/shm\n", err)
    assert process.returncode == 0


# --- a read-only root ---------------------------------------------------------------------------

# $1: where to put the new root, $2...: folders that /tmp may hide, "--", a command
INSIDE = """
    new=$1; shift
    mount --rbind / "$new"
    mount -o remount,bind,ro "$new"
    mount -t tmpfs -o nosuid,nodev,noexec tmpfs "$new/tmp"
    while [ "$1" != -- ]; do
        mkdir -p "$new$1"; mount --bind "$1" "$new$1"; mount -o remount,bind,ro "$new$1"; shift
    done
    shift
    mkdir "$new/tmp/home"; mount -t tmpfs tmpfs "$new/tmp/home"
    if touch "$new/etc/written" 2>/dev/null; then echo "the root is not read-only" >&2; exit 99; fi
    exec chroot "$new" "$@"
"""


@alone
def test_a_read_only_root_with_a_tmp_that_runs_nothing(tmp_path):
    """As by `--read-only --tmpfs /tmp --tmpfs HOME:exec`: forms are compiled into the home."""
    own = ["unshare", "--mount", "--propagation", "private"]
    if os.geteuid():
        own += ["--user", "--map-root-user"]
    if subprocess.run([*own, "true"], capture_output=True, check=False).returncode:
        pytest.skip("this system refuses namespaces")
    variables = {
        "PATH": f"{os.environ['PATH']}:/usr/sbin:/sbin", "HOME": "/tmp/home", "PYTHONPATH": str(ROOT),
        "PYTHONDONTWRITEBYTECODE": "1",
    }  # fmt: skip
    new = tmp_path / "root"
    new.mkdir()
    command = [
        str(ENTRY),
        sys.executable,
        "-m",
        "lobefem",
        "inflate",
        SINGLE,
        "--divisions",
        "4x8",
        "--json",
        "-",
    ]
    done = subprocess.run(
        [*own, "sh", "-euc", INSIDE, "sh", str(new), str(ROOT), sys.prefix, "--", *command],
        env=variables, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["converged"] is True


# --- what goes into the image -------------------------------------------------------------------


def is_sent(path):
    """Whether .dockerignore lets a file through: the last pattern that fits it or a folder of it decides."""
    parents = [path, *map(str, Path(path).parents)]
    sent = True
    for line in (ROOT / ".dockerignore").read_text(encoding="utf-8").splitlines():
        pattern = line.removeprefix("!")
        if pattern and any(fnmatchcase(parent, pattern) for parent in parents):
            sent = line != pattern
    return sent


def test_only_what_the_image_needs_is_sent():
    needed = [
        "pyproject.toml",
        *PROJECT["license-files"],
        PROJECT["readme"],
        "docker/setup.sh",
        "docker/ca.crt",
    ]
    needed += [
        "lobefem/app/cli.py",
        "lobefem/templates/report.html",
        "meshes/stack4.toml",
        "demos/stability.py",
    ]
    assert [path for path in needed if not is_sent(path)] == []
    other = [
        ".git/HEAD",
        ".venv/bin/python",
        ".venv-debian/bin/python",
        ".debian/bin/sh",
        ".peers/a",
        "out/a",
    ]
    other += [
        "build/a",
        "tests/unit/a.py",
        "lobefem/__pycache__/a.pyc",
        "docs/index.md",
        "lobefem.egg-info/a",
    ]
    other += [".mypy_cache/a", "mine.toml"]
    assert [path for path in other if is_sent(path)] == []


def test_the_image_is_labelled_with_this_version():
    labels = dict(
        re.findall(r'org\.opencontainers\.image\.(\w+)="(.*?)"', (ROOT / "docker/Dockerfile").read_text())
    )
    assert (labels["title"], labels["version"], labels["licenses"]) == (
        PROJECT["name"], "$VERSION", PROJECT["license"],
    )  # fmt: skip
    asked = subprocess.run(
        ["make", "--no-print-directory", "-n", "image"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    (find,) = re.findall(r"VERSION=\$\((.*?)\) ", asked.stdout)
    found = subprocess.run(["sh", "-c", find], cwd=ROOT, capture_output=True, text=True, check=True)
    assert found.stdout.strip() == __version__
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.findall(r"^version: (.*)$", citation, flags=re.MULTILINE) == [__version__]


@alone
@pytest.mark.parametrize(
    ("extra", "missing"), [("", ["lobefem-needs"]), ("dev", ["lobefem-needs", "lobefem-tools"])]
)
def test_tools_of_development_are_left_out(tmp_path, extra, missing):
    """The image asks for no extra, the developer's set-up for `dev`."""
    (tmp_path / "pyproject.toml").write_text(
        '[project]\ndependencies = ["numpy", "lobefem-needs"]\n'
        'optional-dependencies = {dev = ["lobefem-tools"]}\n'
    )
    done = subprocess.run(
        [sys.executable, str(ROOT / "docker" / "missing.py"), "constraints.txt", extra],
        cwd=tmp_path, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert done.stdout.split() == missing
    assert "numpy==" in (tmp_path / "constraints.txt").read_text()
