"""Shapes of the film in side and top view, the undeformed one dotted (paper figs 12 to 18, 24).

Matplotlib is used through its objects: no window system is needed, no global state is touched.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.transforms import Affine2D

from lobefem.frozen import Frozen
from lobefem.typing import Array, Axes
from lobefem.viz.film_mesh import FilmMesh, normals, outline, polygons
from lobefem.viz.style import COLOURS, MM, REGIONS, STYLE

__all__ = ["Panel", "Scale", "Window", "blank", "draw", "paint", "window"]

_HEIGHT = 190.0  # of a figure, at most [mm]

_CELL = 42.0  # of a view's width, at most [mm]

_DOTTED: Any = {"color": COLOURS["twist"], "lw": 0.8, "ls": (0, (1, 1.4)), "zorder": 3}


@dataclass(frozen=True)
class Scale:
    """The meaning of colours; panels with the same scale share it.

    Attributes:
        label: of the colour bar.
        low, high: values at its ends.
        cmap: Matplotlib's name of the colour map, "" for slack, wrinkled and taut film (0, 1, 2).
        extend: ends beyond which there are values, "neither", "min", "max" or "both".
    """

    label: str = ""
    low: float = 0.0
    high: float = 1.0
    cmap: str = "cividis"
    extend: str = "neither"

    def mappable(self) -> Any:
        """Values to colours, for Matplotlib."""
        if self.cmap:
            return ScalarMappable(Normalize(self.low, self.high), self.cmap)
        return ScalarMappable(Normalize(-0.5, 2.5), ListedColormap(list(REGIONS.values())))


@dataclass(frozen=True)
class Panel(Frozen):
    """One shape with its caption, drawn in both views.

    Attributes:
        caption: over it.
        shape: node positions as drawn (nodes, 3) [m].
        across: unit vectors across the axis: to the right in both views, and away in the side view.
        values: what is coloured, of each node or of each cell; None for a grey shape.
        scale: of the colours.
    """

    caption: str
    shape: Array = field(repr=False)
    across: tuple[Array, Array] = field(repr=False)
    values: Array | None = field(default=None, repr=False)
    scale: Scale | None = None


@dataclass(frozen=True)
class Window:
    """The extent of a view, the same in all panels and frames.

    Attributes:
        reach: half the width of both views, and half the height of the top view [m].
        low, high: heights in the side view [m].
    """

    reach: float
    low: float
    high: float

    @property
    def side(self) -> float:
        """Height of the side view over its width."""
        return (self.high - self.low) / (2 * self.reach)


def window(film_mesh: FilmMesh, panels: Sequence[Panel], margin: float = 0.04) -> Window:
    """The extent that holds all the panels and the undeformed shape.

    Args:
        film_mesh: the film.
        panels: all that are drawn.
        margin: around, as a share of the diameter.
    """
    shapes = [(film_mesh.x, panel.across) for panel in panels] + [(p.shape, p.across) for p in panels]
    reach = max(float(np.abs(np.stack([x @ e for e in across])).max()) for x, across in shapes)
    heights = [x @ film_mesh.axis for x, _ in shapes]
    extra = margin * film_mesh.diameter
    low, high = min(h.min() for h in heights), max(h.max() for h in heights)
    return Window(reach + extra, float(low) - extra, float(high) + extra)


def blank() -> Figure:
    """A figure to paint on."""
    figure = Figure(dpi=STYLE["savefig.dpi"])
    FigureCanvasAgg(figure)
    return figure


def paint(
    figure: Figure,
    film_mesh: FilmMesh,
    panels: Sequence[Panel],
    view: Window,
    *,
    title: str = "",
    columns: int | None = None,
    note: str = "dotted: undeformed",
    width: float = 85.0,
) -> None:
    """Draw panels in rows, each a side view and below it a top view; of a single one both beside each other.

    Hidden faces are painted over, from back to front.

    Args:
        figure: from `blank`; what was on it goes.
        film_mesh: the film.
        panels: what to draw.
        view: what all views show.
        title: over the figure.
        columns: panels in a row, by default at most four at 85 mm, and as many as fit in wider figures.
        note: below the figure.
        width: of the figure [mm].
    """
    rows = -(-len(panels) // (columns or max(int(width // 21), 1)))
    columns = columns or -(-len(panels) // rows)
    scales = list(dict.fromkeys(panel.scale for panel in panels if panel.scale is not None))
    # heights on paper [mm]
    head, foot = (6.0 if title else 1.0), 4.0 + (10.0 if scales else 0.0)
    label = 4.0 + 3.0 * max(panel.caption.count("\n") for panel in panels)
    alone = len(panels) == 1
    tall = view.side if alone else view.side + 1
    room = (_HEIGHT - head - foot) / rows - label
    cell = min(width / (2 if alone else columns), _CELL if not alone else 0.7 * _CELL, room / tall)
    row_height = label + cell * max(tall, 1.0 if alone else tall)
    total = head + rows * row_height + foot
    with rc_context(STYLE):
        figure.clear()
        figure.set_size_inches(width * MM, total * MM)
        # a letter is about half as wide as high: no longer than the figure
        size = min(7.5, 5.0 * width / max(len(title), 1))
        figure.text(0.5, 1 - 1.5 / total, title, ha="center", va="top", fontsize=size)
        paper = figure.add_axes((0, 0, 1, 1), xlim=(0, width), ylim=(0, total))  # in mm; one is fast
        paper.set_axis_off()
        pitch = width / columns
        around = 0 if film_mesh.grid is None else film_mesh.grid.shape[1]
        step = 2 if around >= (64 if cell > 20 else 32) else 1  # finer lines would run into each other
        captions = []
        for k, panel in enumerate(panels):
            row, column = divmod(k, columns)
            top = total - head - row * row_height
            middle = (column + 0.5) * pitch
            captions.append(figure.text(middle / width, top / total, panel.caption, ha="center", va="top"))
            top -= label
            left = middle - cell / 2 if not alone else middle - cell
            places = [(left, top - cell * view.side), (left, top - cell * tall)]
            if alone:
                places[0] = (left, top - cell * (max(view.side, 1.0) + view.side) / 2)
                places[1] = (left + cell, top - cell * (max(view.side, 1.0) + 1) / 2)
            e1, e2 = panel.across
            views = ((film_mesh.axis, -e2, view.low), (e2, film_mesh.axis, -view.reach))
            for (x, y), (up, towards, bottom) in zip(places, views, strict=True):
                put = Affine2D().translate(view.reach, -bottom).scale(cell / (2 * view.reach)).translate(x, y)
                place = put + paper.transData
                draw(paper, film_mesh, panel.shape, (e1, up, towards), step, panel.values, panel.scale, place)
        # neighbours' captions must not touch
        widest = max(caption.get_window_extent().width for caption in captions) / figure.dpi / MM
        for caption in captions if widest > 0.94 * pitch else ():
            caption.set_fontsize(float(caption.get_fontsize()) * 0.94 * pitch / widest)
        for scale in scales:
            held = [k % columns for k, panel in enumerate(panels) if panel.scale == scale]
            middle = (min(held) + max(held) + 1) / 2 * pitch
            _key(figure, scale, middle / width, min(0.8 * pitch * len(set(held)), 50.0) / width, total)
        figure.text(0.5, 0.6 / total, note, ha="center", va="bottom", fontsize=5.5, color="0.35")


def _key(figure: Figure, scale: Scale, middle: float, wide: float, total: float) -> None:
    """A colour bar, or the names of the colours."""
    if not scale.cmap:
        patches = [Patch(color=colour, label=name) for name, colour in REGIONS.items()]
        figure.legend(
            handles=patches, loc="center", bbox_to_anchor=(middle, 9.0 / total), frameon=False, fontsize=6,
            handlelength=1.0, handleheight=1.0, labelspacing=0.15, borderpad=0,
        )  # fmt: skip
        return
    axes = figure.add_axes((middle - wide / 2, 11.2 / total, wide, 1.8 / total))
    bar = figure.colorbar(scale.mappable(), cax=axes, orientation="horizontal", extend=scale.extend)
    bar.set_label(scale.label, fontsize=6.5, labelpad=1)
    bar.ax.tick_params(labelsize=6, length=1.5, width=0.5, pad=1)
    bar.outline.set_linewidth(0.5)  # type: ignore[operator]


def draw(
    axes: Axes,
    film_mesh: FilmMesh,
    shape: Array,
    view: tuple[Array, Array, Array],
    step: int,
    values: Array | None = None,
    scale: Scale | None = None,
    place: Any = None,
) -> None:
    """One view of a shape, the undeformed one dotted over it.

    Args:
        axes: Matplotlib's.
        film_mesh: the film.
        shape: node positions as drawn (nodes, 3) [m].
        view: unit vectors to the right, up and towards the viewer.
        step: cells along each side of a face that is drawn.
        values: what is coloured, of each node or of each cell; None for a grey shape.
        scale: of the colours.
        place: Matplotlib's transform from metres to where the view is, by default that of the axes.
    """
    place = axes.transData if place is None else place
    right, up, towards = view
    flat = np.stack([shape @ right, shape @ up], axis=1)
    groups = polygons(film_mesh, step)
    cellwise = values is not None and len(values) == len(film_mesh.faces)
    if cellwise:
        groups[0] = film_mesh.faces
    order = np.argsort(np.concatenate([shape[g].mean(axis=1) @ towards for g in groups]))
    corners = [polygon for g in groups for polygon in flat[g]]
    if values is None or scale is None:
        lit = np.concatenate([normals(shape[g]) for g in groups])
        lit = lit @ (0.75 * towards + 0.25 * up + 0.45 * right)
        colours = np.repeat(np.clip(0.80 + 0.20 * np.abs(lit), 0, 1)[:, None], 4, axis=1)
        colours[:, 3] = 1.0
        edges: Any = "0.3"
    else:
        film = values if cellwise else values[groups[0]].mean(axis=1)
        colours = np.full((len(corners), 4), (0.88, 0.88, 0.88, 1.0))
        colours[: len(film)] = scale.mappable().to_rgba(film)
        edges = colours[order] if cellwise else (0.2, 0.2, 0.2, 0.35)
    faces = PolyCollection(
        [corners[i] for i in order],
        facecolors=colours[order],
        edgecolors=edges,
        linewidths=0.2,
        joinstyle="round",
        transform=place,
    )
    axes.add_collection(faces, autolim=False)
    dotted = _DOTTED | {"transform": place}
    _undeformed(axes, film_mesh, view, dotted)
    if film_mesh.grid is not None and values is None:
        from_above = bool(abs(towards @ film_mesh.axis) > 0.5)
        meridian = _meridian(film_mesh, -up if from_above else towards, from_above)
        axes.plot(*flat[meridian].T, color=COLOURS["sway"], lw=1.0, zorder=2, transform=place)
        axes.plot(film_mesh.x[meridian] @ right, film_mesh.x[meridian] @ up, **dotted)


def _undeformed(
    axes: Axes, film_mesh: FilmMesh, view: tuple[Array, Array, Array], dotted: dict[str, Any]
) -> None:
    z, r = outline(film_mesh)
    if abs(view[2] @ film_mesh.axis) > 0.5:
        angle = np.linspace(0, 2 * np.pi, 181)
        for radius in (r.max(), r[-1]):
            axes.plot(radius * np.cos(angle), radius * np.sin(angle), **dotted)
        return
    for x, y in ((r, z), (-r, z), (r[[0, 0]] * [-1, 1], z[[0, 0]]), (r[[-1, -1]] * [-1, 1], z[[-1, -1]])):
        axes.plot(x, y, **dotted)


def _meridian(film_mesh: FilmMesh, front: Array, from_above: bool) -> npt.NDArray[np.int64]:
    """Nodes of the meridian at the front; from above only what is above the topmost equator is seen."""
    assert film_mesh.grid is not None
    meridian = film_mesh.grid[:, np.argmax(film_mesh.x[film_mesh.grid[0]] @ front)]
    if from_above:
        _, r = outline(film_mesh)
        meridian = meridian[len(r) - 1 - int(np.argmax(np.diff(r[::-1]) < 0)) :]
    return meridian
