"""Fields for ParaView: mesh, displacement, stress and modes as XDMF and HDF5."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

from lobefem.equilibrium.state import Equilibrium
from lobefem.fem.balloon import Balloon
from lobefem.files import on_root, replace, require_everywhere, reserve
from lobefem.typing import Array

from dolfinx import fem
from dolfinx.io import XDMFFile

if TYPE_CHECKING:
    from lobefem.stability.mode_records import Mode

__all__ = ["Snapshot", "save_fields"]


@dataclass(frozen=True)
class Snapshot:
    """Fields at one pressure, ready to be written.

    Attributes:
        balloon: the balloon that it is of.
        pressure: [Pa], the time of an animation.
        state: its displacement and stress are drawn, None for the shape as designed.
        modes: drawn as mode_1, mode_2, ..., with imaginary parts if one of a run's is complex.
    """

    balloon: Balloon
    pressure: float
    state: Equilibrium | None = None
    modes: tuple[Mode, ...] = ()


def save_fields(folder: Path, snapshots: Sequence[Snapshot]) -> None:
    """Write fields.xdmf and fields.h5. Collective.

    Raises:
        InputError: the file system refuses, or has no room for them.
    """
    mesh, comm = snapshots[0].balloon.mesh, snapshots[0].balloon.comm
    hidden = Path(on_root(comm, folder, lambda: tempfile.mkdtemp(prefix=".fields-", dir=folder)))

    def publish() -> None:
        text = _merged(hidden / "fields.xdmf", [s.pressure for s in snapshots])
        with (hidden / "fields.h5").open("rb") as file:
            os.fsync(file.fileno())
        os.replace(hidden / "fields.h5", folder / "fields.h5")
        replace(folder / "fields.xdmf", text)

    try:
        imaginary = any(mode.value.imag for snapshot in snapshots for mode in snapshot.modes)
        require_everywhere(comm, hidden)
        size = _size(snapshots)
        on_root(comm, folder, lambda: reserve(hidden / "fields.h5", size))  # where it is full, HDF5 aborts
        with XDMFFile(comm, str(hidden / "fields.xdmf"), "w") as file:
            file.write_mesh(mesh)
            for step, snapshot in enumerate(snapshots):
                for function in _functions(snapshot, imaginary):
                    file.write_function(function, float(step))
        on_root(comm, folder, publish)
    finally:
        if comm.rank == 0:
            shutil.rmtree(hidden, ignore_errors=True)


def _size(snapshots: Sequence[Snapshot]) -> int:
    """Bytes that the fields take at the most: of the numbers, and HDF5's and XML's own for each field."""
    balloon = snapshots[0].balloon
    nodes = balloon.V.dofmap.index_map.size_global
    cells = balloon.mesh.topology.index_map(2).size_global
    fields = [2 * len(s.modes) + 1 for s in snapshots]
    numbers = 3 * nodes + 9 * cells + sum(3 * nodes * n + 13 * cells for n in fields)
    return 8 * numbers + 8192 * (sum(fields) + 3 * len(fields) + 4)


def _functions(snapshot: Snapshot, imaginary: bool) -> list[Any]:
    balloon = snapshot.balloon
    found = []
    if snapshot.state is not None:
        found.append(_nodal(balloon, "displacement", snapshot.state.displacement))
        stress = snapshot.state.stress_resultants()
        stress.name = "stress_resultants"
        found += [stress, snapshot.state.regions()]
    for k, mode in enumerate(snapshot.modes, 1):
        found.append(_nodal(balloon, f"mode_{k}", mode.displacement))
        if imaginary:  # for all or for none: readers keep a field that a later step lacks
            found.append(_nodal(balloon, f"mode_{k}_imag", mode.displacement_imag))
    lobes = fem.Function(fem.functionspace(balloon.mesh, ("DG", 0)), name="lobe")
    lobes.x.array[:] = balloon.surface.lobe_numbers()
    return [*found, lobes]


def _nodal(balloon: Balloon, name: str, values: Array) -> Any:
    function = fem.Function(balloon.V, name=name)
    function.x.array[:] = values.ravel()
    return function


def _merged(path: Path, times: list[float]) -> str:
    """DOLFINx's XML with all fields of a step in one grid, its time the pressure [Pa].

    DOLFINx writes a grid a field, which ParaView shows as blocks that cannot be combined: no
    warping by a mode with the stress as colour.
    """
    root = ElementTree.parse(path).getroot()
    domain = root.find("Domain")
    assert domain is not None
    plain = next(grid for grid in domain.findall("Grid") if grid.get("GridType") == "Uniform")
    mesh = [part for part in plain if part.tag in ("Topology", "Geometry")]
    for item in domain.iter("DataItem"):
        if item.get("NumberType", "Float") == "Float":
            item.set("Precision", "8")  # left out, readers take it for single
    merged = []
    for step, time in enumerate(times):
        grid = ElementTree.Element("Grid", {"Name": "film", "GridType": "Uniform"})
        grid.extend(mesh)
        ElementTree.SubElement(grid, "Time", {"Value": repr(float(time))})
        for written in domain.iter("Grid"):
            stamp = written.find("Time")
            if stamp is not None and float(stamp.get("Value", "nan")) == step:
                grid.extend(written.findall("Attribute"))
        merged.append(grid)
    for old in domain.findall("Grid"):
        domain.remove(old)
    if len(merged) > 1:
        series = {"Name": "pressures", "GridType": "Collection", "CollectionType": "Temporal"}
        ElementTree.SubElement(domain, "Grid", series).extend(merged)
    else:
        domain.extend(merged)
    ElementTree.indent(root)
    return f'<?xml version="1.0"?>\n{ElementTree.tostring(root, encoding="unicode")}\n'
