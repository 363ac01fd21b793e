"""The tables and plots of the page *Validation*, computed from the package.

    python docs/generate.py            into docs/_generated, about a minute
    python docs/generate.py --quick    on coarse meshes, to test this script

Nothing on that page is typed but what others printed. The result is kept until a source of the package
or this file changes.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import re
import sys
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator
from scipy.integrate import quad

import lobefem._dolfinx  # noqa: F401  first: it finds the stack

# isort: split
from lobefem import (
    Balloon,
    EndPlates,
    FixedWrinkles,
    GasPressure,
    Hoops,
    Isotensoid,
    Isotropic,
    TensionField,
    find_modes,
    ideal_state,
    inflate,
    lobed_cylinder,
)
from lobefem.charts import refinement
from lobefem.mesh_study import DIVISIONS, mesh_study

HERE = Path(__file__).parent
ROOT = HERE.parent
STAMP = "stamp.txt"


def table(head: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """A Markdown table; numbers to five digits unless they are text already."""
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    lines += ["| " + " | ".join(c if isinstance(c, str) else f"{c:.5g}" for c in row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def per_cent(value: float, reference: float) -> str:
    """The difference to a reference."""
    return f"{100 * (value / reference - 1):+.2g} %" if value != reference else "0"


def orders(h: Sequence[float], errors: Sequence[float]) -> list[str]:
    """Observed orders between neighbours."""
    pairs = zip(h, h[1:], errors, errors[1:], strict=False)
    return ["", *(f"{np.log(e0 / e1) / np.log(h0 / h1):.2f}" for h0, h1, e0, e1 in pairs)]


def figure(width: float = 4.6, height: float = 3.2) -> tuple[Figure, Any]:
    """A figure without a window system, and its axes."""
    drawing = Figure(figsize=(width, height), layout="constrained", dpi=150)
    FigureCanvasAgg(drawing)
    axes = drawing.add_subplot()
    axes.spines[["top", "right"]].set_visible(False)
    return drawing, axes


# --- the parts ----------------------------------------------------------------------------------


def closed_forms() -> str:
    """The lobe's closed forms beside quadrature of its differential equation, and the paper's numbers."""
    lobe = Isotensoid.from_edge_radius()
    R0, Re = lobe.R0, lobe.edge_radius
    # dz/dR = (R/R0)^2/sqrt(1 - (R/R0)^4); with R = R0 sqrt(cos t) the integrands are smooth
    top = np.arccos((Re / R0) ** 2)

    def integral(f: Any) -> float:
        # d(R/R0) = -sin t/(2 sqrt(cos t)) dt and sqrt(1 - (R/R0)^4) = sin t
        return float(quad(lambda t: f(R0 * np.sqrt(np.cos(t))) / (2 * np.sqrt(np.cos(t))), 0, top)[0]) * R0

    height = 2 * integral(lambda R: (R / R0) ** 2)
    arc = 2 * integral(lambda R: 1.0)
    volume = 2 * integral(lambda R: np.pi * R**2 * (R / R0) ** 2)
    area = 2 * integral(lambda R: 2 * np.pi * R)
    rows = [
        ("height of a lobe [m]", lobe.height, height, "4.2"),
        ("meridian's arc length [m]", lobe.arc_length, arc, "5"),
        ("edge angle [degrees]", np.degrees(lobe.edge_angle), np.degrees(np.arcsin((Re / R0) ** 2)), "15.7"),
        ("film of a lobe [m^2]", lobe.area, area, "-"),
        ("volume of four lobes [m^3]", 4 * lobe.volume, 4 * volume, "591.96"),
    ]
    return table(
        ("", "closed form", "quadrature", "difference", "paper"),
        [(name, f"{a:.6g}", f"{b:.6g}", f"{abs(a / b - 1):.0e}", paper) for name, a, b, paper in rows],
    )


def volumes(out: Path, quick: bool) -> str:
    """Volume of the meshed stack against the exact one."""
    meshes = [(6, 8), (12, 16), (24, 32)] if quick else [(6, 8), (12, 16), (24, 32), (48, 64)]
    exact = 4 * Isotensoid.from_edge_radius().volume
    drawing, axes = figure()
    rows = []
    for order in (1, 2):
        errors, found = [], []
        for divisions in meshes:
            surface = lobed_cylinder(4, divisions, order=order)
            balloon = Balloon(surface, Isotropic(), [GasPressure("closed"), Hoops(), EndPlates()])
            found.append(balloon.reference_volume)
            errors.append(abs(balloon.reference_volume / exact - 1))
        h = [1 / around for _, around in meshes]
        for (along, around), volume, error, rate in zip(
            meshes, found, errors, orders(h, errors), strict=True
        ):
            cells = "linear" if order == 1 else "quadratic"
            rows.append((f"{along} x {around}, {cells}", f"{volume:.4f}", f"{error:.2e}", rate))
        axes.loglog(
            [around for _, around in meshes], errors, "o-", ms=4, label=("linear", "quadratic")[order - 1]
        )
    around = [n for _, n in meshes]
    axes.set_xticks(around, [str(n) for n in around])
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set(xlabel="divisions around", ylabel="relative error of the volume")
    axes.legend(frameon=False)
    drawing.savefig(out / "volumes.png")
    return table(("mesh of a lobe", "volume of four lobes [m^3]", "relative error", "order"), rows)


def free_bodies(quick: bool) -> str:
    """Hoop tension and bar force of prestressed equilibria against the free bodies."""
    meshes = [(6, 8), (12, 16)] if quick else [(12, 16), (24, 32), (48, 64)]
    lobe, p = Isotensoid.from_edge_radius(), 1000.0
    rows = []
    for divisions in meshes:
        surface = lobed_cylinder(4, divisions)
        parts = [GasPressure("film"), Hoops(), EndPlates()]
        state = inflate(Balloon(surface, Isotropic(), parts, prestressed=True), p)
        bar = state.bar_force or 0.0
        rows.append(
            (
                "{} x {}".format(*divisions),
                f"{state.hoop_tension[1] / 1e3:.3f}",
                per_cent(state.hoop_tension[1], lobe.seam_tension(p)),
                f"{bar / 1e3:.3f}",
                per_cent(bar, -lobe.plate_force(p)),
            )
        )
    exact = ("exact", f"{lobe.seam_tension(p) / 1e3:.3f}", "", f"{-lobe.plate_force(p) / 1e3:.3f}", "")
    head = ("mesh of a lobe", "middle hoop [kN]", "difference", "bar [kN]", "difference")
    return table(head, [*rows, exact])


def common_problem(quick: bool) -> str:
    """One lobe blown up to 5 Pa, which other programs solved on the same mesh."""
    # Surface Evolver 2.70 and NGSolve 6.2 agree on all these digits
    cases: list[tuple[tuple[int, int], Any, float, str, float]] = [
        ((24, 32), Isotropic(), 0.0, "taut", 148.76925175),
        ((24, 32), TensionField(slack_stiffness=1e-4), 0.004, "top ring raised 4 mm, wrinkled", 148.77577996),
        ((48, 64), Isotropic(), 0.0, "taut", 149.69312485),
    ]
    rows = []
    for divisions, film, lift, name, others in cases[: 1 if quick else 3]:
        surface = lobed_cylinder(1, divisions, shape=Isotensoid(3.8182))
        state = inflate(Balloon(surface, film, [GasPressure("closed"), EndPlates("fixed", lift=lift)]), 5.0)
        mesh = "{} x {}".format(*divisions)
        rows.append(
            (name, mesh, f"{state.volume:.8f}", f"{others:.8f}", f"{abs(state.volume / others - 1):.0e}")
        )
    return table(("case", "mesh", "volume [m^3]", "the others [m^3]", "difference"), rows)


# (lobes, film, load): real parts that an independent code of ours gave, each pair once
EIGENVALUES: dict[tuple[int, str, str], tuple[float, ...]] = {
    (1, "fixed wrinkles", "film"): (47.70, 156.6, 419.1, 423.8),
    (1, "fixed wrinkles", "closed"): (65.99, 156.6, 410.0, 423.8),
    (1, "isotropic", "closed"): (234.8, 2612, 3360, 5633),
    (4, "fixed wrinkles", "film"): (2.009, 11.33, 31.47, 90.5),
    (4, "fixed wrinkles", "closed"): (1.284, 11.33, 21.38, 90.5),
    (4, "isotropic", "closed"): (3.644, 78.23, 226.1),
}


def eigenvalues(quick: bool) -> str:
    """The lowest eigenvalues at 1000 Pa beside those of the other code, and on a finer mesh."""
    rows = []
    meshes = ((24, 32),) if quick else ((24, 32), (48, 64))
    for (lobes, law, load), others in list(EIGENVALUES.items())[: 1 if quick else None]:
        found = []
        for divisions in meshes:
            surface = lobed_cylinder(lobes, divisions, shape=Isotensoid(4.2 / 1.1))
            film = FixedWrinkles() if law == "fixed wrinkles" else Isotropic()
            parts = [GasPressure(load), Hoops(), EndPlates()]
            balloon = Balloon(surface, film, parts, prestressed=True, quadrature_degree=4)
            modes = find_modes(ideal_state(balloon, 1000.0), count=14, harmonics=range(3))
            found.append({})
            for mode in modes.modes:
                found[-1].setdefault((mode.kind, mode.harmonic), []).append(mode.value.real)
        first = modes_in_order(found[0])[: len(others)]
        for (kind, n, rank, value), other in zip(first, others, strict=True):
            finer = found[1].get((kind, n), []) if len(found) > 1 else []
            finer = distinct(finer)
            rows.append(
                (
                    f"{lobes}, {law}, `{load}`",
                    f"{kind}, n = {n}",
                    value,
                    other,
                    per_cent(value, other),
                    f"{finer[rank]:.5g}" if rank < len(finer) else "-",
                )
            )
    head = ("lobes, film, load", "mode", "24 x 32", "other code, 24 x 32", "difference", "48 x 64")
    return table(head, rows)


def distinct(values: Sequence[float]) -> list[float]:
    """Ascending values, each copy of a pair once."""
    kept: list[float] = []
    for value in sorted(values):
        if not kept or value - kept[-1] > 1e-5 * abs(value):
            kept.append(value)
    return kept


def modes_in_order(found: dict[tuple[str, int], list[float]]) -> list[tuple[str, int, int, float]]:
    """Kind, harmonic, rank in its kind and value, ascending."""
    rows = [(k, n, r, v) for (k, n), values in found.items() for r, v in enumerate(distinct(values))]
    return sorted(rows, key=lambda row: row[3])


def mesh_studies(out: Path, quick: bool) -> dict[str, str]:
    """Critical pressures under refinement: tables, figures, and what the studies say."""
    meshes = ((9, 16), (12, 20), (15, 24)) if quick else DIVISIONS
    studies = {}
    for name, lobes, film in (
        ("single_fixed-wrinkles", 1, FixedWrinkles()),
        ("stack_fixed-wrinkles", 4, FixedWrinkles()),
        ("single_isotropic", 1, Isotropic()),
        ("stack_isotropic", 4, Isotropic()),
    ):
        parts = [GasPressure("film"), Hoops(), EndPlates("fixed")]

        def make(
            divisions: tuple[int, int], lobes: int = lobes, film: Any = film, parts: Any = parts
        ) -> Balloon:
            surface = lobed_cylinder(lobes, divisions, sector=True)
            return Balloon(surface, film, parts, prestressed=True)

        studies[name] = mesh_study(make, meshes)
        refinement(studies[name]).savefig(out / f"{name}.png", dpi=200)
    columns = list(studies.values())
    head = ("mesh of a lobe", *(f"{s.lobes} lobe{'s' * (s.lobes > 1)}, {s.film} [Pa]" for s in columns))
    rows = [
        ("{} x {}".format(*charts[0].divisions), *(f"{c.pressure:.4g} ({c.lowest})" for c in charts))
        for charts in zip(*(s.charts for s in columns), strict=True)
    ]
    low = [
        (
            f"{study.lobes}, {study.film}",
            f"{n}",
            f"{one.pressures[-1]:.5g}",
            f"{one.limit:.5g} +- {one.uncertainty:.1g}",
            f"{one.order:.2f}",
            f"{study.continuum[0].pressures[n]:.2f}" if study.lobes == 1 else "-",
        )
        for study in columns
        for n, one in study.low.items()
    ]
    low_head = ("lobes, film", "n", "finest mesh [Pa]", "fitted limit [Pa]", "order", "without a mesh [Pa]")
    words = [
        f"**{study.lobes} lobe{'s' * (study.lobes > 1)}, {study.film}.** " + " ".join(study.verdict) + "\n"
        for study in columns
    ]
    return {"critical": table(head, rows), "harmonics": table(low_head, low), "verdicts": "\n".join(words)}


def suite() -> str:
    """What the test suite checks against closed forms: the first lines of its modules."""
    lines = []
    for path in sorted((ROOT / "tests" / "analytic").glob("test_*.py")):
        text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
        first = re.sub(r" \(physics[^)]*\)", "", text.splitlines()[0])
        lines.append(f"- `{path.name}`: {first}")
    return "\n".join(lines) + "\n"


# --- all of it ----------------------------------------------------------------------------------


def key(quick: bool) -> str:
    """A hash of all that the results depend on."""
    digest = hashlib.sha256(b"quick" if quick else b"")
    for path in [
        *sorted((ROOT / "lobefem").glob("*.py")),
        *sorted((ROOT / "tests/analytic").glob("*.py")),
        HERE / "generate.py",
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
