"""Frames, Green-Lagrange strain and current area vector of a film, stretch of an edge (UFL).

Everything is written from the displacement gradient rather than from the deformation gradient, so
that strains of 1e-6, the working range of a nearly inextensible film, keep their digits.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from lobefem.typing import Expr, Mesh

import ufl

__all__ = [
    "Frame",
    "area_vector",
    "cell_frame",
    "edge_strain",
    "green_lagrange",
    "revolved_frame",
    "tangent_frame",
    "true_resultants",
]


class Frame(NamedTuple):
    """Right-handed orthonormal frame of the reference surface: m x h = n, n outwards.

    Attributes:
        m: first tangent (meridian; the wrinkle direction of a fixed-wrinkle film).
        h: second tangent (hoop).
        n: unit normal.
    """

    m: Any
    h: Any
    n: Any


def _unit(vector: Expr) -> Any:
    return vector / ufl.sqrt(ufl.dot(vector, vector))


def revolved_frame(mesh: Mesh, axis: Expr, origin: Expr = (0.0, 0.0, 0.0)) -> Frame:
    """The frame of a surface of revolution about `axis`, a unit vector, through the point `origin`.

    The hoop direction is axis x (X - origin) projected on the element's own plane, so that it stays a tangent
    of a faceted surface too and turns with X inside a facet; the meridian is m = h x n.
    """
    n = ufl.CellNormal(mesh)
    around = ufl.cross(ufl.as_vector(list(axis)), ufl.SpatialCoordinate(mesh) - ufl.as_vector(list(origin)))
    h = _unit(around - ufl.dot(around, n) * n)
    return Frame(ufl.cross(h, n), h, n)


def tangent_frame(mesh: Mesh, direction: Expr) -> Frame:
    """The frame whose first vector is `direction` (3,) projected on the surface, for flat films."""
    n = ufl.CellNormal(mesh)
    d = ufl.as_vector(list(direction))
    m = _unit(d - ufl.dot(d, n) * n)
    return Frame(m, ufl.cross(n, m), n)


def cell_frame(mesh: Mesh) -> Frame:
    """The frame whose first vector is each cell's first side, for laws without a direction."""
    n = ufl.CellNormal(mesh)
    jacobian = ufl.Jacobian(mesh)
    m = _unit(ufl.as_vector([jacobian[i, 0] for i in range(3)]))
    return Frame(m, ufl.cross(n, m), n)


def green_lagrange(u: Expr, frame: Frame) -> Any:
    """Green-Lagrange strain of the film in its frame, 2x2, E_ab = (x_,a . x_,b - X_,a . X_,b)/2."""
    g_m, g_h = ufl.dot(ufl.grad(u), frame.m), ufl.dot(ufl.grad(u), frame.h)
    e_mm = ufl.dot(frame.m, g_m) + ufl.dot(g_m, g_m) / 2
    e_hh = ufl.dot(frame.h, g_h) + ufl.dot(g_h, g_h) / 2
    e_mh = (ufl.dot(frame.m, g_h) + ufl.dot(frame.h, g_m) + ufl.dot(g_m, g_h)) / 2
    return ufl.as_matrix([[e_mm, e_mh], [e_mh, e_hh]])


def area_vector(u: Expr, frame: Frame) -> Any:
    """Current normal times current area per reference area, (F m) x (F h), outwards."""
    gradient = ufl.grad(u)
    return ufl.cross(frame.m + ufl.dot(gradient, frame.m), frame.h + ufl.dot(gradient, frame.h))


def true_resultants(S: Expr, u: Expr, frame: Frame, x: Expr, axis: Expr) -> Any:
    """True stress resultants (N_phi, N_theta, N_phitheta) of the deformed film, F S F^T/J.

    Args:
        S: second Piola-Kirchhoff resultants in `frame`, 2x2.
        u: displacement.
        frame: the reference frame.
        x: reference position from a point on the axis.
        axis: its direction; the components are those along the deformed surface's meridian and hoop about it.
    """
    gradient = ufl.grad(u)
    f = frame.m + ufl.dot(gradient, frame.m), frame.h + ufl.dot(gradient, frame.h)
    area = area_vector(u, frame)
    J = ufl.sqrt(ufl.dot(area, area))
    n = area / J
    around = ufl.cross(ufl.as_vector(list(axis)), x + u)
    h = _unit(around - ufl.dot(around, n) * n)
    m = ufl.cross(h, n)

    def component(a: Expr, b: Expr) -> Any:
        return sum(S[i, j] * ufl.dot(f[i], a) * ufl.dot(f[j], b) for i in range(2) for j in range(2)) / J

    return ufl.as_vector([component(m, m), component(h, h), component(m, h)])


def edge_strain(u: Expr, mesh: Mesh, side: str | None = None) -> Any:
    """Green-Lagrange strain of an edge along itself, (|F t|^2 - 1)/2, t = n x (edge normal).

    Args:
        u: displacement.
        mesh: the surface mesh.
        side: "+" inside an interior-facet integral (the edge's stretch is the same from both of
            its cells), None in an exterior-facet one.
    """
    t = ufl.cross(ufl.CellNormal(mesh), ufl.FacetNormal(mesh))
    g = ufl.dot(ufl.grad(u), t)
    strain = ufl.dot(t, g) + ufl.dot(g, g) / 2
    return strain(side) if side else strain
