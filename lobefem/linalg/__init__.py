"""Linear algebra that knows no balloon: DOLFINx's versions, assembly, PETSc, SLEPc, banded pencils.

What belongs here works on meshes, matrices and vectors of any problem. Anything that names a film, a plate,
a pressure or a lobe belongs in a room above. Importing this room first orders the imports of PyPI's DOLFINx.
"""

from __future__ import annotations

from lobefem.linalg import dolfinx_compat  # first: it finds the stack
