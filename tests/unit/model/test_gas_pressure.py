"""Gas pressure: enclosed volume and work on the current surface."""

import numpy as np
import pytest
from states import wavy

from lobefem.errors import InputError
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.linalg import dolfinx_compat
from lobefem.model.gas_pressure import GasPressure, film_volume, film_volume_change, pressure_work
from lobefem.model.kinematics import revolved_frame

import ufl
from dolfinx import fem
from mpi4py import MPI


@pytest.fixture
def parts(comm):
    surface = lobed_cylinder(1, (4, 9), comm=comm)
    V = fem.functionspace(surface.mesh, surface.mesh.ufl_domain().ufl_coordinate_element())
    u = fem.Function(V)
    x = V.tabulate_dof_coordinates()
    u.x.array[:] = (0.3 * wavy(x, 7, 2.0)).ravel()
    return surface, V, u, revolved_frame(surface.mesh, surface.axis)


def integral(surface, expression):
    dx = ufl.dx(metadata={"quadrature_degree": 4})
    value = fem.assemble_scalar(fem.form(expression * dx))
    return surface.mesh.comm.allreduce(value, op=MPI.SUM)


def moved(surface, u):
    """The same cone of volume over the film, by its corners: sum of det(a, b, c)/6."""
    geometry = surface.mesh.geometry
    owned = surface.mesh.topology.index_map(2).size_local
    cells = dolfinx_compat.geometry_dofmap(surface.mesh)[:owned]
    # nodes of geometry and of a linear field are numbered alike cell by cell
    dofs = u.function_space.dofmap.list[:owned]
    position = u.x.array.reshape(-1, 3)[dofs] if u is not None else 0
    corners = geometry.x[cells] + position
    n = np.einsum("ci,ci->c", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    a, b, c = geometry.x[cells].transpose(1, 0, 2)
    outwards = np.sign(np.einsum("ci,ci->c", np.cross(b - a, c - a), (a + b + c) * [1, 1, 0]))
    return surface.mesh.comm.allreduce(float((n * outwards).sum()), op=MPI.SUM)


def test_volume_and_its_change_are_those_of_the_facets(parts):
    surface, _, u, frame = parts
    x = ufl.SpatialCoordinate(surface.mesh)
    rest = integral(surface, film_volume(x, frame))
    change = integral(surface, film_volume_change(u, x, frame))
    assert rest + change == pytest.approx(moved(surface, u), rel=1e-13)
    zero = u.copy()
    zero.x.array[:] = 0
    assert rest == pytest.approx(moved(surface, zero), rel=1e-13)
    assert integral(surface, film_volume_change(zero, x, frame)) == 0.0


def test_small_changes_of_volume_keep_their_digits(parts):
    """dV of a displacement of 1e-9 m is the work of unit pressure on it, to nine digits."""
    surface, V, u, frame = parts
    x = ufl.SpatialCoordinate(surface.mesh)
    u.x.array[:] = 0.0
    for name in ("rim_bottom", "rim_top"):
        assert name in surface.groups
    free = np.ones(len(u.x.array) // 3, dtype=bool)
    surface.mesh.topology.create_connectivity(1, 2)
    for name in ("rim_bottom", "rim_top"):
        facets = surface.edges.find(surface.groups[name][1])
        free[fem.locate_dofs_topological(V, 1, facets)] = False
    nodes = V.tabulate_dof_coordinates()
    radial = nodes * [1, 1, 0]
    u.x.array[:] = (1e-9 * radial * free[:, None]).ravel()
    zero = u.copy()
    zero.x.array[:] = 0
    change = integral(surface, film_volume_change(u, x, frame))
    work = integral(surface, pressure_work(zero, u, frame))
    assert change == pytest.approx(work, rel=1e-8)
    assert work > 1e-9


def test_work_is_on_the_current_surface(parts):
    """A constant velocity's work is the flux of the current area: zero net but for the openings."""
    surface, _, u, frame = parts
    for e in np.eye(3):
        v = ufl.as_vector(e.tolist())
        flux = integral(surface, pressure_work(u, v, frame))
        # closed by Stokes: the area vector of an open surface is its edges' integral of x x dx/2
        X = ufl.SpatialCoordinate(surface.mesh) + u
        t = ufl.cross(ufl.CellNormal(surface.mesh), ufl.FacetNormal(surface.mesh))
        dx_edge = t + ufl.dot(ufl.grad(u), t)
        form = fem.form(ufl.dot(ufl.cross(X, dx_edge), v) / 2 * ufl.ds)
        edge = surface.mesh.comm.allreduce(fem.assemble_scalar(form), op=MPI.SUM)
        assert flux == pytest.approx(edge, abs=1e-12)
    assert abs(flux) > 1e-3


def test_conventions_are_named():
    assert GasPressure().convention == "closed"
    assert GasPressure("film").convention == "film"
    with pytest.raises(InputError, match=r"^pressure load 'open' is unknown; use 'film' or 'closed'$"):
        GasPressure("open")
