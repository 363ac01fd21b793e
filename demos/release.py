"""Does a displaced stack return when it is let go, and what does damping have to do with it (paper sec. 6)?

A four-lobe stack under 5 Pa leans to one side, the film sheared with it, and is let go: damped motion,
equilibrium without damping, lowest eigenvalue. Once until it rests, and, as with Abaqus's STABILIZE,
stopped after one second with much damping, a tenth and a hundredth of it. Runs serially or under mpirun.

    python demos/release.py --out out/release
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import lobefem.linalg.dolfinx_compat  # noqa: F401  first: it finds the stack

# isort: split
import numpy as np

from lobefem import Balloon, EndPlates, GasPressure, Hoops, TensionField, inflate, lobed_cylinder
from lobefem.equilibrium.gradient_flow import Record
from lobefem.equilibrium.solver_options import FlowOptions
from lobefem.equilibrium.state import State
from lobefem.files import save_json
from lobefem.stability.relaxation import release

from mpi4py import MPI

# isort: split
from command import exit_code, folder, pair, parser, speaker

PRESSURE = 5.0  # [Pa]
DAMPINGS = (10.0, 1.0, 0.1)
STEP = 1.0  # duration of a step of the paper's [s]

Say = Callable[[str], None]


def leaning(balloon: Balloon, degrees: float) -> State:
    """The balloon sheared sideways, its bar leaning by an angle, the plates level."""
    motion, x = balloon.motion, balloon.V.tabulate_dof_coordinates()
    lean, height = math.radians(degrees), x[:, 2] - motion.centres[0][2]
    displacement = np.zeros_like(x)
    displacement[:, 0] = math.sin(lean) * height
    displacement[:, 2] = (math.cos(lean) - 1) * height
    q = balloon.map.create_vector()
    free = balloon.map.free
    with q as array:
        array[: free.size] = displacement.ravel()[free]
        if array.size > free.size:  # the rank that holds the plates' parameters
            parameters = array[free.size :]
            parameters[[motion.names.index(f"bar_tilt_{k}") for k in (1, 2)]] = motion.tilts([0, lean, 0])
    return State(balloon, PRESSURE, PRESSURE, q.array_r.copy())


def run(
    divisions: tuple[int, int] = (12, 16),
    lobes: int = 4,
    degrees: float = 4.0,
    out: str | Path = "out/release",
    *,
    load: str = "closed",
    support: str = "clamped",
    comm: Any = MPI.COMM_WORLD,
    say: Say = lambda text: None,
) -> dict[str, Any]:
    """The whole demo; returns its numbers on every rank. Collective."""
    out = folder(out, comm)
    surface = lobed_cylinder(lobes, divisions, comm=comm)
    parts = [GasPressure(load), Hoops(), EndPlates(support=support)]
    balloon = Balloon(surface, TensionField(), parts, prestressed=True)
    rest = inflate(balloon, PRESSURE)
    start = leaning(balloon, degrees)
    free = release(start, undistorted=rest, progress=say)
    numbers: dict[str, Any] = {
        "load": load,
        "support": support,
        "volume": rest.volume,
        "outcome": free.outcome,
        "reason": free.reason,
        "lowest": free.lowest,
        "ledger": vars(free.ledger) | {"error": free.ledger.error},
        "steps": len(free.history) - 1,
        "stopped": [],
    }
    for damping in DAMPINGS:
        stopped = release(
            start,
            undistorted=rest,
            options=FlowOptions(damping=damping, end_time=STEP),
            count=1,
            progress=say,
        )
        last = stopped.history[-1]
        numbers["stopped"].append(
            {
                "damping": damping,
                "time": last.time,
                "unbalanced": last.relative_residual,
                "top": last.top,
                "volume": last.volume,
                "outcome": stopped.outcome,
                "reason": stopped.reason,
            }
        )
    if comm.rank == 0:
        plot(free.history, rest.volume, out / "release.png", f"{free.outcome}: {load}, {support}")
    save_json(out / "release.json", numbers, comm)
    return numbers


def plot(history: Sequence[Record], volume: float, path: Path, title: str) -> None:
    """Volume, ledger and unbalanced force over time. Not collective."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 9), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(3, 1, sharex=True)
    steps = history[1:]
    time = [r.time for r in steps]
    axes[0].set_title(title)
    axes[0].plot(time, [r.volume for r in steps], ".-", label="volume")
    axes[0].axhline(volume, color="0.6", lw=1, label="undistorted")
    axes[0].set_ylabel("enclosed volume [m³]")
    for name in ("pressure", "strain", "damping"):
        axes[1].plot(time, [getattr(r.ledger, name) for r in steps], ".-", label=name)
    axes[1].plot(time, [r.ledger.closure for r in steps], "k--", label="missing")
    axes[1].set_yscale("symlog", linthresh=1.0)
    axes[1].set_ylabel("energy since release [J]")
    axes[2].loglog(time, [r.relative_residual for r in steps], ".-", label="unbalanced force over load")
    axes[2].set_ylabel("unbalanced force / load")
    axes[2].set_xlabel("time [s] at damping 1")
    for ax in axes:
        ax.grid(alpha=0.3)
        ax.legend()
    figure.savefig(path, dpi=130)


def words(numbers: dict[str, Any]) -> list[str]:
    """The outcome in lines."""
    ledger = numbers["ledger"]
    return [
        f"{numbers['outcome']}: {numbers['reason']}; {numbers['steps']} steps",
        f"energy ledger closes to {100 * ledger['error']:.2g} %",
        *(
            f"damping {row['damping']:g}, after {row['time']:.2g} s: top at {row['top'][0]:.3f} m, "
            f"unbalanced {row['unbalanced']:.1e} of the load, V = {row['volume']:.2f} m³: "
            f"{row['outcome']}"
            for row in numbers["stopped"]
        ),
    ]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the demo from the command line."""
    line = parser("Release of a leaning stack (paper sec. 6)", "out/release", "12x16")
    line.add_argument("--load", default="closed", help="closed or film")
    line.add_argument("--support", default="clamped", help="clamped or pinned")
    options, comm = line.parse_args(argv), MPI.COMM_WORLD
    divisions, choice = pair(options, line), {"load": options.load, "support": options.support}
    return exit_code(
        comm, lambda: words(run(divisions, out=options.out, comm=comm, say=speaker(comm), **choice))
    )


if __name__ == "__main__":
    sys.exit(main())
