"""Pictures and reports: figures, renderings, the HTML report.

What belongs here turns results that are there into something to look at. Nothing here solves.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from lobefem.faces import face

if TYPE_CHECKING:
    from lobefem.viz.contours import horizontal_displacements
    from lobefem.viz.film_mesh import gather
    from lobefem.viz.frames import load_frames
    from lobefem.viz.mode_figures import eigenvalue_curves, mode_shapes
    from lobefem.viz.rendering import can_render, render_modes
    from lobefem.viz.report import write_report
    from lobefem.viz.run_pictures import picture, save_picture
    from lobefem.viz.study_figures import curves, harmonic_pressures_figure, perturbation, refinement

_HOME = {
    "can_render": "rendering",
    "curves": "study_figures",
    "eigenvalue_curves": "mode_figures",
    "gather": "film_mesh",
    "harmonic_pressures_figure": "study_figures",
    "horizontal_displacements": "contours",
    "load_frames": "frames",
    "mode_shapes": "mode_figures",
    "perturbation": "study_figures",
    "picture": "run_pictures",
    "refinement": "study_figures",
    "render_modes": "rendering",
    "save_picture": "run_pictures",
    "write_report": "report",
}

__all__ = [
    "can_render",
    "curves",
    "eigenvalue_curves",
    "gather",
    "harmonic_pressures_figure",
    "horizontal_displacements",
    "load_frames",
    "mode_shapes",
    "perturbation",
    "picture",
    "refinement",
    "render_modes",
    "save_picture",
    "write_report",
]

__getattr__, __dir__ = face(__name__, _HOME)
