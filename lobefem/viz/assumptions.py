"""Assumptions of a result on load, support, bar and hoops, in a few words each."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from lobefem.units import scaled

__all__ = ["assumptions"]


def assumptions(results: Mapping[str, Any]) -> list[str]:
    """Load, support, bar and hoops of a run, those that have no part in it left out.

    Args:
        results: as in results.json, be it damaged.
    """
    said = [f"{results['load']} load"] if results.get("load") else []
    said += [str(results["support"])] if results.get("support") else []
    if "bar" in results and results.get("support") != "fixed" and "gores" not in results:
        # two fixed plates need no bar, and a pumpkin has none
        said.append(_part("bar", results["bar"]))
    lobes = results.get("lobes")
    if "hoops" in results and isinstance(lobes, int) and lobes > 1:
        said.append(_part("hoops", results["hoops"]))
    return said


def _part(name: str, stiffness: Any) -> str:
    if stiffness is None:
        return f"no {name}"
    if isinstance(stiffness, (int, float)):
        return f"{name} of EA {scaled(float(stiffness), 'N')}"
    return f"{stiffness} {name}"
