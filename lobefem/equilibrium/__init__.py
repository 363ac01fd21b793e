"""Equilibrium states: inflation by SNES, form finding, displacement control, gradient flow.

What belongs here finds states or describes them. It knows no eigenvalue: whether a state is stable is asked
in `stability`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lobefem.faces import face
from lobefem.linalg import dolfinx_compat as _dolfinx_compat  # first: it finds the stack

if TYPE_CHECKING:
    from lobefem.equilibrium.form_finding import Form, find_form
    from lobefem.equilibrium.inflation import inflate
    from lobefem.equilibrium.pressurisation import pressurise
    from lobefem.equilibrium.state import Equilibrium, ideal_state

__all__ = ["Equilibrium", "Form", "find_form", "ideal_state", "inflate", "pressurise"]

_HOME = {
    "Equilibrium": "state",
    "Form": "form_finding",
    "find_form": "form_finding",
    "ideal_state": "state",
    "inflate": "inflation",
    "pressurise": "pressurisation",
}

__getattr__ = face(__name__, _HOME)
