"""Files: designs, checkpoints, fields, run folders, records and their keys.

What belongs here reads or writes a file. `design` is data, `build` makes objects of it. Nothing here draws.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lobefem.faces import face

if TYPE_CHECKING:
    from lobefem.io.checkpoints import load_state, save_state
    from lobefem.io.design import Design
    from lobefem.io.run_folder import RunFolder
    from lobefem.io.run_reader import load_run

__all__ = ["Design", "RunFolder", "load_run", "load_state", "save_state"]

_HOME = {
    "Design": "design",
    "RunFolder": "run_folder",
    "load_run": "run_reader",
    "load_state": "checkpoints",
    "save_state": "checkpoints",
}

__getattr__ = face(__name__, _HOME)
