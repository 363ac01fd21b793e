"""What the parts share: tables, figures, modules of tests and demos."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

__all__ = ["ROOT", "borrowed", "distinct", "figure", "orders", "per_cent", "table"]

ROOT = Path(__file__).parents[2]


def table(head: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """A Markdown table; numbers to five digits unless they are text already."""
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    lines += ["| " + " | ".join(c if isinstance(c, str) else f"{c:.5g}" for c in row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def per_cent(value: float, reference: float) -> str:
    """The difference to a reference."""
    return f"{100 * (value / reference - 1):+.2g} %" if value != reference else "0"


def orders(h: Sequence[float], errors: Sequence[float]) -> list[str]:
    """Observed orders between neighbours."""
    pairs = zip(h, h[1:], errors, errors[1:], strict=False)
    return ["", *(f"{np.log(e0 / e1) / np.log(h0 / h1):.2f}" for h0, h1, e0, e1 in pairs)]


def figure(width: float = 4.6, height: float = 3.2) -> tuple[Figure, Any]:
    """A figure without a window system, and its axes."""
    drawing = Figure(figsize=(width, height), layout="constrained", dpi=150)
    FigureCanvasAgg(drawing)
    axes = drawing.add_subplot()
    axes.spines[["top", "right"]].set_visible(False)
    return drawing, axes


def borrowed(path: str) -> Any:
    """A module of the tests or the demos."""
    spec = importlib.util.spec_from_file_location(f"borrowed_{Path(path).stem}", ROOT / path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look there
    beside = str((ROOT / path).parent)
    if beside not in sys.path:  # a script finds what lies beside it
        sys.path.append(beside)
    spec.loader.exec_module(module)
    return module


def distinct(values: Sequence[float]) -> list[float]:
    """Ascending values, each copy of a pair once."""
    kept: list[float] = []
    for value in sorted(values):
        if not kept or value - kept[-1] > 1e-5 * abs(value):
            kept.append(value)
    return kept
