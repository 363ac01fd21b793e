"""Commands that solve nothing: files made of a run folder, and what a user looks up, units and materials."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lobefem.app import options
from lobefem.app.runner import loudness
from lobefem.app.tables import printable, show_rows
from lobefem.errors import InputError
from lobefem.io.materials import MATERIALS, NOTE
from lobefem.units import KINDS, scaled

__all__ = ["export", "materials", "report", "units"]


def report(
    context: typer.Context,
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Run folder, or a folder of run folders.")],
) -> None:
    """Write DIR/report.html, one page with everything that a run folder holds."""
    if context.obj.is_root:
        from lobefem.viz.report import write_report

        path = printable(write_report(folder))
        if not loudness(context)["quiet"]:
            print(f"The report is {path}")


def export(
    context: typer.Context,
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A run folder, or a folder of them.")],
    to: options.ExportKind,
) -> None:
    """Write the results of a run folder as tables (CSV) or as files for ParaView (VTU), one per pressure."""
    if context.obj.is_root:
        from lobefem.io.export import export as write

        for path in write(folder, to):
            if not loudness(context)["quiet"]:
                print(f"Written: {printable(path)}")


def units(quantity: options.Which = "") -> None:
    """List the units that design files and options accept.

    A number without a unit is in SI; the angle of an option is in degrees.
    """
    chosen = {name: kind for name, kind in KINDS.items() if quantity.lower() in name.lower()}
    if not chosen:
        raise InputError(f"{quantity!r} is no quantity with units; use {', '.join(KINDS)}")
    rows = [(name, kind.si, kind.example, ", ".join(kind.factors)) for name, kind in chosen.items()]
    show_rows([("quantity", "without a unit", "example", "units"), *rows])


def materials(name: options.Which = "") -> None:
    """List the materials that a design file may name, with typical values and their sources."""
    chosen = {known: one for known, one in MATERIALS.items() if name.lower() in known}
    if not chosen:
        raise InputError(f"{name!r} is no material here; use {', '.join(MATERIALS)}")
    rows = [
        (
            known,
            scaled(one.E, "Pa"),
            f"{one.nu:g}",
            f"{one.density:g} kg/m^3",
            scaled(one.strength, "Pa"),
            f"{one.title}: {one.source}",
        )
        for known, one in chosen.items()
    ]
    show_rows([("material", "E", "nu", "density", "strength", "source"), *rows])
    print(NOTE)
