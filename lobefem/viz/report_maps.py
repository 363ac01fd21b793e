"""Maps of a report: stress and the state of the film, over the unrolled film."""

from __future__ import annotations

from collections.abc import Sequence
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
from lobefem.viz.report_pictures import Picture, png, step_name
from lobefem.viz.style import DIVERGING, MM, REGIONS, SEQUENTIAL, STYLE

__all__ = ["STRESSES", "limits", "regions", "resultants", "stress_maps", "taut_everywhere"]

STRESSES = ("meridional N_m", "hoop N_h", "shear N_mh")


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
    named = [(step_name(run, i + len(run.steps) - len(chosen)), step) for i, step in enumerate(chosen)]
    named = [(name, step) for name, step in named if "stress_resultants" in step.cells]
    if not named:
        return []
    polygons, area = _unrolled(run)
    stresses = [resultants(step) for _, step in named]
    shared = [limits([s[:, k] for s in stresses]) for k in range(3)]
    pictures = []
    for (name, step), stress in zip(named, stresses, strict=True):
        there = [k for k in range(3) if stress[:, k].any()]
        nowhere = [STRESSES[k].rpartition(" ")[0] for k in range(3) if k not in there]
        spans = "; ".join(
            f"{STRESSES[k]} from {stress[:, k].min():.4g} to {stress[:, k].max():.4g} N/m" for k in range(3)
        ).replace("-", "\N{MINUS SIGN}")
        pictures.append(
            Picture(
                f"Stress resultants, {name}{f' ({_and(nowhere)} stress is zero)' if nowhere else ''}",
                f"Maps over angle and height of the film's stress resultants: {spans}.",
                _stress_picture(polygons, stress, shared, there or [0]),
                wide=True,
            )
        )
        kinds = regions(step)
        assert kinds is not None
        shares = [float(area[kinds == k].sum() / area.sum()) for k in range(3)]
        if max(shares) > 0.9995:
            continue
        told = ", ".join(f"{name} {100 * share:.3g} %" for name, share in zip(REGIONS, shares, strict=True))
        pictures.append(
            Picture(
                f"Taut, wrinkled and slack film, {name}",
                f"Map over angle and height of the film's state by its area: {told}.",
                _region_picture(polygons, kinds, told),
            )
        )
    return pictures


def _and(words: Sequence[str]) -> str:
    return " and ".join(words)


def taut_everywhere(run: Run) -> str:
    """A sentence where film of the last state is all of one kind, "" where it is not."""
    kinds = regions(run.steps[-1]) if run.steps else None
    if kinds is None:
        return ""
    _, area = _unrolled(run)
    for k, name in enumerate(REGIONS):
        if float(area[kinds == k].sum()) > 0.9995 * float(area.sum()):
            return f"The film is {name} everywhere {step_name(run, len(run.steps) - 1)}."
    return ""


def resultants(step: Step) -> Array:
    """Stress resultants, round-off beside the largest one taken for nothing: it has no map."""
    stress = step.cells["stress_resultants"]
    return np.where(np.abs(stress) > 1e-9 * np.abs(stress).max(initial=0.0), stress, 0.0)


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


def limits(values: Sequence[Array]) -> tuple[float, float]:
    """A colour scale that all share; symmetric where there are both signs. Rare extremes are cut off."""
    together = np.concatenate(values)
    low, high = (float(v) for v in np.percentile(together, [0.5, 99.5]))
    size = max(abs(low), abs(high)) or 1.0
    if high - low <= 1e-9 * size:
        return low - 0.5 * size, high + 0.5 * size
    return (-size, size) if min(-low, high) > 0.05 * size else (low, high)


def _stress_picture(
    polygons: Array, stress: Array, shared: Sequence[tuple[float, float]], there: Sequence[int]
) -> str:
    with rc_context(STYLE):
        size = ((5 + 55 * len(there)) * MM, 75 * MM)
        figure = Figure(figsize=size, layout="constrained", facecolor="white")
        FigureCanvasAgg(figure)
        for k, axes in zip(there, figure.subplots(1, len(there), sharey=True, squeeze=False)[0], strict=True):
            low, high = shared[k]
            cmap = DIVERGING if low == -high else SEQUENTIAL
            drawn = _map(axes, polygons, stress[:, k], cmap, (low, high))
            axes.set_title(_tex(STRESSES[k]), loc="left")
            figure.colorbar(
                drawn, ax=axes, label="N/m", orientation="horizontal", extend=_extend(stress[:, k], shared[k])
            )
            if k == there[0]:
                axes.set_ylabel("height z [m]")
        return png(figure)


def _tex(name: str) -> str:
    words, symbol = name.rsplit(" ", 1)
    head, index = symbol.split("_")
    return f"{words} ${head}_{{{index}}}$"


def _extend(values: Array, ends: tuple[float, float]) -> str:
    """The ends of a colour bar that are pointed."""
    low, high = bool(values.min() < ends[0]), bool(values.max() > ends[1])
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
        return png(figure)


def _map(axes: Axes, polygons: Array, values: Array, cmap: Any, ends: tuple[float, float]) -> Any:
    low, high = float(polygons[..., 0].min()), float(polygons[..., 0].max())
    right, left = (polygons[..., 0] > 180).any(axis=1), (polygons[..., 0] < -180).any(axis=1)
    turn = np.array([360.0, 0.0])  # what goes over one edge of the map comes in at the other
    polygons = np.concatenate([polygons, polygons[right] - turn, polygons[left] + turn])
    values = np.concatenate([values, values[right], values[left]])
    faces = PolyCollection(
        list(polygons), array=values, cmap=cmap, clim=ends, edgecolors="none", antialiased=False
    )
    axes.add_collection(faces)
    axes.set(xlabel="angle [degrees]")
    if high - low > 180:
        axes.set(xlim=(-180, 180), xticks=[-180, -90, 0, 90, 180])
    else:  # one gore
        axes.set_xlim(low, high)
    axes.set_ylim(polygons[..., 1].min(), polygons[..., 1].max())
    axes.spines[["top", "right"]].set_visible(False)
    return faces
