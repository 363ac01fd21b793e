"""Pictures of modes in space by PyVista, off-screen."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from lobefem.stability.mode_records import Modes
from lobefem.viz.film_mesh import facing, gather
from lobefem.viz.mode_figures import chosen_modes, drawn_amplitude

__all__ = ["can_render", "quiet", "render_modes"]

_PROBE = """
import pyvista
plotter = pyvista.Plotter(off_screen=True)
plotter.add_mesh(pyvista.Sphere())
plotter.screenshot()
"""


def can_render(timeout: float = 120.0) -> bool:
    """True if VTK can draw off-screen here.

    Without an X server some VTK builds do not raise but end the process: so it is tried in another.

    Args:
        timeout: how long to wait for it [s].
    """
    try:
        probe = subprocess.run(
            [sys.executable, "-c", _PROBE], capture_output=True, timeout=timeout, check=False
        )
    except (OSError, subprocess.TimeoutExpired):
        return False
    return probe.returncode == 0


def render_modes(
    modes: Modes,
    chosen: Sequence[int],
    path: str | Path,
    *,
    amplitude: float = 0.09,
    pixels: tuple[int, int] = (1000, 860),
) -> None:
    """Modes side by side, coloured by displacement, as a PNG. Collective; rank 0 draws.

    Args:
        modes: of one state.
        chosen: indices of the modes drawn.
        path: of the picture.
        amplitude: as in `lobefem.viz.mode_figures.mode_shapes`.
        pixels: width and height.

    Raises:
        InputError: no mode, or one that is not there.
    """
    picked = chosen_modes(modes, chosen)
    film_mesh = gather(modes.state.balloon, *(m.displacement for m in picked))
    if film_mesh is None:
        return
    import pyvista

    count = film_mesh.faces.shape[1]
    faces = np.column_stack([np.full(len(film_mesh.faces), count), film_mesh.faces]).ravel()
    centre = (film_mesh.x.max(axis=0) + film_mesh.x.min(axis=0)) / 2
    with quiet():
        plotter = pyvista.Plotter(
            off_screen=True, shape=(1, len(picked)), window_size=list(pixels), border=False
        )
        plotter.set_background("white")
        for k, (mode, field) in enumerate(zip(picked, film_mesh.fields, strict=True)):
            _, e2 = facing(film_mesh, field)
            shape = film_mesh.x + drawn_amplitude(mode.kind, film_mesh, field, amplitude) * field
            mesh = pyvista.PolyData(shape, faces)
            size = np.linalg.norm(field, axis=1)
            mesh["displacement"] = size / size.max()
            plotter.subplot(0, k)
            plotter.add_mesh(
                mesh,
                scalars="displacement",
                cmap="viridis",
                clim=(0, 1),
                show_edges=True,
                edge_color="#444444",
                line_width=0.5,
                ambient=0.25,
                show_scalar_bar=False,
            )
            if film_mesh.grid is not None:
                for rim in (film_mesh.grid[0], film_mesh.grid[-1]):
                    plate = pyvista.PolyData(shape[rim], [len(rim), *range(len(rim))])
                    plotter.add_mesh(plate, color="#cccccc")
            bar = plotter.add_scalar_bar(
                title=f"displacement / largest ({k + 1})",
                vertical=False,
                width=0.6,
                height=0.05,
                position_x=0.2,
                position_y=0.02,
                title_font_size=16,
                label_font_size=14,
                n_labels=2,
                fmt="%.1f",
                color="black",
            )
            bar.SetTitle("displacement / largest")
            plotter.add_text(
                f"{mode.kind}, n = {mode.harmonic}\n", position="upper_edge", font_size=12, color="black"
            )
            plotter.camera.focal_point = centre
            plotter.camera.position = centre + 10 * film_mesh.diameter * (0.35 * film_mesh.axis - e2)
            plotter.camera.up = film_mesh.axis
            plotter.camera.parallel_projection = True
            plotter.camera.parallel_scale = 0.68 * max(film_mesh.height, film_mesh.diameter)
        plotter.enable_anti_aliasing("ssaa")
        plotter.screenshot(str(path))
        plotter.close()


@contextmanager
def quiet() -> Iterator[None]:
    """VTK tells of every X server that it does not find before it draws without one."""
    from vtkmodules.vtkCommonCore import vtkLogger

    before = vtkLogger.GetCurrentVerbosityCutoff()
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)
    try:
        yield
    finally:
        vtkLogger.SetStderrVerbosity(before)
