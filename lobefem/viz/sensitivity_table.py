"""The table of sensitivities: by how many percent each quantity changes for a step of each parameter."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

__all__ = ["sensitivity_table"]

_SHOWN = {
    "critical_pressure": "p_cr",
    "eigenvalue": "eigenvalue",
    "max_stress": "stress",
    "tendon_tension": "tension",
    "volume": "volume",
    "film_area": "area",
}


def sensitivity_table(results: Mapping[str, Any]) -> tuple[tuple[str, ...], tuple[tuple[str, ...], ...]]:
    """Head and rows as text.

    Args:
        results: of `lobefem sensitivities`.
    """
    quantities = results["quantities"]
    shown = [name for name in _SHOWN if name in quantities]
    head = ("", "step", *(f"{_SHOWN[name]}, %" for name in shown))
    rows = []
    for row in results["parameters"]:
        cells = [_percent(row["changes"].get(name), quantities[name]) for name in shown]
        rows.append((str(row["name"]), str(row["step"]), *cells))
    return head, tuple(rows)


def _percent(change: float | None, value: float) -> str:
    """A change in percent of the size of a value."""
    if not change or not value:
        return ""
    return f"{100 * change / abs(value):+.3g}".replace("-", "\N{MINUS SIGN}")
