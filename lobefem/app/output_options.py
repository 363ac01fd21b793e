"""Options of output: run folders, reports, JSON, pictures, and how much is printed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lobefem.app.options import Group, Text, flag, option

__all__ = [
    "OUTPUT",
    "AtPressure",
    "ExportKind",
    "Format",
    "GoreFolder",
    "Json",
    "ModeNumbers",
    "Out",
    "Overwrite",
    "PictureFile",
    "Profile",
    "Quiet",
    "Report",
    "Resume",
    "RunDir",
    "SearchFolder",
    "SweepFolder",
    "Verbose",
    "What",
    "Which",
    "Width",
]

_OUTPUT, _PICTURE = "Output", "The picture"

Resume = Annotated[
    bool,
    flag("--resume", "Continue the run in --out that was stopped.", _OUTPUT),
]

Profile = Annotated[
    bool,
    flag("--profile", "Report the time that each stage took.", _OUTPUT),
]

Report = Annotated[
    bool,
    flag("--report", "Write report.html, the run on one page, into --out.", _OUTPUT),
]

RunDir = Annotated[Path, typer.Argument(metavar="DIR", help="Run folder, made by --out.")]

GoreFolder = Annotated[Path, option("--out", "DIR", "Folder for the table and the drawings.", _OUTPUT)]

What = Annotated[
    str, option("--what", "WHAT", "What to plot: modes, stress, state, curves or release.", _PICTURE)
]

PictureFile = Annotated[
    Path | None, option("--to", "FILE", "File of the picture (default DIR/WHAT.png).", _PICTURE)
]

Which = Annotated[str, typer.Argument(metavar="[WORD]", help="Only names that contain this word.")]

ExportKind = Annotated[str, option("--to", "FORMAT", "csv: tables; xlsx: a workbook; vtu: fields.", _OUTPUT)]

Format = Annotated[
    Text, option("--format", "FORMAT", "png, svg, gif or mp4 (default: by the ending of --to).", _PICTURE)
]

ModeNumbers = Annotated[Text, option("--mode", "LIST", "Only these modes: 1, 1:4 or 2,5.", _PICTURE)]

AtPressure = Annotated[
    Text, option("--pressure", "PRESSURE", "Pressure to plot, e.g. '5 Pa' (default: the last).", _PICTURE)
]

Width = Annotated[str, option("--width", "MM", "Width: 85 for one column (default), 170 for two.", _PICTURE)]

Out = Annotated[Path | None, option("--out", "DIR", "Folder for results and fields.", _OUTPUT)]

Overwrite = Annotated[
    bool,
    flag("--overwrite", "Replace the run in --out.", _OUTPUT),
]

SearchFolder = Annotated[Path, option("--out", "DIR", "Folder for all designs and the best gores.", _OUTPUT)]

SweepFolder = Annotated[
    Path, option("--out", "DIR", "Folder for the table and the run folders of the points.", _OUTPUT)
]

Json = Annotated[Text, option("--json", "FILE", "Write results as JSON; - is standard output.", _OUTPUT)]

Quiet = Annotated[
    bool,
    typer.Option("--quiet", "-q", help="Print only warnings and errors.", rich_help_panel=_OUTPUT),
]

Verbose = Annotated[
    bool,
    typer.Option("--verbose", "-v", help="Print what every step did.", rich_help_panel=_OUTPUT),
]

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
