"""Files: designs, checkpoints, fields, run folders, records and their keys.

What belongs here reads or writes a file. `design` is data, `build` makes objects of it. Nothing here draws.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from lobefem.faces import face

if TYPE_CHECKING:
    from lobefem.io.checkpoints import load_modes, load_state, save_modes, save_state
    from lobefem.io.design import Design
    from lobefem.io.run_folder import RunFolder
    from lobefem.io.run_reader import Run, Step, find_runs, load_run
    from lobefem.io.toml import read_toml, to_toml
    from lobefem.io.xdmf import Snapshot, save_fields

_HOME = {
    "Design": "design",
    "Run": "run_reader",
    "RunFolder": "run_folder",
    "Snapshot": "xdmf",
    "Step": "run_reader",
    "find_runs": "run_reader",
    "load_modes": "checkpoints",
    "load_run": "run_reader",
    "load_state": "checkpoints",
    "read_toml": "toml",
    "save_fields": "xdmf",
    "save_modes": "checkpoints",
    "save_state": "checkpoints",
    "to_toml": "toml",
}

__all__ = [
    "Design",
    "Run",
    "RunFolder",
    "Snapshot",
    "Step",
    "find_runs",
    "load_modes",
    "load_run",
    "load_state",
    "read_toml",
    "save_fields",
    "save_modes",
    "save_state",
    "to_toml",
]

__getattr__, __dir__ = face(__name__, _HOME)
