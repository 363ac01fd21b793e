"""Figures: eigenvalues against pressure, and mode shapes in side and top view.

Matplotlib is used through its objects: no window system is needed, no global state is touched.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from lobefem.errors import InputError
from lobefem.typing import Array, Axes
from lobefem.viz.film_mesh import FilmMesh, facing, gather
from lobefem.viz.style import COLOURS, MM, STYLE, UNITS
from lobefem.viz.views import Panel, blank, paint, window

if TYPE_CHECKING:
    from lobefem.stability.branch_following import Branch
    from lobefem.stability.linear_buckling import CriticalPressure
    from lobefem.stability.mode_records import Mode, Modes
    from lobefem.stability.nonlinear_buckling import CriticalPoint

__all__ = [
    "NOTE",
    "chosen_modes",
    "drawn_amplitude",
    "eigenvalue_curves",
    "mode_caption",
    "mode_panel",
    "mode_shapes",
    "spread_labels",
]

NOTE = "dotted: undeformed; blue: one meridian; displacements exaggerated"


# --- eigenvalues against pressure ---------------------------------------------------------------
def eigenvalue_curves(
    branches: Sequence[Branch],
    *,
    mass: str = "unit",
    title: str = "",
    critical: CriticalPressure | CriticalPoint | None = None,
    published: float | None = None,
    width: float = 85.0,
) -> Figure:
    """Eigenvalues against pressure (paper figs 13, 15, 17, 19). Needs no communication.

    Of local modes the lowest of each harmonic is drawn in full, the others as hairlines. A mode that is
    among the lowest at one pressure only is a point.

    Args:
        branches: of `lobefem.stability`, over two pressures or more.
        mass: "unit" or "nodal", for the unit.
        title: over the figure.
        critical: its crossing is marked, with the harmonic and the mesh it depends on.
        published: a crossing from elsewhere [Pa], shown as a thin vertical line.
        width: of the figure [mm].

    Raises:
        InputError: fewer than two pressures.
    """
    if len({float(p) for b in branches for p in b.pressures}) < 2:
        raise InputError("a curve needs branches over two pressures or more; add a pressure")
    last = max(float(b.pressures[-1]) for b in branches)
    low, high, log = _range(branches)
    with rc_context(STYLE):
        figure = Figure(figsize=(width * MM, 0.92 * width * MM), layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.add_subplot()
        if log:
            axes.set_yscale("log")
        else:
            axes.axhline(0.0, color="0.2", lw=0.7, zorder=1)
        axes.set(xlim=(0, 1.005 * last), ylim=(low, high), xlabel="pressure $p$ [Pa]")
        axes.set_ylabel(rf"eigenvalue $\lambda$ [{UNITS[mass]}], {mass} mass")
        axes.set_title(title, loc="left", pad=12 if published else 6)
        axes.spines[["top", "right"]].set_visible(False)
        # the many that leave the figure at once would only blacken its corner
        branches = [
            b
            for b in branches
            if b.values.min() < 0 or b.values[b.pressures >= 0.15 * last].min(initial=np.inf) <= high
        ]
        for b in branches:
            if _minor(b) and len(b.pressures) > 1:
                axes.plot(b.pressures, b.values, color=COLOURS["local"], lw=0.35, alpha=0.6)
            else:
                axes.plot(b.pressures, b.values, ".-", ms=2.5, lw=1.0, color=COLOURS[b.kind])
        if published is not None and published < last:
            axes.axvline(published, color="0.5", lw=0.7, ls=(0, (4, 3)), zorder=0)
            _note(axes, f"paper: {published:.0f} Pa", (published, 1), (0, 2), ("data", "axes fraction"))
        if critical is not None and critical.mode is not None and critical.pressure < last:
            _mark(axes, critical, critical.mode, low)
        _label_ends(figure, axes, branches, last, (low, high))
    return figure


def _range(branches: Sequence[Branch]) -> tuple[float, float, bool]:
    """Limits of the eigenvalues shown, and whether their axis is logarithmic.

    Where local modes fall, the lowest of them and the lowest twist are shown whole; where none does, the
    lowest five.
    """
    lowest = min(float(b.values.min()) for b in branches)
    falling = [b for b in branches if b.kind == "local" and b.values[-1] < b.values.max()]
    if not falling:
        tops = sorted(float(b.values.max()) for b in branches if not _minor(b))
        high = 1.3 * tops[min(4, len(tops) - 1)]
        if lowest > 0:
            return 0.6 * lowest, high, True
        high = max(high, -lowest)
        return 1.3 * lowest, high, False
    pressures = {float(p) for b in falling for p in b.pressures}
    envelope = [min(b.values[b.pressures == p].min(initial=np.inf) for b in falling) for p in pressures]
    twist = [float(b.values.max()) for b in branches if b.kind == "twist" and b.rank == 0]
    high = max(1.18 * max([*envelope, *twist]), -0.3 * lowest)
    return min(1.06 * lowest, -0.27 * high), high, False


def _minor(branch: Branch) -> bool:
    """True if a branch is one of the many local ones above the lowest of their harmonic."""
    return branch.kind == "local" and branch.rank > 0


def _note(axes: Axes, text: str, at: tuple[float, float], offset: tuple[float, float], coords: Any) -> None:
    axes.annotate(
        text,
        at,
        offset,
        coords,
        "offset points",
        ha="center",
        fontsize=6,
        color="0.35",
        annotation_clip=False,
    )


def _mark(axes: Axes, critical: CriticalPressure | CriticalPoint, mode: Mode, low: float) -> None:
    """A ring at the crossing, and a note in the corner below the zero line, which is empty."""
    where = ""
    if critical.divisions is not None:
        where = f"\non {critical.divisions[0]} × {critical.divisions[1]} divisions"
    axes.annotate(
        f"unstable from {critical.pressure:.0f} Pa\n({mode.kind}, n = {mode.harmonic}){where}",
        (critical.pressure, 0.0),
        xytext=(0.03 * axes.get_xlim()[1], 0.55 * low),
        va="center",
        fontsize=6.5,
        bbox={"fc": "white", "ec": "none", "pad": 0.8},
        arrowprops={"arrowstyle": "-", "lw": 0.6, "shrinkB": 2.5, "relpos": (1, 0.5)},
    )
    axes.plot(critical.pressure, 0.0, "o", ms=4.5, mfc="white", mec="black", mew=0.9, zorder=5)


def _label_ends(
    figure: Any, axes: Axes, branches: Sequence[Branch], last: float, limits: tuple[float, float]
) -> None:
    """Names at the right end of the curves, pushed apart; a local branch is named by its n only."""
    ends = [(float(b.values[-1]), b) for b in branches if b.pressures[-1] == last]
    ends = [(v, b) for v, b in ends if limits[0] < v < limits[1] and not _minor(b)]
    ends.sort(key=lambda end: end[0])
    texts = [
        axes.annotate(
            f"n = {b.harmonic}" if b.kind == "local" else b.name,
            (last, value),
            xytext=(9, 0),
            textcoords="offset points",
            va="center",
            fontsize=6,
            color=COLOURS[b.kind],
            annotation_clip=False,
            arrowprops={"arrowstyle": "-", "lw": 0.4, "color": COLOURS[b.kind], "shrinkA": 1, "shrinkB": 0},
        )
        for value, b in ends
    ]
    early = [  # one that leaves the lowest modes early is named where it does
        axes.annotate(
            b.name,
            (b.pressures[-1], b.values[-1]),
            xytext=(3, 0),
            textcoords="offset points",
            va="center",
            fontsize=6,
            color=COLOURS[b.kind],
            bbox={"fc": "white", "ec": "none", "pad": 0.5},
        )
        for b in branches
        if b.pressures[-1] < last and not _minor(b) and limits[0] < b.values[-1] < limits[1]
    ]
    if not texts and not early:
        return
    figure.draw_without_rendering()  # lays out; only then are the ends' places known
    for k, text in enumerate(early):  # but not where others are named already
        box = text.get_window_extent()
        text.set_visible(not any(t.get_visible() and box.overlaps(t.get_window_extent()) for t in early[:k]))
    if not texts:
        return
    figure.set_layout_engine("none")
    to_points = 72 / figure.dpi
    at = axes.transData.transform([(last, value) for value, _ in ends])[:, 1] * to_points
    wanted = spread_labels(at, 7.0, axes.bbox.y0 * to_points, axes.bbox.y1 * to_points)
    for text, offset in zip(texts, wanted - at, strict=True):
        text.xyann = (9, offset)


def spread_labels(y: Array, gap: float, bottom: float, top: float) -> Array:
    """Positions near to the ascending `y` that keep a gap and stay inside."""
    out = np.array(y, dtype=float)
    for _ in range(500):
        push = np.maximum(gap - np.diff(out), 0.0) / 2
        if not (push > 1e-3).any():
            break
        out[:-1] -= push
        out[1:] += push
        out = np.clip(out, bottom, top)
    return out


# --- mode shapes --------------------------------------------------------------------------------
def chosen_modes(modes: Modes, chosen: Sequence[int]) -> list[Mode]:
    """The modes of some indices.

    Raises:
        InputError: no mode, or one that is not there.
    """
    if not chosen or min(chosen) < 0 or max(chosen) >= len(modes):
        raise InputError(f"modes {list(chosen)} cannot be drawn; choose from 0 to {len(modes) - 1}")
    return [modes[i] for i in chosen]


def drawn_amplitude(kind: str, film_mesh: FilmMesh, field: npt.NDArray[Any], amplitude: float) -> float:
    """Factor [m] on a mode's displacement when drawn; local ones, folds of the skin, are smaller."""
    largest = float(np.linalg.norm(field, axis=1).max())  # less than 1 for the real part of a pair
    return amplitude * film_mesh.diameter * (0.7 if kind == "local" else 1.0) / largest


def mode_shapes(
    modes: Modes,
    chosen: Sequence[int],
    *,
    title: str = "",
    columns: int | None = None,
    amplitude: float = 0.09,
    width: float = 85.0,
) -> Figure | None:
    """Modes in side view and, below, top view, the undeformed shape dotted (paper figs 12 to 18).

    Hidden lines are removed by filling the film's faces from back to front. A side view looks across
    the plane in which the axis moves most; a meridian at its front is marked, to show a twist.

    Args:
        modes: of one state.
        chosen: indices of the modes drawn; captions number them from 1, as tables do.
        title: over the figure.
        columns: number of modes in a row, all by default.
        amplitude: largest displacement as a share of the balloon's diameter.
        width: of the figure [mm].

    Returns:
        the figure on rank 0, None elsewhere.

    Raises:
        InputError: no mode, or one that is not there.

    Collective.
    """
    picked = chosen_modes(modes, chosen)
    film_mesh = gather(modes.state.balloon, *(m.displacement for m in picked))
    if film_mesh is None:
        return None
    captions = [
        mode_caption(f"mode {i + 1}", mode.kind, mode.harmonic, mode.value.real, UNITS[modes.mass])
        for i, mode in zip(chosen, picked, strict=True)
    ]
    panels = [
        mode_panel(caption, mode.kind, film_mesh, field, amplitude)
        for caption, mode, field in zip(captions, picked, film_mesh.fields, strict=True)
    ]
    figure = blank()
    view = window(film_mesh, panels, 0.15 * amplitude)
    paint(
        figure, film_mesh, panels, view, title=title, columns=columns or len(picked), note=NOTE, width=width
    )
    return figure


def mode_caption(label: str, kind: str, harmonic: int, value: float, unit: str) -> str:
    """A mode's number as in tables, if there is one, its name and its eigenvalue, below each other."""
    number = (f"{value:.0f}" if abs(value) >= 1e4 else f"{value:.4g}").replace("-", "\N{MINUS SIGN}")
    return f"{label}\n{kind}, $n$ = {harmonic}\n$\\lambda$ = {number} {unit}".strip()


def mode_panel(
    caption: str,
    kind: str,
    film_mesh: FilmMesh,
    field: npt.NDArray[Any],
    amplitude: float = 0.09,
    phase: float = 0.0,
) -> Panel:
    """A mode, exaggerated.

    Args:
        caption: over it.
        kind: of the mode.
        film_mesh: the film.
        field: its displacement (nodes, 3), complex for a mode that turns as it swings.
        amplitude: largest displacement as a share of the balloon's diameter.
        phase: of the swing [rad]: the real part of field times e^(-i phase) is drawn.
    """
    factor = drawn_amplitude(kind, film_mesh, field, amplitude)
    moved = film_mesh.x + factor * (field * np.exp(-1j * phase)).real
    return Panel(caption, moved, facing(film_mesh, field.real))
