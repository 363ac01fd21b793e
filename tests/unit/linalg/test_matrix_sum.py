"""The sum of a matrix and of one whose pattern comes and goes."""

import numpy as np
import pytest

from lobefem.linalg.matrix_sum import PatternedSum

# isort: split
from petsc4py import PETSc


def matrix(comm, seed, size, entries):
    """A random sparse matrix, the same on any number of ranks."""
    rng = np.random.default_rng(seed)
    rows, columns = rng.integers(0, size, (2, entries))
    A = PETSc.Mat().createAIJ((size, size), comm=comm)
    A.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, False)
    A.setUp()
    begin, end = A.getOwnershipRange()
    for i, j, v in zip(rows, columns, rng.standard_normal(entries), strict=True):
        if begin <= i < end:
            A.setValue(i, j, v, addv=PETSc.InsertMode.ADD_VALUES)
    A.assemble()
    return A


@pytest.mark.parametrize("size", [1, 40])
def test_sums_of_patterns_that_come_and_go(comm, size):
    A, total, seen = matrix(comm, 0, size, 300), PatternedSum(), []
    for k in [None, 1, 1, 2, None, 3, 1, 4, 5, 2]:
        B = None if k is None else matrix(comm, k, size, 4)
        S = total.set(A, B, 0.5)
        assert not seen or S is seen[0]
        seen.append(S)
        difference = A.copy()
        if B is not None:
            difference.axpy(0.5, B, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
        difference.axpy(-1.0, S, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
        assert difference.norm() <= 1e-14 * A.norm()


def test_the_pattern_is_new_only_where_it_has_to_be(comm):
    A, B, C = (matrix(comm, k, 60, n) for k, n in ((0, 2000), (1, 6), (2, 6)))
    total, news = PatternedSum(), []
    for other in (None, B, None, B, C, B, None):
        total.set(A, other)
        news.append(total.new_pattern)
    assert all(news[k] for k in (0, 1, 4))
    assert not any(news[k] for k in (2, 3, 5, 6))


def test_what_came_and_went_does_not_pile_up(comm):
    A, total = matrix(comm, 0, 60, 500), PatternedSum()
    most = 0
    for k in range(1, 60):
        S = total.set(A, matrix(comm, k, 60, 10))
        most = max(most, int(S.getInfo(PETSc.Mat.InfoType.GLOBAL_SUM)["nz_used"]))
    assert most <= 1.2 * A.getInfo(PETSc.Mat.InfoType.GLOBAL_SUM)["nz_used"]
