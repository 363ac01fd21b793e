"""lobefem: is a lobed balloon stable?

Tension-only film, follower gas pressure, rigid plates and cords on a Gmsh surface, equilibrium by
PETSc SNES and buckling modes by SLEPc, on DOLFINx. Names are imported when they are first used, so
that `import lobefem` costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

_HOME = {
    "Balloon": "balloon",
    "Cords": "cables",
    "CriticalPoint": "tracing",
    "CriticalPressure": "critical",
    "Design": "design",
    "EndPlates": "plates",
    "Equilibrium": "equilibrium",
    "FixedWrinkles": "films",
    "Form": "formfinding",
    "FormedLobe": "formed",
    "GasPressure": "loads",
    "HarmonicChart": "chart",
    "Held": "parts",
    "Hoops": "cables",
    "IMP": "imp",
    "Isotensoid": "isotensoid",
    "Isotropic": "films",
    "Modes": "stability",
    "Perturbed": "perturbation",
    "PlateLoad": "plates",
    "PrescribedPath": "imp",
    "Released": "release",
    "Surface": "surface",
    "TensionField": "films",
    "Trace": "tracing",
    "critical_point": "tracing",
    "critical_pressure": "critical",
    "cylinder": "surface",
    "find_form": "formfinding",
    "find_modes": "stability",
    "harmonic_chart": "chart",
    "ideal_state": "equilibrium",
    "inflate": "equilibrium",
    "isotensoid_stiffness": "formed",
    "lobed_cylinder": "surface",
    "perturb": "perturbation",
    "trace": "tracing",
}

__all__ = [*_HOME, "__version__"]

if TYPE_CHECKING:
    from lobefem.balloon import Balloon
    from lobefem.cables import Cords, Hoops
    from lobefem.chart import HarmonicChart, harmonic_chart
    from lobefem.critical import CriticalPressure, critical_pressure
    from lobefem.design import Design
    from lobefem.equilibrium import Equilibrium, ideal_state, inflate
    from lobefem.films import FixedWrinkles, Isotropic, TensionField
    from lobefem.formed import FormedLobe, isotensoid_stiffness
    from lobefem.formfinding import Form, find_form
    from lobefem.imp import IMP, PrescribedPath
    from lobefem.isotensoid import Isotensoid
    from lobefem.loads import GasPressure
    from lobefem.parts import Held
    from lobefem.perturbation import Perturbed, perturb
    from lobefem.plates import EndPlates, PlateLoad
    from lobefem.release import Released
    from lobefem.stability import Modes, find_modes
    from lobefem.surface import Surface, cylinder, lobed_cylinder
    from lobefem.tracing import CriticalPoint, Trace, critical_point, trace


def __getattr__(name: str) -> Any:
    if name in _HOME:
        # DOLFINx's seams first: PyPI's stack must be bootstrapped before any of its parts
        if _HOME[name] not in ("isotensoid", "formed", "films", "imp", "loads", "cables", "plates"):
            import_module("lobefem._dolfinx")
        return getattr(import_module(f"lobefem.{_HOME[name]}"), name)
    raise AttributeError(f"module 'lobefem' has no attribute '{name}'")


def __dir__() -> list[str]:
    return sorted(__all__)
