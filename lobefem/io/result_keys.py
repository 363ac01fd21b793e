"""Meaning and units of the keys of results.json: one table for the documentation and for the tests.

A key in a list of records is written `pressures[].volume`; `sides.*` stands for any name.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from lobefem.outcomes import UNKNOWN

__all__ = ["COMMANDS", "COMMON", "described", "flat", "markdown"]

Entry = tuple[str, str]  # unit, "" where there is none; meaning

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


def _modes(at: str, what: str) -> dict[str, Entry]:
    return {
        f"{at}[].real": ("Pa/m", f"real part of the eigenvalue, {what}; in N/m with nodal mass"),
        f"{at}[].imag": ("Pa/m", "imaginary part; in N/m with nodal mass"),
        f"{at}[].residual": ("", "|K phi - lambda B phi| over |K phi|; 0 for a rigid rotation"),
        f"{at}[].harmonic": ("", "strongest harmonic n of the mode, its number of waves around the axis"),
        f"{at}[].harmonics": ("", "all harmonics with a tenth of the mode or more, strongest first"),
        f"{at}[].kind": (
            "",
            "sway, twist, global, local, or rigid rotation (a free motion without resistance)",
        ),
    }


def _trend(at: str, what: str) -> dict[str, Entry]:
    return {
        f"{at}.values": ("Pa", f"{what} on each mesh"),
        f"{at}.behaviour": ("", "behaviour under refinement: converges, falls or open"),
        f"{at}.limit": ("Pa", "limit of the fit p = limit + C h^order; null if open"),
        f"{at}.order": ("", "order of convergence of the fit"),
        f"{at}.uncertainty": ("Pa", "difference of the limit from that of four meshes; null if not known"),
        f"{at}.error": ("", "half of the error bar about the limit, relative; null without a limit"),
        f"{at}.asymptotic": ("", "true if the finest three meshes follow such a law, of order 0.5 to 2.5"),
    }


def _peaks(at: str, where: str) -> dict[str, Entry]:
    return {
        f"{at}max_stress": (
            "Pa",
            f"largest principal true stress of the film{where}, thickness as built, mean of a cell",
        ),
        f"{at}max_stress_place": ("m", "centre of the cell that has it, as meshed (x, y, z)"),
        f"{at}max_strain": (
            "",
            f"largest principal Green strain of the film{where}, with built-in strain, mean of a cell",
        ),
        f"{at}max_strain_place": ("m", "centre of the cell that has it, as meshed (x, y, z)"),
    }


_HOOPS: Entry = ("N", "mean tension of each hoop")

_BAR: Entry = ("N", "force in the bar, tension positive; null without a bar or with both rims fixed")

_GORES: Entry = ("", "number of gores; of pumpkins only, as all keys that name it")

_LOOKED_AT: Entry = ("", "harmonics that were looked at; of pumpkins only")


def _search() -> dict[str, Entry]:
    """Keys of a search along the inflated path of a pumpkin."""
    return {
        "gores": _GORES,
        "looked_at": _LOOKED_AT,
        "stable": (
            "Pa",
            "stretches of the path, from and to, on which all harmonics are stable; of pumpkins",
        ),
        "searched_from": ("Pa", "lowest pressure of the search; of pumpkins"),
        "searched_to": ("Pa", "highest pressure that the search came to; of pumpkins"),
        "crossings[].pressure": ("Pa", "where a harmonic loses or gains stability; of pumpkins"),
        "crossings[].harmonic": ("", "its harmonic"),
        "crossings[].lost": ("", "true if stability is lost there, false if it is gained"),
        "curves[].harmonic": ("", "harmonic n of a curve; of pumpkins"),
        "curves[].values": ("Pa/m", "its lowest eigenvalue at each pressure of visited"),
    }


_HARMONIC: Entry = ("", "harmonic n of the critical mode; null without one")

_BOUNDS: Entry = ("Pa", "lower and upper bound; tension-field film only")

_ERROR: dict[str, Entry] = {
    "mesh_error": (
        "",
        "half of the error bar that a mesh study found, relative; null where the mesh was not checked or "
        "there is no limit; of modes the largest of all pressures",
    ),
    "mesh_behaviour": (
        "",
        "converges, falls (no limit) or open (the meshes do not tell); null where the mesh was not checked",
    ),
}


def _limit(at: str, unit: str, what: str) -> dict[str, Entry]:
    return {
        f"{at}mesh_limit": (
            unit,
            f"{what} in the limit of fine meshes; null without one",
        ),
        f"{at}mesh_order": ("", "order of convergence, or of the fall; null where none is found"),
        f"{at}mesh_asymptotic": ("", "true if the finest three meshes follow one law, order 0.5 to 2.5"),
    }


_MESHES: dict[str, Entry] = {
    "mesh_tolerance": ("", "value of --tolerance; null without; this and the following of mesh studies only"),
    "meshes[].divisions": ("", "cells along a lobe and around; null on an unstructured mesh"),
    "meshes[].size": ("m", "size of the cells of an unstructured mesh; null otherwise"),
}

COMMANDS: dict[str, dict[str, Entry]] = {
    "inflate": {
        "pressure": ("Pa", "gas pressure; if the solve failed, that of the last converged state"),
        "prestress": ("Pa", "pressure whose meridional stress is built in"),
        "iterations": ("", "iterations of Newton's method in all"),
        "residual": ("N", "norm of the unbalanced forces (in N m for moments on the plates)"),
        "relative_residual": ("", "residual over the norm of the nodal forces of the pressure"),
        "volume": ("m^3", "enclosed by film and plates"),
        "reference_volume": ("m^3", "volume of the shape as drawn"),
        "strain_energy": ("J", "strain energy of film, cables and bar; null for film without an energy"),
        "max_displacement": (
            "m",
            "largest nodal displacement, without the tilt that a pinned support leaves free",
        ),
        "bar_force": _BAR,
        "hoop_tension": _HOOPS,
        **_peaks("", ""),
        "taut_area": ("m^2", "area of the undeformed film that is taut"),
        "wrinkled_area": ("m^2", "area of the undeformed film that is wrinkled"),
        "slack_area": ("m^2", "area of the undeformed film that is slack"),
        "num_dofs": ("", "number of displacement components of all nodes"),
        "steps": ("Pa", "pressures on the way at which Newton's method converged"),
        "gores": ("", "number of gores; this and what follows of pumpkins"),
        "diameter": ("m", "over the bulges"),
        "tendon_diameter": ("m", "over the tendons"),
        "height": ("m", "from fitting to fitting"),
        "stations": ("", "places along the tendon from the bottom, over its length, of the next two"),
        "tendon_tension": ("N", "by station"),
        "bulge_half_angle": ("rad", "half angle of a gore's arc by station"),
        "bulge_radius": ("m", "radius of a gore's arc by station"),
        "meridional_resultant": ("N/m", "mean true resultant of a layer along the gore, by station"),
        "hoop_resultant": ("N/m", "mean true resultant of a layer across the gore, by station"),
        "meridional_strain": ("", "mean strain along the gore, by station"),
        "hoop_strain": ("", "mean strain across the gore, by station"),
        "mass": ("kg", "of film, tendons, fittings and payload"),
        "lift": ("N", "pressure gradient times volume; null without a gradient"),
    },
    "modes": {
        "gores": _GORES,
        "looked_at": _LOOKED_AT,
        "pressures[].by_harmonic[].harmonic": ("", "harmonic n, one record for each; of pumpkins"),
        "pressures[].by_harmonic[].lowest": ("Pa/m", "its lowest eigenvalue; in N/m with nodal mass"),
        "state": ("", "ideal or inflated"),
        "mass": ("", "unit or nodal"),
        **_ERROR,
        **_MESHES,
        "meshes[].lowest": ("Pa/m", "lowest eigenvalue at each pressure; in N/m with nodal mass"),
        "pressures[].mesh_error": ("", "the same at this pressure"),
        "pressures[].mesh_behaviour": ("", "the same at this pressure"),
        **_limit("pressures[].", "Pa/m", "lowest eigenvalue"),
        "pressures[].pressure": ("Pa", "gas pressure; one record for each, in the order given"),
        **_modes("pressures[].modes", "lowest first"),
        "pressures[].stable": ("", "true if all real parts are positive, without those of rigid rotations"),
        "pressures[].verdict": (
            "",
            "stable, unstable, or undecided if the bounds of tension-field film lie on both sides of zero",
        ),
        "pressures[].symmetric": ("", "true if the tangent is symmetric"),
        "pressures[].asymmetry": ("", "max|K - K^T| over max|K|"),
        "pressures[].num_negative": (
            "",
            "negative eigenvalues in the whole spectrum, without rigid rotations; null if not symmetric",
        ),
        "pressures[].state_residual": (
            "",
            "residual of the state over the norm of the nodal forces of the pressure",
        ),
        "pressures[].volume": ("m^3", "enclosed by film and plates"),
        "pressures[].hoop_tension": _HOOPS,
        "pressures[].bar_force": _BAR,
        **_peaks("pressures[].", ""),
        "pressures[].bounds": (
            "Pa/m",
            "bounds of the least growth; only for the ideal state of tension-field film",
        ),
        **_modes("pressures[].mean_modes", "of the mean of both tangents, only there"),
        **_modes("pressures[].taut_modes", "of the taut tangent, only there"),
        "branches[].kind": (
            "",
            "kind of most modes of a branch, which follows a mode from pressure to pressure",
        ),
        "branches[].harmonic": ("", "strongest harmonic n of most modes of the branch"),
        "branches[].rank": ("", "0 for the lowest of its kind and harmonic, and so on"),
        "branches[].pressures": ("Pa", "pressures at which the branch is one of the modes"),
        "branches[].values": ("Pa/m", "real parts of the eigenvalue there; in N/m with nodal mass"),
        "branches[].members": ("", "at each pressure, the places of its modes in the list, from 0"),
        "branches[].mac": ("", "least MAC of its modes from one pressure to the next, 0 to 1"),
    },
    "critical": {
        **_search(),
        "chart[].harmonic": ("", "harmonic n, one record for each; of pumpkins"),
        "chart[].critical_pressure": (
            "Pa",
            "where it loses stability; null if not up to searched_to, 0 if it is never stable",
        ),
        "chart[].stable_from": ("Pa", "where it gains stability; null if it is stable from the start"),
        "state": ("", "ideal or inflated"),
        "critical_pressure": (
            "Pa",
            "pressure at which the balloon becomes unstable; null without one, see reason; of a mesh study "
            "that on the finest mesh",
        ),
        **_ERROR,
        **_limit("", "Pa", "critical pressure"),
        **_MESHES,
        "meshes[].critical_pressure": ("Pa", "critical pressure on that mesh; null without one"),
        "meshes[].harmonic": _HARMONIC,
        "meshes[].kind": ("", "kind of the critical mode"),
        "harmonic": _HARMONIC,
        "only_harmonic": ("", "value of --harmonic; null if all harmonics were searched; ideal state only"),
        "kind": ("", "kind of the critical mode: sway, twist, global or local"),
        "residual": ("", "residual of the critical mode"),
        "pressures": ("Pa", "critical pressures that were found, ascending; ideal state only"),
        **_peaks("", " at that pressure, or at the end of the search"),
        "what_if[].change": (
            "",
            "other assumption of --what-if, in words; first the design as given",
        ),
        "what_if[].settings.*": ("", "key and value of the design that are other"),
        "what_if[].critical_pressure": ("Pa", "critical pressure with it; null without one"),
        "what_if[].harmonic": _HARMONIC,
        "what_if[].kind": ("", "kind of the critical mode"),
        "what_if[].max_stress": ("Pa", "largest stress of the film there, or at the end of the search"),
        "what_if[].error": ("", "reason of a failure; null without one"),
        "hoop_tension": ("N", "mean tension of each hoop there"),
        "bar_force": (
            "N",
            "force in the bar there, tension positive; null without a bar or with both rims fixed",
        ),
        "strength_pressure": (
            "Pa",
            "pressure at which the film reaches its strength; null if it does not; with film.strength only",
        ),
        "bounds": _BOUNDS,
        "sides.*": (
            "Pa",
            "critical pressure of the wrinkled, the mean and the taut tangent; tension-field film only",
        ),
        "point": ("", "bifurcation or limit point; this and the following keys for inflated states only"),
        "projection": ("", "share of the load in the critical mode; above 0.01 it is a limit point"),
        "bracket": ("Pa", "a stable pressure and one that is unstable or has no equilibrium nearby"),
        "visited": ("Pa, Pa/m", "pressure and lowest real part of lambda, in the order found"),
        "limit": ("Pa", "highest pressure of the search"),
    },
    "harmonics": {
        **_search(),
        "state": ("", "inflated; of pumpkins, as the following keys of their critical mode and its state"),
        "kind": ("", "kind of the critical mode"),
        "residual": ("", "its residual"),
        "point": ("", "bifurcation or limit point"),
        "visited": ("Pa, Pa/m", "pressure and lowest eigenvalue of all harmonics"),
        "limit": ("Pa", "highest pressure of the search"),
        **_peaks("", " at that pressure, or at the end of the search"),
        "hoop_tension": ("N", "mean tension of a tendon there"),
        "bar_force": ("N", "null, for a pumpkin has no bar"),
        "strength_pressure": ("Pa", "pressure at which the film reaches its strength; null if it does not"),
        "chart[].stable_from": ("Pa", "where it gains stability; null if it is stable from the start"),
        "critical_pressure": ("Pa", "the lowest of all harmonics"),
        "harmonic": ("", "harmonic of the lowest critical pressure"),
        "bounds": _BOUNDS,
        "chart[].harmonic": ("", "harmonic n, the number of waves around the axis"),
        "chart[].critical_pressure": ("Pa", "critical pressure of the harmonic; null without one"),
        "chart[].kind": ("", "kind of its mode; empty without one"),
        "chart[].residual": ("", "residual of its mode"),
        "chart[].upper_bound": ("Pa", "upper bound, from the mean of both tangents; tension-field film only"),
    },
    "mesh-study": {
        **_ERROR,
        "meshes[].divisions": ("", "cells along a lobe and around"),
        "meshes[].critical_pressure": ("Pa", "lowest critical pressure on that mesh"),
        "meshes[].harmonic": ("", "harmonic of that pressure"),
        **_trend("lowest", "lowest critical pressure"),
        **_trend("low_harmonics.*", "critical pressure of that harmonic"),
        "continuum_of_one_lobe[].law": ("", "film law, for one lobe with fixed rims, without a mesh"),
        "continuum_of_one_lobe[].pressures.*": ("Pa", "critical pressure of that harmonic"),
        "continuum_of_one_lobe[].lowest": ("Pa", "lowest critical pressure of all harmonics"),
        "continuum_of_one_lobe[].unstable_from": (
            "",
            "harmonic from which on all are unstable at any pressure; null without one",
        ),
        "published": ("Pa", "published critical pressure; null without one"),
        "published_around": ("", "divisions around of a mesh that would give this pressure"),
        "verdict": ("", "summary in sentences"),
    },
    "sensitivities": {
        "pressure": ("Pa", "gas pressure of the state"),
        "gores": ("", "number of gores"),
        "harmonic": ("", "n of the eigenvalue and of the critical pressure"),
        "critical_pressure": ("Pa", "pressure at which n loses stability; null where it was not found"),
        "quantities.volume": ("m^3", "enclosed volume"),
        "quantities.film_area": ("m^2", "area of all layers of unstressed film"),
        "quantities.max_stress": ("Pa", "largest principal true stress of a cell"),
        "quantities.tendon_tension": ("N", "mean tension of a tendon"),
        "quantities.eigenvalue": ("Pa/m", "lowest eigenvalue of n"),
        "quantities.critical_pressure": ("Pa", "critical pressure of n; not there without one"),
        "parameters[].name": ("", "parameter, those with the largest effect on stability first"),
        "parameters[].step": ("", "change of the parameter"),
        "parameters[].changes.*": (
            "",
            "change of each quantity to the first order of that step, in the quantity's unit",
        ),
    },
    "perturb": {
        "distortion": ("", "distortion that was imposed"),
        "parameter": ("unit", "size of the distortion"),
        "unit": ("", "unit of the parameter: m or degrees"),
        "reaction_unit": ("", "unit of the reaction: N or N m"),
        "pressure": ("Pa", "gas pressure"),
        "contact": ("", "true if film and plates may touch"),
        "release": ("", "true if the balloon was released"),
        "volume_original": ("m^3", "volume of the pressurised balloon"),
        "volume_imposed": ("m^3", "volume at the end of the ramp"),
        "volume_final": ("m^3", "volume at rest"),
        "imposed_ratio": ("", "volume_imposed over volume_original"),
        "reaction": ("reaction_unit", "reaction of the constraint at the end of the ramp"),
        "outcome": (
            "",
            f"returned, distorted and stable, {UNKNOWN}, not an equilibrium; or under the constraint",
        ),
        "min_eigenvalue": ("Pa/m", "lowest real part at the end, without rigid rotations; null if unknown"),
        "eigenvalues": ("Pa/m", "lowest real parts at the end; only after a release"),
        "gores": ("", "number of gores; this and the next two only of pumpkins"),
        "symmetric_eigenvalue": ("Pa/m", "lowest one of the pressurised balloon before, of all harmonics"),
        "symmetric_harmonic": ("", "its harmonic n"),
        "pressure_final": ("Pa", "gas pressure at rest; this and what follows only after a release"),
        "volume_deficit": ("", "share of the original volume that the balloon at rest lacks"),
        "energy_above": (
            "J",
            "potential energy at rest less that of the original balloon; null under film load",
        ),
        "contact_force": ("N", "total contact force at rest; null without contact"),
        "contact_area": ("m^2", "area of one side of the film in contact at rest; null without contact"),
        "residual": ("", "residual at the end over the norm of the nodal forces of the pressure"),
        "first_contact": (
            "unit",
            "parameter at which film first touches; null without contact",
        ),
        "smallest_gap": (
            "m",
            "smallest gap between parts of the film that share no node; null without contact",
        ),
        "distance": ("m", "largest distance of a node from the undistorted shape; null without a release"),
        "rotation": ("rad", "angle of the rigid motion that was removed before"),
        "energy.strain": ("J", "gain in strain energy of film, cables and bar"),
        "energy.contact": ("J", "gain in contact energy"),
        "energy.pressure": ("J", "work of the gas"),
        "energy.constraint": ("J", "work of the constraint"),
        "energy.damping": ("J", "energy taken by the damping of the release"),
        "energy.euler": ("J", "the same as implicit Euler counts it"),
        "energy.closure": ("J", "energy that the balance does not account for"),
        "energy.error": ("", "closure over the largest term"),
        "history[].parameter": ("unit", "size of the distortion; one record for each accepted step"),
        "history[].reaction": ("reaction_unit", "reaction of the constraint; 0 in the release"),
        "history[].volume": ("m^3", "enclosed by film and plates"),
        "history[].mid_hoop_displacement": ("m", "sideways displacement of the centre of the middle hoop"),
        "history[].contact_force": ("N", "total contact force"),
        "history[].time": ("s", "time in the release; null in the ramp"),
        "history[].residual": ("", "unbalanced forces over the norm of the nodal forces of the pressure"),
        "history[].ledger.strain": ("J", "gain in strain energy from the pressurised balloon on"),
        "history[].ledger.contact": ("J", "gain in contact energy"),
        "history[].ledger.pressure": ("J", "work of the gas"),
        "history[].ledger.constraint": ("J", "work of the constraint"),
        "history[].ledger.damping": ("J", "energy taken by damping"),
        "history[].ledger.euler": ("J", "the same as implicit Euler counts it"),
    },
    "sweep": {
        "of": ("", "command of each point"),
        "varied": ("", "keys of the design and options that are varied"),
        "design_pressure": ("Pa", "pressure of the designs of all points; null if they have several"),
        "rows[].values.*": ("", "values of these at the point"),
        "rows[].folder": ("", "run folder of the point, relative to that of the sweep"),
        "rows[].exit_code": ("", "exit code of its process"),
        "rows[].reason": ("", "reason of a failure; empty without one"),
        "rows[].seconds": ("s", "time of the point"),
        "rows[].found.*": ("", "main results of the point, in the units of its results.json"),
        "rows[].warnings": ("", "warnings of the point"),
        "failed": ("", "number of points without a result"),
        **_ERROR,
        **_limit("", "Pa", "critical pressure"),
        "meshes[].divisions": ("", "cells along a lobe and around; of sweeps over nothing but the mesh"),
        "meshes[].critical_pressure": ("Pa", "critical pressure on that mesh; null without one"),
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
