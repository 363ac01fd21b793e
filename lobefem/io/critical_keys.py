"""Keys of results.json of `critical` and `harmonics`: searches for critical pressures."""

from __future__ import annotations

from lobefem.io.shared_keys import (
    BOUNDS,
    ERROR,
    HARMONIC,
    MESHES,
    Entry,
    mesh_limit_at,
    peaks_at,
    pumpkin_search,
)

__all__ = ["CRITICAL", "HARMONICS"]

CRITICAL: dict[str, Entry] = {
    **pumpkin_search(),
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
    **ERROR,
    **mesh_limit_at("", "Pa", "critical pressure"),
    **MESHES,
    "meshes[].critical_pressure": ("Pa", "critical pressure on that mesh; null without one"),
    "meshes[].harmonic": HARMONIC,
    "meshes[].kind": ("", "kind of the critical mode"),
    "harmonic": HARMONIC,
    "only_harmonic": ("", "value of --harmonic; null if all harmonics were searched; ideal state only"),
    "kind": ("", "kind of the critical mode: sway, twist, global or local"),
    "residual": ("", "residual of the critical mode"),
    "pressures": ("Pa", "critical pressures that were found, ascending; ideal state only"),
    **peaks_at("", " at that pressure, or at the end of the search"),
    "what_if[].change": (
        "",
        "other assumption of --what-if, in words; first the design as given",
    ),
    "what_if[].settings.*": ("", "key and value of the design that are other"),
    "what_if[].critical_pressure": ("Pa", "critical pressure with it; null without one"),
    "what_if[].harmonic": HARMONIC,
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
    "bounds": BOUNDS,
    "sides.*": (
        "Pa",
        "critical pressure of the wrinkled, the mean and the taut tangent; tension-field film only",
    ),
    "point": ("", "bifurcation or limit point; this and the following keys for inflated states only"),
    "projection": ("", "share of the load in the critical mode; above 0.01 it is a limit point"),
    "bracket": ("Pa", "a stable pressure and one that is unstable or has no equilibrium nearby"),
    "visited": ("Pa, Pa/m", "pressure and lowest real part of lambda, in the order found"),
    "limit": ("Pa", "highest pressure of the search"),
}

HARMONICS: dict[str, Entry] = {
    **pumpkin_search(),
    "state": ("", "inflated; of pumpkins, as the following keys of their critical mode and its state"),
    "kind": ("", "kind of the critical mode"),
    "residual": ("", "its residual"),
    "point": ("", "bifurcation or limit point"),
    "visited": ("Pa, Pa/m", "pressure and lowest eigenvalue of all harmonics"),
    "limit": ("Pa", "highest pressure of the search"),
    **peaks_at("", " at that pressure, or at the end of the search"),
    "hoop_tension": ("N", "mean tension of a tendon there"),
    "bar_force": ("N", "null, for a pumpkin has no bar"),
    "strength_pressure": ("Pa", "pressure at which the film reaches its strength; null if it does not"),
    "chart[].stable_from": ("Pa", "where it gains stability; null if it is stable from the start"),
    "critical_pressure": ("Pa", "the lowest of all harmonics"),
    "harmonic": ("", "harmonic of the lowest critical pressure"),
    "bounds": BOUNDS,
    "chart[].harmonic": ("", "harmonic n, the number of waves around the axis"),
    "chart[].critical_pressure": ("Pa", "critical pressure of the harmonic; null without one"),
    "chart[].kind": ("", "kind of its mode; empty without one"),
    "chart[].residual": ("", "residual of its mode"),
    "chart[].upper_bound": ("Pa", "upper bound, from the mean of both tangents; tension-field film only"),
}
