"""Two lobes pushed onto each other: self-contact, and what its activation distance changes.

The top plate of a two-lobe stack under gas pressure is lowered in steps, with the film's own contact in the
energy. The last state is computed again with a half and a quarter of the activation distance. Prints a table
and draws the stack with its contact zones coloured. Runs serially or under mpirun.

    python demos/contact.py --out out/contact
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

import lobefem.linalg.dolfinx_compat  # noqa: F401  first: it finds the stack

# isort: split
from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.solver_options import NewtonOptions
from lobefem.equilibrium.state import Equilibrium
from lobefem.fem.balloon import Balloon
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.geometry.surface import Surface
from lobefem.model.cables import Hoops
from lobefem.model.end_plates import EndPlates
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.self_contact import SelfContact
from lobefem.model.tension_field import TensionField
from lobefem.viz.film_mesh import gather
from lobefem.viz.rendering import can_render

from mpi4py import MPI

# isort: split
from command import exit_code, pair, parser

PRESSURE = 5.0  # [Pa]
LIFTS = (0.0, -0.4, -0.8, -1.2, -1.6, -1.8, -2.0)  # of the top plate [m]


def balloon_at(surface: Surface, lift: float, activation: float | None) -> Balloon:
    plates = EndPlates("fixed", lift=lift)
    parts = [GasPressure(), Hoops(EA=2.15e9), plates, SelfContact(activation=activation)]
    return Balloon(surface, TensionField(slack_stiffness=1e-4), parts)


def lowered(state: Equilibrium, balloon: Balloon, change: float) -> Equilibrium:
    """The state as a start for `balloon`, whose plate stands lower: heights shrink in proportion."""
    heights = balloon.V.tabulate_dof_coordinates()[:, 2]
    shift = np.zeros((heights.size, 3))
    top = balloon.surface.num_lobes * balloon.surface.shape.z(balloon.surface.shape.stations(1))[[0, -1]]
    shift[:, 2] = change * heights / np.ptp(top)
    unknowns = state.unknowns.copy()
    unknowns[: balloon.map.free.size] += shift.ravel()[balloon.map.free]
    return replace(state, balloon=balloon, unknowns=unknowns)


def run(divisions: tuple[int, int], lifts: Sequence[float], out: Path) -> list[dict[str, Any]]:
    """Lower the plate, then shorten the reach of the contact; returns a row a state. Collective."""
    comm = MPI.COMM_WORLD
    surface = lobed_cylinder(2, divisions, comm=comm)
    rows: list[dict[str, Any]] = []

    def record(state: Equilibrium, lift: float) -> None:
        contact = state.balloon.contact
        state.restore()
        report = contact.measure(state.balloon.u)  # type: ignore[union-attr]
        rows.append(
            {
                "lift": lift,
                "activation": contact.activation,  # type: ignore[union-attr]
                "gap": report.gap,
                "force": report.force,
                "area": report.area,
                "volume": state.volume,
                "intersects": contact.intersects(state.balloon.u),  # type: ignore[union-attr]
            }
        )

    state = inflate(balloon_at(surface, lifts[0], None), PRESSURE)
    record(state, lifts[0])
    for before, lift in pairwise(lifts):
        balloon = balloon_at(surface, lift, None)
        state = inflate(
            balloon,
            PRESSURE,
            start=lowered(state, balloon, lift - before),
            options=NewtonOptions(max_iterations=150),
        )
        record(state, lift)
    full = state
    for share in (2, 4):
        balloon = balloon_at(surface, lifts[-1], full.balloon.contact.activation / share)  # type: ignore[union-attr]
        state = inflate(
            balloon,
            PRESSURE,
            start=replace(state, balloon=balloon),
            options=NewtonOptions(max_iterations=150),
        )
        record(state, lifts[-1])
    if comm.rank == 0:
        out.mkdir(parents=True, exist_ok=True)
        (out / "contact.json").write_text(json.dumps(rows, indent=1), encoding="utf-8")
        (out / "table.md").write_text(table(rows), encoding="utf-8")
    draw(full, out / "contact.png")
    return rows


def table(rows: Sequence[dict[str, Any]]) -> str:
    """The rows as Markdown."""
    lines = ["| lift [m] | activation [mm] | gap [mm] | force [N] | volume [m^3] |", "|---|---|---|---|---|"]
    lines += [
        f"| {r['lift']:.1f} | {1e3 * r['activation']:.1f} | {1e3 * r['gap']:.1f} | {r['force']:.2f} | "
        f"{r['volume']:.3f} |"
        for r in rows
    ]
    return "\n".join(lines) + "\n"


def draw(state: Equilibrium, path: Path) -> None:
    """The film coloured by the size of the contact forces, if anything can be drawn here. Collective."""
    balloon = state.balloon
    state.restore()
    force = np.zeros_like(state.displacement)
    gradient = balloon.contact.gradient(balloon.u).reshape(-1, 3)  # type: ignore[union-attr]
    force[: len(gradient)] = gradient
    film_mesh = gather(balloon, state.displacement, force)
    if film_mesh is None or not can_render():
        return
    import pyvista

    displacement, force = film_mesh.fields
    faces = np.column_stack(
        [np.full(len(film_mesh.faces), film_mesh.faces.shape[1]), film_mesh.faces]
    ).ravel()
    film = pyvista.PolyData(film_mesh.x + displacement, faces)
    film["contact force [N]"] = np.linalg.norm(force, axis=1)
    plotter = pyvista.Plotter(off_screen=True, window_size=[900, 700])
    plotter.set_background("white")
    plotter.add_mesh(
        film, scalars="contact force [N]", cmap="viridis", show_edges=True, ambient=0.3, show_scalar_bar=False
    )
    plotter.add_scalar_bar(
        title="contact force [N]\n", vertical=False, width=0.6, height=0.09, position_x=0.2, position_y=0.01,
        title_font_size=16, label_font_size=14, n_labels=4, fmt="%.1f", color="black",
    )  # fmt: skip
    centre = film.center
    plotter.camera.focal_point = centre
    plotter.camera.position = (centre[0] + 40, centre[1], centre[2] + 6)
    plotter.camera.up = (0, 0, 1)
    plotter.camera.parallel_projection = True
    plotter.camera.parallel_scale = 0.68 * film_mesh.height
    plotter.screenshot(str(path))
    plotter.close()


def main(argv: Sequence[str] | None = None) -> int:
    """Run the demo from the command line."""
    line = parser(str(__doc__).splitlines()[0], "out/contact", "8x12")
    options, comm = line.parse_args(argv), MPI.COMM_WORLD
    divisions = pair(options, line)
    return exit_code(comm, lambda: [table(run(divisions, LIFTS, options.out))])


if __name__ == "__main__":
    sys.exit(main())
