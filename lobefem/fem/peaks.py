"""Largest stress and strain of the film, and their places."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from lobefem.fem import functionals
from lobefem.fem.balloon import Balloon
from lobefem.typing import Array

from mpi4py import MPI

__all__ = ["Peak", "largest_strain", "largest_stress"]

_ALIKE = 1e-9  # cells that symmetry makes equal, up to round-off


@dataclass(frozen=True)
class Peak:
    """The largest value of a field over the film.

    Attributes:
        value: it.
        place: middle of its cell as meshed (x, y, z) [m]; of equal cells the lowest one.
    """

    value: float
    place: tuple[float, float, float]


def largest_stress(balloon: Balloon) -> Peak:
    """The largest principal true stress [Pa] of a cell in the present displacement. Collective.

    The mean of the true resultants in a cell, per length as it is now, over the thickness as built.
    """
    resultants = functionals.true_resultants(balloon).x.array.reshape(-1, 3)
    return _largest(balloon, _major(resultants) / balloon.film.thickness)


def largest_strain(balloon: Balloon) -> Peak:
    """The largest principal strain of a cell, Green's, built-in strain included. Collective."""
    return _largest(balloon, _major(functionals.strains(balloon).x.array.reshape(-1, 3)))


def _major(tensors: Array) -> Array:
    """Major principal value of symmetric tensors (xx, yy, xy) (n, 3)."""
    xx, yy, xy = tensors.T
    return (xx + yy) / 2 + np.hypot((xx - yy) / 2, xy)


def _largest(balloon: Balloon, values: Any) -> Peak:
    own = balloon.mesh.topology.index_map(2).size_local
    values = values[:own]
    value = balloon.comm.allreduce(float(values.max(initial=-np.inf)), op=MPI.MAX)
    alike = np.flatnonzero(values >= value - _ALIKE * abs(value))
    middles = balloon.X[balloon.V.dofmap.list[alike]].mean(axis=1)
    places = np.concatenate(balloon.comm.allgather(middles))
    x, y, z = np.round(places, 9).T
    first = places[np.lexsort((x, y, z))[0]]
    return Peak(value, (float(first[0]), float(first[1]), float(first[2])))
