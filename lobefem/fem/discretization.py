"""`Discretization`: the space, displacement and loads of a balloon, in which its forms are written."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from lobefem.geometry import gather
from lobefem.geometry.axis import Axis
from lobefem.geometry.surface import Surface
from lobefem.model.kinematics import Frame, cell_frame, revolved_frame
from lobefem.typing import Mesh

import ufl
from dolfinx import fem
from mpi4py import MPI

__all__ = ["Discretization", "axis_terms"]


class Discretization:
    """Mesh, displacement and loads of a balloon, and where its axis stands.

    Args:
        surface: where the film lies.
        axis: of the surface.
        frame: the film's; by default that of a surface of revolution, or each cell's own.

    Collective.
    """

    def __init__(self, surface: Surface, axis: Axis, frame: Frame | None) -> None:
        self.mesh = surface.mesh
        self.comm = self.mesh.comm
        self.order = gather.degree(self.mesh)
        self.V = gather.nodal_space(self.mesh)
        self.X = self.V.tabulate_dof_coordinates()
        self.X.flags.writeable = False
        self.u = fem.Function(self.V, name="displacement")
        self.pressure = fem.Constant(self.mesh, 0.0)
        self.prestress = fem.Constant(self.mesh, 0.0)
        self.axis = axis
        self.direction, origin = axis_terms(self.mesh, axis)
        self.x = ufl.SpatialCoordinate(self.mesh) - origin
        if frame is not None:
            self.frame = frame
        elif surface.of_revolution:
            self.frame = revolved_frame(self.mesh, self.direction, origin)
        else:
            self.frame = cell_frame(self.mesh)

    @cached_property
    def lowest(self) -> float:
        """Height of the lowest node along the axis [m]. Collective."""
        lowest = float(self.axis.relative(self.X)[:, 2].min(initial=np.inf))
        return float(self.comm.allreduce(lowest, op=MPI.MIN))


def axis_terms(mesh: Mesh, axis: Axis) -> tuple[Any, Any]:
    """Direction and origin of an axis in UFL: constants, so that a form is compiled once for all places."""
    if axis.home:  # without the terms that vanish
        return ufl.as_vector([0.0, 0.0, 1.0]), ufl.as_vector([0.0, 0.0, 0.0])
    return fem.Constant(mesh, axis.direction), fem.Constant(mesh, axis.origin)
