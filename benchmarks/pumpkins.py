"""NASA's pumpkin of 280 gores from one gore: state, all 141 harmonics, a path; and the full model beside it.

Each part runs in a process of its own, so that its peak memory is its own; times leave out the interpreter's
start, imports and the compilation of forms, and begin with the mesh. One core: OMP_NUM_THREADS=1. CPU time is
given beside elapsed time, for a machine that is not idle.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import resource
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

DESIGN = Path(__file__).parents[1] / "meshes" / "superpressure.toml"

GORES = 280

BARS = {"harmonics": 25.0, "path": 300.0}  # seconds

MEMORY = 450.0  # [MB]

PRESSURE = 170.0


def balloon(gores: int, divisions: tuple[int, int], full: bool = False) -> Any:
    """The balloon with fewer gores, of the same bulge angle, where there are no 280."""
    from lobefem.io.design import Design

    design = Design.load(DESIGN)
    changes: dict[str, Any] = {"mesh.divisions": list(divisions)}
    if gores != GORES:  # 280 gores' widths do not fit; their weight and caps are left out
        design = Design.parse(
            {
                "shape": {
                    "kind": "pumpkin", "tendon_length": 149.82, "gores": gores, "fitting_radius": [0.1, 0.35],
                    "lobe": "constant-angle", "half_angle": math.radians(22.0),
                },
                "film": {"law": "tension-field", "E": 230e6, "nu": 0.5, "thickness": 38.1e-6,
                         "slack_stiffness": 1e-5},
                "tendons": {"EA": 761560.0 * GORES / gores},
                "pressure": {"value": PRESSURE},
            }
        )  # fmt: skip
    design = design.with_overrides(changes)
    return design.balloon(design.surface(sector=not full))


def run(part: str, divisions: tuple[int, int]) -> dict[str, float]:
    """One part in this process: seconds in all and of the processor, peak memory [MB]."""
    from lobefem.equilibrium.inflation import inflate
    from lobefem.stability.gore_buckling import critical_pressures
    from lobefem.stability.modes import find_modes

    full = part.startswith("full")
    gores = int(part.split("-")[1]) if "-" in part else GORES

    def work(mesh: tuple[int, int]) -> float:
        made = balloon(gores, mesh, full)
        if part == "path":
            found = critical_pressures(made, up_to=2 * PRESSURE, start=PRESSURE / 5, growth=10 ** (1 / 11))
            return float(len(found.visited))
        state = inflate(made, PRESSURE)
        if part == "state":
            return state.volume
        if full:
            return find_modes(state, 20).lowest
        return find_modes(state, 20, harmonics=range(gores // 2 + 1)).lowest

    if full or part == "state":  # compile or load the forms before the clock starts
        work((4, 2))
    else:
        find_modes(inflate(balloon(gores, (8, 4)), PRESSURE), 1, harmonics=[2])
    base = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    start, processor = time.perf_counter(), time.process_time()
    answer = work(divisions)
    end, used = time.perf_counter(), time.process_time() - processor
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return {"seconds": end - start, "processor": used, "memory": peak, "above": peak - base, "answer": answer}


def measured(part: str, divisions: str) -> dict[str, float]:
    """A part in a process of its own."""
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-m", "benchmarks.pumpkins", "--part", part, "--divisions", divisions]
    output = subprocess.run(command, env=environment, check=True, capture_output=True, text=True).stdout
    return dict(json.loads(output.splitlines()[-1]))


def extrapolated(counts: list[int], seconds: list[float]) -> float:
    """Seconds of all gores by the power law through the two largest full models."""
    (a, b), (x, y) = counts[-2:], seconds[-2:]
    return float(y * (GORES / b) ** (math.log(y / x) / math.log(b / a)))


def main() -> None:
    """Run the parts, one after the other, and compare them with the bars."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--divisions", default="64x8", help="of one gore, for all parts")
    parser.add_argument("--full-divisions", default="16x4", help="of one gore beside the full model")
    parser.add_argument("--gores", default="8,16,32,64", help="of the full models")
    parser.add_argument("--parts", default="state,harmonics,path,full")
    parser.add_argument("--part", help=argparse.SUPPRESS)
    parser.add_argument("--json", help="file for the results")
    given = parser.parse_args()
    along, across = map(int, given.divisions.split("x"))
    if given.part:
        print(json.dumps(run(given.part, (along, across))))
        return
    results: dict[str, Any] = {"load": os.getloadavg()[0], "divisions": given.divisions}
    for part in given.parts.split(","):
        if part != "full":
            results[part] = one = measured(part, given.divisions)
            bar = f" (bar {BARS[part]:.0f} s, {MEMORY:.0f} MB)" if part in BARS else ""
            times = f"{one['seconds']:8.1f} s  {one['processor']:8.1f} s CPU"
            print(f"{part:12} {times}  {one['memory']:6.0f} MB{bar}")
            continue
        alone, whole = [], []
        counts = [int(text) for text in given.gores.split(",")]
        for gores in counts:
            alone.append(measured(f"sector-{gores}", given.full_divisions))
            whole.append(measured(f"full-{gores}", given.full_divisions))
            times = [each[-1]["processor"] for each in (alone, whole)]
            print(f"{gores:4} gores: one gore {times[0]:.2f} s CPU, all {times[1]:.2f} s CPU")
        far = extrapolated(counts, [one["processor"] for one in whole])
        near = measured("harmonics", given.full_divisions)["processor"]
        results["full"] = {
            "gores": counts,
            "one": alone,
            "all": whole,
            "extrapolated": far,
            "ratio": far / near,
        }
        shares = f"{near:.1f} s CPU by one gore, {far:.0f} s by the full model, 1/{far / near:.0f}"
        print(f"all {GORES} gores: {shares}")
    if given.json:
        Path(given.json).write_text(json.dumps(results, indent=2) + "\n")


if __name__ == "__main__":
    main()
