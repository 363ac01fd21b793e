"""CalculiX: membranes M3D3, which it expands into wedges.

It has no film that wrinkles with Poisson's ratio in it, so the wrinkled case is not for it.
"""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import numpy as np

from benchmarks.problem import NU, PRESSURE, THICKNESS, Answer, Case, E, film
from benchmarks.programs import PEERS, Job

NAME = "CalculiX"


def missing() -> str | None:
    """Reason why it cannot run, None if it can."""
    return None if _executable() else "ccx is not there (Debian: calculix-ccx)"


def unable(case: Case) -> str | None:
    """Reason why it cannot do a case, None if it can."""
    return "no law for it: its tension-only material leaves out Poisson's ratio" if case.lift else None


def prepare(case: Case, folder: Path) -> Job:
    """Write the input deck."""
    (folder / "film.inp").write_text(_deck(case), encoding="ascii")
    libraries = PEERS / "debian/usr/lib/x86_64-linux-gnu"
    path = ":".join(str(libraries / name) for name in (".", "blas", "lapack"))
    return Job([str(_executable()), "film"], environment={"LD_LIBRARY_PATH": path})


def answer(case: Case, folder: Path, output: str) -> Answer:
    """Read the displacements printed at the end of the step."""
    rows = [line.split() for line in (folder / "film.dat").read_text(encoding="ascii").splitlines()]
    values = np.array([row for row in rows if len(row) == 4 and row[0].isdigit()], dtype=float)
    mesh = film(case)
    displacement = np.zeros_like(mesh.points)
    displacement[values[:, 0].astype(int) - 1] = values[:, 1:]
    history = (folder / "film.sta").read_text(encoding="ascii").splitlines()
    iterations = sum(int(line.split()[3]) for line in history if line.split()[:1] == ["1"])
    return mesh.answer(displacement, iterations)


def _executable() -> str | None:
    ours = PEERS / "debian/usr/bin/ccx"
    return str(ours) if os.access(ours, os.X_OK) else shutil.which("ccx")


def _deck(case: Case) -> str:
    mesh = film(case)
    nodes = "\n".join(
        f"{k}, {x:.12f}, {y:.12f}, {z:.12f}" for k, (x, y, z) in enumerate(mesh.points.tolist(), 1)
    )
    cells = "\n".join(
        f"{k}, {a + 1}, {b + 1}, {c + 1}" for k, (a, b, c) in enumerate(mesh.triangles.tolist(), 1)
    )
    held = "\n".join(f"{k + 1}," for k in np.concatenate((mesh.bottom, mesh.top)).tolist())
    return f"""** the common problem, {case.name}, {case.divisions[0]} x {case.divisions[1]}
*NODE, NSET=ALL
{nodes}
*ELEMENT, TYPE=M3D3, ELSET=FILM
{cells}
*NSET, NSET=HELD
{held}
*MATERIAL, NAME=FILM
*ELASTIC
{E!r}, {NU!r}
*MEMBRANE SECTION, ELSET=FILM, MATERIAL=FILM
{THICKNESS!r}
*BOUNDARY
HELD, 1, 3
*STEP, NLGEOM
*STATIC
0.01, 1.
*DLOAD
FILM, P1, {PRESSURE!r}
*NODE PRINT, NSET=ALL
U
*END STEP
"""
