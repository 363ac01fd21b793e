"""Errors: families, exit codes and data."""

import pytest

from lobefem.errors import (
    ConvergenceError,
    EigenError,
    InputError,
    LobefemError,
    MissingDependencyError,
    SolveError,
)

pytestmark = pytest.mark.serial


@pytest.mark.parametrize(
    ("kind", "code", "builtin"),
    [
        (InputError, 2, ValueError),
        (MissingDependencyError, 2, ImportError),
        (SolveError, 3, RuntimeError),
        (ConvergenceError, 3, RuntimeError),
        (EigenError, 3, RuntimeError),
    ],
)
def test_families(kind, code, builtin):
    error = kind("what, the value, what to try")
    assert isinstance(error, LobefemError)
    assert isinstance(error, builtin)
    assert error.exit_code == code
    assert str(error) == "what, the value, what to try"


def test_data_and_state_travel_with_the_error():
    error = ConvergenceError("stopped", state="last", pressure=3.0)
    assert error.state == "last"
    assert error.data == {"pressure": 3.0}
    assert EigenError("few", converged=2).data == {"converged": 2}
    assert ConvergenceError("stopped").state is None
