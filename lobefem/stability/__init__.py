"""Stability of states: modes, critical pressures, branches, release.

What belongs here judges states: eigenproblems, harmonics, paths of states with their modes, and what a
distorted balloon does when it is released. It writes no file and draws nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from lobefem.faces import face
from lobefem.linalg import dolfinx_compat as _dolfinx_compat  # first: it finds the stack

if TYPE_CHECKING:
    from lobefem.stability.all_gores import full_modes
    from lobefem.stability.branch_following import Branch, follow
    from lobefem.stability.continuum import continuum_pressure, unstable_from
    from lobefem.stability.cyclic import Sector, sector_balloon
    from lobefem.stability.deployment import Deployment, deploy
    from lobefem.stability.gore_buckling import GorePressures, critical_pressures
    from lobefem.stability.gore_modes import GoreMode
    from lobefem.stability.harmonic_buckling import HarmonicPressures, harmonic_pressures
    from lobefem.stability.linear_buckling import CriticalPressure, critical_pressure
    from lobefem.stability.mesh_convergence import MeshStudy, mesh_study
    from lobefem.stability.mode_records import Mode, Modes
    from lobefem.stability.modes import find_modes
    from lobefem.stability.nonlinear_buckling import CriticalPoint, critical_point
    from lobefem.stability.one_sided import (
        OneSidedModes,
        OneSidedPressures,
        one_sided_charts,
        one_sided_modes,
        one_sided_pressures,
        slack_critical_pressure,
    )
    from lobefem.stability.perturbation import Perturbed, Point, perturb
    from lobefem.stability.refinement import Trend, trend
    from lobefem.stability.relaxation import Released, release
    from lobefem.stability.sector_modes import SectorMode
    from lobefem.stability.sensitivities import Adjoint, critical_sensitivity
    from lobefem.stability.sensitivity_record import Sensitivity
    from lobefem.stability.tracing import Trace, branches, trace

_HOME = {
    "Adjoint": "sensitivities",
    "Branch": "branch_following",
    "CriticalPoint": "nonlinear_buckling",
    "CriticalPressure": "linear_buckling",
    "Deployment": "deployment",
    "GoreMode": "gore_modes",
    "GorePressures": "gore_buckling",
    "HarmonicPressures": "harmonic_buckling",
    "MeshStudy": "mesh_convergence",
    "Mode": "mode_records",
    "Modes": "mode_records",
    "OneSidedModes": "one_sided",
    "OneSidedPressures": "one_sided",
    "Perturbed": "perturbation",
    "Point": "perturbation",
    "Released": "relaxation",
    "Sector": "cyclic",
    "SectorMode": "sector_modes",
    "Sensitivity": "sensitivity_record",
    "Trace": "tracing",
    "Trend": "refinement",
    "branches": "tracing",
    "continuum_pressure": "continuum",
    "critical_point": "nonlinear_buckling",
    "critical_pressure": "linear_buckling",
    "critical_pressures": "gore_buckling",
    "critical_sensitivity": "sensitivities",
    "deploy": "deployment",
    "find_modes": "modes",
    "follow": "branch_following",
    "full_modes": "all_gores",
    "harmonic_pressures": "harmonic_buckling",
    "mesh_study": "mesh_convergence",
    "one_sided_charts": "one_sided",
    "one_sided_modes": "one_sided",
    "one_sided_pressures": "one_sided",
    "perturb": "perturbation",
    "release": "relaxation",
    "sector_balloon": "cyclic",
    "slack_critical_pressure": "one_sided",
    "trace": "tracing",
    "trend": "refinement",
    "unstable_from": "continuum",
}

__all__ = [
    "Adjoint",
    "Branch",
    "CriticalPoint",
    "CriticalPressure",
    "Deployment",
    "GoreMode",
    "GorePressures",
    "HarmonicPressures",
    "MeshStudy",
    "Mode",
    "Modes",
    "OneSidedModes",
    "OneSidedPressures",
    "Perturbed",
    "Point",
    "Released",
    "Sector",
    "SectorMode",
    "Sensitivity",
    "Trace",
    "Trend",
    "branches",
    "continuum_pressure",
    "critical_point",
    "critical_pressure",
    "critical_pressures",
    "critical_sensitivity",
    "deploy",
    "find_modes",
    "follow",
    "full_modes",
    "harmonic_pressures",
    "mesh_study",
    "one_sided_charts",
    "one_sided_modes",
    "one_sided_pressures",
    "perturb",
    "release",
    "sector_balloon",
    "slack_critical_pressure",
    "trace",
    "trend",
    "unstable_from",
]

__getattr__, __dir__ = face(__name__, _HOME)
