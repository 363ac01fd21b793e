"""Physics as UFL: kinematics, film laws, gas pressure, and what cables, plates, supports and contact are.

What belongs here can be written without a mesh: energies and stresses as UFL expressions of a displacement,
and the frozen records that a design consists of. PETSc and DOLFINx are not imported here.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from lobefem.faces import face

if TYPE_CHECKING:
    from lobefem.model.cables import Cables, Hoops, Tendons
    from lobefem.model.components import OwnComponent
    from lobefem.model.dead_weight import DeadWeight
    from lobefem.model.end_plates import EndPlates, PlateLoad
    from lobefem.model.film import Film, Isotropic
    from lobefem.model.fixed_wrinkles import FixedWrinkles
    from lobefem.model.gas_pressure import GasPressure, SealedGas
    from lobefem.model.imp import IMP, PrescribedPath
    from lobefem.model.kinematics import Frame, green_lagrange, revolved_frame, tangent_frame
    from lobefem.model.orthotropic import Orthotropic, OrthotropicTensionField
    from lobefem.model.self_contact import SelfContact
    from lobefem.model.supports import Fixed, FreeBody
    from lobefem.model.tension_field import TensionField, WrinkledField

_HOME = {
    "IMP": "imp",
    "Cables": "cables",
    "DeadWeight": "dead_weight",
    "EndPlates": "end_plates",
    "Film": "film",
    "Fixed": "supports",
    "FixedWrinkles": "fixed_wrinkles",
    "Frame": "kinematics",
    "FreeBody": "supports",
    "GasPressure": "gas_pressure",
    "Hoops": "cables",
    "Isotropic": "film",
    "OwnComponent": "components",
    "Orthotropic": "orthotropic",
    "OrthotropicTensionField": "orthotropic",
    "PlateLoad": "end_plates",
    "PrescribedPath": "imp",
    "SealedGas": "gas_pressure",
    "SelfContact": "self_contact",
    "Tendons": "cables",
    "TensionField": "tension_field",
    "WrinkledField": "tension_field",
    "green_lagrange": "kinematics",
    "revolved_frame": "kinematics",
    "tangent_frame": "kinematics",
}

__all__ = [
    "IMP",
    "Cables",
    "DeadWeight",
    "EndPlates",
    "Film",
    "Fixed",
    "FixedWrinkles",
    "Frame",
    "FreeBody",
    "GasPressure",
    "Hoops",
    "Isotropic",
    "Orthotropic",
    "OrthotropicTensionField",
    "OwnComponent",
    "PlateLoad",
    "PrescribedPath",
    "SealedGas",
    "SelfContact",
    "Tendons",
    "TensionField",
    "WrinkledField",
    "green_lagrange",
    "revolved_frame",
    "tangent_frame",
]

__getattr__, __dir__ = face(__name__, _HOME)
