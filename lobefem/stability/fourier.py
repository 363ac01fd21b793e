"""Circumferential harmonics of a mode."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from lobefem.fem.balloon import Balloon
from lobefem.fem.cylindrical import cylindrical
from lobefem.fem.functionals import largest, nodal_areas
from lobefem.typing import Array

from mpi4py import MPI

__all__ = ["cyclic_order", "dominant", "spectrum"]

_FEWEST = 3  # nodes of equal height, in the mean, that make a ring


def spectrum(balloon: Balloon, real: Array, imag: Array) -> Array:
    """Share of each circumferential harmonic n = 0, 1, ... in a displacement; sums to 1.

    Nodes are gathered into rings of equal height; each ring's cylindrical components are analysed
    with nodal areas as weights. On a ring of N nodes n runs to N/2: beyond it are the aliases of lower ones.

    Args:
        balloon: whose nodes they are.
        real: nodal displacements (nodes, 3), as kept by a mode.
        imag: their imaginary part.

    Collective.
    """
    angle, height, frame = cylindrical(balloon)
    n = len(angle)
    weights = nodal_areas(balloon)
    field = np.einsum("nij,nj->ni", frame, real[:n] + 1j * imag[:n]) * weights[:, None]
    rings, num_rings = _rings(balloon, height)
    divisions = balloon.surface.divisions
    counts = balloon.comm.allreduce(np.bincount(rings, minlength=num_rings))
    total = np.maximum(balloon.comm.allreduce(np.bincount(rings, weights, num_rings)), 1e-300)
    if divisions and (counts == divisions[1] * balloon.order).all():
        columns = np.rint(angle * counts[0] / (2 * np.pi))
        coefficients = _of_grid(field, rings, columns, int(counts[0]), num_rings)
    else:  # a mesh of scattered nodes, or one moved by hand
        coefficients = _of_scattered(field, rings, angle, int(counts.max()), num_rings)
    balloon.comm.Allreduce(MPI.IN_PLACE, coefficients)
    energy = (np.abs(coefficients) ** 2).sum(axis=-1) / total
    # n beyond half the nodes on a ring is the alias of a lower one, n at the half that of -n
    orders = 2 * np.arange(coefficients.shape[1])[:, None]
    energy *= np.where(orders > counts, 0.0, np.where(orders == counts, 0.5, 1.0))
    power = energy.sum(axis=(0, 2))
    power[0] /= 2
    return power / power.sum()


def _of_grid(
    field: npt.NDArray[np.complex128],
    rings: npt.NDArray[np.int64],
    columns: Array,
    around: int,
    num_rings: int,
) -> npt.NDArray[np.complex128]:
    """Sums over each ring of field e^{-i k theta}, k = n and -n, (2, orders, rings, 3), at equal angles.

    The nodes fill a part of a grid; what is not this rank's is zero.
    """
    orders = np.arange(around // 2 + 1)
    coefficients = np.zeros((2, len(orders), num_rings, 3), dtype=complex)
    here, row = np.unique(rings, return_inverse=True)
    grid = np.zeros((len(here), 3, around), dtype=complex)
    grid[row, :, columns.astype(np.int64) % around] = field
    transform = np.moveaxis(np.fft.fft(grid), 2, 0)
    coefficients[0][:, here], coefficients[1][:, here] = transform[orders], transform[-orders]
    return coefficients


def _of_scattered(
    field: npt.NDArray[np.complex128],
    rings: npt.NDArray[np.int64],
    angle: Array,
    most: int,
    num_rings: int,
) -> npt.NDArray[np.complex128]:
    """The same of nodes at any angles, at `most` so many on a ring."""
    from scipy import sparse  # slow to import, and our own meshes are grids

    n = len(angle)
    ringwise = sparse.csr_array((np.ones(n), (rings, np.arange(n))), (num_rings, n))
    coefficients = np.zeros((2, most // 2 + 1, num_rings, 3), dtype=complex)
    step, phase = np.exp(-1j * angle), np.ones(n, dtype=complex)
    for k in range(most // 2 + 1):
        coefficients[0, k] = ringwise @ (field * phase[:, None])
        coefficients[1, k] = ringwise @ (field * phase.conj()[:, None])
        phase *= step
    return coefficients


def cyclic_order(balloon: Balloon, displacement: Array) -> int:
    """Number of equal sectors of a state, 0 if it did not keep its surface's symmetry. Collective.

    A distorted state has simple eigenvalues.

    Args:
        balloon: whose state it is.
        displacement: its nodal displacements (nodes, 3) [m].
    """
    order = balloon.surface.cyclic_order
    if order is None:
        return 0
    # nodes may have been moved by hand, too
    places = balloon.X - balloon.axis.origin + displacement
    power = spectrum(balloon, places, np.zeros_like(places))
    power[::order] = 0.0
    broken = math.sqrt(power.sum()) * largest(balloon, places)
    return order if broken <= 1e-9 * math.sqrt(balloon.reference_area) else 0


def dominant(power: Array) -> tuple[int, ...]:
    """Harmonics by their share, strongest first; of those that share the first place the lowest one first.

    Evenly spaced nodes cannot tell n from its aliases.
    """
    strongest = [int(n) for n in np.argsort(-power, kind="stable")]
    first = int(np.argmax(power >= (1 - 1e-6) * power.max()))
    return (first, *(n for n in strongest if n != first))


def _rings(balloon: Balloon, height: Array) -> tuple[npt.NDArray[np.int64], int]:
    """Ring index of each owned node, and the number of rings.

    The index is the height's rank where several nodes have each, a class of heights otherwise.
    """
    comm = balloon.comm
    low = comm.allreduce(height.min(initial=np.inf), op=MPI.MIN)
    high = comm.allreduce(height.max(initial=-np.inf), op=MPI.MAX)
    scaled = (height - low) / (high - low)
    keys = np.round(scaled * 1e7).astype(np.int64)
    levels = np.unique(np.concatenate(comm.allgather(np.unique(keys))))
    # neighbours that rounding split belong together
    group = np.concatenate([[0], np.cumsum(np.diff(levels) > 3)])
    num = int(group[-1]) + 1
    if _FEWEST * num <= balloon.V.dofmap.index_map.size_global:
        return group[np.searchsorted(levels, keys)], num
    # classes about a cell high
    cells = balloon.mesh.topology.index_map(2).size_global
    num = max(int((high - low) / np.sqrt(balloon.reference_area / cells)), 1)
    return np.minimum((scaled * num).astype(np.int64), num - 1), num
