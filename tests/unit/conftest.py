"""What tests of the command line share."""

import json

import pytest

from lobefem.app import cli

from mpi4py import MPI


@pytest.fixture
def lobefem_json(capfd):
    """Run a command with --json - and return what it printed, on all ranks, and its exit code."""

    def run(*arguments):
        code = cli.main([*map(str, arguments), "--json", "-"])
        printed = MPI.COMM_WORLD.bcast(capfd.readouterr().out, root=0)
        return json.loads(printed), code

    return run


@pytest.fixture
def refused(capfd):
    """Run a command and return its exit code and what it said on stderr, on all ranks."""

    def run(*arguments):
        code = cli.main(list(map(str, arguments)))
        out, err = MPI.COMM_WORLD.bcast(tuple(capfd.readouterr()), root=0)
        assert out == ""
        return code, err

    return run
