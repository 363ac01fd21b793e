"""`NewtonOptions` and `FlowOptions`: settings of the solvers, checked when they are made."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from lobefem import checks
from lobefem.errors import InputError

__all__ = ["FLOW", "NEWTON", "RAMP", "FlowOptions", "NewtonOptions"]


@dataclass(frozen=True)
class NewtonOptions:
    """Settings of Newton's method.

    Args:
        rtol: norm of the residual over that of the pressure's nodal forces.
        max_iterations: Newton iterations of one solve.
        min_step: smallest step of the pressure, or of a distortion's parameter, as a share of the whole.
        keep_tangent: on a large mesh, take further steps with a factorised tangent while they cost less than
            a new one; False for Newton's method as it is in books.
        keep_above: unknowns above which a mesh is large in this sense.
        nest_above: nodes above which an inflation with `nested` looks at a coarser mesh first; by default
            where that saves time.
        compress_above: unknowns above which MUMPS compresses the factorisation; below there is nothing to
            gain.
        petsc_options: of the solver, by their names without the prefix, as {"snes_monitor": None,
            "ksp_type": "cg"}; what stands in PETSc's own database goes before.

    Raises:
        InputError: a number out of its range.
    """

    rtol: float = 1e-8
    max_iterations: int = 40
    min_step: float = 1e-3
    keep_tangent: bool = True
    keep_above: int = 9000
    nest_above: int | None = None
    compress_above: int = 300_000
    petsc_options: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("min_step", "rtol"):
            checks.positive(name, getattr(self, name), "")
        checks.integer("max_iterations", self.max_iterations, 1)
        for name in ("keep_above", "nest_above", "compress_above"):
            if getattr(self, name) is not None:
                checks.integer(name, getattr(self, name), 0)
        if not isinstance(self.petsc_options, Mapping):
            raise InputError(
                f"petsc_options is {self.petsc_options!r}; give values by name, as {{'snes_max_it': 20}}"
            )


@dataclass(frozen=True)
class FlowOptions:
    """Settings of the damped motion c B dq/dt + r(q) = 0, see `lobefem.equilibrium.gradient_flow`.

    Args:
        damping: c as a multiple of `damping_scale`.
        tolerance: of the error of a time step, root mean square over the nodes, as a share of the
            square root of the film's area.
        settled: residual, over the norm of the pressure's nodal forces, at which the motion ends.
        close: residual of a step's solution over that of its beginning. By default the path is that of 1e-4
            to four digits, in three quarters of the iterations.
        max_steps: of the motion.
        end_time: the motion's end [s]; by default when it has settled.
        fade: time in which the forces that held the start die away [s], as Abaqus turns a boundary
            condition that is removed in a static step into its force, and that linearly to zero. By
            default they are gone at once.

    Raises:
        InputError: a number out of its range.
    """

    damping: float = 1.0
    tolerance: float = 2e-4
    settled: float = 1e-6
    close: float = 0.03
    max_steps: int = 1000
    end_time: float | None = None
    fade: float | None = None

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if value is not None:
                checks.positive(name, value, "")


# by default: of equilibria, of the increments of a distortion, of damped motions
NEWTON, RAMP, FLOW = NewtonOptions(), NewtonOptions(max_iterations=25, min_step=1e-4), FlowOptions()
