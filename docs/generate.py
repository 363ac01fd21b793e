"""The tables and plots of the pages *Validation*, *Scaling* and *Which stacks come back*.

    python docs/generate.py            into docs/_generated, about a minute
    python docs/generate.py --quick    on coarse meshes, to test this script

Nothing on the first is typed but what others printed; the others' are made from what was measured on the
paper's mesh and on large ones: data/table2.json and benchmarks/results. The result is kept until a source of
the package, a measurement or this file changes.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import importlib.util
import json
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
    FormedLobe,
    GasPressure,
    Hoops,
    Isotensoid,
    Isotropic,
    PrescribedPath,
    TensionField,
    critical_point,
    critical_pressure,
    cylinder,
    find_form,
    find_modes,
    harmonic_chart,
    ideal_state,
    inflate,
    lobed_cylinder,
)
from lobefem.charts import refinement
from lobefem.continuum import continuum_pressure
from lobefem.kink import one_sided_charts
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


def borrowed(path: str) -> Any:
    """A module of the tests or the demos."""
    spec = importlib.util.spec_from_file_location(f"borrowed_{Path(path).stem}", ROOT / path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look there
    spec.loader.exec_module(module)
    return module


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
            found.append([harmonic_chart(balloon, [n]).pressure for n in low])
        h = [1 / around for _, around in meshes]
        errors = np.abs(np.array(found) / [exact[n] for n in low] - 1)
        rates = [orders(h, column) for column in errors.T]
        for k, divisions in enumerate(meshes):
            name = "{} x {}, {} {}s".format(*divisions, ("linear", "quadratic")[order - 1], cell)
            rows.append((name, *(cell for p, r in zip(found[k], rates, strict=True) for cell in (p, r[k]))))
    return table(("mesh", *(cell for n in low for cell in (f"n = {n} [Pa]", "order"))), rows)


def one_sided(quick: bool) -> str:
    """Bounds of the tension field's critical pressures at its kink, on a mesh and without one."""
    low = (2, 4) if quick else (2, 4, 6, 8)
    film = TensionField(slack_stiffness=0.0)
    mean = TensionField(slack_stiffness=0.5)  # half of the isotropic hoop stiffness
    surface = lobed_cylinder(1, (16, 32), cell="quadrilateral", order=2, sector=True)
    balloon = Balloon(surface, film, [GasPressure("film"), EndPlates("fixed")], prestressed=True)
    rows = []
    for n in low:
        cells = [str(n)]
        for chart, law in zip(one_sided_charts(balloon, [n]), (film, mean, Isotropic()), strict=True):
            cells += [f"{p:.0f}" for p in (chart.pressure, continuum_pressure(n, law))]
        rows.append(cells)
    sides = ("wrinkled: below", "mean: above", "taut")
    head = ("n", *(text for side in sides for text in (f"{side} [Pa]", "without a mesh [Pa]")))
    return table(head, rows)


def crossings(quick: bool) -> str:
    """Where film with fixed wrinkles loses stability on 36 divisions around, held and inflated."""
    rows = []
    divisions = (8, 12) if quick else (24, 36)
    for lobes, paper in ((1, 4600.0), (4, 3000.0)):
        parts = [GasPressure("film"), Hoops(), EndPlates()]
        surface = lobed_cylinder(lobes, divisions)
        balloon = Balloon(surface, FixedWrinkles(), parts, prestressed=True)
        held = critical_pressure(balloon)
        low, high = (0.8 if quick else 0.98) * held.pressure, 1.02 * held.pressure
        inflated = critical_point(balloon, start=low, limit=high, growth=high / low)
        modes = [f"{c.mode.kind}, n = {c.mode.harmonic}" if c.mode else "-" for c in (held, inflated)]
        name = f"{lobes} lobe{'s' * (lobes > 1)}, {divisions[0]} x {divisions[1]}"
        rows.append(
            (name, held.pressure, modes[0], inflated.pressure, modes[1], str(inflated.point), f"{paper:.0f}")
        )
    head = ("lobes, mesh of a lobe", "held [Pa]", "mode", "inflated [Pa]", "mode", "point", "paper [Pa]")
    return table(head, rows)


def isotropic_stack(quick: bool) -> str:
    """Where four inflated lobes of isotropic film lose stability, with and without built-in stress."""
    rows = []
    for divisions in ((12, 16),) if quick else ((12, 16), (24, 32)):
        surface = lobed_cylinder(4, divisions)
        for load, low, high in (("closed", 2300.0, 3000.0), ("film", 12000.0, 15000.0))[: 1 if quick else 2]:
            parts = [GasPressure(load), Hoops(), EndPlates()]
            found = critical_point(
                Balloon(surface, Isotropic(), parts), start=low, limit=high, growth=high / low, rtol=2e-2
            )
            assert found.mode is not None
            kept = Balloon(surface, Isotropic(), parts, prestressed=True)
            lowest = find_modes(inflate(kept, high), 2)[0]
            rows.append(
                (
                    "{} x {}".format(*divisions),
                    f"`{load}`",
                    f"{found.pressure:.0f}",
                    f"{found.point}, {found.mode.kind}",
                    f"{lowest.value.real:.3g} at {high:.0f} Pa ({lowest.kind})",
                )
            )
    head = (
        "mesh of a lobe",
        "load",
        "unstressed film [Pa]",
        "how",
        "stress built in: lowest [Pa/m]",
    )
    return table(head, rows)


def formed_lobes(quick: bool) -> str:
    """Forms found on meshes beside the closed form."""
    length = Isotensoid.from_edge_radius().height
    meshes = ((12, 16),) if quick else ((12, 16), (24, 32), (48, 64))
    rows = []
    for p in (0.75, 10.0, 37.5):
        forms = [find_form(cylinder(2.0, length, divisions), p) for divisions in meshes]
        exact = FormedLobe.inflated(2.0, length, forms[0].Et, p)
        rows.append((f"{p:g} Pa, closed form", exact.R0, "", exact.arc_length, exact.m, "", ""))
        h = [1 / around for _, around in meshes]
        rates = orders(h, [abs(form.shape.R0 / exact.R0 - 1) for form in forms])
        for divisions, form, rate in zip(meshes, forms, rates, strict=True):
            rows.append(
                (
                    "{} x {}".format(*divisions),
                    f"{form.shape.R0:.5f}",
                    rate,
                    form.shape.arc_length,
                    form.shape.m,
                    f"{1e3 * form.distance:.2f}",
                    f"{100 * np.ptp(form.tension) / form.tension.mean():.2f} %",
                )
            )
    head = ("mesh", "R0 [m]", "order", "arc [m]", "m", "nodes off a lobe [mm]", "spread of N R")
    return table(head, rows)


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


def scaling(out: Path) -> dict[str, str]:
    """The runs of benchmarks/scaling.py, and what the cost model makes of them."""
    sys.path.append(str(ROOT))
    from benchmarks import cost_model, scaling_report

    records = [r for r in json.loads(cost_model.RESULTS.read_text(encoding="utf-8")) if r["load"] == "closed"]
    model = cost_model.fit(records)
    scaling_report.figure(records).savefig(out / "scaling.png")
    return {
        "scaling_runs": scaling_report.runs_table(records),
        "scaling_work": scaling_report.work_table(records),
        "scaling_speedup": scaling_report.speedup_table(records),
        "scaling_solvers": scaling_report.solvers_table(records),
        "scaling_check": cost_model.check(model, records),
        "scaling_predictions": cost_model.predictions(model),
        "scaling_limits": cost_model.limits(model),
    }


RETURNS = HERE / "data" / "table2.json"


def returns(out: Path) -> dict[str, str]:
    """The page on releases, from the numbers that `demos/table2.py --json` has left."""
    demo = borrowed("demos/table2.py")
    numbers = json.loads(RETURNS.read_text(encoding="utf-8"))
    fine = {name: r for name, r in numbers["runs"].items() if name.startswith("24x32")}
    shown = [(row[1], *row[2:10], row[11]) for row in demo.rows(fine)]
    for angle, (original, imposed, final) in demo.PAPER.items():
        cells = (f"{original:.2f}", f"{imposed:.2f}", f"{imposed / original:.4f}", f"{final:.2f}")
        shown.append((f"*the paper, {angle:g} degrees*", *cells, "*distorted*", "", "", "", ""))
    head = (*demo.HEAD[1:10], demo.HEAD[11])
    parts = {"returns_matrix": table(head, shown)}

    rows: list[Sequence[str]] = []
    for r in fine.values():
        e = r["energy"]
        release = e["pressure"] - r["history"]["ramp"]["pressure"][-1]
        plates = release - demo.PRESSURE * (r["volume_final"] - r["volume_imposed"])
        rows.append(
            (
                f"{r['load']}, {r['support']}, {r['amount']:g} degrees",
                f"{r['work_of_constraint']:.2f}",
                f"{r['strain_imposed']:.2f}",
                f"{r['contact_imposed']:.2f}",
                f"{release:.2f}",
                f"{plates:.2f}" if r["load"] == "film" else "0",
                f"{e['damping']:.2f}",
                f"{100 * e['error']:.2g} %",
            )
        )
    parts["returns_ledger"] = table(
        (
            "case",
            "constraint [J]",
            "strain [J]",
            "contact [J]",
            "gas, released [J]",
            "of it by the plates [J]",
            "damping [J]",
            "missing",
        ),
        rows,
    )

    rows = []
    for angle, (_, imposed, final) in demo.PAPER.items():
        ours = [r for r in fine.values() if r["amount"] == angle]
        strain = max(r["strain_imposed"] + r["contact_imposed"] for r in ours if r["load"] == "closed")
        film = [r for r in ours if r["load"] == "film"]
        plates = [
            r["energy"]["pressure"]
            - r["history"]["ramp"]["pressure"][-1]
            - demo.PRESSURE * (r["volume_final"] - r["volume_imposed"])
            for r in film
        ]
        rows.append(
            (
                f"{angle:g} degrees",
                f"{demo.PRESSURE * (imposed - final):.1f}",
                f"{strain:.2f}",
                f"{max(plates):.2f}" if plates else "-",
                "takes",
                "takes",
            )
        )
    parts["returns_bound"] = table(
        ("", "needed [J]", "strain and contact", "`film` load's plates", "fading constraint", "damping"), rows
    )

    parts["returns_way"] = table(
        ("case", *(f"{100 * share:.0f} % gone" for share in demo.SHARES), "at rest"),
        [
            (
                f"{r['load']}, {r['support']}, {r['amount']:g} degrees",
                *(f"{place['lowest']:.2g}" for place in r["way"]),
                f"{r['min_eigenvalue']:.3g}",
            )
            for r in fine.values()
        ],
    )
    parts["returns_larger"] = table(
        demo.HEAD[:2] + demo.HEAD[2:10],
        [row[:10] for row in demo.rows({k: r for k, r in numbers["runs"].items() if k not in fine})],
    )
    parts["returns_random"] = table(
        ("seed", "support", "least volume on the way", "contact", "outcome", "lowest [Pa/m]"),
        [
            (
                str(r["seed"]),
                r["support"],
                f"{100 * r['least_volume'] / r['volume_original']:.1f} %",
                "yes" if r["contact"] else "no",
                r["outcome"],
                "-" if r["min_eigenvalue"] is None else f"{r['min_eigenvalue']:.3g}",
            )
            for r in numbers["random"]
        ],
    )
    parts["returns_stopped"] = table(
        (
            "case",
            "damping",
            "imposed [m³]",
            "at the step's end [m³]",
            "mid hoop [m]",
            "unbalanced force / load",
            "outcome",
        ),
        [
            (
                name,
                f"{r['damping']:g}",
                f"{r['volume_imposed']:.2f}",
                f"{r['volume']:.2f}",
                f"{r['middle']:.3f}",
                f"{r['unbalanced']:.0e}",
                r["outcome"],
            )
            for name, ends in numbers["stopped"].items()
            for r in ends
        ],
    )
    exact = demo.LOBES * Isotensoid.from_edge_radius().volume
    parts["returns_volumes"] = table(
        ("mesh of a lobe", "drawn [m³]", "at 5 Pa [m³]", "off the smooth shape"),
        [
            (
                "{} x {}, {}".format(*v["mesh"][:2], ("linear", "quadratic")[v["mesh"][2] - 1]),
                f"{v['drawn']:.3f}",
                f"{v['pressurised']:.3f}",
                f"{v['drawn'] - exact:.3f}",
            )
            for v in numbers["volumes"]
        ]
        + [("smooth", f"{exact:.3f}", "", ""), ("the paper, 24 x 32 quadrilaterals", "", "591.96", "")],
    )
    made = numbers["made_with"]
    parts["returns_made"] = (
        f"Made with lobefem {made['lobefem']}, DOLFINx {made['dolfinx']}, PETSc {made['petsc']}, "
        f"{sum(r['seconds'] for r in fine.values()) / len(fine):.0f} s of one core for a case on average.\n"
    )
    for angle in demo.ANGLES:
        demo.middle(numbers["runs"], "24x32", angle).savefig(out / f"returns_fig23_{angle:g}.png", dpi=150)
    demo.landscape(numbers["runs"], "24x32").savefig(out / "returns_landscape.png", dpi=150)
    return parts


def suite() -> str:
    """What the test suite checks against closed forms: the first lines of its modules."""
    lines = []
    for path in sorted((ROOT / "tests" / "analytic").glob("test_*.py")):
        text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
        lines.append(f"- `{path.name}`: {text.splitlines()[0]}")
    return "\n".join(lines) + "\n"


# --- all of it ----------------------------------------------------------------------------------


def key(quick: bool) -> str:
    """A hash of all that the results depend on."""
    digest = hashlib.sha256(b"quick" if quick else b"")
    for path in [
        *sorted((ROOT / "lobefem").glob("*.py")),
        *sorted((ROOT / "tests/analytic").glob("*.py")),
        *sorted((ROOT / "benchmarks").glob("*.py")),
        ROOT / "benchmarks/results/scaling.json",
        ROOT / "demos/load_path.py",
        ROOT / "demos/table2.py",
        RETURNS,
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
        "fourier": lambda: fourier(quick),
        "one_sided": lambda: one_sided(quick),
        "crossings": lambda: crossings(quick),
        "isotropic_stack": lambda: isotropic_stack(quick),
        "formed_lobes": lambda: formed_lobes(quick),
        "pressurisation": lambda: pressurisation(quick),
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
