"""What `table2.py` shows of its runs: the paper's table 2 beside ours, fig. 23, energies over the way."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from lobefem import Isotensoid

__all__ = ["HEAD", "PAPER", "STEP", "bends", "landscape", "middle", "rows", "words"]

# bend angle [degrees]: volume after pressurisation, distorted, and at the end [m^3], as printed
PAPER = {7.5: (591.96, 589.19, 575.57), 15.0: (591.96, 581.61, 571.151)}
PAPER_MIDDLE = 2.4  # displacement of the mid hoop at the end [m], fig. 23
PAPER_LOBES, PAPER_PRESSURE = 4, 5.0
STEP = 1.0  # duration of a static step [s]

Runs = Mapping[str, dict[str, Any]]


def bends(runs: Runs, mesh: str = "") -> list[dict[str, Any]]:
    """The runs that bend a stack, on one mesh or on all."""
    return [r for name, r in runs.items() if r["distortion"] == "bend" and name.startswith(mesh)]


COLOURS = {"film": "#D55E00", "closed": "#0072B2"}
DASHES = {"clamped": "-", "pinned": "--"}


def middle(runs: Runs, mesh: str, angle: float) -> Figure:
    """Chart of the mid hoop's displacement over the ramp and the release (paper fig. 23)."""
    sheet = Figure(figsize=(6.6, 2.8), layout="constrained")
    FigureCanvasAgg(sheet)
    left, right = sheet.subplots(1, 2, sharey=True, width_ratios=(1, 2))
    for r in bends(runs, mesh):
        if r["amount"] != angle:
            continue
        look = {"color": COLOURS[r["load"]], "ls": DASHES[r["support"]], "lw": 1.2}
        ramp, motion = r["history"]["ramp"], r["history"]["release"]
        left.plot(np.array(ramp["parameter"]) / angle, np.abs(ramp["middle"]), **look)
        after = np.array(motion["time"]) > 0
        sides = np.abs(np.array(motion["middle"]))
        name = f"{r['load']}, {r['support']}" + " (free to tilt)" * (r["support"] == "pinned")
        right.semilogx(np.array(motion["time"])[after], sides[after], label=name, **look)
    left.set(xlabel=f"share of {angle:g} degrees", ylabel="mid hoop's displacement [m]", title="Distortion")
    right.set(xlabel="time since the release [s], damping 1", title="Release")
    for axes in (left, right):
        axes.axhline(PAPER_MIDDLE, color="0.6", lw=0.8, ls=":")
        axes.set_ylim(0, 1.08 * PAPER_MIDDLE)
        axes.spines[["top", "right"]].set_visible(False)
    right.text(0.98, PAPER_MIDDLE, "paper's end", ha="right", va="bottom", fontsize=7, color="0.4",
               transform=right.get_yaxis_transform())  # fmt: skip
    right.legend(frameon=False, fontsize=7)
    return sheet


def landscape(runs: Runs, mesh: str) -> Figure:
    """Energy above the original's against the mid hoop's displacement: ways up, down, and the paper's."""
    sheet = Figure(figsize=(5.2, 3.6), layout="constrained")
    FigureCanvasAgg(sheet)
    axes = sheet.add_subplot()
    shown = [r for r in bends(runs, mesh) if r["load"] == "closed"]
    for r in shown:
        ramp, motion = r["history"]["ramp"], r["history"]["release"]
        colour = "#0072B2" if r["support"] == "pinned" else "#009E73"
        axes.plot(np.abs(ramp["middle"]), _potential(ramp), color="0.55", lw=1.0)
        axes.plot(np.abs(motion["middle"]), _potential(motion), color=colour, ls="--", lw=1.0)
        axes.plot(abs(ramp["middle"][-1]), _potential(ramp)[-1], "o", ms=4, color=colour)
    for angle, (original, imposed, final) in PAPER.items():
        side = PAPER_LOBES * Isotensoid.from_edge_radius().height / 2 * math.tan(math.radians(angle) / 2)
        path = [PAPER_PRESSURE * (original - v) for v in (imposed, final)]
        axes.plot([side, PAPER_MIDDLE], path, "s:", ms=4, color="#D55E00", lw=0.9)
        axes.annotate(
            f"  paper, {angle:g}°", (PAPER_MIDDLE, path[1]), fontsize=7, color="#D55E00", va="center"
        )
    names = (
        ("0.55", "-", "distorting it"),
        ("#0072B2", "--", "released, pinned"),
        ("#009E73", "--", "released, clamped"),
        ("#D55E00", "s:", "paper's volumes, $p (V_0 - V)$"),
    )
    for colour, look, name in names:
        axes.plot([], [], look, color=colour, ms=4, lw=1.0, label=name)
    axes.set(xlabel="mid hoop's displacement [m]", ylabel="energy above the original's [J]")
    axes.set_xlim(0, max(3.0, *(1.05 * abs(r["middle_imposed"]) for r in shown), 0))
    axes.set_ylim(bottom=0)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize=7, loc="upper left")
    return sheet


def _potential(history: Mapping[str, Any]) -> np.ndarray:
    """Strain and contact less the work of the gas since the original [J]."""
    return np.array(history["strain"]) + np.array(history["contact"]) - np.array(history["pressure"])


# --- words --------------------------------------------------------------------------------------


def rows(runs: Runs) -> list[tuple[str, ...]]:
    """Table 2 for every case, as text."""
    found = []
    for name, r in runs.items():
        mesh, what = name.split(", ", 1)
        contact = "-" if r["first_contact"] is None else f"{r['first_contact']:.3g}"
        found.append(
            (
                mesh,
                what,
                f"{r['volume_original']:.2f}",
                f"{r['volume_imposed']:.2f}",
                f"{r['volume_imposed'] / r['volume_original']:.4f}",
                f"{r['volume_final']:.2f}",
                r["outcome"],
                "-" if r["min_eigenvalue"] is None else f"{r['min_eigenvalue']:.3g}",
                f"{r['residual']:.0e}",
                f"{r['rotation']:.2g}",
                contact,
                f"{100 * r['energy']['error']:.2g} %",
            )
        )
    return found


HEAD = (
    "mesh", "case", "original [m³]", "imposed [m³]", "ratio", "released [m³]", "outcome", "lowest [Pa/m]",
    "residual", "turned [degrees]", "first contact", "ledger",
)  # fmt: skip


def words(numbers: Mapping[str, Any]) -> list[str]:
    """Lines to be printed."""
    table = [HEAD, *rows(numbers["runs"])]
    for angle, (original, imposed, final) in PAPER.items():
        ratio = f"{imposed / original:.4f}"
        cells = ("24x32", f"paper, bend {angle:g} degrees", f"{original}", f"{imposed}", ratio, f"{final}")
        table.append((*cells, "distorted", *("",) * 5))
    widths = [max(len(row[k]) for row in table) for k in range(len(HEAD))]
    text = ["  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip() for row in table]
    for name, ends in numbers["stopped"].items():
        text += ["", f"{name}: let go by forces that fade over {STEP:g} s, and stopped then"]
        text += [
            f"  damping {r['damping']:g}: V = {r['volume']:.2f} m³, mid hoop {r['middle']:.3f} m aside, "
            f"unbalanced {r['unbalanced']:.1e} of the load: {r['outcome']}"
            for r in ends
        ]
    for r in numbers["random"]:
        lowest = "-" if r["min_eigenvalue"] is None else f"{r['min_eigenvalue']:.3g}"
        text.append(
            f"random shape {r['seed']}, {r['support']}: least volume {r['least_volume']:.1f} of "
            f"{r['volume_original']:.1f} m³ on the way, {r['outcome']}, lowest {lowest} Pa/m"
        )
    for v in numbers["volumes"]:
        along, around, order = v["mesh"]
        cells = ("linear", "quadratic")[order - 1]
        text.append(
            f"{along}x{around}, {cells}: {v['drawn']:.3f} m³ drawn, {v['pressurised']:.3f} m³ at 5 Pa"
        )
    return text
