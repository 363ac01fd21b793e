"""Keys of results.json that several commands have, each with its unit and its meaning.

A function gives those of one record, at a place such as `pressures[].`.
"""

from __future__ import annotations

__all__ = [
    "BAR",
    "BOUNDS",
    "ERROR",
    "GORES",
    "HARMONIC",
    "HOOPS",
    "LOOKED_AT",
    "MESHES",
    "Entry",
    "mesh_limit_at",
    "modes_at",
    "peaks_at",
    "pumpkin_search",
    "trend_at",
]

Entry = tuple[str, str]  # unit, "" where there is none; meaning


def modes_at(at: str, what: str) -> dict[str, Entry]:
    """Keys of the modes in a list."""
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


def trend_at(at: str, what: str) -> dict[str, Entry]:
    """Keys of the way that a pressure goes under mesh refinement."""
    return {
        f"{at}.values": ("Pa", f"{what} on each mesh"),
        f"{at}.behaviour": ("", "behaviour under refinement: converges, falls or open"),
        f"{at}.limit": ("Pa", "limit of the fit p = limit + C h^order; null if open"),
        f"{at}.order": ("", "order of convergence of the fit"),
        f"{at}.uncertainty": ("Pa", "difference of the limit from that of four meshes; null if not known"),
        f"{at}.error": ("", "half of the error bar about the limit, relative; null without a limit"),
        f"{at}.asymptotic": ("", "true if the finest three meshes follow such a law, of order 0.5 to 2.5"),
    }


def peaks_at(at: str, where: str) -> dict[str, Entry]:
    """Keys of the largest stress and strain of the film."""
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


HOOPS: Entry = ("N", "mean tension of each hoop")

BAR: Entry = ("N", "force in the bar, tension positive; null without a bar or with both rims fixed")

GORES: Entry = ("", "number of gores; of pumpkins only, as all keys that name it")

LOOKED_AT: Entry = ("", "harmonics that were looked at; of pumpkins only")


def pumpkin_search() -> dict[str, Entry]:
    """Keys of a search along the inflated path of a pumpkin."""
    return {
        "gores": GORES,
        "looked_at": LOOKED_AT,
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


HARMONIC: Entry = ("", "harmonic n of the critical mode; null without one")

BOUNDS: Entry = ("Pa", "lower and upper bound; tension-field film only")

ERROR: dict[str, Entry] = {
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


def mesh_limit_at(at: str, unit: str, what: str) -> dict[str, Entry]:
    """Keys of the limit that a mesh study finds."""
    return {
        f"{at}mesh_limit": (
            unit,
            f"{what} in the limit of fine meshes; null without one",
        ),
        f"{at}mesh_order": ("", "order of convergence, or of the fall; null where none is found"),
        f"{at}mesh_asymptotic": ("", "true if the finest three meshes follow one law, order 0.5 to 2.5"),
    }


MESHES: dict[str, Entry] = {
    "mesh_tolerance": ("", "value of --tolerance; null without; this and the following of mesh studies only"),
    "meshes[].divisions": ("", "cells along a lobe and around; null on an unstructured mesh"),
    "meshes[].size": ("m", "size of the cells of an unstructured mesh; null otherwise"),
}
