"""Options of the command line, and the keys of the design that they override."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import typer

__all__ = [
    "DESIGN",
    "KEYS",
    "NAMES",
    "OUTPUT",
    "AtPressure",
    "Bar",
    "Bend",
    "Cell",
    "Cleft",
    "Contact",
    "Count",
    "Damping",
    "DesignFile",
    "Divisions",
    "EdgeRadius",
    "ExportKind",
    "FilmLaw",
    "Format",
    "Full",
    "GoreFolder",
    "Harmonic",
    "HarmonicSeed",
    "Harmonics",
    "HoopsOption",
    "Json",
    "Lift",
    "Limit",
    "Load",
    "Lobes",
    "Marks",
    "Mass",
    "MeshStudy",
    "Meshes",
    "ModeNumbers",
    "OnePressure",
    "Order",
    "Out",
    "Overwrite",
    "Petsc",
    "PictureFile",
    "Pressures",
    "Prestress",
    "Profile",
    "Quiet",
    "RandomDesigns",
    "Release",
    "Report",
    "Resume",
    "RunDir",
    "SearchFile",
    "SearchFolder",
    "SearchPressure",
    "Settings",
    "Setup",
    "Slack",
    "Starts",
    "State",
    "Steps",
    "Support",
    "SweepFile",
    "SweepFolder",
    "TipDisplacement",
    "Tolerance",
    "Twist",
    "Verbose",
    "Wave",
    "What",
    "WhatIf",
    "Which",
    "Width",
    "Workers",
    "design_files",
    "sharing",
]

# which key of the design an option overrides
KEYS = {
    "film": "film.law",
    "slack_stiffness": "film.slack_stiffness",
    "prestress": "film.prestress",
    "setup": "film.setup",
    "load": "pressure.load",
    "pressure": "pressure.value",
    "support": "plates.support",
    "bar": "plates.bar",
    "lift": "plates.lift",
    "divisions": "mesh.divisions",
    "cell": "mesh.cell",
    "order": "mesh.order",
    "lobes": "shape.lobes",
    "edge_radius": "shape.edge_radius",
}

NAMES = {key: "--" + option.replace("_", "-") for option, key in KEYS.items()}


def _option(name: str, metavar: str, help: str, panel: str = "Override the design") -> Any:  # noqa: A002
    return typer.Option(name, metavar=metavar, help=help, show_default=False, rich_help_panel=panel)


def design_files(incomplete: str) -> list[str]:
    """Complete the first letters of a design file's name; a lone folder gives what is in it."""
    folder = Path(incomplete) if incomplete.endswith("/") or not incomplete else Path(incomplete).parent
    try:
        found = sorted(path for path in folder.iterdir() if not path.name.startswith("."))
    except OSError:
        return []
    names = [f"{path}/" if path.is_dir() else str(path) for path in found]
    fitting = [n for n in names if n.endswith(("/", ".toml")) and n.startswith(incomplete)]
    if len(fitting) == 1 and fitting[0].endswith("/"):
        return design_files(fitting[0])
    return fitting


def _flag(name: str, help: str, panel: str) -> Any:  # noqa: A002
    return typer.Option(name, help=help, rich_help_panel=panel)


_RUN, _OUTPUT, _PICTURE = "The run", "Output", "The picture"

Text = str | None

SearchPressure = Annotated[list[str] | None, typer.Option("--pressure", hidden=True)]

DesignFile = Annotated[
    Path,
    typer.Argument(metavar="DESIGN.toml", help="Design file, see meshes/.", autocompletion=design_files),
]

FilmLaw = Annotated[
    Text, _option("--film", "LAW", "Film law: tension-field, isotropic, fixed-wrinkles, imp or load-path.")
]

Load = Annotated[
    Text, _option("--load", "LOAD", "closed: gas presses on film and end plates; film: on the film only.")
]

Support = Annotated[
    Text,
    _option("--support", "HOW", "clamped: bottom plate fixed; pinned: free to tilt; fixed: both plates."),
]

Bar = Annotated[Text, _option("--bar", "BAR", "Between the plates: rigid, none, or EA such as '2.15 GN'.")]

HoopsOption = Annotated[Text, _option("--hoops", "HOOPS", "At the seams: none, or EA such as '2.15 GN'.")]

Settings = Annotated[
    list[str] | None,
    _option("--set", "KEY=VALUE", "Any key of the design, film.thickness='25 um'; repeat for more."),
]

Lift = Annotated[
    Text, _option("--lift", "LENGTH", "Raise the top plate, e.g. '4 mm' (needs --support fixed).")
]

Slack = Annotated[
    Text,
    _option(
        "--slack-stiffness",
        "SHARE",
        "Share of isotropic stiffness in slack film (default 1e-6 for tension-field).",
    ),
]

Divisions = Annotated[
    Text, _option("--divisions", "ROWSxCOLUMNS", "Cells along a lobe and around the axis, e.g. 24x32.")
]

Lobes = Annotated[Text, _option("--lobes", "NUMBER", "Number of lobes along the axis.")]

EdgeRadius = Annotated[Text, _option("--edge-radius", "LENGTH", "Radius of seams and rims, e.g. '2 m'.")]

Cell = Annotated[Text, _option("--cell", "CELL", "Shape of the cells: triangle or quadrilateral.")]

Order = Annotated[Text, _option("--order", "NUMBER", "1: flat cells; 2: curved cells.")]

OnePressure = Annotated[
    list[str] | None, _option("--pressure", "PRESSURE", "Gas pressure, e.g. '5 Pa'.", _RUN)
]

Full = Annotated[
    bool,
    _flag("--full", "All gores of a pumpkin, not one for all.", _RUN),
]

Pressures = Annotated[
    list[str] | None,
    _option("--pressure", "PRESSURE", "Gas pressure, e.g. '5 Pa'; repeat for more.", _RUN),
]

Prestress = Annotated[
    bool | None,
    typer.Option(
        "--prestress/--no-prestress",
        help="Start with the design stress built in (default for fixed-wrinkles only).",
        show_default=False,
        rich_help_panel="Override the design",
    ),
]

Setup = Annotated[
    Text,
    _option("--setup", "HOW", "Find the built-in stress in closed form (initial-stress) or by load-path."),
]

State = Annotated[
    Text,
    _option(
        "--state",
        "STATE",
        "ideal: shape as designed (default for stacks); inflated: shape under pressure (recommended).",
        _RUN,
    ),
]

Count = Annotated[
    str, _option("--count", "NUMBER", "Modes per pressure (default 8); a complex pair is not split.", _RUN)
]

Mass = Annotated[
    str,
    _option(
        "--mass", "MASS", "Scale of eigenvalues: unit areal mass (default), or nodal, as in the paper.", _RUN
    ),
]

Harmonics = Annotated[
    Text,
    _option(
        "--harmonics",
        "LIST",
        "Only modes with these numbers of waves around the axis: 3, 0:8 or 2,5,7.",
        _RUN,
    ),
]

Harmonic = Annotated[
    Text, _option("--harmonic", "NUMBER", "Only modes with this number of waves around the axis.", _RUN)
]

TipDisplacement = Annotated[
    Text, _option("--tip-displacement", "LENGTH", "Push the top sideways, e.g. '70 cm'.", "The distortion")
]

Bend = Annotated[
    Text,
    _option("--bend", "ANGLE", "Bend the axis to this half-angle [degrees].", "The distortion"),
]

Twist = Annotated[
    Text, _option("--twist", "ANGLE", "Rotate the top plate about the axis [degrees].", "The distortion")
]

Wave = Annotated[
    Text,
    _option(
        "--wave",
        "NUMBER:LENGTH",
        "Impose waves around the equators, e.g. 2:0.1 for two of 0.1 m.",
        "The distortion",
    ),
]

HarmonicSeed = Annotated[
    Text,
    _option(
        "--harmonic-seed",
        "NUMBER:SHARE",
        "Move a pumpkin's tendons around the axis in waves, e.g. 4:0.05 for four of 5 % of the radius.",
        "The distortion",
    ),
]

Cleft = Annotated[
    bool,
    _flag("--cleft", "Pull some gores of a pumpkin in along an S line, see [cleft].", "The distortion"),
]

Release = Annotated[
    bool,
    _flag("--release/--no-release", "Release the balloon at the end of the ramp.", _RUN),
]

Contact = Annotated[
    bool,
    _flag("--contact/--no-contact", "Let film and plates touch, or pass through each other.", _RUN),
]

Steps = Annotated[str, _option("--steps", "NUMBER", "Increments of the ramp (default 20).", _RUN)]

Damping = Annotated[
    str,
    _option(
        "--damping",
        "NUMBER",
        "Damping of the release (default 1). Less is faster; the outcome is the same.",
        _RUN,
    ),
]

Resume = Annotated[
    bool,
    _flag("--resume", "Continue the run in --out that was stopped.", _OUTPUT),
]

Limit = Annotated[
    Text,
    typer.Option(
        "--limit",
        "--up-to",
        metavar="PRESSURE",
        help="Highest pressure to search, inflated only (default 20 kPa; of pumpkins film strained by 5 %).",
        show_default=False,
        rich_help_panel=_RUN,
    ),
]

MeshStudy = Annotated[
    bool,
    _flag("--mesh-study", "Repeat on finer meshes: a limit with an error bar, if there is one.", _RUN),
]

Meshes = Annotated[Text, _option("--meshes", "LIST", "Meshes of the study, e.g. 18x24,24x32,36x48.", _RUN)]

Tolerance = Annotated[
    Text, _option("--tolerance", "SHARE", "Refine the mesh until the error bar is this small, e.g. 2%.", _RUN)
]

WhatIf = Annotated[
    bool, _flag("--what-if", "Also with another bar, load and film stiffness: what decides.", _RUN)
]

Petsc = Annotated[
    Text, _option("--petsc", "OPTIONS", "PETSc options, e.g. '-lobefem_inflate_snes_monitor'.", "For experts")
]

Profile = Annotated[
    bool,
    _flag("--profile", "Report the time that each stage took.", _OUTPUT),
]

Report = Annotated[
    bool,
    _flag("--report", "Write report.html, the run on one page, into --out.", _OUTPUT),
]

RunDir = Annotated[Path, typer.Argument(metavar="DIR", help="Run folder, made by --out.")]

GoreFolder = Annotated[Path, _option("--out", "DIR", "Folder for the table and the drawings.", _OUTPUT)]

Marks = Annotated[str, _option("--marks", "NUMBER", "Marks of the tendon on a seam (default 51).", _RUN)]

What = Annotated[
    str, _option("--what", "WHAT", "What to plot: modes, stress, state, curves or release.", _PICTURE)
]

PictureFile = Annotated[
    Path | None, _option("--to", "FILE", "File of the picture (default DIR/WHAT.png).", _PICTURE)
]

Which = Annotated[str, typer.Argument(metavar="[WORD]", help="Only names that contain this word.")]

ExportKind = Annotated[str, _option("--to", "FORMAT", "csv: tables; xlsx: a workbook; vtu: fields.", _OUTPUT)]

Format = Annotated[
    Text, _option("--format", "FORMAT", "png, svg, gif or mp4 (default: by the ending of --to).", _PICTURE)
]

ModeNumbers = Annotated[Text, _option("--mode", "LIST", "Only these modes: 1, 1:4 or 2,5.", _PICTURE)]

AtPressure = Annotated[
    Text, _option("--pressure", "PRESSURE", "Pressure to plot, e.g. '5 Pa' (default: the last).", _PICTURE)
]

Width = Annotated[str, _option("--width", "MM", "Width: 85 for one column (default), 170 for two.", _PICTURE)]

Out = Annotated[Path | None, _option("--out", "DIR", "Folder for results and fields.", _OUTPUT)]

Overwrite = Annotated[
    bool,
    _flag("--overwrite", "Replace the run in --out.", _OUTPUT),
]

SweepFile = Annotated[Path, typer.Argument(metavar="SWEEP.toml", help="What to vary, see demos/lobes.toml.")]

SearchFile = Annotated[
    Path, typer.Argument(metavar="SEARCH.toml", help="What to search for, see demos/search.toml.")
]

SearchFolder = Annotated[Path, _option("--out", "DIR", "Folder for all designs and the best gores.", _OUTPUT)]

Starts = Annotated[str, _option("--starts", "NUMBER", "Starts of the optimiser (default 3).", _RUN)]

RandomDesigns = Annotated[
    str, _option("--random", "NUMBER", "Random designs for comparison (default 0).", _RUN)
]

SweepFolder = Annotated[
    Path, _option("--out", "DIR", "Folder for the table and the run folders of the points.", _OUTPUT)
]

Workers = Annotated[Text, _option("--workers", "NUMBER", "Points at a time (default: one per core).", _RUN)]

Json = Annotated[Text, _option("--json", "FILE", "Write results as JSON; - is standard output.", _OUTPUT)]

Quiet = Annotated[
    bool,
    typer.Option("--quiet", "-q", help="Print only warnings and errors.", rich_help_panel=_OUTPUT),
]

Verbose = Annotated[
    bool,
    typer.Option("--verbose", "-v", help="Print what every step did.", rich_help_panel=_OUTPUT),
]

Group = dict[str, tuple[Any, Any]]  # by parameter: its annotation and its default

DESIGN: Group = {
    "film": (FilmLaw, None),
    "load": (Load, None),
    "support": (Support, None),
    "bar": (Bar, None),
    "hoops": (HoopsOption, None),
    "slack_stiffness": (Slack, None),
    "divisions": (Divisions, None),
    "cell": (Cell, None),
    "order": (Order, None),
    "lobes": (Lobes, None),
    "edge_radius": (EdgeRadius, None),
    "settings": (Settings, None),
}

OUTPUT: Group = {
    "profile": (Profile, False),
    "out": (Out, None),
    "overwrite": (Overwrite, False),
    "resume": (Resume, False),
    "report": (Report, False),
    "json": (Json, None),
    "quiet": (Quiet, False),
    "verbose": (Verbose, False),
}


def sharing(first: Group, last: Group) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Give a command the options that many share; it finds their values in its context's `params`.

    Args:
        first: those between its design file and its own options.
        last: those after its own options.
    """

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        hints = get_type_hints(command, include_extras=True)
        own = inspect.signature(command).parameters

        @wraps(command)
        def shared(**given: Any) -> Any:
            return command(**{name: given[name] for name in own})

        def parameter(name: str, annotation: Any, default: Any) -> inspect.Parameter:
            return inspect.Parameter(
                name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation
            )

        mine = [parameter(name, hints[name], one.default) for name, one in own.items()]
        before, after = ([parameter(name, *one) for name, one in group.items()] for group in (first, last))
        parameters = [*mine[:2], *before, *mine[2:], *after]
        shared.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        shared.__annotations__ = {one.name: one.annotation for one in parameters}
        return shared

    return decorate
