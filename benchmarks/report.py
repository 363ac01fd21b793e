"""The comparison as Markdown, and as a figure of time against unknowns."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

__all__ = ["NOTE", "as_markdown", "exponent", "figure", "stages_as_markdown", "write_report"]

Row = dict[str, Any]
_HEAD = (
    "mesh", "unknowns", "program", "seconds", "ratio", "CPU s", "MB", "iterations", "errors of V, u", "note",
)  # fmt: skip
NOTE = """The ratio is the time of a program over that of lobefem. Errors are relative to the answers on
which the programs agree. A time counts if the volume is right to 1e-7 and the largest displacement to 1e-5.
MB is the peak of the largest process. The note of lobefem has two numbers: its solve over its floor, the
numeric factorisations and triangular solves, and over the floor of Newton's method on one mesh with a new
tangent in each step (next row)."""


def exponent(rows: list[Row]) -> float | None:
    """The b of seconds ~ unknowns^b through the right answers, least squares of logarithms."""
    right = [row for row in rows if row["right"]]
    if len(right) < 2:
        return None
    x, y = (np.log([row[key] for row in right]) for key in ("unknowns", "seconds"))
    return float(np.polyfit(x, y, 1)[0])


def write_report(folder: Path, rows: list[Row], first: list[Row]) -> None:
    """Write results.md and scaling.png into a folder.

    Args:
        folder: where.
        rows: the medians.
        first: the runs before all others, in which lobefem compiles its forms.
    """
    parts = []
    for case in dict.fromkeys(row["case"] for row in rows):
        parts += [f"### {case.capitalize()}", "", as_markdown(case, rows)]
    parts += [_compiled(row) for row in first if row.get("profile")]
    parts += [NOTE, "", "![time against unknowns](scaling.png)", ""]
    (folder / "results.md").write_text("\n".join(parts), encoding="utf-8")
    figure(rows).savefig(folder / "scaling.png", dpi=120)


def as_markdown(case: str, rows: list[Row]) -> str:
    """The table of one case, and how each program's time grows."""
    lines = ["| " + " | ".join(_HEAD) + " |", "|" + " --- |" * len(_HEAD)]
    lines += [_line(row, rows) for row in rows if row["case"] == case]
    grows = []
    for program in dict.fromkeys(row["program"] for row in rows):
        of = [row for row in rows if (row["case"], row["program"]) == (case, program)]
        if (b := exponent(of)) is not None:
            grows.append(f"{program} {b:.2f}")
    if grows:
        lines += ["", f"Time grows as a power of the unknowns: {', '.join(grows)}."]
    lines.append("")
    return "\n".join(lines)


def stages_as_markdown(case: str, rows: list[Row]) -> str:
    """Table of lobefem's seconds by stage in one case, the stages that take any."""
    of = [row for row in rows if (row["case"], row["program"], row["right"]) == (case, "lobefem", True)]
    seconds = {name: [row["stages"][name] for row in of] for name in (of[0]["stages"] if of else ())}
    head = ["", *("{}x{}".format(*row["divisions"]) for row in of)]
    lines = [head, ["---"] * len(head)]
    lines += [[name, *(f"{t:.3f}" for t in ts)] for name, ts in seconds.items() if max(ts) >= 0.005]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def _compiled(row: Row) -> str:
    """Seconds that lobefem's first run of a case spent on its forms."""
    seconds = row["profile"]["stages"]["form compilation"]["seconds"]
    return f"Compiled forms are kept: the first run, {row['case']}, took {seconds:.1f} s for them.  "


def _line(row: Row, rows: list[Row]) -> str:
    alike = {
        other["program"]: other
        for other in rows
        if (other["case"], other["divisions"], other["right"]) == (row["case"], row["divisions"], True)
    }
    ratio = ""
    if row["right"] and "lobefem" in alike:
        ratio = f"{row['seconds'] / alike['lobefem']['seconds']:.2f}"
    note = row["reason"]
    if row.get("over_floor"):
        note = f"{row['over_floor']:.2f} x its floor"
        if row["program"] == "lobefem" and "lobefem, Newton" in alike:
            note += f", {row['solve'] / alike['lobefem, Newton']['floor']:.2f} x Newton's"
    errors = ""
    if row["volume_error"] is not None:
        errors = f"{row['volume_error']:.0e}, {row['displacement_error']:.0e}"
    cells = (
        "{}x{}".format(*row["divisions"]),
        row["unknowns"],
        row["program"],
        f"{row['seconds']:.2f}" if row["right"] else "",
        ratio,
        f"{row['cpu']:.2f}" if row["right"] else "",
        f"{row['memory']:.0f}" if row["right"] else "",
        f"{row['iterations']:g}" if row["iterations"] is not None else "",
        errors,
        note,
    )
    return "| " + " | ".join(map(str, cells)) + " |"


def figure(rows: list[Row]) -> Figure:
    """Time against unknowns, logarithmic, a panel a case."""
    cases = list(dict.fromkeys(row["case"] for row in rows))
    result = Figure(figsize=(5 * len(cases), 4), layout="constrained")
    panels = result.subplots(1, len(cases), sharey=True, squeeze=False)[0]
    for ax, case in zip(panels, cases, strict=True):
        for k, program in enumerate(dict.fromkeys(row["program"] for row in rows)):
            of = [r for r in rows if (r["case"], r["program"], r["right"]) == (case, program, True)]
            if not of:
                continue
            b = exponent(of)
            label = program if b is None else f"{program}, exponent {b:.2f}"
            unknowns, seconds = ([r[key] for r in of] for key in ("unknowns", "seconds"))
            ax.loglog(unknowns, seconds, "oPs^Dv"[k % 6] + "-", label=label)
        ax.set_title(case)
        ax.set_xlabel("unknowns")
        ax.grid(alpha=0.3, which="both")
        ax.legend(fontsize=8)
    panels[0].set_ylabel("whole process [s]")
    return result
