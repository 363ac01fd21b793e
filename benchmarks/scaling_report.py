"""The scaling runs as Markdown tables, and as a figure of time and memory against unknowns."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

__all__ = [
    "exponent",
    "figure",
    "runs_table",
    "solvers_table",
    "speedup_table",
    "table",
    "work_table",
    "write_report",
]

Record = dict[str, Any]


def table(head: list[str], rows: list[list[Any]]) -> str:
    """A Markdown table; numbers to three digits unless they are text already."""
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    lines += ["| " + " | ".join(c if isinstance(c, str) else f"{c:.3g}" for c in row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def exponent(records: list[Record], clock: str = "cpu") -> float:
    """The b of time ~ unknowns^b from the first record to the last, start of the process left out."""
    times = [r["whole"][clock] - r["start"][clock] for r in (records[0], records[-1])]
    return float(np.log(times[1] / times[0]) / np.log(records[-1]["unknowns"] / records[0]["unknowns"]))


def _of(records: list[Record], ranks: int) -> list[Record]:
    return sorted((r for r in records if r["ranks"] == ranks), key=lambda r: r["unknowns"])


def runs_table(records: list[Record]) -> str:
    """Whole runs: time of each step, Newton steps, memory; then the exponents."""
    head = [
        "unknowns",
        "ranks",
        "start [s]",
        "mesh",
        "set-up",
        "inflate",
        "modes",
        "whole [s]",
        "elapsed [s]",
    ]
    head += ["Newton steps", "factorisations", "memory [GB]", "bytes an unknown"]
    rows = []
    for r in sorted(records, key=lambda r: (r["unknowns"], r["ranks"])):
        steps = [r["steps"][name]["cpu"] for name in ("mesh", "set-up", "inflate", "modes")]
        row = [str(r["unknowns"]), str(r["ranks"]), r["start"]["cpu"], *steps, r["whole"]["cpu"]]
        factorisations = r["tangents"] - 1 + r["factorisations"]
        row += [r["whole"]["seconds"], str(r["newton"]), str(factorisations), r["memory"] / 1024]
        rows.append([*row, f"{r['memory'] * 2**20 / r['unknowns']:.0f}"])
    lines = [table(head, rows)]
    for ranks in sorted({r["ranks"] for r in records}):
        of = _of(records, ranks)
        if len(of) > 1:
            lines.append(f"On {ranks} rank(s) the time grows as unknowns^{exponent(of):.2f}.\n")
    return "\n".join(lines)


def work_table(records: list[Record]) -> str:
    """Each kind of work alone."""
    head = [
        "unknowns",
        "ranks",
        "residual [s]",
        "tangent",
        "analysis",
        "factorisation",
        "compressed",
        "solve",
    ]
    head += ["factor entries an unknown", "Gflop", "largest front"]
    rows = []
    for r in sorted(records, key=lambda r: (r["unknowns"], r["ranks"])):
        names = ("residual", "tangent", "symbolic", "numeric", "compressed", "solve")
        parts = [r["parts"][name]["cpu"] for name in names]
        factors = r["factors"]
        rows.append([str(r["unknowns"]), str(r["ranks"]), *parts])
        rows[-1] += [
            f"{factors['entries'] / r['unknowns']:.0f}",
            factors["flops"] / 1e9,
            str(factors["front"]),
        ]
    return table(head, rows)


def speedup_table(records: list[Record]) -> str:
    """Table of speed-ups by the second rank."""
    head = ["unknowns", "assembly", "factorisation", "solve", "inflate", "modes", "whole"]
    rows = []
    for one in _of(records, 1):
        two = [r for r in _of(records, 2) if r["divisions"] == one["divisions"]]
        if not two:
            continue

        def gain(*path: str, one: Record = one, two: Record = two[0]) -> float:
            return _at(one, path) / _at(two, path)

        assembly = [sum(r["parts"][name]["cpu"] for name in ("residual", "tangent")) for r in (one, two[0])]
        row = [str(one["unknowns"]), assembly[0] / assembly[1]]
        row += [gain("parts", name, "cpu") for name in ("numeric", "solve")]
        row += [gain("steps", name, "cpu") for name in ("inflate", "modes")] + [gain("whole", "cpu")]
        rows.append([row[0], *(f"{value:.2f}" for value in row[1:])])
    return table(head, rows)


def _at(record: Record, path: tuple[str, ...]) -> float:
    value: Any = record
    for key in path:
        value = value[key]
    return value


def solvers_table(records: list[Record]) -> str:
    """One Newton step's system by other solvers, on one rank."""
    head = ["unknowns", "solver", "set-up [s]", "solve [s]", "iterations", "relative residual"]
    rows = []
    for r in _of(records, 1):
        for s in r.get("solvers", ()):
            steps = str(s["iterations"]) if s["converged"] else f"stopped at {s['iterations']}"
            row = [str(r["unknowns"]), s["solver"], s["setup"], s["solve"], steps, f"{s['residual']:.0e}"]
            rows.append(row)
    return table(head, rows)


def figure(records: list[Record]) -> Any:
    """Time and memory against unknowns, a line for each number of ranks."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    drawing = Figure(figsize=(9, 3.6), layout="constrained", dpi=150)
    FigureCanvasAgg(drawing)
    time, memory = drawing.subplots(1, 2)
    for ranks in sorted({r["ranks"] for r in records}):
        of = _of(records, ranks)
        x = [r["unknowns"] for r in of]
        spent = [r["whole"]["cpu"] - r["start"]["cpu"] for r in of]
        label = f"{ranks} rank" + "s" * (ranks > 1)
        power = f", unknowns^{exponent(of):.2f}" if len(of) > 1 else ""
        time.loglog(x, spent, "os^"[ranks % 3] + "-", label=label + power)
        memory.loglog(x, [r["memory"] / 1024 for r in of], "os^"[ranks % 3] + "-", label=label)
    time.set_ylabel("time of the busiest rank [s]")
    memory.set_ylabel("memory in all [GB]")
    for axes in (time, memory):
        axes.set_xlabel("unknowns")
        axes.grid(alpha=0.3, which="both")
        axes.legend(fontsize=8)
        axes.spines[["top", "right"]].set_visible(False)
    return drawing


def write_report(folder: Path, records: list[Record]) -> None:
    """Write scaling.md and scaling.png into a folder."""
    lines = []
    for load in sorted({r["load"] for r in records}):
        of = [r for r in records if r["load"] == load]
        lines += [
            f"## {load.capitalize()} load\n",
            runs_table(of),
            "Each kind of work alone:\n",
            work_table(of),
        ]
        lines += ["One rank's time over that of the busiest of two:\n", speedup_table(of)]
        if any("solvers" in r for r in of):
            lines += ["Other solvers of one Newton step's system:\n", solvers_table(of)]
        figure(of).savefig(folder / ("scaling.png" if load == "closed" else f"scaling_{load}.png"))
    (folder / "scaling.md").write_text("\n".join(lines), encoding="utf-8")
