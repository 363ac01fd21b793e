"""Frames, strain, area vector and edge stretch against closed forms of affine and bent films."""

import numpy as np
import pytest

from lobefem.geometry.stacks import cylinder, lobed_cylinder
from lobefem.model.kinematics import area_vector, edge_strain, green_lagrange, revolved_frame, tangent_frame

import ufl
from dolfinx import fem
from mpi4py import MPI

F = np.array([[1.1, 0.2, -0.1], [0.05, 0.9, 0.3], [0.1, -0.2, 1.2]])


@pytest.fixture
def surface(comm):
    return lobed_cylinder(2, (4, 9), comm=comm)


def square_integral(surface, expression, measure=ufl.dx):
    """The integral of a square, for expressions that must vanish everywhere."""
    form = fem.form(ufl.inner(expression, expression) * measure)
    return surface.mesh.comm.allreduce(fem.assemble_scalar(form), op=MPI.SUM)


def displacement(surface, map_):
    element = surface.mesh.ufl_domain().ufl_coordinate_element()
    V = fem.functionspace(surface.mesh, element)
    u = fem.Function(V)
    u.interpolate(lambda x: map_(x) - x)
    return u


def check_orthonormal(surface, frame):
    rows = ufl.as_matrix([[v[i] for i in range(3)] for v in frame])
    assert square_integral(surface, rows * rows.T - ufl.Identity(3)) < 1e-24
    assert square_integral(surface, ufl.cross(frame.m, frame.h) - frame.n) < 1e-24
    assert square_integral(surface, frame.n - ufl.CellNormal(surface.mesh)) < 1e-24


def test_revolved_frame_follows_meridian_and_hoop(surface):
    frame = revolved_frame(surface.mesh, surface.axis)
    check_orthonormal(surface, frame)
    x = ufl.SpatialCoordinate(surface.mesh)
    # h goes round the axis, so that m x h = n outwards makes m go down the meridian
    around = ufl.as_vector([-x[1], x[0], 0])
    radius = ufl.sqrt(ufl.dot(around, around))
    wrong = ufl.conditional(ufl.lt(ufl.dot(frame.h, around) / radius, 0.9), 1.0, 0.0)
    wrong += ufl.conditional(ufl.gt(frame.m[2], -0.2), 1.0, 0.0)
    assert square_integral(surface, wrong) == 0


@pytest.mark.parametrize("direction", [(1, 0, 0), (0.2, -0.3, 0.9)])
def test_tangent_frame_projects_its_direction(comm, direction):
    surface = cylinder(2.0, 3.0, (3, 5), comm=comm)
    frame = tangent_frame(surface.mesh, direction)
    check_orthonormal(surface, frame)
    d = ufl.as_vector(list(map(float, direction)))
    assert square_integral(surface, ufl.dot(d, frame.h)) < 1e-24


def test_strain_of_an_affine_motion(surface):
    """E = T^T (F^T F - 1) T/2 with T the frame, for strains of any size."""
    u = displacement(surface, lambda x: F @ x)
    for frame in (revolved_frame(surface.mesh, surface.axis), tangent_frame(surface.mesh, (0, 0, 1))):
        C = ufl.as_matrix((F.T @ F - np.eye(3)).tolist()) / 2
        tangents = (frame.m, frame.h)
        exact = ufl.as_matrix([[ufl.dot(a, C * b) for b in tangents] for a in tangents])
        assert square_integral(surface, green_lagrange(u, frame) - exact) < 1e-22


def test_strains_of_1e_9_keep_their_digits(surface):
    """From the deformation gradient, 1 + 1e-9 would leave seven digits."""
    u = displacement(surface, lambda x: (1 + 1e-9) * x)
    frame = revolved_frame(surface.mesh, surface.axis)
    exact = (1e-9 + 1e-18 / 2) * ufl.Identity(2)
    error = square_integral(surface, (green_lagrange(u, frame) - exact) / 1e-9)
    # the nodal values themselves carry (1 + 1e-9) x to 1e-16: 1e-7 of the strain
    assert np.sqrt(error) < 1e-5


def test_area_vector_is_the_cofactor_of_the_normal(surface):
    u = displacement(surface, lambda x: F @ x)
    frame = revolved_frame(surface.mesh, surface.axis)
    cofactor = ufl.as_matrix((np.linalg.det(F) * np.linalg.inv(F).T).tolist())
    assert square_integral(surface, area_vector(u, frame) - cofactor * frame.n) < 1e-22


def test_edge_strain_is_the_edges_own_from_both_sides(surface):
    u = displacement(surface, lambda x: F @ x)
    C = ufl.as_matrix((F.T @ F - np.eye(3)).tolist()) / 2
    t = ufl.cross(ufl.CellNormal(surface.mesh), ufl.FacetNormal(surface.mesh))
    exact = ufl.dot(t, C * t)
    ds = ufl.Measure("ds", domain=surface.mesh, subdomain_data=surface.edges)
    dS = ufl.Measure("dS", domain=surface.mesh, subdomain_data=surface.edges)
    rim, seam = surface.groups["rim_top"][1], surface.groups["seam_1"][1]
    found = edge_strain(u, surface.mesh)
    assert square_integral(surface, found - exact, ds(rim)) < 1e-24
    for side in "+-":
        found = edge_strain(u, surface.mesh, side)
        assert square_integral(surface, found - exact("-"), dS(seam)) < 1e-24
    assert square_integral(surface, exact("+"), dS(seam)) > 1e-3
