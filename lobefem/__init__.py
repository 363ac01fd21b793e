"""lobefem: is a lobed balloon stable?

Tension-only film, follower gas pressure, rigid plates and cables on a Gmsh surface, equilibrium by
PETSc SNES and buckling modes by SLEPc, on DOLFINx. Names are imported when they are first used, so
that `import lobefem` costs nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from lobefem.faces import face
from lobefem.version import __version__

if TYPE_CHECKING:
    from lobefem.equilibrium.clefts import Cleft, HarmonicSeed
    from lobefem.equilibrium.displacement_control import Distorted, distort, release_start
    from lobefem.equilibrium.distortions import Bend, Tip, Twist, Wave
    from lobefem.equilibrium.form_finding import Form, find_form
    from lobefem.equilibrium.full_model import full_state
    from lobefem.equilibrium.inflation import inflate
    from lobefem.equilibrium.pressurisation import pressurise
    from lobefem.equilibrium.sealed_gas import fill, seal
    from lobefem.equilibrium.solver_options import FlowOptions, NewtonOptions
    from lobefem.equilibrium.state import Equilibrium, ideal_state
    from lobefem.fem.balloon import Balloon
    from lobefem.geometry.gore import ConstantAngle, ConstantRadius, FlatLobe, Gore, TabulatedWidth
    from lobefem.geometry.isotensoid import Isotensoid
    from lobefem.geometry.natural_curve import NaturalCurve
    from lobefem.geometry.natural_shape import NaturalShape, isotensoid_stiffness
    from lobefem.geometry.pumpkin import PumpkinRecipe
    from lobefem.geometry.pumpkin_curve import PumpkinCurve
    from lobefem.geometry.stacks import cylinder, lobed_cylinder
    from lobefem.geometry.surface import Surface
    from lobefem.geometry.tendon_curve import TendonCurve
    from lobefem.io.checkpoints import load_state, save_state
    from lobefem.io.design import Design
    from lobefem.io.run_folder import RunFolder
    from lobefem.io.run_reader import load_run
    from lobefem.model.cables import Cables, Hoops, Tendons
    from lobefem.model.dead_weight import DeadWeight
    from lobefem.model.end_plates import EndPlates, PlateLoad
    from lobefem.model.film import Isotropic
    from lobefem.model.fixed_wrinkles import FixedWrinkles
    from lobefem.model.gas_pressure import GasPressure, SealedGas
    from lobefem.model.imp import IMP, PrescribedPath
    from lobefem.model.orthotropic import Orthotropic, OrthotropicTensionField
    from lobefem.model.self_contact import SelfContact
    from lobefem.model.supports import Fixed, FreeBody
    from lobefem.model.tension_field import TensionField
    from lobefem.stability.branch_following import Branch
    from lobefem.stability.continuum import continuum_pressure, unstable_from
    from lobefem.stability.deployment import Deployment, deploy
    from lobefem.stability.harmonic_buckling import HarmonicPressures, harmonic_pressures
    from lobefem.stability.linear_buckling import CriticalPressure, critical_pressure
    from lobefem.stability.mesh_convergence import MeshStudy, mesh_study
    from lobefem.stability.mode_records import Mode, Modes
    from lobefem.stability.modes import find_modes
    from lobefem.stability.nonlinear_buckling import CriticalPoint, critical_point
    from lobefem.stability.one_sided import (
        one_sided_charts,
        one_sided_modes,
        one_sided_pressures,
        slack_critical_pressure,
    )
    from lobefem.stability.perturbation import Perturbed, Point, perturb
    from lobefem.stability.relaxation import Released, release
    from lobefem.stability.sensitivities import Adjoint, critical_sensitivity
    from lobefem.stability.sensitivity_record import Sensitivity
    from lobefem.stability.tracing import Trace, branches, trace
    from lobefem.viz.report import write_report

_HOME = {
    "IMP": "model.imp",
    "Adjoint": "stability.sensitivities",
    "Balloon": "fem.balloon",
    "Bend": "equilibrium.distortions",
    "Branch": "stability.branch_following",
    "Cables": "model.cables",
    "Cleft": "equilibrium.clefts",
    "ConstantAngle": "geometry.gore",
    "ConstantRadius": "geometry.gore",
    "CriticalPoint": "stability.nonlinear_buckling",
    "CriticalPressure": "stability.linear_buckling",
    "DeadWeight": "model.dead_weight",
    "Deployment": "stability.deployment",
    "Design": "io.design",
    "Distorted": "equilibrium.displacement_control",
    "EndPlates": "model.end_plates",
    "Equilibrium": "equilibrium.state",
    "Fixed": "model.supports",
    "FixedWrinkles": "model.fixed_wrinkles",
    "FlatLobe": "geometry.gore",
    "FlowOptions": "equilibrium.solver_options",
    "Form": "equilibrium.form_finding",
    "FreeBody": "model.supports",
    "GasPressure": "model.gas_pressure",
    "Gore": "geometry.gore",
    "HarmonicPressures": "stability.harmonic_buckling",
    "HarmonicSeed": "equilibrium.clefts",
    "Hoops": "model.cables",
    "Isotensoid": "geometry.isotensoid",
    "Isotropic": "model.film",
    "MeshStudy": "stability.mesh_convergence",
    "Mode": "stability.mode_records",
    "Modes": "stability.mode_records",
    "NaturalCurve": "geometry.natural_curve",
    "NaturalShape": "geometry.natural_shape",
    "NewtonOptions": "equilibrium.solver_options",
    "Orthotropic": "model.orthotropic",
    "OrthotropicTensionField": "model.orthotropic",
    "Perturbed": "stability.perturbation",
    "PlateLoad": "model.end_plates",
    "Point": "stability.perturbation",
    "PrescribedPath": "model.imp",
    "PumpkinCurve": "geometry.pumpkin_curve",
    "PumpkinRecipe": "geometry.pumpkin",
    "Released": "stability.relaxation",
    "RunFolder": "io.run_folder",
    "SealedGas": "model.gas_pressure",
    "SelfContact": "model.self_contact",
    "Sensitivity": "stability.sensitivity_record",
    "Surface": "geometry.surface",
    "TabulatedWidth": "geometry.gore",
    "TendonCurve": "geometry.tendon_curve",
    "Tendons": "model.cables",
    "TensionField": "model.tension_field",
    "Tip": "equilibrium.distortions",
    "Trace": "stability.tracing",
    "Twist": "equilibrium.distortions",
    "Wave": "equilibrium.distortions",
    "branches": "stability.tracing",
    "continuum_pressure": "stability.continuum",
    "critical_point": "stability.nonlinear_buckling",
    "critical_pressure": "stability.linear_buckling",
    "critical_sensitivity": "stability.sensitivities",
    "cylinder": "geometry.stacks",
    "deploy": "stability.deployment",
    "distort": "equilibrium.displacement_control",
    "fill": "equilibrium.sealed_gas",
    "find_form": "equilibrium.form_finding",
    "find_modes": "stability.modes",
    "full_state": "equilibrium.full_model",
    "harmonic_pressures": "stability.harmonic_buckling",
    "ideal_state": "equilibrium.state",
    "inflate": "equilibrium.inflation",
    "isotensoid_stiffness": "geometry.natural_shape",
    "load_run": "io.run_reader",
    "load_state": "io.checkpoints",
    "lobed_cylinder": "geometry.stacks",
    "mesh_study": "stability.mesh_convergence",
    "one_sided_charts": "stability.one_sided",
    "one_sided_modes": "stability.one_sided",
    "one_sided_pressures": "stability.one_sided",
    "perturb": "stability.perturbation",
    "pressurise": "equilibrium.pressurisation",
    "release": "stability.relaxation",
    "release_start": "equilibrium.displacement_control",
    "save_state": "io.checkpoints",
    "seal": "equilibrium.sealed_gas",
    "slack_critical_pressure": "stability.one_sided",
    "trace": "stability.tracing",
    "unstable_from": "stability.continuum",
    "write_report": "viz.report",
}

__all__ = [
    "IMP",
    "Adjoint",
    "Balloon",
    "Bend",
    "Branch",
    "Cables",
    "Cleft",
    "ConstantAngle",
    "ConstantRadius",
    "CriticalPoint",
    "CriticalPressure",
    "DeadWeight",
    "Deployment",
    "Design",
    "Distorted",
    "EndPlates",
    "Equilibrium",
    "Fixed",
    "FixedWrinkles",
    "FlatLobe",
    "FlowOptions",
    "Form",
    "FreeBody",
    "GasPressure",
    "Gore",
    "HarmonicPressures",
    "HarmonicSeed",
    "Hoops",
    "Isotensoid",
    "Isotropic",
    "MeshStudy",
    "Mode",
    "Modes",
    "NaturalCurve",
    "NaturalShape",
    "NewtonOptions",
    "Orthotropic",
    "OrthotropicTensionField",
    "Perturbed",
    "PlateLoad",
    "Point",
    "PrescribedPath",
    "PumpkinCurve",
    "PumpkinRecipe",
    "Released",
    "RunFolder",
    "SealedGas",
    "SelfContact",
    "Sensitivity",
    "Surface",
    "TabulatedWidth",
    "TendonCurve",
    "Tendons",
    "TensionField",
    "Tip",
    "Trace",
    "Twist",
    "Wave",
    "__version__",
    "branches",
    "continuum_pressure",
    "critical_point",
    "critical_pressure",
    "critical_sensitivity",
    "cylinder",
    "deploy",
    "distort",
    "fill",
    "find_form",
    "find_modes",
    "full_state",
    "harmonic_pressures",
    "ideal_state",
    "inflate",
    "isotensoid_stiffness",
    "load_run",
    "load_state",
    "lobed_cylinder",
    "mesh_study",
    "one_sided_charts",
    "one_sided_modes",
    "one_sided_pressures",
    "perturb",
    "pressurise",
    "release",
    "release_start",
    "save_state",
    "seal",
    "slack_critical_pressure",
    "trace",
    "unstable_from",
    "write_report",
]

__getattr__, __dir__ = face(__name__, {**_HOME, "__version__": "version"})
