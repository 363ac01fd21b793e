"""Smooth deterministic states of a balloon, the same on any number of ranks."""

import numpy as np

from lobefem.linalg import dolfinx_compat

import ufl
from dolfinx import fem


def wavy(x, seed, waves=7.0):
    """A displacement field (n, 3) of size 1 that varies over a metre or less."""
    rng = np.random.default_rng(seed)
    field = np.zeros_like(x)
    for _ in range(4):
        k = rng.normal(size=(3, 3)) * waves / 3
        field += np.sin(x @ k.T + rng.uniform(0, 6, 3)) * rng.uniform(0.5, 1, 3) / 4
    return field


def unknowns(balloon, displacement, parameters=0.0):
    """q of nodal displacements (nodes, 3) and plate parameters (a number or an array)."""
    q = balloon.map.create_vector()
    free = balloon.map.free
    with q as array:
        array[: free.size] = displacement.reshape(-1)[free]
        array[free.size :] = (
            np.broadcast_to(parameters, balloon.map.num_parameters) if array.size > free.size else 0.0
        )
    return q


def nodes(balloon):
    """Reference positions of this rank's nodes, ghosts included, (nodes, 3)."""
    return balloon.V.tabulate_dof_coordinates()


def cell_strains(balloon):
    """A function of q: principal strains (cells, 2), minor first, of this rank's linear triangles."""
    W = fem.functionspace(balloon.mesh, ("DG", 0, (2, 2)))
    strain = fem.Function(W)
    expression = fem.Expression(
        ufl.as_tensor(balloon.forms.strain), dolfinx_compat.interpolation_points(W.element)
    )

    def at(q):
        balloon.set_unknowns(q)
        strain.interpolate(expression)
        return np.linalg.eigvalsh(strain.x.array.reshape(-1, 2, 2))

    return at


def kink_distance(strains, nu):
    """Distance of each cell's strain from a change of the tension field's state."""
    minor, major = strains.T
    taut = minor + nu * major
    return np.minimum(np.abs(taut), np.where(taut >= 0, np.inf, np.abs(major)))


def taylor_rates(remainder, steps):
    """Observed orders of the remainders over steps that halve."""
    found = np.array([abs(remainder(h)) for h in steps])
    return np.log2(found[:-1] / found[1:])
