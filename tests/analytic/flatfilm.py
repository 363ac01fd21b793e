"""Small surfaces for analytic tests: a flat square or rectangle, a quarter of a disc, a closed sphere."""

from dataclasses import replace

import numpy as np

from lobefem.linalg import dolfinx_compat

import basix.ufl

# isort: split
from lobefem.equilibrium.inflation import inflate
from lobefem.fem.balloon import Balloon
from lobefem.geometry.surface import Surface

from dolfinx import fem, la


def film_surface(comm, points, cells, cell="triangle"):
    """A mesh of linear cells in space from nodes (n, 3) and cells (m, corners) of rank 0."""
    element = basix.ufl.element("Lagrange", cell, 1, shape=(3,))
    if comm.rank:
        points, cells = np.empty((0, 3)), np.empty((0, len(cells[0])), dtype=np.int64)
    mesh = dolfinx_compat.create_mesh(comm, np.asarray(cells, dtype=np.int64), element, points)
    return Surface(mesh, axis=(0, 0, 1))


def square(comm, side, n):
    """[0, side]^2 in n x n squares, all diagonals from the origin's corner outwards."""
    i, j = (k.ravel() for k in np.indices((n + 1, n + 1)))
    points = np.column_stack([i, j, 0 * i]) * (side / n)
    i, j = (k.ravel() for k in np.indices((n, n)))
    a, b = i * (n + 1) + j, (i + 1) * (n + 1) + j
    cells = np.concatenate([np.column_stack([a, b, b + 1]), np.column_stack([a, b + 1, a + 1])])
    return film_surface(comm, points, cells)


def rectangle(comm, length, height, divisions):
    """[0, length] x [0, height] in quadrilaterals."""
    n, m = divisions
    j, i = (k.ravel() for k in np.indices((m + 1, n + 1)))
    points = np.column_stack([i * length / n, j * height / m, 0.0 * i])
    j, i = (k.ravel() for k in np.indices((m, n)))
    a = j * (n + 1) + i
    return film_surface(comm, points, np.column_stack([a, a + 1, a + n + 1, a + n + 2]), "quadrilateral")


def quarter_disc(comm, radius, rings, per_ring=2):
    """The quarter x, y >= 0 of a disc; ring i has per_ring * i equal sectors."""
    start = np.concatenate([[0], np.cumsum(per_ring * np.arange(rings + 1) + 1)])
    points, cells = [], []
    for i in range(rings + 1):
        angle = np.linspace(0, np.pi / 2, per_ring * i + 1)
        r = radius * i / rings
        points.append(np.column_stack([r * np.cos(angle), r * np.sin(angle), 0 * angle]))
    for i in range(rings):
        for k in range(per_ring):  # each wedge like a triangle of the hexagonal net
            inner, outer = start[i] + k * i, start[i + 1] + k * (i + 1)
            for j in range(i + 1):
                cells.append((inner + j, outer + j, outer + j + 1))
                if j < i:
                    cells.append((inner + j, outer + j + 1, inner + j + 1))
    points = np.concatenate(points)
    points[np.abs(points) < 1e-12 * radius] = 0.0  # cos(pi/2) exactly, for the symmetry plane
    return film_surface(comm, points, cells)


def sphere(comm, radius, refinements):
    """An octahedron refined and put on a sphere: a film without an edge, normals outwards."""
    points = np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=float)
    cells = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [1, 0, 5], [2, 1, 5], [3, 2, 5], [0, 3, 5]])
    for _ in range(refinements):
        edges = np.sort(cells[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        edges, which = np.unique(edges, axis=0, return_inverse=True)
        which = which.reshape(-1, 3) + len(points)
        points = np.concatenate([points, points[edges].mean(axis=1)])
        a, b, c = cells.T
        ab, bc, ca = which.T
        cells = np.concatenate(
            [np.column_stack(t) for t in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))]
        )
    points /= np.linalg.norm(points, axis=1)[:, None]
    return film_surface(comm, radius * points, cells)


def nodal(balloon):
    """Reference positions of this rank's nodes, ghosts included, (nodes, 3)."""
    return balloon.V.tabulate_dof_coordinates()


def state_at(balloon, displacement, pressure=0.0):
    """A state with the given nodal displacements (nodes, 3), as a start for `inflate`."""
    rest = inflate(balloon, 0.0)
    unknowns = rest.unknowns.copy()
    free = balloon.map.free
    unknowns[: free.size] = np.asarray(displacement).reshape(-1)[free]
    return replace(rest, unknowns=unknowns, pressure=pressure)


def value_at(balloon, state, point):
    """Displacement (3,) of the node at `point`, on every rank."""
    x = nodal(balloon)
    owned = balloon.V.dofmap.index_map.size_local
    near = np.flatnonzero(np.linalg.norm(x[:owned] - np.asarray(point), axis=1) < 1e-10)
    mine = state.displacement[near[0]] if near.size else None
    found = [u for u in balloon.comm.allgather(mine) if u is not None]
    assert len(found) == 1
    return found[0]


def rates(errors):
    """Observed orders of convergence of errors on meshes each twice as fine as the one before."""
    errors = np.abs(errors)
    return np.log2(errors[:-1] / errors[1:])


def fan(comm, radius, rings, sectors):
    """The quarter x, y >= 0 of a disc cut along `sectors` equal angles, mirrored at every spoke."""
    angle = np.linspace(0, np.pi / 2, sectors + 1)
    spoke = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    spoke[np.abs(spoke) < 1e-12] = 0.0
    r = radius * np.arange(1, rings + 1) / rings
    points = np.concatenate([np.zeros((1, 3)), (r[:, None, None] * spoke).reshape(-1, 3)])
    cells = []
    for j in range(sectors):
        cells.append((0, 1 + j, 2 + j))
        for i in range(rings - 1):
            a = 1 + i * (sectors + 1) + j
            b, c, d = a + 1, a + sectors + 2, a + sectors + 1  # a-b inner, d-c outer
            cells += [(a, d, c), (a, c, b)] if j % 2 else [(a, d, b), (b, d, c)]
    return film_surface(comm, points, cells)


def stretched(balloon, guess, **options):
    """Equilibrium, without pressure, of a flat film whose edges are held at displacements.

    Args:
        balloon: with `Fixed` parts.
        guess: function of coordinates x (3, n): displacements (3, n) from which Newton's method starts.
        options: of `inflate`.
    """
    still = [replace(part, displacement=None) for part in balloon.components]
    rest = Balloon(balloon.surface, balloon.film, still, frame=balloon.frame)
    start = state_at(rest, guess(nodal(balloon).T).T)
    return inflate(balloon, 0.0, start=start, **options)


def nodal_forces(balloon, state):
    """Reference positions (n, 3) and out-of-balance forces (n, 3) [N] of all nodes, on every rank.

    In equilibrium the forces are those of the supports.
    """
    balloon.set_unknowns(state.vector())
    r = fem.assemble_vector(balloon.forms.residual)
    r.scatter_reverse(la.InsertMode.add)
    forces = r.array.reshape(-1, 3)[: balloon.map.owned // 3]
    return gathered(balloon.comm, nodal(balloon)[: len(forces)], forces)


def cell_resultants(balloon, state):
    """Centres (n, 3) and mean resultants (N_m, N_h, N_mh) (n, 3) [N/m] of all cells, on every rank."""
    owned = balloon.mesh.topology.index_map(2).size_local
    centres = nodal(balloon)[balloon.V.dofmap.list[:owned]].mean(axis=1)
    return gathered(balloon.comm, centres, state.stress_resultants().x.array.reshape(-1, 3)[:owned])


def gathered(comm, *arrays):
    return [np.concatenate(comm.allgather(array)) for array in arrays]
