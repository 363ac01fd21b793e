"""`lobefem gores`: from a design file to what a pumpkin's gores are cut by."""

from __future__ import annotations

from pathlib import Path

from lobefem.errors import InputError
from lobefem.io.design import Design
from lobefem.io.gore_files import cutting_table, save_gore
from lobefem.io.pumpkin_design import foreshortening

__all__ = ["gores"]


def gores(
    design: str | Path, folder: Path, *, marks: int = 51, overwrite: bool = False
) -> tuple[list[tuple[str, str, str]], list[Path]]:
    """Write the cutting table and the drawings of one gore; rows to show, and the paths.

    Args:
        design: path of a design file.
        folder: for gore.csv, gore.svg and gore.dxf.
        marks: of the tendon on a seam, both ends included.
        overwrite: whether earlier files may be replaced.

    Raises:
        InputError: a design without gores, or a folder that cannot be filled.
    """
    plan = Design.load(design)
    if not plan.is_pumpkin:
        raise InputError(
            f"lobefem gores cuts pumpkins, and this design is of the kind {plan.shape.kind!r}; give one like "
            "meshes/pumpkin.toml"
        )
    if not overwrite and any((folder / f"gore.{kind}").exists() for kind in ("csv", "svg", "dxf")):
        raise InputError(f"'{folder}' holds a gore already; give another --out, or --overwrite")
    table = cutting_table(plan.gore, foreshortening(plan), marks)
    rest = float(table.tendon[-1])
    count = plan.shape.gores
    values = {
        "gores": (f"{count}", ""),
        "length": (f"{table.length:.6g}", "m"),
        "width": (f"{table.width:.6g}", "m"),
        "seam": (f"{table.seam[-1]:.6g}", "m"),
        "tendon at rest": (f"{rest:.6g}", "m"),
        "seam over tendon": (f"{100 * (table.seam[-1] / rest - 1):.3g}", "%"),
        "area of a gore": (f"{table.area:.6g}", "m^2"),
    }
    about = {"design": Path(design).name} | {
        name: f"{value} {unit}".strip() for name, (value, unit) in values.items()
    }
    paths = save_gore(folder, table, about)
    return [("", "value", "unit"), *((name, *value) for name, value in values.items())], paths
