"""A sweep over nothing but the mesh is a mesh study: its limit and error bar."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from lobefem.app import parsing
from lobefem.app.mesh_study_command import fitted
from lobefem.errors import InputError
from lobefem.stability.refinement import trend
from lobefem.typing import Unchecked

__all__ = ["mesh_study"]

_KEYS = ("divisions", "mesh.divisions")


def mesh_study(
    varied: Sequence[str], values: Sequence[Mapping[str, Any]], pressures: Sequence[float | None]
) -> dict[str, Any]:
    """The keys of a mesh study for a sweep's results; none where more is varied, or of one or two meshes.

    Args:
        varied: the keys and options of the sweep.
        values: of these, of each point that came to its end.
        pressures: critical pressure of each such point [Pa], None without one.
    """
    if len(varied) != 1 or varied[0] not in _KEYS:
        return {}
    meshes = [_pair(one[varied[0]]) for one in values]
    known = sorted({mesh: p for mesh, p in zip(meshes, pressures, strict=True) if mesh}.items(), key=_cells)
    sizes = [1 / math.sqrt(_cells(one)) for one in known]
    if len(known) < 3 or len(set(sizes)) < len(sizes):
        return {}
    found = trend(sizes, [math.inf if p is None else p for _, p in known])
    rows = [{"divisions": list(mesh), "critical_pressure": p} for mesh, p in known]
    return fitted(found) | {"meshes": rows}


def _cells(row: tuple[tuple[int, int], float | None]) -> int:
    return row[0][0] * row[0][1]


def _pair(value: Unchecked) -> tuple[int, int] | None:
    """Divisions from [24, 32] or "24x32"; None of anything else."""
    if isinstance(value, str):
        try:
            pairs = parsing.divisions("divisions", value)
        except InputError:
            return None
        return pairs[0] if pairs and len(pairs) == 1 else None
    if isinstance(value, (list, tuple)) and len(value) == 2 and all(isinstance(n, int) for n in value):
        return value[0], value[1]
    return None
