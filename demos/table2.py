"""Does a bent stack come back when it is let go (paper sec. 6, figs 23 and 24, table 2)?

Four lobes under 5 Pa are bent by 7.5 or 15 degrees, with self-contact, and let go: damped motion,
equilibrium without damping, lowest eigenvalue. The paper leaves open what the gas does to the end plates
(`film` or `closed`) and how the bottom is held (clamped or pinned), so all combinations are tried; with
--larger also larger bends and other distortions. Volumes are printed beside the paper's table 2.

One of the cases is let go once more with fading forces, as Abaqus lets go of a constraint in a static
step, and stopped at the end of that step with several dampings. Runs serially or under mpirun.

    python demos/table2.py --out out/table2
    python demos/table2.py --divisions 24x32 --angles 7.5,15 --json table2.json --out out/table2
"""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import lobefem.linalg.dolfinx_compat  # noqa: F401  first: it finds the stack

# isort: split
import numpy as np
from command import exit_code, folder, pair, parser, speaker
from table2_shown import STEP, bends, landscape, middle, words

from lobefem import Balloon, EndPlates, GasPressure, Hoops, TensionField, inflate, lobed_cylinder
from lobefem.equilibrium.displacement_control import release_start
from lobefem.equilibrium.distortions import Bend, Distortion, Tip, Twist, Wave
from lobefem.equilibrium.solver_options import FlowOptions
from lobefem.equilibrium.state import Equilibrium, State, record
from lobefem.errors import ConvergenceError
from lobefem.io.provenance import provenance
from lobefem.model.self_contact import SelfContact
from lobefem.stability.modes import find_modes
from lobefem.stability.perturbation import Perturbed, Point, perturb
from lobefem.stability.relaxation import Released, release
from lobefem.viz.contours import horizontal_displacements
from lobefem.viz.study_figures import perturbation

from mpi4py import MPI

LOBES, PRESSURE = 4, 5.0
LOADS, SUPPORTS, ANGLES = ("film", "closed"), ("clamped", "pinned"), (7.5, 15.0)
DAMPINGS = (10.0, 1.0, 0.1, 0.01)  # of the release that is stopped at a step's end
SHARES = (0.0, 0.1, 0.3, 0.6, 0.9)  # of the energy gone, where the tangent on the way is looked at
LARGER = (Bend(30), Bend(45), Twist(25), Tip(1.6), Wave(2, 0.3), Wave(3, 0.2))
KEPT = 30  # points of a ramp's or a release's history on file

Say = Callable[[str], None]
Runs = Mapping[str, dict[str, Any]]


@dataclass(frozen=True)
class Case:
    """A load, a support and a distortion."""

    load: str
    support: str
    distortion: Distortion

    @property
    def amount(self) -> float:
        """Of the distortion [degrees or m]."""
        s = self.distortion.parameter
        return round(math.degrees(s), 9) if self.distortion.unit == "rad" else s

    @property
    def name(self) -> str:
        """In words."""
        unit = "degrees" if self.distortion.unit == "rad" else self.distortion.unit
        return f"{self.load}, {self.support}, {self.distortion.kind} {self.amount:g} {unit}"

    @property
    def file(self) -> str:
        """For file names."""
        kind = self.distortion.kind.replace(" of n = ", "_").replace(" ", "_")
        return f"{self.load}_{self.support}_{kind}_{self.amount:g}"


def matrix(angles: Iterable[float] = ANGLES) -> list[Case]:
    """All combinations that the paper's text allows."""
    return [Case(load, support, Bend(a)) for a in angles for load in LOADS for support in SUPPORTS]


def larger() -> list[Case]:
    """Larger and other distortions, of the load that has a potential.

    A push on the tip would only tip a pinned stack over; twisted, it has no hold against that.
    """
    return [
        Case("closed", support, d)
        for d in LARGER
        for support in SUPPORTS
        if support == "clamped" or isinstance(d, Bend | Wave)
    ]


def stack(
    divisions: tuple[int, int], load: str, support: str, comm: Any, order: int = 1, contact: bool = True
) -> Balloon:
    """Four lobes of the paper's design, the isotensoid's stress built in. Collective."""
    surface = lobed_cylinder(LOBES, divisions, comm=comm, order=order)
    parts = [GasPressure(load), Hoops(), EndPlates(support=support), *([SelfContact()] if contact else [])]
    return Balloon(surface, TensionField(), parts, prestressed=True)


# --- one case -----------------------------------------------------------------------------------


def study(case: Case, divisions: tuple[int, int], comm: Any, say: Say) -> tuple[dict[str, Any], Perturbed]:
    """Bend, let go, and look at the tangent on the way. Collective."""
    begin = time.process_time()
    balloon = stack(divisions, case.load, case.support, comm)
    way: list[Any] = []  # the states that the steps of the release began at

    def keep(state: Any, notes: Mapping[str, Any]) -> None:
        if notes["phase"] == "release" and notes["records"]:
            way.append((notes["records"][-1]["number"], state))

    found = perturb(balloon, PRESSURE, case.distortion, let_go=True, keep=keep, progress=say)
    released, end = _released(found), found.ramp[-1]
    seconds = comm.allreduce(time.process_time() - begin)
    final = released.state
    numbers = {
        "divisions": list(divisions),
        "load": case.load,
        "support": case.support,
        "distortion": case.distortion.kind,
        "amount": case.amount,
        "volume_original": found.original.volume,
        "volume_imposed": end.volume,
        "volume_final": released.history[-1].volume if final is None else final.volume,
        "work_of_constraint": end.ledger.constraint,
        "strain_imposed": end.ledger.strain,
        "contact_imposed": end.ledger.contact,
        "middle_imposed": end.mid_hoop_displacement,
        "outcome": released.outcome,
        "reason": released.reason,
        "min_eigenvalue": released.lowest,
        "residual": released.history[-1].relative_residual if final is None else final.relative_residual,
        "distance": released.distance,
        "rotation": math.degrees(released.rotation),
        "first_contact": _amount(case, found.first_contact),
        "smallest_gap": min(p.gap for p in found.history if p.gap is not None),
        "energy": vars(released.ledger) | {"error": released.ledger.error},
        "way": _tangents(way, released),
        "history": _thinned(case, found.history),
        "seconds": seconds,
    }
    return numbers, found


def _released(found: Perturbed) -> Released:
    assert found.released is not None  # `let_go` was asked for
    return found.released


def _amount(case: Case, s: float | None) -> float | None:
    return math.degrees(s) if s is not None and case.distortion.unit == "rad" else s


def _tangents(way: Sequence[tuple[int, Any]], released: Released) -> list[dict[str, float]]:
    """Lowest eigenvalues of the free balloon's tangent at a few places on the way. Collective."""
    records = {r.number: r for r in released.history}
    begun = {number - 1: state for number, state in way if number > 0}
    lost = {n: records[n].ledger.damping / max(released.ledger.damping, 1e-300) for n in begun}
    found = []
    for share in SHARES:
        n = min(lost, key=lambda n: abs(lost[n] - share))
        state = begun[n]
        state.balloon.set_loads(state.pressure, state.prestress)
        free = record(state.balloon, state.vector(), False, "in motion", 0, ())
        lowest = find_modes(free, 3).lowest
        found.append({"time": records[n].time, "lost": lost[n], "lowest": lowest})
    return found


def _thinned(case: Case, history: Sequence[Point]) -> dict[str, Any]:
    """Ramp and release as columns of few digits and points."""

    def columns(points: Sequence[Point], **values: Callable[[Point], float | None]) -> dict[str, Any]:
        chosen = sorted(set(np.linspace(0, len(points) - 1, KEPT).round().astype(int))) if points else []
        return {
            name: [float(f"{value(points[i]) or 0.0:.5g}") for i in chosen] for name, value in values.items()
        }

    common: dict[str, Callable[[Point], float | None]] = {
        "middle": lambda p: p.mid_hoop_displacement,
        "pressure": lambda p: p.ledger.pressure,
        "strain": lambda p: p.ledger.strain,
        "contact": lambda p: p.ledger.contact,
    }
    return {
        "ramp": columns(
            [p for p in history if p.time is None],
            parameter=lambda p: _amount(case, p.parameter),
            reaction=lambda p: p.reaction,
            **common,
        ),
        "release": columns(
            [p for p in history if p.time is not None],
            time=lambda p: p.time,
            residual=lambda p: p.residual,
            damping=lambda p: p.ledger.damping,
            **common,
        ),
    }


def stopped(
    case: Case, divisions: tuple[int, int], dampings: Sequence[float], comm: Any, say: Say
) -> list[dict[str, Any]]:
    """A distorted balloon let go by forces that fade over a step, and stopped at its end. Collective."""
    held = perturb(stack(divisions, case.load, case.support, comm), PRESSURE, case.distortion, progress=say)
    original, imposed = held.original, held.imposed
    assert imposed is not None  # nothing was resumed
    start, rows = release_start(imposed), []
    for damping in dampings:
        end = release(
            start,
            undistorted=original,
            options=FlowOptions(damping=damping, fade=STEP, end_time=STEP),
            count=1,
            progress=say,
        )
        last = end.history[-1]
        rows.append(
            {
                "damping": damping,
                "volume_imposed": imposed.volume,
                "volume": last.volume,
                "middle": abs(last.middle[0]),
                "unbalanced": last.relative_residual,
                "work_of_fading_forces": last.ledger.constraint,
                "error": last.ledger.error,
                "outcome": end.outcome,
            }
        )
    return rows


def tumbled(rest: Equilibrium, seed: int, size: float) -> State:
    """Random large waves on the lobes (n to 4) and on the axis, as far as the film does not meet itself.

    Collective.

    Args:
        rest: the equilibrium that they are added to.
        seed: of the random numbers.
        size: root mean square of the lobes' waves; those of the axis are twice as large [m].
    """
    balloon, random = rest.balloon, np.random.default_rng(seed)
    x, motion = balloon.V.tabulate_dof_coordinates(), balloon.motion
    height = (x - motion.centres[0]) @ motion.direction / motion.length
    angle = np.arctan2(x[:, 1], x[:, 0])
    outwards = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    waves, aside = np.zeros_like(angle), np.zeros_like(x)
    for lobe in range(LOBES):
        on = np.floor(LOBES * height) == lobe
        for n in range(5):
            wave = random.normal() * np.cos(n * angle + random.uniform(0, 2 * np.pi))
            waves += np.where(on, wave * np.sin(np.pi * LOBES * height) ** 2, 0.0)
    for m in (1, 2, 3):
        a, phi = random.normal(), random.uniform(0, 2 * np.pi)
        aside += np.outer(2 * a * np.sin(m * np.pi * height), [np.cos(phi), np.sin(phi), 0.0])
    change = (waves[:, None] * outwards / math.sqrt(5) + aside).ravel()[balloon.map.free]
    while True:
        q = rest.vector()
        q.array[: len(change)] += size * change
        balloon.set_unknowns(q)
        if balloon.contact is None or not balloon.contact.intersects(balloon.u):
            return State(balloon, rest.pressure, rest.prestress, q.array_r.copy())
        size *= 0.8


def tumble(divisions: tuple[int, int], count: int, size: float, comm: Any, say: Say) -> list[dict[str, Any]]:
    """Releases from random shapes, with `closed` pressure. Collective."""
    rows = []
    for seed in range(count):
        support = SUPPORTS[seed % 2]
        rest = inflate(stack(divisions, "closed", support, comm), PRESSURE)
        end = release(tumbled(rest, seed, size), undistorted=rest, count=2, progress=say)
        volumes = [r.volume for r in end.history]
        rows.append(
            {
                "divisions": list(divisions),
                "seed": seed,
                "support": support,
                "size": size,
                "volume_original": rest.volume,
                "least_volume": min(volumes),
                "energy": end.ledger.damping,
                "contact": max(r.contact_energy for r in end.history) > 0,
                "outcome": end.outcome,
                "reason": end.reason,
                "min_eigenvalue": end.lowest,
                "error": end.ledger.error,
            }
        )
    return rows


def volumes(meshes: Sequence[tuple[int, int, int]], comm: Any) -> list[dict[str, Any]]:
    """Volume of the pressurised stack on meshes (along, around, order). Collective."""
    rows = []
    for along, around, order in meshes:
        state = inflate(stack((along, around), "closed", "pinned", comm, order, contact=False), PRESSURE)
        drawn = state.balloon.reference_volume
        rows.append({"mesh": [along, around, order], "drawn": drawn, "pressurised": state.volume})
    return rows


# --- all of it ----------------------------------------------------------------------------------


def run(
    divisions: tuple[int, int] = (8, 12),
    cases: Sequence[Case] = tuple(matrix(ANGLES[:1])),
    out: str | Path = "out/table2",
    *,
    numbers: dict[str, Any] | None = None,
    file: Path | None = None,
    dampings: Sequence[float] = DAMPINGS,
    meshes: Sequence[tuple[int, int, int]] = (),
    random: int = 0,
    size: float = 0.4,
    comm: Any = MPI.COMM_WORLD,
    say: Say = lambda text: None,
) -> dict[str, Any]:
    """The whole demo; returns its numbers on every rank. Collective.

    Args:
        divisions: of a lobe along its meridian, and around.
        cases: what to try; those that `numbers` has for this mesh are not tried again.
        out: folder of the figures.
        numbers: of earlier runs, to be added to.
        file: where to keep the numbers after each case; in the folder by default.
        dampings: of the last case's release that is stopped at the end of a step; none to leave it out.
        meshes: (along, around, order) whose volumes are wanted.
        random: how many random shapes to let go as well.
        size: of these, see `tumbled` [m].
        comm: communicator.
        say: called with lines of text.
    """
    out = folder(out, comm)
    file = file or out / "table2.json"
    mesh = "{}x{}".format(*divisions)
    numbers = {"runs": {}, "stopped": {}, "random": [], "volumes": []} | (numbers or {})
    numbers["made_with"] = provenance(comm)
    for case in cases:
        name = f"{mesh}, {case.name}"
        if name in numbers["runs"]:
            continue
        say(name)
        try:
            numbers["runs"][name], found = study(case, divisions, comm, say)
        except ConvergenceError as error:
            say(f"{name}: {error}")
            continue
        _save(file, numbers, comm)
        _draw(case, found, out, comm)
    name = f"{mesh}, {cases[-1].name}" if cases else ""
    if dampings and cases and name not in numbers["stopped"]:
        numbers["stopped"][name] = stopped(cases[-1], divisions, dampings, comm, say)
    if meshes:
        numbers["volumes"] = volumes(meshes, comm)
    if random:
        numbers["random"] = tumble(divisions, random, size, comm, say)
    _save(file, numbers, comm)
    if comm.rank == 0:
        for angle in sorted({r["amount"] for r in bends(numbers["runs"], mesh)}):
            middle(numbers["runs"], mesh, angle).savefig(out / f"fig23_{angle:g}.png", dpi=200)
        landscape(numbers["runs"], mesh).savefig(out / "landscape.png", dpi=200)
    comm.Barrier()
    return numbers


def _save(file: Path, numbers: Mapping[str, Any], comm: Any) -> None:
    """JSON with one line for each run, from rank 0. Not collective."""
    if comm.rank == 0:
        runs = ",\n".join(f"{json.dumps(k)}: {json.dumps(v)}" for k, v in numbers["runs"].items())
        rest = ",\n".join(f"{json.dumps(k)}: {json.dumps(v)}" for k, v in numbers.items() if k != "runs")
        file.write_text(f'{{{rest},\n"runs": {{\n{runs}\n}}}}\n', encoding="utf-8")


# --- pictures of single cases --------------------------------------------------------------------


def _draw(case: Case, found: Perturbed, out: Path, comm: Any) -> None:
    """One case: shapes with the horizontal displacement (fig. 24), and its ramp, release and ledger."""
    shapes = []
    for caption, state in (("imposed", found.imposed), (_released(found).outcome, _released(found).state)):
        if state is not None:
            shapes.append((f"{caption}, V = {state.volume:.2f} m³", state.displacement))
    balloon = found.original.balloon
    drawn = horizontal_displacements(balloon, shapes, title=case.name)
    if comm.rank == 0 and drawn is not None:
        drawn.savefig(out / f"fig24_{case.file}.png")
        unit = "degrees" if case.distortion.unit == "rad" else "m"
        history = perturbation(found.history, unit=unit, reaction_unit=case.distortion.reaction_unit)
        history.savefig(out / f"ledger_{case.file}.png")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the demo from the command line."""
    line = parser("Release of a bent stack (paper figs 23, 24, table 2)", "out/table2", "8x12")
    line.add_argument("--angles", default="7.5", help="of the bend [degrees], separated by commas")
    line.add_argument("--larger", action="store_true", help="larger and other distortions, too")
    line.add_argument("--only", default="", help="cases whose name contains this")
    line.add_argument("--json", type=Path, help="file to keep numbers in; what it has is not done again")
    line.add_argument("--no-damping", action="store_true", help="leave out the stopped releases")
    line.add_argument("--random", type=int, default=0, help="how many random shapes to let go, too")
    line.add_argument("--size", type=float, default=0.4, help="of the random shapes' waves [m]")
    line.add_argument("--meshes", action="store_true", help="the volume on several meshes, too")
    options, comm = line.parse_args(argv), MPI.COMM_WORLD
    divisions = pair(options, line)
    try:
        angles = [float(part) for part in options.angles.split(",") if part]
    except ValueError:
        line.error("give --angles such as 7.5,15")
    cases = [c for c in matrix(angles) + larger() * options.larger if options.only in c.name]
    earlier = None
    if options.json is not None and options.json.exists():
        earlier = json.loads(options.json.read_text(encoding="utf-8"))
    meshes = [(12, 16, 1), (24, 32, 1), (48, 64, 1), (12, 16, 2)] if options.meshes else []

    def task() -> list[str]:
        numbers = run(
            divisions, cases, options.out, numbers=earlier, file=options.json,
            dampings=() if options.no_damping else DAMPINGS, meshes=meshes,
            random=options.random, size=options.size, comm=comm, say=speaker(comm),
        )  # fmt: skip
        return words(numbers)

    return exit_code(comm, task)


if __name__ == "__main__":
    sys.exit(main())
