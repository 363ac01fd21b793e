"""Shapes of a report: what its 3D view turns and swings, as plain data."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from lobefem.errors import InputError
from lobefem.io.run_reader import Run, Step
from lobefem.typing import Array, Integers
from lobefem.viz.film_mesh import FilmMesh
from lobefem.viz.frames import Frames, load_frames
from lobefem.viz.report_maps import STRESSES, limits, regions, resultants
from lobefem.viz.report_pictures import drawn, film_of, mode_name, mode_number, order, step_name
from lobefem.viz.report_tables import number, pairs, stored_modes

__all__ = ["Scene", "scene"]

_MOST = 100_000  # triangles that a browser turns with ease; beyond, midpoints of cells are left out


@dataclass(frozen=True)
class Scene:
    """The 3D data of a run.

    Attributes:
        data: for the page's script. Arrays are base64: float32 positions, uint32 numbers, the rest as int16
            or uint16 with a scale.
        steps: for each step of the run its state in `data`.
        points: for each point of a perturbation's history that has a shape, its state.
        left_out: number of states that had no room.
    """

    data: dict[str, Any] = field(repr=False)
    steps: Mapping[int, int]
    points: Mapping[int, int]
    left_out: int

    def mode(self, step: int, mode: int) -> str:
        """The view that shows a stored mode, "" if none does."""
        state = self.steps.get(step)
        if state is None:
            return ""
        known = self.data["states"][state]["modes"]
        at = next((k for k, one in enumerate(known) if mode in one["numbers"]), None)
        return "" if at is None else f"{state}:{at}"

    def point(self, point: int) -> str:
        """The view that shows the shape nearest to a point of the history, "" if none is kept."""
        if not self.points:
            return ""
        return f"{self.points[min(self.points, key=lambda k: abs(k - point))]}:"


def scene(run: Run, room: int) -> Scene | None:
    """The 3D data of a run within a size in bytes; None without a shape."""
    if not len(run.triangles) or not run.steps:
        return None
    run = _without_midpoints(run)
    film = film_of(run)
    if len(run.triangles) > 4 * _MOST:
        return None
    gores = run.results.get("gores")
    gores = gores if isinstance(gores, int) and gores > 2 else 0
    copies = gores if gores and _is_one_gore(run.x, gores) else 1
    data: dict[str, Any] = {
        "name": run.name,
        "copies": copies,
        "x": _pack(run.x, "<f4"),
        "triangles": _pack(run.triangles, "<u4"),
        "owners": _pack(run.owners, "<u4"),
        "plates": [_pack(loop, "<u4") for loop in (_ends if copies > 1 else _rims)(run, gores)],
        "lines": _structure(run, film, gores),
        "outline": [_pack(line, "<u4") for line in _outline(film)],
        "states": [],
    }
    left = room - sum(len(str(value)) for value in data.values())
    frames = _frames(run)
    shapes = frames.displacements if frames is not None else ()
    farthest = max((float(np.linalg.norm(one, axis=1).max()) for one in shapes), default=0.0)
    steps: dict[int, int] = {}
    points: dict[int, int] = {}
    left_out = 0
    made_up: list[tuple[dict[str, Any], int | None, int | None]] = []
    # those of the highest pressures have room first
    for name, step, frame in reversed(_moments(run, frames)):
        if step is not None:
            made = _state(run, film, name, step, farthest)
        else:
            made = _frame(name, frames.displacements[frame], farthest)  # type: ignore[union-attr, index]
        left -= sum(len(str(value)) for value in made.values())
        if left < 0 and made_up:
            left_out += 1
        else:
            made_up.append((made, step, frame))
    for made, step, frame in reversed(made_up):
        if step is not None:
            steps[step] = len(data["states"])
        if frame is not None:
            points[frames.points[frame]] = len(data["states"])  # type: ignore[union-attr]
        data["states"].append(made)
    # the page begins with the last pressure, a motion where it was let go
    first = min(steps.values(), default=0) if points else len(data["states"]) - 1
    return Scene(data | {"first": first}, steps, points, left_out)


def _moments(run: Run, frames: Frames | None) -> list[tuple[str, int | None, int | None]]:
    """Name, step and frame of each state, in the order in which a slider goes through them."""
    chosen = order(run) if run.results.get("command") == "perturb" else order(run)[::-1]
    if frames is None:
        return [(step_name(run, s), s, None) for s in chosen]
    history = run.results.get("history")
    rows = history if isinstance(history, list) else []
    ramp = sum(isinstance(row, dict) and row.get("time") is None for row in rows) - 1
    ends = {ramp: 0, len(rows) - 1: len(run.steps) - 1} if len(run.steps) > 1 else {len(rows) - 1: 0}
    named: list[tuple[str, int | None, int | None]] = []
    for k, point in enumerate(frames.points):
        row = rows[point] if point < len(rows) and isinstance(rows[point], dict) else {}
        time = row.get("time")
        unit = str(run.results.get("unit") or "")
        name = f"pushed {number(row.get('parameter'))} {unit}"
        if time is not None:
            name = f"{number(time)} s after the release"
        named.append((name, ends.get(point), k))
    told = {step for _, step, _ in named if step is not None}
    return named + [(step_name(run, s), s, None) for s in range(len(run.steps)) if s not in told]


def _frames(run: Run) -> Frames | None:
    """The shapes of a motion in the run's own order of nodes, if there are any and they are of its mesh."""
    try:
        found = load_frames(run.path)
    except InputError:
        return None
    if found is None or found.film_mesh.x.shape != run.x.shape:
        return None
    from scipy.spatial import cKDTree  # slow to import, and only motions need it

    far, nodes = cKDTree(found.film_mesh.x).query(run.x)
    if far.max() > 1e-4 * float(np.ptp(run.x)):
        return None
    return replace(found, displacements=tuple(field[nodes] for field in found.displacements))


def _without_midpoints(run: Run) -> Run:
    """The run on corners of its cells alone, if it has too many triangles to be turned with ease."""
    if len(run.triangles) <= _MOST:
        return run
    kept, corners = np.unique(run.corners, return_inverse=True)
    corners = corners.reshape(run.corners.shape)
    parts = [[0, 1, 2]] if run.corners.shape[1] == 3 else [[0, 1, 2], [0, 2, 3]]
    steps = tuple(
        replace(step, nodal={name: field[kept] for name, field in step.nodal.items()}) for step in run.steps
    )
    owners = np.repeat(np.arange(len(corners)), len(parts))
    triangles = corners[:, parts].reshape(-1, 3)
    return replace(run, x=run.x[kept], corners=corners, triangles=triangles, owners=owners, steps=steps)


# --- one state -----------------------------------------------------------------------------------
def _frame(name: str, displacement: Array, farthest: float) -> dict[str, Any]:
    fields = [_distance(displacement, farthest)]
    return {"name": name, **_displaced(displacement), "modes": [], "fields": fields}


def _state(run: Run, film: FilmMesh, name: str, index: int, farthest: float) -> dict[str, Any]:
    """Shape, modes and fields of a step; a displacement of `farthest` has the last colour."""
    step = run.steps[index]
    state = step.nodal.get("displacement", np.zeros_like(run.x))
    modes = []
    for numbers, _ in pairs(stored_modes(run, index)):
        k = numbers[0] - 1
        real, called = step.nodal[f"mode_{k + 1}"], mode_name(run, index, k)
        factor = drawn(film, real, called)
        imaginary = step.nodal.get(f"mode_{k + 1}_imag")
        which = "s " if numbers[1:] else " "
        which += " and ".join(str(mode_number(run, index, n - 1)) for n in numbers)
        stored = stored_modes(run, index)[k]
        mode = {
            "numbers": [n - 1 for n in numbers],
            "name": f"Mode{which}: {called}",
            "kind": str(stored.get("kind") or ""),
            "harmonic": stored["harmonic"] if isinstance(stored.get("harmonic"), int) else 0,
            **_displaced(factor * real),
        }
        if imaginary is not None and imaginary.any():
            mode["imaginary"] = _displaced(factor * imaginary)
        modes.append(mode)
    fields = [_distance(state, farthest)] if state.any() else []
    return {"name": name, **_displaced(state), "modes": modes, "fields": [*fields, *_fields(step)]}


def _distance(displacement: Array, farthest: float) -> dict[str, Any]:
    size = np.linalg.norm(displacement, axis=1)
    largest = farthest or float(size.max(initial=0.0)) or 1.0
    unit, factor = ("m", 1.0) if largest >= 0.1 else ("mm", 1e3)
    return {
        "name": "Displacement", "kind": "size", "bar": f"displacement [{unit}]", "cells": False,
        **_quantised(factor * size, 0.0, factor * largest),
    }  # fmt: skip


def _fields(step: Step) -> list[dict[str, Any]]:
    """Stresses and the state of the film, a value each cell; a stress that is nowhere is left out."""
    found: list[dict[str, Any]] = []
    stress = resultants(step) if "stress_resultants" in step.cells else np.zeros((1, 3))
    for k, name in enumerate(STRESSES):
        values = stress[:, k]
        if not values.any():
            continue
        low, high = limits([values])
        kind = "signed" if low == -high else "size"
        found.append(
            {
                "name": f"Stress, {name}", "kind": kind, "bar": f"{name} [N/m]", "cells": True,
                **_quantised(values, low, high),
            }
        )  # fmt: skip
    kinds = regions(step)
    if kinds is not None:
        found.append(
            {
                "name": "Taut, wrinkled or slack", "kind": "regions", "bar": "", "cells": True,
                **_quantised(kinds, 0.0, 2.0),
            }
        )  # fmt: skip
    return found


def _pack(values: npt.ArrayLike, kind: str) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode()


def _displaced(field: Array) -> dict[str, Any]:
    scale = float(np.abs(field).max(initial=0.0))
    steps = np.round(field / scale * 32767) if scale > 0 else np.zeros_like(field)
    return {"moved": _pack(steps, "<i2") if scale > 0 else "", "scale": scale / 32767}


def _quantised(values: npt.NDArray[Any], low: float, high: float) -> dict[str, Any]:
    share = np.clip((values - low) / ((high - low) or 1.0), 0.0, 1.0)
    return {"values": _pack(np.round(65535 * share), "<u2"), "range": [low, high]}


# --- the structure -------------------------------------------------------------------------------
def _is_one_gore(x: Array, gores: int) -> bool:
    """True for the mesh of one gore, which the view shows as often as there are gores."""
    angle = np.arctan2(x[:, 1], x[:, 0])
    return float(np.ptp(angle)) < 1.01 * 2 * np.pi / gores


def _rims(run: Run, gores: int) -> list[list[int]]:
    """Nodes around each hole of the film, in order: the plates' edges."""
    return [loop for loop in _chains(_edges(run.triangles)) if len(loop) > 2]


def _ends(run: Run, gores: int) -> list[list[int]]:
    """Nodes of a gore's two ends, in order, which the fittings hold."""
    edges = _edges(run.triangles)
    turns = np.arctan2(run.x[:, 1], run.x[:, 0]) * gores / (2 * np.pi)
    seam = np.abs(turns - np.round(turns)) < 1e-6
    ends = edges[~(seam[edges].all(axis=1) & (np.round(turns)[edges[:, 0]] == np.round(turns)[edges[:, 1]]))]
    low = run.x[ends, 2].mean(axis=1) < run.x[:, 2].mean()
    # in order of angle, which is that along an end
    return [
        nodes[np.argsort(turns[nodes])].tolist()
        for nodes in (np.unique(ends[low]), np.unique(ends[~low]))
        if len(nodes)
    ]


def _edges(triangles: Integers) -> Integers:
    """Edges of one triangle only (edges, 2)."""
    edges = np.concatenate([triangles[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))])
    unique, count = np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)
    return unique[count == 1]


def _chains(edges: Integers) -> list[list[int]]:
    """The loops that edges make, as nodes in order."""
    neighbours: dict[int, list[int]] = {}
    pairs: Any = edges.tolist()
    for a, b in pairs:
        neighbours.setdefault(a, []).append(b)
        neighbours.setdefault(b, []).append(a)
    loops = []
    while neighbours:
        node = next(iter(neighbours))
        loop = []
        while node in neighbours:
            loop.append(node)
            ahead = neighbours.pop(node)
            node = next((n for n in ahead if n in neighbours), -1)
        loops.append(loop)
    return loops


def _structure(run: Run, film: FilmMesh, gores: int) -> list[dict[str, Any]]:
    """Hoops and tendons as lines of nodes; what a bar joins is the middle of both plates."""
    results = run.results
    if gores:
        return [{"kind": "tendon", "nodes": _pack(line, "<u4")} for line in _tendons(run.x, gores)]
    lines: list[dict[str, Any]] = []
    lobes = results.get("lobes")
    if film.grid is not None:  # to see a twist by
        around = film.grid.shape[1]
        columns = range(0, around, max(around // 8, 1))
        lines += [{"kind": "meridian", "nodes": _pack(film.grid[:, j], "<u4")} for j in columns]
    if film.grid is not None and isinstance(lobes, int) and lobes > 1:
        rings = film.grid.shape[0] - 1
        kind = "hoop" if results.get("hoops") is not None else "seam"
        seams = [rings * k // lobes for k in range(1, lobes)] if rings % lobes == 0 else []
        lines += [{"kind": kind, "nodes": _pack([*film.grid[i], film.grid[i, 0]], "<u4")} for i in seams]
    if results.get("bar") is not None and results.get("support") != "fixed":
        lines.append({"kind": "bar", "nodes": ""})
    return lines


def _tendons(x: Array, gores: int) -> list[Integers]:
    """Nodes at multiples of the gore's angle, from bottom to top."""
    turns = np.arctan2(x[:, 1], x[:, 0]) * gores / (2 * np.pi)
    near = np.abs(turns - np.round(turns)) < 1e-6
    number_ = np.round(turns).astype(np.int64) % gores
    found = []
    for k in np.unique(number_[near]):
        nodes = np.flatnonzero(near & (number_ == k))
        found.append(nodes[np.argsort(x[nodes, 2], kind="stable")])
    return found


def _outline(film: FilmMesh) -> Sequence[Sequence[int]]:
    """Lines on the undeformed shape: four meridians of a structured mesh, and its rims."""
    if film.grid is None:
        return []
    rings, around = film.grid.shape
    meridians: list[Any] = [film.grid[:, j].tolist() for j in range(0, around, max(around // 4, 1))]
    circles: list[Any] = [[*film.grid[i].tolist(), int(film.grid[i, 0])] for i in (0, rings - 1)]
    return [*meridians, *circles]
