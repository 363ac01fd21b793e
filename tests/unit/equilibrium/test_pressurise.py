"""`pressurise`; options of PETSc's for `inflate`, and a failed state in place of an error."""

import pytest

from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.pressurisation import pressurise
from lobefem.equilibrium.solver_options import NewtonOptions
from lobefem.errors import ConvergenceError, InputError
from lobefem.model.tension_field import TensionField
from tests.builders import stack

from petsc4py import PETSc


def balloon(**given):
    return stack(film=TensionField(E=1e8, **given), support="fixed")


def test_states_come_one_by_one_each_from_the_one_before():
    one = balloon()
    states = pressurise(one, (p for p in (10.0, 20.0, 30.0)), options=NewtonOptions(keep_tangent=False))
    first = next(states)
    assert first.pressure == 10.0
    second = next(states)
    again = inflate(one, 20.0, start=first, options=NewtonOptions(keep_tangent=False))
    assert second.volume == pytest.approx(again.volume, rel=1e-12)
    assert second.iterations == again.iterations
    assert [state.pressure for state in states] == [30.0]


def test_options_of_petsc_reach_the_solver():
    one = balloon()
    with pytest.raises(ConvergenceError):
        inflate(one, 50.0, options=NewtonOptions(petsc_options={"snes_max_it": 1}, min_step=0.5))
    assert not PETSc.Options().hasName("lobefem_inflate_snes_max_it")
    assert inflate(one, 50.0).converged
    with pytest.raises(InputError, match=r"petsc_options is '-snes_monitor'; give values by name"):
        inflate(one, 50.0, options=NewtonOptions(petsc_options="-snes_monitor"))


def test_a_failure_can_be_a_state():
    """The last one that was found, or the reference shape."""
    one = balloon()
    options = NewtonOptions(petsc_options={"snes_max_it": 1}, min_step=0.5)
    how = {"options": options, "raise_on_failure": False}
    failed = inflate(one, 50.0, **how)
    assert not failed.converged
    assert failed.reason == "too many iterations"
    assert failed.pressure == 0.0
    assert failed.max_displacement == 0.0
    good = inflate(one, 50.0)
    failed = inflate(one, 5000.0, start=good, **how)
    assert not failed.converged
    assert failed.pressure == 50.0
    assert failed.volume == pytest.approx(good.volume, rel=1e-12)


def test_pressurise_ends_with_the_state_that_did_not_converge():
    one = balloon()
    start = inflate(one, 10.0)
    options = NewtonOptions(petsc_options={"snes_max_it": 1}, min_step=0.5)
    how = {"options": options, "raise_on_failure": False}
    states = list(pressurise(one, [10.0, 5000.0, 20.0], start=start, **how))
    assert [state.converged for state in states] == [True, False]
