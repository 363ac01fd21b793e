"""At which bulge angle a pumpkin of 27 m and 200 gores turns unstable, beside what is known of such balloons.

Public sources tell how three balloons deployed, not of what film they were and under which pressure each
gore was. So the film and the tendons here are those of NASA's large balloon, and the verdict is by the bulge
angle, for lobes of constant angle and of constant radius, cut flat. Writes a table and JSON.

    python demos/ground_models.py --out out/ground_models
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import lobefem.linalg.dolfinx_compat  # noqa: F401  first: it finds the stack

# isort: split
from lobefem import Balloon, EndPlates, GasPressure, OrthotropicTensionField
from lobefem.files import save_json
from lobefem.geometry.gore import ConstantAngle, ConstantRadius, Gore
from lobefem.geometry.pumpkin import PumpkinRecipe
from lobefem.geometry.pumpkin_curve import PumpkinCurve
from lobefem.model.cables import Tendons
from lobefem.stability import critical_pressures

from mpi4py import MPI

# isort: split
from command import exit_code, pair, parser

GORES, RADIUS = 200, 13.5

ANGLES = (55.0, 68.0, 75.0, 80.0, 85.0, 95.0)  # full bulge angles [degrees], at the equator

HARMONICS = range(2, 9)

LOWEST, HIGHEST = 20.0, 500.0  # [Pa]

LOBES = {"constant angle": ConstantAngle, "constant radius": ConstantRadius}

KNOWN = (
    "a 27 m model of 200 gores and a full bulge angle of 55 degrees deployed",
    "flight 586NT, 200 gores, 54.47 m by 33.36 m, deployed fully at 50 to 60 Pa",
    "a replica of flight 555, 'too much bulge material for the number of gores', clefted in an S; with 10 of "
    "its gores trussed up it deployed",
    "inextensible hoop fibres of constant angle, without what film bears else: unstable above 68 degrees",
)


def model(angle: float, lobes: str, divisions: tuple[int, int]) -> Balloon:
    """One gore of a 27 m balloon with a full bulge angle [degrees]."""
    gore = Gore(PumpkinCurve(RADIUS, 0.02 * RADIUS), GORES, LOBES[lobes](math.radians(angle / 2)))
    recipe = PumpkinRecipe(gore, divisions)
    surface = recipe.surface()
    film = OrthotropicTensionField(E1=212.5e6, E2=246.6e6, nu12=0.58, thickness=38.1e-6, slack_stiffness=1e-5)
    parts = [GasPressure("closed"), Tendons(EA=761_560.0), EndPlates(bar=False)]
    return Balloon(surface, film, parts, pattern=recipe.pattern(surface))


def run(
    divisions: Sequence[int] = (24, 6),
    *,
    out: Path = Path("out/ground_models"),
    angles: Sequence[float] = ANGLES,
    comm: Any = MPI.COMM_WORLD,
) -> dict[str, Any]:
    """Compute everything, write it into `out`, and return the numbers. Collective."""
    along, across = divisions
    rows = []
    for lobes in LOBES:
        for angle in angles:
            found = critical_pressures(
                model(angle, lobes, (along, across)),
                HARMONICS,
                up_to=HIGHEST,
                start=LOWEST,
                growth=1.8,
                first=True,
            )
            rows.append(
                {
                    "lobes": lobes,
                    "bulge_angle": angle,
                    "critical_pressure": found.pressure,
                    "harmonic": found.harmonic,
                    "searched_from": found.visited[0],
                    "searched_to": found.searched_to,
                }
            )
    numbers = {"gores": GORES, "diameter": 2 * RADIUS, "divisions": list(divisions), "models": rows}
    if comm.rank == 0:
        out.mkdir(parents=True, exist_ok=True)
        (out / "table.md").write_text(to_markdown(numbers), encoding="utf-8")
    save_json(out / "ground_models.json", numbers, comm)
    return numbers


def to_markdown(numbers: dict[str, Any]) -> str:
    """The verdicts as a table, with what is known."""
    lines = [f"| full bulge angle | {' | '.join(LOBES)} |", "|---|---|---|"]
    for angle in dict.fromkeys(row["bulge_angle"] for row in numbers["models"]):
        told = [verdict(row) for row in numbers["models"] if row["bulge_angle"] == angle]
        lines.append(f"| {angle:g} | {' | '.join(told)} |")
    return "\n".join([*lines, "", "Known:", "", *(f"- {one}" for one in KNOWN)]) + "\n"


def verdict(row: dict[str, Any]) -> str:
    """Up to which pressure a model is stable, in words."""
    pressure, n = row["critical_pressure"], row["harmonic"]
    if pressure is None:
        return f"stable to {row['searched_to']:.0f} Pa and more"
    if not pressure:
        return f"stable at no pressure (n = {n})"
    return f"stable up to {pressure:.0f} Pa (n = {n})"


def main(argv: Sequence[str] | None = None) -> int:
    """Run the demo from the command line."""
    line = parser(
        "Bulge angles at which a pumpkin of 27 m turns unstable", "out/ground_models", "24x6", "of a gore"
    )
    options, comm = line.parse_args(argv), MPI.COMM_WORLD
    divisions = pair(options, line)

    def task() -> list[str]:
        numbers = run(divisions, out=options.out, comm=comm)
        return [to_markdown(numbers), f"table and numbers are in {options.out}"]

    return exit_code(comm, task)


if __name__ == "__main__":
    sys.exit(main())
