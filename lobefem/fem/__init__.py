"""The discrete balloon: `Balloon` joins surface and model into energy, residual and tangent.

What belongs here evaluates: weak forms, constraint maps, rigid plates, contact, functionals. Nothing here
solves an equation: that is done in `equilibrium` and `stability`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lobefem.faces import face
from lobefem.linalg import dolfinx_compat as _dolfinx_compat  # first: it finds the stack

if TYPE_CHECKING:
    from lobefem.fem.balloon import Balloon

__all__ = ["Balloon"]

_HOME = {
    "Balloon": "balloon",
}

__getattr__ = face(__name__, _HOME)
