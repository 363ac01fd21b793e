"""A folder for what a module's demo writes."""

import pytest

from mpi4py import MPI


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    return MPI.COMM_WORLD.bcast(tmp_path_factory.mktemp("demo"), root=0)
