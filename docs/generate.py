"""The tables and plots of the pages *Validation*, *Speed*, *Scaling* and *Which stacks come back*.

    python docs/generate.py            into docs/_generated, about a minute
    python docs/generate.py --quick    on coarse meshes, to test this script

Nothing on the first is typed but what others printed; the others' are made from what was measured on the
paper's mesh and on large ones: data/table2.json and benchmarks/results. The result is kept until a source of
the package, a measurement or one of the parts changes.
"""

from __future__ import annotations

import argparse
import hashlib
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


def key(quick: bool) -> str:
    """A hash of all that the results depend on."""
    digest = hashlib.sha256(b"quick" if quick else b"")
    for path in [
        *sorted((ROOT / "lobefem").glob("*.py")),
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


def main(arguments: Sequence[str] | None = None) -> int:
    """Generate what is not up to date."""
    parser = argparse.ArgumentParser(description="Tables and plots of the page Validation")
    parser.add_argument("--out", type=Path, default=HERE / "_generated")
    parser.add_argument("--quick", action="store_true", help="coarse meshes")
    options = parser.parse_args(arguments)
    stamp, wanted = options.out / STAMP, key(options.quick)
    if stamp.exists() and stamp.read_text() == wanted:
        return 0
    generate(options.out, quick=options.quick, say=lambda text: print(text, flush=True))
    stamp.write_text(wanted)
    return 0


if __name__ == "__main__":
    sys.exit(main())
