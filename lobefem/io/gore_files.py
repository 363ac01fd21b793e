"""A gore's cutting table as CSV, its outline at 1:1 as SVG and DXF.

The gore lies along x from its bottom end, symmetric about y = 0; drawings are in millimetres. Tendon marks
are points of the seam at even steps of the tendon, where the two are laid together.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lobefem import checks
from lobefem.errors import InputError
from lobefem.files import replace
from lobefem.frozen import Frozen
from lobefem.geometry.gore import Gore
from lobefem.geometry.station_table import StationTable
from lobefem.typing import Array

__all__ = ["COLUMNS", "CuttingTable", "cutting_table", "save_gore"]

COLUMNS = ("s [m]", "half-width [m]", "seam length [m]", "tendon at rest [m]")

_FINE = 20  # points of the outline between two marks


@dataclass(frozen=True)
class CuttingTable(Frozen):
    """One flat gore.

    Attributes:
        s: centre-line length from the bottom of each mark (n,) [m].
        half_width: there (n,) [m].
        seam: length of the gore's edge from its bottom (n,) [m].
        tendon: length of the unstressed tendon from its bottom (n,) [m].
        outline: centre line and half-widths of the edge, finer (m, 2) [m].
    """

    s: Array
    half_width: Array
    seam: Array
    tendon: Array
    outline: Array

    @property
    def length(self) -> float:
        """Of the gore along its centre line [m]."""
        return float(self.s[-1])

    @property
    def width(self) -> float:
        """Of the gore at its widest [m]."""
        return 2 * float(self.outline[:, 1].max())

    @property
    def area(self) -> float:
        """Of the gore [m^2]."""
        x, w = self.outline.T
        return float(np.trapezoid(2 * w, x))


def cutting_table(gore: Gore, foreshortening: float | StationTable = 0.0, marks: int = 51) -> CuttingTable:
    """The flat gore with marks at even steps of the tendon.

    Args:
        gore: its shape.
        foreshortening: share by which the tendon at rest is shorter than its curve, or a table of it.
        marks: their number, both ends included.

    Raises:
        InputError: fewer than two marks.
    """
    checks.integer("the number of tendon marks", marks, 2)
    fine: Array = np.asarray(np.linspace(0.0, gore.curve.arc_length, (marks - 1) * _FINE + 1))
    outline = np.stack([gore.along(fine), gore.half_width(fine)], axis=1)
    seam = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(outline, axis=0).T))])
    at = slice(None, None, _FINE)
    shares = (
        foreshortening.at(fine / fine[-1]) if callable(foreshortening) else np.full(len(fine), foreshortening)
    )
    rest = (1 - (shares[1:] + shares[:-1]) / 2) * np.diff(fine)
    tendon = np.concatenate([[0.0], np.cumsum(rest)])[at]
    return CuttingTable(outline[at, 0], outline[at, 1], seam[at], tendon, outline)


def save_gore(folder: str | Path, table: CuttingTable, about: Mapping[str, Any]) -> list[Path]:
    """Write gore.csv, gore.svg and gore.dxf; the paths of what was written.

    Args:
        folder: made if it is not there.
        table: from `cutting_table`.
        about: what the drawing says of itself, by name.

    Raises:
        InputError: the file system refuses, or ezdxf is missing.
    """
    dxf = _dxf(table, about)  # first: it may be missing
    path = Path(folder)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"'{path}' cannot be made ({error.strerror}); give another --out") from None
    texts = {"gore.csv": as_csv(table, about), "gore.svg": as_svg(table, about), "gore.dxf": dxf}
    for name, text in texts.items():
        replace(path / name, text)
    return [path / name for name in texts]


def as_csv(table: CuttingTable, about: Mapping[str, Any]) -> str:
    """The table; `[shape] pattern` reads stations and half-widths from two columns, not from this one."""
    rows = np.stack([table.s, table.half_width, table.seam, table.tendon], axis=1)
    head = [f"# {name}: {value}" for name, value in about.items()]
    return (
        "\n".join([*head, ", ".join(COLUMNS), *(", ".join(f"{v:.6f}" for v in row) for row in rows)]) + "\n"
    )


def _closed(table: CuttingTable) -> Array:
    """The outline once around, in millimetres."""
    upper = 1e3 * table.outline
    return np.concatenate([upper, upper[::-1] * (1, -1)])


def _marks(table: CuttingTable) -> list[tuple[Array, Array]]:
    """Ticks across both edges at the marks, in millimetres; a hundredth of the width long."""
    tick = 1e3 * table.width / 100
    x, w = 1e3 * table.s, 1e3 * table.half_width
    return [
        (np.array([a, side * (b - tick)]), np.array([a, side * b]))
        for side in (1, -1)
        for a, b in zip(x, w, strict=True)
    ]


def as_svg(table: CuttingTable, about: Mapping[str, Any]) -> str:
    """The gore at 1:1."""
    from xml.sax.saxutils import escape

    margin = 10.0
    length, width = 1e3 * table.length, 1e3 * table.width
    size = f"{length + 2 * margin:.3f}", f"{width + 2 * margin:.3f}"
    points = " ".join(f"{x:.3f},{y:.3f}" for x, y in _closed(table))
    ticks = " ".join(f"M{a[0]:.3f},{a[1]:.3f} L{b[0]:.3f},{b[1]:.3f}" for a, b in _marks(table))
    said = escape("; ".join(f"{name}: {value}" for name, value in about.items()))
    return f"""<svg xmlns="http://www.w3.org/2000/svg" width="{size[0]}mm" height="{size[1]}mm"
 viewBox="{-margin:g} {-width / 2 - margin:.3f} {size[0]} {size[1]}">
<title>{said}</title>
<g fill="none" stroke="black" stroke-width="0.5">
<polygon points="{points}"/>
<path d="M0,0 L{length:.3f},0" stroke-dasharray="20,10"/>
<path d="{ticks}"/>
</g>
</svg>
"""


def _dxf(table: CuttingTable, about: Mapping[str, Any]) -> str:
    """The gore at 1:1 in layers OUTLINE, CENTRE, MARKS and TEXT."""
    import io

    try:
        import ezdxf
    except ImportError:
        raise InputError(
            "the gore's DXF drawing needs ezdxf, which is not installed; pip install ezdxf"
        ) from None
    drawing = ezdxf.new("R2010", units=ezdxf.units.MM)
    for layer, colour in (("OUTLINE", 7), ("CENTRE", 5), ("MARKS", 1), ("TEXT", 3)):
        drawing.layers.add(layer, color=colour)
    space = drawing.modelspace()
    space.add_lwpolyline(_closed(table).tolist(), close=True, dxfattribs={"layer": "OUTLINE"})
    space.add_line((0.0, 0.0), (1e3 * table.length, 0.0), dxfattribs={"layer": "CENTRE"})
    for a, b in _marks(table):
        space.add_line((float(a[0]), float(a[1])), (float(b[0]), float(b[1])), dxfattribs={"layer": "MARKS"})
    height = max(1e3 * table.width / 40, 1.0)
    for k, (name, value) in enumerate(about.items()):
        place = (0.0, -1e3 * table.width / 2 - 2 * height * (k + 1))
        space.add_text(f"{name}: {value}", height=height, dxfattribs={"layer": "TEXT", "insert": place})
    stream = io.StringIO()
    drawing.write(stream)
    return stream.getvalue()
