"""Every test leaves nothing behind that another rank would wait for."""

import gc

import pytest

import lobefem.linalg.dolfinx_compat  # noqa: F401  first of all: it finds the stack and orders its imports

# isort: split
from lobefem.linalg import petsc

from mpi4py import MPI


def pytest_collection_modifyitems(config, items):
    """Only unit tests can be quick; on several ranks, leave out what is for one."""
    for item in items:
        if "unit" not in item.path.parts:
            item.add_marker("slow")
    if MPI.COMM_WORLD.size > 1:
        serial = {item for item in items if item.get_closest_marker("serial")}
        config.hook.pytest_deselected(items=list(serial))
        items[:] = [item for item in items if item not in serial]


def pytest_sessionfinish(session, exitstatus):
    """A selection that is for one rank alone is no failure on several."""
    if MPI.COMM_WORLD.size > 1 and exitstatus == pytest.ExitCode.NO_TESTS_COLLECTED:
        session.exitstatus = pytest.ExitCode.OK


def pytest_collection_finish(session):
    """What the imported modules hold stays: a hundred thousand objects that no later collection looks at."""
    gc.collect()
    gc.freeze()


@pytest.fixture
def comm():
    return MPI.COMM_WORLD


@pytest.fixture(autouse=True)
def _collect_together():
    """Destructors of PETSc and DOLFINx objects are collective: run them at the same place."""
    yield
    gc.collect()
    petsc.tidy(MPI.COMM_WORLD)
    MPI.COMM_WORLD.Barrier()


@pytest.fixture(scope="module", autouse=True)
def _freeze_what_stays():
    """What a module has left, imported modules and caches above all, no later collection looks at."""
    yield
    gc.collect()
    gc.freeze()


@pytest.fixture
def shared_path(tmp_path):
    """A temporary folder that all ranks agree on: rank 0's."""
    return MPI.COMM_WORLD.bcast(tmp_path, root=0)
