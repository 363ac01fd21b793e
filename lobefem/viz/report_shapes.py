"""Shapes of a report: what its 3D view turns, pictures of modes, maps of the unrolled film."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from lobefem.geometry.axis import across
from lobefem.io.run_reader import Run, Step
from lobefem.typing import Array, Axes
from lobefem.units import pascals
from lobefem.viz.film_mesh import FilmMesh, facing, film_mesh
from lobefem.viz.mode_figures import drawn_amplitude
from lobefem.viz.report_tables import number, stored_modes
from lobefem.viz.style import MM, REGIONS, STYLE, UNITS
from lobefem.viz.views import draw

__all__ = ["Picture", "mode_pictures", "regions", "scene", "stress_maps"]

PICTURES = 24  # of modes in a report

STRESSES = ("meridional N_m", "hoop N_h", "shear N_mh")

_AMPLITUDE = 0.09  # of a mode as drawn, over the diameter

_DPI = 130


@dataclass(frozen=True)
class Picture:
    """A PNG and what it shows.

    Attributes:
        title: below the picture.
        alt: for those who do not see it.
        data: the PNG as base64.
    """

    title: str
    alt: str
    data: str = field(repr=False)
    wide: bool = False


def _png(figure: Figure) -> str:
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=_DPI)
    return base64.b64encode(stream.getvalue()).decode()


def _film_mesh(run: Run, *fields: Array) -> FilmMesh:
    """The film with its grid, if its mesh has one."""
    mesh = run.design.get("mesh")
    divisions = mesh.get("divisions") if isinstance(mesh, Mapping) else None
    try:
        around = int(divisions[1]) * int(mesh.get("order", 1)) if divisions else 0  # type: ignore[index, union-attr]
        return film_mesh(run.x, run.corners, (0.0, 0.0, 1.0), around, *fields)
    except (ValueError, TypeError, IndexError):  # another mesh than the design's: drawn without its lines
        return film_mesh(run.x, run.corners, (0.0, 0.0, 1.0), 0, *fields)


# --- modes ---------------------------------------------------------------------------------------
def mode_name(run: Run, step: int, k: int) -> str:
    """A mode's caption: pressure, kind, harmonic, eigenvalue."""
    mode = stored_modes(run, step)[k]
    words = [str(mode["kind"])] if mode.get("kind") else [f"mode {mode_number(run, step, k)}"]
    if mode.get("harmonic") is not None:
        words.append(f"n = {number(mode['harmonic'])}")
    if isinstance(mode.get("real"), float):
        unit = UNITS.get(str(run.results.get("mass", "unit")), "Pa/m")
        words.append(f"λ = {mode['real']:.4g} {unit}".replace("-", "\N{MINUS SIGN}"))
    elif "critical_pressure" in mode:
        words.append(f"critical at {number(mode['critical_pressure'])} Pa")
    return ", ".join(words)


def mode_number(run: Run, step: int, k: int) -> int:
    """A stored mode's number in the table of eigenvalues, where not all of them may be stored."""
    number = stored_modes(run, step)[k].get("number")
    return number if isinstance(number, int) else k + 1


def pressure_name(step: Step) -> str:
    """A step's pressure."""
    return pascals(step.pressure)


def mode_pictures(run: Run, most: int = PICTURES) -> tuple[list[Picture], int]:
    """Side and top view of each stored mode, the highest pressures first; and how many were left out."""
    chosen = [(s, k) for s in _order(run) for k in range(run.steps[s].num_modes)]
    pictures = []
    for s, k in chosen[:most]:
        step, name = run.steps[s], mode_name(run, s, k)
        title = f"Mode {mode_number(run, s, k)} at {pressure_name(step)}: {name}"
        alt = f"{title}. Side view and top view of the deformed film over its dotted undeformed outline."
        pictures.append(Picture(title, alt, _mode_picture(run, step.nodal[f"mode_{k + 1}"], name)))
    return pictures, max(len(chosen) - most, 0)


def _mode_picture(run: Run, mode: Array, name: str) -> str:
    film = _film_mesh(run, mode)
    e1, e2 = facing(film, mode)
    scale = _drawn(film, mode, name)
    shape = film.x + scale * mode
    reach, margin = film.diameter * (0.5 + 1.15 * _AMPLITUDE), _AMPLITUDE * film.diameter
    base = float((film.x @ film.axis).min())
    side = (film.height + 2 * margin) / (2 * reach)  # over the width of a view
    width, height = 62.0, 62.0 * (side + 1)
    places: list[tuple[float, float, float, float]]
    places = [(0, 1 / (1 + side), 1, side / (1 + side)), (0, 0, 1, 1 / (1 + side))]
    if side > 1.2:  # a tall stack: side by side
        width, height, places = 124.0 / side, 62.0, [(0, 0, 0.5, 1), (0.5, 0, 0.5, 1)]
    tall = (base - margin, base + film.height + margin)
    views = ((film.axis, -e2, tall), (e2, film.axis, (-reach, reach)))
    with rc_context(STYLE):
        figure = Figure(figsize=(width * MM, height * MM), facecolor="white")
        FigureCanvasAgg(figure)
        for place, (up, towards, limits) in zip(places, views, strict=True):
            axes = figure.add_axes(place)
            axes.set_axis_off()
            draw(axes, film, shape, (e1, up, towards), 1)
            axes.set(xlim=(-reach, reach), ylim=limits, aspect="equal")
        return _png(figure)


def _drawn(film: FilmMesh, mode: Array, name: str) -> float:
    """Factor [m] on a mode's displacement when drawn; a mode of nothing is damage, and drawn as such."""
    return drawn_amplitude(name.split(",")[0], film, mode, _AMPLITUDE) if mode.any() else 0.0


# --- maps ----------------------------------------------------------------------------------------
def regions(step: Step) -> npt.NDArray[np.int64] | None:
    """0 slack, 1 wrinkled, 2 taut of each cell: what it is for the most part by the stored shares.

    Without them by how many of its principal stresses are tensile, which is the same for tension-field
    film, slack stiffness included.
    """
    shares = step.cells.get("regions")
    if shares is not None and shares.ndim == 2 and shares.shape[1] == 3:
        return 2 - np.argmax(shares, axis=1)
    stress = step.cells.get("stress_resultants")
    if stress is None:
        return None
    mean, radius = (
        (stress[:, 0] + stress[:, 1]) / 2,
        np.hypot((stress[:, 0] - stress[:, 1]) / 2, stress[:, 2]),
    )
    least = 1e-9 * float(np.abs(mean).max(initial=0.0) + radius.max(initial=0.0))
    return (mean + radius > least).astype(np.int64) + (mean - radius > least)


def stress_maps(run: Run) -> list[Picture]:
    """Stress resultants and regions of the unrolled film: at the last pressure, of a perturbation at all."""
    chosen = run.steps if run.results.get("command") == "perturb" else run.steps[-1:]
    named = [(_step_name(run, i + len(run.steps) - len(chosen)), step) for i, step in enumerate(chosen)]
    named = [(name, step) for name, step in named if "stress_resultants" in step.cells]
    if not named:
        return []
    polygons, area = _unrolled(run)
    stresses = [_resultants(step) for _, step in named]
    limits = [_limits([s[:, k] for s in stresses]) for k in range(3)]
    pictures = []
    for (name, step), stress in zip(named, stresses, strict=True):
        spans = "; ".join(
            f"{STRESSES[k]} from {stress[:, k].min():.4g} to {stress[:, k].max():.4g} N/m" for k in range(3)
        ).replace("-", "\N{MINUS SIGN}")
        pictures.append(
            Picture(
                f"Stress resultants, {name}",
                f"Maps over angle and height of the film's stress resultants: {spans}.",
                _stress_picture(polygons, stress, limits),
                wide=True,
            )
        )
        kinds = regions(step)
        assert kinds is not None
        shares = [float(area[kinds == k].sum() / area.sum()) for k in range(3)]
        told = ", ".join(f"{name} {100 * share:.3g} %" for name, share in zip(REGIONS, shares, strict=True))
        pictures.append(
            Picture(
                f"Taut, wrinkled and slack film, {name}",
                f"Map over angle and height of the film's state by its area: {told}.",
                _region_picture(polygons, kinds, told),
            )
        )
    return pictures


def _resultants(step: Step) -> Array:
    """Stress resultants, round-off beside the largest one taken for nothing: it has no map."""
    stress = step.cells["stress_resultants"]
    return np.where(np.abs(stress) > 1e-9 * np.abs(stress).max(initial=0.0), stress, 0.0)


def _step_name(run: Run, index: int) -> str:
    """The name of a step within its run."""
    if run.results.get("command") == "perturb" and len(run.steps) > 1:
        return "distorted" if index == 0 else "released"
    return f"at {pressure_name(run.steps[index])}"


def _unrolled(run: Run) -> tuple[Array, Array]:
    """Corners of each cell as angle [degrees] and height [m], (cells, corners, 2), and areas (cells,)."""
    axis = np.array([0.0, 0.0, 1.0])
    e1, e2 = across(axis)
    points = run.x[run.corners]
    angle = np.degrees(np.arctan2(points @ e2, points @ e1))
    angle -= 360 * np.round((angle - angle[:, :1]) / 360)  # no cell goes round the back
    a, b = points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]
    areas = np.linalg.norm(np.cross(a, b), axis=1) / 2
    if points.shape[1] == 4:
        areas += np.linalg.norm(np.cross(b, points[:, 3] - points[:, 0]), axis=1) / 2
    return np.stack([angle, points @ axis], axis=2), areas


def _order(run: Run) -> list[int]:
    """Steps as they are shown: the last pressure first, a perturbation as it went."""
    indices = list(range(len(run.steps)))
    return indices if run.results.get("command") == "perturb" else indices[::-1]


def _limits(values: Sequence[Array]) -> tuple[float, float]:
    """A colour scale that all share; symmetric where there are both signs. Rare extremes are cut off."""
    together = np.concatenate(values)
    low, high = (float(v) for v in np.percentile(together, [0.5, 99.5]))
    size = max(abs(low), abs(high)) or 1.0
    if high - low <= 1e-9 * size:
        return low - 0.5 * size, high + 0.5 * size
    return (-size, size) if min(-low, high) > 0.05 * size else (low, high)


def _stress_picture(polygons: Array, stress: Array, limits: Sequence[tuple[float, float]]) -> str:
    with rc_context(STYLE):
        figure = Figure(figsize=(170 * MM, 75 * MM), layout="constrained", facecolor="white")
        FigureCanvasAgg(figure)
        for k, axes in enumerate(figure.subplots(1, 3, sharey=True)):
            low, high = limits[k]
            cmap = "PuOr" if low == -high else "cividis"
            drawn = _map(axes, polygons, stress[:, k], cmap, (low, high))
            axes.set_title(_tex(STRESSES[k]), loc="left")
            figure.colorbar(
                drawn, ax=axes, label="N/m", orientation="horizontal", extend=_extend(stress[:, k], limits[k])
            )
            if k == 0:
                axes.set_ylabel("height z [m]")
        return _png(figure)


def _tex(name: str) -> str:
    words, symbol = name.rsplit(" ", 1)
    head, index = symbol.split("_")
    return f"{words} ${head}_{{{index}}}$"


def _extend(values: Array, limits: tuple[float, float]) -> str:
    """The ends of a colour bar that are pointed."""
    low, high = bool(values.min() < limits[0]), bool(values.max() > limits[1])
    return {(True, True): "both", (True, False): "min", (False, True): "max"}.get((low, high), "neither")


def _region_picture(polygons: Array, kinds: npt.NDArray[np.int64], told: str) -> str:
    with rc_context(STYLE):
        figure = Figure(figsize=(85 * MM, 70 * MM), layout="constrained", facecolor="white")
        FigureCanvasAgg(figure)
        axes = figure.add_subplot()
        drawn = _map(axes, polygons, kinds.astype(float), ListedColormap(list(REGIONS.values())), (-0.5, 2.5))
        axes.set_ylabel("height z [m]")
        bar = figure.colorbar(drawn, ax=axes, orientation="horizontal", ticks=[0, 1, 2])
        bar.ax.set_xticklabels(list(REGIONS))
        bar.ax.tick_params(length=0)
        bar.set_label(f"share of the area: {told}", fontsize=6)
        return _png(figure)


def _map(axes: Axes, polygons: Array, values: Array, cmap: Any, limits: tuple[float, float]) -> Any:
    right, left = (polygons[..., 0] > 180).any(axis=1), (polygons[..., 0] < -180).any(axis=1)
    turn = np.array([360.0, 0.0])  # what goes over one edge of the map comes in at the other
    polygons = np.concatenate([polygons, polygons[right] - turn, polygons[left] + turn])
    values = np.concatenate([values, values[right], values[left]])
    faces = PolyCollection(
        list(polygons), array=values, cmap=cmap, clim=limits, edgecolors="none", antialiased=False
    )
    axes.add_collection(faces)
    axes.set(xlim=(-180, 180), xlabel="angle [degrees]", xticks=[-180, -90, 0, 90, 180])
    axes.set_ylim(polygons[..., 1].min(), polygons[..., 1].max())
    axes.spines[["top", "right"]].set_visible(False)
    return faces


# --- in space ------------------------------------------------------------------------------------
def scene(run: Run, room: int) -> tuple[dict[str, Any] | None, int]:
    """The page's 3D data of a run within a size in bytes, and the number of views left out.

    Arrays are base64: float32 positions, uint32 triangles, displacements as int16 with a scale.
    """
    if not len(run.triangles) or not run.steps:
        return None, 0
    film = _film_mesh(run)
    data: dict[str, Any] = {
        "name": run.name,
        "x": _pack(run.x, "<f4"),
        "triangles": _pack(run.triangles, "<u4"),
        "plates": [_pack(loop, "<u4") for loop in _rims(run)],
        "lines": [_pack(line, "<u4") for line in _lines(film)],
        "views": [],
    }
    left, missing = room - sum(len(str(v)) for v in data.values()), 0
    for view in _views(run, film):
        left -= len(view["moved"]) + len(view.get("values", ""))
        if left < 0 and data["views"]:
            missing += 1
        else:
            data["views"].append(view)
    return data, missing


def _views(run: Run, film: FilmMesh) -> Iterator[dict[str, Any]]:
    """At each step modes, displacement, stresses and regions."""
    for s in _order(run):
        step = run.steps[s]
        state = step.nodal.get("displacement", np.zeros_like(run.x))
        group = _step_name(run, s)
        for k in range(step.num_modes):
            mode, name = step.nodal[f"mode_{k + 1}"], mode_name(run, s, k)
            size = np.linalg.norm(mode, axis=1)
            yield {
                "group": group, "name": f"Mode {mode_number(run, s, k)}: {name}", "kind": "mode",
                "bar": "displacement / largest",
                **_displaced(_drawn(film, mode, name) * mode),
                "values": _pack(size / (size.max(initial=0.0) or 1.0), "<f4"), "range": [0.0, 1.0],
            }  # fmt: skip
        moved = _displaced(state)
        if float(np.abs(state).max(initial=0.0)) > 0:
            size = np.linalg.norm(state, axis=1)
            yield {
                "group": group, "name": "Displacement", "kind": "state", "bar": "displacement [m]", **moved,
                "values": _pack(size, "<f4"), "range": [0.0, float(size.max())],
            }  # fmt: skip
        stress = _resultants(step) if "stress_resultants" in step.cells else None
        for k, name in enumerate(STRESSES if stress is not None else ()):
            values = stress[:, k]  # type: ignore[index]
            yield {
                "group": group, "name": f"Stress, {name}", "kind": "stress", "bar": f"{name} [N/m]", **moved,
                "values": _pack(values[run.owners], "<f4"), "cells": True, "range": list(_limits([values])),
            }  # fmt: skip
        kinds = regions(step)
        if kinds is not None:
            yield {
                "group": group, "name": "Taut, wrinkled or slack", "kind": "regions", "bar": "", **moved,
                "values": _pack(kinds[run.owners], "<f4"), "cells": True, "range": [-0.5, 2.5],
            }  # fmt: skip


def _pack(values: npt.ArrayLike, kind: str) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode()


def _displaced(field: Array) -> dict[str, Any]:
    scale = float(np.abs(field).max(initial=0.0))
    steps = np.round(field / scale * 32767) if scale > 0 else np.zeros_like(field)
    return {"moved": _pack(steps, "<i2"), "scale": scale / 32767}


def _rims(run: Run) -> list[list[int]]:
    """Nodes around each hole of the film, in order: the plates' edges."""
    edges = np.concatenate([run.triangles[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))])
    unique, count = np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)
    neighbours: dict[int, list[int]] = {}
    for a, b in unique[count == 1].tolist():
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


def _lines(film: FilmMesh) -> list[list[int]]:
    """Nodes of lines on the undeformed shape: eight meridians of a structured mesh, and the rims."""
    if film.grid is None:
        return []
    rings, around = film.grid.shape
    meridians: list[Any] = [film.grid[:, j].tolist() for j in range(0, around, max(around // 8, 1))]
    circles: list[Any] = [[*film.grid[i].tolist(), int(film.grid[i, 0])] for i in (0, rings - 1)]
    return [*meridians, *circles]
