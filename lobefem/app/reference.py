"""Commands that judge no balloon: on run folders, design files, gores, units, materials, the installation."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from lobefem.app import design_options, options, output_options, parsing, run_options
from lobefem.app.progress_bar import reporting
from lobefem.app.runner import loudness, overridden
from lobefem.app.tables import printable, show_rows
from lobefem.errors import InputError
from lobefem.io.materials import MATERIALS, NOTE
from lobefem.units import KINDS, scaled

__all__ = [
    "check",
    "doctor",
    "export",
    "gores",
    "materials",
    "new",
    "plot",
    "report",
    "schema",
    "units",
]


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
    to: output_options.ExportKind,
) -> None:
    """Write the results of a run folder as tables (CSV), as a workbook (XLSX), or for ParaView (VTU)."""
    if context.obj.is_root:
        from lobefem.io.export import export as write

        for path in write(folder, to):
            if not loudness(context)["quiet"]:
                print(f"Written: {printable(path)}")


def new(
    context: typer.Context,
    name: Annotated[str, typer.Argument(metavar="[NAME]", help="One of --list.")] = "",
    listed: Annotated[bool, typer.Option("--list", help="List the designs that come with lobefem.")] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Write the design, what it reads and the JSON schema into a folder."
        ),
    ] = None,
) -> None:
    """Print a design file to start from: [bold]lobefem new stack4 > mine.toml[/bold]."""
    from lobefem.io.shipped_designs import copy_design, needed_files, read_design, shipped_designs

    if listed or not name:
        if name or out is not None:
            raise InputError("--list stands alone, and --out needs the name of a design; give one of the two")
        known = shipped_designs()
        for one, title in known.items():
            print(f"{one:<{max(map(len, known)) + 2}}{title}")
    elif out is None:
        print(read_design(name), end="")
        beside = needed_files(name)
        if beside and context.obj.is_root:
            note = f"this design reads {', '.join(beside)}: lobefem new {name} --out DIR writes both"
            print(f"lobefem: note: {note}", file=sys.stderr)
    elif context.obj.is_root:
        for path in copy_design(name, out):
            print(f"Written: {printable(path)}")


def schema() -> None:
    """Print the JSON schema of design files, with which editors complete and check their keys."""
    from lobefem.io.design_schema import design_schema

    print(design_schema(), end="")


def units(quantity: output_options.Which = "") -> None:
    """List the units that design files and options accept.

    A number without a unit is in SI; the angle of an option is in degrees.
    """
    chosen = {name: kind for name, kind in KINDS.items() if quantity.lower() in name.lower()}
    if not chosen:
        raise InputError(f"{quantity!r} is no quantity with units; use {', '.join(KINDS)}")
    rows = [(name, kind.si, kind.example, ", ".join(kind.factors)) for name, kind in chosen.items()]
    show_rows([("quantity", "without a unit", "example", "units"), *rows])


def materials(name: output_options.Which = "") -> None:
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


def plot(
    context: typer.Context,
    folder: output_options.RunDir,
    what: output_options.What,
    to: output_options.PictureFile = None,
    format: output_options.Format = None,  # noqa: A002  --format
    pressure: output_options.AtPressure = None,
    mode: output_options.ModeNumbers = None,
    width: output_options.Width = "85",
) -> None:
    """Plot what a run folder holds, for print or screen; GIF and MP4 are animated."""
    at = None if pressure is None else parsing.pressure("--pressure", pressure)
    numbers, wide = parsing.integers("--mode", mode), parsing.positive("--width", width)
    if context.obj.is_root:
        from lobefem.viz.run_pictures import save_picture

        path = save_picture(folder, what, to, format, pressure=at, modes=numbers, width=wide)
        if not loudness(context)["quiet"]:
            print(f"The picture is {printable(path)}")


def gores(
    context: typer.Context,
    design: design_options.DesignFile,
    out: output_options.GoreFolder,
    marks: run_options.Marks = "51",
    overwrite: output_options.Overwrite = False,
    quiet: output_options.Quiet = False,
    verbose: output_options.Verbose = False,
) -> None:
    """A pumpkin's gore to be cut: a table as CSV, the piece at 1:1 as SVG and DXF."""
    number, said = parsing.integer("--marks", marks, 2), loudness(context)
    if context.obj.is_root:
        from lobefem.app.gores_command import gores as cut

        rows, paths = cut(design, out, marks=number, overwrite=overwrite)
        if not said["quiet"]:
            show_rows(rows)
            print(f"The gore is in {', '.join(printable(path) for path in paths)}")


@options.sharing(design_options.DESIGN, {})
def check(context: typer.Context, design: design_options.DesignFile) -> None:
    """Print a design in full: each key, whether it is a default, and what it does to the answer."""
    from lobefem.app.check_command import check as examine

    rows, sentences = examine(overridden({**context.params, "design": design}, None))
    if context.obj.is_root:
        show_rows([("key", "value", "from", "note"), *rows])
        for sentence in sentences:
            print(sentence)


def doctor(
    context: typer.Context, quiet: output_options.Quiet = False, verbose: output_options.Verbose = False
) -> int:
    """Check this installation part by part and advise on what does not work (exit code 1)."""
    from lobefem.app.doctor import examine
    from lobefem.app.tables import show_findings

    ranks = context.obj
    with reporting(ranks.is_root, ranks.stop, **loudness(context)) as progress:
        findings = examine(progress)
    if ranks.is_root:
        show_findings([f for f in findings if not (f.fine and loudness(context)["quiet"])])
    return 0 if all(finding.fine for finding in findings) else 1
