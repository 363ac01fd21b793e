"""A run folder read back: design, results, fields and log as plain data, without DOLFINx.

Nothing in a folder is executed, and nothing outside of it is read. What a run that was stopped has
not written yet is left out; what cannot be read is told in `Run.faults`.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import h5py
import numpy as np
import numpy.typing as npt

from lobefem.errors import InputError
from lobefem.frozen import Frozen
from lobefem.typing import Array, Integers

__all__ = ["SCHEMA", "Run", "Step", "find_runs", "load_run"]

SCHEMA = 1  # the newest form of results.json that is understood here

# a cell's corners and midpoints, as VTK numbers them, cut into triangles
_TRIANGLES = {
    "Triangle": [[0, 1, 2]],
    "Triangle_6": [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]],
    "Quadrilateral": [[0, 1, 2], [0, 2, 3]],
    "Quadrilateral_9": [
        [0, 4, 8], [0, 8, 7], [4, 1, 5], [4, 5, 8], [8, 5, 2], [8, 2, 6], [7, 8, 6], [7, 6, 3],
    ],
}  # fmt: skip

_CORNERS = {"Triangle": 3, "Quadrilateral": 4}


@dataclass(frozen=True)
class Step(Frozen):
    """The fields at one pressure.

    Attributes:
        pressure: [Pa].
        nodal: by name, (nodes, 3): "displacement" [m], "mode_1", "mode_1_imag", ...
        cells: by name, (cells,) or (cells, 3): "stress_resultants" [N/m], "regions", "lobe".
    """

    pressure: float
    nodal: Mapping[str, Array] = field(repr=False)
    cells: Mapping[str, Array] = field(repr=False)

    @property
    def num_modes(self) -> int:
        """Number of modes."""
        return sum(name.startswith("mode_") and not name.endswith("_imag") for name in self.nodal)


@dataclass(frozen=True)
class Run(Frozen):
    """A finished or interrupted run, read from its folder.

    Attributes:
        path: of the folder.
        design: the design's tables; empty if they cannot be read.
        design_text: the same as the text of design.toml.
        results: what --json holds; empty of a run that did not end.
        log: the text of log.txt, "" without one.
        x: node positions (nodes, 3) [m]; no nodes without fields.
        corners: corner nodes of each cell in order around it (cells, 3 or 4).
        triangles: the cells cut into flat triangles (triangles, 3).
        owners: the cell of each triangle (triangles,).
        steps: the fields, one a pressure, in the order written.
        faults: what could not be read, in sentences.
    """

    path: Path
    design: Mapping[str, Any] = field(repr=False)
    design_text: str = field(repr=False)
    results: Mapping[str, Any] = field(repr=False)
    log: str = field(repr=False)
    x: Array = field(repr=False)
    corners: Integers = field(repr=False)
    triangles: Integers = field(repr=False)
    owners: Integers = field(repr=False)
    steps: tuple[Step, ...] = field(repr=False)
    faults: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The folder's own name."""
        return self.path.absolute().name


def find_runs(folder: str | Path) -> list[Path]:
    """The folder itself if it holds a run, else the folders in it that do, by name.

    Raises:
        InputError: no such folder, or no run in it.
    """
    path = Path(folder)
    try:
        if not path.is_dir():
            raise InputError(f"there is no folder '{path}'; give one that a command's --out has made")
        if _holds_run(path):
            return [path]
        found = sorted(sub for sub in path.iterdir() if sub.is_dir() and _holds_run(sub))
    except OSError as error:
        raise InputError(f"'{path}' cannot be read ({error.strerror}); give another folder") from None
    if not found:
        raise InputError(f"'{path}' holds no run; give a folder that a command's --out has made")
    return found


def _holds_run(path: Path) -> bool:
    return any((path / name).is_file() for name in ("design.toml", "results.json"))


def load_run(folder: str | Path) -> Run:
    """Read a run folder.

    Raises:
        InputError: it holds no run, or one of a newer lobefem.
    """
    path = Path(folder)
    if find_runs(path) != [path]:
        raise InputError(f"'{path}' holds no run; give a folder that a command's --out has made")
    faults: list[str] = []
    results = _results(path, faults)
    several = results.get("command") == "sweep"  # which has no design of its own
    text = _text(path / "design.toml", [] if several else faults)
    design: dict[str, Any] = {}
    try:
        design = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError):
        faults.append("design.toml is no TOML, so the design is not shown")
    try:
        x, kind, cells, steps = _fields(path)
    except (OSError, KeyError, ValueError, TypeError, RuntimeError, ElementTree.ParseError) as error:
        what = " ".join(str(error).split())[:200]
        faults.append(f"fields.xdmf and fields.h5 cannot be read ({what}), so no shape is shown")
        x, kind, cells, steps = np.zeros((0, 3)), "Triangle", np.zeros((0, 3), dtype=np.int64), ()
    parts = np.array(_TRIANGLES[kind])
    triangles = cells[:, parts].reshape(-1, 3)
    return Run(
        path, design, text, results, _text(path / "log.txt", []), x,
        cells[:, : _CORNERS[kind.split("_")[0]]], triangles, np.repeat(np.arange(len(cells)), len(parts)),
        steps, tuple(faults),
    )  # fmt: skip


def _text(path: Path, faults: list[str]) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        faults.append(f"{path.name} cannot be read ({error.strerror})")
        return ""


def _results(path: Path, faults: list[str]) -> dict[str, Any]:
    if not (path / "results.json").is_file():
        faults.append("No results.json: this run has not come to its end")
        return {}
    try:
        found = json.loads(_text(path / "results.json", faults))
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        faults.append("results.json is damaged, so no numbers are shown")
        return {}
    if isinstance(found.get("schema"), int) and found["schema"] > SCHEMA:
        raise InputError(
            f"'{path}' was written by a newer lobefem (schema {found['schema']}, this one knows {SCHEMA}); "
            "use that one"
        )
    return found


def _fields(path: Path) -> tuple[Array, str, Integers, tuple[Step, ...]]:
    """Node positions, kind of cell, cells, and the fields of each step."""
    if not (path / "fields.xdmf").is_file():
        return np.zeros((0, 3)), "Triangle", np.zeros((0, 3), dtype=np.int64), ()
    grids = [
        grid
        for grid in ElementTree.parse(path / "fields.xdmf").iter("Grid")
        if grid.find("Topology") is not None
    ]
    if not grids:
        raise ValueError("no mesh")
    topology, geometry = _found(grids[0], "Topology"), _found(grids[0], "Geometry")
    kind = topology.get("TopologyType", "")
    if kind not in _TRIANGLES:
        raise ValueError(f"cells of the kind {kind!r}")
    with h5py.File(path / "fields.h5", "r") as file:
        x = np.asarray(_data(file, geometry), dtype=float)
        cells = np.asarray(_data(file, topology), dtype=np.int64)
        if x.ndim != 2 or x.shape[1] != 3 or not np.isfinite(x).all():
            raise ValueError("nodes without three coordinates")
        if cells.ndim != 2 or cells.shape[1] != np.max(_TRIANGLES[kind]) + 1:
            raise ValueError("cells without their nodes")
        if cells.size and not (cells.min() >= 0 and cells.max() < len(x)):
            raise ValueError("cells of nodes that are not there")
        steps = tuple(_step(file, grid, len(x), len(cells)) for grid in grids)
    return x, kind, cells, steps


def _step(file: h5py.File, grid: ElementTree.Element, nodes: int, cells: int) -> Step:
    time = grid.find("Time")
    by_place: dict[str, dict[str, Array]] = {"Node": {}, "Cell": {}}
    for attribute in grid.findall("Attribute"):
        place = attribute.get("Center", "")
        values = np.asarray(_data(file, attribute), dtype=float)
        if len(values) != {"Node": nodes, "Cell": cells}.get(place):
            raise ValueError(f"{attribute.get('Name')} is of another mesh")
        by_place[place][attribute.get("Name", "")] = values[:, 0] if values.shape[1:] == (1,) else values
    pressure = float(time.get("Value", "nan")) if time is not None else float("nan")
    return Step(pressure, by_place["Node"], by_place["Cell"])


def _found(element: ElementTree.Element, tag: str) -> ElementTree.Element:
    part = element.find(tag)
    if part is None:
        raise ValueError(f"no {tag}")
    return part


def _data(file: h5py.File, element: ElementTree.Element) -> npt.NDArray[Any]:
    """The array that an element names, as "fields.h5:/path"; links out of the file are not followed."""
    name, _, path = (_found(element, "DataItem").text or "").strip().partition(":")
    if name != "fields.h5":
        raise ValueError(f"data in {name!r}")
    data = file[path]
    if not isinstance(data, h5py.Dataset) or data.file.filename != file.filename or data.external:
        raise ValueError(f"no data at {path!r}")
    return data[()]
