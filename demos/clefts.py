"""Do seeded pumpkins deploy? A design that is linearly stable, one that is not, and lobes of constant radius.

Thirty-two gores of 5 m radius, soft film of 30 MPa and 38 um, tendons of EA = 100 kN, bottom fitting held.
With lobes of a constant half angle of 85 degrees the symmetric shape is stable at 100 Pa and unstable at
400 Pa; with lobes of the same angle at the equator but of constant radius it is stable at both. Tendons are
moved around the axis in four waves, or four gores pulled in along an S line, film and fittings touch
each other, and the balloon is released. Where it stays clefted the cleft is looked at: volume and energy
beside the symmetric shape, contact, lowest eigenvalues, the same with a tenth and a hundredth of the
damping, and at which lower pressure it deploys. Writes a table, numbers, a chart and pictures.

    python demos/clefts.py --out out/clefts
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import lobefem.linalg.dolfinx_compat  # noqa: F401  first: it finds the stack

# isort: split
from lobefem import (
    Balloon,
    Cleft,
    ConstantAngle,
    ConstantRadius,
    EndPlates,
    GasPressure,
    Gore,
    HarmonicSeed,
    Perturbed,
    PumpkinCurve,
    PumpkinRecipe,
    SelfContact,
    Tendons,
    TensionField,
    deploy,
    find_modes,
    full_state,
    inflate,
    perturb,
    release_start,
    seal,
)
from lobefem import release as let_go
from lobefem.equilibrium import Distortion, Equilibrium
from lobefem.equilibrium.solver_options import FlowOptions
from lobefem.files import save_json
from lobefem.stability.relaxation import DISTORTED

from mpi4py import MPI

# isort: split
from command import exit_code, folder, pair, parser, speaker

GORES, ANGLE, RADIUS = 32, 85.0, 5.0
SMALL, LARGE = HarmonicSeed(4, 0.1), HarmonicSeed(4, 0.4)
S_CLEFT = Cleft(0.6, 45.0, 90.0)

# lobes, pressure [Pa], seed, whether the gas is sealed in
Case = tuple[str, float, Distortion, bool]
CASES: tuple[Case, ...] = (
    ("angle", 100.0, LARGE, False),
    ("angle", 100.0, S_CLEFT, False),
    ("angle", 400.0, SMALL, False),
    ("angle", 400.0, SMALL, True),
    ("radius", 400.0, LARGE, False),
    ("radius", 400.0, S_CLEFT, False),
)
AMBIENT = 5000.0  # [Pa]
DAMPINGS = (0.1, 0.01)
LOWER = (320.0, 280.0, 240.0, 200.0, 150.0, 100.0)  # [Pa]

Say = Callable[[str], None]


def pumpkin(lobes: str, divisions: Sequence[int], full: bool, comm: Any, *parts: Any) -> Balloon:
    """One gore or all, on bilinear quadrilaterals."""
    kind = {"angle": ConstantAngle, "radius": ConstantRadius}[lobes]
    gore = Gore(PumpkinCurve(RADIUS, 0.25), GORES, kind(math.radians(ANGLE)))
    along, across = divisions
    surface = PumpkinRecipe(gore, (along, across), order=1, full=full).surface(comm)
    film = TensionField(E=30e6, nu=0.4, thickness=38e-6, slack_stiffness=1e-5)
    components = [GasPressure("closed"), Tendons(EA=1e5), EndPlates(bar=False), *parts]
    return Balloon(surface, film, components)


def symmetric(lobes: str, pressure: float, divisions: Sequence[int], comm: Any) -> tuple[Equilibrium, Any]:
    """All gores alike at a pressure, and the lowest modes of one of them."""
    gore = pumpkin(lobes, divisions, False, comm)
    state = inflate(gore, pressure / 4)
    state = inflate(gore, pressure, start=state)
    modes = find_modes(state, 1, harmonics=range(GORES // 2 + 1))
    contact = SelfContact(stiffness=pressure)
    return full_state(state, pumpkin(lobes, divisions, True, comm, contact)), modes


def release(case: Case, divisions: Sequence[int], steps: int, comm: Any, say: Say) -> tuple[Any, Perturbed]:
    """One case: its row of the table, and what was found."""
    lobes, pressure, seed, sealed = case
    state, modes = symmetric(lobes, pressure, divisions, comm)
    original = seal(state, AMBIENT) if sealed else state
    found = perturb(
        original.balloon, pressure, seed, let_go=True, steps=steps, original=original, progress=say
    )
    end = found.released
    assert end is not None
    rest = end.state or found.imposed
    assert rest is not None
    before, after = (one.balloon.energy(one.restore())[0] for one in (original, rest))
    contact = rest.balloon.contact.measure(rest.balloon.u)
    row = {
        "lobes": f"constant {lobes}",
        "pressure": pressure,
        "gas": "sealed" if sealed else "given",
        "seed": seed.kind,
        "amount": seed.parameter,
        "symmetric_eigenvalue": modes.lowest,
        "symmetric_harmonic": modes[0].harmonic,
        "seed_contact": max(point.contact_force for point in found.ramp),
        "outcome": end.outcome,
        "reason": end.reason,
        "distance": end.distance,
        "pressure_final": rest.pressure,
        "volume_deficit": 1 - rest.volume / original.volume,
        "energy_above": after - before,
        "contact_force": contact.force,
        "contact_area": contact.area,
        "gap": min(point.gap for point in found.history if point.gap is not None),
        "eigenvalues": [] if end.modes is None else [mode.value.real for mode in end.modes],
        "ledger_error": end.ledger.error,
        "steps": len(end.history),
        "volumes": [[p.time, p.volume / original.volume] for p in found.history if p.time is not None],
    }
    return row, found


def damped(found: Perturbed, say: Say) -> list[dict[str, Any]]:
    """The release again with a tenth and a hundredth of the damping."""
    rows = []
    assert found.imposed is not None
    for damping in DAMPINGS:
        end = let_go(
            release_start(found.imposed),
            undistorted=found.original,
            ledger=found.ramp[-1].ledger,
            options=FlowOptions(damping=damping),
            progress=say,
        )
        gained = None if end.state is None else end.state.volume / found.original.volume - 1
        row = {"damping": damping, "outcome": end.outcome, "lowest": end.lowest, "volume_gained": gained}
        rows.append(row | {"time": end.history[-1].time, "ledger_error": end.ledger.error})
    return rows


def lowered(found: Perturbed, lobes: str, divisions: Sequence[int], comm: Any, say: Say) -> dict[str, Any]:
    """The cleft at lower and lower pressures, and at which of them it deploys."""
    assert found.released is not None
    assert found.released.state is not None
    end = found.released.state
    gore = pumpkin(lobes, divisions, False, comm)
    alike = {}
    state = inflate(gore, end.pressure / 4)
    for pressure in sorted(LOWER):
        alike[pressure] = state = inflate(gore, pressure, start=state)
    study = deploy(end, LOWER, lambda p: full_state(alike[p], end.balloon), progress=say)
    rows = []
    for whole, one in zip(study.symmetric, study.released, strict=True):
        modes = find_modes(alike[whole.pressure], 1, harmonics=range(2, GORES // 2 + 1))
        gained = None if one.state is None else one.state.volume / whole.volume - 1
        rows.append(
            {
                "pressure": whole.pressure,
                "symmetric_eigenvalue": modes.lowest,
                "outcome": one.outcome,
                "lowest": one.lowest,
                "distance": one.distance,
                "volume_gained": gained,
            }
        )
    return {"pressures": rows, "deployed_from": study.deployed_from}


def run(
    divisions: Sequence[int] = (12, 4),
    *,
    out: str | Path = "out/clefts",
    cases: Sequence[Case] = CASES,
    steps: int = 8,
    picture: bool = True,
    comm: Any = MPI.COMM_WORLD,
    say: Say = lambda text: None,
) -> dict[str, Any]:
    """Compute everything, write it into `out`, and return the numbers. Collective."""
    out = folder(out, comm)
    rows = []
    more: dict[str, Any] = {}
    for k, case in enumerate(cases, 1):
        row, found = release(case, divisions, steps, comm, say)
        rows.append(row)
        say(f"{row['lobes']}, {row['pressure']:g} Pa, {row['seed']}: {row['outcome']}")
        end = found.released
        stays = end is not None and row["outcome"] == DISTORTED
        if stays and picture:
            draw(end.state, out / f"cleft_{k}.png", comm)
        if stays and not more and row["gas"] == "given":
            more = {"damped": damped(found, say), "lowered": lowered(found, case[0], divisions, comm, say)}
    numbers = {"gores": GORES, "half_angle": ANGLE, "divisions": list(divisions), "cases": rows} | more
    if comm.rank == 0:
        (out / "table.md").write_text(to_markdown(numbers), encoding="utf-8")
        chart(numbers, out / "clefts.png")
    save_json(out / "clefts.json", numbers, comm)
    return numbers


def to_markdown(numbers: dict[str, Any]) -> str:
    """The numbers as a table."""
    along, across = numbers["divisions"]
    lines = [
        f"{numbers['gores']} gores, half angle {numbers['half_angle']:g} degrees at the equator, "
        f"{along} x {across} cells a gore.",
        "",
        "| lobes | p [Pa] | gas | lowest before [Pa/m] | seed | outcome | volume gained | energy above [J] "
        "| contact [N] | [m^2] | lowest after [Pa/m] | ledger |",
        "|" + "---|" * 12,
    ]
    for row in numbers["cases"]:
        lowest = f"{row['eigenvalues'][0]:.3g}" if row["eigenvalues"] else ""
        lines.append(
            f"| {row['lobes']} | {row['pressure']:g} | {row['gas']} | {row['symmetric_eigenvalue']:.3g}, "
            f"n = {row['symmetric_harmonic']} | {row['seed']}, {row['amount']:g} m | {row['outcome']} "
            f"| {-100 * row['volume_deficit']:.3f} % | {row['energy_above']:.3g} "
            f"| {row['contact_force']:.3g} | {row['contact_area']:.3g} | {lowest} "
            f"| {100 * row['ledger_error']:.2g} % |"
        )
    for row in numbers.get("damped", ()):
        lines += [
            "",
            f"With {row['damping']:g} of the damping: {row['outcome']}, lowest {row['lowest']:.3g} Pa/m.",
        ]
    for row in numbers.get("lowered", {}).get("pressures", ()):
        lines += [
            "",
            f"Lowered to {row['pressure']:g} Pa (symmetric shape {row['symmetric_eigenvalue']:.2g} Pa/m from "
            f"harmonic 2 on): {row['outcome']}, {row['distance']:.2g} m from the symmetric shape.",
        ]
    return "\n".join(lines) + "\n"


def chart(numbers: dict[str, Any], path: Path) -> None:
    """Volume over that of the symmetric shape, from the release on."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.5, 4.5), layout="constrained")
    axes = figure.add_subplot()
    for row in numbers["cases"]:
        name = f"{row['lobes']}, {row['pressure']:g} Pa, {row['seed']}"
        name += ", sealed" if row["gas"] == "sealed" else ""
        shown = [(t, 100 * (v - 1)) for t, v in row["volumes"] if t]
        axes.plot(*zip(*shown, strict=True), "-", lw=1.2, label=name)
    axes.axhline(0.0, color="k", lw=0.6)
    axes.set(
        xscale="log", xlabel="time after the release [s]", ylabel="volume above the symmetric shape's [%]"
    )
    axes.grid(alpha=0.3, which="both", lw=0.5)
    axes.legend(fontsize=7)
    figure.savefig(path, dpi=150)


def draw(state: Equilibrium, path: Path, comm: Any) -> None:
    """The film from above and from the side, where it can be rendered. Collective."""
    from lobefem.viz.rendering import can_render

    grid = state.to_pyvista()
    if comm.rank or not can_render():
        return
    import pyvista

    plotter = pyvista.Plotter(shape=(1, 2), window_size=(1400, 700), off_screen=True)
    for k, (eye, up) in enumerate((((0, 0, 1), (0, 1, 0)), ((1, 0.4, 0.35), (0, 0, 1)))):
        plotter.subplot(0, k)
        plotter.add_mesh(grid.copy(), color="#c9d7e6", specular=0.2)
        plotter.camera_position = [tuple(40 * x for x in eye), (0, 0, 0), up]
        plotter.reset_camera()
        plotter.camera.zoom(1.2)
    plotter.screenshot(path)
    plotter.close()


def main(argv: Sequence[str] | None = None) -> int:
    """Run the demo from the command line."""
    line = parser("Do seeded pumpkins deploy?", "out/clefts", "12x4", "of a gore along it, and across")
    options, comm = line.parse_args(argv), MPI.COMM_WORLD
    divisions = pair(options, line)

    def task() -> list[str]:
        numbers = run(divisions, out=options.out, comm=comm, say=speaker(comm, clock=True))
        return [to_markdown(numbers), f"table, chart, pictures and numbers are in {options.out}"]

    return exit_code(comm, task)


if __name__ == "__main__":
    sys.exit(main())
