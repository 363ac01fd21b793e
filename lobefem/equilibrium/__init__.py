"""Equilibrium states: inflation by SNES, form finding, displacement control, gradient flow.

What belongs here finds states or describes them. It knows no eigenvalue: whether a state is stable is asked
in `stability`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from lobefem.faces import face
from lobefem.linalg import dolfinx_compat as _dolfinx_compat  # first: it finds the stack

if TYPE_CHECKING:
    from lobefem.equilibrium.clefts import Cleft, HarmonicSeed
    from lobefem.equilibrium.displacement_control import Distorted, constrain, distort, release_start
    from lobefem.equilibrium.distortions import Bend, Distortion, Tip, Twist, Wave
    from lobefem.equilibrium.energy_ledger import Ledger
    from lobefem.equilibrium.form_finding import Form, find_form, row_means
    from lobefem.equilibrium.full_model import full_state
    from lobefem.equilibrium.gradient_flow import GradientFlow, Record
    from lobefem.equilibrium.inflation import inflate
    from lobefem.equilibrium.pressurisation import pressurise
    from lobefem.equilibrium.pumpkin_measures import PumpkinMeasures, measure
    from lobefem.equilibrium.ramp import Increment
    from lobefem.equilibrium.sealed_gas import fill, seal
    from lobefem.equilibrium.solver_options import FlowOptions, NewtonOptions
    from lobefem.equilibrium.state import Equilibrium, State, ideal_state, record

_HOME = {
    "Bend": "distortions",
    "Cleft": "clefts",
    "Distorted": "displacement_control",
    "Distortion": "distortions",
    "Equilibrium": "state",
    "FlowOptions": "solver_options",
    "Form": "form_finding",
    "GradientFlow": "gradient_flow",
    "HarmonicSeed": "clefts",
    "Increment": "ramp",
    "Ledger": "energy_ledger",
    "NewtonOptions": "solver_options",
    "PumpkinMeasures": "pumpkin_measures",
    "Record": "gradient_flow",
    "State": "state",
    "Tip": "distortions",
    "Twist": "distortions",
    "Wave": "distortions",
    "constrain": "displacement_control",
    "distort": "displacement_control",
    "fill": "sealed_gas",
    "find_form": "form_finding",
    "full_state": "full_model",
    "ideal_state": "state",
    "inflate": "inflation",
    "measure": "pumpkin_measures",
    "pressurise": "pressurisation",
    "record": "state",
    "release_start": "displacement_control",
    "row_means": "form_finding",
    "seal": "sealed_gas",
}

__all__ = [
    "Bend",
    "Cleft",
    "Distorted",
    "Distortion",
    "Equilibrium",
    "FlowOptions",
    "Form",
    "GradientFlow",
    "HarmonicSeed",
    "Increment",
    "Ledger",
    "NewtonOptions",
    "PumpkinMeasures",
    "Record",
    "State",
    "Tip",
    "Twist",
    "Wave",
    "constrain",
    "distort",
    "fill",
    "find_form",
    "full_state",
    "ideal_state",
    "inflate",
    "measure",
    "pressurise",
    "record",
    "release_start",
    "row_means",
    "seal",
]

__getattr__, __dir__ = face(__name__, _HOME)
