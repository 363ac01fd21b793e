"""Pictures of a report: side and top view of modes, and how steps and modes are called."""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from lobefem.io.run_reader import Run, Step
from lobefem.typing import Array
from lobefem.units import pascals
from lobefem.viz import pumpkin_modes
from lobefem.viz.film_mesh import FilmMesh, facing, film_mesh
from lobefem.viz.mode_figures import drawn_amplitude
from lobefem.viz.report_tables import pairs, stored_modes, waves
from lobefem.viz.style import MM, STYLE, UNITS
from lobefem.viz.views import Panel, draw

__all__ = [
    "AMPLITUDE", "Picture", "drawn", "film_of", "mode_name", "mode_number", "mode_pictures", "order", "png",
    "pressure_name", "step_name",
]  # fmt: skip

PICTURES = 16  # of modes in a report

AMPLITUDE = 0.09  # of a mode as drawn, over the diameter

_DPI = 130

_MANY = 8_000  # cells of which a picture takes a second


@dataclass(frozen=True)
class Picture:
    """A PNG and what it shows.

    Attributes:
        title: below the picture.
        alt: for those who do not see it.
        data: the PNG as base64.
        wide: True if it takes the whole width.
        step, mode: which mode it is, from 0; -1 of another picture.
    """

    title: str
    alt: str
    data: str = field(repr=False)
    wide: bool = False
    step: int = -1
    mode: int = -1


def png(figure: Figure) -> str:
    """A figure as base64 of a PNG."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=_DPI)
    return base64.b64encode(stream.getvalue()).decode()


def film_of(run: Run, *fields: Array) -> FilmMesh:
    """The film with its grid, if its mesh has one."""
    mesh = run.design.get("mesh")
    divisions = mesh.get("divisions") if isinstance(mesh, Mapping) and "gores" not in run.results else None
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
    n = mode.get("harmonic")
    if n is not None and mode.get("kind") not in ("sway", "twist"):  # which say it
        words.append(waves(n))
    if isinstance(mode.get("real"), float):
        unit = UNITS.get(str(run.results.get("mass", "unit")), "Pa/m")
        words.append(f"λ = {mode['real']:.4g} {unit}".replace("-", "\N{MINUS SIGN}"))
    elif "critical_pressure" in mode:
        words.append("critical")
    return ", ".join(words)


def mode_number(run: Run, step: int, k: int) -> int:
    """A stored mode's number in the table of eigenvalues, where not all of them may be stored."""
    number = stored_modes(run, step)[k].get("number")
    return number if isinstance(number, int) else k + 1


def pressure_name(step: Step) -> str:
    """A step's pressure."""
    return pascals(step.pressure)


def mode_pictures(run: Run, most: int = PICTURES) -> tuple[list[Picture], int]:
    """Side and top view of the stored modes, an equal pair once; and how many were left out.

    The highest pressures come first.
    """
    chosen = [(s, numbers) for s in order(run) for numbers, _ in pairs(stored_modes(run, s))]
    pictures = []
    most = most if len(run.corners) <= _MANY else min(most, 6)
    for s, numbers in chosen[:most]:
        k = numbers[0] - 1
        step, name = run.steps[s], mode_name(run, s, k)
        pair = " and ".join(str(mode_number(run, s, n - 1)) for n in numbers)
        title = f"Mode{'s' if numbers[1:] else ''} {pair} at {pressure_name(step)}: {name}"
        alt = f"{title}. Side view and top view of the deformed film over its dotted undeformed outline."
        data = _mode_picture(run, step, step.nodal[f"mode_{k + 1}"], name)
        pictures.append(Picture(title, alt, data, step=s, mode=k))
    return pictures, max(len(chosen) - most, 0)


def _panel(run: Run, film: FilmMesh, step: Step, mode: Array, name: str) -> Panel:
    """A stack grey with its lines; a pumpkin, whose lines would be too many, coloured."""
    if "gores" in run.results and mode.any():
        state = film.x + step.nodal.get("displacement", np.zeros_like(film.x))
        return pumpkin_modes.mode_panel("", name.split(",")[0], film, state, mode)
    return Panel("", film.x + drawn(film, mode, name) * mode, facing(film, mode))


def _mode_picture(run: Run, step: Step, mode: Array, name: str) -> str:
    film = film_of(run, mode)
    panel = _panel(run, film, step, mode, name)
    e1, e2 = panel.across
    reach, margin = film.diameter * (0.5 + 1.15 * AMPLITUDE), AMPLITUDE * film.diameter
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
            draw(axes, film, panel.shape, (e1, up, towards), 1, panel.values, panel.scale)
            axes.set(xlim=(-reach, reach), ylim=limits, aspect="equal")
        return png(figure)


def drawn(film: FilmMesh, mode: Array, name: str) -> float:
    """Factor [m] on a mode's displacement when drawn; a mode of nothing is damage, and drawn as such."""
    return drawn_amplitude(name.split(",")[0], film, mode, AMPLITUDE) if mode.any() else 0.0


def step_name(run: Run, index: int) -> str:
    """The name of a step within its run."""
    if run.results.get("command") == "perturb" and len(run.steps) > 1:
        return "distorted" if index == 0 else "released"
    return f"at {pressure_name(run.steps[index])}"


def order(run: Run) -> list[int]:
    """Steps as they are shown: the last pressure first, a perturbation as it went."""
    indices = list(range(len(run.steps)))
    return indices if run.results.get("command") == "perturb" else indices[::-1]
