"""NASA's 18.8 million cubic foot superpressure balloon: its size beside the published one, and its stability.

280 gores cut flat by the published table, orthotropic tension-field film with a second layer over the top,
tendons, fittings, payload and hydrostatic gas (meshes/superpressure.toml). The state is found on three
meshes; the balloon of another program's data beside that program's numbers. What moves the height, and
what moves the stability, is found by changing one assumption at a time. Writes a chart and tables.

    python demos/superpressure.py --out out/superpressure
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import lobefem.linalg.dolfinx_compat  # noqa: F401  first: it finds the stack

# isort: split
import numpy as np
from matplotlib.figure import Figure

from lobefem import Balloon, Design, EndPlates, GasPressure, OrthotropicTensionField, inflate
from lobefem.equilibrium.pumpkin_measures import measure
from lobefem.files import save_json
from lobefem.geometry.gore import Gore, TabulatedWidth
from lobefem.geometry.pumpkin import PumpkinRecipe
from lobefem.geometry.pumpkin_curve import PumpkinCurve
from lobefem.model.cables import Tendons
from lobefem.stability import critical_pressures

from mpi4py import MPI

# isort: split
from command import exit_code, pair, parser

DESIGN = Path(__file__).resolve().parents[1] / "meshes" / "superpressure.toml"

PUBLISHED = {"volume": 532_379.0, "diameter": 114.5, "height": 68.96}

# linear triangles 96 x 8 a gore, isotropic film, even pressure, tendons cut off at r = 0.8 m
ELSEWHERE = {"volume": 530_495.0, "diameter": 115.13, "height": 70.09, "tension": (5954.0, 6081.0)}

PRESSURE, HIGHEST = 170.0, 1000.0  # [Pa]

HARMONICS = range(2, 11)  # 0 and 1 are the balloon as a whole, which the bottom fitting holds

# one assumption at a time: what it is, and the keys of the design
SIZES: tuple[tuple[str, dict[str, Any]], ...] = (
    ("as published", {}),
    ("50 Pa at the bottom, not 170 Pa", {"pressure.value": 50.0}),
    ("250 Pa", {"pressure.value": 250.0}),
    ("no gradient of the gas", {"pressure.gradient": 0.0, "fittings.payload": 0.0}),
    ("weightless film", {"film.density": 1e-6}),
    ("without the cap", {"film.caps": []}),
    ("film of half the modulus", {"film.E1": 106.25e6, "film.E2": 123.3e6}),
    ("tendons ten times as stiff", {"tendons.EA": 7.6156e6}),
    ("tendons as long as the flat gore, 148.44 m", {"shape.tendon_length": 148.44}),
    ("tendons 1 % shorter", {"tendons.foreshortening": 0.01}),
)

STABILITY: tuple[tuple[str, dict[str, Any]], ...] = (
    ("as published", {}),
    ("without the cap", {"film.caps": []}),
    ("nu12 = 0.3, not 0.58", {"film.nu12": 0.3}),
    ("tendons ten times as stiff", {"tendons.EA": 7.6156e6}),
    ("fittings of 0.5 m", {"shape.fitting_radius": [0.5, 0.5]}),
    ("tendons 2 % shorter", {"tendons.foreshortening": 0.02}),
    ("tendons 4 % shorter", {"tendons.foreshortening": 0.04}),
    ("gores 1 % wider", {"widths": 1.01}),
    ("gores 2 % wider", {"widths": 1.02}),
    ("gores 3 % wider", {"widths": 1.03}),
    ("gores 5 % wider", {"widths": 1.05}),
    ("film of a tenth of the modulus", {"film.E1": 21.25e6, "film.E2": 24.66e6}),
    ("film of 3 % of the modulus", {"film.E1": 6.375e6, "film.E2": 7.398e6}),
)


def meshes(divisions: Sequence[int]) -> list[tuple[int, int]]:
    """A half, three quarters and all of the cells along a gore and across it."""
    along, across = divisions
    if along % 4 or across % 4:
        raise argparse.ArgumentTypeError(f"{along}x{across}: give multiples of four such as 32x8")
    return [(along * k // 4, across * k // 4) for k in (2, 3, 4)]


def design(divisions: Sequence[int], changes: Mapping[str, Any] | None = None) -> Design:
    """The balloon's design on a mesh with other values; `widths` is a factor on its gores' half-widths."""
    found = Design.load(DESIGN)
    changes = dict(changes or {})
    wider = changes.pop("widths", None)
    if wider is not None:
        assert found.shape.half_widths is not None
        changes["shape.half_widths"] = [wider * width for width in found.shape.half_widths]
    return found.with_overrides({"mesh.divisions": list(divisions)} | changes)


def sizes(plan: Design) -> dict[str, Any]:
    """Sizes, tension and stress of a design's state at its pressure."""
    balloon = plan.balloon(plan.surface(sector=True))
    return numbers_of(inflate(balloon, plan.pressure.value[0]))


def numbers_of(state: Any) -> dict[str, Any]:
    """Sizes, tension and stress of a state."""
    found = measure(state)
    return {
        "volume": state.volume,
        "diameter": found.diameter,
        "height": found.height,
        "tension": [float(found.tendon_tension.min()), float(found.tendon_tension.max())],
        "max_stress": found.max_stress,
    }


def elsewhere(divisions: Sequence[int]) -> dict[str, Any]:
    """The same of the other program's balloon, on linear triangles."""
    length = 150.27
    whole = PumpkinCurve(length / 2.6220576, 0.01)  # as good as from pole to pole
    curve = PumpkinCurve(whole.R0, 0.8)
    plan = Design.load(DESIGN).shape
    assert plan.stations is not None
    assert plan.half_widths is not None
    cut = (length - curve.arc_length) / 2
    at = (np.asarray(plan.stations) * length - cut) / curve.arc_length
    kept = (at > 0) & (at < 1)
    stations = np.concatenate([[0.0], at[kept], [1.0]])
    widths = np.interp(stations, at, plan.half_widths)
    gore = Gore(curve, 280, TabulatedWidth(tuple(stations.tolist()), tuple(widths.tolist())))
    along, across = divisions
    recipe = PumpkinRecipe(gore, (3 * along, across + across % 2), "triangle", order=1)
    surface = recipe.surface()
    film = OrthotropicTensionField(E1=230e6, E2=230e6, nu12=0.6, thickness=38.1e-6, slack_stiffness=1e-5)
    parts = [GasPressure("closed"), Tendons(EA=761_560.0), EndPlates(bar=False)]
    return numbers_of(inflate(Balloon(surface, film, parts, pattern=recipe.pattern(surface)), PRESSURE))


def stability(divisions: Sequence[int], changes: Mapping[str, Any]) -> dict[str, Any]:
    """First loss of stability, and the lowest eigenvalues on the way."""
    plan = design(divisions, changes)
    balloon = plan.balloon(plan.surface(sector=True))
    found = critical_pressures(balloon, HARMONICS, up_to=HIGHEST, start=40.0, growth=1.6, first=True)
    return {
        "critical_pressure": found.pressure,
        "harmonic": found.harmonic,
        "searched_to": found.searched_to,
        "visited": list(found.visited),
        "charts": {str(n): list(found.chart(n)) for n in found.harmonics},
    }


def run(
    divisions: Sequence[int] = (32, 8),
    *,
    out: Path = Path("out/superpressure"),
    variants: int | None = None,
    comm: Any = MPI.COMM_WORLD,
) -> dict[str, Any]:
    """Compute everything, write it into `out`, and return the numbers. Collective.

    Args:
        divisions: of the finest mesh, multiples of four.
        out: folder of the results.
        variants: how many of the rows of `SIZES` and `STABILITY`; all by default.
        comm: ranks, all of which compute the same.
    """
    chosen = meshes(divisions)
    numbers: dict[str, Any] = {
        "published": PUBLISHED,
        "meshes": [{"divisions": list(size)} | sizes(design(size)) for size in chosen],
        "another_program": {"theirs": ELSEWHERE, "ours": elsewhere(divisions)},
        "sizes": [{"what": what} | sizes(design(chosen[0], keys)) for what, keys in SIZES[:variants]],
        "stability": [
            {"what": what, "meshes": [stability(size, keys) for size in chosen[:2]]}
            for what, keys in STABILITY[:variants]
        ],
    }
    if comm.rank == 0:
        out.mkdir(parents=True, exist_ok=True)
        (out / "tables.md").write_text(to_markdown(numbers), encoding="utf-8")
        draw(numbers, out / "superpressure.png")
    save_json(out / "superpressure.json", numbers, comm)
    return numbers


def to_markdown(numbers: dict[str, Any]) -> str:
    """The numbers as tables."""

    def row(name: str, one: Mapping[str, Any]) -> str:
        tension = " to ".join(f"{value:.0f}" for value in one["tension"]) if "tension" in one else ""
        stress = f"{one['max_stress'] / 1e6:.2f}" if "max_stress" in one else ""
        sizes = f"{one['volume']:.0f} | {one['diameter']:.2f} | {one['height']:.2f}"
        return f"| {name} | {sizes} | {tension} | {stress} |"

    head = "| volume [m^3] | diameter [m] | height [m] | tendons [N] | stress [MPa] |"
    rule = "|---|---|---|---|---|---|"
    lines = [f"| mesh {head}", rule]
    lines += [row(" x ".join(map(str, one["divisions"])), one) for one in numbers["meshes"]]
    lines += [row("published", numbers["published"])]
    other = numbers["another_program"]
    lines += ["", f"| another program's balloon {head}", rule, row("its numbers", other["theirs"])]
    lines += [row("lobefem", other["ours"])]
    lines += ["", f"| one change at a time {head}", rule]
    lines += [row(one["what"], one) for one in numbers["sizes"]]
    lines += [
        "",
        f"| one change at a time | {' | '.join(_name(numbers, k) for k in (0, 1))} |",
        "|---|---|---|",
    ]
    for one in numbers["stability"]:
        lines.append(f"| {one['what']} | {' | '.join(verdict(found) for found in one['meshes'])} |")
    return "\n".join(lines) + "\n"


def _name(numbers: dict[str, Any], k: int) -> str:
    """Head of a column of critical pressures: the mesh."""
    return "stable up to, " + " x ".join(map(str, numbers["meshes"][k]["divisions"]))


def verdict(found: Mapping[str, Any]) -> str:
    """The first loss of stability in words."""
    pressure, n = found["critical_pressure"], found["harmonic"]
    if pressure is None:
        return f"more than {found['searched_to']:.0f} Pa"
    return f"{pressure:.0f} Pa (n = {n})" if pressure else f"stable at no pressure (n = {n})"


def draw(numbers: dict[str, Any], path: Path) -> None:
    """The lowest eigenvalues of the balloon over pressure, and the critical pressure of its variants."""
    figure = Figure(figsize=(6.7, 2.9), layout="constrained", dpi=200)
    left, right = figure.subplots(1, 2)
    as_built = numbers["stability"][0]["meshes"][-1]
    for n in ("2", "3", "4", "5", "6"):
        left.plot(as_built["visited"], as_built["charts"][n], ".-", lw=1, label=f"n = {n}")
    left.axvline(PRESSURE, color="#888888", lw=0.8, ls=":")
    left.set(xlabel="pressure at the bottom [Pa]", ylabel="lowest eigenvalue [Pa/m]", xscale="log")
    left.legend(frameon=False, fontsize=7)
    left.set_title("as published: no mode loses stability", fontsize=8, loc="left")
    rows = [(one["what"], one["meshes"][-1]) for one in numbers["stability"]][::-1]
    for k, (_, found) in enumerate(rows):
        pressure = found["critical_pressure"]
        reach = found["searched_to"] if pressure is None else pressure
        right.barh(
            k,
            reach,
            color="#0072B2" if reach > PRESSURE else "#D55E00",
            alpha=0.5 if pressure is None else 1.0,
        )
    right.axvline(PRESSURE, color="#888888", lw=0.8, ls=":")
    right.set_yticks(range(len(rows)), [what for what, _ in rows], fontsize=6)
    right.set_xlabel("stable up to [Pa]; pale: as far as was looked")
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(labelsize=6.5)
        axes.xaxis.label.set_size(7)
        axes.yaxis.label.set_size(7)
    figure.savefig(path)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the demo from the command line."""
    of = "of the finest mesh, along a gore and across it"
    line = parser("NASA's superpressure balloon: size and stability", "out/superpressure", "32x8", of)
    options, comm = line.parse_args(argv), MPI.COMM_WORLD
    divisions = pair(options, line, meshes)

    def task() -> list[str]:
        numbers = run(divisions, out=options.out, comm=comm)
        return [to_markdown(numbers), f"chart, tables and numbers are in {options.out}"]

    return exit_code(comm, task)


if __name__ == "__main__":
    sys.exit(main())
