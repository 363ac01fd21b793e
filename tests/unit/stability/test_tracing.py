"""Branches over the pressure: by harmonic."""

from functools import partial

import builders
import numpy as np
import pytest

from lobefem import (
    FixedWrinkles,
    Isotropic,
    critical_pressure,
    find_modes,
    ideal_state,
)
from lobefem.errors import InputError
from lobefem.stability.tracing import branches

make = partial(builders.stack, film=FixedWrinkles(), load="film", prestressed=True)


@pytest.mark.parametrize("film", [FixedWrinkles(), Isotropic()])
@pytest.mark.parametrize("load", ["film", "closed"])
def test_branches_agree_with_the_full_model(film, load):
    balloon = make(film=film, load=load)
    found = branches(balloon, [500.0, 2000.0], count=6)
    for column, p in enumerate((500.0, 2000.0)):
        for mode in find_modes(ideal_state(balloon, p), count=12).modes:
            same = [b for b in found if b.harmonic == mode.harmonic and len(b.values) == 2]
            nearest = min(same, key=lambda b: abs(b.values[column] - mode.value.real))
            assert nearest.values[column] == pytest.approx(
                mode.value.real, rel=1e-6
            )  # round-off of the hoops' stiffness
            assert nearest.kind == mode.kind


def test_a_branch_crosses_zero_at_the_critical_pressure():
    balloon = make(divisions=(6, 16))
    critical = critical_pressure(balloon, full=True)
    p = critical.pressure * np.array([0.999, 1.001])
    (falling,) = [b for b in branches(balloon, p) if b.values[1] < 0]
    assert falling.values[0] > 0
    assert (falling.harmonic, falling.kind) == (critical.mode.harmonic, "local")


def test_sweeps_refuse_what_has_no_branches():
    with pytest.raises(InputError, match="prestressed=True"):
        branches(make(prestressed=False), [1.0])
    with pytest.raises(InputError, match=r"pressures \[2.0, 1.0\] must ascend"):
        branches(make(), [2.0, 1.0])
    with pytest.raises(InputError, match=r"^the path of pressures is 1.0; give numbers \[Pa\] in a row"):
        branches(make(), 1.0)
    with pytest.raises(InputError, match=r"^a harmonic is '2'; give an integer, 0 or more"):
        branches(make(), [1.0], harmonics="2")
    with pytest.raises(InputError, match="cyclic mesh"):
        branches(make(divisions=None, layout="unstructured", size=1.0), [1.0])
