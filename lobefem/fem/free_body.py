"""A closed film that nothing holds: six displacement components that take out its rigid motions.

Gas in a closed film exerts no force and no moment on it as a whole, and neither does the film's stress,
whatever the displacement. So the six components that are held to make the equilibrium unique bear nothing,
and which ones they are is of no account but for the place where the film ends up.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
import numpy.typing as npt

from lobefem.errors import InputError
from lobefem.fem.specification import Specification
from lobefem.typing import Array, Space

from dolfinx.mesh import exterior_facet_indices

__all__ = ["require_afloat", "six_components"]


def require_afloat(given: Specification) -> None:
    """Refuse a free body that is held, loaded from outside or open.

    Raises:
        InputError: which of these it is.

    Collective.
    """
    parts = given.parts
    reasons = {
        "Fixed film": parts.fixed,
        "EndPlates": parts.plates,
        "DeadWeight": parts.weight.film or parts.weight.cables,
        "a pressure gradient": parts.load.gradient,
        "an extra_energy": given.extra_energy,
        "a component of your own": parts.own,
    }
    for name, reason in reasons.items():
        if reason:
            raise InputError(
                f"a FreeBody is held and loaded by nothing but the gas; leave {name} out, or FreeBody"
            )
    mesh = given.surface.mesh
    mesh.topology.create_connectivity(1, 2)
    count = mesh.comm.allreduce(len(exterior_facet_indices(mesh.topology)))
    if count or given.surface.copies != 1:
        raise InputError(
            f"a FreeBody is closed, and this film has {count} free edges, at which gas would push it away; "
            "close it, or hold it by Fixed"
        )


def six_components(V: Space, X: Array) -> npt.NDArray[np.int32]:
    """Those of the six components that this rank owns, as unrolled indices. Collective.

    Three of one node and three more of two others far from it, of all choices the one that resists rotations
    most.

    Args:
        V: space of displacements.
        X: positions of its nodes at rest, ghosts included (nodes, 3) [m].
    """
    comm, index_map = V.mesh.comm, V.dofmap.index_map
    x = X[: index_map.size_local]
    first = int(index_map.local_range[0])

    def farthest(measure: Array) -> tuple[int, Array]:
        at = int(np.argmax(measure)) if len(measure) else -1
        mine = (float(measure[at]), first + at, x[at]) if at >= 0 else (-1.0, -1, np.zeros(3))
        # to fewer digits than the sums over ranks are good for
        _, number, place = max(comm.allgather(mine), key=lambda one: (float(f"{one[0]:.8e}"), -one[1]))
        return number, place

    count = comm.allreduce(len(x))
    a, A = farthest(np.linalg.norm(x - comm.allreduce(x.sum(axis=0)) / count, axis=1))
    b, B = farthest(np.linalg.norm(x - A, axis=1))
    along = (B - A) / np.linalg.norm(B - A)
    c, C = farthest(np.linalg.norm(np.cross(x - A, along), axis=1))
    places = [(node, k, np.cross(P - A, np.eye(3)[k])) for node, P in ((b, B), (c, C)) for k in range(3)]
    best = max(combinations(places, 3), key=lambda rows: abs(np.linalg.det([row[2] for row in rows])))
    held = [(a, 0), (a, 1), (a, 2), *((node, k) for node, k, _ in best)]
    mine = [3 * (node - first) + k for node, k in held if first <= node < first + len(x)]
    return np.array(mine, dtype=np.int32)
