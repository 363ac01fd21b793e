"""Is it stable? What results say of that, in sentences: the first thing that a reader wants to know."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from lobefem.outcomes import RIGID, UNDECIDED, UNKNOWN
from lobefem.units import pascals, scaled
from lobefem.viz import pumpkin_verdict
from lobefem.viz.mesh_verdict import checked, eigenvalue_bars, not_converged, percent
from lobefem.viz.verdict_records import Results, divisions_of, entries_of, is_number

__all__ = ["FIXED_WRINKLES", "KINK", "motion", "verdict"]

_NO_ANSWER = "the film model gives no answer in this shape; use --state inflated"

_OUTCOMES = {
    "returned": "The balloon returned to its shape after release",
    "distorted and stable": "After release the balloon did not return: it is stable in another shape",
    "not an equilibrium": "After release the balloon found no stable equilibrium",
    UNKNOWN: "After release the balloon came to rest; whether it is stable there could not be computed",
    "distorted under the constraint": "The balloon is still held in this shape. Add --release to let it go",
}

# the two remarks on the film with fixed wrinkles and on the ideal state of a tension field; commands warn
# with them, so that a verdict that is read beside the warnings need not repeat them
FIXED_WRINKLES = (
    "with fixed wrinkles the critical pressure depends on the mesh and goes to zero as it is refined: do not "
    "use it for design; for a realistic result use --film tension-field --state inflated"
)

KINK = (
    "in its ideal shape a tension-field film is exactly between taut and wrinkled, so there are only a "
    "lower and an upper bound, and the table shows the lower; use --state inflated for one number"
)


def verdict(results: Results) -> list[str]:
    """Sentences on stability from the results of a command; none where it failed, or says nothing of it.

    Args:
        results: as in results.json, be it damaged. What its warnings say is not said again.
    """
    make = {
        "inflate": _inflate,
        "modes": _modes,
        "critical": _critical,
        "harmonics": _critical,
        "stability": _critical,  # of the demo
        "mesh-study": _study,
        "perturb": _perturb,
        "sweep": _sweep,
        "sensitivities": _sensitivities,
    }.get(str(results.get("command")))
    if make is None or results.get("error"):
        return []
    warned = results.get("warnings")
    known = {_plain(text) for text in warned} if isinstance(warned, list) else set()
    return [sentence for sentence in make(results) if _plain(sentence) not in known]


def _plain(sentence: object) -> str:
    """A sentence as it can be compared with a warning, which has no capital and no full stop."""
    text = str(sentence).rstrip(".")
    return text[:1].lower() + text[1:]


def motion(kind: Any, harmonic: Any, lobes: Any) -> str:
    """The balloon's motion in a mode, as the end of a sentence."""
    who = "the stack" if isinstance(lobes, int) and lobes > 1 else "the balloon"
    waves = "" if harmonic is None else f" ({harmonic} {'wave' if harmonic == 1 else 'waves'} around)"
    words = {
        "sway": f"{who} sways sideways",
        "twist": f"{who} twists about its axis",
        "global": f"{who} buckles as a whole{waves}",
        "local": f"the film buckles locally{waves}",
    }
    return words.get(str(kind), f"{who} buckles{waves}")


def _on_mesh(results: Results) -> list[str]:
    """Sentences on the mesh dependence of a pressure or an eigenvalue: checked or not, and how far."""
    said = []
    if results.get("film") == "fixed-wrinkles":
        said.append(f"{FIXED_WRINKLES[:1].upper()}{FIXED_WRINKLES[1:]}.")
    if results.get("mesh_behaviour") is not None:
        return [checked(results), *said]
    mesh = divisions_of(results)
    if mesh is None:
        return ["Mesh: not checked. Repeat with a finer one.", *said]
    finer = "x".join(str(2 * math.ceil(0.75 * n)) for n in mesh)
    way = f"Repeat with --divisions {finer}" if results.get("command") == "harmonics" else "Add --mesh-study"
    bounds = results.get("command") == "critical" and "sides" in results  # no study takes them
    way = "For a study of the mesh use --state inflated" if bounds else f"{way} for an error bar"
    return [f"Mesh: not checked ({mesh[0]} x {mesh[1]} divisions). {way}.", *said]


def _inflate(results: Results) -> list[str]:
    if not is_number(results.get("pressure")) or not results.get("converged"):
        return []
    found = f"Equilibrium found at {pascals(results['pressure'])}."
    return [f"{found} Run lobefem modes to check its stability.", *_bears(results)]


def _sensitivities(results: Results) -> list[str]:
    """Sentence on the changes that do most for the stability of a pumpkin."""
    rows = results.get("parameters")
    if not isinstance(rows, list) or not rows:
        return []
    critical = is_number(results.get("critical_pressure"))
    key, what = (
        ("critical_pressure", "critical pressure") if critical else ("eigenvalue", "lowest eigenvalue")
    )
    steps = [row for row in rows if row["name"] != "pressure" and row["changes"].get(key)]
    if not steps:
        return []
    first = steps[0]
    way = "raises" if first["changes"][key] > 0 else "lowers"
    unit = "Pa" if critical else "Pa/m"
    return [
        f"Of these changes that of the {first['name']}, {first['step']}, does most: it {way} the {what} of "
        f"n = {results.get('harmonic')} by {abs(first['changes'][key]):.3g} {unit}."
    ]


# --- critical pressures -------------------------------------------------------------------------
def _critical(results: Results) -> list[str]:
    pressure: Any = results.get("critical_pressure")
    if "gores" in results:
        found = pumpkin_verdict.critical(results, _quoted(results))
        if found and pressure and results.get("mesh_behaviour") in ("falls", "open"):
            found = [not_converged(results)]
        return [*_breaks(results), *found, *_bears(results), *_on_mesh(results)] if found else []
    if pressure == 0:
        return _from_nothing(results)
    if not is_number(pressure) or pressure < 0:
        reason = str(results.get("reason") or "")
        if not reason and "chart" in results:
            reason = f"stable at any pressure{_looked_at(results)}"
        if not reason:
            return []
        on_mesh = _on_mesh(results) if results.get("film") != "fixed-wrinkles" else []
        first = f"{reason[:1].upper()}{reason[1:]}."
        return [*_breaks(results), first, *_bears(results), *on_mesh, *_assumed(results)]
    if results.get("mesh_behaviour") in ("falls", "open"):
        first = not_converged(results)
        return [*_breaks(results), first, *_bears(results), *_on_mesh(results), *_assumed(results)]
    quoted, where = _quoted(results), _looked_at(results)
    moves = motion(_kind(results), results.get("harmonic"), results.get("lobes"))
    if results.get("point") == "limit point":
        first = (
            f"Stable{where} up to {quoted}. That is a limit point: above it there is no "
            f"equilibrium nearby, and {moves}."
        )
    else:
        first = f"Stable{where} up to {quoted}. Above that {moves}."
    bounds = results.get("bounds")
    if isinstance(bounds, (list, tuple)) and len(bounds) == 2 and is_number(bounds[0]):
        upper = is_number(bounds[1])
        end = f"unstable above {pascals(bounds[1])}" if upper else "no upper bound found"
        rest = "Between them" if upper else "Above that"
        first = f"Stable{where} below {pascals(bounds[0])}, {end}. {rest} {_NO_ANSWER}."
    assumed = _decides(results) or _assumed(results)
    return [*_breaks(results), first, *_bears(results), *_on_mesh(results), *assumed]


def _decides(results: Results) -> list[str]:
    """A sentence on the other assumption that changes a critical pressure most, if others were tried."""
    rows = results.get("what_if")
    known = [row for row in rows if isinstance(row, Mapping)] if isinstance(rows, list) else []
    known = [row for row in known if not row.get("error") and "critical_pressure" in row]
    given: Any = known[0]["critical_pressure"] if known else None
    if not is_number(given) or given <= 0 or len(known) < 2:
        return []

    def far(row: Mapping[str, Any]) -> float:
        p: Any = row["critical_pressure"]
        return abs(math.log(p / given)) if is_number(p) and p > 0 else math.inf

    most = max(known[1:], key=far)
    found = most["critical_pressure"]
    limit: Any = results.get("limit")
    to = f" up to {pascals(limit)}" if is_number(limit) else ""
    answer = pascals(found) if is_number(found) else f"no instability is found{to}"
    return [f"Of the other assumptions that were tried, '{most['change']}' changes most: {answer}."]


def _quoted(results: Results) -> str:
    """The critical pressure to quote: the limit of a mesh study with its error bar, if there is one."""
    pressure: Any = results.get("critical_pressure")
    limit: Any = results.get("mesh_limit")
    if is_number(limit) and is_number(results.get("mesh_error")):
        return f"{pascals(limit)} ± {percent(results['mesh_error'])}"
    return pascals(pressure) if is_number(pressure) else ""


def _breaks(results: Results) -> list[str]:
    """A sentence on film that breaks before the balloon turns unstable, or before the search ended."""
    reached: Any = results.get("strength_pressure")
    strength: Any = results.get("strength")
    critical: Any = results.get("critical_pressure")
    if not is_number(reached) or not is_number(strength):
        return []
    limit: Any = results.get("mesh_limit")
    later = not is_number(limit) or not is_number(results.get("mesh_error")) or limit >= reached
    when = "before" if later else "about when"  # the finest mesh's critical pressure is above the limit
    before = f", {when} the balloon turns unstable at {_quoted(results)}" if is_number(critical) else ""
    return [f"The film reaches its strength of {pascals(strength)} at about {pascals(reached)}{before}."]


def _bears(results: Results) -> list[str]:
    """A sentence on the film's largest stress, beside its strength where that is known."""
    stress: Any = results.get("max_stress")
    strength: Any = results.get("strength")
    pressure: Any = results.get("pressure")
    if not is_number(stress) or is_number(results.get("strength_pressure")):
        return []
    if pressure is None and results.get("critical_pressure") == 0:
        pressure = results.get("searched_to")  # of a pumpkin that is nowhere stable
    there = f"at {pascals(pressure)}" if is_number(pressure) else "there"
    told = f"The film is stressed to {pascals(stress)} at most {there}"
    if not is_number(strength):
        return [f"{told}; compare that with its strength (film.strength)."]
    if stress < strength:
        return [f"{told}, {100 * stress / strength:.0f} % of its strength."]
    return [f"{told}, beyond its strength of {pascals(strength)}: it breaks before."]


def _from_nothing(results: Results) -> list[str]:
    """Of what is unstable at any pressure, or may be as far as a tension field's bounds tell."""
    bounds = results.get("bounds")
    upper: Any = bounds[1] if isinstance(bounds, (list, tuple)) and len(bounds) == 2 else 0.0
    if upper == 0:
        where = f" in harmonic {results.get('harmonic')}" if "chart" in results else _looked_at(results)
        return [f"Unstable at any pressure{where}."]
    if not is_number(upper):
        return [f"Whether the balloon is stable, {_NO_ANSWER}."]
    return [f"Unstable above {pascals(upper)}. Below that {_NO_ANSWER}."]


def _assumed(results: Results) -> list[str]:
    """A sentence on the load or the bar, which change a critical pressure several times over."""
    if results.get("support") == "fixed":
        return []
    if results.get("load") == "closed" and results.get("bar") == "rigid":
        return [
            "This run has a rigid bar along the axis, which decides much in a closed balloon: if yours has "
            "none, add --bar none."
        ]
    if results.get("load") != "film":
        return []
    return [
        "In this run the gas does not press on the end plates (--load film). In a closed balloon it does, "
        "which can lower the critical pressure several times: --load closed."
    ]


def _looked_at(results: Results) -> str:
    """The harmonics that were looked at, "" if all were."""
    if results.get("only_harmonic") is not None:
        return f" in harmonic {results['only_harmonic']} (no other was looked at)"
    chart, mesh = results.get("chart"), results.get("divisions")
    if isinstance(chart, list) and isinstance(mesh, (list, tuple)) and len(chart) <= mesh[-1] // 2:
        several = f" in the {len(chart)} harmonics that were looked at"
        return several if len(chart) > 1 else " in that harmonic"
    return ""


def _kind(results: Results) -> str:
    """Of the critical mode; a chart's stands in its row."""
    if results.get("kind"):
        return str(results["kind"])
    chart = results.get("chart")
    rows = [row for row in chart if isinstance(row, Mapping)] if isinstance(chart, list) else []
    return next((str(row.get("kind")) for row in rows if row.get("harmonic") == results.get("harmonic")), "")


def _study(results: Results) -> list[str]:
    found = results.get("verdict")
    said = [str(sentence) for sentence in found] if isinstance(found, list) else []
    return [*said, checked(results)] if results.get("mesh_behaviour") else said


def _sweep(results: Results) -> list[str]:
    """Sentences on a sweep over nothing but the mesh, which is a mesh study."""
    if results.get("mesh_behaviour") is None:
        return []
    limit: Any = results.get("mesh_limit")
    error: Any = results.get("mesh_error")
    if not is_number(error) or not is_number(limit):
        return [not_converged({**results, "hoops": ""}), checked(results)]
    return [f"The critical pressure is {pascals(limit)} ± {percent(error)}.", checked(results)]


# --- single pressures ---------------------------------------------------------------------------
def _modes(results: Results) -> list[str]:
    known = entries_of(results)
    stable = ", ".join(pascals(entry["pressure"]) for entry in known if entry["stable"])
    said = [f"Stable at {stable}."] if stable else []
    for entry in known:
        if entry.get("verdict") == UNDECIDED:
            said.append(
                f"At {pascals(entry['pressure'])} the lower bound of the lowest eigenvalue is negative, the "
                f"upper one positive: {_NO_ANSWER}."
            )
        elif not entry["stable"]:
            modes = entry.get("modes")
            own = [m for m in modes if not _is_rigid(m)] if isinstance(modes, list) else []
            lowest = own[0] if own and isinstance(own[0], Mapping) else {}
            moves = motion(lowest.get("kind"), lowest.get("harmonic"), results.get("lobes"))
            said.append(f"Unstable at {pascals(entry['pressure'])}: {moves}.")
    said += eigenvalue_bars(known, results)
    if said:
        highest = max(known, key=lambda entry: entry["pressure"])
        said += [*_flutter(known), *_bears({**results, **highest}), *_on_mesh(results), *_assumed(results)]
    return said


def _flutter(entries: list[Mapping[str, Any]]) -> list[str]:
    """Stable eigenvalues that are more imaginary than real, of a load without a potential."""
    for entry in entries:
        modes = entry.get("modes")
        known = [m for m in modes if isinstance(m, Mapping)] if isinstance(modes, list) else []
        found = [m for m in known if not _is_rigid(m)]
        pairs: list[tuple[Any, Any]] = [(m.get("real"), m.get("imag")) for m in found]
        values = [(re, im) for re, im in pairs if is_number(re) and is_number(im)]
        scale = max((abs(re) for re, _ in values), default=0.0)
        if any(0 <= re < abs(im) and abs(im) > 1e-3 * scale for re, im in values):
            return [
                f"At {pascals(entry['pressure'])} a stable mode may flutter (a growing oscillation) if "
                "nothing damps it: its eigenvalue is more imaginary than real."
            ]
    return []


def _is_rigid(mode: Any) -> bool:
    return isinstance(mode, Mapping) and mode.get("kind") == RIGID


def _perturb(results: Results) -> list[str]:
    outcome = _OUTCOMES.get(str(results.get("outcome")))
    if outcome is None:
        return []
    distance: Any = results.get("distance")
    if results.get("outcome") == "returned":
        # below a micrometre is exact for a balloon
        within = f", within {scaled(max(distance, 1e-6), 'm')}" if is_number(distance) else ""
        return [f"{outcome} (stable{within})."]
    reason = str(results.get("reason") or "")
    told = reason and results.get("release", True)
    return [f"{outcome}{': ' + reason if told else ''}."]
