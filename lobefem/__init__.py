"""lobefem: is a lobed balloon stable?

Tension-only film, follower gas pressure, rigid plates and cables on a Gmsh surface, equilibrium by
PETSc SNES and buckling modes by SLEPc, on DOLFINx. Names are imported when they are first used, so
that `import lobefem` costs nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lobefem.faces import face
from lobefem.version import __version__

if TYPE_CHECKING:
    from lobefem.equilibrium.form_finding import Form, find_form
    from lobefem.equilibrium.inflation import inflate
    from lobefem.equilibrium.pressurisation import pressurise
    from lobefem.equilibrium.state import Equilibrium, ideal_state
    from lobefem.fem.balloon import Balloon
    from lobefem.geometry.isotensoid import Isotensoid
    from lobefem.geometry.natural_shape import NaturalShape, isotensoid_stiffness
    from lobefem.geometry.stacks import cylinder, lobed_cylinder
    from lobefem.geometry.surface import Surface
    from lobefem.io.design import Design
    from lobefem.model.cables import Cables, Hoops
    from lobefem.model.end_plates import EndPlates, PlateLoad
    from lobefem.model.film import Isotropic
    from lobefem.model.fixed_wrinkles import FixedWrinkles
    from lobefem.model.gas_pressure import GasPressure
    from lobefem.model.imp import IMP, PrescribedPath
    from lobefem.model.supports import Fixed, FreeBody
    from lobefem.model.tension_field import TensionField
    from lobefem.stability.harmonic_buckling import HarmonicPressures, harmonic_pressures
    from lobefem.stability.linear_buckling import CriticalPressure, critical_pressure
    from lobefem.stability.modes import Modes, find_modes
    from lobefem.stability.nonlinear_buckling import CriticalPoint, critical_point
    from lobefem.stability.perturbation import Perturbed, perturb
    from lobefem.stability.relaxation import Released
    from lobefem.stability.tracing import Trace, trace

_HOME = {
    "Balloon": "fem.balloon",
    "Cables": "model.cables",
    "CriticalPoint": "stability.nonlinear_buckling",
    "CriticalPressure": "stability.linear_buckling",
    "Design": "io.design",
    "EndPlates": "model.end_plates",
    "Equilibrium": "equilibrium.state",
    "FixedWrinkles": "model.fixed_wrinkles",
    "Form": "equilibrium.form_finding",
    "NaturalShape": "geometry.natural_shape",
    "FreeBody": "model.supports",
    "GasPressure": "model.gas_pressure",
    "HarmonicPressures": "stability.harmonic_buckling",
    "Fixed": "model.supports",
    "Hoops": "model.cables",
    "IMP": "model.imp",
    "Isotensoid": "geometry.isotensoid",
    "Isotropic": "model.film",
    "Modes": "stability.modes",
    "Perturbed": "stability.perturbation",
    "PlateLoad": "model.end_plates",
    "PrescribedPath": "model.imp",
    "Released": "stability.relaxation",
    "Surface": "geometry.surface",
    "TensionField": "model.tension_field",
    "Trace": "stability.tracing",
    "critical_point": "stability.nonlinear_buckling",
    "critical_pressure": "stability.linear_buckling",
    "cylinder": "geometry.stacks",
    "find_form": "equilibrium.form_finding",
    "find_modes": "stability.modes",
    "harmonic_pressures": "stability.harmonic_buckling",
    "ideal_state": "equilibrium.state",
    "inflate": "equilibrium.inflation",
    "isotensoid_stiffness": "geometry.natural_shape",
    "lobed_cylinder": "geometry.stacks",
    "perturb": "stability.perturbation",
    "pressurise": "equilibrium.pressurisation",
    "trace": "stability.tracing",
}

__all__ = [*_HOME, "__version__"]

__getattr__ = face(__name__, _HOME)


def __dir__() -> list[str]:
    return sorted(__all__)
