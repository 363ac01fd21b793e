"""The paper's statements in sec. 5 beside the numbers of a run; every verdict is computed."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

CASES = ("single, fixed-wrinkles", "stack, fixed-wrinkles", "single, isotropic", "stack, isotropic")


class Row(NamedTuple):
    """A statement, what came out here, whether they agree, and the paper's figure that it is about."""

    paper: str
    here: str
    verdict: str
    figure: int = 0  # 0: several or none


def _branch(case: dict[str, Any], kind: str, harmonic: int | None = None) -> dict[str, Any]:
    """The lowest branch of a kind, or an empty one."""
    found = [
        b
        for b in case["branches"]
        if b["kind"] == kind and b["rank"] == 0 and harmonic in (None, b["harmonic"])
    ]
    return found[0] if found else {"pressures": [], "values": []}


def _at(branch: dict[str, Any], pressure: float) -> float:
    return float(np.interp(pressure, branch["pressures"], branch["values"]))


def _rises(branch: dict[str, Any]) -> bool:
    return len(branch["values"]) > 1 and bool((np.diff(branch["values"]) > 0).all())


def _envelope(case: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Lowest local eigenvalue at each pressure."""
    points: dict[float, float] = {}
    for b in case["branches"]:
        if b["kind"] == "local":
            for p, value in zip(b["pressures"], b["values"], strict=True):
                points[p] = min(value, points.get(p, np.inf))
    pressures = sorted(points)
    return np.array(pressures), np.array([points[p] for p in pressures])


def compare(numbers: dict[str, Any]) -> list[Row]:
    """One row a statement.

    Args:
        numbers: what `stability.run` returns, or one state of `eigenvalues.run`.
    """
    single, stack, single_iso, stack_iso = (numbers["cases"][name] for name in CASES)
    rows = [
        _crossing("single lobe, wrinkled: stable up to about 4600 Pa", 13, 4600.0, single, numbers, "single"),
        _crossing("four lobes, wrinkled: stable up to about 3000 Pa", 17, 3000.0, stack, numbers, "stack"),
    ]
    study = numbers["mesh_study"]
    crossings = [[r[name] for r in study if r[name] is not None] for name in ("single", "stack")]
    falling = all(len(found) > 1 and bool((np.diff(found) < 0).all()) for found in crossings)
    rows.append(
        Row(
            "more local modes appear as the mesh is refined; the text gives the crossing for one mesh",
            "crossing single / stack by divisions around: "
            + "; ".join(f"{r['divisions'][1]}: {_pa(r['single'])} / {_pa(r['stack'])}" for r in study),
            "the crossing falls with refinement: it is a property of the mesh"
            if falling
            else "no clear trend on these meshes",
            13,
        )
    )
    p1, p4 = single["critical_pressure"], stack["critical_pressure"]
    rows.append(
        Row(
            "the four-lobe stack is less stable than the single lobe",
            f"crossings {_pa(p1)} and {_pa(p4)} Pa",
            _agree(p1 is not None and p4 is not None and p4 < p1),
            17,
        )
    )
    for name, case, figure in (("single lobe", single, 13), ("four lobes", stack, 17)):
        sway, twist = _branch(case, "sway", 1), _branch(case, "twist", 0)
        rows.append(
            Row(
                f"{name}, wrinkled: global modes become more stable as p grows",
                f"sway {_ends(sway)}, twist {_ends(twist)} Pa/m",
                _agree(_rises(sway) and _rises(twist)),
                figure,
            )
        )
        rows.append(_falling(f"{name}, wrinkled: local modes become less stable as p grows", figure, case))
    rows += [_softer(single, stack), _unchanged(single, stack)]
    for name, case, wrinkled, figure in (
        ("single lobe", single_iso, single, 15),
        ("four lobes", stack_iso, stack, 19),
    ):
        rows.append(_isotropic(name, figure, case))
        p = max(case["pressures"]) / 2
        ratios = [_at(_branch(case, kind), p) / _at(_branch(wrinkled, kind), p) for kind in ("sway", "twist")]
        rows.append(
            Row(
                f"{name}: an isotropic film raises the eigenvalues substantially",
                f"at {p:.0f} Pa sway x {ratios[0]:.1f}, twist x {ratios[1]:.1f}",
                _agree(min(ratios) > 1.2),
                figure,
            )
        )
    return rows


def _crossing(
    paper: str, figure: int, published: float, case: dict[str, Any], numbers: dict[str, Any], name: str
) -> Row:
    p = case["critical_pressure"]
    mesh = "{} x {}".format(*numbers["divisions"])
    if p is None:
        return Row(paper, f"no crossing on {mesh}", "differs", figure)
    here = f"{p:.0f} Pa on {mesh} (local, n = {case['critical_harmonic']})"
    if abs(p / published - 1) < 0.1:
        return Row(paper, here, "agrees within 10 %", figure)
    study = [(r["divisions"][1], r[name]) for r in numbers["mesh_study"] if r[name] is not None]
    for (coarse, above), (fine, below) in pairwise(study):
        if below <= published <= above:
            verdict = f"{100 * (p / published - 1):+.0f} %; the paper's value lies between the crossings"
            return Row(paper, here, f"{verdict} on {coarse} and {fine} divisions around", figure)
    return Row(paper, here, f"differs by {100 * (p / published - 1):+.0f} %", figure)


def _falling(paper: str, figure: int, case: dict[str, Any]) -> Row:
    pressures, values = _envelope(case)
    if not len(values):
        return Row(paper, "no local mode among those computed", "differs", figure)
    top = int(values.argmax())
    here = f"lowest local {values[top]:.0f} Pa/m at {pressures[top]:.0f} Pa, {values[-1]:.0f} at the end"
    falls = top < len(values) - 1 and bool((np.diff(values[top:]) < 0).all())
    if falls and top > 0:
        return Row(paper, here, f"only from {pressures[top]:.0f} Pa on; below it they rise", figure)
    return Row(paper, here, _agree(falls), figure)


def _softer(single: dict[str, Any], stack: dict[str, Any]) -> Row:
    p = max(single["pressures"]) / 2
    ratios = [_at(_branch(single, k), p) / _at(_branch(stack, k), p) for k in ("sway", "twist")]
    return Row(
        "the stack's global modes are significantly softer than one lobe's",
        f"at {p:.0f} Pa: sway 1/{ratios[0]:.0f}, twist 1/{ratios[1]:.0f}",
        _agree(min(ratios) > 2),
        17,
    )


def _unchanged(single: dict[str, Any], stack: dict[str, Any]) -> Row:
    paper = "the local modes' eigenvalues are substantially the same in stack and single lobe"
    (p, one), (q, four) = _envelope(single), _envelope(stack)
    both = np.intersect1d(p, q)
    if not len(both):
        return Row(paper, "no local modes to compare", "differs", 17)
    middle = both[len(both) // 4]
    ratio = float(four[q == middle][0] / one[p == middle][0])
    if abs(ratio - 1) < 0.2:
        verdict = "agrees within 20 %"
    else:
        verdict = f"differs: {100 * (ratio - 1):+.0f} %"
        if ratio < 1:
            verdict += " (the stack's seams, unlike a rim on its plate, may leave their circle)"
    return Row(paper, f"lowest local at {middle:.0f} Pa, stack over single: {ratio:.2f}", verdict, 17)


def _isotropic(name: str, figure: int, case: dict[str, Any]) -> Row:
    lowest = min(min(b["values"]) for b in case["branches"])
    full = [b for b in case["branches"] if len(b["values"]) == len(case["pressures"])]
    rising = sum(_rises(b) for b in full)
    unstable = case["critical_pressure"]
    bound = "no crossing" if unstable is None else f"crossing at {unstable:.3g} Pa"
    return Row(
        f"{name}, isotropic: no local modes go unstable, all eigenvalues positive and rising",
        f"lowest {lowest:.3g} Pa/m; {rising} of {len(full)} branches rise throughout; {bound}",
        _agree(lowest > 0 and rising == len(full)),
        figure,
    )


def _agree(holds: bool) -> str:
    return "agrees" if holds else "differs"


def _ends(branch: dict[str, Any]) -> str:
    return f"{branch['values'][0]:.3g} to {branch['values'][-1]:.3g}" if branch["values"] else "absent"


def _pa(pressure: float | None) -> str:
    return "none" if pressure is None else f"{pressure:.0f}"


def to_markdown(rows: list[Row], header: str) -> str:
    """The rows as a Markdown table below a header line."""
    lines = [header, "", "| paper, sec. 5 | here | verdict |", "|---|---|---|"]
    lines += [f"| {row.paper} | {row.here} | {row.verdict} |" for row in rows]
    return "\n".join(lines) + "\n"


def beside_the_paper(rows: list[Row], header: str) -> dict[str, Any]:
    """The same table as a report of the runs shows it (`lobefem.viz.report.TABLES`)."""
    return {
        "title": "Beside the paper's words",
        "note": header.replace("`", ""),
        "tables": [
            {
                "caption": "What sec. 5 of the paper says, and what was computed here",
                "head": ["paper, sec. 5", "here", "verdict"],
                "rows": [[row.paper, row.here, row.verdict] for row in rows],
            }
        ],
    }
