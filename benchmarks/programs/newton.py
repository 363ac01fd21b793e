"""lobefem's Newton's method on one mesh with a new tangent in each step, which needs more of its floor."""

from __future__ import annotations

import sys
from pathlib import Path

from benchmarks.problem import Case
from benchmarks.programs import ROOT, Job, lobefem
from benchmarks.programs.lobefem import answer, missing, results, unable

__all__ = ["NAME", "answer", "missing", "prepare", "results", "unable"]

NAME = "lobefem, Newton"


def prepare(case: Case, folder: Path) -> Job:
    """The design file, and a script in the place of the command."""
    job = lobefem.prepare(case, folder)
    script = str(ROOT / "benchmarks/decks/film_newton.py")
    return Job([sys.executable, script], environment=job.environment)
