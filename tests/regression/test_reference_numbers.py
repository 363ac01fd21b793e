"""Energies and eigenvalues against stored numbers: the same on any number of ranks and either stack.

`reference_numbers.json` was written by one serial run of the wheel stack (DOLFINx 0.11):

    python tests/regression/test_reference_numbers.py

Every run of the suite, serial or on 2 or 3 ranks, DOLFINx 0.9 or 0.11, is compared to it. Tolerance
1e-8 relative for energies, volumes, forces and eigenvalues. An imaginary part is a small difference
of two large numbers and is compared at 1e-8 of the eigenvalue's modulus.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.solver_options import NewtonOptions
from lobefem.equilibrium.state import ideal_state
from lobefem.fem.balloon import Balloon
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.model.cables import Hoops
from lobefem.model.end_plates import EndPlates
from lobefem.model.film import Isotropic
from lobefem.model.fixed_wrinkles import FixedWrinkles
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.tension_field import TensionField
from lobefem.stability.linear_buckling import critical_pressure
from lobefem.stability.modes import find_modes

STORED = Path(__file__).with_name("reference_numbers.json")
TOLERANCE = 1e-8


def stack(comm, film, load, lobes=4, divisions=(12, 16), prestressed=False, order=1, **plates):
    surface = lobed_cylinder(lobes, divisions, order=order, comm=comm)
    plates = EndPlates(**({"support": "clamped"} | plates))
    return Balloon(surface, film, [GasPressure(load), Hoops(), plates], prestressed=prestressed)


def inflated(comm, film, load, **kw):
    state = inflate(stack(comm, film, load, **kw), 5.0, options=NewtonOptions(rtol=1e-10))
    return {
        "volume": state.volume,
        "strain_energy": state.strain_energy,
        "max_displacement": state.max_displacement,
        "bar_force": state.bar_force,
        "hoop_tension": list(state.hoop_tension),
    }


def ideal(comm, film, load, lobes, mass="unit", **kw):
    state = ideal_state(stack(comm, film, load, lobes, prestressed=True, **kw), 1000.0)
    modes = find_modes(state, count=6, mass=mass)
    return {
        "strain_energy": state.strain_energy,
        "volume": state.volume,
        "residual": state.residual,
        "eigenvalues": [[v.real, v.imag] for v in modes.values],
    }


def critical(comm, lobes):
    balloon = stack(comm, FixedWrinkles(), "closed", lobes, prestressed=True, support="fixed")
    return {"critical_pressure": critical_pressure(balloon).pressure}


CASES = {
    "isotropic stack, closed": lambda comm: inflated(comm, Isotropic(), "closed"),
    "tension-field stack, closed": lambda comm: inflated(comm, TensionField(), "closed"),
    "tension-field stack, film": lambda comm: inflated(comm, TensionField(), "film"),
    "tension-field stack, quadratic": lambda comm: inflated(
        comm, TensionField(), "closed", divisions=(4, 8), order=2
    ),
    "tension-field lobe, wrinkled by a lift": lambda comm: inflated(
        comm, TensionField(slack_stiffness=1e-4), "closed", lobes=1, support="fixed", lift=0.004
    ),
    "wrinkled stack, film, ideal": lambda comm: ideal(comm, FixedWrinkles(), "film", 4),
    "wrinkled stack, closed, ideal": lambda comm: ideal(comm, FixedWrinkles(), "closed", 4),
    "isotropic stack, closed, ideal": lambda comm: ideal(comm, Isotropic(), "closed", 4),
    "wrinkled lobe, film, ideal": lambda comm: ideal(comm, FixedWrinkles(), "film", 1),
    "wrinkled lobe, closed, ideal, nodal": lambda comm: ideal(
        comm, FixedWrinkles(), "closed", 1, mass="nodal"
    ),
    "critical pressure of one lobe": lambda comm: critical(comm, 1),
    "critical pressure of the stack": lambda comm: critical(comm, 4),
}


@pytest.mark.parametrize("case", CASES)
def test_the_numbers_are_those_of_the_reference_run(comm, case):
    expected = json.loads(STORED.read_text(encoding="utf-8"))[case]
    found = CASES[case](comm)
    assert found.keys() == expected.keys()
    for key, numbers in expected.items():
        if numbers is None:  # no bar force with both rims held
            assert found[key] is None
            continue
        a, b = np.array(found[key], dtype=float), np.array(numbers, dtype=float)
        assert a.shape == b.shape, key
        # a vector's parts (pairs of real and imaginary part) share the size of the whole
        size = np.linalg.norm(b, axis=-1, keepdims=True) if key == "eigenvalues" else np.abs(b)
        worst = np.max(np.abs(a - b) / size, initial=0.0)
        assert worst < TOLERANCE, f"{key}: {a} instead of {b}, {worst:.1e} off"


if __name__ == "__main__":
    from mpi4py import MPI

    numbers = {name: case(MPI.COMM_WORLD) for name, case in CASES.items()}
    if MPI.COMM_WORLD.rank == 0:
        STORED.write_text(json.dumps(numbers, indent=1) + "\n", encoding="utf-8")
