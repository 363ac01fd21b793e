"""The page *Validation*: closed forms, known numbers, other discretisations."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.ticker import NullLocator
from scipy.integrate import quad

from lobefem import (
    Balloon,
    EndPlates,
    FixedWrinkles,
    GasPressure,
    Hoops,
    Isotensoid,
    Isotropic,
    PrescribedPath,
    TensionField,
    find_modes,
    harmonic_pressures,
    ideal_state,
    inflate,
    lobed_cylinder,
)
from parts.common import ROOT, borrowed, distinct, figure, orders, per_cent, table

__all__ = [
    "closed_forms",
    "common_problem",
    "eigenvalues",
    "fourier",
    "free_bodies",
    "pressurisation",
    "suite",
    "volumes",
]


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
        ("arc length of the meridian [m]", lobe.arc_length, arc, "5"),
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


def modes_in_order(found: dict[tuple[str, int], list[float]]) -> list[tuple[str, int, int, float]]:
    """Kind, harmonic, rank in its kind and value, ascending."""
    rows = [(k, n, r, v) for (k, n), values in found.items() for r, v in enumerate(distinct(values))]
    return sorted(rows, key=lambda row: row[3])


def fourier(quick: bool) -> str:
    """Critical pressures of low harmonics beside the Fourier solution of tests/analytic, with orders."""
    lobe = borrowed("tests/analytic/fourier.py").Lobe
    low = (2, 3, 4)
    cases = (
        ("triangle", 1, ((18, 36), (24, 48), (36, 72))),
        ("quadrilateral", 2, ((8, 16), (12, 24), (16, 32))),
    )
    exact = {n: lobe(n).critical_pressure("fixed") for n in low}
    rows = [("Fourier solution", *(cell for n in low for cell in (f"{exact[n]:.2f}", "")))]
    for cell, order, meshes in cases[: 1 if quick else 2]:
        found = []
        for divisions in meshes:
            surface = lobed_cylinder(1, divisions, cell=cell, order=order, sector=True)
            parts = [GasPressure("film"), EndPlates("fixed")]
            balloon = Balloon(surface, FixedWrinkles(), parts, prestressed=True)
            found.append([harmonic_pressures(balloon, [n]).pressure for n in low])
        h = [1 / around for _, around in meshes]
        errors = np.abs(np.array(found) / [exact[n] for n in low] - 1)
        rates = [orders(h, column) for column in errors.T]
        for k, divisions in enumerate(meshes):
            name = "{} x {}, {} {}s".format(*divisions, ("linear", "quadratic")[order - 1], cell)
            rows.append((name, *(cell for p, r in zip(found[k], rates, strict=True) for cell in (p, r[k]))))
    return table(("mesh", *(cell for n in low for cell in (f"n = {n} [Pa]", "order"))), rows)


def pressurisation(quick: bool) -> dict[str, str]:
    """The numbers of the paper's fig. 20, and Newton's iterations with the secant and the tangent."""
    demo = borrowed("demos/load_path.py")
    divisions = (8, 12) if quick else (24, 32)
    surface = lobed_cylinder(2, divisions, cell="quadrilateral")
    path = inflate(demo.stack(surface, PrescribedPath()), demo.PRESSURE)
    then = demo.stack(surface, TensionField(), load_path=path)
    states = {
        "initial stress": inflate(demo.stack(surface, Isotropic(), prestressed=True), demo.PRESSURE),
        "load path": path,
        "load path, then the tension field": inflate(then, demo.PRESSURE, start=path),
    }
    rows = []
    for name, state in states.items():
        stress = demo.along_the_meridian(state)
        off = np.abs(np.array(stress["phi mean"]) / np.array(stress["eq. 4"]) - 1).max()
        hoop = demo.residual_hoop_stress(stress)
        low, high = (f"{hoop[word] / 1e3:.4f}" for word in ("least", "largest"))
        rows.append((name, f"{100 * off:.2f} %", low, high, f"{100 * hoop['share']:.3g} %"))
    head = (
        "method",
        "worst ring against eq. 4",
        "least hoop stress [kPa]",
        "largest [kPa]",
        "share of eq. 4",
    )
    coarse = lobed_cylinder(2, (8, 12), cell="quadrilateral")
    start = inflate(demo.stack(coarse, PrescribedPath()), demo.PRESSURE)
    counts = demo.iterations(coarse, start, lambda text: None)
    laws = [key for key in counts[0] if key not in ("case", "wrinkled")]
    newton = table(
        ("from", *laws, "wrinkled"),
        [(row["case"], *(str(row[law]) for law in laws), f"{100 * row['wrinkled']:.0f} %") for row in counts],
    )
    return {"pressurisation": table(head, rows), "iterations": newton}


def suite() -> str:
    """List of checks against closed forms: the first lines of the suite's modules."""
    lines = []
    for path in sorted((ROOT / "tests" / "analytic").glob("test_*.py")):
        text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
        lines.append(f"- `{path.name}`: {text.splitlines()[0]}")
    return "\n".join(lines) + "\n"
