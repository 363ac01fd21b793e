"""Physics as UFL: kinematics, film laws, gas pressure, and what cables, plates, supports and contact are.

What belongs here can be written without a mesh: energies and stresses as UFL expressions of a displacement,
and the frozen records that a design consists of. PETSc and DOLFINx are not imported here.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lobefem.faces import face

if TYPE_CHECKING:
    from lobefem.model.cables import Cables, Hoops
    from lobefem.model.end_plates import EndPlates, PlateLoad
    from lobefem.model.film import Film, Isotropic
    from lobefem.model.fixed_wrinkles import FixedWrinkles
    from lobefem.model.gas_pressure import GasPressure
    from lobefem.model.imp import IMP, PrescribedPath
    from lobefem.model.kinematics import Frame
    from lobefem.model.self_contact import SelfContact
    from lobefem.model.supports import Fixed, FreeBody
    from lobefem.model.tension_field import TensionField

__all__ = [
    "IMP",
    "Cables",
    "EndPlates",
    "Film",
    "Fixed",
    "FixedWrinkles",
    "Frame",
    "FreeBody",
    "GasPressure",
    "Hoops",
    "Isotropic",
    "PlateLoad",
    "PrescribedPath",
    "SelfContact",
    "TensionField",
]

_HOME = {
    "Cables": "cables",
    "EndPlates": "end_plates",
    "Film": "film",
    "FixedWrinkles": "fixed_wrinkles",
    "Frame": "kinematics",
    "FreeBody": "supports",
    "GasPressure": "gas_pressure",
    "Fixed": "supports",
    "Hoops": "cables",
    "IMP": "imp",
    "Isotropic": "film",
    "PlateLoad": "end_plates",
    "PrescribedPath": "imp",
    "SelfContact": "self_contact",
    "TensionField": "tension_field",
}

__getattr__ = face(__name__, _HOME)
