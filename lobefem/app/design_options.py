"""Options of designs: the design file, and the options that override its keys."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lobefem.app.options import Group, Text, option

__all__ = [
    "DESIGN",
    "KEYS",
    "NAMES",
    "Bar",
    "Cell",
    "DesignFile",
    "Divisions",
    "EdgeRadius",
    "FilmLaw",
    "HoopsOption",
    "Lift",
    "Load",
    "Lobes",
    "Order",
    "Prestress",
    "Settings",
    "Setup",
    "Slack",
    "Support",
    "design_files",
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

NAMES = {key: "--" + name.replace("_", "-") for name, key in KEYS.items()}


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


DesignFile = Annotated[
    Path,
    typer.Argument(metavar="DESIGN.toml", help="Design file, see meshes/.", autocompletion=design_files),
]

FilmLaw = Annotated[
    Text, option("--film", "LAW", "Film law: tension-field, isotropic, fixed-wrinkles, imp or load-path.")
]

Load = Annotated[
    Text, option("--load", "LOAD", "closed: gas presses on film and end plates; film: on the film only.")
]

Support = Annotated[
    Text,
    option("--support", "HOW", "clamped: bottom plate fixed; pinned: free to tilt; fixed: both plates."),
]

Bar = Annotated[Text, option("--bar", "BAR", "Between the plates: rigid, none, or EA such as '2.15 GN'.")]

HoopsOption = Annotated[Text, option("--hoops", "HOOPS", "At the seams: none, or EA such as '2.15 GN'.")]

Settings = Annotated[
    list[str] | None,
    option("--set", "KEY=VALUE", "Any key of the design, film.thickness='25 um'; repeat for more."),
]

Lift = Annotated[
    Text, option("--lift", "LENGTH", "Raise the top plate, e.g. '4 mm' (needs --support fixed).")
]

Slack = Annotated[
    Text,
    option(
        "--slack-stiffness",
        "SHARE",
        "Share of isotropic stiffness in slack film (default 1e-6 for tension-field).",
    ),
]

Divisions = Annotated[
    Text, option("--divisions", "ROWSxCOLUMNS", "Cells along a lobe and around the axis, e.g. 24x32.")
]

Lobes = Annotated[Text, option("--lobes", "NUMBER", "Number of lobes along the axis.")]

EdgeRadius = Annotated[Text, option("--edge-radius", "LENGTH", "Radius of seams and rims, e.g. '2 m'.")]

Cell = Annotated[Text, option("--cell", "CELL", "Shape of the cells: triangle or quadrilateral.")]

Order = Annotated[Text, option("--order", "NUMBER", "1: flat cells; 2: curved cells.")]

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
    option("--setup", "HOW", "Find the built-in stress in closed form (initial-stress) or by load-path."),
]

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
