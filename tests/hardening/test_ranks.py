"""A fault that one rank alone sees ends the run on all of them, with the same words and code."""

import json
import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest
from broken import EXAMPLES, SINGLE, fault_of_sentence, run
from test_kills import ENVIRONMENT, MPIRUN

from lobefem import files
from lobefem.io import npz, xdmf

from mpi4py import MPI

FULL, BUG = OSError(28, "No space left on device"), RuntimeError("a bug")
FAULTS = ["MemoryError()", "ZeroDivisionError('a bug')", "OSError(5, 'I/O error')"]
COMMAND = ["modes", SINGLE, "--divisions", "4x6", "--count", "2"]


def alike(comm, arguments):
    """The exit code, the same on all ranks, and what rank 0 said; the others say nothing."""
    code, out, err = run(arguments)
    seen = comm.allgather((code, out, err))
    assert len({one for one, _, _ in seen}) == 1
    assert not any(one or other for _, one, other in seen[1:])
    return seen[0]


@pytest.mark.parametrize("rank", range(min(MPI.COMM_WORLD.size, 2)))
def test_a_rank_whose_folder_is_unwritable(comm, shared_path, monkeypatch, rank):
    access = os.access
    denied = shared_path / "run"

    def refuse(path, mode, **options):
        return not Path(path).is_relative_to(denied) and access(path, mode, **options)

    if comm.rank == rank:
        monkeypatch.setattr(files.os, "access", refuse)
    code, _, err = alike(comm, [*COMMAND, "--out", denied])
    assert code == 2
    words = err.splitlines(True)[-1]
    assert fault_of_sentence(words) == ""
    assert f"from rank {rank} of {comm.size}" in words


def test_a_rank_that_lacks_the_design_file(comm, tmp_path, monkeypatch):
    """Rank 0 reads for all."""
    if comm.rank == 0:
        (tmp_path / "mine.toml").write_text(Path(SINGLE).read_text())
    comm.Barrier()
    monkeypatch.chdir(tmp_path)  # each rank has its own
    code, out, _ = alike(comm, ["modes", "mine.toml", *COMMAND[2:], "--json", "-"])
    assert code == 0
    if comm.rank == 0:
        assert json.loads(out)["versions"]["ranks"] == comm.size


@pytest.mark.parametrize(
    ("module", "fault", "expected"),
    [(npz, FULL, 2), (xdmf, BUG, 1), (files, FULL, 2), (npz, BUG, 1)],
)
def test_a_fault_in_writing_on_rank_0_alone(comm, shared_path, monkeypatch, module, fault, expected):
    def fail(*arguments, **options):
        raise fault

    if comm.rank == 0:
        name = "replacing" if module is npz else "replace"
        monkeypatch.setattr(module, name, fail)
    code, _, err = alike(comm, [*COMMAND, "--out", shared_path / "run", "--json", shared_path / "x.json"])
    assert code == expected
    if code == 2:
        assert fault_of_sentence(err.splitlines(True)[-1]) == ""
    assert "Traceback" not in err


@pytest.mark.serial
@pytest.mark.skipif(not MPIRUN, reason="starts ranks of its own")
@pytest.mark.parametrize("fault", FAULTS if EXAMPLES else FAULTS[:1])
def test_a_rank_alone_with_its_fault_between_collective_calls_ends_all(tmp_path, fault):
    """Rank 1 fails where rank 0 waits for it: it says so and takes all with it."""
    program = f"""
        from mpi4py import MPI
        from lobefem.app import cli, process
        from lobefem.io import checkpoints
        process.Ranks.end.__defaults__ = ("", 0.5)  # how long it waits for the others [s]
        def fail(*arguments, **options):
            raise {fault}
        if MPI.COMM_WORLD.rank == 1:
            checkpoints._input_order = fail
        cli.main({[*COMMAND, "--out", str(tmp_path / "run")]!r})
    """
    done = subprocess.run(
        [MPIRUN, "-n", "2", sys.executable, "-c", textwrap.dedent(program)],
        env=ENVIRONMENT,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert done.returncode not in (0, 130)
    assert "(rank 1)" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "run" / "results.json").exists()
