"""Style of all figures: sizes in mm, small type, colours that colour-blind readers tell apart."""

from __future__ import annotations

from typing import Any

__all__ = ["COLOURS", "DARK", "DIVERGING", "LEDGER", "MM", "REGIONS", "SEQUENTIAL", "STYLE", "UNITS"]

MM = 1 / 25.4  # [inch]

UNITS = {"unit": "Pa/m", "nodal": "N/m"}

# Okabe and Ito's
COLOURS = {
    "sway": "#0072B2",
    "twist": "#D55E00",
    "global": "#009E73",
    "local": "#B4588F",
    "rigid rotation": "#777777",
}

# the same on a dark page
DARK = {
    "sway": "#5AB4F0",
    "twist": "#FF8A3D",
    "global": "#35C795",
    "local": "#DD8DBB",
    "rigid rotation": "#999999",
}

# Matplotlib's colour maps for sizes, and for what has both signs
SEQUENTIAL, DIVERGING = "cividis", "PuOr_r"

# of gas, constraint, strain, contact, damping and their sum
LEDGER = ("#0072B2", "#009E73", "#D55E00", "#E69F00", "#B4588F", "black")

REGIONS = {"slack": "#E69F00", "wrinkled": "#56B4E9", "taut": "#0072B2"}

STYLE: Any = {
    "font.size": 7,
    "axes.linewidth": 0.6,
    "axes.titlesize": 7.5,
    "xtick.labelsize": 6.5,
    "ytick.labelsize": 6.5,
    "figure.dpi": 300,
    "savefig.dpi": 300,
}
