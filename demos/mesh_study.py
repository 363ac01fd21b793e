"""Is a critical pressure a property of the balloon, or of the mesh?

Refines one lobe and the four-lobe stack, with fixed wrinkles and with isotropic film, both rims held; fits
what converges, places the paper's 4600 and 3000 Pa on the curves, and says what all that means. All
harmonics of a mesh come from one sector of it. Runs serially or under mpirun.

    python demos/mesh_study.py --out out/mesh_study
"""

from __future__ import annotations

import argparse
import sys
import textwrap
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import lobefem.linalg.dolfinx_compat  # noqa: F401  first: it finds the stack

# isort: split
from lobefem import Balloon
from lobefem.files import save_json
from lobefem.io.design import Design
from lobefem.stability.mesh_convergence import DIVISIONS, MeshStudy, mesh_study
from lobefem.viz.study_figures import refinement

from mpi4py import MPI

# isort: split
from command import exit_code, folder, speaker

CASES = (
    ("single", 1, "fixed-wrinkles"),
    ("stack", 4, "fixed-wrinkles"),
    ("single", 1, "isotropic"),
    ("stack", 4, "isotropic"),
)

Say = Callable[[str], None]


def maker(lobes: int, law: str) -> Callable[[tuple[int, int]], Balloon]:
    """From divisions to the paper's balloon on one sector of that mesh, both rims held."""
    design = Design.parse(
        {
            "shape": {"lobes": lobes},
            "film": {"law": law, "prestress": True},
            "hoops": {"enabled": lobes > 1},
            "plates": {"support": "fixed"},
        }
    )

    def make(divisions: tuple[int, int]) -> Balloon:
        changed = design.with_overrides({"mesh.divisions": divisions})
        return changed.balloon(changed.surface(sector=True))

    return make


def run(
    divisions: Sequence[tuple[int, int]] = DIVISIONS,
    out: str | Path = "out/mesh_study",
    *,
    comm: Any = MPI.COMM_WORLD,
    say: Say = lambda text: None,
) -> dict[str, MeshStudy]:
    """All four studies, with a figure and the numbers of each. Collective.

    Args:
        divisions: of the meshes, from coarse to fine.
        out: folder of figures and numbers; the same on all ranks.
        comm: MPI communicator.
        say: called with what goes on.
    """
    out = folder(out, comm)
    studies = {}
    for size, lobes, law in CASES:
        name = f"{size}_{law}"
        say(name)
        study = studies[name] = mesh_study(maker(lobes, law), divisions, comm=comm, progress=say)
        if comm.rank == 0:
            refinement(study).savefig(out / f"{name}.png")
        save_json(out / f"{name}.json", numbers(study), comm)
    return studies


def numbers(study: MeshStudy) -> dict[str, Any]:
    """A study as plain data in SI units."""
    return {
        "film": study.film,
        "lobes": study.lobes,
        "meshes": [
            {"divisions": c.divisions, "critical_pressure": c.pressure, "harmonic": c.lowest}
            for c in study.charts
        ],
        "lowest": vars(study.lowest),
        "harmonics": {n: vars(one) for n, one in study.low.items()},
        "continuum_of_one_lobe": [vars(one) for one in study.continuum],
        "published": study.published,
        "published_around": study.published_around,
        "verdict": study.verdict,
    }


def main(argv: Sequence[str] | None = None) -> int:
    """Run the demo from the command line."""
    line = argparse.ArgumentParser(description="Mesh studies of critical pressures (paper sec. 5)")
    line.add_argument("--out", type=Path, default=Path("out/mesh_study"), help="folder to write to")
    options, comm, begin = line.parse_args(argv), MPI.COMM_WORLD, time.monotonic()

    def task() -> list[str]:
        lines = []
        for name, study in run(out=options.out, comm=comm, say=speaker(comm, clock=True)).items():
            lines.append(f"\n{name.replace('_', ', ')}")
            lines += [
                textwrap.fill(sentence, 100, initial_indent="- ", subsequent_indent="  ")
                for sentence in study.verdict
            ]
        return [*lines, f"\n{time.monotonic() - begin:.0f} s; figures and numbers are in {options.out}"]

    return exit_code(comm, task)


if __name__ == "__main__":
    sys.exit(main())
