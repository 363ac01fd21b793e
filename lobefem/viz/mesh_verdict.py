"""Do results depend on the mesh? Sentences on what several meshes show, from results.json."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from lobefem.units import pascals
from lobefem.viz.verdict_records import Results, divisions_of, entries_of, is_number, meshes_of

__all__ = ["checked", "eigenvalue_bars", "not_converged", "percent"]


def percent(share: float) -> str:
    """A relative error as a percentage of two digits, never less than 0.01 %."""
    return f"{max(100 * share, 0.01):.2g} %"


def checked(results: Results) -> str:
    """A sentence on what several meshes show."""
    rows = meshes_of(results)
    error: Any = results.get("mesh_error")
    meshes = f"{len(rows)} meshes" if rows else "several meshes"
    finest = f", the finest of {_mesh_name(rows[-1])}" if rows else ""
    if results.get("mesh_behaviour") == "falls":
        end = "no limit in sight, so do not use any of these numbers for design"
        return f"Mesh: checked on {meshes}{finest}: {end}."
    if not is_number(error):
        pressures = [row.get("critical_pressure") for row in rows if "critical_pressure" in row]
        if rows and pressures == [None] * len(rows):
            return f"Mesh: checked, the same on {meshes}{finest}."
        return f"Mesh: checked on {meshes}{finest}, which do not show a limit. Give finer --meshes."
    judged = [results, *entries_of(results)]  # of modes each pressure by itself
    law = all(entry.get("mesh_asymptotic", True) for entry in judged)
    doubt = "" if law else "; they do not follow one law of convergence yet, so the bar is a wide one"
    return f"Mesh: checked, ± {percent(error)} ({meshes}{finest}{doubt})."


def not_converged(results: Results) -> str:
    """A sentence on a critical pressure without a limit under mesh refinement, or without one yet."""
    rows = meshes_of(results)
    found = _listed([_or_none(row.get("critical_pressure")) for row in rows])
    on = _listed([_mesh_name(row).removesuffix(" divisions") for row in rows])
    falls = results.get("mesh_behaviour") == "falls"
    why = "it falls as the mesh is refined, with no limit in sight" if falls else "it has not converged"
    seams = ""
    if results.get("hoops") is None and isinstance(results.get("lobes"), int) and results["lobes"] > 1:
        seams = " Only film holds the seams, in a band one cell wide: give the balloon hoops."
    return (
        f"There is no critical pressure to quote{'' if falls else ' yet'}: {why} ({found} on {on} "
        f"divisions).{seams}"
    )


def eigenvalue_bars(entries: list[Mapping[str, Any]], results: Results) -> list[str]:
    """A sentence for each pressure on its lowest eigenvalue under mesh refinement."""
    said, unit = [], "N/m" if results.get("mass") == "nodal" else "Pa/m"
    rows = [row["lowest"] for row in meshes_of(results) if isinstance(row.get("lowest"), list)]
    for k, entry in enumerate(entries):
        limit: Any = entry.get("mesh_limit")
        error: Any = entry.get("mesh_error")
        at = pascals(entry["pressure"])
        values = [row[k] for row in rows if k < len(row) and is_number(row[k])]
        if not values or entry.get("mesh_behaviour") is None:
            continue
        path = _listed([f"{value:.4g}" for value in values])
        if min(values) <= 0 < max(values):
            said.append(
                f"At {at} the answer depends on the mesh: the lowest eigenvalue is {path} {unit} from coarse "
                "to fine."
            )
        elif is_number(limit) and is_number(error):
            said.append(f"Lowest eigenvalue at {at}: {limit:.4g} {unit} ± {percent(error)}.")
        else:
            falls = " It falls, with no limit in sight." if entry["mesh_behaviour"] == "falls" else ""
            said.append(f"Lowest eigenvalue at {at} from coarse to fine: {path} {unit}.{falls}")
    return said


def _mesh_name(row: Mapping[str, Any]) -> str:
    mesh = divisions_of(row)
    return f"{mesh[0]} x {mesh[1]} divisions" if mesh else f"size {row.get('size')} m"


def _listed(words: list[str]) -> str:
    return " and ".join([", ".join(words[:-1]), words[-1]]) if len(words) > 1 else "".join(words)


def _or_none(pressure: Any) -> str:
    return pascals(pressure) if is_number(pressure) else "none"
