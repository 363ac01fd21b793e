"""Options of runs: pressures, modes, searches, mesh studies, distortions, and files of many runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lobefem.app.options import Text, flag, option

__all__ = [
    "Bend",
    "Cleft",
    "Contact",
    "Count",
    "Damping",
    "Full",
    "Harmonic",
    "HarmonicSeed",
    "Harmonics",
    "Limit",
    "Marks",
    "Mass",
    "MeshStudy",
    "Meshes",
    "OnePressure",
    "Petsc",
    "Pressures",
    "RandomDesigns",
    "Release",
    "SearchFile",
    "SearchPressure",
    "SensitivityLimit",
    "Starts",
    "State",
    "Steps",
    "SweepFile",
    "TipDisplacement",
    "Tolerance",
    "Twist",
    "Wave",
    "WhatIf",
    "Workers",
]

_RUN = "The run"

SearchPressure = Annotated[list[str] | None, typer.Option("--pressure", hidden=True)]

OnePressure = Annotated[
    list[str] | None, option("--pressure", "PRESSURE", "Gas pressure, e.g. '5 Pa'.", _RUN)
]

Full = Annotated[
    bool,
    flag("--full", "All gores of a pumpkin, not one for all.", _RUN),
]

Pressures = Annotated[
    list[str] | None,
    option("--pressure", "PRESSURE", "Gas pressure, e.g. '5 Pa'; repeat for more.", _RUN),
]

State = Annotated[
    Text,
    option(
        "--state",
        "STATE",
        "ideal: shape as designed (default for stacks); inflated: shape under pressure (recommended).",
        _RUN,
    ),
]

Count = Annotated[
    str, option("--count", "NUMBER", "Modes per pressure (default 8); a complex pair is not split.", _RUN)
]

Mass = Annotated[
    str,
    option(
        "--mass", "MASS", "Scale of eigenvalues: unit areal mass (default), or nodal, as in the paper.", _RUN
    ),
]

Harmonics = Annotated[
    Text,
    option(
        "--harmonics",
        "LIST",
        "Only modes with these numbers of waves around the axis: 3, 0:8 or 2,5,7.",
        _RUN,
    ),
]

Harmonic = Annotated[
    Text, option("--harmonic", "NUMBER", "Only modes with this number of waves around the axis.", _RUN)
]

TipDisplacement = Annotated[
    Text, option("--tip-displacement", "LENGTH", "Push the top sideways, e.g. '70 cm'.", "The distortion")
]

Bend = Annotated[
    Text,
    option("--bend", "ANGLE", "Bend the axis to this half-angle [degrees].", "The distortion"),
]

Twist = Annotated[
    Text, option("--twist", "ANGLE", "Rotate the top plate about the axis [degrees].", "The distortion")
]

Wave = Annotated[
    Text,
    option(
        "--wave",
        "NUMBER:LENGTH",
        "Impose waves around the equators, e.g. 2:0.1 for two of 0.1 m.",
        "The distortion",
    ),
]

HarmonicSeed = Annotated[
    Text,
    option(
        "--harmonic-seed",
        "NUMBER:SHARE",
        "Move a pumpkin's tendons around the axis in waves, e.g. 4:0.05 for four of 5 % of the radius.",
        "The distortion",
    ),
]

Cleft = Annotated[
    bool,
    flag("--cleft", "Pull some gores of a pumpkin in along an S line, see [cleft].", "The distortion"),
]

Release = Annotated[
    bool,
    flag("--release/--no-release", "Release the balloon at the end of the ramp.", _RUN),
]

Contact = Annotated[
    bool,
    flag("--contact/--no-contact", "Let film and plates touch, or pass through each other.", _RUN),
]

Steps = Annotated[str, option("--steps", "NUMBER", "Increments of the ramp (default 20).", _RUN)]

Damping = Annotated[
    str,
    option(
        "--damping",
        "NUMBER",
        "Damping of the release (default 1). Less is faster; the outcome is the same.",
        _RUN,
    ),
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

SensitivityLimit = Annotated[
    Text,
    typer.Option(
        "--limit",
        "--up-to",
        metavar="PRESSURE",
        help="Highest pressure at which the critical one is looked for (default: ten times the design's).",
        show_default=False,
        rich_help_panel=_RUN,
    ),
]

MeshStudy = Annotated[
    bool,
    flag("--mesh-study", "Repeat on finer meshes: a limit with an error bar, if there is one.", _RUN),
]

Meshes = Annotated[Text, option("--meshes", "LIST", "Meshes of the study, e.g. 18x24,24x32,36x48.", _RUN)]

Tolerance = Annotated[
    Text, option("--tolerance", "SHARE", "Refine the mesh until the error bar is this small, e.g. 2%.", _RUN)
]

WhatIf = Annotated[
    bool, flag("--what-if", "Also with another bar, load and film stiffness: what decides.", _RUN)
]

Petsc = Annotated[
    Text, option("--petsc", "OPTIONS", "PETSc options, e.g. '-lobefem_inflate_snes_monitor'.", "For experts")
]

Marks = Annotated[str, option("--marks", "NUMBER", "Marks of the tendon on a seam (default 51).", _RUN)]

SweepFile = Annotated[Path, typer.Argument(metavar="SWEEP.toml", help="What to vary, see demos/lobes.toml.")]

SearchFile = Annotated[
    Path, typer.Argument(metavar="SEARCH.toml", help="What to search for, see demos/search.toml.")
]

Starts = Annotated[str, option("--starts", "NUMBER", "Starts of the optimiser (default 3).", _RUN)]

RandomDesigns = Annotated[
    str, option("--random", "NUMBER", "Random designs for comparison (default 0).", _RUN)
]

Workers = Annotated[Text, option("--workers", "NUMBER", "Points at a time (default: one per core).", _RUN)]
