"""Linear algebra that knows no balloon: DOLFINx's versions, assembly, PETSc, SLEPc, banded pencils.

What belongs here works on meshes, matrices and vectors of any problem. Anything that names a film, a plate,
a pressure or a lobe belongs in a room above. Importing this room first orders the imports of PyPI's DOLFINx.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from lobefem.faces import face
from lobefem.linalg import dolfinx_compat  # first: it finds the stack

if TYPE_CHECKING:
    from lobefem.linalg.assembly import (
        NodalMatrix,
        NodalVector,
        PickedMatrix,
        integral,
        together,
        total,
        totals,
    )
    from lobefem.linalg.banded import Band, as_scipy
    from lobefem.linalg.matrix_sum import PatternedSum
    from lobefem.linalg.memory import require_memory

_HOME = {
    "Band": "banded",
    "NodalMatrix": "assembly",
    "NodalVector": "assembly",
    "PatternedSum": "matrix_sum",
    "PickedMatrix": "assembly",
    "as_scipy": "banded",
    "integral": "assembly",
    "require_memory": "memory",
    "together": "assembly",
    "total": "assembly",
    "totals": "assembly",
}

__all__ = [
    "Band",
    "NodalMatrix",
    "NodalVector",
    "PatternedSum",
    "PickedMatrix",
    "as_scipy",
    "integral",
    "require_memory",
    "together",
    "total",
    "totals",
]

__getattr__, __dir__ = face(__name__, _HOME)
