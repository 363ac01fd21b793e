"""How hard is it to push the top of a stack sideways? Force against displacement (paper fig. 22).

Five lobes, the bottom clamped, pressurised to 5 Pa; then the top centre is displaced by delta along x
and the force on it is read off, with and without self-contact. Tension-field film with the isotensoid's
stress built in. From 0.7 m the path is also gone back, and the top is let go with two dampings. With
--mesh-study the force at 0.25 m is computed on finer and finer meshes instead. Runs serially or under
mpirun.

    python demos/tip_displacement.py --out out/tip
    python demos/tip_displacement.py --divisions 24x32 --out out/tip24
    python demos/tip_displacement.py --mesh-study --out out/tip-meshes
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import lobefem.linalg.dolfinx_compat  # noqa: F401  first: it finds the stack

# isort: split
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from lobefem.equilibrium.displacement_control import distort, release_start
from lobefem.equilibrium.distortions import Tip
from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.ramp import Increment
from lobefem.equilibrium.solver_options import FlowOptions
from lobefem.errors import ConvergenceError
from lobefem.fem.balloon import Balloon
from lobefem.files import save_json
from lobefem.io.design import Design
from lobefem.stability.perturbation import Point, perturb
from lobefem.stability.relaxation import release

from mpi4py import MPI

# isort: split
from command import exit_code, parser, speaker

LOBES, PRESSURE = 5, 5.0
INCREMENT = 0.05  # of the displacement [m]
SHOWN = 0.7  # the end of the paper's curve, from where it lets go [m]
SOFTENING = 0.1  # where the paper sees it soften [m]
CONTACT = 1.551  # where lobes touch in the paper [m]
DAMPINGS = (1.0, 0.1)
STUDIED = 0.25  # displacement of the mesh study [m]
# cells along and around a lobe, cell, order, grading
MESHES = (
    ((12, 16), "triangle", 1, 0.0),
    ((24, 16), "triangle", 1, 0.0),
    ((12, 32), "triangle", 1, 0.0),
    ((24, 32), "triangle", 1, 0.0),
    ((48, 32), "triangle", 1, 0.0),
    ((24, 64), "triangle", 1, 0.0),
    ((48, 64), "triangle", 1, 0.0),
    ((12, 16), "triangle", 2, 0.0),
    ((12, 16), "quadrilateral", 1, 0.0),
    ((24, 16), "quadrilateral", 1, 0.0),
    ((48, 16), "quadrilateral", 1, 0.0),
    ((24, 32), "quadrilateral", 1, 0.0),
    ((48, 32), "quadrilateral", 1, 0.0),
    ((12, 16), "quadrilateral", 2, 0.0),
    ((12, 16), "triangle", 1, 0.9),
    ((24, 32), "triangle", 1, 0.9),
    ((12, 16), "quadrilateral", 1, 0.9),
    ((24, 16), "quadrilateral", 1, 0.9),
    ((24, 32), "quadrilateral", 1, 0.9),
    ((48, 32), "quadrilateral", 1, 0.9),
    ((36, 48), "quadrilateral", 1, 0.9),
)

Say = Callable[[str], None]


def balloon(
    divisions: Sequence[int],
    comm: Any,
    lobes: int = LOBES,
    *,
    contact: bool = False,
    cell: str = "triangle",
    order: int = 1,
    grading: float = 0.0,
) -> Balloon:
    """The paper's design; its edge radius, film and hoops are the defaults. Collective."""
    design = Design.parse(
        {
            "shape": {"lobes": lobes},
            "mesh": {"divisions": list(divisions), "cell": cell, "order": order, "grading": grading},
            "film": {"law": "tension-field", "prestress": True},
            "hoops": {"enabled": True},
            "plates": {"support": "clamped"},
            "pressure": {"load": "closed"},
        }
    )
    return design.balloon(design.surface(comm), contact=contact)


def push(one: Balloon, displacement: float, say: Say) -> dict[str, Any]:
    """Displace the top: force, volume, gap and the ledger's error on the way. Collective."""
    steps = max(round(displacement / INCREMENT), 1)
    stopped, first = None, None
    try:
        found = perturb(one, PRESSURE, Tip(displacement), steps=steps, progress=say)
        points, first = found.ramp, found.first_contact
    except ConvergenceError as error:
        points, stopped = error.data.get("points", ()), str(error)
    return curve(points) | {"first_contact": first, "stopped": stopped}


def curve(points: Sequence[Point]) -> dict[str, Any]:
    """The steps as lists."""
    names = ("parameter", "reaction", "volume", "contact_force", "gap", "residual")
    found: dict[str, Any] = {name: [getattr(p, name) for p in points] for name in names}
    found["ledger_error"] = [p.ledger.error for p in points]
    found["damping"] = [p.ledger.damping for p in points]
    return found


def let_go(one: Balloon, displacement: float, say: Say) -> dict[str, Any]:
    """Displace the top, go back, and let it go with two dampings; no contact. Collective."""
    start = inflate(one, PRESSURE)
    steps = max(round(displacement / INCREMENT), 1)
    there = distort(start, Tip(displacement), steps=steps, first=1 / 8, progress=say)
    back = distort(there.state, Tip(0.0), steps=steps, progress=say)
    releases = []
    for damping in DAMPINGS:
        # the same evidence as `lobefem perturb --release`
        free = release(
            release_start(there.state), undistorted=start, options=FlowOptions(damping=damping), progress=say
        )
        releases.append(
            {
                "damping": damping,
                "outcome": free.outcome,
                "reason": free.reason,
                "time": [r.time for r in free.history],
                "top": [r.top[0] if r.top is not None else 0.0 for r in free.history],
                "ledger_error": free.ledger.error,
            }
        )
    return {"displacement": displacement, "difference": difference(there.history, back.history)} | {
        "parameter": [i.parameter for i in back.history],
        "reaction": [i.reaction for i in back.history],
        "damping": there.history[-1].damping + back.history[-1].damping,
        "releases": releases,
    }


def difference(there: Sequence[Increment], back: Sequence[Increment]) -> float:
    """Largest difference of force between two paths at the same displacements, over the largest force."""
    forces = {round(i.parameter, 9): i.reaction for i in there}
    pairs = [(forces[round(i.parameter, 9)], i.reaction) for i in back if round(i.parameter, 9) in forces]
    return max(abs(a - b) for a, b in pairs) / max(forces.values())


def run(
    meshes: Sequence[tuple[int, int]],
    displacement: float = 1.6,
    out: Path = Path("out/tip"),
    *,
    lobes: int = LOBES,
    contact: bool = True,
    cell: str = "triangle",
    grading: float = 0.0,
    comm: Any = MPI.COMM_WORLD,
    say: Say = lambda text: None,
) -> dict[str, Any]:
    """The curve on each mesh, on the first one with contact, back and let go too; writes files. Collective.

    Args:
        meshes: cells along and around a lobe; the first one is the one meant.
        displacement: largest delta [m].
        out: folder to write to.
        lobes: of the stack.
        contact: whether to go the first mesh's path with self-contact, too.
        cell: of the meshes, "triangle" or "quadrilateral".
        grading: of the meshes, see `lobefem.lobed_cylinder`.
        comm: MPI communicator.
        say: called with a line of text after each solve.
    """
    curves: dict[str, Any] = {}
    for k, mesh in enumerate(meshes):
        for touching in (False, True) if contact and k == 0 else (False,):
            name = f"{mesh[0]} x {mesh[1]}" + (", contact" if touching else "")
            one = balloon(mesh, comm, lobes, contact=touching, cell=cell, grading=grading)
            curves[name] = push(one, displacement, lambda text, name=name: say(f"{name}: {text}"))  # type: ignore[misc]
    first = balloon(meshes[0], comm, lobes, cell=cell, grading=grading)
    freed = let_go(first, min(SHOWN, displacement), say)
    numbers = {
        "cell": cell,
        "grading": grading,
        "pressure": PRESSURE,
        "lobes": lobes,
        "curves": curves,
        "let_go": freed,
    }
    if comm.rank == 0:
        out.mkdir(parents=True, exist_ok=True)
        figure(numbers).savefig(out / "tip_displacement.png", dpi=200)
    save_json(out / "tip_displacement.json", numbers, comm)
    return numbers


def mesh_study(out: Path, comm: Any, say: Say, meshes: Sequence[Any] = MESHES) -> list[dict[str, Any]]:
    """Force at one displacement on each mesh; writes JSON. Collective."""
    rows = []
    if comm.rank == 0:
        out.mkdir(parents=True, exist_ok=True)
    for divisions, cell, order, grading in meshes:
        name = f"{divisions[0]} x {divisions[1]} {cell}s, order {order}, grading {grading}"
        one = balloon(divisions, comm, cell=cell, order=order, grading=grading)
        row = {"divisions": divisions, "cell": cell, "order": order, "grading": grading}
        row["unknowns"] = one.map.size
        found = push(one, STUDIED, lambda text, name=name: say(f"{name}: {text}"))  # type: ignore[misc]
        row |= {"volume": found["volume"][0], "force": found["reaction"][-1], "stopped": found["stopped"]}
        row["damping"] = found["damping"][-1]
        rows.append(row)
        save_json(out / "mesh_study.json", {"displacement": STUDIED, "rows": rows}, comm)
    return rows


def figure(numbers: dict[str, Any]) -> Figure:
    """Force against displacement, and the top's way back when it is let go."""
    sheet = Figure(figsize=(7.0, 3.2), layout="constrained")
    FigureCanvasAgg(sheet)
    left, right = sheet.subplots(1, 2)
    place: Any = {"rotation": 90, "ha": "right", "va": "bottom", "transform": left.get_xaxis_transform()}
    colours = {}
    for name, found in numbers["curves"].items():
        mesh = name.split(",")[0]
        colour = colours.setdefault(mesh, ("#0072B2", "#D55E00", "#009E73", "#B4588F")[len(colours) % 4])
        touching = mesh != name
        style = {"marker": "x", "lw": 0, "markersize": 4} if touching else {"lw": 1.2}
        left.plot(found["parameter"], found["reaction"], color=colour, label=name, **style)
        if found["first_contact"] is not None:
            left.axvline(found["first_contact"], color=colour, lw=0.6, ls="--")
            left.text(found["first_contact"], 0.45, "contact ", color=colour, fontsize=7, **place)
    back = numbers["let_go"]
    left.plot(back["parameter"], back["reaction"], "o", color="0.3", mfc="none", ms=3.5, label="back")
    if left.get_xlim()[1] > CONTACT:
        left.axvline(CONTACT, color="0.5", lw=0.6, ls=":")
        left.text(CONTACT, 0.02, "paper: contact ", color="0.4", fontsize=7, **place)
    left.set(xlabel="displacement of the top centre δ [m]", ylabel="force on the top centre [N]")
    left.margins(x=0)
    left.locator_params(axis="x", nbins=5)
    left.set_ylim(bottom=0)
    left.legend(frameon=False, fontsize=7, loc="lower center", title="divisions of a lobe", title_fontsize=7)
    for one, style in zip(back["releases"], ("-", "--"), strict=True):
        time_, top = np.array(one["time"][1:]), np.array(one["top"][1:])
        right.semilogx(time_, top, style, color="#0072B2", lw=1.2, label=f"damping {one['damping']:g}")
    right.set(xlabel="time after letting go [s]", ylabel="displacement of the top centre [m]")
    right.legend(frameon=False, fontsize=7)
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(labelsize=8)
    sheet.suptitle(
        f"{numbers['lobes']} lobes at {PRESSURE:g} Pa, bottom clamped, top pushed sideways (paper fig. 22)",
        fontsize=9,
    )
    return sheet


def words(numbers: dict[str, Any]) -> list[str]:
    """Findings of the curves beside the paper's sec. 6.1."""
    text = []
    for name, found in numbers["curves"].items():
        delta, force = np.array(found["parameter"]), np.array(found["reaction"])

        def force_at(d: float, delta: Any = delta, force: Any = force) -> float:
            return float(np.interp(d, delta, force))

        end, soft = min(SHOWN, delta[-1]), min(SOFTENING, delta[-1] / 2)
        early, late = force_at(soft / 2) / (soft / 2), (force_at(end) - force_at(soft)) / (end - soft)
        text.append(
            f"{name}: {early:.3g} N/m at first, {late:.3g} N/m from {soft:g} m to {end:g} m (paper: softens "
            f"from about {SOFTENING:g} m, stiffness positive to {SHOWN:g} m)"
        )
        text.append(
            f"{name}: force {force_at(STUDIED):.3f} N at {STUDIED:g} m, {force_at(end):.3f} N at {end:g} m; "
            f"the greatest, {force.max():.3f} N, at {delta[force.argmax()]:.3g} m"
        )
        first = "none" if found["first_contact"] is None else f"{found['first_contact']:.3f} m"
        if ", contact" in name:
            free = numbers["curves"][name.split(",")[0]]
            apart = np.abs(np.interp(delta, free["parameter"], free["reaction"]) - force).max() / force.max()
            text.append(
                f"{name}: first contact {first} (paper: {CONTACT} m); force at most {100 * apart:.2g} % off "
                "the one without contact (paper: almost identical)"
            )
        text.append(
            f"{name}: ledger closes to {100 * found['ledger_error'][-1]:.2g} %, damped motions took "
            f"{found['damping'][-1]:.2g} J"
        )
        if found["stopped"]:
            text.append(f"{name}: {found['stopped']}")
    back = numbers["let_go"]
    text.append(
        f"back from {back['displacement']:g} m: force at most {100 * back['difference']:.2g} % of the "
        f"greatest off the way there; damped motions took {back['damping']:.2g} J"
    )
    text += [
        f"let go at {back['displacement']:g} m with damping {one['damping']:g}: {one['outcome']} after "
        f"{one['time'][-1]:.3g} s (paper: stays with the default damping, returns with less); {one['reason']}"
        for one in back["releases"]
    ]
    return text


def table(rows: Sequence[dict[str, Any]]) -> str:
    """The mesh study as Markdown."""
    lines = [
        f"Force at {STUDIED:g} m, {LOBES} lobes, {PRESSURE:g} Pa.",
        "",
        "| divisions | cell | order | grading | unknowns | volume [m^3] | force [N] |",
        "|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        along, around = row["divisions"]
        force = row["stopped"] or f"{row['force']:.3f}"
        lines.append(
            f"| {along} x {around} | {row['cell']} | {row['order']} | {row['grading']} | {row['unknowns']} | "
            f"{row['volume']:.2f} | {force} |"
        )
    return "\n".join(lines)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the demo from the command line."""
    of = "of a lobe, one mesh or more; paper: 24x32"
    line = parser("Force against tip displacement (paper fig. 22)", "out/tip", "12x16", of)
    line.add_argument("--cell", default="triangle", choices=("triangle", "quadrilateral"))
    line.add_argument("--grading", type=float, default=0.0, help="flatter cells at the seams: 0 to 0.95")
    line.add_argument("--displacement", type=float, default=1.6, help="of the top centre [m]")
    line.add_argument("--no-contact", action="store_true", help="leave out the path with self-contact")
    line.add_argument("--mesh-study", action="store_true", help="the force on many meshes instead")
    options = line.parse_args(argv)
    comm, begin = MPI.COMM_WORLD, time.monotonic()
    try:
        meshes = [tuple(int(n) for n in part.split("x")) for part in options.divisions.split(",")]
        meshes = [(along, around) for along, around in meshes]
    except ValueError:
        line.error(f"--divisions {options.divisions}: give pairs of integers such as 24x32,12x16")

    say = speaker(comm, clock=True)

    def task() -> list[str]:
        if options.mesh_study:
            lines = [table(mesh_study(options.out, comm, say))]
        else:
            contact = not options.no_contact
            numbers = run(
                meshes,
                options.displacement,
                options.out,
                contact=contact,
                cell=options.cell,
                grading=options.grading,
                comm=comm,
                say=say,
            )
            lines = words(numbers)
        return [*lines, f"{time.monotonic() - begin:.0f} s; figure and numbers are in {options.out}"]

    return exit_code(comm, task)


if __name__ == "__main__":
    sys.exit(main())
