"""Critical pressures of pumpkin balloons of 96 to 160 gores, each from one gore.

The more gores a pumpkin of one size has, the lower is the pressure from which it is unstable. Pagitz and
Pellegrino (Int. J. Solids Struct. 44, 2007) find a power law; the table has the power from one number of
gores to the next, which is not the same everywhere. Isotensoid of 5 m radius, fittings of 0.25 m, lobes
of half angle 60 degrees, tension-field film of 300 MPa and 38 um, tendons of EA = 100 kN without
foreshortening, closed load, bottom fitting held. Three meshes give each pressure and its limit, beside what
another program finds. Writes a chart, a table and the buckling mode of all gores.

    python demos/pumpkin.py --out out/pumpkin
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import lobefem.linalg.dolfinx_compat  # noqa: F401  first: it finds the stack

# isort: split
from lobefem import Balloon, EndPlates, GasPressure, TensionField, find_modes, inflate
from lobefem.files import save_json
from lobefem.geometry.gore import ConstantAngle, Gore
from lobefem.geometry.pumpkin import PumpkinRecipe
from lobefem.geometry.pumpkin_curve import PumpkinCurve
from lobefem.model.cables import Tendons
from lobefem.stability import GorePressures, critical_pressures, full_modes
from lobefem.stability.refinement import Trend, trend
from lobefem.viz.rendering import can_render, render_modes

from mpi4py import MPI

# isort: split
from command import exit_code, pair, parser

GORES = (96, 128, 160)
ELSEWHERE = {96: 804.0, 160: 88.0}  # limits of another program's meshes [Pa]
HARMONICS = range(7)


def pumpkin(gores: int, divisions: tuple[int, int]) -> Balloon:
    """One gore on quadratic quadrilaterals."""
    gore = Gore(PumpkinCurve(5.0, 0.25), gores, ConstantAngle(math.radians(60)))
    surface = PumpkinRecipe(gore, divisions, order=2).surface()
    film = TensionField(E=300e6, nu=0.4, thickness=38e-6, slack_stiffness=1e-5)
    return Balloon(surface, film, [GasPressure("closed"), Tendons(EA=1e5), EndPlates(bar=False)])


def meshes(divisions: Sequence[int]) -> list[tuple[int, int]]:
    """A half, three quarters and all of the cells along a gore and across it."""
    along, across = divisions
    if along % 4 or across % 4:
        raise argparse.ArgumentTypeError(f"{along}x{across}: give multiples of four such as 48x8")
    return [(along * k // 4, across * k // 4) for k in (2, 3, 4)]


def limit(divisions: Sequence[tuple[int, int]], pressures: Sequence[float | None]) -> Trend:
    """The pressure at a mesh size of zero, with its order and its error."""
    sizes = [1 / along for along, _ in divisions]
    return trend(sizes, [math.inf if p is None else p for p in pressures], highest=4.0)


def search(gores: int, divisions: tuple[int, int], near: float) -> GorePressures:
    """The first loss of stability about a pressure that the power law gives [Pa]."""
    balloon = pumpkin(gores, divisions)
    return critical_pressures(balloon, HARMONICS, up_to=2.5 * near, start=0.5 * near, growth=1.5)


def run(
    divisions: Sequence[int] = (48, 8),
    *,
    out: Path = Path("out/pumpkin"),
    gores: Sequence[int] = GORES,
    picture: bool = True,
    comm: Any = MPI.COMM_WORLD,
) -> dict[str, Any]:
    """Compute everything, write it into `out`, and return the numbers. Collective."""
    sizes = meshes(divisions)
    rows = []
    found = None
    for count in gores:
        near = 804.0 * (count / 96) ** -4.3
        searched = [search(count, size, near) for size in sizes]
        pressures = [one.pressure for one in searched]
        found_limit = limit(sizes, pressures)
        rows.append(
            {
                "gores": count,
                "harmonic": searched[-1].harmonic,
                "pressures": pressures,
                "limit": found_limit.limit if found_limit.behaviour == "converges" else None,
                "error": found_limit.error if found_limit.behaviour == "converges" else None,
                "elsewhere": ELSEWHERE.get(count),
            }
        )
        found = found or searched[0]
    numbers = {"meshes": [list(size) for size in sizes], "balloons": rows, "exponents": exponents(rows)}
    if comm.rank == 0:
        out.mkdir(parents=True, exist_ok=True)
        (out / "table.md").write_text(to_markdown(numbers), encoding="utf-8")
        draw(numbers, out / "pumpkin.png")
    save_json(out / "pumpkin.json", numbers, comm)
    possible = comm.bcast(can_render() if comm.rank == 0 else None, root=0)
    if picture and possible and found is not None and found.state is not None:
        # the finest mesh's harmonic on the coarsest, whose full model takes seconds
        state = inflate(found.state.balloon, 0.98 * found.state.pressure, start=found.state)
        lowest = find_modes(state, 1, harmonics=[rows[0]["harmonic"]])
        render_modes(full_modes(lowest), [0], out / "mode.png", pixels=(900, 760))
    return numbers


def exponents(rows: Sequence[dict[str, Any]]) -> list[float]:
    """The m of p ~ N^m between the limits of one balloon and the next."""
    known = [(row["gores"], row["limit"]) for row in rows if row["limit"]]
    return [math.log(q / p) / math.log(n / m) for (m, p), (n, q) in pairwise(known)]


def to_markdown(numbers: dict[str, Any]) -> str:
    """The numbers as a table."""
    sizes = [f"{along} x {across}" for along, across in numbers["meshes"]]
    lines = [
        "Lowest critical pressure [Pa]; quadratic quadrilaterals along and across a gore.",
        "",
        f"| gores | n | {' | '.join(sizes)} | limit | error | another program's limit |",
        "|" + "---|" * (len(sizes) + 5),
    ]
    for row in numbers["balloons"]:
        *shown, other = (
            "" if p is None else f"{p:.4g}" for p in (*row["pressures"], row["limit"], row["elsewhere"])
        )
        error = "" if row["error"] is None else f"{100 * row['error']:.1f} %"
        lines.append(f"| {row['gores']} | {row['harmonic']} | {' | '.join([*shown, error, other])} |")
    if numbers["exponents"]:
        powers = ", ".join(f"{power:.2f}" for power in numbers["exponents"])
        lines += [
            "",
            f"From one balloon to the next the limits go with the number of gores to the power {powers}.",
        ]
    return "\n".join(lines) + "\n"


def draw(numbers: dict[str, Any], path: Path) -> None:
    """The chart of critical pressures over the number of gores."""
    from matplotlib.figure import Figure

    rows = [row for row in numbers["balloons"] if row["limit"]]
    figure = Figure(figsize=(7.5, 5), layout="constrained")
    axes = figure.add_subplot()
    for k, (along, across) in enumerate(numbers["meshes"]):
        shown = [(r["gores"], r["pressures"][k]) for r in rows]
        axes.plot(*zip(*shown, strict=True), "-o", ms=4, lw=0.9, label=f"{along} x {across} cells a gore")
    axes.plot([r["gores"] for r in rows], [r["limit"] for r in rows], "k-", lw=1.5, label="limit")
    other = [(r["gores"], r["elsewhere"]) for r in rows if r["elsewhere"]]
    if other:
        style = {"mfc": "none", "mec": "k", "ms": 10, "label": "another program's limit"}
        axes.plot(*zip(*other, strict=True), "s", **style)
    axes.set(xscale="log", yscale="log", xlabel="gores N", ylabel="critical pressure [Pa]")
    axes.set_xticks([r["gores"] for r in rows], [str(r["gores"]) for r in rows])
    axes.minorticks_off()
    axes.set_title("Pumpkin of 5 m radius, half angle 60 degrees", fontsize=11)
    axes.grid(alpha=0.3, which="both", lw=0.5)
    axes.legend(fontsize=8)
    figure.savefig(path, dpi=150)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the demo from the command line."""
    of = "of the finest mesh, along a gore and across it"
    line = parser("Critical pressures of pumpkins from one gore", "out/pumpkin", "48x8", of)
    options, comm = line.parse_args(argv), MPI.COMM_WORLD
    divisions = pair(options, line, meshes)

    def task() -> list[str]:
        numbers = run(divisions, out=options.out, comm=comm)
        return [to_markdown(numbers), f"chart, table, picture and numbers are in {options.out}"]

    return exit_code(comm, task)


if __name__ == "__main__":
    sys.exit(main())
