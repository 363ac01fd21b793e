"""The design files that come with lobefem: those of meshes/, which an installed package holds as well.

`lobefem/designs` is a link to meshes/ in the source tree and a folder of the same files in a wheel.
"""

from __future__ import annotations

import re
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

from lobefem.errors import InputError
from lobefem.files import replace
from lobefem.io.design_values import listed, nearest

if TYPE_CHECKING:
    from importlib.resources.abc import Traversable

__all__ = ["copy_design", "needed_files", "read_design", "shipped_designs"]


def _folder() -> Traversable:
    return resources.files("lobefem") / "designs"


def shipped_designs() -> dict[str, str]:
    """Names of the designs, and the first sentence of each."""
    found = sorted((file.name, file) for file in _folder().iterdir() if file.name.endswith(".toml"))
    return {name.removesuffix(".toml"): _title(file.read_text(encoding="utf-8")) for name, file in found}


def _title(text: str) -> str:
    """The first comment that is no directive, up to its full stop."""
    lines = text.splitlines()
    first = next(k for k, line in enumerate(lines) if line.startswith("# "))
    words = []
    for line in lines[first:]:
        if not line.removeprefix("#").strip():
            break
        words.append(line.removeprefix("#").strip())
    return re.split(r"\.(?: (?=[A-Z])|$)", " ".join(words))[0]


def read_design(name: str) -> str:
    """The text of a shipped design file.

    Raises:
        InputError: no such design.
    """
    names = tuple(shipped_designs())
    plain = name.removesuffix(".toml")
    if plain not in names:
        raise InputError(
            f"'{name}' is no design that comes with lobefem; use {listed(names)}{nearest(plain, names)}"
        )
    return (_folder() / f"{plain}.toml").read_text(encoding="utf-8")


def needed_files(name: str) -> list[str]:
    """Names of the files that a shipped design reads beside itself: a mesh, or a gore's table."""
    text = read_design(name)
    beside = [file.name for file in _folder().iterdir() if file.name.endswith((".msh", ".csv"))]
    return sorted(file for file in beside if f'"{file}"' in text)


def copy_design(name: str, folder: Path) -> list[Path]:
    """Write a shipped design with all that it needs, and the schema, into a folder.

    Args:
        name: of the design.
        folder: made if it is not there.

    Returns:
        the paths, the design's first.

    Raises:
        InputError: no such design, a folder that cannot be written, or one that has such a file.
    """
    plain = name.removesuffix(".toml")
    text, beside = read_design(plain), needed_files(plain)
    texts = {f"{plain}.toml": text} | {
        file: (_folder() / file).read_text(encoding="utf-8") for file in [*beside, "design.schema.json"]
    }
    for file in (f"{plain}.toml", *beside):  # the schema is the same for all
        if (folder / file).exists():
            raise InputError(f"'{folder / file}' exists; give another --out, or remove it")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for file, content in texts.items():
            replace(folder / file, content)
    except OSError as error:
        raise InputError(f"'{folder}' cannot be written ({error.strerror}); give another --out") from None
    return [folder / file for file in texts]
