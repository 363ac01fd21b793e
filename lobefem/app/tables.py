"""Tables of results on the terminal."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Sequence
from typing import Any

from lobefem.terminal import console
from lobefem.units import pascals, scaled
from lobefem.viz.assumptions import assumptions
from lobefem.viz.sensitivity_table import sensitivity_table
from lobefem.viz.verdict import verdict

__all__ = ["printable", "show", "show_findings", "show_profile", "show_rows"]


def show(results: dict[str, Any]) -> None:
    """Print results on stdout: the verdict, a table, and what to check."""
    # as wide as the table wants where no terminal sets a limit
    screen = console(sys.stdout, 120)
    table = {
        "inflate": _inflate_table,
        "modes": _modes_table,
        "critical": _critical_table,
        "harmonics": _harmonics_table,
        "mesh-study": _study_table,
        "perturb": _perturb_table,
        "sensitivities": _sensitivities_table,
    }
    first, *more = verdict(results) or [""]
    if first.startswith("Unstable below") and more:  # of pumpkins, before up to where they are stable
        first, more = more[0], [first, *more[1:]]
    if first:
        screen.print(first, style="bold", markup=False, highlight=False, soft_wrap=True)
    screen.print(_caption(results))
    screen.print(table[results["command"]](results))
    for sentence in more:
        screen.print(sentence, markup=False, soft_wrap=True)


def _caption(results: dict[str, Any]) -> str:
    """The lines above a table."""
    if results["command"] == "inflate":
        title = f"Equilibrium at {pascals(results['pressure'])}"
    elif results["command"] == "modes":
        title = f"Lowest modes, {results['state']} state, {results['mass']} mass"
    elif results["command"] == "harmonics":
        title = f"Critical pressure of each harmonic, {results.get('state', 'ideal')} state"
    elif results["command"] == "perturb":
        title = f"{results['distortion']} of {results['parameter']:g} {results['unit']}".capitalize()
        title += f" at {pascals(results['pressure'])}, {results['outcome']}"
    elif results["command"] == "sensitivities":
        title = f"Sensitivities at {pascals(results['pressure'])}, n = {results['harmonic']}"
    elif results["command"] == "mesh-study":
        title = "Critical pressures under refinement, ideal state"
    else:
        title = f"Critical pressure of the {results['state']} state"
    lobes = (
        f"{results['gores']} gores"
        if "gores" in results
        else {None: "own mesh", 1: "1 lobe"}.get(results["lobes"], f"{results['lobes']} lobes")
    )
    mesh = "x".join(map(str, results["divisions"] or ())) or "unstructured"
    radius, thickness = results["radius"], scaled(results["thickness"], "m")
    size = "" if radius is None else f"radius {scaled(radius, 'm')}, "
    size += f"{thickness} of {results['film']} film"
    return f"{title}\n{lobes}, {size}, {mesh}\n{', '.join(assumptions(results))}"


def _table(*columns: str) -> Any:
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE)
    for column in columns:
        table.add_column(column, justify="right" if column else "left", no_wrap=True)
    return table


_QUANTITIES = (
    ("volume", "m^3"),
    ("strain_energy", "J"),
    ("max_displacement", "m"),
    ("bar_force", "N"),
    ("hoop_tension", "N"),
    ("max_stress", "Pa"),
    ("max_stress_place", "m"),
    ("max_strain", ""),
    ("max_strain_place", "m"),
    ("taut_area", "m^2"),
    ("wrinkled_area", "m^2"),
    ("slack_area", "m^2"),
    ("residual", "N"),
    ("iterations", ""),
    ("num_dofs", ""),
)


_OF_PUMPKINS = (
    ("diameter", "m"),
    ("tendon_diameter", "m"),
    ("height", "m"),
    ("mass", "kg"),
    ("lift", "N"),
)


def _inflate_table(results: dict[str, Any]) -> Any:
    if "gores" not in results:
        return _quantities(results, _QUANTITIES)
    # the cables of a pumpkin are its tendons, whose tension is shown by place
    quantities = [quantity for quantity in _QUANTITIES if quantity[0] != "hoop_tension"]
    table = _quantities(results, (*quantities, *_OF_PUMPKINS))
    tension, angles = results["tendon_tension"], [math.degrees(a) for a in results["bulge_half_angle"]]
    for name, of, unit in (("tendon tension", tension, "N"), ("bulge half angle", angles, "degrees")):
        text = ", ".join(scaled(value, unit) for value in (of[0], of[len(of) // 2], of[-1]))
        table.add_row(f"{name}, bottom middle top", text)
    return table


def _sensitivities_table(results: dict[str, Any]) -> Any:
    table = _table(*sensitivity_table(results)[0])
    for row in sensitivity_table(results)[1]:
        table.add_row(*row)
    return table


def _quantities(results: dict[str, Any], quantities: Iterable[tuple[str, str]]) -> Any:
    table = _table("", "value")
    for key, unit in quantities:
        value = results.get(key)
        if value is None or value == ():
            continue
        values = value if isinstance(value, tuple) else (value,)
        said = ", ".join(str(v) if isinstance(v, int) else scaled(v, unit) for v in values)
        name = "tendon_tension" if key == "hoop_tension" and "gores" in results else key
        table.add_row(name.replace("_", " "), said)
    return table


def _modes_table(results: dict[str, Any]) -> Any:
    unit = "Pa/m" if results["mass"] == "unit" else "N/m"
    table = _table("pressure", "mode", f"real [{unit}]", f"imag [{unit}]", "harmonic", "kind", "residual")
    for entry in results["pressures"]:
        for k, mode in enumerate(entry["modes"], 1):
            table.add_row(
                pascals(entry["pressure"]) if k == 1 else "",
                str(k),
                f"{mode['real']:.4g}",
                f"{mode['imag']:.3g}" if mode["imag"] else "",
                str(mode["harmonic"]),
                mode["kind"],
                f"{mode['residual']:.0e}",
            )
        verdict = entry.get("verdict", "stable" if entry["stable"] else "unstable")
        stress = entry.get("max_stress")
        said = () if stress is None else ("", "", "film up to", scaled(stress, "Pa"))
        table.add_row("", "", verdict, *said, end_section=True)
    return _group(table, *_meshes_tables(results))


def _critical_table(results: dict[str, Any]) -> Any:
    path = "projection" in results
    table = _table("pressure", "harmonic", "kind", *(("point", "load's share") if path else ()))
    rest = [""] * (len(table.columns) - 1)
    if not results["critical_pressure"] or results["kind"] is None:
        table.add_row(results["reason"], *rest)
    else:
        pressure = pascals(results["critical_pressure"])
        more = (results["point"], f"{results['projection']:.1e}") if path else ()
        table.add_row(pressure, str(results["harmonic"]), results["kind"], *more)
    for name, own in results.get("sides", {}).items():
        said = "none" if own is None else pascals(own)
        table.add_row(f"{name}: {said}", *rest)
    keys = ("max_stress", "max_strain", "hoop_tension", "bar_force")
    quantities = [q for q in _QUANTITIES if q[0] in keys]
    borne = [_quantities(results, quantities)] if "max_stress" in results else []
    return _group(table, *borne, *_meshes_tables(results), *_what_if_tables(results))


def _what_if_tables(results: dict[str, Any]) -> list[Any]:
    """The table of answers with other assumptions, if they were asked for."""
    rows = results.get("what_if")
    if not rows:
        return []
    table = _table("what if", "critical pressure", "change", "harmonic", "kind", "max stress")
    given = rows[0]["critical_pressure"]
    for row in rows:
        found, stress = row["critical_pressure"], row["max_stress"]
        pressure = "failed" if row["error"] else "none found" if found is None else pascals(found)
        change = f"{100 * (found / given - 1):+.3g} %" if found and given and row is not rows[0] else ""
        words = ["" if row[key] is None else str(row[key]) for key in ("harmonic", "kind")]
        table.add_row(row["change"], pressure, change, *words, "" if stress is None else scaled(stress, "Pa"))
    return [table]


def _meshes_tables(results: dict[str, Any]) -> list[Any]:
    """The table of a mesh study's answers, if there was one."""
    rows = results.get("meshes")
    if not rows:
        return []
    unit = "Pa/m" if results.get("mass") != "nodal" else "N/m"
    pressures = [f"lowest at {pascals(e['pressure'])} [{unit}]" for e in results.get("pressures") or ()]
    critical = "critical_pressure" in rows[0]
    table = _table("mesh", *(("critical pressure", "harmonic", "kind") if critical else pressures))
    for row in rows:
        mesh = "x".join(map(str, row["divisions"])) if row["divisions"] else f"{row['size']:.3g} m"
        if critical:
            found = row["critical_pressure"]
            words = ["none" if found is None else pascals(found)]
            words += ["" if row[key] is None else str(row[key]) for key in ("harmonic", "kind")]
        else:
            words = [f"{value:.4g}" for value in row["lowest"]]
        table.add_row(mesh, *words)
    return [table]


def _group(*tables: Any) -> Any:
    from rich.console import Group

    return tables[0] if len(tables) == 1 else Group(*tables)


def _study_table(results: dict[str, Any]) -> Any:
    table = _table("mesh", "pressure", "harmonic")
    for row in results["meshes"]:
        mesh = "x".join(map(str, row["divisions"]))
        table.add_row(mesh, pascals(row["critical_pressure"]), str(row["harmonic"]))
    return table


def _gores_table(results: dict[str, Any]) -> Any:
    """The critical pressures by harmonic of a pumpkin; neighbours that are just stable share a row."""
    table = _table("harmonic", "stable from", "stable up to", "lowest")
    same: list[int] = []

    def close() -> None:
        if same:
            said = f"{same[0]}" if len(same) == 1 else f"{same[0]} to {same[-1]}"
            table.add_row(said, "", f"{pascals(results['searched_to'])} at least", "")
            same.clear()

    for row in results["chart"]:
        pressure, gained = row["critical_pressure"], row["stable_from"]
        if pressure is None and gained is None:
            same.append(row["harmonic"])
            continue
        close()
        end = f"{pascals(results['searched_to'])} at least" if pressure is None else pascals(pressure)
        lowest = "<--" if row["harmonic"] == results["harmonic"] else ""
        begin = "" if gained is None else pascals(gained)
        table.add_row(str(row["harmonic"]), begin, end if pressure != 0 else "never stable", lowest)
    close()
    return table


def _harmonics_table(results: dict[str, Any]) -> Any:
    if "gores" in results:
        return _gores_table(results)
    sides = any("upper_bound" in row for row in results["chart"])
    last = ("upper bound",) if sides else ()
    table = _table("harmonic", "pressure", "kind", "residual", "lowest", *last)
    for row in results["chart"]:
        pressure = row["critical_pressure"]
        said = "never unstable" if math.isinf(pressure) else pascals(pressure)
        if pressure == 0:
            said = "0" if row.get("upper_bound", 0) else "unstable at any"
        error = f"{row['residual']:.0e}" if row["kind"] else ""
        first = "<--" if row["harmonic"] == results["harmonic"] and row["kind"] else ""
        bound = row.get("upper_bound", math.inf)
        upper = ("none" if math.isinf(bound) else pascals(bound),) if sides else ()
        table.add_row(str(row["harmonic"]), said, row["kind"], error, first, *upper)
    return table


def show_profile(profile: dict[str, Any]) -> None:
    """Print where the time went on stderr: stages exclusive of each other, of rank 0."""
    whole = profile["whole"]
    table = _table("stage", "seconds", "share", "calls")
    for name, entry in profile["stages"].items():
        seconds, calls = entry["seconds"], entry["calls"]
        if seconds > 0:
            table.add_row(name, f"{seconds:.3f}", f"{seconds / whole:.0%}", str(calls or ""))
    table.add_section()
    table.add_row("whole", f"{whole:.3f}", "100%", "")
    screen = console(sys.stderr, 120)
    screen.print(table)
    if profile["floor"] > 0:
        floor = profile["floor"]
        screen.print(
            f"Floor, the numeric factorisations and triangular solves: {floor:.3f} s; the solve takes "
            f"{profile['solve'] / floor:.2f}, the whole {whole / floor:.2f} times as long."
        )


def show_rows(rows: Sequence[Sequence[str]]) -> None:
    """Print a sweep's table on stdout, its head first."""
    used = [k for k, name in enumerate(rows[0]) if name != "reason" or any(row[k] for row in rows[1:])]
    table = _table(*(rows[0][k].replace("_", " ") for k in used))
    if used[-1] == len(rows[0]) - 1 and rows[0][-1] in (
        "reason",
        "source",
        "units",
        "note",
    ):  # sentences, lists
        table.columns[-1].justify, table.columns[-1].no_wrap = "left", False
    for row in rows[1:]:
        table.add_row(*(row[k] for k in used))
    console(sys.stdout, 160).print(table)


def show_findings(findings: Sequence[Any]) -> None:
    """Print what `lobefem doctor` found on stdout."""
    screen = console(sys.stdout, 120)
    for finding in findings:
        mark = "[green]ok  [/green]" if finding.fine else "[bold red]FAIL[/bold red]"
        screen.print(f"{mark} {finding.name:16}", end="")
        screen.print(printable(finding.found), markup=False)
        if finding.advice:
            screen.print(f"{'':21}-> {printable(finding.advice)}", markup=False)


def _perturb_table(results: dict[str, Any]) -> Any:
    table = _table("", "value", "")
    table.columns[2].justify = "left"
    energy = results["energy"]
    unit, force = results["unit"], results["reaction_unit"]
    rows = [
        ("volume, original", results["volume_original"], "m^3", ""),
        ("volume, imposed", results["volume_imposed"], "m^3", f"{results['imposed_ratio']:.5f} of it"),
        ("volume, final", results["volume_final"], "m^3", ""),
        ("reaction at the end of the ramp", results["reaction"], force, ""),
        ("first contact", results["first_contact"], unit, ""),
        ("smallest gap", results["smallest_gap"], "m", ""),
        *_at_rest(results),
        ("lowest eigenvalue", results["min_eigenvalue"], "Pa/m", ""),
        ("residual of the load", results["residual"], "", ""),
        ("work of the constraint", energy["constraint"], "J", ""),
        ("work of the gas", energy["pressure"], "J", ""),
        ("gain in strain energy", energy["strain"], "J", ""),
        ("contact energy", energy["contact"], "J", ""),
        ("taken by damping", energy["damping"], "J", ""),
        ("not accounted for", energy["closure"], "J", f"{100 * energy['error']:.2g} %"),
    ]
    for name, value, one, more in rows:
        table.add_row(name, *(("none", "") if value is None else (scaled(value, one), more)))
    return table


def _at_rest(results: dict[str, Any]) -> list[tuple[str, Any, str, str]]:
    """The rows of a balloon that was released, beside the original one."""
    rows = []
    if "symmetric_eigenvalue" in results:
        harmonic = f"n = {results['symmetric_harmonic']}"
        rows.append(("lowest eigenvalue before", results["symmetric_eigenvalue"], "Pa/m", harmonic))
    if "volume_deficit" in results:
        rows += [
            ("pressure, final", results["pressure_final"], "Pa", ""),
            ("volume deficit", 100 * results["volume_deficit"], "%", ""),
            ("energy above the original", results["energy_above"], "J", ""),
            ("contact force, final", results["contact_force"], "N", ""),
            ("contact area, final", results["contact_area"], "m^2", ""),
        ]
    return rows


def printable(words: object) -> str:
    """Words with what no terminal should get, in names of files for example, escaped."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in str(words))
