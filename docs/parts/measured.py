"""The pages *Speed*, *Scaling* and *Which stacks return*, from what was measured before."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path

from lobefem import Isotensoid
from parts.common import ROOT, borrowed, table

__all__ = ["COMPARED", "RETURNS", "programs", "returns", "scaling"]

RETURNS = ROOT / "docs/data/table2.json"
COMPARED = ROOT / "benchmarks/results/compare.json"


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


def programs(out: Path) -> dict[str, str]:
    """The medians of benchmarks/compare.py."""
    sys.path.append(str(ROOT))
    from benchmarks import report

    rows = json.loads(COMPARED.read_text(encoding="utf-8"))["rows"]
    report.figure(rows).savefig(out / "programs.png", dpi=150)
    cases = dict.fromkeys(row["case"] for row in rows)
    return {f"programs_{case}": report.as_markdown(case, rows) for case in cases} | {
        "programs_note": report.NOTE + "\n",
        "programs_stages": report.stages_as_markdown("wrinkled", rows),
    }


def returns(out: Path) -> dict[str, str]:
    """The page on releases, from the numbers that `demos/table2.py --json` has left."""
    demo, shows = borrowed("demos/table2.py"), borrowed("demos/table2_shown.py")
    numbers = json.loads(RETURNS.read_text(encoding="utf-8"))
    names = [case.name for case in demo.matrix()]
    cases = {name: r for name, r in numbers["runs"].items() if name.split(", ", 1)[1] in names}
    shown = [(*row[:10], row[11]) for row in shows.rows(cases)]
    for angle, (original, imposed, final) in shows.PAPER.items():
        cells = (f"{original:.2f}", f"{imposed:.2f}", f"{imposed / original:.4f}", f"{final:.2f}")
        shown.append(("24x32", f"*the paper, {angle:g} degrees*", *cells, "*distorted*", "", "", "", ""))
    head = (*shows.HEAD[:10], shows.HEAD[11])
    parts = {"returns_matrix": table(head, shown)}

    rows: list[Sequence[str]] = []
    for r in cases.values():
        e = r["energy"]
        release = e["pressure"] - r["history"]["ramp"]["pressure"][-1]
        plates = release - demo.PRESSURE * (r["volume_final"] - r["volume_imposed"])
        rows.append(
            (
                "{}x{}, {}, {}, {:g} degrees".format(*r["divisions"], r["load"], r["support"], r["amount"]),
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
    for angle, (_, imposed, final) in shows.PAPER.items():
        ours = [r for r in cases.values() if r["amount"] == angle]
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
        ("", "needed [J]", "strain and contact", "plates under `film` load", "fading constraint", "damping"),
        rows,
    )

    parts["returns_way"] = table(
        ("case", *(f"{100 * share:.0f} % gone" for share in demo.SHARES), "at rest"),
        [
            (
                "{}x{}, {}, {}, {:g} degrees".format(*r["divisions"], r["load"], r["support"], r["amount"]),
                *(f"{place['lowest']:.2g}" for place in r["way"]),
                f"{r['min_eigenvalue']:.3g}",
            )
            for r in cases.values()
        ],
    )
    parts["returns_larger"] = table(
        shows.HEAD[:10],
        [row[:10] for row in shows.rows({k: r for k, r in numbers["runs"].items() if k not in cases})],
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
            "at the end of the step [m³]",
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
        ("mesh of a lobe", "as designed [m³]", "at 5 Pa [m³]", "off the smooth shape"),
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
        f"{max(r['seconds'] for r in cases.values()):.0f} s of one core for the longest of these cases.\n"
    )
    for angle in demo.ANGLES:
        shows.middle(numbers["runs"], "24x32", angle).savefig(out / f"returns_fig23_{angle:g}.png", dpi=150)
    shows.landscape(numbers["runs"], "24x32").savefig(out / "returns_landscape.png", dpi=150)
    return parts
