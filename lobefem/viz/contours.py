"""Figures of displaced shapes, coloured by a displacement component (paper fig. 24).

Matplotlib is used through its objects: no window system is needed, no global state is touched.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib import colormaps, rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from lobefem.errors import InputError
from lobefem.fem.balloon import Balloon
from lobefem.geometry.axis import across
from lobefem.typing import Array
from lobefem.viz.film_mesh import gather, polygons
from lobefem.viz.style import MM, STYLE

__all__ = ["horizontal_displacements"]


def horizontal_displacements(
    balloon: Balloon, shapes: Sequence[tuple[str, Array]], *, title: str = "", width: float = 85.0
) -> Figure | None:
    """Displaced shapes side by side, seen along y, with bands of the displacement along x.

    A bend, and a push on the tip, lie in the plane of the paper. Displacements are to scale, and the
    bands of all shapes the same.

    Args:
        balloon: whose shapes they are.
        shapes: a caption and this rank's nodal displacements (nodes, 3) of each [m].
        title: over the figure.
        width: of the figure [mm].

    Returns:
        the figure on rank 0, None elsewhere.

    Raises:
        InputError: no shape.

    Collective.
    """
    if not shapes:
        raise InputError("there is no shape to draw; give one or more")
    film_mesh = gather(balloon, *(u for _, u in shapes))
    if film_mesh is None:
        return None
    right, _ = across(film_mesh.axis)
    towards = np.cross(right, film_mesh.axis)
    groups = polygons(film_mesh, 1)
    extents = [film_mesh.x + u for u in film_mesh.fields]
    reach = max(float(np.abs(x @ right).max()) for x in extents)
    low = min(float((x @ film_mesh.axis).min()) for x in extents)
    high = max(float((x @ film_mesh.axis).max()) for x in extents)
    horizontal = [u @ right for u in film_mesh.fields]
    limits = min(float(u.min()) for u in horizontal), max(float(u.max()) for u in horizontal)
    ticks = np.array(MaxNLocator(10, steps=[1, 2, 2.5, 5, 10]).tick_values(*limits))
    # a band about each, so that the round-off of what has not moved draws no border
    half = (ticks[1] - ticks[0]) / 2
    levels = np.append(ticks - half, ticks[-1] + half)
    colours = colormaps["viridis"]
    norm = BoundaryNorm(levels, colours.N)
    cell = width / len(shapes)
    with rc_context(STYLE):
        figure = Figure(
            figsize=(width * MM, (cell * (high - low) / (2 * reach) + (19 if title else 14)) * MM),
            layout="constrained",
        )
        FigureCanvasAgg(figure)
        panels = figure.subplots(1, len(shapes), squeeze=False)[0]
        for axes, (caption, _), x, u in zip(panels, shapes, extents, horizontal, strict=True):
            flat = np.stack([x @ right, x @ film_mesh.axis], axis=1)
            depth = np.concatenate([x[g].mean(axis=1) @ towards for g in groups])
            values = np.concatenate([u[g].mean(axis=1) for g in groups])
            corners = [polygon for g in groups for polygon in flat[g]]
            order = np.argsort(depth)  # from back to front
            axes.add_collection(
                PolyCollection(
                    [corners[i] for i in order],
                    facecolors=colours(norm(values[order])),
                    edgecolors=(0, 0, 0, 0.35),
                    linewidths=0.15,
                    joinstyle="round",
                )
            )
            axes.set(xlim=(-1.02 * reach, 1.02 * reach), ylim=(low - 0.1, high + 0.1), aspect="equal")
            axes.set_axis_off()
            axes.set_title(caption)
        bar = figure.colorbar(
            ScalarMappable(norm, colours),
            ax=panels.tolist(),
            location="bottom",
            aspect=30,
            pad=0.01,
            ticks=ticks[::2].tolist(),
        )
        bar.set_label("horizontal displacement [m]")
        if title:
            # what leaves room below it: the layout puts it right on the captions
            figure.suptitle(f"{title}\n", fontsize=7.5, linespacing=0.6)
    return figure
