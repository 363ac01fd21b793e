"""Is it stable? Eigenvalues and modes of one lobe and of the four-lobe stack (paper sec. 5).

For each of {one lobe, four lobes} x {fixed wrinkles, isotropic}: the lowest eigenvalues against
pressure (paper figs 13, 15, 17, 19), the mode shapes (figs 12, 14, 16, 18), fields for ParaView, one
table beside the paper's words, and a report of it all for a browser. The geometry is held at the
ideal isotensoid, its stress in proportion to the pressure. Runs serially or under mpirun.

    python demos/stability.py --out out/demo
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import lobefem.linalg.dolfinx_compat  # noqa: F401  first: it finds the stack

# isort: split
from command import exit_code, folder, pair, parser, speaker
from paper_words import CASES, Row, beside_the_paper, compare, to_markdown

from lobefem import critical_pressure, find_modes, ideal_state
from lobefem.app.states_command import mode_data
from lobefem.app.states_command import summary as origin
from lobefem.files import on_root, save_json
from lobefem.io.design import Design
from lobefem.io.run_folder import RunFolder
from lobefem.io.xdmf import Snapshot
from lobefem.stability.branch_following import Branch
from lobefem.stability.linear_buckling import CriticalPressure
from lobefem.stability.mode_records import Modes
from lobefem.stability.nonlinear_buckling import CriticalPoint
from lobefem.stability.tracing import branches
from lobefem.terminal import console, is_terminal
from lobefem.viz.mode_figures import eigenvalue_curves, mode_shapes
from lobefem.viz.rendering import can_render, render_modes
from lobefem.viz.report import TABLES, write_report
from lobefem.viz.verdict import FIXED_WRINKLES

from mpi4py import MPI

PRESSURES = (50.0, *(500.0 * k for k in range(1, 13)))
AROUND = (24, 32, 36, 40, 48)  # divisions of the mesh study
PUBLISHED = {"single, fixed-wrinkles": 4600.0, "stack, fixed-wrinkles": 3000.0}
COUNT = 24  # modes computed at the pressure at which they are drawn
SHOWN = 4000.0  # the pressure nearest to which modes are drawn [Pa]

Say = Callable[[str], None]


def design(lobes: int, law: str, divisions: Sequence[int], support: str = "clamped") -> Design:
    """The paper's design; its edge radius, film and hoops are the defaults."""
    return Design.parse(
        {
            "shape": {"lobes": lobes},
            "mesh": {"divisions": list(divisions)},
            "film": {"law": law, "prestress": True},
            "hoops": {"enabled": lobes > 1},
            "plates": {"support": support},
            "pressure": {"load": "film"},
        }
    )


def crossing(lobes: int, divisions: Sequence[int], comm: Any) -> float | None:
    """Critical pressure with fixed wrinkles and both rims held [Pa], None without one. Collective."""
    held = design(lobes, "fixed-wrinkles", divisions, "fixed")
    return _finite(critical_pressure(held.balloon(held.surface(comm))).pressure)


def distinct(modes: Modes) -> list[int]:
    """Indices of the modes, of each pair the first."""
    kept: list[int] = []
    for i, mode in enumerate(modes.modes):
        before = modes[kept[-1]] if kept else None
        near = before is not None and abs(before.value.real - mode.value.real) <= 1e-6 * abs(mode.value)
        if not (near and before is not None and before.harmonic == mode.harmonic):
            kept.append(i)
    return kept


def choose(modes: Modes, law: str) -> list[int]:
    """Four modes to draw: the lowest; with fixed wrinkles three global ones and a local one."""
    candidates = distinct(modes)
    local = [i for i in candidates if modes[i].kind == "local"]
    others = [i for i in candidates if modes[i].kind != "local"]
    if law == "isotropic" or not local or len(others) < 3:
        return candidates[:4]
    return [*others[:3], local[0]]


def study(
    name: str,
    divisions: Sequence[int],
    pressures: Sequence[float],
    meshes: Sequence[dict[str, Any]],
    out: Path,
    comm: Any,
    say: Say,
) -> tuple[dict[str, Any], Modes]:
    """One case: its numbers, and the modes that were drawn. Collective."""
    size, law = name.split(", ")
    described = design(4 if size == "stack" else 1, law, divisions)
    balloon = described.balloon(described.surface(comm))
    say(f"{name}: eigenvalues at {len(pressures)} pressures")
    curves = branches(balloon, pressures)
    say(f"{name}: critical pressure")
    critical = critical_pressure(balloon)
    at = min(pressures, key=lambda p: abs(p - SHOWN))
    say(f"{name}: modes at {at:.0f} Pa")
    shown = find_modes(ideal_state(balloon, at), COUNT)
    say(f"{name}: figures and fields")
    picked = choose(shown, law)
    title = f"{'Four lobes' if size == 'stack' else 'Single lobe'}, {law.replace('-', ' ')}"
    stem = name.replace(", ", "_")
    figure = mode_shapes(
        shown,
        picked,
        title=f"{title}, p = {at:.0f} Pa",
        columns=4 if size == "stack" else 2,
    )
    if figure is not None:
        figure.savefig(out / f"{stem}_modes.png")
        figure = eigenvalue_curves(curves, title=title, critical=critical, published=PUBLISHED.get(name))
        figure.savefig(out / f"{stem}_eigenvalues.png")
    numbers = summary(curves, shown, critical)
    snapshot = Snapshot(balloon, at, shown.state, tuple(shown[i] for i in picked))
    told = origin("stability", described) | {"title": title} | numbers
    told["harmonic"] = told.pop("critical_harmonic")
    told["kind"] = None if critical.mode is None else critical.mode.kind
    told["stored_modes"] = [mode_data(shown[i]) | {"number": i + 1} for i in picked]
    if law == "fixed-wrinkles":
        told["warnings"].append(FIXED_WRINKLES)
        told["meshes"] = [{"divisions": row["divisions"], "critical_pressure": row[size]} for row in meshes]
        told["verdict"] = [
            f"Both rims held; {divisions[0]} divisions along each lobe's meridian, more and more around."
        ]
    RunFolder(out / stem, comm, overwrite=True).save(described.to_toml(), told, [snapshot])
    return numbers, shown


def curve_numbers(
    curves: Sequence[Branch], critical: CriticalPressure | CriticalPoint | None
) -> dict[str, Any]:
    """Numbers of the curves of a case, in SI."""
    mode = None if critical is None else critical.mode
    return {
        "pressures": sorted({float(p) for b in curves for p in b.pressures}),
        "critical_pressure": None if critical is None else _finite(critical.pressure),
        "critical_harmonic": None if mode is None else mode.harmonic,
        "branches": [
            {
                "kind": b.kind,
                "harmonic": b.harmonic,
                "rank": b.rank,
                "pressures": b.pressures.tolist(),
                "values": b.values.tolist(),
            }
            for b in curves
        ],
    }


def summary(curves: Sequence[Branch], shown: Modes, critical: CriticalPressure) -> dict[str, Any]:
    """Numbers of a case, all in SI."""
    return curve_numbers(curves, critical) | {
        "shown": {
            "pressure": shown.state.pressure,
            "volume": shown.state.volume,
            "asymmetry": shown.asymmetry,
            "modes": [
                {
                    "real": m.value.real,
                    "imag": m.value.imag,
                    "residual": m.residual,
                    "harmonic": m.harmonic,
                    "kind": m.kind,
                }
                for m in shown.modes
            ],
        },
    }


def run(
    divisions: tuple[int, int] = (24, 32),
    pressures: Sequence[float] = PRESSURES,
    out: str | Path = "out/demo",
    *,
    around: Sequence[int] = AROUND,
    picture: bool = True,
    comm: Any = MPI.COMM_WORLD,
    say: Say = lambda text: None,
) -> dict[str, Any]:
    """The whole demo; returns its numbers on every rank. Collective.

    Args:
        divisions: of each lobe along its meridian, and around.
        pressures: of the sweeps [Pa].
        out: folder of figures, tables and fields; the same on all ranks.
        around: divisions around the axis of the mesh study, those along the meridian kept.
        picture: also draw the stack's modes in space, where VTK can.
        comm: MPI communicator.
        say: called with what goes on.
    """
    out = folder(out, comm)
    numbers: dict[str, Any] = {"divisions": list(divisions), "load": "film", "mass": "unit", "cases": {}}
    numbers["mesh_study"] = []
    for n in around:
        say(f"mesh study: {divisions[0]} x {n} divisions")
        row = {"divisions": [divisions[0], n]}
        numbers["mesh_study"].append(
            row
            | {"single": crossing(1, row["divisions"], comm), "stack": crossing(4, row["divisions"], comm)}
        )
    for name in CASES:
        numbers["cases"][name], shown = study(
            name, divisions, pressures, numbers["mesh_study"], out, comm, say
        )
        if name == "stack, fixed-wrinkles" and picture:
            numbers["picture"] = _picture(shown, out / "stack_modes_3d.png", comm, say)
    rows = compare(numbers)
    numbers["paper"] = [row._asdict() for row in rows]
    if comm.rank == 0:
        (out / "table.md").write_text(to_markdown(rows, _header(divisions)), encoding="utf-8")
    save_json(out / "stability.json", numbers, comm)
    save_json(out / TABLES, beside_the_paper(rows, _header(divisions)), comm)
    say("report")
    on_root(comm, out, lambda: write_report(out))
    return numbers


def _picture(shown: Modes, path: Path, comm: Any, say: Say) -> bool:
    possible = comm.bcast(can_render() if comm.rank == 0 else None, root=0)
    if not possible:
        say("no 3D picture: VTK cannot draw off-screen here (its Debian build needs an X server: xvfb-run)")
        return False
    say("picture of the stack's modes")
    candidates = distinct(shown)
    local = [i for i in candidates if shown[i].kind == "local"]
    render_modes(shown, [candidates[0], (local or candidates)[0]], path)
    return True


def _header(divisions: Sequence[int]) -> str:
    return (
        "Held isotensoid, edge radius 2 m, `film` pressure, bottom plate clamped, bar; "
        f"{divisions[0]} x {divisions[1]} linear triangles a lobe. Eigenvalues with unit areal mass "
        "[Pa/m], that is squared circular frequencies in 1/s^2 of a film of 1 kg/m^2. Mesh study: both "
        "rims held."
    )


def _finite(pressure: float) -> float | None:
    return pressure if math.isfinite(pressure) else None


def _show(rows: Sequence[Row], header: str) -> None:
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, caption=header, caption_justify="left", show_lines=True)
    for column in ("paper, sec. 5", "here", "verdict"):
        table.add_column(column)
    for row in rows:
        table.add_row(*row[:3])
    console(sys.stdout, 120).print(table)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the demo from the command line."""
    line = parser("Stability of one lobe and of four (paper sec. 5)", "out/demo", "24x32")
    options, comm, begin = line.parse_args(argv), MPI.COMM_WORLD, time.monotonic()
    divisions = pair(options, line)

    def task() -> list[str]:
        with ExitStack() as stack:
            say = speaker(comm, clock=True)
            if comm.rank == 0 and is_terminal(sys.stderr):
                say = stack.enter_context(console(sys.stderr).status("setting up", spinner="line")).update
            numbers = run(divisions, out=options.out, comm=comm, say=say)
        if comm.rank == 0:
            _show([Row(**row) for row in numbers["paper"]], _header(divisions))
        return [
            f"{time.monotonic() - begin:.0f} s; figures, fields and tables are in {options.out}",
            f"The report of it all is {options.out / 'report.html'}: open it in a browser",
        ]

    return exit_code(comm, task)


if __name__ == "__main__":
    sys.exit(main())
