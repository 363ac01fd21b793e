"""Pictures of what a run folder holds: shapes, modes, stress, curves, and motion as GIF or MP4.

Only the folder is read: nothing is solved, and DOLFINx is not needed but for charts of harmonics and meshes.
"""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import animation
from matplotlib.figure import Figure

from lobefem.errors import InputError
from lobefem.files import replacing
from lobefem.io.run_reader import Run, Step, load_run
from lobefem.outcomes import UNKNOWN
from lobefem.typing import Array
from lobefem.units import pascals
from lobefem.viz import mode_figures, pumpkin_modes, pumpkin_pictures
from lobefem.viz.film_mesh import FilmMesh, facing, film_mesh
from lobefem.viz.frames import Frames, load_frames
from lobefem.viz.study_figures import curves
from lobefem.viz.style import UNITS
from lobefem.viz.views import Panel, Scale, blank, paint, window

__all__ = ["FORMATS", "WHATS", "Picture", "held", "picture", "save_picture"]

WHATS = ("modes", "stress", "state", "curves", "release")

FORMATS = ("png", "svg", "gif", "mp4")

_SWING = 24  # frames of a period

_RATE = 15  # frames a second

_STRIP = 6  # shapes of a motion on paper


@dataclass(frozen=True)
class Picture:
    """The content of a picture.

    Attributes:
        figure: makes it, for PNG and SVG.
        frames: each paints one frame of its motion on a figure, for GIF and MP4; none where it has no motion.
    """

    figure: Callable[[], Figure]
    frames: tuple[Callable[[Figure], None], ...] = ()


def save_picture(
    folder: str | Path,
    what: str,
    path: str | Path | None = None,
    format: str | None = None,  # noqa: A002  Matplotlib's name
    *,
    pressure: float | None = None,
    modes: Sequence[int] | None = None,
    width: float = 85.0,
) -> Path:
    """Draw what a run folder holds; the picture appears complete or not at all. Needs no communication.

    Args:
        folder: of a run.
        what: "modes", "stress", "state", "curves" or "release".
        path: of the picture, by default what.FORMAT in the folder.
        format: "png", "svg", "gif" or "mp4"; by default the path's suffix, or png.
        pressure: which of a run's pressures [Pa], by default the last one.
        modes: which, from 1; by default all, but one of each pair.
        width: of the picture [mm]: 85 for one column, 170 for two.

    Returns:
        the picture's path.

    Raises:
        InputError: something that the folder does not hold, a format that it cannot have, or a place that
            cannot be written to.
    """
    run = load_run(folder)
    suffix = (format or (Path(path).suffix[1:] if path is not None else "png")).lower()
    if suffix not in FORMATS:
        raise InputError(f"format '{suffix}' is unknown; use {', '.join(FORMATS)}")
    path = Path(path) if path is not None else run.path / f"{what}.{suffix}"
    if not (math.isfinite(width) and 20 <= width <= 1000):
        raise InputError(f"width = {width} mm is no width of a picture; give 85, or 170 for two columns")
    try:
        drawn = picture(run, what, pressure=pressure, modes=modes, width=width)
        if suffix not in ("png", "svg") and not drawn.frames:
            raise InputError(f"{what} of '{folder}' has no motion; use png or svg")
        with _fitting(run):
            if suffix in ("png", "svg"):
                with replacing(path) as stream:
                    drawn.figure().savefig(stream, format=suffix)
            else:
                _animate(drawn.frames, path, suffix)
    except OSError as error:
        raise InputError(f"'{path}': {error.strerror or error}; give another place") from None
    return path


def picture(
    run: Run,
    what: str,
    *,
    pressure: float | None = None,
    modes: Sequence[int] | None = None,
    width: float = 85.0,
) -> Picture:
    """The picture that `save_picture` saves; the arguments are the same.

    Raises:
        InputError: something that the run does not hold.
    """
    if what not in WHATS:
        raise InputError(f"'{what}' is unknown; use {', '.join(WHATS)}")
    if modes is not None and what != "modes":
        raise InputError(f"--mode is of modes, not of {what}; leave it out")
    if pressure is not None and what in ("curves", "release"):
        raise InputError(f"{what} are of all pressures; leave --pressure out")
    if "gores" in run.results and what == "stress" and not pumpkin_pictures.is_inflated_pumpkin(run):
        raise InputError(
            f"lobefem plot draws the stress of pumpkins that lobefem inflate has found; open "
            f"'{run.path}/fields.xdmf' in ParaView, or use lobefem report"
        )
    holds = held(run)
    if what not in holds:
        if run.faults:
            raise InputError(f"'{run.path}' holds no {what}: {run.faults[0]}")
        instead = f"it holds {', '.join(holds)}" if holds else "nor anything else to draw"
        raise InputError(f"'{run.path}' holds no {what}; {instead}")
    with _fitting(run):
        if what == "curves" and run.results.get("stations"):
            return Picture(lambda: pumpkin_pictures.station_curves(run, width))
        if what == "curves":
            return Picture(lambda: curves(run, width))
        if what == "release":
            return _release(run, width)
        step = _step(run, pressure)
        if what == "modes":
            with_modes = [k for k, one in enumerate(run.steps) if one.num_modes]
            if pressure is None:  # a run that failed ends with a state without modes
                step = with_modes[-1]
            elif step not in with_modes:
                there = ", ".join(f"{run.steps[k].pressure:g}" for k in with_modes)
                raise InputError(f"'{run.path}' holds no modes at {pressure:g} Pa; it does at {there} Pa")
            return _modes(run, step, modes, width)
        if "gores" in run.results:
            of_gores = pumpkin_pictures.gore_map if what == "stress" else pumpkin_pictures.portrait
            return Picture(lambda: of_gores(run, run.steps[step], width))
        draw = _stress if what == "stress" else _state
        return draw(run, step, pressure, width)


@contextmanager
def _fitting(run: Run) -> Iterator[None]:
    """A folder's files are anyone's: what they lack or hold too much of is bad input."""
    try:
        yield
    except InputError:
        raise
    except (AttributeError, KeyError, TypeError, ValueError, IndexError) as error:
        raise InputError(
            f"the files in '{run.path}' do not fit each other ({type(error).__name__}: {error}); run it again"
        ) from None


def held(run: Run) -> tuple[str, ...]:
    """The members of `WHATS` that a run holds."""
    results = run.results
    found = {
        "modes": any(step.num_modes for step in run.steps)
        and results.get("command") in ("modes", "critical", *(("harmonics",) if "gores" in results else ())),
        "stress": any("stress_resultants" in step.cells for step in run.steps),
        "state": any("displacement" in step.nodal for step in run.steps),
        "curves": any(
            results.get(key) for key in ("branches", "visited", "chart", "meshes", "history", "stations")
        )
        or ("gores" in results and results.get("command") == "modes"),
        "release": bool(results.get("history")) and (run.path / "frames" / "mesh.npz").is_file(),
    }
    return tuple(what for what in WHATS if found[what])


def _step(run: Run, pressure: float | None) -> int:
    """The number of the step at a pressure."""
    if pressure is None:
        return len(run.steps) - 1
    found = [k for k, step in enumerate(run.steps) if math.isclose(step.pressure, pressure, rel_tol=1e-6)]
    if not found:
        there = ", ".join(f"{step.pressure:g}" for step in run.steps)
        raise InputError(f"'{run.path}' holds nothing at {pressure:g} Pa; it holds {there} Pa")
    return found[-1]


def _film(run: Run) -> FilmMesh:
    mesh = run.design["mesh"]
    # all gores of a pumpkin are no grid
    divisions = None if "gores" in run.results else mesh.get("divisions")
    return film_mesh(
        run.x, run.corners, (0.0, 0.0, 1.0), divisions[1] * mesh.get("order", 1) if divisions else 0
    )


def _title(run: Run, step: Step) -> str:
    results = run.results
    lobes = "1 lobe" if results["lobes"] == 1 else f"{results['lobes']} lobes"
    lobes = f"{results['gores']} gores" if "gores" in results else lobes
    what = f"{results['film'].replace('-', ' ')} film"
    if results["command"] == "perturb":
        what = f"{results['distortion']} of {results['parameter']:g} {results['unit']}"
    return f"{lobes}, {what}, {pascals(step.pressure)}"


def _still(
    film: FilmMesh, panels: Sequence[Panel], title: str, width: float, **options: Any
) -> Callable[[], Figure]:
    def draw() -> Figure:
        figure = blank()
        paint(figure, film, panels, window(film, panels), title=title, width=width, **options)
        return figure

    return draw


# --- modes --------------------------------------------------------------------------------------
def _modes(run: Run, number: int, chosen: Sequence[int] | None, width: float) -> Picture:
    step, film, results = run.steps[number], _film(run), run.results
    told: list[dict[str, Any]]
    if results["command"] == "modes":
        told = results["pressures"][number]["modes"]
    else:
        told = [{"kind": results["kind"], "harmonic": results["harmonic"], "real": 0.0, "imag": 0.0}]
    if chosen is None:
        chosen = _one_of_each(told)
    if not chosen or not 1 <= min(chosen) <= max(chosen) <= step.num_modes:
        raise InputError(f"modes {list(chosen)} are not in '{run.path}'; choose from 1 to {step.num_modes}")
    unit = UNITS[results.get("mass", "unit")]
    shown: list[tuple[str, str, Any]] = []
    for k in chosen:
        mode = told[k - 1]
        label = f"mode {k}" if results["command"] == "modes" else ""
        caption = mode_figures.mode_caption(label, mode["kind"], mode["harmonic"], mode["real"], unit)
        field = step.nodal[f"mode_{k}"] + 1j * step.nodal.get(f"mode_{k}_imag", 0.0)
        shown.append((caption, mode["kind"], field))

    def panels(phase: float) -> list[Panel]:
        if "gores" in results:
            state = _moved(run, step)
            return [pumpkin_modes.mode_panel(c, kind, film, state, f, phase=phase) for c, kind, f in shown]
        return [mode_figures.mode_panel(c, kind, film, field, phase=phase) for c, kind, field in shown]

    extremes = window(film, [*panels(0.0), *panels(math.pi / 2), *panels(math.pi), *panels(-math.pi / 2)])
    title = _title(run, step)
    exaggerated = "dotted: as designed; displacements exaggerated"
    note = exaggerated if "gores" in results else mode_figures.NOTE

    def at(phase: float) -> Callable[[Figure], None]:
        def draw(figure: Figure) -> None:
            paint(figure, film, panels(phase), extremes, title=title, note=note, width=width)

        return draw

    swing = tuple(at(2 * math.pi * k / _SWING) for k in range(_SWING))
    return Picture(_still(film, panels(0.0), title, width, note=note), swing)


def _one_of_each(modes: Sequence[dict[str, Any]]) -> list[int]:
    """Numbers from 1 of modes, of which the second of a pair is left out."""
    chosen: list[int] = []
    for k, mode in enumerate(modes, 1):
        before = modes[chosen[-1] - 1] if chosen else None
        pair = before is not None and (before["kind"], before["harmonic"]) == (mode["kind"], mode["harmonic"])
        if not (pair and math.isclose(before["real"], mode["real"], rel_tol=1e-5)):  # type: ignore[index]
            chosen.append(k)
    return chosen


# --- states -------------------------------------------------------------------------------------
def _moved(run: Run, step: Step) -> Array:
    moved = step.nodal.get("displacement")
    return run.x if moved is None else run.x + moved


def _stress(run: Run, number: int, pressure: float | None, width: float) -> Picture:
    """Stress resultants on one scale, and taut, wrinkled and slack film; a row each state."""
    film, chosen = _film(run), _states(run, number, pressure)
    steps = [step for _, step in chosen]
    if not all("stress_resultants" in step.cells for step in steps):
        raise InputError(f"'{run.path}' holds no stress at {steps[-1].pressure:g} Pa; give another pressure")
    scale = _shared("stress resultant [N/m]", np.concatenate([s.cells["stress_resultants"] for s in steps]))
    panels = []
    for name, step in chosen:
        shape, resultants = _moved(run, step), step.cells["stress_resultants"]
        across, first = facing(film, shape - film.x), f"{name}\n" if len(chosen) > 1 else ""
        for k, what in enumerate(("meridional, $N_m$", "hoop, $N_h$")):
            panels.append(Panel(first + what, shape, across, resultants[:, k], scale))
        if "regions" in step.cells:
            state = (2 - np.argmax(step.cells["regions"], axis=1)).astype(np.float64)
            panels.append(Panel(first + "state of the film", shape, across, state, Scale(cmap="")))
    columns = len(panels) // len(chosen)
    return Picture(_still(film, panels, _title(run, steps[-1]), width, columns=columns))


def _states(run: Run, number: int, pressure: float | None) -> list[tuple[str, Step]]:
    """The states of a picture with their names: of a perturbation the distorted and the released one."""
    results = run.results
    if results["command"] != "perturb" or pressure is not None:
        return [("", run.steps[number])]
    # of a run that was stopped and went on in the release, the distorted state is not there
    at_rest = results.get("min_eigenvalue") is not None or results.get("outcome") == UNKNOWN
    released = bool(results["release"]) and at_rest
    names = ["distorted", *(["released"] if released else [])]
    return list(zip(names[-len(run.steps) :], run.steps, strict=True))


def _shared(label: str, resultants: Array) -> Scale:
    """One scale for N_m and N_h: from zero, or about it where both signs occur. Rare extremes are cut off."""
    values = resultants[:, :2]
    low, high = (float(v) for v in np.percentile(values, [2, 98]))
    two_sided = -low > 0.02 * high
    high = max(-low, high) if two_sided else high or 1.0
    low = -high if two_sided else 0.0
    beyond = (bool(values.min() < low - 0.02 * high), bool(values.max() > 1.02 * high))
    extend = {(True, True): "both", (True, False): "min", (False, True): "max"}.get(beyond, "neither")
    return Scale(label, low, high, "PuOr_r" if two_sided else "cividis", extend)


def _state(run: Run, number: int, pressure: float | None, width: float) -> Picture:
    """The shape true to scale."""
    film, chosen = _film(run), _states(run, number, pressure)
    fields = [step.nodal["displacement"] for _, step in chosen]
    panels = _displaced(film, fields, [name for name, _ in chosen])
    return Picture(_still(film, panels, _title(run, chosen[-1][1]), width))


def _displaced(film: FilmMesh, fields: Sequence[Array], names: Sequence[str]) -> list[Panel]:
    """Shapes true to scale, coloured by displacement on one scale."""
    sizes: list[Array] = [np.sqrt((field**2).sum(axis=1)) for field in fields]
    largest = max(float(size.max()) for size in sizes)
    across = facing(film, fields[int(np.argmax([size.max() for size in sizes]))])
    if largest == 0:
        return [Panel(f"{name}\nas designed".strip(), film.x, across) for name in names]
    unit, factor = ("m", 1.0) if largest >= 0.1 else ("mm", 1e3)
    scale = Scale(f"displacement [{unit}]", 0.0, factor * largest)
    return [
        Panel(name, film.x + field, across, factor * size, scale)
        for name, field, size in zip(names, fields, sizes, strict=True)
    ]


# --- motion -------------------------------------------------------------------------------------
def _release(run: Run, width: float) -> Picture:
    frames = load_frames(run.path)
    assert frames is not None  # `held` has seen it
    film = frames.film_mesh
    names = [_moment(run, point) for point in frames.points]
    panels = _displaced(film, frames.displacements, names)
    view = window(film, panels)
    title = f"{run.results['distortion']} of {run.results['parameter']:g} {run.results['unit']}".capitalize()
    if run.results["release"]:
        title += f", let go: {run.results.get('outcome', 'stopped')}"

    def of(panel: Panel) -> Callable[[Figure], None]:
        return lambda figure: paint(figure, film, [panel], view, title=title, width=width)

    ramp = sum(point["time"] is None for point in run.results["history"]) - 1
    still = _still(film, [panels[k] for k in _strip(frames, ramp)], title, width)
    # the end stays for half a second
    return Picture(still, tuple(of(panel) for panel in [*panels, *[panels[-1]] * (_RATE // 2)]))


def _moment(run: Run, point: int) -> str:
    history, results = run.results["history"], run.results
    if point == len(history) - 1 and history[point]["time"] is not None:
        return "released\nat rest"
    if history[point]["time"] is None:
        return f"imposed\n{history[point]['parameter']:.3g} {results['unit']}"
    return f"released\n{history[point]['time']:.2g} s"


def _strip(frames: Frames, ramp: int) -> list[int]:
    """Shapes that tell the motion: equal steps of the way that the film goes, and its turning points."""
    moved = [
        float(np.linalg.norm(b - a, axis=1).max())
        for a, b in zip(frames.displacements, frames.displacements[1:], strict=False)
    ]
    way = np.concatenate([[0.0], np.cumsum(moved)])
    wanted = np.linspace(0.0, way[-1], min(_STRIP, len(way)))
    chosen = [int(np.abs(way - w).argmin()) for w in wanted[:-1]]
    if ramp in frames.points:  # instead of the shape nearest to it
        turn = frames.points.index(ramp)
        chosen[int(np.abs(np.array(chosen) - turn).argmin())] = turn
    return sorted({*chosen, len(way) - 1})


def _animate(frames: Sequence[Callable[[Figure], None]], path: Path, suffix: str) -> None:
    """Frames as GIF by Pillow, or as MP4 by ffmpeg."""
    writer: Any = animation.PillowWriter(fps=_RATE)
    if suffix == "mp4":
        if not animation.FFMpegWriter.isAvailable():
            raise InputError("an MP4 needs ffmpeg, which is not installed; install it, or use gif")
        # H.264 wants even numbers of pixels, and players this one pixel format
        even = ["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p"]
        writer = animation.FFMpegWriter(fps=_RATE, codec="libx264", extra_args=even)
    figure = blank()
    frames[0](figure)  # which sets its size
    folder = path.absolute().parent
    handle, hidden = tempfile.mkstemp(prefix=f".{path.stem}-", suffix=f".{suffix}", dir=folder)
    os.close(handle)
    try:
        with writer.saving(figure, hidden, dpi=200):
            for paint_frame in frames:
                paint_frame(figure)
                writer.grab_frame()
        with replacing(path) as stream:
            stream.write(Path(hidden).read_bytes())
    finally:
        os.unlink(hidden)
