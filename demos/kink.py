"""Taut or wrinkled? Stability of tension-field film at the ideal isotensoid, where it is both.

One lobe of the paper's design, rims held, geometry held at the ideal shape. There the tension field has
two tangents; a hoop slack s > 0 makes it wrinkled, with one. Writes the critical pressure of each harmonic
n for s = 0 (both tangents, and their mean) and for some slacks as a chart and a table, the lowest
eigenvalues of the tangents, and a mesh study over all harmonics. See `lobefem.stability.one_sided` for what
bounds what.

    python demos/kink.py --out out/kink
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import lobefem.linalg.dolfinx_compat  # noqa: F401  first: it finds the stack

# isort: split
from lobefem import Balloon, EndPlates, GasPressure, TensionField, lobed_cylinder
from lobefem.files import save_json
from lobefem.stability.one_sided import one_sided_modes, one_sided_pressures, slack_critical_pressure

from mpi4py import MPI

# isort: split
from command import exit_code, pair, parser

HARMONICS = tuple(range(2, 9))
SLACKS = (1e-4, 1e-3, 1e-2)
AROUND = (16, 24, 32)  # of the mesh study
PRESSURE = 1000.0  # of the spectra [Pa]


def lobe(divisions: Sequence[int], comm: Any, slack: float = 0.0, order: int = 2) -> Balloon:
    """One lobe of tension field film on quadrilaterals, both rims held."""
    surface = lobed_cylinder(1, (divisions[0], divisions[1]), cell="quadrilateral", order=order, comm=comm)
    parts = [GasPressure("film"), EndPlates("fixed")]
    film = TensionField(slack_stiffness=0.0)
    return Balloon(surface, film, parts, prestressed=True, hoop_slack=slack)


def run(
    divisions: Sequence[int] = (16, 32),
    *,
    out: Path = Path("out/kink"),
    harmonics: Sequence[int] = HARMONICS,
    around: Sequence[int] = AROUND,
    comm: Any = MPI.COMM_WORLD,
) -> dict[str, Any]:
    """Compute everything, write chart, table and numbers into `out`, and return the numbers. Collective."""
    ideal = lobe(divisions, comm)
    found = {n: one_sided_pressures(ideal, harmonic=n) for n in harmonics}
    slackened = {s: lobe(divisions, comm, s) for s in SLACKS}
    rows = [
        {
            "harmonic": n,
            "wrinkled": _finite(found[n].wrinkled.pressure),
            "slack": {
                str(s): _finite(slack_critical_pressure(b, harmonic=n).pressure) for s, b in slackened.items()
            },
            "mean": _finite(found[n].mean.pressure),
            "taut": _finite(found[n].taut.pressure),
        }
        for n in harmonics
    ]
    spectra = one_sided_modes(lobe(divisions, comm, order=1), PRESSURE, count=6)
    study = []
    for count in around:
        both = one_sided_pressures(lobe((3 * count // 4, count), comm, order=1))
        study.append(
            {
                "around": count,
                "wrinkled": _finite(both.wrinkled.pressure),
                "wrinkled_harmonic": both.wrinkled.mode.harmonic if both.wrinkled.mode else None,
                "mean": _finite(both.mean.pressure),
            }
        )
    numbers = {
        "divisions": list(divisions),
        "critical": rows,
        "spectra": {
            name: [{"value": m.value.real, "harmonic": m.harmonic} for m in modes.modes]
            for name, modes in vars(spectra).items()
        },
        "mesh_study": study,
    }
    if comm.rank == 0:
        out.mkdir(parents=True, exist_ok=True)
        (out / "table.md").write_text(to_markdown(numbers), encoding="utf-8")
        draw(numbers, out / "kink.png")
    save_json(out / "kink.json", numbers, comm)
    return numbers


def _finite(pressure: float) -> float | None:
    return pressure if math.isfinite(pressure) else None


def _pascal(pressure: float | None) -> str:
    return "none" if pressure is None else f"{pressure:.0f}"


def to_markdown(numbers: dict[str, Any]) -> str:
    """The numbers as three tables."""
    along, around = numbers["divisions"]
    lines = [
        f"Critical pressure [Pa] of each harmonic n; one lobe, rims held, {along} x {around} quadratic "
        "quadrilaterals.",
        "",
        "| n | wrinkled, s = 0 (lower bound) | "
        + " | ".join(f"s = {s:g}" for s in SLACKS)
        + " | mean (upper bound) | taut |",
        "|" + "---|" * (len(SLACKS) + 4),
    ]
    for row in numbers["critical"]:
        cells = [row["wrinkled"], *row["slack"].values(), row["mean"], row["taut"]]
        lines.append(f"| {row['harmonic']} | " + " | ".join(_pascal(p) for p in cells) + " |")
    lines += [
        "",
        f"Lowest eigenvalues [Pa/m] at {PRESSURE:g} Pa, unit areal mass, linear cells, (harmonic).",
        "",
        "| wrinkled | mean | taut |",
        "|---|---|---|",
    ]
    columns = ([f"{m['value']:.1f} ({m['harmonic']})" for m in v] for v in numbers["spectra"].values())
    lines += [f"| {' | '.join(row)} |" for row in zip(*columns, strict=False)]
    lines += [
        "",
        "Lowest critical pressure [Pa] of all harmonics, linear cells. The wrinkled one belongs to the mesh: "
        "it tends to 0, for in the continuum n >= 13 is unstable at any pressure.",
        "",
        "| divisions around | wrinkled (n) | mean |",
        "|---|---|---|",
    ]
    lines += [
        f"| {r['around']} | {_pascal(r['wrinkled'])} ({r['wrinkled_harmonic']}) | {_pascal(r['mean'])} |"
        for r in numbers["mesh_study"]
    ]
    return "\n".join(lines) + "\n"


def draw(numbers: dict[str, Any], path: Path) -> None:
    """The chart of critical pressures over n, the bounds shaded."""
    from matplotlib.figure import Figure

    rows = [r for r in numbers["critical"] if r["wrinkled"] and r["mean"] and r["taut"]]
    n = [r["harmonic"] for r in rows]
    figure = Figure(figsize=(7.5, 5), layout="constrained")
    axes = figure.add_subplot()
    wrinkled, mean, taut = ([r[k] for r in rows] for k in ("wrinkled", "mean", "taut"))
    axes.fill_between(
        n, wrinkled, mean, color="tab:blue", alpha=0.12, lw=0, label="s = 0: between these bounds"
    )
    axes.plot(n, taut, "-^", color="tab:gray", ms=4, label="taut tangent (isotropic film)")
    axes.plot(n, mean, "-s", color="tab:blue", ms=4, label="mean tangent: upper bound")
    axes.plot(n, wrinkled, "-o", color="tab:red", ms=4, label="wrinkled tangent: lower bound")
    for s, marker, size in zip(SLACKS, ("x", "+", "o"), (6, 9, 12), strict=True):
        values = [r["slack"][str(s)] for r in rows]
        face = {"markerfacecolor": "none"} if marker == "o" else {}
        axes.plot(n, values, marker, color="k", ms=size, mew=0.8, label=f"hoop slack s = {s:g}", **face)
    axes.set_yscale("log")
    axes.set_xticks(n)
    axes.set_xlabel("harmonic n (waves around)")
    axes.set_ylabel("critical pressure [Pa]")
    axes.set_title("Tension field at the ideal isotensoid: one lobe, rims held", fontsize=11)
    axes.grid(alpha=0.3, which="both", lw=0.5)
    axes.legend(fontsize=8, loc="center right", bbox_to_anchor=(0.99, 0.56))
    figure.savefig(path, dpi=150)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the demo from the command line."""
    line = parser("Tension field where it is taut and wrinkled at once", "out/kink", "16x32")
    options, comm = line.parse_args(argv), MPI.COMM_WORLD
    divisions = pair(options, line)

    def task() -> list[str]:
        numbers = run(divisions, out=options.out, comm=comm)
        return [to_markdown(numbers), f"chart, table and numbers are in {options.out}"]

    return exit_code(comm, task)


if __name__ == "__main__":
    sys.exit(main())
