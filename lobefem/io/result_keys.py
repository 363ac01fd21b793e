"""Meaning and units of the keys of results.json: one table for the documentation and for the tests.

A key in a list of records is written `pressures[].volume`; `sides.*` stands for any name.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from lobefem.io.critical_keys import CRITICAL, HARMONICS
from lobefem.io.perturb_keys import PERTURB
from lobefem.io.shared_keys import Entry
from lobefem.io.state_keys import INFLATE, MODES
from lobefem.io.study_keys import MESH_STUDY, SENSITIVITIES, SWEEP

__all__ = ["COMMANDS", "COMMON", "described", "flat", "markdown"]

COMMON: dict[str, Entry] = {
    "schema": ("", "version of these keys; it rises with every change that a reader must know about"),
    "command": ("", "command that was run"),
    "version": ("", "version of lobefem"),
    "versions.*": (
        "",
        "versions of all packages, git revision of lobefem (null outside a checkout), number of ranks",
    ),
    "warnings": ("", "warnings that a reader of the numbers must know"),
    "film": ("", "film law"),
    "load": ("", "surfaces under gas pressure: film, or closed (film and plates)"),
    "support": ("", "support of the plates: clamped, pinned or fixed; null without end plates"),
    "bar": ("N", "central bar between the end plates: rigid, its EA, or null without one"),
    "hoops": ("N", "EA of the hoops at the seams; null without hoops"),
    "lobes": ("", "number of lobes; null for the kind mesh"),
    "radius": ("m", "edge radius, or R0 or radius if the design gives that; null for the kind mesh"),
    "thickness": ("m", "thickness of the film"),
    "strength": ("Pa", "stress at which the film breaks, as in the design; null without one"),
    "divisions": ("", "cells along a lobe and around the axis; null on an unstructured mesh"),
    "converged": ("", "false if the solve failed; inflate always has it"),
    "reason": ("", "reason for which a solve or a search ended"),
    "error": ("", "message of a failed solve; there only then"),
    "profile.whole": ("s", "time of the whole run; profile is there with --profile only"),
    "profile.solve": ("s", "time in solvers"),
    "profile.floor": ("s", "time in factorisations and triangular solves"),
    "profile.stages.*.seconds": ("s", "time in a stage, without the stages within it"),
    "profile.stages.*.calls": ("", "calls of the stage"),
}

COMMANDS: dict[str, dict[str, Entry]] = {
    "inflate": INFLATE,
    "modes": MODES,
    "critical": CRITICAL,
    "harmonics": HARMONICS,
    "mesh-study": MESH_STUDY,
    "sensitivities": SENSITIVITIES,
    "perturb": PERTURB,
    "sweep": SWEEP,
}


def flat(results: Any, at: str = "") -> Iterator[str]:
    """The keys of results, those in lists of records as in `COMMANDS`."""
    if isinstance(results, Mapping):
        for key, value in results.items():
            key = str(key).replace(".", "_")  # a sweep's names have dots
            yield from flat(value, f"{at}.{key}" if at else key)
    elif isinstance(results, (list, tuple)) and results and isinstance(results[0], Mapping):
        for value in results:
            yield from flat(value, f"{at}[]")
    else:
        yield at


def described(command: str, key: str) -> str | None:
    """The key of `COMMON` or `COMMANDS` that says what a key of results means; None if there is none."""
    known = COMMON | COMMANDS.get(command, {})
    parts = key.split(".")
    for name in known:
        pattern = name.split(".")
        if len(pattern) == len(parts) and all(a in ("*", b) for a, b in zip(pattern, parts, strict=True)):
            return name
    # a list of records that is empty
    return next((name for name in known if name.startswith(f"{key}[].")), None)


def markdown() -> str:
    """The tables for the documentation."""
    said = ["Every command:", "", *_table(COMMON)]
    for command, keys in COMMANDS.items():
        name = "critical --mesh-study" if command == "mesh-study" else command
        said += ["", f"`{name}`:", "", *_table(keys)]
    return "\n".join(said) + "\n"


def _table(keys: Mapping[str, Entry]) -> Iterator[str]:
    yield from ("| key | unit | meaning |", "|---|---|---|")
    for key, (unit, meaning) in keys.items():
        yield f"| `{key}` | {unit} | {meaning.replace('|', chr(92) + '|')} |"
