"""The picture of docs/start.md that names the parts of balloons: python docs/parts/parts_of_a_balloon.py."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

sys.path.insert(0, str(Path(__file__).parents[2]))

from lobefem.geometry.isotensoid import Isotensoid
from lobefem.geometry.pumpkin_curve import PumpkinCurve
from lobefem.viz.style import COLOURS, MM, STYLE

FILM, INK = "#cfe3f2", "#1b1f24"


def picture() -> Figure:
    """Both balloons in section and view, with the names of their parts."""
    with rc_context(STYLE):
        figure = Figure(figsize=(170 * MM, 76 * MM), facecolor="white")
        FigureCanvasAgg(figure)
        stack, pumpkin = figure.subplots(1, 2, width_ratios=(1.0, 1.25))
        for axes in (stack, pumpkin):
            axes.set_aspect("equal")
            axes.set_axis_off()
        _stack(stack)
        _pumpkin(pumpkin)
        figure.subplots_adjust(left=0.0, right=1.0, bottom=0.01, top=0.93, wspace=0.0)
        return figure


def _name(axes: Any, text: str, at: tuple[float, float], words: tuple[float, float]) -> None:
    left = words[0] > at[0]
    axes.annotate(
        text, at, words, va="center", ha="left" if left else "right", fontsize=7.5, color=INK,
        arrowprops={"arrowstyle": "-", "lw": 0.6, "color": INK, "shrinkA": 1, "shrinkB": 0},
    )  # fmt: skip


def _stack(axes: Any) -> None:
    lobe, lobes = Isotensoid.from_edge_radius(2.0, 0.55), 3
    half = 0.55 * lobe.R0
    s = lobe.stations(120)
    z, r = lobe.z(s), lobe.radius(s)
    edge, equator = float(r[0]), float(r.max())
    for k in range(lobes):
        up = 2 * half * k
        axes.fill(np.concatenate([r, -r[::-1]]), np.concatenate([z, z[::-1]]) + up, color=FILM, lw=0)
        for sign in (-1, 1):
            axes.plot(sign * r, z + up, color=COLOURS["sway"], lw=1.4)
        if k:
            axes.plot([-edge, edge], [up - half] * 2, color=COLOURS["twist"], lw=2.2)
    top = 2 * half * lobes - half
    for height in (-half, top):
        axes.plot([-edge, edge], [height] * 2, color="#5b6167", lw=4, solid_capstyle="butt")
    axes.plot([0, 0], [-half, top], color="#5b6167", lw=1.6, ls=(0, (5, 1.5)))
    middle = 2 * half
    axes.annotate(
        "", (equator, middle), (0, middle), arrowprops={"arrowstyle": "<->", "lw": 0.7, "color": INK}
    )
    axes.text(0.55 * equator, middle + 0.15, "$R_0$", fontsize=8, ha="center")
    out = equator + 0.9
    _name(axes, "lobe (film)", (float(r[30]), z[30] + 4 * half), (out, 4 * half - 0.7))
    _name(axes, "hoop on a seam", (edge, half + 2 * half), (out, 3 * half))
    _name(axes, "seam", (edge, half), (out, half))
    _name(axes, "plate", (edge, top), (out, top))
    _name(axes, "bar", (0, -0.2 * half), (out, -0.2 * half))
    side = -equator - 0.6
    axes.annotate("", (side, half), (side, 0), arrowprops={"arrowstyle": "<->", "lw": 0.7, "color": INK})
    axes.text(side - 0.2, half / 2, "truncation\n$\\times R_0$", fontsize=7.5, ha="right", va="center")
    for height in (0, half):
        axes.plot([side - 0.1, -0.2], [height] * 2, color=INK, lw=0.4, ls=":")
    axes.set(xlim=(-8.0, 9.0), ylim=(-half - 0.5, top + 0.5))
    axes.set_title("a stack of three lobes, in section", fontsize=8.5)


def _pumpkin(axes: Any) -> None:
    curve, gores = PumpkinCurve(5.0, 0.25), 24
    s = np.linspace(0, curve.arc_length, 161)
    r, z = curve.radius(s), curve.z(s)
    bulge = 1.0 + 0.035
    view = 0.32  # sine of the angle from which it is seen
    z = z - z.mean()
    angles = (np.arange(gores) + 0.5) * 2 * np.pi / gores

    dr, dz = curve.slope(s)

    def faces(angle: float) -> Any:
        """Mask of a meridian on the side that is seen."""
        return dz * np.cos(angle) * np.sqrt(1 - view**2) - dr * view > 0

    def seen(radius: Any, angle: Any, height: Any) -> tuple[Any, Any]:
        return radius * np.sin(angle), height * np.sqrt(1 - view**2) - radius * np.cos(angle) * view

    for angle in sorted(angles, key=np.cos):
        left, right = angle - np.pi / gores, angle + np.pi / gores
        edge = [seen(r, left, z), seen(r, right, z)]
        x = np.concatenate([edge[0][0], edge[1][0][::-1]])
        y = np.concatenate([edge[0][1], edge[1][1][::-1]])
        shade = 0.72 + 0.28 * max(np.cos(angle - 0.5), 0)
        axes.fill(x, y, color=tuple(np.array([0.81, 0.89, 0.95]) * shade), lw=0)
        middle = seen(r * bulge, angle, z)
        axes.plot(*(np.where(faces(angle), one, np.nan) for one in middle), color="white", lw=0.5, alpha=0.7)
        for tendon in (left, right):
            shown = np.where(faces(tendon), z, np.nan)
            axes.plot(*seen(r, tendon, shown), color=COLOURS["twist"], lw=1.1)
    turn = np.linspace(0, 2 * np.pi, 61)
    axes.fill(*seen(4 * r[-1], turn, z[-1]), color="#5b6167", lw=0)
    front = angles[np.argmax(np.cos(angles))]
    _name(axes, "fitting", tuple(np.ravel(seen(2 * r[-1], np.pi / 2, z[-1]))), (3.6, 4.6))
    _name(axes, "tendon", tuple(np.ravel(seen(r[95], front + np.pi / gores, z[95]))), (6.2, 2.4))
    _name(
        axes,
        "gore (film)",
        tuple(np.ravel(seen(r[80] * bulge, front + 2 * np.pi / gores, z[80]))),
        (6.2, 0.4),
    )
    _name(axes, "bulge", tuple(np.ravel(seen(r[70], np.pi / 2, z[70]))), (6.2, -1.7))
    axes.set(xlim=(-5.6, 10.4), ylim=(-5.0, 5.4))
    axes.set_title("a pumpkin", fontsize=8.5)


if __name__ == "__main__":
    picture().savefig(Path(__file__).parents[1] / "pictures" / "parts.png", dpi=200)
