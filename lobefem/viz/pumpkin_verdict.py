"""Is a pumpkin stable? Sentences on a search along its inflated path, from results.json."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from lobefem.units import pascals

if TYPE_CHECKING:
    from lobefem.typing import Unchecked

__all__ = ["critical"]

_MOVES = {
    "sway": "the balloon sways sideways",
    "twist": "the balloon twists about its axis",
    "global": "the balloon buckles as a whole",
    "local": "the film buckles locally",
}


def _is_number(value: Unchecked) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def _moves(kind: Any, harmonic: Any) -> str:
    waves = (
        ""
        if not isinstance(harmonic, int)
        else f" ({harmonic} {'wave' if harmonic == 1 else 'waves'} around)"
    )
    return _MOVES.get(str(kind), "the balloon buckles") + waves


def critical(results: Mapping[str, Any], quoted: str = "") -> list[str]:
    """Sentences on where a pumpkin is stable and how it moves beyond; none of damaged results.

    Args:
        results: of `critical` or `harmonics`.
        quoted: the critical pressure with its error bar, by default that of the results.
    """
    stable: Any = results.get("stable")
    pressure: Any = results.get("critical_pressure")
    begin: Any = results.get("searched_from")
    end: Any = results.get("searched_to")
    if not isinstance(stable, list) or not _is_number(begin) or not _is_number(end):
        return []
    where = _looked_at(results)
    if not stable:
        looked = results.get("looked_at")
        alone = results.get("only_harmonic") is not None or (isinstance(looked, list) and len(looked) == 1)
        why = str(results.get("reason") or "").partition("; ")[2]
        ended = f"; {why}" if why else ""
        most = "" if alone else f", most of all in harmonic {results.get('harmonic')}"
        return [f"Unstable{where} at all pressures from {pascals(begin)} to {pascals(end)}{most}{ended}."]
    said = []
    low, high = stable[0][:2]
    if low > begin:
        said.append(f"Unstable{where} below {pascals(low)}{_gained(results, low)}.")
        where = ""
    ended = str(results.get("reason") or "")
    if not _is_number(pressure):
        first = f"Stable{where} up to {pascals(high)}"
        ended_at = f"no instability found up to {pascals(high)}, "  # which the sentence says already
        if ended.startswith(ended_at):
            return [*said, f"{first}, {ended.removeprefix(ended_at)}."]
        return [*said, f"{first}: {ended}." if ended else f"{first}."]
    moves = _moves(results.get("kind"), results.get("harmonic"))
    if results.get("point") == "limit point":
        said.append(
            f"Stable{where} up to {quoted or pascals(pressure)}. That is a limit point: above it there is no "
            f"equilibrium nearby, and {moves}."
        )
    else:
        said.append(f"Stable{where} up to {quoted or pascals(pressure)}. Above that {moves}.")
    for again, last in (stretch[:2] for stretch in stable[1:]):
        said.append(f"Stable again from {pascals(again)} to {pascals(last)}.")
    return said


def _gained(results: Mapping[str, Any], pressure: float) -> str:
    """The harmonic that is unstable below a pressure, as the end of a sentence."""
    crossings = results.get("crossings")
    found = [c for c in crossings if isinstance(c, Mapping)] if isinstance(crossings, list) else []
    harmonic = next((c.get("harmonic") for c in found if c.get("pressure") == pressure), None)
    return "" if harmonic is None else f" in harmonic {harmonic}{' (sideways)' if harmonic == 1 else ''}"


def _looked_at(results: Mapping[str, Any]) -> str:
    """The harmonics that were looked at, "" if all were."""
    if results.get("only_harmonic") is not None:
        return f" in harmonic {results['only_harmonic']} (no other was looked at)"
    looked, gores = results.get("looked_at"), results.get("gores")
    if isinstance(looked, list) and isinstance(gores, int) and len(looked) <= gores // 2:
        return (
            f" in the {len(looked)} harmonics that were looked at" if len(looked) > 1 else " in that harmonic"
        )
    return ""
