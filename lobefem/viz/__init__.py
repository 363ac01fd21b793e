"""Pictures and reports: figures, renderings, the HTML report.

What belongs here turns results that are there into something to look at. Nothing here solves.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lobefem.faces import face

if TYPE_CHECKING:
    from lobefem.viz.mode_figures import eigenvalue_curves, mode_shapes
    from lobefem.viz.report import write_report
    from lobefem.viz.run_pictures import save_picture

__all__ = ["eigenvalue_curves", "mode_shapes", "save_picture", "write_report"]

_HOME = {
    "eigenvalue_curves": "mode_figures",
    "mode_shapes": "mode_figures",
    "save_picture": "run_pictures",
    "write_report": "report",
}

__getattr__ = face(__name__, _HOME)
