"""Stability of states: modes, critical pressures, branches, release.

What belongs here judges states: eigenproblems, harmonics, paths of states with their modes, and what a
distorted balloon does when it is released. It writes no file and draws nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lobefem.faces import face
from lobefem.linalg import dolfinx_compat as _dolfinx_compat  # first: it finds the stack

if TYPE_CHECKING:
    from lobefem.stability.all_gores import full_modes
    from lobefem.stability.continuum import continuum_pressure
    from lobefem.stability.gore_buckling import GorePressures, critical_pressures
    from lobefem.stability.harmonic_buckling import HarmonicPressures, harmonic_pressures
    from lobefem.stability.linear_buckling import CriticalPressure, critical_pressure
    from lobefem.stability.mesh_convergence import MeshStudy, mesh_study
    from lobefem.stability.modes import Mode, Modes, find_modes
    from lobefem.stability.nonlinear_buckling import CriticalPoint, critical_point
    from lobefem.stability.perturbation import Perturbed, perturb
    from lobefem.stability.relaxation import Released, release
    from lobefem.stability.tracing import Trace, trace

__all__ = [
    "CriticalPoint",
    "CriticalPressure",
    "GorePressures",
    "HarmonicPressures",
    "MeshStudy",
    "Mode",
    "Modes",
    "Perturbed",
    "Released",
    "Trace",
    "continuum_pressure",
    "critical_point",
    "critical_pressure",
    "critical_pressures",
    "find_modes",
    "full_modes",
    "harmonic_pressures",
    "mesh_study",
    "perturb",
    "release",
    "trace",
]

_HOME = {
    "CriticalPoint": "nonlinear_buckling",
    "CriticalPressure": "linear_buckling",
    "GorePressures": "gore_buckling",
    "HarmonicPressures": "harmonic_buckling",
    "MeshStudy": "mesh_convergence",
    "Mode": "modes",
    "Modes": "modes",
    "Perturbed": "perturbation",
    "Released": "relaxation",
    "Trace": "tracing",
    "continuum_pressure": "continuum",
    "critical_point": "nonlinear_buckling",
    "critical_pressure": "linear_buckling",
    "critical_pressures": "gore_buckling",
    "find_modes": "modes",
    "full_modes": "all_gores",
    "harmonic_pressures": "harmonic_buckling",
    "mesh_study": "mesh_convergence",
    "perturb": "perturbation",
    "release": "relaxation",
    "trace": "tracing",
}

__getattr__ = face(__name__, _HOME)
