"""Keys of results.json of studies: of the mesh, of small changes of a design, of many designs."""

from __future__ import annotations

from lobefem.io.shared_keys import ERROR, Entry, mesh_limit_at, trend_at

__all__ = ["MESH_STUDY", "SENSITIVITIES", "SWEEP"]

MESH_STUDY: dict[str, Entry] = {
    **ERROR,
    "meshes[].divisions": ("", "cells along a lobe and around"),
    "meshes[].critical_pressure": ("Pa", "lowest critical pressure on that mesh"),
    "meshes[].harmonic": ("", "harmonic of that pressure"),
    **trend_at("lowest", "lowest critical pressure"),
    **trend_at("low_harmonics.*", "critical pressure of that harmonic"),
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
}

SENSITIVITIES: dict[str, Entry] = {
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
}

SWEEP: dict[str, Entry] = {
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
    **ERROR,
    **mesh_limit_at("", "Pa", "critical pressure"),
    "meshes[].divisions": ("", "cells along a lobe and around; of sweeps over nothing but the mesh"),
    "meshes[].critical_pressure": ("Pa", "critical pressure on that mesh; null without one"),
}
