"""An ipctk that would end the process on this processor is found out before, and said."""

from pathlib import Path

import pytest
from mpi4py import MPI

from lobefem import _ipctk, cli

SINGLE = str(Path(__file__).parents[2] / "meshes" / "single.toml")
KILLED = "import os, signal; os.kill(os.getpid(), signal.SIGILL)"

alone = pytest.mark.skipif(
    MPI.COMM_WORLD.size > 1, reason="starts a process, which ranks of an MPI run must not"
)


@pytest.fixture
def trial(monkeypatch):
    """`trial` of another program, nothing of it kept."""

    def of(program):
        monkeypatch.setattr(_ipctk, "_TRIAL", program)
        return _ipctk.trial()

    _ipctk.trial.cache_clear()
    yield of
    _ipctk.trial.cache_clear()


@alone
def test_the_installed_one_runs_here(trial):
    assert trial(_ipctk._TRIAL) == ""


@alone
@pytest.mark.parametrize(
    ("program", "said"),
    [
        (KILLED, "ipctk uses instructions that this processor lacks (signal 4)"),
        ("raise ImportError('no libtbb')", "a trial of ipctk failed (ImportError: no libtbb)"),
        ("import sys; sys.exit(1)", "a trial of ipctk failed (no reason given)"),
    ],
)
def test_what_a_trial_tells(trial, program, said):
    assert trial(program) == said


def test_contact_is_refused_in_one_sentence_on_all_ranks(monkeypatch, capfd, comm):
    """Rank 0 alone tries; without contact all is well."""
    monkeypatch.setattr(_ipctk, "_has_avx512", lambda: False)
    monkeypatch.setattr(
        _ipctk, "trial", lambda: "ipctk uses instructions that this processor lacks (signal 4)"
    )
    run = ["perturb", SINGLE, "--divisions", "4x6", "--film", "tension-field", "--pressure", "5"]
    assert cli.main([*run, "--bend", "1", "--steps", "1"]) == 2
    err = capfd.readouterr().err
    if comm.rank == 0:
        assert err == (
            "lobefem: ipctk uses instructions that this processor lacks (signal 4); run: pip install "
            "'ipctk!=1.6.1', or leave contact out (--no-contact)\n"
        )
    assert cli.main([*run, "--bend", "1", "--steps", "1", "--no-contact"]) == 0
