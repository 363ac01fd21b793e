"""The page *Validation*: critical pressures and their convergence."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from lobefem import (
    Balloon,
    EndPlates,
    FixedWrinkles,
    GasPressure,
    Hoops,
    Isotensoid,
    Isotropic,
    NaturalShape,
    TensionField,
    critical_point,
    critical_pressure,
    cylinder,
    find_form,
    find_modes,
    inflate,
    lobed_cylinder,
)
from lobefem.stability.continuum import continuum_pressure
from lobefem.stability.mesh_convergence import DIVISIONS, mesh_study
from lobefem.stability.one_sided import one_sided_charts
from lobefem.viz.study_figures import refinement
from parts.common import orders, table

__all__ = ["crossings", "formed_lobes", "isotropic_stack", "mesh_studies", "one_sided"]


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
            f"{one.values[-1]:.5g}",
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


def one_sided(quick: bool) -> str:
    """Bounds for tension-field film at its non-smooth point, with and without a mesh."""
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
    """Critical pressures of film with fixed wrinkles on 36 divisions around, geometry fixed and inflated."""
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
    head = (
        "lobes, mesh of a lobe",
        "fixed geometry [Pa]",
        "mode",
        "inflated [Pa]",
        "mode",
        "point",
        "paper [Pa]",
    )
    return table(head, rows)


def isotropic_stack(quick: bool) -> str:
    """Critical pressures of four inflated lobes of isotropic film, with and without built-in stress."""
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
        exact = NaturalShape.inflated(2.0, length, forms[0].Et, p)
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
