"""One sector of a cyclic surface that deforms as all others do: harmonic 0 as a constraint.

The far cut of the sector is its near one rotated by alpha = 2 pi/N about the axis, at rest and in every state
that is the same in all sectors. Tied to it, the nodes of the far cut are no unknowns, and plates can only
move along the axis and spin about it: the equilibrium of one sector is that of the whole balloon.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from lobefem.errors import InputError
from lobefem.fem.rigid_plates import PlateMotion
from lobefem.geometry.axis import Axis
from lobefem.geometry.surface import Surface
from lobefem.typing import Array, ComplexArray, Indices, Integers, Space

from dolfinx import fem
from dolfinx.mesh import exterior_facet_indices

__all__ = ["SymmetricMotion", "Ties", "about_axis", "images", "plate_basis", "ties"]

_SAME = 1e-8  # of the span, between a node and the image of its partner


class Ties(NamedTuple):
    """Nodes that do what others do, rotated: u[far] = R u[near].

    Attributes:
        far, near: block indices of the nodes (n,), all on this rank.
        rotation: R (3, 3).
    """

    far: Indices
    near: Indices
    rotation: Array


def about_axis(axis: Array, angle: float) -> Array:
    """Rotation by an angle [rad] about a unit vector (3, 3)."""
    x, y, z = axis
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * skew + (1.0 - math.cos(angle)) * skew @ skew


def ties(V: Space, X: Array, surface: Surface, axis: Axis) -> Ties:
    """Nodes of a sector's far cut with their partners on the near one.

    Args:
        V: space of displacements of the sector's mesh, which is whole on every rank.
        X: positions of its nodes (nodes, 3) [m].
        surface: one sector.
        axis: of the surface.

    Raises:
        InputError: the surface has no two cuts that are each other's image.
    """
    from scipy.spatial import cKDTree

    mesh = surface.mesh
    mesh.topology.create_connectivity(1, 2)
    edge = fem.locate_dofs_topological(V, 1, exterior_facet_indices(mesh.topology))
    rotation = about_axis(axis.direction, 2.0 * math.pi / surface.copies)
    places = X[edge] - axis.origin
    span = float(np.ptp(places, axis=0).max())
    distance, partner = cKDTree(places).query(places @ rotation.T)
    near = np.flatnonzero((distance < _SAME * span) & (partner != np.arange(len(edge))))
    if not near.size:
        raise InputError(
            f"the surface is said to be one of {surface.copies} equal sectors, and no edge of it is another "
            "one rotated about the axis; check copies and axis"
        )
    return Ties(edge[partner[near]], edge[near], rotation)


def images(sector: Any, whole: Any) -> tuple[Integers, Integers]:
    """Sector j, and node i of the first one, of each node of a whole balloon: X = R^j X_i. Collective.

    Args:
        sector: balloon of one sector.
        whole: balloon of all of them (this rank's nodes, ghosts included).

    Returns:
        sectors (nodes,) from 0 to N - 1, nodes (nodes,).

    Raises:
        InputError: a node that is no image of one of the sector's.
    """
    from scipy.spatial import cKDTree

    order, axis = sector.surface.copies, sector.axis
    alpha = 2.0 * math.pi / order
    tree, span = cKDTree(sector.X), float(np.ptp(sector.X, axis=0).max())
    inside = axis.cylindrical(sector.X.mean(axis=0)[None])[0][0] - alpha / 2
    guess = np.floor((axis.cylindrical(whole.X)[0] - inside) / alpha + 1e-6).astype(np.int64)
    sectors, nodes = np.zeros_like(guess), np.full_like(guess, -1)
    for off in (0, -1, 1):
        for j in np.unique(guess + off):
            at = np.flatnonzero((guess + off == j) & (nodes < 0))
            places = (whole.X[at] - axis.origin) @ about_axis(axis.direction, j * alpha) + axis.origin
            distance, found = tree.query(places)
            hit = distance < _SAME * span
            sectors[at[hit]], nodes[at[hit]] = j % order, found[hit]
    missing = whole.comm.allreduce(int((nodes < 0).sum()))
    if missing:
        raise InputError(
            f"{missing} nodes of the whole balloon are no images of those of the sector rotated about the "
            "axis; mesh both alike"
        )
    return sectors, nodes


def plate_basis(motion: PlateMotion | None, axis: Axis, harmonic: int) -> ComplexArray:
    """Plate parameters (rows) that move in a harmonic (columns).

    With n = 0 those along the axis, with n = 1 the pairs across it as x + i y, which is what turns with
    e^{i theta}.
    """
    names = motion.names if motion is not None else ()
    columns: list[ComplexArray] = []
    x, y, z = axis.basis
    for k, name in enumerate(names):
        column = np.zeros(len(names), dtype=complex)
        if name.endswith("_x") and harmonic <= 1:  # the first of a vector's three components
            column[k : k + 3] = z if harmonic == 0 else x + 1j * y
        elif name.endswith("_1") and harmonic == 1:  # the first of a tilt's two
            column[k : k + 2] = motion.across @ (x + 1j * y)  # type: ignore[union-attr]
        else:
            continue
        columns.append(column)
    return np.array(columns, dtype=complex).reshape(len(columns), len(names)).T


class SymmetricMotion:
    """The motion of plates in harmonic 0: along the axis and about it.

    Stands for the `PlateMotion` that it is made from wherever a constraint map needs one.

    Args:
        motion: with all its parameters.
        axis: of the surface.
    """

    def __init__(self, motion: PlateMotion, axis: Axis) -> None:
        self._motion = motion
        self._basis = plate_basis(motion, axis, 0).real
        self.size = self._basis.shape[1]
        self.pushed = None

    def __getattr__(self, name: str) -> Any:
        return getattr(self._motion, name)

    def evaluate(self, y: Array) -> tuple[Array, Array, Array]:
        """The plates' w (12,), dw/dy (12, size) and d2w/dy2 (12, size, size) at y (size,)."""
        w, dw, d2w = self._motion.evaluate(self._basis @ y)
        return w, dw @ self._basis, np.einsum("wkl,ka,lb->wab", d2w, self._basis, self._basis)

    def coordinates(self, w: Array) -> Array:
        """The y of a motion w (12,)."""
        return self._basis.T @ self._motion.coordinates(w)
