"""Pressurisation by initial stress and by the prescribed load path (paper secs. 4 and 6, fig. 20).

Two lobes at 5 Pa, quadrilaterals, one end of the bar fixed: meridional and hoop stress along the
meridian of both methods against eq. 4, the hoop stress that each leaves, what the standard law makes
of it afterwards, and Newton's iterations with the secant and with the consistent tangent. Runs
serially or under mpirun.

    python demos/load_path.py --out out/load_path
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import lobefem.linalg.dolfinx_compat  # noqa: F401  first: it finds the stack

# isort: split
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from lobefem import (
    IMP,
    Balloon,
    EndPlates,
    Equilibrium,
    GasPressure,
    Hoops,
    Isotropic,
    PrescribedPath,
    TensionField,
    inflate,
    lobed_cylinder,
)
from lobefem.equilibrium.solver_options import NewtonOptions
from lobefem.fem.functionals import true_resultants
from lobefem.files import save_json
from lobefem.model.film import Film

from mpi4py import MPI

# isort: split
from command import exit_code, folder, pair, parser, speaker

PRESSURE = 5.0  # [Pa]
SLACK = 1e-3  # hoop slack of the last row of the table of iterations
STEEL = 2.15e9  # EA of hoops and bar [N]
METHODS = ("initial stress", "load path")

Say = Callable[[str], None]


def stack(surface: Any, film: Film, **options: Any) -> Balloon:
    """Two lobes whose bar is pinned at its lower end and free at the other. Collective."""
    parts = [GasPressure("film"), Hoops(STEEL), EndPlates("pinned", bar=STEEL)]
    return Balloon(surface, film, parts, **options)


def along_the_meridian(state: Equilibrium) -> dict[str, list[float]]:
    """Stresses [Pa] of each ring of cells: mean, least and largest around, and eq. 4's. Collective.

    True resultants over the film's thickness. Eq. 4 is taken on the exact meridian, half way between
    the ring's nodes.
    """
    balloon, surface = state.balloon, state.balloon.surface
    shape, rings = surface.shape, surface.divisions[0]
    owned = balloon.mesh.topology.index_map(2).size_local
    state.restore()
    N = true_resultants(balloon).x.array.reshape(-1, 3)[:owned]
    x = balloon.V.tabulate_dof_coordinates()[balloon.V.dofmap.list[:owned]].mean(axis=1)
    x, N = (np.concatenate(balloon.comm.allgather(part)) for part in (x, N))
    stations = shape.stations(rings)
    arc = (stations[1:] + stations[:-1]) / 2
    heights = np.concatenate(
        [shape.z(arc) + (2 * k + 1) * shape.half_height for k in range(surface.num_lobes)]
    )
    ring = np.abs(x[:, 2, None] - heights).argmin(axis=1)
    exact = shape.meridional_resultant(state.pressure, shape.radius(arc))
    t = balloon.film.thickness
    found = {"z": heights, "eq. 4": np.tile(exact, surface.num_lobes) / t}
    for k, name in enumerate(("phi", "theta")):
        of_ring = [N[ring == r, k] / t for r in range(len(heights))]
        for word in ("mean", "min", "max"):
            found[f"{name} {word}"] = np.array([getattr(values, word)() for values in of_ring])
    return {name: values.tolist() for name, values in found.items()}


def residual_hoop_stress(stress: dict[str, list[float]]) -> dict[str, float]:
    """Largest compression and tension [Pa], and the larger of both over eq. 4 there."""
    low, high = np.array(stress["theta min"]), np.array(stress["theta max"])
    share = np.maximum(np.abs(low), np.abs(high)) / np.array(stress["eq. 4"])
    return {"least": float(low.min()), "largest": float(high.max()), "share": float(share.max())}


def iterations(surface: Any, path: Equilibrium, say: Say) -> list[dict[str, Any]]:
    """Newton's iterations to 5 Pa of the energy, of IMP with its tangent and with its secant."""
    cases: dict[str, tuple[dict[str, Any], Equilibrium | None]] = {
        "unstressed film": ({}, None),
        "initial stress": ({"prestressed": True}, None),
        "after the load path": ({"load_path": path}, path),
        f"after the load path, hoop slack {SLACK:g}": ({"load_path": path, "hoop_slack": SLACK}, path),
    }
    films = {
        "tension field": TensionField(),
        "IMP, consistent": IMP(),
        "IMP, secant": IMP(tangent="secant"),
    }
    rows = []
    for name, (options, start) in cases.items():
        row: dict[str, Any] = {"case": name}
        for law, film in films.items():
            say(f"iterations: {name}, {law}")
            balloon = stack(surface, film, **options)
            state = inflate(balloon, PRESSURE, start=start, options=NewtonOptions(max_iterations=300))
            row[law] = state.iterations
        row["wrinkled"] = state.wrinkled_area / balloon.reference_area
        rows.append(row)
    return rows


def figure(curves: dict[str, dict[str, list[float]]]) -> Figure:
    """Meridional and hoop stress of both methods along the stack (paper fig. 20)."""
    drawn = Figure(figsize=(6.9, 3.4), dpi=200, layout="constrained")
    FigureCanvasAgg(drawn)
    left, right = drawn.subplots(1, 2, sharey=True)
    marks = dict(zip(METHODS, ("o", "x"), strict=True))
    colours = dict(zip(METHODS, ("#0072B2", "#D55E00"), strict=True))
    exact = curves[METHODS[0]]
    left.plot(np.array(exact["eq. 4"]) / 1e3, exact["z"], color="0.4", lw=0.8, label="eq. 4")
    for name in METHODS:
        style = {"marker": marks[name], "color": colours[name], "mfc": "none", "ms": 3.5, "lw": 0}
        curve = curves[name]
        left.plot(np.array(curve["phi mean"]) / 1e3, curve["z"], **style, label=name)
        right.plot(np.array(curve["theta mean"]) / 1e3, curve["z"], **style, label=name)
    right.axvline(0, color="0.4", lw=0.8)
    left.set(xlabel="meridional stress σφ [kPa]", ylabel="height z [m]", xlim=(0, None))
    right.set(xlabel="hoop stress σθ [kPa]")
    left.legend(fontsize=7, frameon=False, loc="center left")
    for axes in (left, right):
        axes.tick_params(labelsize=7)
        axes.xaxis.label.set_size(8)
        axes.yaxis.label.set_size(8)
    drawn.suptitle(f"Two lobes pressurised to {PRESSURE:g} Pa: means around each ring of cells", fontsize=8)
    return drawn


def table(numbers: dict[str, Any]) -> str:
    """The numbers in words, as Markdown."""
    lines = [
        f"Two lobes, {numbers['divisions'][0]} x {numbers['divisions'][1]} quadrilaterals each, "
        f"{PRESSURE:g} Pa on the film, lower end of the bar pinned.",
        "",
        "| method | σφ against eq. 4, worst ring | σθ, least [kPa] | σθ, largest [kPa] | of σφ |",
        "|---|---|---|---|---|",
    ]
    for name, case in numbers["cases"].items():
        hoop = case["hoop"]
        lines.append(
            f"| {name} | {100 * case['error']:.2f} % | {hoop['least'] / 1e3:.4f} | "
            f"{hoop['largest'] / 1e3:.4f} | {100 * hoop['share']:.3f} % |"
        )
    laws = [key for key in numbers["iterations"][0] if key not in ("case", "wrinkled")]
    lines += ["", f"| Newton's iterations | {' | '.join(laws)} | wrinkled |", "|---" * (len(laws) + 2) + "|"]
    for row in numbers["iterations"]:
        counts = " | ".join(str(row[law]) for law in laws)
        lines.append(f"| {row['case']} | {counts} | {100 * row['wrinkled']:.0f} % |")
    return "\n".join(lines) + "\n"


def run(
    divisions: tuple[int, int] = (24, 32),
    out: str | Path = "out/load_path",
    *,
    comm: Any = MPI.COMM_WORLD,
    say: Say = lambda text: None,
) -> dict[str, Any]:
    """The whole demo; returns its numbers on every rank. Collective.

    Args:
        divisions: of each lobe along its meridian, and around.
        out: folder of figure and tables; the same on all ranks.
        comm: MPI communicator.
        say: called with what goes on.
    """
    out = folder(out, comm)
    surface = lobed_cylinder(2, divisions, cell="quadrilateral", comm=comm)
    say("initial stress")
    states = {METHODS[0]: inflate(stack(surface, Isotropic(), prestressed=True), PRESSURE)}
    say("load path")
    path = inflate(stack(surface, PrescribedPath()), PRESSURE)
    states[METHODS[1]] = path
    say("standard law")
    # the standard law with the path's stress built in, and as a law of the whole strain
    kept = stack(surface, TensionField(), load_path=path)
    states["load path, then the standard law"] = inflate(kept, PRESSURE, start=path)
    bare = stack(surface, TensionField())
    states["load path, then the standard law of the whole strain"] = inflate(bare, PRESSURE, start=path)
    numbers: dict[str, Any] = {"divisions": list(divisions), "pressure": PRESSURE, "cases": {}}
    for name, state in states.items():
        stress = along_the_meridian(state)
        error = np.abs(np.array(stress["phi mean"]) / np.array(stress["eq. 4"]) - 1).max()
        numbers["cases"][name] = {
            "iterations": state.iterations,
            "volume": state.volume,
            "error": float(error),
            "hoop": residual_hoop_stress(stress),
            "stress": stress,
        }
    numbers["iterations"] = iterations(surface, path, say)
    if comm.rank == 0:
        figure({name: case["stress"] for name, case in numbers["cases"].items()}).savefig(out / "fig20.png")
        (out / "table.md").write_text(table(numbers), encoding="utf-8")
    save_json(out / "load_path.json", numbers, comm)
    return numbers


def main(argv: Sequence[str] | None = None) -> int:
    """Run the demo from the command line."""
    line = parser("Initial stress and prescribed load path (paper fig. 20)", "out/load_path", "24x32")
    options, comm = line.parse_args(argv), MPI.COMM_WORLD
    divisions = pair(options, line)

    def task() -> list[str]:
        numbers = run(divisions, options.out, comm=comm, say=speaker(comm))
        return [table(numbers), f"figure and tables are in {options.out}"]

    return exit_code(comm, task)


if __name__ == "__main__":
    sys.exit(main())
