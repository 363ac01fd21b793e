"""The chart of all harmonics against the full model's modes, time and memory, in one run.

Each part runs in a process of its own, so that its peak memory is its own; times leave out the
interpreter's start and imports and begin with the mesh. One core: OMP_NUM_THREADS=1.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import time

PARTS = {
    "chart": "critical pressures of all harmonics, one sector",
    "one": "critical pressure of n = 7 alone, one sector",
    "modes-by-harmonics": "ten lowest modes of each harmonic at 1000 Pa, one sector",
    "full-10": "ten lowest modes at 1000 Pa, full model",
    "full-100": "hundred lowest modes at 1000 Pa, full model",
}


def run(part: str, divisions: tuple[int, int], lobes: int) -> dict[str, float]:
    """One part in this process: seconds in all, seconds of the solution, peak memory [MB]."""
    from lobefem.equilibrium.state import ideal_state
    from lobefem.fem.balloon import Balloon
    from lobefem.geometry.stacks import lobed_cylinder
    from lobefem.linalg import dolfinx_compat  # noqa: F401
    from lobefem.model.cables import Hoops
    from lobefem.model.end_plates import EndPlates
    from lobefem.model.fixed_wrinkles import FixedWrinkles
    from lobefem.model.gas_pressure import GasPressure
    from lobefem.stability.harmonic_buckling import harmonic_pressures
    from lobefem.stability.modes import find_modes
    from lobefem.stability.tracing import branches

    def balloon(divisions: tuple[int, int], sector: bool) -> Balloon:
        surface = lobed_cylinder(lobes, divisions, sector=sector)
        parts = [GasPressure("film"), Hoops(), EndPlates()]
        return Balloon(surface, FixedWrinkles(), parts, prestressed=True)

    sector = not part.startswith("full")
    if sector:  # compile or load the forms before the clock starts
        harmonic_pressures(balloon((4, 8), True), [2])
    else:
        find_modes(ideal_state(balloon((4, 8), False), 1000.0), 2)
    base = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    start = time.perf_counter()
    made = balloon(divisions, sector)
    meshed = time.perf_counter()
    if part == "chart":
        harmonic_pressures(made)
    elif part == "one":
        harmonic_pressures(made, [7])
    elif part == "modes-by-harmonics":
        branches(made, [1000.0], count=10)
    else:
        find_modes(ideal_state(made, 1000.0), int(part.split("-")[1]))
    end = time.perf_counter()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return {"seconds": end - start, "solve": end - meshed, "memory": peak, "above": peak - base}


def main() -> None:
    """Run all parts, one after the other, and print the ratios."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--divisions", default="96x256")
    parser.add_argument("--lobes", type=int, default=1)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--part", choices=PARTS, help=argparse.SUPPRESS)
    parser.add_argument("--json", help="file for the results")
    given = parser.parse_args()
    along, around = map(int, given.divisions.split("x"))
    if given.part:
        print(json.dumps(run(given.part, (along, around), given.lobes)))
        return
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    results: dict[str, dict[str, float]] = {}
    for part in PARTS:
        command = [sys.executable, __file__, "--part", part, "--divisions", given.divisions]
        command += ["--lobes", str(given.lobes)]
        runs = [
            json.loads(subprocess.run(command, env=environment, check=True, capture_output=True).stdout)
            for _ in range(1 if part == "full-100" else given.runs)
        ]
        results[part] = sorted(runs, key=lambda r: r["seconds"])[len(runs) // 2]
    ten, hundred = results["full-10"], results["full-100"]
    print(f"{given.lobes} lobe(s), {given.divisions}: medians of {given.runs}\n")
    print(f"{'':58}{'s':>9}{'solve':>9}{'MB':>7}{'of ten':>9}{'of 100':>9}{'memory':>9}")
    for part, text in PARTS.items():
        r = results[part]
        print(
            f"{text:58}{r['seconds']:9.3f}{r['solve']:9.3f}{r['memory']:7.0f}"
            f"{r['seconds'] / ten['seconds']:9.3f}{r['seconds'] / hundred['seconds']:9.3f}"
            f"{r['above'] / ten['above']:9.3f}"
        )
    print("\nmemory: growth above the imports and a tiny warm-up, over that of the ten lowest modes")
    if given.json:
        with open(given.json, "w") as stream:
            json.dump(results, stream, indent=1)


if __name__ == "__main__":
    main()
