"""A run folder's results in other forms: CSV tables, an Excel workbook, VTU files for ParaView."""

from __future__ import annotations

import os
import shutil
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from lobefem import files
from lobefem.errors import InputError
from lobefem.io import spreadsheets
from lobefem.io.run_reader import Run, Step, find_runs, load_run
from lobefem.io.workbook import NAME, workbook

__all__ = ["KINDS", "export"]

KINDS = ("csv", "vtu", "xlsx")

_VTK_TYPES = {3: 5, 4: 9}  # by corners of a cell


def export(folder: str | Path, kind: str) -> list[Path]:
    """Write a run's tables or fields beside its other files, or those of each run in a folder of runs.

    Args:
        folder: what a command's --out has made, or a folder that holds such folders.
        kind: one of `KINDS`.

    Returns:
        the files.

    Raises:
        InputError: an unknown kind, no run, nothing to export, or the file system refuses.
    """
    if kind not in KINDS:
        raise InputError(f"--to: {kind!r} is unknown; use csv, vtu or xlsx")
    written = []
    for path in find_runs(folder):
        run = load_run(path)
        try:
            written += {"csv": _tables, "vtu": _grids, "xlsx": _workbook}[kind](run)
        except OSError as error:
            raise InputError(
                f"'{path}' takes no files ({error.strerror}); make room or copy it elsewhere"
            ) from None
    if not written:
        what = {"csv": "eigenvalues, history or stations", "vtu": "fields", "xlsx": "results"}[kind]
        raise InputError(f"'{folder}' holds no {what}; give the folder of a run that has come to its end")
    return written


def _tables(run: Run) -> list[Path]:
    found = spreadsheets.tables(run)
    for name, text in found.items():
        files.replace(run.path / name, text)
    return [run.path / name for name in found]


def _workbook(run: Run) -> list[Path]:
    book = workbook(run)
    if book is None:
        return []
    with files.replacing(run.path / NAME) as stream:
        stream.write(book)
    return [run.path / NAME]


def _grids(run: Run) -> list[Path]:
    hidden = Path(tempfile.mkdtemp(prefix=".fields-", dir=run.path))
    names = [f"fields-{number}.vtu" for number in range(1, len(run.steps) + 1)]
    try:
        for name, step in zip(names, run.steps, strict=True):
            _grid(run, step).save(hidden / name)
        for name in names:
            os.replace(hidden / name, run.path / name)
    finally:
        shutil.rmtree(hidden, ignore_errors=True)
    return [run.path / name for name in names]


def _grid(run: Run, step: Step) -> Any:
    """A PyVista grid of a step: curved cells cut into flat triangles, points as meshed."""
    import pyvista

    flat = len(np.unique(run.corners)) == len(run.x)
    cells, owners = (run.corners, slice(None)) if flat else (run.triangles, run.owners)
    corners = cells.shape[1]
    joined = np.column_stack([np.full(len(cells), corners), cells]).ravel()
    grid = pyvista.UnstructuredGrid(joined, np.full(len(cells), _VTK_TYPES[corners]), run.x)
    for name, values in step.nodal.items():
        grid.point_data[name] = values
    for name, values in step.cells.items():
        grid.cell_data[name] = values[owners]
    grid.field_data["pressure"] = [step.pressure]
    return grid
