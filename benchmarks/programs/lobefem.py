"""lobefem: its command line, from the design file to the results, mesh and all."""

from __future__ import annotations

import json
import sys
from pathlib import Path

from benchmarks.problem import NU, PRESSURE, R0, SHARE, THICKNESS, Answer, Case, E
from benchmarks.programs import ROOT, Job

NAME = "lobefem"


def missing() -> str | None:
    """It is always there."""
    return None


def unable(case: Case) -> str | None:
    """It can do all cases."""
    return None


def prepare(case: Case, folder: Path) -> Job:
    """Write the design file."""
    along, around = case.divisions
    law = f'"tension-field"\nslack_stiffness = {SHARE}' if case.lift else '"isotropic"'
    text = f"""[shape]
R0 = {R0}

[mesh]
divisions = [{along}, {around}]

[film]
law = {law}
E = {E}
nu = {NU}
thickness = {THICKNESS}

[plates]
support = "fixed"
lift = {case.lift}

[pressure]
load = "closed"
value = {PRESSURE}
"""
    (folder / "film.toml").write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "lobefem", "inflate", "film.toml", "--json", "result.json"]
    return Job([*command, "--profile"], environment={"PYTHONPATH": str(ROOT)})


def answer(case: Case, folder: Path, output: str) -> Answer:
    """Read its results."""
    result = results(folder)
    return Answer(result["volume"], result["max_displacement"], result["iterations"])


def results(folder: Path) -> dict:
    """All of its results, the profile too."""
    return json.loads((folder / "result.json").read_text(encoding="utf-8"))
