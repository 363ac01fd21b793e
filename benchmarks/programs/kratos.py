"""Kratos Multiphysics: its membrane element and wrinkling law, its Newton-Raphson strategy."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from benchmarks.problem import Answer, Case, film
from benchmarks.programs import PEERS, ROOT, Job, arrays

NAME = "Kratos"
_PYTHON = PEERS / "kratos/bin/python"


def missing() -> str | None:
    """Reason why it cannot run, None if it can."""
    return None if os.access(_PYTHON, os.X_OK) else "its environment .peers/kratos is not there"


def unable(case: Case) -> str | None:
    """It can do all cases."""
    return None


def prepare(case: Case, folder: Path) -> Job:
    """Write mesh and numbers for the script."""
    np.savez(folder / "data.npz", **arrays(case))
    return Job([str(_PYTHON), str(ROOT / "benchmarks/decks/film_kratos.py")])


def answer(case: Case, folder: Path, output: str) -> Answer:
    """Read what the script left."""
    result = np.load(folder / "result.npz")
    return film(case).answer(result["displacement"], int(result["iterations"]))
