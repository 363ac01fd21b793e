"""What a verdict reads in results, be they damaged: numbers, and records of pressures and of meshes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lobefem.typing import Unchecked

__all__ = ["Results", "divisions_of", "entries_of", "is_number", "meshes_of"]

Results = Mapping[str, Any]


def is_number(value: Unchecked) -> bool:
    """True of a finite number."""
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def entries_of(results: Results) -> list[Mapping[str, Any]]:
    """The records of single pressures in the results of modes."""
    entries = results.get("pressures")
    known = [e for e in entries if isinstance(e, Mapping)] if isinstance(entries, list) else []
    return [e for e in known if "stable" in e and is_number(e.get("pressure"))]


def meshes_of(results: Results) -> list[Mapping[str, Any]]:
    """The records of single meshes in the results of a mesh study."""
    rows = results.get("meshes")
    return [row for row in rows if isinstance(row, Mapping)] if isinstance(rows, list) else []


def divisions_of(results: Results) -> tuple[int, int] | None:
    """Cells along a lobe and around the axis, None where they are not known."""
    found = results.get("divisions")
    if isinstance(found, (list, tuple)) and len(found) == 2 and all(isinstance(n, int) for n in found):
        return found[0], found[1]
    return None
