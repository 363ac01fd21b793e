"""Pumpkin balloons of design files: what goes together, gores and their tables, and the balloon itself.

Functions of a `Design`; those that check raise `ValueError` as its sections do.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from lobefem.errors import LobefemError
from lobefem.io.design_tables import GRAVITY, Tables
from lobefem.io.design_values import fill, listed
from lobefem.typing import Comm
from lobefem.units import LENGTH, NUMBER, Quantity, shown

if TYPE_CHECKING:
    from lobefem.fem.balloon import Balloon
    from lobefem.geometry.station_table import StationTable
    from lobefem.geometry.surface import Surface
    from lobefem.io.design_sections import Film
    from lobefem.model.film import Film as FilmLaw
    from lobefem.typing import Convention, Support

__all__ = [
    "balloon",
    "complete",
    "foreshortening",
    "layers",
    "orthotropic",
    "refuse",
    "surface",
    "with_tables",
]

_LAWS = ("isotropic", "orthotropic", "tension-field")

_MOST_BYTES = 100_000  # of a gore's table


# --- checks ---------------------------------------------------------------------------------------
def refuse(design: Tables) -> None:
    """Refuse what only a pumpkin has, for other shapes, with a ValueError."""
    for section in ("tendons", "fittings", "cleft"):
        if section in design.model_fields_set:
            raise ValueError(
                f"[{section}] are those of a pumpkin, not of the kind {design.shape.kind!r}; leave them out"
            )
    film = design.film
    for key in ("E1", "density", "caps"):
        if getattr(film, key) is not None:
            raise ValueError(
                f"film.{key} = {shown(getattr(film, key))} is that of a pumpkin, not of the kind "
                f"{design.shape.kind!r}; leave it out"
            )


def complete(design: Tables) -> None:
    """Put a pumpkin's own defaults where nothing is given; refuse what does not fit, with a ValueError."""
    _fill_in(design, "mesh", divisions=(48, 8), cell="quadrilateral", order=2)
    _fill_in(design, "film", law="tension-field")
    _fill_in(design, "plates", bar=False)
    _fill_in(design, "pressure", load="closed")
    mesh, film, plates = design.mesh, design.film, design.plates
    if mesh.layout != "structured":
        raise ValueError("mesh.layout = 'unstructured' does not fit a pumpkin; give divisions of one gore")
    if mesh.diagonals != "same":
        raise ValueError(
            f"mesh.diagonals = {mesh.diagonals!r} does not fit a pumpkin, whose gores are their own mirror "
            "images; leave it out"
        )
    if film.law not in _LAWS:
        raise ValueError(f"film.law = {film.law!r} does not fit a pumpkin; use {listed(_LAWS)}")
    if film.is_orthotropic and film.law == "isotropic":
        raise ValueError(
            "film.law = 'isotropic' is not that of E1 and E2; use 'orthotropic' or 'tension-field'"
        )
    if design.hoops.enabled:
        raise ValueError(
            "hoops.enabled = true does not fit a pumpkin, which has [tendons]; leave [hoops] out"
        )
    if plates.bar is not False:
        raise ValueError(
            f"plates.bar = {str(plates.bar).lower()} does not fit a pumpkin, which has no bar; leave it out"
        )
    try:
        curve, _ = design.curve, design.gore
    except LobefemError as error:
        raise ValueError(f"shape: {error}") from None
    gas, fittings = design.pressure, design.fittings
    weight, lift = GRAVITY * fittings.payload, gas.gradient * curve.volume
    if gas.gradient > 0 and weight > lift:
        raise ValueError(
            f"fittings.payload = {fittings.payload:g} kg weighs {weight:.4g} N, more than the lift of "
            f"{lift:.4g} N of {curve.volume:.4g} m^3; give a lighter one, a larger balloon or a larger "
            "pressure.gradient"
        )


def _fill_in(design: Tables, section: str, **defaults: Any) -> None:
    """Defaults of a section, a copy of which takes its place: it may be part of another design."""
    own = getattr(design, section)
    missing = {key: value for key, value in defaults.items() if key not in own.model_fields_set}
    own = own.model_copy()
    for key, value in missing.items():
        fill(own, key, value)
    fill(design, section, own)


# --- tables in files ---------------------------------------------------------------------------------
def with_tables(tables: dict[str, Any], path: Path) -> tuple[dict[str, Any] | None, str]:
    """A design's tables with the numbers of files beside it.

    Those are the files that `shape.pattern` and `tendons.foreshortening` name.

    Returns:
        the tables and "", or None and what is wrong with a file, in one sentence.
    """
    shape, tendons = tables.get("shape"), tables.get("tendons")
    if isinstance(shape, dict) and isinstance(shape.get("pattern"), str):
        if shape.get("lobe") != "table":
            return None, f"{path}: shape.pattern needs lobe = 'table'; give it, or leave pattern out"
        advice = "write a station from 0 to 1 and a half-width in metres a line, as 0.5, 0.6528"
        rows, fault = _read(path, "shape.pattern", shape["pattern"], LENGTH, advice)
        if fault:
            return None, fault
        table = {"stations": [row[0] for row in rows], "half_widths": [row[1] for row in rows]}
        rest = {key: value for key, value in shape.items() if key != "pattern"}
        tables = tables | {"shape": rest | table}
    given = tendons.get("foreshortening") if isinstance(tendons, dict) else None
    if isinstance(given, str) and given.lower().endswith(".csv"):
        advice = "write a station from 0 to 1 and a share of the tendon's length a line, as 0.5, 0.01"
        rows, fault = _read(path, "tendons.foreshortening", given, NUMBER, advice)
        if fault:
            return None, fault
        shares = [[station, share] for station, share in rows]
        tables = tables | {"tendons": dict(tendons or {}) | {"foreshortening": shares}}
    return tables, ""


def _read(
    path: Path, key: str, name: str, kind: Quantity, advice: str
) -> tuple[list[tuple[float, float]], str]:
    """The rows of a file beside a design, and what is wrong with it, in one sentence."""
    file = path.parent / name
    if file.exists() and not file.is_file():  # a pipe would be waited for
        return [], f"{path}: {key} = {shown(name)} is no file; give one beside the design"
    try:
        with file.open("rb") as stream:
            content = stream.read(_MOST_BYTES + 1)
        lines = content.decode("utf-8-sig").splitlines()
    except OSError as error:
        why = f"cannot be read ({error.strerror}); give a file beside the design"
        return [], f"{path}: {key} = {shown(name)} {why}"
    except UnicodeDecodeError:
        lines, content = [], b""
    rows, fault = _rows(lines, kind) if 0 < len(content) <= _MOST_BYTES else ([], "is no table of text")
    if not fault and len(rows) < 2:
        fault = "has less than two rows"
    return rows, f"{file} {fault}; {advice}" if fault else ""


def _rows(lines: list[str], kind: Quantity) -> tuple[list[tuple[float, float]], str]:
    """Pairs of numbers, without comments and a heading; and what is wrong."""
    rows: list[tuple[float, float]] = []
    for number, line in enumerate(lines, 1):
        parts = [part.strip() for part in line.partition("#")[0].split(",")]
        if parts == [""]:
            continue
        try:
            station, value = parts
            rows.append((NUMBER.read(station), kind.read(value)))
        except ValueError:
            if rows or any(character.isdigit() for character in line):
                return [], f"has no pair of numbers in line {number}"
    return rows, ""


# --- building -----------------------------------------------------------------------------------------
def surface(design: Tables, comm: Comm, sector: bool) -> Surface:
    """The meshed film of one gore, or of all. Collective.

    Args:
        design: a pumpkin's.
        comm: MPI communicator of all gores (default: all ranks).
        sector: one gore, whole on every rank.
    """
    import lobefem.linalg.dolfinx_compat  # noqa: F401  first: it finds the stack

    # isort: split
    from lobefem.geometry.pumpkin import PumpkinRecipe

    from mpi4py import MPI

    mesh = design.mesh
    assert mesh.divisions is not None
    recipe = PumpkinRecipe(design.gore, mesh.divisions, mesh.cell, mesh.order, mesh.grading, full=not sector)
    return recipe.surface(MPI.COMM_WORLD if comm is None else comm)


def balloon(design: Tables, surface: Surface, film: FilmLaw, touching: Sequence[Any] = ()) -> Balloon:
    """Film, gas, tendons, fittings and further parts; the bottom fitting is held. Collective."""
    from lobefem.fem.balloon import Balloon
    from lobefem.model.cables import Tendons
    from lobefem.model.dead_weight import DeadWeight
    from lobefem.model.end_plates import EndPlates, PlateLoad
    from lobefem.model.gas_pressure import GasPressure

    gas, plates, tendons, fittings = design.pressure, design.plates, design.tendons, design.fittings
    components: list[Any] = [
        *touching,
        GasPressure(cast("Convention", gas.load), gradient=gas.gradient, level=gas.level),
        Tendons(EA=tendons.EA, foreshortening=foreshortening(design)),
        EndPlates(support=cast("Support", plates.support), bar=False, lift=plates.lift),
    ]
    layer = GRAVITY * (design.film.density or 0.0) * design.film.thickness
    rope = GRAVITY * tendons.mass_per_length
    if layer or rope:
        components.append(DeadWeight(film=layer, cables=rope))
    if fittings.mass[1] and plates.support != "fixed":  # of one gore its share
        components.append(PlateLoad(force=(0.0, 0.0, -GRAVITY * fittings.mass[1])))
    pattern = surface.recipe.pattern(surface) if design.shape.reference == "flat" else None
    return Balloon(surface, film, components, pattern=pattern, layers=layers(design, surface))


def foreshortening(design: Tables) -> float | StationTable:
    """The tendons' foreshortening: a share of their length, or a table along them."""
    from lobefem.geometry.station_table import StationTable

    given = design.tendons.foreshortening
    if not isinstance(given, tuple):
        return float(given)
    stations, shares = zip(*given, strict=True)
    return StationTable(design.curve, stations, shares)


def layers(design: Tables, surface: Surface) -> Any:
    """Number of layers in each cell, a mean where a cap ends in it; None without caps."""
    import numpy as np

    from dolfinx import fem

    if not design.film.caps:
        return None
    grid = surface.recipe.grid
    s = grid.s[grid.cells]
    low, high = s.min(axis=1), s.max(axis=1)
    count = np.ones(len(s))
    for cap in sorted(design.film.caps, key=lambda cap: cap.layers):
        end = design.curve.arc_length - cap.length
        share = np.clip((high - end) / (high - low), 0.0, 1.0)
        count += share * (cap.layers - count)
    field = fem.Function(fem.functionspace(surface.mesh, ("DG", 0)), name="layers")
    field.x.array[:] = count[np.asarray(surface.mesh.topology.original_cell_index) % len(grid.cells)]
    return field


def masses(design: Tables, balloon: Balloon) -> float:
    """Mass of film, tendons, fittings and payload of the whole balloon [kg]. Collective."""
    tendons, fittings, gores = design.tendons, design.fittings, design.shape.gores
    assert gores is not None
    area = (
        balloon.forms.area_of_film if balloon.layers is None else balloon.layers * balloon.forms.area_of_film
    )
    film = balloon.surface.copies * balloon.integrate(area * balloon.dx)
    given = foreshortening(design)
    rope = gores * design.curve.arc_length * (1 - (given.mean if callable(given) else given))
    return (
        (design.film.density or 0.0) * design.film.thickness * film
        + tendons.mass_per_length * rope
        + sum(fittings.mass)
        + fittings.payload
    )


def orthotropic(film: Film) -> FilmLaw:
    """The law of film with moduli of its own along and across."""
    from lobefem.model.orthotropic import Orthotropic, OrthotropicTensionField

    material = {"E1": film.E1, "E2": film.E2, "nu12": film.nu12, "G12": film.G12, "thickness": film.thickness}
    if film.law == "orthotropic":
        return Orthotropic(**material)  # type: ignore[arg-type]
    return OrthotropicTensionField(**material, slack_stiffness=film.slack_stiffness)  # type: ignore[arg-type]
