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
    from lobefem.equilibrium.full_model import full_state
    from lobefem.equilibrium.inflation import inflate
    from lobefem.equilibrium.state import Equilibrium, ideal_state

__all__ = ["Equilibrium", "Form", "find_form", "full_state", "ideal_state", "inflate"]

_HOME = {
    "Equilibrium": "state",
    "Form": "form_finding",
    "find_form": "form_finding",
    "full_state": "full_model",
    "ideal_state": "state",
    "inflate": "inflation",
}

__getattr__ = face(__name__, _HOME)
