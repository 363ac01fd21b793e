"""The tables and plots of the pages *Validation*, *Speed*, *Scaling* and *Which stacks come back*.

    python docs/generate.py            into docs/_generated, some minutes
    python docs/generate.py --kept     the results of docs/_computed, at once; a sentence says if they are old
    python docs/generate.py --keep     computes them, and keeps them in docs/_computed
    python docs/generate.py --quick    on coarse meshes, to test this script

Nothing on the first is typed but what others printed; the others' are made from what was measured on the
paper's mesh and on large ones: data/table2.json and benchmarks/results. The result is kept until a source of
the package, a measurement or one of the parts changes.
"""

from __future__ import annotations

import argparse
import hashlib
import shutil
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import lobefem.linalg.dolfinx_compat  # noqa: F401  first: it finds the stack

sys.path.insert(0, str(Path(__file__).parent))

# isort: split
from parts.common import ROOT
from parts.critical import crossings, formed_lobes, isotropic_stack, mesh_studies, one_sided
from parts.measured import COMPARED, RETURNS, programs, returns, scaling
from parts.validation import (
    closed_forms,
    common_problem,
    eigenvalues,
    fourier,
    free_bodies,
    pressurisation,
    suite,
    volumes,
)

HERE = Path(__file__).parent
STAMP = "stamp.txt"
STATE = "state.md"  # how old the results are, for the pages that show them
KEPT = HERE / "_computed"
ROOMS = ("linalg", "geometry", "model", "fem", "equilibrium", "stability")  # that compute

FRESH = "All numbers below were computed by this version of lobefem.\n"
OLD = (
    "All numbers below were computed by an earlier version of lobefem: sources have changed since. "
    "`make docs VALIDATE=1` computes them anew.\n"
)


def key(quick: bool) -> str:
    """A hash of all that the results depend on."""
    digest = hashlib.sha256(b"quick" if quick else b"")
    for path in [
        *sorted((ROOT / "lobefem").glob("*.py")),
        *(path for room in ROOMS for path in sorted((ROOT / "lobefem" / room).glob("*.py"))),
        *sorted((ROOT / "tests/analytic").glob("*.py")),
        *sorted((ROOT / "benchmarks").glob("*.py")),
        ROOT / "benchmarks/results/scaling.json",
        COMPARED,
        ROOT / "demos/load_path.py",
        ROOT / "demos/table2.py",
        ROOT / "demos/table2_shown.py",
        RETURNS,
        HERE / "generate.py",
        *sorted((HERE / "parts").glob("*.py")),
    ]:
        digest.update(path.read_bytes())
    return digest.hexdigest()


def generate(out: Path, *, quick: bool = False, say: Any = lambda text: None) -> None:
    """Compute all parts anew and write them to a folder."""
    out.mkdir(parents=True, exist_ok=True)
    parts: dict[str, Any] = {
        "closed_forms": closed_forms,
        "volumes": lambda: volumes(out, quick),
        "free_bodies": lambda: free_bodies(quick),
        "common_problem": lambda: common_problem(quick),
        "eigenvalues": lambda: eigenvalues(quick),
        "mesh_studies": lambda: mesh_studies(out, quick),
        "fourier": lambda: fourier(quick),
        "one_sided": lambda: one_sided(quick),
        "crossings": lambda: crossings(quick),
        "isotropic_stack": lambda: isotropic_stack(quick),
        "formed_lobes": lambda: formed_lobes(quick),
        "pressurisation": lambda: pressurisation(quick),
        "programs": lambda: programs(out),
        "scaling": lambda: scaling(out),
        "returns": lambda: returns(out),
        "suite": suite,
    }
    for name, part in parts.items():
        begin = time.monotonic()
        texts = part()
        for title, text in texts.items() if isinstance(texts, dict) else [(name, texts)]:
            (out / f"{title}.md").write_text(text, encoding="utf-8")
        say(f"{name}: {time.monotonic() - begin:.1f} s")
    (out / STATE).write_text(FRESH, encoding="utf-8")


def use_kept(out: Path, kept: Path = KEPT) -> None:
    """Put the results that were kept where the pages read them, with a sentence on their age."""
    out.mkdir(parents=True, exist_ok=True)
    for path in kept.iterdir():
        shutil.copy(path, out / path.name)
    fresh = (kept / STAMP).read_text() == key(quick=False)
    (out / STATE).write_text(FRESH if fresh else OLD, encoding="utf-8")


def main(arguments: Sequence[str] | None = None) -> int:
    """Generate what is not up to date."""
    parser = argparse.ArgumentParser(description="Tables and plots of the page Validation")
    parser.add_argument("--out", type=Path, default=HERE / "_generated")
    parser.add_argument("--quick", action="store_true", help="coarse meshes")
    parser.add_argument("--kept", action="store_true", help="compute nothing, use what was kept")
    parser.add_argument("--keep", action="store_true", help="keep the results in docs/_computed")
    options = parser.parse_args(arguments)
    stamp, wanted = options.out / STAMP, key(options.quick)
    if not (stamp.exists() and stamp.read_text() == wanted):
        if options.kept:
            use_kept(options.out)
            return 0
        generate(options.out, quick=options.quick, say=lambda text: print(text, flush=True))
        stamp.write_text(wanted)
    if options.keep:
        shutil.copytree(options.out, KEPT, dirs_exist_ok=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
