"""The answer of a run at a glance: a word, a number, what happens there, and what to check first."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from lobefem.outcomes import RIGID, UNDECIDED
from lobefem.typing import Unchecked
from lobefem.units import pascals, scaled
from lobefem.viz.mesh_verdict import percent
from lobefem.viz.verdict import motion, verdict

__all__ = ["Headline", "Mark", "headline"]

Results = Mapping[str, Any]

GOOD, BAD, OPEN, PLAIN = "good", "bad", "open", "plain"


@dataclass(frozen=True)
class Mark:
    """A fact beside the answer, and how far it is to be trusted.

    Attributes:
        name: a word, as "mesh".
        text: a few words.
        tone: "good", "bad", "open" (check this) or "plain".
    """

    name: str
    text: str
    tone: str = PLAIN


@dataclass(frozen=True)
class Headline:
    """The answer.

    Attributes:
        tone: "good", "bad", "open" or "plain", which the page colours and marks with a sign.
        word: "Stable up to", "Unstable", "Undecided", ...
        number: the number that goes with it, with its unit; "" without one.
        text: what happens there, a sentence.
        marks: mesh, film, bar, ...
        value: the number in SI, by which runs are compared; None without one.
        about: what `value` is, with its unit, as an axis says it.
    """

    tone: str
    word: str
    number: str = ""
    text: str = ""
    marks: tuple[Mark, ...] = ()
    value: float | None = None
    about: str = field(default="critical pressure [Pa]", repr=False)


def headline(results: Results) -> Headline:
    """The answer of a run from what results.json holds, be it damaged."""
    command = str(results.get("command"))
    if results.get("error"):
        return Headline(BAD, "Failed", "", "The solve failed; what is shown is its last converged state.")
    makers = {
        "inflate": _inflated,
        "modes": _modes,
        "critical": _critical,
        "harmonics": _critical,
        "stability": _critical,  # of the demo
        "mesh-study": _study,
        "perturb": _perturbed,
        "sweep": _sweep,
        "sensitivities": _sensitivities,
    }
    made = makers[command](results) if command in makers else None
    return made or Headline(OPEN, "No verdict", "", "These results say nothing of stability.")


def _real(value: Unchecked) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def _number(pressure: Any) -> str:
    return pascals(float(pressure))


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}." if text else ""


def _kind(results: Results) -> Any:
    """Of the critical mode; a chart's stands in its row."""
    if results.get("kind"):
        return results["kind"]
    chart, harmonic = results.get("chart"), results.get("harmonic")
    rows = [r for r in chart if isinstance(r, Mapping)] if isinstance(chart, list) else []
    return next((row.get("kind") for row in rows if row.get("harmonic") == harmonic), None)


def _moves(results: Results) -> str:
    return motion(_kind(results), results.get("harmonic"), results.get("lobes"))


# --- critical pressures -------------------------------------------------------------------------
def _critical(results: Results) -> Headline | None:
    pressure: Any = results.get("critical_pressure")
    bounds = results.get("bounds")
    low, high = bounds if isinstance(bounds, (list, tuple)) and len(bounds) == 2 else (None, None)
    breaks: Any = results.get("strength_pressure")
    marks = (*_mesh(results), *_film(results), *_parts(results))
    pressure = _converged(results, pressure)
    if _real(breaks) and not (_real(pressure) and pressure < breaks):
        known = f"before the balloon becomes unstable at {_number(pressure)}" if _real(pressure) else "there"
        text = f"The film reaches its strength {known}."
        return Headline(BAD, "The film breaks at", _number(breaks), text, marks, pressure)
    if _real(low) and low != high:
        if not low and not _real(high):
            return Headline(OPEN, "Undecided", "", "The film model gives no answer in this shape.", marks)
        text = _sentence(f"above that {_moves(results)}")
        if not low:
            return Headline(
                OPEN, "Unstable above", _number(high), text + " Below that undecided.", marks, high
            )
        rest = f" Undecided up to {_number(high)}." if _real(high) else " Undecided above."
        return Headline(OPEN, "Stable below", _number(low), rest.strip(), marks, low)
    if "gores" in results:
        return _pumpkin(results, marks)
    if pressure == 0:
        return Headline(BAD, "Unstable", "at any pressure", _sentence(_moves(results)), marks, 0.0)
    if _real(pressure) and results.get("mesh_behaviour") in ("falls", "open"):
        return _without_limit(results, marks)
    if _real(pressure):
        tone = OPEN if _falls(results) else GOOD
        text = _sentence(f"above that {_moves(results)}")
        return Headline(tone, "Stable up to", _number(pressure), text, marks, pressure)
    end: Any = results.get("limit")
    if _real(end):
        text = "That is where the search ended; a higher --limit looks further."
        return Headline(GOOD, "No instability up to", _number(end), text, marks)
    if results.get("reason"):
        return Headline(OPEN, "No critical pressure", "", _sentence(str(results["reason"])), marks)
    if "chart" in results:
        return Headline(GOOD, "Stable", "at any pressure", "No harmonic turns unstable.", marks)
    return None


def _converged(results: Results, pressure: Any) -> Any:
    """The limit of a mesh study, if there is one, in the place of a critical pressure."""
    limit: Any = results.get("mesh_limit")
    known = pressure and _real(pressure) and _real(limit) and _real(results.get("mesh_error"))
    return limit if known else pressure


def _pumpkin(results: Results, marks: tuple[Mark, ...]) -> Headline | None:
    """Of the stretches of a pumpkin's path on which it is stable."""
    stable: Any = results.get("stable")
    pressure: Any = results.get("critical_pressure")
    begin: Any = results.get("searched_from")
    end: Any = results.get("searched_to")
    if not isinstance(stable, list) or not _real(begin) or not _real(end):
        return None
    if not stable:
        why = _sentence(str(results.get("reason") or "").partition("; ")[2])
        text = f"{_sentence(_moves(results))} Searched from {_number(begin)}. {why}".strip()
        return Headline(BAD, "Unstable up to", _number(end), text, marks, 0.0)
    low, high = stable[0][0], stable[0][-1]
    gained = low > begin
    from_ = f"Stable from {_number(low)} up to" if gained else "Stable up to"
    if not _real(pressure):
        reason = str(results.get("reason") or "")
        text = "That is where the search ended."
        text = text if not reason or reason.startswith("no instability found") else _sentence(reason)
        word = from_ if gained else "No instability up to"
        below = f" Below {_number(low)} it is unstable." if gained else ""
        return Headline(GOOD, word, _number(high), f"{text}{below}", marks)
    if results.get("mesh_behaviour") in ("falls", "open"):
        return _without_limit(results, marks)
    pressure = _converged(results, pressure)
    again = f" Stable again from {_number(stable[1][0])}." if len(stable) > 1 else ""
    text = _sentence(f"above that {_moves(results)}")
    below = f" Below {_number(low)} it is unstable, too." if gained else ""
    tone = OPEN if _falls(results) else GOOD
    return Headline(tone, from_, _number(pressure), f"{text}{below}{again}", marks, pressure)


def _without_limit(results: Results, marks: tuple[Mark, ...]) -> Headline:
    """Of a mesh study that found no limit above zero, or none yet."""
    rows = [r for r in results.get("meshes") or [] if isinstance(r, Mapping)]
    values = [r["critical_pressure"] for r in rows if _real(r.get("critical_pressure"))]
    span = (
        f"{_number(values[0])} to {_number(values[-1])} from the coarsest to the finest mesh."
        if values
        else ""
    )
    last = values[-1] if values else results["critical_pressure"]
    if results["mesh_behaviour"] == "falls":
        text = f"{span} There is no limit in sight: do not use it for design.".strip()
        return Headline(BAD, "Falls with refinement", f"below {_number(last)}", text, marks, last)
    return Headline(OPEN, "Not converged", _number(last), f"{span} Give finer --meshes.".strip(), marks, last)


def _falls(results: Results) -> bool:
    return results.get("film") == "fixed-wrinkles" or results.get("mesh_behaviour") == "falls"


def _mesh(results: Results) -> tuple[Mark, ...]:
    """Mark that says how far the number depends on the mesh."""
    mesh = results.get("divisions")
    on = "×".join(map(str, mesh)) if isinstance(mesh, (list, tuple)) else ""
    error: Any = results.get("mesh_error")
    if _falls(results):
        return (Mark("Mesh", f"falls with refinement{f' ({on})' if on else ''}: not for design", BAD),)
    rows = results.get("meshes")
    meshes = f"{len(rows)} meshes" if isinstance(rows, list) and rows else "several meshes"
    if _real(error):
        sure = error < 0.05 and results.get("mesh_asymptotic", True)
        # beside the pressure at which the film breaks the bar would pass for that of this pressure
        of = "instability " if _real(results.get("strength_pressure")) else ""
        return (Mark("Mesh", f"{of}± {percent(error)}, by {meshes}", GOOD if sure else OPEN),)
    if results.get("mesh_behaviour") is not None and isinstance(rows, list):
        known = [r.get("critical_pressure") for r in rows if isinstance(r, Mapping)]
        if "critical_pressure" in results and known == [None] * len(rows):
            return (Mark("Mesh", f"the same on {meshes}", GOOD),)
    if results.get("mesh_behaviour") is not None:
        return (Mark("Mesh", f"{meshes} do not show a limit", OPEN),)
    return (Mark("Mesh", f"{on + ': ' if on else ''}not checked on a finer one", OPEN),)


def _film(results: Results) -> tuple[Mark, ...]:
    stress: Any = results.get("max_stress")
    strength: Any = results.get("strength")
    if not _real(stress):
        return ()
    if not _real(strength):
        return (Mark("Film stress", f"{scaled(stress, 'Pa')}; its strength is not given", OPEN),)
    share = f"{scaled(stress, 'Pa')}, {100 * stress / strength:.0f} % of its strength"
    return (Mark("Film stress", share, GOOD if stress < strength else BAD),)


def _parts(results: Results) -> tuple[Mark, ...]:
    """Load, bar and hoops, which change a critical pressure several times over."""
    marks = []
    hoops: Any = results.get("hoop_tension")
    if "gores" in results:
        pass  # it has tendons
    elif isinstance(hoops, list) and hoops and all(map(_real, hoops)):
        marks.append(Mark("Hoops", f"{scaled(max(hoops), 'N')} at most"))
    elif results.get("hoops") is None and isinstance(results.get("lobes"), int) and results["lobes"] > 1:
        marks.append(Mark("Hoops", "none at the seams", OPEN))
    force: Any = results.get("bar_force")
    if results.get("bar") is not None and results.get("support") != "fixed" and "gores" not in results:
        bar = "rigid" if results["bar"] == "rigid" else "elastic"
        text = f"{bar}, {scaled(force, 'N')}" if _real(force) else bar
        closed = results.get("load") == "closed" and bar == "rigid"
        marks.append(
            Mark("Bar", text + (": does yours have one?" if closed else ""), OPEN if closed else PLAIN)
        )
    if results.get("load") == "film" and results.get("support") != "fixed":
        marks.append(Mark("Gas", "does not press on the plates", OPEN))
    tension: Any = results.get("tendon_tension")
    if isinstance(tension, list) and tension and all(map(_real, tension)):
        marks.append(Mark("Tendons", f"{scaled(min(tension), 'N')} to {scaled(max(tension), 'N')}"))
    return tuple(marks)


# --- single pressures ---------------------------------------------------------------------------
def _modes(results: Results) -> Headline | None:
    found = results.get("pressures")
    entries = [e for e in found if isinstance(e, Mapping)] if isinstance(found, list) else []
    entries = [e for e in entries if "stable" in e and _real(e.get("pressure"))]
    if not entries:
        return None
    entries.sort(key=lambda entry: entry["pressure"])
    highest = {**results, **entries[-1]}
    marks = (*_mesh(results), *_film(highest), *_parts(highest))
    unstable = [e for e in entries if not e["stable"] and e.get("verdict") != UNDECIDED]
    open_ = [e for e in entries if e.get("verdict") == UNDECIDED]
    stable = [e for e in entries if e["stable"] and e.get("verdict") != UNDECIDED]
    span = _span([e["pressure"] for e in stable])
    if unstable:
        first = unstable[0]
        modes = first.get("modes")
        own = [m for m in modes if isinstance(m, Mapping)] if isinstance(modes, list) else []
        lowest: Mapping[str, Any] = next((m for m in own if m.get("kind") != RIGID), {})
        moves = _sentence(motion(lowest.get("kind"), lowest.get("harmonic"), results.get("lobes")))
        later = [e for e in entries if e["pressure"] >= first["pressure"]]
        below = [e["pressure"] for e in stable if e["pressure"] < first["pressure"]]
        told = f" Stable at {span}." if stable else ""
        if len(later) == len(unstable) and below:
            told = f" It becomes unstable between {_number(max(below))} and {_number(first['pressure'])}."
        word = "Unstable from" if len(later) == len(unstable) > 1 else "Unstable at"
        number = (
            _number(first["pressure"])
            if word == "Unstable from"
            else ", ".join(_number(e["pressure"]) for e in unstable)
        )
        return Headline(BAD, word, number, f"{moves}{told}", marks)
    if open_:
        text = f"The film model gives no answer there.{f' Stable at {span}.' if stable else ''}"
        return Headline(OPEN, "Undecided at", _span([e["pressure"] for e in open_]), text, marks)
    tone = OPEN if _falls(results) else GOOD
    text = "At each of these pressures all modes push the balloon back."
    if len(stable) == 1:
        text = "All modes push the balloon back."
    return Headline(tone, "Stable at", span, text, marks)


def _span(pressures: list[float]) -> str:
    """Pressures in few words."""
    if not pressures:
        return ""
    return (
        _number(pressures[0])
        if len(pressures) == 1
        else f"{_number(pressures[0])} to {_number(pressures[-1])}"
    )


def _inflated(results: Results) -> Headline | None:
    pressure: Any = results.get("pressure")
    if not _real(pressure) or not results.get("converged"):
        return None
    volume: Any = results.get("volume")
    first = f"The balloon holds {scaled(volume, 'm³')}. " if _real(volume) else ""
    marks = (Mark("Stability", "not checked", OPEN), *_film(results), *_parts(results))
    size = (("Diameter", "diameter"), ("Height", "height"))
    marks += tuple(Mark(name, scaled(results[key], "m")) for name, key in size if _real(results.get(key)))
    text = f"{first}lobefem critical tells up to which pressure it is stable."
    return Headline(PLAIN, "In equilibrium at", _number(pressure), text, marks, volume, "volume [m³]")


def _perturbed(results: Results) -> Headline | None:
    words = {
        "returned": (GOOD, "Returned", "Let go, the balloon took up its shape again."),
        "distorted and stable": (BAD, "Did not return", "It is stable in another shape."),
        "not an equilibrium": (BAD, "Did not return", "It found no stable equilibrium."),
        "distorted under the constraint": (PLAIN, "Held at", "Whether it returns, --release tells."),
    }
    known = words.get(str(results.get("outcome")))
    if known is None:
        known = (OPEN, "Undecided", _sentence(str(results.get("outcome") or "the run did not end")))
    tone, word, text = known
    unit = str(results.get("unit") or "")
    size: Any = results.get("parameter")
    number = ""
    if _real(size):
        sign = "°" if unit == "degrees" else unit
        number = f"{size:.4g}°" if sign == "°" else scaled(size, sign)
        number = number if word == "Held at" else f"after {number}"
    pressure: Any = results.get("pressure")
    marks = [Mark("Push", str(results.get("distortion") or ""))] if results.get("distortion") else []
    marks += [Mark("Pressure", _number(pressure))] if _real(pressure) else []
    reaction: Any = results.get("reaction")
    if _real(reaction):
        marks.append(Mark("Force", scaled(abs(reaction), str(results.get("reaction_unit") or "N"))))
    ledger = results.get("energy")
    error: Any = ledger.get("error") if isinstance(ledger, Mapping) else None
    if _real(error):
        marks.append(
            Mark("Energy", f"{100 * abs(error):.2g} % unaccounted", GOOD if abs(error) < 0.05 else OPEN)
        )
    return Headline(tone, word, number, text, tuple(marks))


# --- studies ------------------------------------------------------------------------------------
def _study(results: Results) -> Headline | None:
    lowest = results.get("lowest")
    trend: Mapping[str, Any] = lowest if isinstance(lowest, Mapping) else {}
    rows = results.get("meshes")
    meshes = [r for r in rows if isinstance(r, Mapping)] if isinstance(rows, list) else []
    values = [r["critical_pressure"] for r in meshes if _real(r.get("critical_pressure"))]
    span = f"{_number(values[0])} to {_number(values[-1])} on {len(values)} meshes" if values else ""
    limit, error = trend.get("limit"), trend.get("uncertainty")
    if trend.get("behaviour") == "converges" and _real(limit):
        text = f"± {_number(error)}: the error of the fit." if _real(error) else ""
        return Headline(GOOD, "Stable up to", _number(limit), text, (Mark("Mesh", "converges", GOOD),), limit)
    if trend.get("behaviour") == "falls":
        text = f"{span[:1].upper()}{span[1:]}; it goes to zero. Do not use it for design."
        return Headline(BAD, "Falls with refinement", f"below {_number(values[-1])}" if values else "", text)
    if not meshes:
        return None
    last = values[-1] if values else None
    number = "" if last is None else _number(last)
    text = f"{span[:1].upper()}{span[1:]}: these meshes do not show a limit."
    return Headline(OPEN, "Not converged", number, text, (), last)


def _sensitivities(results: Results) -> Headline | None:
    said = verdict(results)
    rows = results.get("parameters")
    if not said or not isinstance(rows, list) or not isinstance(rows[0], Mapping):
        return None
    first = next((row for row in rows if row.get("name") != "pressure"), rows[0])
    return Headline(PLAIN, "Most depends on", str(first.get("name")), said[0])


def _sweep(results: Results) -> Headline | None:
    rows = results.get("rows")
    points = [r for r in rows if isinstance(r, Mapping)] if isinstance(rows, list) else []
    failed: Any = results.get("failed")
    if not points:
        return None
    done = [r["found"] for r in points if isinstance(r.get("found"), Mapping)]
    found = [one["critical_pressure"] for one in done if "critical_pressure" in one]
    values = sorted(value for value in found if _real(value) and value > 0)
    told = [f"Critical pressures from {_number(values[0])} to {_number(values[-1])}."] if values else []
    if results.get("of") in ("critical", "harmonics"):
        others = {"never stable": found.count(0), "stable up to the end of the search": found.count(None)}
        told += [f"{count} of {len(points)} {words}." for words, count in others.items() if count]
    text = " ".join(told)
    bad = isinstance(failed, int) and failed > 0
    marks = (Mark("Failed", f"{failed} of {len(points)}", OPEN),) if bad else ()
    return Headline(PLAIN, "Sweep", f"{len(points)} points", text, marks)
