"""Gmsh on one rank: the meridian's curve revolved about the z axis, meshed, with named groups.

Linear cells only: the caller puts their nodes on the exact surface and adds mid-side nodes. Two
layouts, two ways to revolve. A structured mesh needs patches with four sides, so each lobe is
revolved sector by sector; the caller knows its grid and closes it. An unstructured mesh takes one
whole turn, whose faces Gmsh closes upon themselves, so that no duplicate curve has to be merged.
"""

from __future__ import annotations

import math
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from lobefem.errors import MissingDependencyError, SolveError
from lobefem.frozen import Frozen
from lobefem.typing import Gmsh

__all__ = ["Meridian", "RawMesh", "fresh_model", "structured", "unstructured"]

_POINTS = 65  # interpolated by each lobe's spline, whose error is then below 1e-8 of R0

_AXIS = (0.0, 0.0, 0.0, 0.0, 0.0, 1.0)

# Options set here, and put back where the caller has Gmsh open already.
_OPTIONS = {
    "General.Terminal": 0,
    "General.AbortOnError": 2,  # raise
    "General.NumThreads": 1,  # the same mesh every time
    "Mesh.Algorithm": 6,  # frontal Delaunay
    "Mesh.ElementOrder": 1,
    "Mesh.MeshSizeExtendFromBoundary": 0,
    "Mesh.MeshSizeFactor": 1,
    "Mesh.MeshSizeFromCurvature": 0,
    "Mesh.MeshSizeFromPoints": 0,
    "Mesh.MeshSizeMax": 1e22,
    "Mesh.MeshSizeMin": 0,
    "Mesh.RandomFactor": 1e-9,
    "Mesh.RecombinationAlgorithm": 1,
    "Mesh.RecombineAll": 0,
    "Mesh.SubdivisionAlgorithm": 0,
}


class Meridian(Protocol):
    """Protocol of a lobe's meridian as a mesher needs it; s is the arc length from mid-height [m]."""

    @property
    def edge_radius(self) -> float:
        """Radius of both edges [m]."""

    @property
    def height(self) -> float:
        """Height from edge to edge [m]."""

    @property
    def arc_length(self) -> float:
        """Arc length from edge to edge [m]."""

    @property
    def area(self) -> float:
        """Area of the film [m^2]."""

    def radius(self, s: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Distance from the axis [m]."""

    def z(self, s: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Height above mid-height [m]."""

    def slope(self, s: npt.ArrayLike) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """Unit tangent (dR/ds, dz/ds)."""

    def stations(self, count: int) -> npt.NDArray[np.float64]:
        """Arc lengths of `count` equal steps from edge to edge [m]."""


@dataclass(frozen=True)
class RawMesh(Frozen):
    """A mesh from Gmsh, numbered from 0, without nodes that no cell uses.

    Args:
        points: shape (n, 3) [m].
        cells: corners in cyclic order, shape (m, 3) or (m, 4).
        lobes: lobe of each cell from the bottom, from 0, shape (m,).
        rings: per ring (bottom rim, seams, top rim) its edges, shape (k, 2).
    """

    points: npt.NDArray[np.float64]
    cells: npt.NDArray[np.int64]
    lobes: npt.NDArray[np.int64]
    rings: list[npt.NDArray[np.int64]]


def structured(shape: Meridian, lobes: int, divisions: tuple[int, int]) -> RawMesh:
    """Quadrilaterals, `divisions` = (along each lobe's meridian, around the axis)."""
    along, around = divisions
    sectors = min(4, around)
    first = [around * k // sectors for k in range(sectors + 1)]
    with fresh_model() as gmsh:
        occ = gmsh.model.occ
        curves = _meridians(gmsh, shape, lobes)
        meridians, faces = set(curves), []
        cells_of = []
        for start, end in pairwise(first):
            angle = 2.0 * math.pi * (end - start) / around
            out = occ.revolve([(1, c) for c in curves], *_AXIS, angle)
            faces.append([tag for dim, tag in out if dim == 2])
            curves = _ends(out)
            meridians.update(curves)
            cells_of.append(end - start)
        occ.synchronize()
        for count, sector in zip(cells_of, faces, strict=True):
            for face in sector:
                for _, curve in gmsh.model.getBoundary([(2, face)], oriented=False):
                    nodes = along + 1 if curve in meridians else count + 1
                    gmsh.model.mesh.setTransfiniteCurve(curve, nodes)
                gmsh.model.mesh.setTransfiniteSurface(face)
                gmsh.model.mesh.setRecombine(2, face)
        _name_groups(gmsh, shape, [list(column) for column in zip(*faces, strict=True)], meridians)
        gmsh.model.mesh.generate(2)
        return _read(gmsh, lobes, corners=4)


def unstructured(shape: Meridian, lobes: int, size: float, corners: int) -> RawMesh:
    """Triangles (`corners` 3) or quadrilaterals (4) of edge length about `size` [m]."""
    with fresh_model() as gmsh:
        curves = _meridians(gmsh, shape, lobes)
        out = gmsh.model.occ.revolve([(1, c) for c in curves], *_AXIS, 2.0 * math.pi)
        faces = [[tag] for dim, tag in out if dim == 2]
        gmsh.model.occ.synchronize()
        meridians = set(curves) | set(_ends(out))
        _name_groups(gmsh, shape, faces, meridians)
        if corners == 4:
            # Recombination leaves triangles, and a mixed mesh would be misread. So mesh at twice
            # the size and cut every cell at its edges' midpoints, which leaves none. (Gmsh's own
            # full-quad recombination refuses faces that close upon themselves.)
            gmsh.option.setNumber("Mesh.RecombineAll", 1)
            gmsh.option.setNumber("Mesh.SubdivisionAlgorithm", 1)
            size *= 2.0
        gmsh.option.setNumber("Mesh.MeshSizeMin", size)
        gmsh.option.setNumber("Mesh.MeshSizeMax", size)
        gmsh.model.mesh.generate(2)
        return _read(gmsh, lobes, corners)


@contextmanager
def fresh_model() -> Iterator[Any]:
    """A fresh Gmsh model; leaves a session that the caller had open as it was."""
    try:
        import gmsh
    except (ImportError, OSError) as error:
        raise MissingDependencyError(
            f"Gmsh cannot be imported ({error}); install python3-gmsh (Debian) or: pip install gmsh"
        ) from error
    ours = not gmsh.isInitialized()
    if ours:  # no argv, no configuration files, and no handler for Ctrl-C
        gmsh.initialize([], readConfigFiles=False, interruptible=False)
        handler = signal.getsignal(signal.SIGTERM)
        if handler is not None and threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGTERM, handler)  # Gmsh has put the default in its place
    before = {name: gmsh.option.getNumber(name) for name in _OPTIONS}
    current = None if ours else gmsh.model.getCurrent()
    name = f"lobefem-{os.getpid()}"
    try:
        for option, value in _OPTIONS.items():
            gmsh.option.setNumber(option, value)
        gmsh.model.add(name)
        yield gmsh
    finally:
        if ours:
            gmsh.finalize()
        else:
            gmsh.model.setCurrent(name)
            gmsh.model.remove()
            for option, value in before.items():
                gmsh.option.setNumber(option, value)
            gmsh.model.setCurrent(current)


def _meridians(gmsh: Gmsh, shape: Meridian, lobes: int) -> list[int]:
    """One curve per lobe in the plane y = 0, x > 0, each sharing its end points with the next."""
    occ = gmsh.model.occ
    s = shape.stations(_POINTS - 1)
    R, z = shape.radius(s), shape.z(s)
    straight = np.ptp(R) < 1e-12 * R.max()
    bottom = occ.addPoint(R[0], 0.0, 0.0)
    curves = []
    for k in range(lobes):
        base = (k + 0.5) * shape.height
        top = occ.addPoint(R[-1], 0.0, (k + 1) * shape.height)
        if straight:
            curves.append(occ.addLine(bottom, top))
        else:
            inner = [occ.addPoint(x, 0.0, base + y) for x, y in zip(R[1:-1], z[1:-1], strict=True)]
            curves.append(occ.addSpline([bottom, *inner, top]))
            occ.remove([(0, point) for point in inner])  # else they become nodes of no cell
        bottom = top
    return curves


def _ends(out: list[tuple[int, int]]) -> list[int]:
    """The curves where a turn ends: Gmsh lists each just before the face that it swept."""
    return [out[k - 1][1] for k, (dim, _) in enumerate(out) if dim == 2]


def _name_groups(gmsh: Gmsh, shape: Meridian, faces: list[list[int]], meridians: set[int]) -> None:
    """Physical groups lobe_k and ring_k, k from 1 and from 0; `faces` holds each lobe's."""
    rings: list[set[int]] = [set() for _ in range(len(faces) + 1)]
    for k, lobe in enumerate(faces):
        gmsh.model.addPhysicalGroup(2, lobe, k + 1, name=f"lobe_{k + 1}")
        for _, curve in gmsh.model.getBoundary([(2, f) for f in lobe], False, False):
            if curve in meridians:
                continue
            low, _ = gmsh.model.getParametrizationBounds(1, curve)
            height = gmsh.model.getValue(1, curve, low)[2] / shape.height
            ring = round(height)
            if abs(height - ring) < 1e-6:  # else a copy of a meridian
                rings[ring].add(curve)
    for k, ring_curves in enumerate(rings):
        gmsh.model.addPhysicalGroup(1, sorted(ring_curves), k, name=f"ring_{k}")


def _read(gmsh: Gmsh, lobes: int, corners: int) -> RawMesh:
    """Take cells and rings out of the groups; refuse cells of any other type."""
    mesh = gmsh.model.mesh
    wanted = {3: 2, 4: 3}[corners]  # Gmsh's numbers for the linear triangle and quadrilateral
    cells, lobe_of, rings = [], [], []
    for k in range(lobes):
        for face in gmsh.model.getEntitiesForPhysicalGroup(2, k + 1):
            types, _, nodes = mesh.getElements(2, face)
            if list(types) != [wanted]:
                raise SolveError(
                    f"Gmsh returned cells of types {list(types)} where only type {wanted} was "
                    "asked for; try another size or cell='triangle'"
                )
            cells.append(nodes[0].astype(np.int64).reshape(-1, corners))
            lobe_of.append(np.full(len(cells[-1]), k, dtype=np.int64))
    for k in range(lobes + 1):
        edges = [
            mesh.getElements(1, curve)[2][0].astype(np.int64).reshape(-1, 2)
            for curve in gmsh.model.getEntitiesForPhysicalGroup(1, k)
        ]
        rings.append(np.concatenate(edges))
    tags, points, _ = mesh.getNodes()
    used, flat = np.unique(np.concatenate(cells), return_inverse=True)
    row = np.full(int(tags.max()) + 1, -1, dtype=np.int64)
    row[tags.astype(np.int64)] = np.arange(len(tags))
    number = np.full(len(row), -1, dtype=np.int64)
    number[used] = np.arange(len(used))
    return RawMesh(
        points=points.reshape(-1, 3)[row[used]],
        cells=flat.reshape(-1, corners).astype(np.int64),
        lobes=np.concatenate(lobe_of),
        rings=[number[ring] for ring in rings],
    )
