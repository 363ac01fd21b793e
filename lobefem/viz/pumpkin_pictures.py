"""Pictures of an inflated pumpkin: all gores in space, one gore's stress, and curves by station.

A run of one gore is drawn with all the others, each the first one rotated. Plain data of a run folder.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.collections import PolyCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from lobefem.frozen import Frozen
from lobefem.io.run_reader import Run, Step
from lobefem.typing import Array, Axes, Integers
from lobefem.units import pascals
from lobefem.viz.style import MM, REGIONS, STYLE
from lobefem.viz.views import blank

__all__ = [
    "STATIONS",
    "AllGores",
    "all_gores",
    "gore_map",
    "is_inflated_pumpkin",
    "is_one_gore",
    "portrait",
    "renders",
    "side_view",
    "station_curves",
]

_FILM, _TENDON, _FITTING = "#e9edf2", "#8a5a2b", "#30343b"

_RISE = 0.22  # of the camera over its distance, seen from the side

_MANY = 120  # gores whose tendons are drawn as lines, not as tubes that would hide the film


# charts by station: title, unit, and of each line the key of the results, its label and a factor
STATIONS: tuple[tuple[str, str, tuple[tuple[str, str, float], ...]], ...] = (
    ("tension of a tendon", "N", (("tendon_tension", "", 1.0),)),
    ("half angle of the bulge", "degrees", (("bulge_half_angle", "", math.degrees(1.0)),)),
    ("radius of the bulge", "m", (("bulge_radius", "", 1.0),)),
    (
        "resultants of a layer",
        "N/m",
        (("meridional_resultant", "meridional", 1.0), ("hoop_resultant", "hoop", 1.0)),
    ),
    ("strain", "%", (("meridional_strain", "meridional", 100.0), ("hoop_strain", "hoop", 100.0))),
)


@dataclass(frozen=True)
class AllGores(Frozen):
    """The film of all gores at one pressure, cut into triangles.

    Attributes:
        points: of all gores (n, 3) [m]; neighbours do not share those of their tendon in a run of one gore.
        triangles: (m, 3).
        cells: the cell of each triangle in the run (m,).
        tendons: points along each tendon, from the bottom (gores, k, 3) [m].
    """

    points: Array = field(repr=False)
    triangles: Integers = field(repr=False)
    cells: Integers = field(repr=False)
    tendons: Array = field(repr=False)


def is_inflated_pumpkin(run: Run) -> bool:
    """True if a run is one of `lobefem inflate` on a pumpkin."""
    return run.results.get("command") == "inflate" and isinstance(run.results.get("gores"), int)


def all_gores(run: Run, step: Step) -> AllGores:
    """The film of all gores of a run at one of its pressures."""
    gores = int(run.results["gores"])
    alpha = 2 * math.pi / gores
    moved = run.x + step.nodal.get("displacement", 0.0)
    edge = _tendon(run.x)
    turns = alpha * np.arange(gores)
    tendons = _rotated(moved[edge], turns)
    if not is_one_gore(run):
        return AllGores(moved, run.triangles, run.owners, tendons)
    first = len(moved) * np.arange(gores)[:, None, None]
    return AllGores(
        _rotated(moved, turns).reshape(-1, 3),
        (run.triangles + first).reshape(-1, 3),
        np.tile(run.owners, gores),
        tendons,
    )


def is_one_gore(run: Run) -> bool:
    """True if the fields of a pumpkin's run are those of one gore."""
    alpha = 2 * math.pi / int(run.results["gores"])
    azimuth = np.arctan2(run.x[:, 1], run.x[:, 0])
    return bool(azimuth.min() > -alpha / 4 and azimuth.max() < 1.25 * alpha)


def _rotated(points: Array, turns: Any) -> Array:
    """Points (n, 3) rotated about the axis by each of some angles (m, n, 3)."""
    c, s = np.cos(turns)[:, None], np.sin(turns)[:, None]
    x, y, z = points.T
    return np.stack([c * x - s * y, s * x + c * y, np.broadcast_to(z, (len(turns), len(z)))], axis=2)


def _tendon(x: Array) -> Integers:
    """Nodes of the tendon of azimuth 0 at rest, from the bottom."""
    r = np.hypot(x[:, 0], x[:, 1])
    on = np.flatnonzero((np.abs(x[:, 1]) < 1e-9 * r.max()) & (x[:, 0] > 0))
    return on[np.argsort(_rise(x[on], x))]


def _rise(points: Array, x: Array) -> Array:
    """Angle from the middle of the balloon's axis, from -pi/2 at the bottom to pi/2 at the top."""
    middle = (x[:, 2].max() + x[:, 2].min()) / 2
    return np.asarray(np.arctan2(points[:, 2] - middle, np.hypot(points[:, 0], points[:, 1])))


# --- in space ------------------------------------------------------------------------------------
@lru_cache
def renders() -> bool:
    """True if VTK can draw here; asked once."""
    from lobefem.viz.rendering import can_render  # slow to import

    return can_render()


def portrait(run: Run, step: Step, width: float = 170.0) -> Figure:
    """The balloon from the side and from above, with its tendons, and a cut through the equator."""
    shape = all_gores(run, step)
    with rc_context(STYLE):
        figure = blank()
        figure.set_size_inches(width * MM, 0.5 * width * MM)
        places = ((0.0, 0.0, 0.66, 0.88), (0.68, 0.36, 0.31, 0.6))
        for k, place in enumerate(places):
            axes = figure.add_axes(place)
            axes.set_axis_off()
            _view(axes, shape, _RISE if k == 0 else math.inf, 1400 if k == 0 else 800)
        _cut(figure.add_axes((0.71, 0.15, 0.25, 0.17)), shape)
        figure.text(0.835, 0.02, "three bulges,\ncut at the equator", ha="center", fontsize=6.0)
        results = run.results
        told = f"{results['gores']} gores, {pascals(step.pressure)}"
        figure.text(0.02, 0.97, told, va="top", fontsize=8.5, weight="bold")
        sizes = [("diameter", "m across"), ("height", "m high"), ("volume", "m³")]
        words = [f"{_plain(results[k])} {unit}" for k, unit in sizes if isinstance(results.get(k), float)]
        figure.text(0.02, 0.91, ", ".join(words), va="top")
        return figure


def side_view(run: Run, step: Step, width: float = 85.0) -> Figure:
    """The balloon with its tendons from the side, and nothing else."""
    figure = blank()
    figure.set_size_inches(width * MM, 0.66 * width * MM)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    _view(axes, all_gores(run, step), _RISE, 1000)
    return figure


def _plain(value: float) -> str:
    """Four digits, without an exponent; thousands apart."""
    return (
        f"{value:.4g}"
        if abs(value) < 1e4
        else f"{round(value, 3 - math.floor(math.log10(value))):,.0f}".replace(
            ",", "\N{NARROW NO-BREAK SPACE}"
        )
    )


def _view(axes: Axes, shape: AllGores, rise: float, pixels: int) -> None:
    """The balloon seen from the side, or from above for an infinite rise, on axes."""
    towards = np.array([0.0, 0.0, 1.0]) if math.isinf(rise) else np.array([0.0, -1.0, rise])
    towards /= np.linalg.norm(towards)
    up = np.array([0.0, 1.0, 0.0]) if math.isinf(rise) else np.array([0.0, 0.0, 1.0])
    if renders():
        axes.imshow(_rendered(shape, towards, up, pixels))
        axes.set_anchor("C")
    else:
        _painted(axes, shape, towards, up)


def _rendered(shape: AllGores, towards: Array, up: Array, pixels: int) -> Any:
    """An image of the balloon by VTK, shaded smoothly within each gore."""
    import pyvista

    from lobefem.viz.rendering import quiet

    faces = np.column_stack([np.full(len(shape.triangles), 3), shape.triangles]).ravel()
    size = float(np.ptp(shape.points, axis=0).max())
    low, high = shape.points.min(axis=0), shape.points.max(axis=0)
    centre = (low + high) / 2
    across = np.cross(up, towards)
    reach = [float(np.ptp(shape.points @ e)) for e in (across, np.cross(towards, across))]
    window = (pixels, max(int(pixels * 1.06 * reach[1] / (1.06 * reach[0])), 64))
    with quiet():
        plotter = pyvista.Plotter(off_screen=True, window_size=list(window), lighting="none")
        plotter.set_background("white")
        film = pyvista.PolyData(shape.points, faces)
        film = film.compute_normals(cell_normals=False, split_vertices=True, feature_angle=25.0)
        plotter.add_mesh(
            film, color=_FILM, smooth_shading=True, specular=0.35, specular_power=12, ambient=0.22
        )
        thin = len(shape.tendons) > _MANY
        count, nodes, _ = shape.tendons.shape
        numbers = np.arange(count * nodes).reshape(count, nodes)
        strands = np.column_stack([np.full(count, nodes), numbers]).ravel()
        lines = pyvista.PolyData(shape.tendons.reshape(-1, 3), lines=strands)
        if thin:
            plotter.add_mesh(lines, color=_TENDON, line_width=1.0, opacity=0.55)
        else:
            plotter.add_mesh(lines.tube(radius=0.0014 * size), color=_TENDON, ambient=0.3)
        for end in (0, -1):
            ring = shape.tendons[:, end]
            plotter.add_mesh(pyvista.PolyData(ring, [len(ring), *range(len(ring))]), color=_FITTING)
        sun = centre + 5 * size * (0.75 * towards + 0.55 * up - 0.6 * across)
        sky = centre + 5 * size * (0.5 * towards - 0.2 * up + 0.9 * across)
        for place, strength in ((sun, 0.82), (sky, 0.25)):
            plotter.add_light(pyvista.Light(position=place, focal_point=centre, intensity=strength))
        plotter.camera.focal_point = centre
        plotter.camera.position = centre + 10 * size * towards
        plotter.camera.up = up
        plotter.camera.parallel_projection = True
        plotter.camera.parallel_scale = 0.53 * reach[1]
        plotter.enable_anti_aliasing("ssaa")
        image = plotter.screenshot(return_img=True)
        plotter.close()
    return image


def _painted(axes: Axes, shape: AllGores, towards: Array, up: Array) -> None:
    """The balloon by Matplotlib, painted from back to front."""
    across = np.cross(up, towards)
    frame = np.stack([across, np.cross(towards, across)])
    corners = shape.points[shape.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    facing = normal @ towards > 0
    corners, normal = corners[facing], normal[facing]
    order = np.argsort(corners.mean(axis=1) @ towards)
    light = 0.75 * towards + 0.55 * up - 0.6 * across
    shade = 0.35 + 0.65 * np.clip(normal[order] @ light / np.linalg.norm(light), 0.0, 1.0)
    colours = shade[:, None] * np.array([0.93, 0.95, 0.97])
    polygons = PolyCollection(list(corners[order] @ frame.T), facecolors=colours, edgecolors=colours, lw=0.2)
    axes.add_collection(polygons)
    axes.set_aspect("equal")
    axes.autoscale_view()


def _cut(axes: Axes, shape: AllGores) -> None:
    """The bulges of some gores where the tendons are farthest from the axis."""
    tendons = shape.tendons
    gores = len(tendons)
    row = int(np.argmax(np.hypot(tendons[0, :, 0], tendons[0, :, 1])))
    ring = tendons[:, row]
    height = float(ring[:, 2].mean())
    near = 3
    corners = shape.points[shape.triangles]
    below = corners[..., 2] < height
    crossing = corners[below.any(axis=1) & ~below.all(axis=1)]
    ends = []
    for a, b in ((0, 1), (1, 2), (2, 0)):
        p, q = crossing[:, a], crossing[:, b]
        t = (height - p[:, 2]) / np.where(p[:, 2] == q[:, 2], 1.0, q[:, 2] - p[:, 2])
        here = (p[:, 2] < height) != (q[:, 2] < height)
        ends.append(np.where(here[:, None], p + t[:, None] * (q - p), np.nan))
    points = np.concatenate(ends)
    points = points[~np.isnan(points[:, 0])]
    azimuth = np.mod(np.arctan2(points[:, 1], points[:, 0]), 2 * math.pi)
    chosen = azimuth < near * 2 * math.pi / gores
    points = points[chosen][np.argsort(azimuth[chosen])]
    first = _rotated(points, np.array([math.pi / 2 - near * math.pi / gores]))[0]
    knots = _rotated(ring[np.arange(near + 1) % gores], np.array([math.pi / 2 - near * math.pi / gores]))[0]
    axes.plot(first[:, 0], first[:, 1], color="#0072B2", lw=1.2, clip_on=False)
    axes.plot(knots[:, 0], knots[:, 1], "o", color=_TENDON, ms=3, clip_on=False)
    axes.set_aspect("equal")
    axes.set_axis_off()


# --- one gore ------------------------------------------------------------------------------------
def gore_map(run: Run, step: Step, width: float = 170.0) -> Figure:
    """Stress resultants and taut, wrinkled and slack film over the first gore, as wide as it is."""
    polygons, chosen = _unrolled(run)
    stress = step.cells["stress_resultants"][chosen]
    panels = [("meridional, $N_m$ [N/m]", stress[:, 0]), ("hoop, $N_h$ [N/m]", stress[:, 1])]
    with rc_context(STYLE):
        figure = blank()
        figure.set_size_inches(width * MM, 0.6 * width * MM)
        figure.set_layout_engine("constrained")
        regions = step.cells.get("regions")
        for k, axes in enumerate(figure.subplots(1, 3 if regions is not None else 2, sharey=True)):
            if k < len(panels):
                title, values = panels[k]
                high = float(np.percentile(values, 99.5)) or 1.0
                limits = (min(float(values.min()), 0.0), high)
                colours: Any = "cividis"
            else:
                assert regions is not None
                title, values = "state of the film", 2.0 - np.argmax(regions[chosen], axis=1)
                limits, colours = (-0.5, 2.5), ListedColormap(list(REGIONS.values()))
            drawn = PolyCollection(
                list(polygons), array=values, cmap=colours, clim=limits, edgecolors="face", lw=0.1
            )
            axes.add_collection(drawn)
            axes.autoscale_view()
            axes.set_title(title, loc="left")
            axes.set_xlabel("across the gore [m]")
            bar = figure.colorbar(drawn, ax=axes, orientation="horizontal", aspect=30)
            if k == len(panels):
                bar.set_ticks([0, 1, 2], labels=list(REGIONS))
                bar.ax.tick_params(length=0)
        figure.axes[0].set_ylabel("along the tendon, from the bottom [m]")
        return figure


def _unrolled(run: Run) -> tuple[Array, Any]:
    """Corners of the first gore's cells, across and along it [m] (cells, corners, 2), and which cells."""
    alpha = 2 * math.pi / int(run.results["gores"])
    middle = run.x[run.corners].mean(axis=1)
    chosen = np.mod(np.arctan2(middle[:, 1], middle[:, 0]), 2 * math.pi) < alpha
    edge = run.x[_tendon(run.x)]
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(edge, axis=0), axis=1))])
    points = run.x[run.corners[chosen]]
    flat = points.reshape(-1, 3)
    across = flat[:, 1] * math.cos(alpha / 2) - flat[:, 0] * math.sin(alpha / 2)
    s = np.interp(_rise(flat, run.x), _rise(edge, run.x), along)
    return np.stack([across, s], axis=1).reshape(*points.shape[:2], 2), chosen


# --- by station ------------------------------------------------------------------------------------
def station_curves(run: Run, width: float = 170.0) -> Figure:
    """Tension of a tendon, bulges, resultants and strains by station from the bottom to the top."""
    results = run.results
    s = np.asarray(results["stations"], dtype=float)
    groups = [
        (title, unit, lines)
        for title, unit, lines in STATIONS
        if all(isinstance(results.get(name), list) for name, _, _ in lines)
    ]
    with rc_context(STYLE):
        figure = blank()
        columns = 3
        rows = -(-len(groups) // columns)
        figure.set_size_inches(width * MM, 0.3 * rows * width * MM)
        figure.set_layout_engine("constrained")
        panels = figure.subplots(rows, columns, squeeze=False).ravel()
        for axes, (title, unit, lines) in zip(panels, groups, strict=False):
            for (name, label, factor), colour in zip(lines, ("#0072B2", "#D55E00"), strict=False):
                axes.plot(s, factor * np.asarray(results[name]), color=colour, lw=1.2, label=label)
            if any(label for _, label, _ in lines):
                axes.legend(frameon=False)
            axes.set_title(f"{title} [{unit}]", loc="left")
            axes.set_xlabel("station, bottom to top")
            axes.set_xlim(0, 1)
            if title.startswith("tension"):
                axes.set_ylim(bottom=0)
            axes.spines[["top", "right"]].set_visible(False)
        for axes in panels[len(groups) :]:
            axes.set_visible(False)
        return figure
