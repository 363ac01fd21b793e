"""The programs, one module each: `missing`, `prepare` a run in a folder, read its `answer`."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.problem import NU, PRESSURE, SHARE, STIFFNESS, Case, film

__all__ = ["PEERS", "ROOT", "Job", "arrays"]

ROOT = Path(__file__).parents[2]
PEERS = ROOT / ".peers"


@dataclass(frozen=True)
class Job:
    """A process to run: its command, what it reads from stdin, what is added to its environment."""

    command: list[str]
    stdin: str = ""
    environment: dict[str, str] = field(default_factory=dict)


def arrays(case: Case) -> dict[str, Any]:
    """Mesh, numbers and start of a case, for scripts in Python of other environments."""
    mesh = film(case)
    return {
        "points": mesh.points,
        "triangles": mesh.triangles,
        "held": np.concatenate((mesh.bottom, mesh.top)),
        "start": mesh.start(case),
        "pressure": PRESSURE,
        "stiffness": STIFFNESS,
        "nu": NU,
        "share": SHARE,
        "wrinkles": case.lift > 0,
    }
