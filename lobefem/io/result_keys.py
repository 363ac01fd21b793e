"""Meaning and units of the keys of results.json: one table for the documentation and for the tests.

A key in a list of records is written `pressures[].volume`, one below names that are free `sides.*`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from lobefem.outcomes import UNKNOWN

__all__ = ["COMMANDS", "COMMON", "described", "flat", "markdown"]

Entry = tuple[str, str]  # unit, "" where there is none; meaning

COMMON: dict[str, Entry] = {
    "schema": ("", "version of these keys; it rises with a change that a reader must know of"),
    "command": ("", "what was run"),
    "version": ("", "of lobefem"),
    "versions.*": ("", "of all parts, lobefem's git revision (null outside of a checkout), number of ranks"),
    "warnings": ("", "sentences that a reader of the numbers must know"),
    "film": ("", "film law"),
    "load": ("", "film or closed"),
    "support": ("", "clamped, pinned or fixed"),
    "bar": ("N", "central bar between the end plates: rigid, its EA, or null without one"),
    "hoops": ("N", "EA of the hoops at the seams; null without hoops"),
    "lobes": ("", "number of lobes"),
    "radius": ("m", "of the design's shape: its R0, edge_radius or radius, as given"),
    "thickness": ("m", "of the film"),
    "strength": ("Pa", "stress at which the film breaks, as the design gives it; null without"),
    "divisions": ("", "cells along a lobe and around; null on a mesh without"),
    "converged": ("", "false where the solve failed; of inflate always there"),
    "reason": ("", "why a solve or a search ended, in words"),
    "error": ("", "the sentence of a failed solve; only then"),
    "profile.whole": ("s", "time of the run; profile with --profile only"),
    "profile.solve": ("s", "of that in solvers"),
    "profile.floor": ("s", "of that in factorisations and triangular solves"),
    "profile.stages.*.seconds": ("s", "in a stage, those within it left out"),
    "profile.stages.*.calls": ("", "of the stage"),
}


def _modes(at: str, what: str) -> dict[str, Entry]:
    return {
        f"{at}[].real": ("Pa/m", f"real part of the eigenvalue, {what}; in N/m with nodal mass"),
        f"{at}[].imag": ("Pa/m", "imaginary part; in N/m with nodal mass"),
        f"{at}[].residual": ("", "|K phi - lambda B phi| over |K phi|; 0 for a rigid rotation"),
        f"{at}[].harmonic": ("", "strongest circumferential harmonic n of the mode"),
        f"{at}[].harmonics": ("", "all with a tenth of the mode or more, strongest first"),
        f"{at}[].kind": ("", "sway, twist, global or local, or rigid rotation, which costs nothing"),
    }


def _trend(at: str, what: str) -> dict[str, Entry]:
    return {
        f"{at}.pressures": ("Pa", f"{what} on each mesh"),
        f"{at}.behaviour": ("", "converges, falls or open"),
        f"{at}.limit": ("Pa", "of p = limit + C h^order; null where it is open"),
        f"{at}.order": ("", "of the fit"),
        f"{at}.uncertainty": ("Pa", "of the limit; null where it is not known"),
    }


def _peaks(at: str, where: str) -> dict[str, Entry]:
    return {
        f"{at}max_stress": (
            "Pa",
            f"largest principal stress of the film{where}, thickness as built",
        ),
        f"{at}max_stress_place": ("m", "middle of the cell that has it, as meshed (x, y, z)"),
        f"{at}max_strain": ("", f"largest principal strain of the film{where}, built-in strain included"),
        f"{at}max_strain_place": ("m", "middle of the cell that has it, as meshed (x, y, z)"),
    }


_HOOPS: Entry = ("N", "mean tension of each hoop")

_BAR: Entry = ("N", "tension positive; null without a bar or with both rims held")

_HARMONIC: Entry = ("", "circumferential harmonic n of the critical mode, null without one")

_BOUNDS: Entry = ("Pa", "lower and upper bound, of tension-field film only")

COMMANDS: dict[str, dict[str, Entry]] = {
    "inflate": {
        "pressure": ("Pa", "gas pressure, that of the last converged state where the solve failed"),
        "prestress": ("Pa", "pressure whose meridional stress is built in"),
        "iterations": ("", "of Newton's method in all"),
        "residual": ("N", "norm of the unbalanced forces, N m for the plates' moments"),
        "relative_residual": ("", "the same over the norm of the pressure's nodal forces"),
        "volume": ("m^3", "enclosed by film and plates"),
        "strain_energy": ("J", "of film, cables and bar; null for film without an energy"),
        "max_displacement": (
            "m",
            "largest nodal displacement, without the tilt that a pinned support leaves free",
        ),
        "bar_force": _BAR,
        "hoop_tension": _HOOPS,
        **_peaks("", ""),
        "taut_area": ("m^2", "area of the undeformed film that is taut"),
        "wrinkled_area": ("m^2", "that is wrinkled"),
        "slack_area": ("m^2", "that is slack"),
        "num_dofs": ("", "displacement components of all nodes"),
        "steps": ("Pa", "pressures at which Newton's method converged on the way"),
    },
    "modes": {
        "state": ("", "ideal or inflated"),
        "mass": ("", "unit or nodal"),
        "pressures[].pressure": ("Pa", "gas pressure; one record for each, in the order given"),
        **_modes("pressures[].modes", "lowest first"),
        "pressures[].stable": ("", "whether all real parts are positive, those of rigid rotations left out"),
        "pressures[].verdict": (
            "",
            "stable, unstable, or undecided where tension-field film's bounds lie on both sides of zero",
        ),
        "pressures[].symmetric": ("", "whether the tangent is"),
        "pressures[].asymmetry": ("", "max|K - K^T| over max|K|"),
        "pressures[].num_negative": (
            "",
            "negative eigenvalues in the whole spectrum, rigid rotations left out; null if not symmetric",
        ),
        "pressures[].state_residual": ("", "of the state, over the norm of the pressure's nodal forces"),
        "pressures[].volume": ("m^3", "enclosed by film and plates"),
        "pressures[].hoop_tension": _HOOPS,
        "pressures[].bar_force": _BAR,
        **_peaks("pressures[].", ""),
        "pressures[].bounds": (
            "Pa/m",
            "bounds of the least growth, of tension-field film's ideal state only",
        ),
        **_modes("pressures[].mean_modes", "of the mean of both tangents, there only"),
        **_modes("pressures[].taut_modes", "of the taut tangent, there only"),
        "branches[].kind": ("", "of most of its modes; modes followed from pressure to pressure, if several"),
        "branches[].harmonic": ("", "strongest circumferential harmonic n of most of its modes"),
        "branches[].rank": ("", "0 for the lowest of its kind and harmonic, and so on"),
        "branches[].pressures": ("Pa", "at which it is one of the modes"),
        "branches[].values": ("Pa/m", "real parts of the eigenvalue there; in N/m with nodal mass"),
        "branches[].members": ("", "at each pressure, its modes' places in the list, from 0"),
        "branches[].mac": ("", "least MAC of its modes from one pressure to the next, 0 to 1"),
    },
    "critical": {
        "state": ("", "ideal or inflated"),
        "critical_pressure": ("Pa", "at which stability is lost; null where it is not, see reason"),
        "harmonic": _HARMONIC,
        "only_harmonic": ("", "what --harmonic asked for, null where all were looked at; of the ideal state"),
        "kind": ("", "of the critical mode: sway, twist, global or local"),
        "residual": ("", "of the critical mode"),
        "pressures": ("Pa", "critical pressures that were found, ascending; of the ideal state"),
        **_peaks("", " at that pressure, or where the search ended"),
        "hoop_tension": ("N", "mean tension of each hoop there"),
        "bar_force": ("N", "there, tension positive; null without a bar or with both rims held"),
        "strength_pressure": (
            "Pa",
            "at which the film reaches its strength; null where it is not reached; with film.strength only",
        ),
        "bounds": _BOUNDS,
        "sides.*": ("Pa", "of the wrinkled, the mean and the taut tangent; of tension-field film only"),
        "point": ("", "bifurcation or limit point; this and what follows of inflated states"),
        "projection": ("", "share of the load in the critical mode: above 0.01 it is a limit point"),
        "bracket": ("Pa", "a stable pressure and one that is unstable or has no equilibrium nearby"),
        "visited": ("Pa, Pa/m", "pressure and lowest real part of lambda, in the order found"),
        "limit": ("Pa", "where the search gives up"),
    },
    "harmonics": {
        "critical_pressure": ("Pa", "the lowest of all harmonics"),
        "harmonic": ("", "that has it"),
        "bounds": _BOUNDS,
        "chart[].harmonic": ("", "circumferential harmonic n"),
        "chart[].critical_pressure": ("Pa", "its critical pressure; null where none makes it unstable"),
        "chart[].kind": ("", "of its mode, empty without one"),
        "chart[].residual": ("", "of its mode"),
        "chart[].upper_bound": ("Pa", "of the mean of both tangents; of tension-field film only"),
    },
    "mesh-study": {
        "meshes[].divisions": ("", "cells along a lobe and around"),
        "meshes[].critical_pressure": ("Pa", "lowest on that mesh"),
        "meshes[].harmonic": ("", "that has it"),
        **_trend("lowest", "lowest critical pressure"),
        **_trend("low_harmonics.*", "critical pressure of that harmonic"),
        "continuum_of_one_lobe[].law": ("", "film law, for one lobe with its rims held, without a mesh"),
        "continuum_of_one_lobe[].pressures.*": ("Pa", "critical pressure of that harmonic"),
        "continuum_of_one_lobe[].lowest": ("Pa", "of all harmonics"),
        "continuum_of_one_lobe[].unstable_from": ("", "harmonic from which on none is stable; null if none"),
        "published": ("Pa", "critical pressure from elsewhere; null without one"),
        "published_around": ("", "divisions around of a mesh that would have it"),
        "verdict": ("", "what it all means, in sentences"),
    },
    "perturb": {
        "distortion": ("", "what was imposed"),
        "parameter": ("unit", "its size"),
        "unit": ("", "of the parameter: m or degrees"),
        "reaction_unit": ("", "of the reaction: N or N m"),
        "pressure": ("Pa", "gas pressure"),
        "contact": ("", "whether film and plates may touch"),
        "release": ("", "whether it was let go"),
        "volume_original": ("m^3", "of the pressurised balloon"),
        "volume_imposed": ("m^3", "at the end of the ramp"),
        "volume_final": ("m^3", "at rest"),
        "imposed_ratio": ("", "volume_imposed over volume_original"),
        "reaction": ("reaction_unit", "that holds the distortion at the end of the ramp"),
        "outcome": (
            "",
            f"returned, distorted and stable, {UNKNOWN}, not an equilibrium; or under the constraint",
        ),
        "min_eigenvalue": ("Pa/m", "lowest real part at the end, rigid rotations left out; null if unknown"),
        "residual": ("", "at the end, over the norm of the pressure's nodal forces"),
        "first_contact": (
            "unit",
            "parameter at which the film first touches; null without",
        ),
        "smallest_gap": ("m", "between parts of the film that share no node; null without contact"),
        "distance": ("m", "of a node from the undistorted shape, at most; null without a release"),
        "rotation": ("rad", "of the rigid motion that was taken out before"),
        "energy.strain": ("J", "gain of film, cables and bar"),
        "energy.contact": ("J", "of contact"),
        "energy.pressure": ("J", "work of the gas"),
        "energy.constraint": ("J", "work of what imposed the distortion"),
        "energy.damping": ("J", "taken by the release's damping"),
        "energy.euler": ("J", "the same by the time steps' own rule"),
        "energy.closure": ("J", "what is missing in the balance"),
        "energy.error": ("", "closure over the largest term"),
        "history[].parameter": ("unit", "one record for each accepted step"),
        "history[].reaction": ("reaction_unit", "0 in the release"),
        "history[].volume": ("m^3", "enclosed by film and plates"),
        "history[].mid_hoop_displacement": ("m", "sideways, of the middle hoop's centre"),
        "history[].contact_force": ("N", "in all"),
        "history[].time": ("s", "in the release; null in the ramp"),
        "history[].residual": ("", "unbalanced forces over the norm of the pressure's nodal forces"),
        "history[].ledger.strain": ("J", "gain in strain energy since the pressurised balloon"),
        "history[].ledger.contact": ("J", "gain in contact energy"),
        "history[].ledger.pressure": ("J", "work of the gas"),
        "history[].ledger.constraint": ("J", "work of the constraint"),
        "history[].ledger.damping": ("J", "taken by damping"),
        "history[].ledger.euler": ("J", "the same as implicit Euler counts it"),
    },
    "sweep": {
        "of": ("", "the command of each point"),
        "varied": ("", "keys of the design and options that vary"),
        "rows[].values.*": ("", "what the point has of them"),
        "rows[].folder": ("", "its run folder, below the sweep's"),
        "rows[].exit_code": ("", "of its process"),
        "rows[].reason": ("", "why it failed, empty where it did not"),
        "rows[].seconds": ("s", "that it took"),
        "rows[].found.*": ("", "some of its results.json, in the units there"),
        "rows[].warnings": ("", "what to know before believing it"),
        "failed": ("", "number of points without a result"),
    },
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
    return None


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
