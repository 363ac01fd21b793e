"""How hard is it to push the top of a stack sideways? Force against displacement (paper fig. 22).

Five lobes, the bottom clamped, pressurised to 5 Pa; then the top centre is displaced by delta along x
and the force on it is read off. Tension-field film with the isotensoid's stress built in. The same is
repeated on the meshes of the mesh study. Runs serially or under mpirun.

    python demos/tip_displacement.py --out out/tip
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import lobefem._dolfinx  # noqa: F401  first: it finds the stack

# isort: split
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from mpi4py import MPI

from lobefem.design import Design
from lobefem.distortions import Increment, Tip, distort
from lobefem.equilibrium import inflate
from lobefem.errors import ConvergenceError, LobefemError
from lobefem.storage import save_json

LOBES, PRESSURE = 5, 5.0
INCREMENT = 0.05  # of the displacement [m]
SHOWN = 0.7  # the end of the paper's curve [m]
SOFTENING = 0.1  # where the paper sees it soften [m]

Say = Callable[[str], None]


def design(divisions: Sequence[int], lobes: int = LOBES) -> Design:
    """The paper's design; its edge radius, film and hoops are the defaults."""
    return Design.parse(
        {
            "shape": {"lobes": lobes},
            "mesh": {"divisions": list(divisions)},
            "film": {"law": "tension-field", "prestress": True},
            "hoops": {"enabled": True},
            "plates": {"support": "clamped"},
            "pressure": {"load": "closed"},
        }
    )


def push(
    divisions: Sequence[int], displacement: float, comm: Any, say: Say, lobes: int = LOBES
) -> tuple[tuple[Increment, ...], str | None]:
    """Inflate and displace the top: the increments, and why they ended early if they did. Collective."""
    made = design(divisions, lobes)
    start = inflate(made.balloon(made.surface(comm)), PRESSURE)
    steps = max(round(displacement / INCREMENT), 1)
    name = f"{divisions[0]} x {divisions[1]}"
    try:
        pushed = distort(
            start,
            Tip(displacement),
            steps=steps,
            min_step=0.1 / steps,
            progress=lambda text: say(f"{name}: {text}"),
        )
    except ConvergenceError as error:
        return error.data["history"], str(error)
    return pushed.history, None


def curve(history: Sequence[Increment], stopped: str | None) -> dict[str, Any]:
    """The increments as lists, and what is said of the curve."""
    records = [asdict(record) for record in history]
    found: dict[str, Any] = {key: [record[key] for record in records] for key in records[0]}
    force = np.array(found["reaction"])
    found["most_force"] = float(force.max())
    found["most_force_at"] = found["parameter"][int(force.argmax())]
    found["stopped"] = stopped
    return found


def run(
    meshes: Sequence[tuple[int, int]],
    displacement: float = 1.6,
    out: Path = Path("out/tip"),
    *,
    lobes: int = LOBES,
    comm: Any = MPI.COMM_WORLD,
    say: Say = lambda text: None,
) -> dict[str, Any]:
    """The curve on each mesh, the first one being the one meant; writes JSON and a figure. Collective."""
    curves = {f"{a} x {b}": curve(*push((a, b), displacement, comm, say, lobes)) for a, b in meshes}
    numbers = {"pressure": PRESSURE, "lobes": lobes, "curves": curves}
    if comm.rank == 0:
        out.mkdir(parents=True, exist_ok=True)
        figure(curves, lobes).savefig(out / "tip_displacement.png", dpi=200)
    save_json(out / "tip_displacement.json", numbers, comm)
    return numbers


def figure(curves: dict[str, Any], lobes: int = LOBES) -> Figure:
    """Force and volume against the displacement."""
    sheet = Figure(figsize=(7.0, 3.0), layout="constrained")
    FigureCanvasAgg(sheet)
    left, right = sheet.subplots(1, 2)
    for (name, found), colour in zip(
        curves.items(), ("#0072B2", "#D55E00", "#009E73", "#B4588F"), strict=False
    ):
        delta, volume = np.array(found["parameter"]), np.array(found["volume"])
        left.plot(
            delta, found["reaction"], color=colour, marker=".", markersize=3, lw=1, label=f"{name} a lobe"
        )
        right.plot(delta, 100 * (volume / volume[0] - 1), color=colour, lw=1)
    left.set_ylabel("force on the top centre [N]")
    right.set_ylabel("change of volume [%]")
    for axes in (left, right):
        axes.set_xlabel("displacement of the top centre [m]")
        axes.axvline(SHOWN, color="0.7", lw=0.6, ls=":")
        axes.margins(x=0)
        axes.spines[["top", "right"]].set_visible(False)
    left.set_ylim(bottom=0)
    left.text(
        SHOWN,
        0.02,
        " end of the\n paper's curve",
        color="0.4",
        fontsize=7,
        transform=left.get_xaxis_transform(),
    )
    left.legend(frameon=False, fontsize=7, loc="center right", title="divisions", title_fontsize=7)
    sheet.suptitle(
        f"{lobes} lobes at {PRESSURE:g} Pa, bottom clamped, top pushed sideways (paper fig. 22)", fontsize=9
    )
    return sheet


def words(numbers: dict[str, Any]) -> list[str]:
    """What the curves say beside the paper's sec. 6.1."""
    name, found = next(iter(numbers["curves"].items()))
    delta, force = np.array(found["parameter"]), np.array(found["reaction"])

    def stiffness(a: float, b: float) -> float:
        return float((np.interp(b, delta, force) - np.interp(a, delta, force)) / (b - a))

    end = min(SHOWN, delta[-1])
    early, late = stiffness(0, SOFTENING / 2), stiffness(SOFTENING, end)
    text = [
        f"{name}: {early:.3g} N/m at first, {late:.3g} N/m from {SOFTENING:g} m to {end:g} m (paper: softens "
        f"from about {SOFTENING:g} m, stiffness positive to {SHOWN:g} m)",
        f"{name}: force {np.interp(end, delta, force):.3g} N at {end:g} m; the greatest, "
        f"{found['most_force']:.3g} N, at {found['most_force_at']:.3g} m",
    ]
    for other, second in list(numbers["curves"].items())[1:]:
        there = np.interp(end, second["parameter"], second["reaction"])
        text.append(f"{other}: force {there:.3g} N at {end:g} m")
    text += [f"{mesh}: {each['stopped']}" for mesh, each in numbers["curves"].items() if each["stopped"]]
    return text


def main(argv: Sequence[str] | None = None) -> int:
    """Run the demo from the command line."""
    parser = argparse.ArgumentParser(description="Force against tip displacement (paper fig. 22)")
    parser.add_argument("--out", type=Path, default=Path("out/tip"), help="folder to write to")
    parser.add_argument("--divisions", default="24x32,12x16", help="of a lobe, one mesh or more")
    parser.add_argument("--displacement", type=float, default=1.6, help="of the top centre [m]")
    options = parser.parse_args(argv)
    comm, begin = MPI.COMM_WORLD, time.monotonic()
    try:
        meshes = [tuple(int(n) for n in part.split("x")) for part in options.divisions.split(",")]
        meshes = [(along, around) for along, around in meshes]
    except ValueError:
        parser.error(f"--divisions {options.divisions}: give pairs of integers such as 24x32,12x16")

    def say(text: str) -> None:
        if comm.rank == 0:
            print(f"[{time.monotonic() - begin:5.1f} s] {text}", file=sys.stderr, flush=True)

    try:
        numbers = run(meshes, options.displacement, options.out, comm=comm, say=say)
    except LobefemError as error:
        if comm.rank == 0:
            print(f"demo: {error}", file=sys.stderr)
        return error.exit_code
    if comm.rank == 0:
        print("\n".join(words(numbers)))
        print(f"{time.monotonic() - begin:.0f} s; figure and numbers are in {options.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
