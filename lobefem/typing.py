"""Types that signatures share: arrays by what they hold, objects of libraries without stubs by their names.

The latter are `Any` to a type checker. They say to a reader what goes in, without an import of DOLFINx.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import numpy.typing as npt

__all__ = [
    "EPS",
    "KSP",
    "SNES",
    "TS",
    "Array",
    "Axes",
    "Cell",
    "Comm",
    "ComplexArray",
    "Constant",
    "Convention",
    "Diagonals",
    "Expr",
    "Form",
    "Function",
    "Gmsh",
    "Indices",
    "Integers",
    "Layout",
    "Mass",
    "Mat",
    "Measure",
    "Mesh",
    "Scalar",
    "Space",
    "Sparse",
    "StateKind",
    "Support",
    "Tangent",
    "Unchecked",
    "Vec",
]

Array = npt.NDArray[np.float64]
ComplexArray = npt.NDArray[np.complex128]
Integers = npt.NDArray[np.int64]
Indices = npt.NDArray[np.int32]  # of nodes and cells, as DOLFINx has them

type Comm = Any  # mpi4py.MPI.Comm

type Vec = Any  # petsc4py.PETSc.Vec
type Mat = Any  # petsc4py.PETSc.Mat
type KSP = Any  # petsc4py.PETSc.KSP
type SNES = Any  # petsc4py.PETSc.SNES
type TS = Any  # petsc4py.PETSc.TS
type EPS = Any  # slepc4py.SLEPc.EPS
type Sparse = Any  # a matrix of scipy.sparse

type Gmsh = Any  # the module, once it is imported and started
type Axes = Any  # matplotlib.axes.Axes

type Mesh = Any  # dolfinx.mesh.Mesh
type Space = Any  # dolfinx.fem.FunctionSpace
type Function = Any  # dolfinx.fem.Function
type Constant = Any  # dolfinx.fem.Constant
type Form = Any  # ufl.Form, or dolfinx.fem.Form: compiled
type Measure = Any  # ufl.Measure
type Expr = Any  # ufl.core.expr.Expr, or a number in its place
type Scalar = Any  # a number, an array of numbers or a UFL expression: arithmetic is all it meets

type Unchecked = Any  # what somebody has given, of any type, before it is looked at

Cell = Literal["triangle", "quadrilateral"]
Diagonals = Literal["same", "alternating"]  # of structured triangles
Layout = Literal["structured", "unstructured"]
Convention = Literal["film", "closed"]  # of the gas pressure: what it bears on
Support = Literal["clamped", "pinned", "fixed"]  # of end plates
Tangent = Literal["consistent", "secant"]  # of a law written as a stress
Mass = Literal["unit", "nodal"]  # of modes
StateKind = Literal["ideal", "inflated"]  # in which modes are looked for
