"""Supports, rigid plates and prescribed motions put together as the constraint map."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from lobefem.errors import InputError
from lobefem.fem.constraint_map import ConstraintMap
from lobefem.fem.cyclic_symmetry import SymmetricMotion, ties
from lobefem.fem.discretization import axis_terms
from lobefem.fem.prescribed_motion import PrescribedMotion
from lobefem.fem.rigid_plates import PlateMotion
from lobefem.geometry.axis import Axis
from lobefem.geometry.surface import Surface
from lobefem.linalg.assembly import together, totals
from lobefem.model.end_plates import EndPlates
from lobefem.model.supports import Fixed
from lobefem.typing import Space

import ufl
from dolfinx import fem
from dolfinx.mesh import meshtags

__all__ = ["constraint_map", "edge_nodes", "plate_motion"]


def edge_nodes(V: Space, surface: Surface, group: str) -> npt.NDArray[np.int32]:
    """Node indices, owned and ghosts, of a surface's edge group. Collective."""
    edges = sorted(name for name, (dimension, _) in surface.groups.items() if dimension == 1)
    if group not in edges:
        raise InputError(f"no edge group '{group}' on this surface; it has {edges}")
    return fem.locate_dofs_topological(V, 1, surface.facets(group))


def plate_motion(surface: Surface, plates: EndPlates, axis: Axis) -> PlateMotion:
    """The plates' motion; the rims' areas come from the mesh, A = |closed integral of X x t|/2.

    Args:
        surface: with its two rims.
        plates: that close them.
        axis: of the surface; the plates' centres are on it.

    Raises:
        InputError: a rim without an edge.

    Collective.
    """
    mesh = surface.mesh
    # exact for the area within edges of any of our degrees and for its moment
    rule = {"quadrature_degree": 5}
    names = ("rim_bottom", "rim_top")
    rims = [surface.facets(name) for name in names]
    # tags of our own: a surface's may depend on its number of lobes, and what is compiled on the tags
    facets, first = np.unique(np.concatenate(rims), return_index=True)
    tags = meshtags(mesh, 1, facets, np.repeat([1, 2], [len(rim) for rim in rims])[first].astype(np.int32))
    ds = ufl.Measure("ds", domain=mesh, subdomain_data=tags, metadata=rule)
    e, origin = axis_terms(mesh, axis)
    X = ufl.SpatialCoordinate(mesh) - origin
    t = ufl.cross(ufl.CellNormal(mesh), ufl.FacetNormal(mesh))
    swept = ufl.dot(ufl.cross(X, t), e) / 2
    wanted = swept, fem.Constant(mesh, 1.0), swept * ufl.dot(X, e)
    found = totals(mesh, together(mesh, *((f, ds(k)) for k in (1, 2) for f in wanted)))
    areas, lengths, moments = found.reshape(2, 3).T
    for name, length in zip(names, lengths, strict=True):
        if length == 0.0:
            raise InputError(f"edge group '{name}' is empty: there is no rim to close by a plate")
    if not isinstance(plates.bar, bool):  # a sector has its share of the plates and of their bar
        plates = replace(plates, bar=plates.bar / surface.copies)
    # a rim of arcs between tendons is not flat: its height is the mean over what it encloses, with which
    # the gas on film and plates has no other resultant than its buoyancy
    centres = axis.origin + np.outer(moments / areas, axis.direction)
    return PlateMotion(plates, centres, np.abs(areas), axis.origin, surface.copies)


def constraint_map(
    V: Space,
    X: npt.NDArray[np.float64],
    surface: Surface,
    held: Sequence[Fixed],
    motion: PlateMotion | None,
    prescribed: PrescribedMotion | None = None,
    tied: Axis | None = None,
    six: npt.NDArray[np.int32] | None = None,
) -> ConstraintMap:
    """The map from the unknowns q to nodal displacements under all that holds the film.

    Args:
        V: space of displacements.
        X: positions of its nodes at rest, ghosts included (nodes, 3) [m].
        surface: where the film lies.
        held: parts whose displacement is given.
        motion: of the plates.
        prescribed: what leads the balloon in the plates' place.
        six: further components at zero, those of a free body.
        tied: the axis about which one sector's cuts are tied, so that it deforms as all others do.

    Collective.
    """
    rims = ("rim_bottom", "rim_top") if motion else ()
    rings = (*rims, *(prescribed.seams if prescribed else ()))
    first_of_all = np.empty(0, dtype=np.int32) if six is None else six
    dofs, values = [first_of_all], [np.zeros(len(first_of_all))]
    for part in held:
        if callable(part.on):
            nodes = fem.locate_dofs_geometrical(V, part.on)
        else:
            nodes = edge_nodes(V, surface, part.on)
        given = np.zeros((3, nodes.size)) if part.displacement is None else part.displacement(X[nodes].T)
        dofs += [3 * nodes + c for c in part.components]
        values += [given[c] for c in part.components]
    fixed, first = np.unique(np.concatenate(dofs), return_index=True)
    fixed, given = fixed.astype(np.int32), np.concatenate(values)[first]
    nodes = tuple(edge_nodes(V, surface, name) for name in rings)
    if tied is not None:
        whole = SymmetricMotion(motion, tied) if motion is not None else None
        return ConstraintMap(V, X, whole, nodes, fixed, given, ties(V, X, surface, tied))
    return ConstraintMap(V, X, prescribed or motion, nodes, fixed, given)
