"""Eigenvalues against pressure, on the drawn shape and on the one that the gas gives it (paper sec. 5).

The paper's figs 13, 15, 17 and 19 twice: with the geometry held at the ideal isotensoid, and on the
nonlinear equilibrium at each pressure, each found from the one before, its modes followed by likeness.
The wrinkled film has the isotensoid's stress built in and relaxes a little; the isotropic one has none
and stretches. Beside them what the paper says of each figure. Runs serially or under mpirun.

    python demos/eigenvalues.py --out out/eigenvalues
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import lobefem.linalg.dolfinx_compat  # noqa: F401  first: it finds the stack

# isort: split
from command import exit_code, pair, parser, speaker
from paper_words import CASES, Row, compare
from stability import PUBLISHED, curve_numbers, design

from lobefem import CriticalPoint, CriticalPressure, critical_point, critical_pressure, trace
from lobefem.files import save_json
from lobefem.stability.branch_following import Branch
from lobefem.stability.tracing import branches
from lobefem.viz.mode_figures import eigenvalue_curves

from mpi4py import MPI

STATES = ("held", "inflated")
FIGURES = dict(zip(CASES, (13, 17, 15, 19), strict=True))
# closer at the start, where a membrane's modes change most
PRESSURES = (50.0, 100.0, 250.0, *(500.0 * k for k in range(1, 13)))
AROUND = (32, 36)  # divisions around of the meshes on which crossings are compared
COUNT = 40  # modes at each pressure of an inflated path: past its crossing a stack has many local ones

Say = Callable[[str], None]


def describe(name: str, divisions: Sequence[int]) -> Any:
    """Design of a case."""
    size, law = name.split(", ")
    return design(4 if size == "stack" else 1, law, divisions)


def balloon(name: str, state: str, divisions: Sequence[int], comm: Any) -> Any:
    """Balloon of a case; isotropic film to be inflated has no stress built in. Collective."""
    described = describe(name, divisions)
    prestressed = state == "held" or described.film.law != "isotropic"
    return described.balloon(described.surface(comm), prestressed=prestressed)


def held(made: Any, pressures: Sequence[float]) -> tuple[list[Branch], CriticalPressure | None]:
    """Branches of a held geometry, and where it turns unstable. Collective."""
    critical = critical_pressure(made)
    return branches(made, pressures), critical if critical.mode is not None else None


def inflated(made: Any, pressures: Sequence[float], count: int) -> tuple[list[Branch], CriticalPoint | None]:
    """Branches of an inflated path, and where it loses stability, if it does. Collective."""
    path = trace(made, pressures, count=count, state="inflated", refinements=2)
    stable = [modes.stable for modes in path.modes]
    critical = None
    if stable[0] and not all(stable):
        first = stable.index(False)
        start, end = path.pressures[first - 1 : first + 1]
        critical = critical_point(made, start=float(start), limit=float(end), growth=float(end / start))
    return list(path.branches), critical


def crossing(made: Any, state: str, last: float) -> float | None:
    """Pressure of the loss of stability [Pa], below a last one when inflated; None if nowhere. Collective."""
    if state == "held":
        pressure = critical_pressure(made).pressure
    else:
        pressure = critical_point(made, start=min(500.0, last / 8), limit=last, growth=1.5).pressure
    return pressure if math.isfinite(pressure) else None


def run(
    divisions: tuple[int, int] = (24, 32),
    pressures: Sequence[float] = PRESSURES,
    out: str | Path = "out/eigenvalues",
    *,
    around: Sequence[int] = AROUND,
    count: int = COUNT,
    comm: Any = MPI.COMM_WORLD,
    say: Say = lambda text: None,
) -> dict[str, Any]:
    """The whole demo; returns its numbers, by state, on every rank. Collective.

    Args:
        divisions: of each lobe along its meridian, and around.
        pressures: of the curves [Pa]; crossings of inflated states are looked for up to the last one.
        out: folder of figures and tables; the same on all ranks.
        around: divisions around the axis of the meshes on which crossings are compared.
        count: modes at each pressure of an inflated path.
        comm: MPI communicator.
        say: called with a line of text now and then.
    """
    out, last = Path(out), float(pressures[-1])
    if comm.rank == 0:
        out.mkdir(parents=True, exist_ok=True)
    comm.Barrier()
    numbers: dict[str, Any] = {}
    for state in STATES:
        given: dict[str, Any] = {"divisions": list(divisions), "cases": {}, "mesh_study": []}
        for name in CASES:
            say(f"{name}, {state}: eigenvalues at {len(pressures)} pressures")
            made = balloon(name, state, divisions, comm)
            found: list[Branch]
            critical: CriticalPressure | CriticalPoint | None
            if state == "held":
                found, critical = held(made, pressures)
            else:
                found, critical = inflated(made, pressures, count)
            given["cases"][name] = curve_numbers(found, critical)
            if isinstance(critical, CriticalPoint):
                extra = {key: getattr(critical, key) for key in ("point", "projection", "bracket")}
                given["cases"][name] |= extra
            if comm.rank == 0:
                title = f"{'Four lobes' if 'stack' in name else 'One lobe'}, {name.split(', ')[1]}, {state}"
                figure = eigenvalue_curves(
                    found, title=title, critical=critical, published=PUBLISHED.get(name)
                )
                figure.savefig(out / f"fig{FIGURES[name]}_{state}.png")
        for n in around:
            row: dict[str, Any] = {"divisions": [divisions[0], n]}
            for size in ("single", "stack"):
                say(f"{size}, {state}: crossing on {divisions[0]} x {n} divisions")
                made = balloon(f"{size}, fixed-wrinkles", state, row["divisions"], comm)
                row[size] = crossing(made, state, last)
            given["mesh_study"].append(row)
        given["paper"] = [row._asdict() for row in compare(given)]
        numbers[state] = given
    if comm.rank == 0:
        (out / "eigenvalues.md").write_text(page(numbers), encoding="utf-8")
    save_json(out / "eigenvalues.json", numbers, comm)
    return numbers


def page(numbers: dict[str, Any]) -> str:
    """Figures, and below each the paper's statements about it beside ours, in Markdown."""
    ours = [[Row(**row) for row in numbers[state]["paper"]] for state in STATES]
    lines = [
        "# Eigenvalues against pressure",
        "",
        "Edge radius 2 m, `film` pressure, bottom plate clamped, bar; {} x {} linear triangles a lobe, unit "
        "areal mass. Held: the isotensoid as drawn. Inflated: the equilibrium at each pressure.".format(
            *numbers["held"]["divisions"]
        ),
    ]
    for figure in sorted(FIGURES.values()):
        images = " | ".join(f"![Fig. {figure}, {state}](fig{figure}_{state}.png)" for state in STATES)
        lines += ["", f"## Fig. {figure}", "", "| held | inflated |", "|---|---|", f"| {images} |", ""]
        lines += ["| paper, sec. 5 | held | verdict | inflated | verdict |", "|---|---|---|---|---|"]
        for left, right in zip(*ours, strict=True):
            if left.figure == figure:
                cells = (left.paper, left.here, left.verdict, right.here, right.verdict)
                lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def main(argv: Sequence[str] | None = None) -> int:
    """Run the demo from the command line."""
    line = parser("Eigenvalues against pressure (paper sec. 5)", "out/eigenvalues", "24x32")
    options, comm = line.parse_args(argv), MPI.COMM_WORLD
    divisions, say = pair(options, line), speaker(comm, clock=True)
    return exit_code(comm, lambda: [page(run(divisions, out=options.out, comm=comm, say=say))])


if __name__ == "__main__":
    sys.exit(main())
