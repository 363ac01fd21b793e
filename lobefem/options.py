"""The command line's options, and the keys of the design that they override."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

__all__ = [
    "KEYS",
    "NAMES",
    "AtPressure",
    "Bend",
    "Cell",
    "Contact",
    "Count",
    "Damping",
    "DesignFile",
    "Divisions",
    "EdgeRadius",
    "FilmLaw",
    "Format",
    "Harmonic",
    "Harmonics",
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
    "Release",
    "Resume",
    "RunDir",
    "Slack",
    "State",
    "Steps",
    "Support",
    "TipDisplacement",
    "Twist",
    "Wave",
    "What",
    "Width",
]

# which key of the design an option overrides
KEYS = {
    "film": "film.law",
    "slack_stiffness": "film.slack_stiffness",
    "prestress": "film.prestress",
    "load": "pressure.load",
    "pressure": "pressure.value",
    "support": "plates.support",
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


_RUN, _OUTPUT, _PICTURE = "The run", "Output", "The picture"
Text = str | None
DesignFile = Annotated[Path, typer.Argument(metavar="DESIGN.toml", help="Design file, see meshes/.")]
FilmLaw = Annotated[Text, _option("--film", "LAW", "isotropic, fixed-wrinkles or tension-field.")]
Load = Annotated[Text, _option("--load", "LOAD", "film: gas on the film only; closed: on the plates too.")]
Support = Annotated[
    Text,
    _option("--support", "HOW", "clamped: bottom plate held; pinned: free to tilt; fixed: both held."),
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
    Text, _option("--bend", "PSI", "Bend the axis to an arc of half-angle PSI degrees.", "The distortion")
]
Twist = Annotated[Text, _option("--twist", "ANGLE", "Turn the top plate, degrees.", "The distortion")]
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
    typer.Option("--resume", help="Go on with the run in --out.", rich_help_panel=_OUTPUT),
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
RunDir = Annotated[Path, typer.Argument(metavar="DIR", help="Run folder, what --out has made.")]
What = Annotated[str, _option("--what", "WHAT", "modes, stress, state, curves or release.", _PICTURE)]
PictureFile = Annotated[Path | None, _option("--to", "FILE", "The picture; default: DIR/WHAT.png.", _PICTURE)]
Format = Annotated[Text, _option("--format", "F", "png, svg, gif or mp4, by default of --to.", _PICTURE)]
ModeNumbers = Annotated[Text, _option("--mode", "LIST", "These modes only, 1, 1:4 or 2,5.", _PICTURE)]
AtPressure = Annotated[Text, _option("--pressure", "P", "Of several, 5 or '5 Pa'; default: last.", _PICTURE)]
Width = Annotated[str, _option("--width", "MM", "85 for one column (default), 170 for two.", _PICTURE)]
Out = Annotated[Path | None, _option("--out", "DIR", "Folder for results and fields.", _OUTPUT)]
Overwrite = Annotated[
    bool,
    typer.Option("--overwrite", help="Replace a run in --out.", rich_help_panel=_OUTPUT),
]
Json = Annotated[Text, _option("--json", "FILE", "Results as JSON, - for standard output.", _OUTPUT)]
