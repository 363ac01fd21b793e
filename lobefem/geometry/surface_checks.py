"""Checks of a `Surface` against its mesh: tags, axis, sense of the cells, shape, divisions.

A balloon is examined once, when it is made. Ranks exchange their parts of the two rims, so that all come to
the same axis, and to the same refusal.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from lobefem.errors import InputError
from lobefem.frozen import Frozen
from lobefem.geometry.axis import Axis, across, circle, rounded, unit
from lobefem.geometry.manifold import require_manifold
from lobefem.geometry.orientation import CORNERS
from lobefem.geometry.surface import Surface
from lobefem.linalg import dolfinx_compat
from lobefem.typing import Array, Mesh

from dolfinx.mesh import exterior_facet_indices
from mpi4py import MPI

__all__ = ["examine"]

_RIMS = ("rim_bottom", "rim_top")

_NEAR = 0.02  # share of the edge radius, or of the height, that a claim may be off


@dataclass(frozen=True)
class _Rim(Frozen):
    """A rim, the same on every rank.

    Attributes:
        numbers: of its nodes in the mesh's input, ascending (n,).
        points: where they lie (n, 3) [m].
        ends: start and end of its free edges in the sense of their cells (k, 2, 3) [m].
        centre, radius: of the circle through it [m]; an arc of one sector has none.
    """

    numbers: npt.NDArray[np.int64]
    points: Array
    ends: Array
    centre: Array = field(default_factory=lambda: np.zeros(3))
    radius: float = 0.0


def examine(surface: Surface, closed: bool) -> Axis:
    """The axis of a surface, all that it claims checked.

    Args:
        surface: a `Surface`.
        closed: whether end plates close its rims.

    Raises:
        InputError: what it claims and its mesh do not go together.

    Collective.
    """
    if closed:
        missing = [name for name in _RIMS if name not in surface.groups]
        if missing:
            raise InputError(f"end plates need the edge group '{missing[0]}', which this surface lacks")
    _check_nodes(surface)
    require_manifold(surface, closed)
    rims = _rims(surface)
    axis = _axis(surface, rims)
    _check_sense(surface, axis, rims)
    _check_shape(surface, axis, rims)
    return axis


def _check_nodes(surface: Surface) -> None:
    """Refuse nodes at no place, cells that lack their ghosts, and lobes that are not there. Collective."""
    mesh, comm = surface.mesh, surface.mesh.comm
    nodes, cells = mesh.geometry.index_map().size_local, mesh.topology.index_map(2)
    bad = int((~np.isfinite(mesh.geometry.x[:nodes])).any(axis=1).sum())
    numbers = surface.lobe_numbers()[: cells.size_local]
    wrong = int(((numbers < 1) | (numbers > surface.num_lobes)).sum())
    cut = 0
    if comm.size > 1:
        mesh.topology.create_entities(1)
        mesh.topology.create_connectivity(1, 2)
        cells_of = mesh.topology.connectivity(1, 2)
        cut = sum(len(cells_of.links(facet)) == 1 for facet in mesh.topology.interprocess_facets())
    bad, wrong, cut = comm.allreduce(np.array([bad, wrong, cut])).tolist()
    if bad:
        raise InputError(
            f"{bad} node{'s' if bad > 1 else ''} of the mesh lie{'' if bad > 1 else 's'} at no finite place; "
            "give all of them finite coordinates"
        )
    if cut:
        raise InputError(
            "the mesh lacks ghost cells, without which edges between ranks are lost; partition it with "
            "dolfinx.mesh.GhostMode.shared_facet"
        )
    if wrong:
        raise InputError(
            f"{wrong} cells are tagged with none of the lobes 1 to {surface.num_lobes}; give num_lobes, or "
            "other lobes"
        )


# --- the rims and the axis ----------------------------------------------------------------------
def _rims(surface: Surface) -> dict[str, _Rim]:
    """The rims that the surface has. Collective."""
    names = [name for name in _RIMS if name in surface.groups]
    if not names:
        return {}
    mesh = surface.mesh
    mesh.topology.create_connectivity(1, 2)
    mesh.topology.create_connectivity(2, 1)
    parts = mesh.comm.allgather([_own_part(surface, name) for name in names])
    rims = {}
    for name, own in zip(names, zip(*parts, strict=True), strict=True):
        numbers, points, ends = (np.concatenate(part) for part in zip(*own, strict=True))
        numbers, first = np.unique(numbers, return_index=True)
        points = points[first]
        if surface.copies == 1 and len(numbers) > 2:
            rims[name] = _Rim(numbers, points, ends, *circle(points))
        elif len(numbers):
            rims[name] = _Rim(numbers, points, ends)
    return rims


def _own_part(surface: Surface, name: str) -> tuple[npt.NDArray[np.int64], Array, Array]:
    """Numbers, places and directed edges of the part of a rim that this rank owns."""
    mesh, topology = surface.mesh, surface.mesh.topology
    facets = surface.facets(name)
    facets = facets[facets < topology.index_map(1).size_local]
    nodes = dolfinx_compat.entity_nodes(mesh, 1, facets)
    x, dofmap = mesh.geometry.x, dolfinx_compat.geometry_dofmap(mesh)
    cells_of = topology.connectivity(1, 2)
    ends = []
    for facet, a, b in zip(facets, nodes[:, 0].astype(int), nodes[:, 1].astype(int), strict=True):
        cells = cells_of.links(facet)
        if len(cells) == 1:
            corners = dofmap[cells[0]][CORNERS[dofmap.shape[1]]].tolist()
            follows = corners[(corners.index(a) + 1) % len(corners)] == b
            ends.append(x[[a, b] if follows else [b, a]])
    numbers = np.asarray(mesh.geometry.input_global_indices, dtype=np.int64)[nodes.ravel()]
    return numbers, x[nodes.ravel()], np.array(ends).reshape(-1, 2, 3)


def _axis(surface: Surface, rims: dict[str, _Rim]) -> Axis:
    """The axis as given, or as the rims have it; the same on every rank."""
    centres = [rims[name].centre for name in _RIMS if name in rims]
    whole = surface.copies == 1 and len(centres) == 2
    along: Array = np.asarray(centres[1] - centres[0]) if whole else np.zeros(3)
    length = float(np.linalg.norm(along))
    size = max((rim.radius for rim in rims.values()), default=0.0)
    if whole and length <= 1e-9 * size:
        raise InputError("the centres of the surface's two rims coincide; tag the bottom and the top rim")
    if surface.axis is not None:
        direction: Array = surface.axis
        if whole and float(along @ direction) < math.cos(math.radians(1.0)) * length:
            raise InputError(
                f"the surface's axis is {_shown(direction)}, but the centre of its top rim lies from that of "
                f"the bottom one along {_shown(np.asarray(along / length))}; give that, or axis=None"
            )
    elif whole:
        direction = unit(rounded(np.asarray(along / length), 1.0))
    elif not surface.of_revolution:
        middle, direction = _principal(surface.mesh)
        point = middle if surface.origin is None else surface.origin
        return Axis(direction, point, _first(surface, rims, direction, point))
    else:
        raise InputError("the axis of a surface without two rims is not known; give axis=(0, 0, 1), say")
    origin: Array = np.zeros(3)
    if surface.origin is not None:
        origin = surface.origin
        for name, rim in rims.items() if surface.copies == 1 else ():
            arm = rim.centre - origin
            off = float(np.linalg.norm(arm - (arm @ direction) * direction))
            if off > _NEAR * rim.radius:
                raise InputError(
                    f"the axis through {_shown(origin)} passes the centre of {name} at {off:.3g} m; give a "
                    "point on the axis, or origin=None"
                )
        if surface.copies == 1 and centres:  # heights count from the rim
            origin = origin + ((centres[0] - origin) @ direction) * direction
    elif surface.copies == 1 and centres:
        origin = centres[0]
    return Axis(direction, origin, _first(surface, rims, direction, origin))


def _principal(mesh: Mesh) -> tuple[Array, Array]:
    """Centre of the nodes and their principal axis, long or short beside two that are alike. Collective."""
    x = mesh.geometry.x[: mesh.geometry.index_map().size_local]
    sums = mesh.comm.allreduce(np.append(x.sum(axis=0), len(x)))
    middle = sums[:3] / sums[3]
    arms = x - middle
    size = mesh.comm.allreduce(float(np.abs(arms).max(initial=0.0)), op=MPI.MAX)
    moments, axes = np.linalg.eigh(mesh.comm.allreduce(arms.T @ arms))
    long = moments[2] - moments[1] > moments[1] - moments[0]
    direction = axes[:, 2 if long else 0]
    direction = direction * np.sign(direction[np.abs(direction).argmax()])
    # to fewer digits than the order of sums moves
    return np.round(middle, 10 - math.ceil(math.log10(size or 1.0))) + 0.0, unit(
        np.round(direction, 10) + 0.0
    )


def _first(surface: Surface, rims: dict[str, _Rim], direction: Array, origin: Array) -> Array:
    """From where azimuths count: of a grid its first column, as that of its first node on the bottom rim."""
    if surface.divisions is None or "rim_bottom" not in rims:
        return across(direction)[0]
    arm = rims["rim_bottom"].points[0] - origin
    return unit(rounded(unit(arm - (arm @ direction) * direction), 1.0))


def _shown(vector: Array) -> str:
    return f"({', '.join(f'{v:.4g}' for v in vector)})"


# --- against the mesh ---------------------------------------------------------------------------
def _check_sense(surface: Surface, axis: Axis, rims: dict[str, _Rim]) -> None:
    """Refuse cells whose normals point into what film and rims enclose.

    Film turned outwards runs anticlockwise about its bottom rim, as seen from above, and clockwise about its
    top rim. Film without rims that has free edges encloses nothing: gas presses along its cells' normals.

    Collective.
    """
    sense = 0.0
    for name, sign in zip(_RIMS, (1.0, -1.0), strict=True):
        if name in rims:
            a, b = np.swapaxes(rims[name].ends - axis.origin, 0, 1)
            sense += sign * float((np.cross(a, b) @ axis.direction).sum())
    if sense == 0.0 and surface.copies == 1:
        sense = _volume_within(surface)
    if sense < 0:
        raise InputError(
            "the surface's cells are turned inwards, so that gas would press on it from outside; reverse "
            "the order of their corners"
        )


def _volume_within(surface: Surface) -> float:
    """Volume that a film without a free edge encloses, by its corners; 0 with one [m^3]. Collective."""
    mesh, comm = surface.mesh, surface.mesh.comm
    mesh.topology.create_connectivity(1, 2)
    free = len(exterior_facet_indices(mesh.topology))
    dofmap = dolfinx_compat.geometry_dofmap(mesh)[: mesh.topology.index_map(2).size_local]
    corners = mesh.geometry.x[dofmap[:, CORNERS[dofmap.shape[1]]]]
    # about a point of its own, far from the origin as it may stand
    middle = comm.bcast(corners[0, 0] if len(corners) else np.zeros(3))
    corners = corners - middle
    a = corners[:, 0]
    fans = (np.cross(corners[:, k], corners[:, k + 1]) for k in range(1, corners.shape[1] - 1))
    volume = sum(float(np.einsum("ni,ni->", a, fan)) for fan in fans) / 6
    total = comm.allreduce(np.array([free, volume]))
    size = comm.allreduce(float(np.abs(corners).max(initial=0.0)), op=MPI.MAX)
    # two sheets upon each other, which gas is to part, enclose round-off
    return 0.0 if total[0] or abs(total[1]) <= 1e-9 * size**3 else float(total[1])


def _check_shape(surface: Surface, axis: Axis, rims: dict[str, _Rim]) -> None:
    """Refuse a shape or divisions that are not the mesh's. Collective."""
    shape, lobes = surface.shape, surface.num_lobes
    if shape is not None and surface.copies == 1:
        for name, rim in rims.items():
            if abs(rim.radius - shape.edge_radius) > _NEAR * shape.edge_radius:
                raise InputError(
                    f"the surface's shape has an edge radius of {shape.edge_radius:.4g} m, but {name} has "
                    f"{rim.radius:.4g} m; give the mesh's own shape, or shape=None"
                )
        if len(rims) == 2:
            apart = float((rims["rim_top"].centre - rims["rim_bottom"].centre) @ axis.direction)
            if abs(apart - lobes * shape.height) > _NEAR * lobes * shape.height:
                raise InputError(
                    f"the surface's shape makes {lobes} lobe{'s' if lobes > 1 else ''} of together "
                    f"{lobes * shape.height:.4g} m, but its rims are {apart:.4g} m apart; give the mesh's "
                    "own shape and num_lobes, or shape=None"
                )
    mesh, comm = surface.mesh, surface.mesh.comm
    x = mesh.geometry.x[: mesh.geometry.index_map().size_local]
    angle, height, radius, _ = axis.cylindrical(x)
    off = beside = 0.0
    if shape is not None and "rim_bottom" in rims:
        table = shape.stations(200)
        z = np.clip(height / shape.height, 0, lobes)
        within = (z - np.minimum(np.floor(z), lobes - 1) - 0.5) * shape.height
        off = float(np.abs(radius - np.interp(within, shape.z(table), shape.radius(table))).sum())
    if surface.divisions is not None:
        columns = angle * _order(mesh) * surface.divisions[1] / (2 * np.pi)
        beside = float((np.abs(columns - np.rint(columns)) > 0.25).sum())
    off, beside, count = comm.allreduce(np.array([off, beside, len(x)])).tolist()
    if shape is not None and off > _NEAR * shape.edge_radius * count:
        raise InputError(
            f"the nodes lie {off / count:.3g} m off the surface's shape in the mean; give the mesh's own "
            "shape, or shape=None"
        )
    if surface.divisions is None:
        return
    along, around = (_order(mesh) * number for number in surface.divisions)
    wide = around if surface.copies == 1 else around // surface.copies + 1
    if beside or count != (lobes * along + 1) * wide:
        raise InputError(
            f"the mesh is not the grid of {surface.divisions[0]} x {surface.divisions[1]} divisions a lobe "
            "that it claims to be; leave divisions and cyclic_order out"
        )


def _order(mesh: Mesh) -> int:
    """Degree of the geometry."""
    return 1 if dolfinx_compat.geometry_dofmap(mesh).shape[1] < 6 else 2
