"""Is it stable? What results say of that, in sentences: the first thing that a reader wants to know."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from lobefem.outcomes import RIGID, UNDECIDED, UNKNOWN
from lobefem.units import pascals

__all__ = ["verdict"]

Results = Mapping[str, Any]

_OUTCOMES = {
    "returned": "Let go, the balloon returns",
    "distorted and stable": "Let go, the balloon does not return: it rests distorted, and stable there",
    "not an equilibrium": "Let go, the balloon comes to rest in no stable equilibrium",
    UNKNOWN: "Let go, the balloon comes to rest; whether it is stable there could not be computed",
    "distorted under the constraint": "Held distorted; what it does when it is let go, --release tells",
}


def verdict(results: Results) -> list[str]:
    """Sentences on stability from the results of a command; none where it failed, or says nothing of it.

    Args:
        results: as in results.json, be it damaged.
    """
    make = {
        "inflate": _inflate,
        "modes": _modes,
        "critical": _critical,
        "harmonics": _critical,
        "stability": _critical,  # of the demo
        "mesh-study": _study,
        "perturb": _perturb,
    }.get(str(results.get("command")))
    if make is None or results.get("error"):
        return []
    return make(results)


def _is_pressure(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def _mode(kind: Any, harmonic: Any) -> str:
    name = f"a {kind} mode" if kind else "a mode"
    return name if harmonic is None else f"{name} of harmonic {harmonic}"


def _mesh(results: Results) -> str:
    divisions = results.get("divisions")
    if not isinstance(divisions, (list, tuple)) or len(divisions) != 2:
        return "an unstructured mesh"
    return f"{divisions[0]} × {divisions[1]} divisions"


def _inflate(results: Results) -> list[str]:
    if not _is_pressure(results.get("pressure")) or not results.get("converged"):
        return []
    return [f"In equilibrium at {pascals(results['pressure'])}. Whether that is stable, lobefem modes tells."]


# --- critical pressures -------------------------------------------------------------------------
def _critical(results: Results) -> list[str]:
    pressure: Any = results.get("critical_pressure")
    if pressure == 0:
        return _from_nothing(results)
    if not _is_pressure(pressure) or pressure < 0:
        reason = str(results.get("reason") or "")
        if not reason and "chart" in results:
            reason = f"stable at any pressure{_looked_at(results)}"
        return [f"{reason[:1].upper()}{reason[1:]}."] if reason else []
    held = " as its pressure rises" if results.get("state") == "inflated" else _looked_at(results)
    mode = _mode(_kind(results), results.get("harmonic"))
    if results.get("point") == "limit point":
        first = f"Stable{held} up to {pascals(pressure)}, a limit point; there {mode} gives way."
    else:
        first = f"Stable{held} below {pascals(pressure)}, unstable from there on in {mode}."
    bounds = results.get("bounds")
    if isinstance(bounds, (list, tuple)) and len(bounds) == 2 and _is_pressure(bounds[0]):
        end = f"unstable above {pascals(bounds[1])}" if _is_pressure(bounds[1]) else "no upper bound found"
        first = (
            f"Stable{held} below {pascals(bounds[0])}, {end}; between the two this film's law does not tell."
        )
    return [first, _whose(results), *_gas(results)]


def _from_nothing(results: Results) -> list[str]:
    """Of what is unstable at any pressure, or may be as far as a tension field's bounds tell."""
    bounds = results.get("bounds")
    upper: Any = bounds[1] if isinstance(bounds, (list, tuple)) and len(bounds) == 2 else 0.0
    if upper == 0:
        where = f" in harmonic {results.get('harmonic')}" if "chart" in results else _looked_at(results)
        return [f"Unstable at any pressure{where.rstrip(',')}."]
    ends = f"Unstable above {pascals(upper)}; below, this" if _is_pressure(upper) else "This"
    return [f"{ends} film's law does not tell whether the balloon is stable."]


def _gas(results: Results) -> list[str]:
    """A sentence on where the gas presses, which changes a critical pressure several times over."""
    if results.get("load") != "film" or results.get("support") == "fixed":
        return []
    return [
        "Here the gas presses on the film alone (load film, the paper's). In a closed balloon it presses on "
        "the end plates too, which can be far less stable: --load closed."
    ]


def _looked_at(results: Results) -> str:
    """The harmonics that were looked at, "" if all were."""
    if results.get("only_harmonic") is not None:
        return f" in harmonic {results['only_harmonic']}, which alone was looked at,"
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


def _whose(results: Results) -> str:
    """A sentence on the mesh dependence of a critical pressure."""
    mesh = _mesh(results)
    if results.get("film") == "fixed-wrinkles":
        return (
            f"That pressure is the mesh's ({mesh}), not the balloon's: with fixed wrinkles it falls without "
            "a limit as the mesh is refined. Closest to real film is --film tension-field --state inflated."
        )
    study = " or --mesh-study" if results.get("film") == "isotropic" else ""
    return (
        f"Whether that is the balloon's or the mesh's ({mesh}), one mesh cannot tell: compare with a finer "
        f"one (--divisions{study})."
    )


def _study(results: Results) -> list[str]:
    found = results.get("verdict")
    return [str(sentence) for sentence in found] if isinstance(found, list) else []


# --- single pressures ---------------------------------------------------------------------------
def _modes(results: Results) -> list[str]:
    entries = results.get("pressures")
    known = (
        [e for e in entries if isinstance(e, Mapping) and "stable" in e] if isinstance(entries, list) else []
    )
    known = [entry for entry in known if _is_pressure(entry.get("pressure"))]
    where = f" on this mesh ({_mesh(results)})" if results.get("film") == "fixed-wrinkles" else ""
    stable = ", ".join(pascals(entry["pressure"]) for entry in known if entry["stable"])
    said = [f"Stable{where} at {stable}."] if stable else []
    for entry in known:
        if entry.get("verdict") == UNDECIDED:
            said.append(
                f"At {pascals(entry['pressure'])} this film's law does not tell whether the balloon is "
                "stable: only the lower bound of its lowest eigenvalue is negative."
            )
        elif not entry["stable"]:
            modes = entry.get("modes")
            own = [m for m in modes if not _is_rigid(m)] if isinstance(modes, list) else []
            lowest = own[0] if own and isinstance(own[0], Mapping) else {}
            mode = _mode(lowest.get("kind"), lowest.get("harmonic"))
            said.append(f"Unstable{where} at {pascals(entry['pressure'])} in {mode}.")
    said += _flutter(known)
    return said + (_gas(results) if said else [])


def _flutter(entries: list[Mapping[str, Any]]) -> list[str]:
    """Stable eigenvalues that are more imaginary than real, of a load without a potential."""
    for entry in entries:
        modes = entry.get("modes")
        known = [m for m in modes if isinstance(m, Mapping)] if isinstance(modes, list) else []
        found = [m for m in known if not _is_rigid(m)]
        pairs: list[tuple[Any, Any]] = [(m.get("real"), m.get("imag")) for m in found]
        values = [(re, im) for re, im in pairs if _is_pressure(re) and _is_pressure(im)]
        scale = max((abs(re) for re, _ in values), default=0.0)
        if any(0 <= re < abs(im) and abs(im) > 1e-3 * scale for re, im in values):
            return [
                f"At {pascals(entry['pressure'])} the eigenvalue of a stable mode is more imaginary than "
                "real: without damping by the air such a pair grows, swinging (flutter)."
            ]
    return []


def _is_rigid(mode: Any) -> bool:
    return isinstance(mode, Mapping) and mode.get("kind") == RIGID


def _perturb(results: Results) -> list[str]:
    outcome = _OUTCOMES.get(str(results.get("outcome")))
    if outcome is None:
        return []
    reason = str(results.get("reason") or "")
    return [f"{outcome}{': ' + reason if reason else ''}."]
