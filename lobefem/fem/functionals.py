"""Functionals of a balloon in its present displacement: areas, tensions, stresses, sizes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from lobefem.fem.balloon import Balloon
from lobefem.geometry.axis import across
from lobefem.linalg import dolfinx_compat
from lobefem.linalg.assembly import totals
from lobefem.model import kinematics
from lobefem.typing import Array, Expr, Vec

import ufl
from dolfinx import fem
from mpi4py import MPI

__all__ = [
    "cable_tensions",
    "displacement_of",
    "largest",
    "mid_hoop_displacement",
    "middle_nodes",
    "nodal_areas",
    "owned_nodes",
    "region_areas",
    "region_shares",
    "stiffness_scale",
    "straining_share",
    "strains",
    "stress_resultants",
    "true_resultants",
]


def mid_hoop_displacement(balloon: Balloon, displacement: Array) -> float:
    """Displacement along x of the middle hoop's centre [m]; of an odd number of lobes the equator's.

    The mean over the nodes of the ring, or over those nearest to the middle; e1 in the place of x where the
    axis is not z. Collective.
    """
    nodes = middle_nodes(balloon)
    first = across(balloon.axis.direction)[0]
    sums = np.array([float((displacement[nodes] @ first).sum()), len(nodes)])
    total, count = balloon.comm.allreduce(sums)
    return float(total / count)


def cable_tensions(balloon: Balloon) -> tuple[float, ...]:
    """Mean tension of each cable group over its reference length [N]. Collective."""
    forms = balloon.forms
    if not forms.cable_forms.terms:
        return ()
    return tuple((forms.cable_forms.sums(forms.pulls) / forms.lengths).tolist())


def region_areas(balloon: Balloon) -> tuple[float, float, float]:
    """Reference areas of taut, wrinkled and slack film [m^2]. Collective."""
    taut, wrinkled, slack = totals(balloon.mesh, balloon.forms.regions)
    return float(taut), float(wrinkled), float(slack)


def region_shares(balloon: Balloon) -> Any:
    """Shares (taut, wrinkled, slack) of each cell's film in the present displacement. Collective."""
    shares = balloon.film.regions(balloon.forms.strain, balloon.forms.number)
    return _cell_means(balloon, ufl.as_vector(shares), "regions")


def stress_resultants(balloon: Balloon) -> Any:
    """Cell means of (N_m, N_h, N_mh) [N/m] in the present displacement. Collective."""
    S = balloon.film.stress(balloon.forms.strain, balloon.forms.number)
    N = ufl.as_vector([S[0, 0], S[1, 1], S[0, 1]])
    return _cell_means(balloon, N, "stress resultants")


def strains(balloon: Balloon) -> Any:
    """Cell means of the strain (E_m, E_h, E_mh) in the present displacement, and built in. Collective."""
    E = balloon.forms.strain
    return _cell_means(balloon, ufl.as_vector([E[0, 0], E[1, 1], E[0, 1]]), "strain")


def true_resultants(balloon: Balloon) -> Any:
    """Cell means of the true (N_phi, N_theta, N_phitheta) [N/m] in the present displacement.

    Cauchy's, per current length, in the current surface's own frame of meridian and hoop; they
    differ from `stress_resultants`, which are per reference length, where the film strains much. Both are
    those of one layer.

    Collective.
    """
    S = balloon.forms.pattern.resultants(balloon.film.stress(balloon.forms.strain, balloon.forms.number))
    N = kinematics.true_resultants(S, balloon.u, balloon.frame, balloon.x, balloon.direction)
    return _cell_means(balloon, N, "true stress resultants")


def _cell_means(balloon: Balloon, expression: Expr, name: str) -> Any:
    W = fem.functionspace(balloon.mesh, ("DG", 0, expression.ufl_shape))
    v = ufl.TestFunction(W)
    mean = fem.Function(W, name=name)
    area = fem.Function(W)
    ones = ufl.as_vector([1.0] * expression.ufl_shape[0])
    for target, f in ((mean, expression), (area, ones)):
        fem.assemble_vector(target.x.array, dolfinx_compat.form(ufl.inner(f, v) * balloon.dx))
        target.x.scatter_forward()
    mean.x.array[:] /= area.x.array
    return mean


def displacement_of(balloon: Balloon, q: Vec, dq: Vec) -> Array:
    """Nodal displacements du = J dq, ghosts included, (nodes, 3) [m]. Collective."""
    w, dw, _ = balloon.map.plate_parameters(balloon.map.parameters(q))
    du = fem.Function(balloon.V)
    balloon.map.jacobian(w, dw).mult(dq, du.x.petsc_vec)
    du.x.scatter_forward()
    return du.x.array.reshape(-1, 3).copy()


def nodal_areas(balloon: Balloon) -> Array:
    """Area [m^2] lumped to each node that this rank owns, positive for any element. Collective."""
    # integrals of quadratic shape functions vanish at vertices: take those of their squares
    diagonal = balloon.mass_matrix().getDiagonal().array_r[::3]
    return diagonal / balloon.comm.allreduce(diagonal.sum()) * balloon.reference_area


def straining_share(balloon: Balloon, real: Array, imag: Array) -> float:
    """Share of strain in a displacement gradient, |sym grad phi|^2/|grad phi|^2 in the film's plane.

    Args:
        balloon: whose film it is.
        real: nodal displacements (nodes, 3); ghosts are taken from their owners.
        imag: their imaginary part.

    Collective.
    """
    sums = np.zeros(2)
    for part in (real, imag):
        balloon.forms.directions[0].x.array[:] = part.ravel()
        balloon.forms.directions[0].x.scatter_forward()
        sums += [fem.assemble_scalar(form) for form in balloon.forms.straining]
    strain, gradient = balloon.comm.allreduce(sums)
    return float(strain / gradient) if gradient else 0.0


def largest(balloon: Balloon, displacement: npt.NDArray[Any]) -> float:
    """Largest nodal displacement [m]. Collective."""
    square = (np.abs(displacement) ** 2).sum(axis=1).max(initial=0.0)
    return float(np.sqrt(balloon.comm.allreduce(square, op=MPI.MAX)))


def middle_nodes(balloon: Balloon) -> npt.NDArray[np.int64]:
    """This rank's own nodes of the ring at half the height: the middle hoop, or an equator. Collective."""
    owned, comm = balloon.V.dofmap.index_map.size_local, balloon.comm
    height = (balloon.X[:owned] - balloon.axis.origin) @ balloon.axis.direction
    low = comm.allreduce(height.min(initial=np.inf), op=MPI.MIN)
    high = comm.allreduce(height.max(initial=-np.inf), op=MPI.MAX)
    off = np.abs(height - (low + high) / 2)
    nearest = comm.allreduce(off.min(initial=np.inf), op=MPI.MIN)
    return np.flatnonzero(off < nearest + 1e-6 * (high - low))


def owned_nodes(balloon: Balloon) -> tuple[Array, Array]:
    """Reference positions (n, 3) and areas (n,) of the nodes that this rank owns."""
    areas = nodal_areas(balloon)
    return balloon.X[: len(areas)], areas


def stiffness_scale(balloon: Balloon, pressure: float) -> float:
    """|p|/sqrt(A), the stiffness of a film under pressure [Pa/m], A its area."""
    return abs(pressure) / math.sqrt(balloon.reference_area)
