"""The command line's options, and the keys of the design that they override."""

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
    "Contact",
    "Count",
    "Damping",
    "DesignFile",
    "Divisions",
    "EdgeRadius",
    "ExportKind",
    "FilmLaw",
    "Format",
    "Harmonic",
    "Harmonics",
    "HoopsOption",
    "Json",
    "Lift",
    "Limit",
    "Load",
    "Lobes",
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
    "Release",
    "Report",
    "Resume",
    "RunDir",
    "SearchPressure",
    "Settings",
    "Setup",
    "Slack",
    "State",
    "Steps",
    "Support",
    "SweepFile",
    "SweepFolder",
    "TipDisplacement",
    "Twist",
    "Verbose",
    "Wave",
    "What",
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


def _option(name: str, metavar: str, help: str, panel: str = "The design, overridden") -> Any:  # noqa: A002
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


_RUN, _OUTPUT, _PICTURE = "The run", "Output", "The picture"

Text = str | None

SearchPressure = Annotated[list[str] | None, typer.Option("--pressure", hidden=True)]

DesignFile = Annotated[
    Path,
    typer.Argument(metavar="DESIGN.toml", help="Design file, see meshes/.", autocompletion=design_files),
]

FilmLaw = Annotated[
    Text, _option("--film", "LAW", "isotropic, fixed-wrinkles, tension-field, imp or load-path.")
]

Load = Annotated[Text, _option("--load", "LOAD", "film: gas on the film only; closed: on the plates too.")]

Support = Annotated[
    Text,
    _option("--support", "HOW", "clamped: bottom plate held; pinned: free to tilt; fixed: both held."),
]

Bar = Annotated[Text, _option("--bar", "BAR", "Between the plates: rigid, none, or EA such as '2.15 GN'.")]

HoopsOption = Annotated[Text, _option("--hoops", "HOOPS", "At the seams: none, or EA such as '2.15 GN'.")]

Settings = Annotated[
    list[str] | None,
    _option("--set", "KEY=VALUE", "Any key of the design, film.thickness='25 um'; repeat for more."),
]

Lift = Annotated[Text, _option("--lift", "Z", "Raise the top rim, 0.004 or '4 mm', if fixed.")]

Slack = Annotated[Text, _option("--slack-stiffness", "K", "Stiffness share of slack film, 1e-4.")]

Divisions = Annotated[Text, _option("--divisions", "AxB", "Cells along a lobe and around, 24x32.")]

Lobes = Annotated[Text, _option("--lobes", "N", "Number of lobes.")]

EdgeRadius = Annotated[Text, _option("--edge-radius", "R", "Radius of seams and rims, 2.0 or '2 m'.")]

Cell = Annotated[Text, _option("--cell", "CELL", "triangle or quadrilateral.")]

Order = Annotated[Text, _option("--order", "N", "1: flat cells, 2: curved ones.")]

OnePressure = Annotated[list[str] | None, _option("--pressure", "P", "Gas pressure, 5 or '5 Pa'.", _RUN)]

Pressures = Annotated[
    list[str] | None,
    _option("--pressure", "P", "Gas pressure, 5 or '5 Pa'; repeat for more.", _RUN),
]

Prestress = Annotated[
    bool | None,
    typer.Option(
        "--prestress/--no-prestress",
        help="Isotensoid's stress built in; default: with fixed-wrinkles.",
        show_default=False,
        rich_help_panel="The design, overridden",
    ),
]

Setup = Annotated[
    Text,
    _option("--setup", "HOW", "Built-in stress: initial-stress (closed form) or load-path (found by it)."),
]

State = Annotated[
    str,
    _option("--state", "STATE", "ideal: held ideal shape (default); inflated: equilibrium.", _RUN),
]

Count = Annotated[
    str, _option("--count", "K", "Modes a pressure, 8 by default; a complex pair stays whole.", _RUN)
]

Mass = Annotated[
    str, _option("--mass", "B", "unit: areal mass (default); nodal: identity, the paper's.", _RUN)
]

Harmonics = Annotated[
    Text,
    _option("--harmonics", "LIST", "These harmonics only, from one sector: 3, 0:8 or 2,5,7.", _RUN),
]

Harmonic = Annotated[Text, _option("--harmonic", "N", "Modes of this harmonic only.", _RUN)]

TipDisplacement = Annotated[
    Text, _option("--tip-displacement", "D", "Push the top sideways, 0.7 or '70 cm'.", "The distortion")
]

Bend = Annotated[
    Text,
    _option(
        "--bend", "PSI", "Bend the axis to an arc of half-angle PSI, 7.5 or '7.5 deg'.", "The distortion"
    ),
]

Twist = Annotated[Text, _option("--twist", "ANGLE", "Turn the top plate, 30 or '30 deg'.", "The distortion")]

Wave = Annotated[
    Text,
    _option("--wave", "N:A", "Waves of the equators, harmonic and amplitude, 2:0.1.", "The distortion"),
]

Release = Annotated[
    bool,
    typer.Option("--release/--no-release", help="Let go at the end of the ramp.", rich_help_panel=_RUN),
]

Contact = Annotated[
    bool,
    typer.Option("--contact/--no-contact", help="Film and plates touch each other.", rich_help_panel=_RUN),
]

Steps = Annotated[str, _option("--steps", "K", "Increments of the ramp, 20 by default.", _RUN)]

Damping = Annotated[str, _option("--damping", "C", "Of the release, 1 by default; try 0.1.", _RUN)]

Resume = Annotated[
    bool,
    typer.Option("--resume", help="Go on with the run in --out, if it was stopped.", rich_help_panel=_OUTPUT),
]

Limit = Annotated[
    Text, _option("--limit", "P", "Where a search along inflated states ends, 20 kPa by default.", _RUN)
]

MeshStudy = Annotated[
    bool,
    typer.Option("--mesh-study", help="Refine: does it converge?", rich_help_panel=_RUN),
]

Meshes = Annotated[Text, _option("--meshes", "LIST", "Of a mesh study, 18x24,24x32,36x48.", _RUN)]

Petsc = Annotated[
    Text, _option("--petsc", "OPTIONS", "PETSc options, '-lobefem_inflate_snes_monitor'.", _RUN)
]

Profile = Annotated[
    bool,
    typer.Option("--profile", help="Say where the time went, stage by stage.", rich_help_panel=_OUTPUT),
]

Report = Annotated[
    bool,
    typer.Option("--report", help="Write report.html into --out.", rich_help_panel=_OUTPUT),
]

RunDir = Annotated[Path, typer.Argument(metavar="DIR", help="Run folder, what --out has made.")]

What = Annotated[str, _option("--what", "WHAT", "modes, stress, state, curves or release.", _PICTURE)]

PictureFile = Annotated[Path | None, _option("--to", "FILE", "The picture; default: DIR/WHAT.png.", _PICTURE)]

Which = Annotated[str, typer.Argument(metavar="[WORD]", help="Those whose name holds it.")]

ExportKind = Annotated[str, _option("--to", "FORM", "csv: tables; vtu: fields.", _OUTPUT)]

Format = Annotated[Text, _option("--format", "F", "png, svg, gif or mp4, by default of --to.", _PICTURE)]

ModeNumbers = Annotated[Text, _option("--mode", "LIST", "These modes only, 1, 1:4 or 2,5.", _PICTURE)]

AtPressure = Annotated[Text, _option("--pressure", "P", "Of several, 5 or '5 Pa'; default: last.", _PICTURE)]

Width = Annotated[str, _option("--width", "MM", "85 for one column (default), 170 for two.", _PICTURE)]

Out = Annotated[Path | None, _option("--out", "DIR", "Folder for results and fields.", _OUTPUT)]

Overwrite = Annotated[
    bool,
    typer.Option("--overwrite", help="Replace a run in --out.", rich_help_panel=_OUTPUT),
]

SweepFile = Annotated[Path, typer.Argument(metavar="SWEEP.toml", help="What to vary, see demos/lobes.toml.")]

SweepFolder = Annotated[Path, _option("--out", "DIR", "Folder for the table and the points.", _OUTPUT)]

Workers = Annotated[Text, _option("--workers", "N", "Points at a time, one a core by default.", _RUN)]

Json = Annotated[Text, _option("--json", "FILE", "Results as JSON, - for standard output.", _OUTPUT)]

Quiet = Annotated[
    bool,
    typer.Option("--quiet", "-q", help="Say nothing but warnings and errors.", rich_help_panel=_OUTPUT),
]

Verbose = Annotated[
    bool,
    typer.Option("--verbose", "-v", help="Say what every step did.", rich_help_panel=_OUTPUT),
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
