"""The discrete balloon: `Balloon` joins surface and model into energy, residual and tangent.

What belongs here evaluates: weak forms, constraint maps, rigid plates, contact, functionals. Nothing here
solves an equation: that is done in `equilibrium` and `stability`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from lobefem.faces import face
from lobefem.linalg import dolfinx_compat as _dolfinx_compat  # first: it finds the stack

if TYPE_CHECKING:
    from lobefem.fem.balloon import Balloon
    from lobefem.fem.constraint_map import ConstraintMap
    from lobefem.fem.contact_potential import Contact, ContactReport
    from lobefem.fem.film_assembly import FilmAssembly
    from lobefem.fem.functionals import (
        cable_tensions,
        displacement_of,
        mid_hoop_displacement,
        nodal_areas,
        region_areas,
        region_shares,
        straining_share,
        stress_resultants,
        true_resultants,
    )
    from lobefem.fem.plate_loads import PlateForces
    from lobefem.fem.prescribed_motion import PrescribedMotion
    from lobefem.fem.rigid_plates import PlateMotion, rotation
    from lobefem.fem.weak_forms import WeakForms

_HOME = {
    "Balloon": "balloon",
    "ConstraintMap": "constraint_map",
    "Contact": "contact_potential",
    "ContactReport": "contact_potential",
    "FilmAssembly": "film_assembly",
    "PlateForces": "plate_loads",
    "PlateMotion": "rigid_plates",
    "PrescribedMotion": "prescribed_motion",
    "WeakForms": "weak_forms",
    "cable_tensions": "functionals",
    "displacement_of": "functionals",
    "mid_hoop_displacement": "functionals",
    "nodal_areas": "functionals",
    "region_areas": "functionals",
    "region_shares": "functionals",
    "rotation": "rigid_plates",
    "straining_share": "functionals",
    "stress_resultants": "functionals",
    "true_resultants": "functionals",
}

__all__ = [
    "Balloon",
    "ConstraintMap",
    "Contact",
    "ContactReport",
    "FilmAssembly",
    "PlateForces",
    "PlateMotion",
    "PrescribedMotion",
    "WeakForms",
    "cable_tensions",
    "displacement_of",
    "mid_hoop_displacement",
    "nodal_areas",
    "region_areas",
    "region_shares",
    "rotation",
    "straining_share",
    "stress_resultants",
    "true_resultants",
]

__getattr__, __dir__ = face(__name__, _HOME)
