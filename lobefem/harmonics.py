"""What a mode looks like around the axis: its circumferential harmonics, and its name."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from lobefem.balloon import Balloon
from lobefem.measures import nodal_areas, straining_share
from lobefem.schema import RIGID

# isort: split
from mpi4py import MPI

__all__ = ["RIGID", "cylindrical", "kind_of", "label", "spectrum"]

Array = npt.NDArray[np.float64]


def cylindrical(balloon: Balloon) -> tuple[Array, Array, Array]:
    """Where the nodes that this rank owns lie about the surface's axis.

    Returns:
        angle (n,) [rad], height (n,) [m], cylindrical frame (n, 3, 3; rows radial, hoop, axial).
    """
    axis = np.asarray(balloon.surface.axis, dtype=float)
    first = np.cross(np.eye(3)[np.argmin(np.abs(axis))], axis)
    first /= np.linalg.norm(first)
    if abs(axis[2]) == 1.0:
        first = np.array([1.0, 0.0, 0.0])
    second = np.cross(axis, first)
    X = balloon.X[: balloon.V.dofmap.index_map.size_local]
    angle = np.arctan2(X @ second, X @ first)
    radial = np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * second
    hoop = np.cross(axis, radial)
    frame = np.stack([radial, hoop, np.broadcast_to(axis, radial.shape)], axis=1)
    return angle, X @ axis, frame


def spectrum(balloon: Balloon, real: Array, imag: Array, highest: int = 64) -> Array:
    """Share of each circumferential harmonic n = 0, 1, ... in a displacement; sums to 1.

    Nodes are gathered into rings of equal height; each ring's cylindrical components are analysed
    with nodal areas as weights. On rings of N nodes n runs to N/2.

    Args:
        balloon: whose nodes they are.
        real: nodal displacements (nodes, 3), as kept by a mode.
        imag: their imaginary part.
        highest: largest harmonic looked at.

    Collective.
    """
    angle, height, frame = cylindrical(balloon)
    n = len(angle)
    weights = nodal_areas(balloon)
    field = np.einsum("nij,nj->ni", frame, real[:n] + 1j * imag[:n]) * weights[:, None]
    rings, num_rings = _rings(balloon, height)
    divisions = balloon.surface.divisions
    around = divisions[1] * balloon.order if divisions else 2 * highest + 1
    highest = min(highest, around // 2)
    total = np.bincount(rings, weights, num_rings)
    orders = np.arange(-highest, highest + 1)
    if divisions:
        coefficients = _of_grid(
            field, rings, np.rint(angle * around / (2 * np.pi)), around, num_rings, orders
        )
    else:
        from scipy import sparse  # slow to import, and our own meshes are grids

        ringwise = sparse.csr_array((np.ones(n), (rings, np.arange(n))), (num_rings, n))
        coefficients = np.stack([ringwise @ (field * np.exp(-1j * k * angle)[:, None]) for k in orders])
    balloon.comm.Allreduce(MPI.IN_PLACE, coefficients)
    total = np.maximum(balloon.comm.allreduce(total), 1e-300)
    energy = (np.abs(coefficients) ** 2 / total[:, None]).sum(axis=(1, 2))
    power = energy[highest:].copy()
    power[1:] += energy[:highest][::-1]
    if 2 * highest == around:
        power[highest] /= 2  # n and -n are the same there
    return power / power.sum()


def _of_grid(
    field: npt.NDArray[np.complex128],
    rings: npt.NDArray[np.int64],
    columns: Array,
    around: int,
    num_rings: int,
    orders: npt.NDArray[np.int64],
) -> npt.NDArray[np.complex128]:
    """Sums over each ring of field e^{-i k theta}, (orders, rings, 3), of nodes at equal angles.

    The nodes fill a part of a grid; what is not this rank's is zero.
    """
    coefficients = np.zeros((len(orders), num_rings, 3), dtype=complex)
    here, row = np.unique(rings, return_inverse=True)
    grid = np.zeros((len(here), 3, around), dtype=complex)
    grid[row, :, columns.astype(np.int64) % around] = field
    coefficients[:, here] = np.moveaxis(np.fft.fft(grid)[..., orders % around], 2, 0)
    return coefficients


def label(balloon: Balloon, real: Array, imag: Array, power: Array) -> str:
    """The kind of a mode by its dominant harmonic, see `kind_of`. Collective."""
    return kind_of(balloon, real + 1j * imag, int(np.argmax(power)))


def kind_of(balloon: Balloon, displacement: npt.NDArray[np.complex128], harmonic: int) -> str:
    """The kind of a mode, after the paper's sec. 5: "sway", "twist", "global" or "local".

    n = 1 moves the axis sideways (sway); n = 0 turns about it (twist) or stretches and breathes
    (global). With n >= 2 plates and axis stay. Such a mode is local where it strains the film rather
    than turning it, the coupled hoopwise and radial distortion of the paper: strain makes up 0.5 to
    0.9 of the displacement gradient of wrinkled film, which has no stiffness against it, and less than
    0.2 of that of isotropic film, which has no local modes.

    Args:
        balloon: whose mode it is, or one sector of it.
        displacement: nodal displacements (nodes, 3).
        harmonic: the dominant n.

    Collective.
    """
    if harmonic == 1:
        return "sway"
    if harmonic == 0:
        _, _, frame = cylindrical(balloon)
        field = np.einsum("nij,nj->ni", frame, displacement[: len(frame)])
        parts = balloon.comm.allreduce((np.abs(field) ** 2).sum(axis=0))
        return "twist" if parts[1] > parts.sum() / 2 else "global"
    return "local" if straining_share(balloon, displacement.real, displacement.imag) > 0.3 else "global"


def _rings(balloon: Balloon, height: Array) -> tuple[npt.NDArray[np.int64], int]:
    """Ring index of each owned node, and the number of rings.

    The index is the height's rank on a structured mesh, a class of heights otherwise.
    """
    comm = balloon.comm
    low = comm.allreduce(height.min(initial=np.inf), op=MPI.MIN)
    high = comm.allreduce(height.max(initial=-np.inf), op=MPI.MAX)
    scaled = (height - low) / (high - low)
    if balloon.surface.divisions is None:
        # classes about a cell high
        cells = balloon.mesh.topology.index_map(2).size_global
        num = max(int((high - low) / np.sqrt(balloon.reference_area / cells)), 1)
        return np.minimum((scaled * num).astype(np.int64), num - 1), num
    keys = np.round(scaled * 1e7).astype(np.int64)
    levels = np.unique(np.concatenate(comm.allgather(np.unique(keys))))
    # neighbours that rounding split belong together
    group = np.concatenate([[0], np.cumsum(np.diff(levels) > 3)])
    return group[np.searchsorted(levels, keys)], int(group[-1]) + 1
