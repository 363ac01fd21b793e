"""Parameter studies: one command over all combinations of designs, keys and options, from a TOML file."""

from __future__ import annotations

import hashlib
import itertools
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator

from lobefem.errors import InputError
from lobefem.io.design import Design
from lobefem.io.toml import read_toml
from lobefem.units import shown
from lobefem.version import __version__

__all__ = ["Point", "Study", "load"]

_MOST = 100_000  # points of a study; their designs alone then take minutes


class _File(BaseModel):
    """A study as its TOML file describes it."""

    model_config = ConfigDict(extra="forbid", strict=True)

    command: Literal["inflate", "modes", "critical", "harmonics", "perturb"]
    design: str | list[str]
    options: dict[str, str | bool | int | float] = Field(default_factory=dict)
    vary: dict[str, list[str | bool | int | float | list[Any]]] = Field(default_factory=dict)

    @field_validator("vary", mode="before")
    @classmethod
    def _flat(cls, tables: Any) -> Any:
        """`film.law = [...]` is a table in a table for TOML; "film.law" = [...] is not."""
        if not isinstance(tables, dict):
            return tables
        flat: dict[str, Any] = {}
        for key, value in tables.items():
            flat |= {f"{key}.{k}": v for k, v in value.items()} if isinstance(value, dict) else {key: value}
        for key, value in flat.items():
            if not isinstance(value, list) or not value:
                raise ValueError(f"vary.{key} = {shown(value)} is no list of values; write [1, 2, 4], say")
        return flat


_STEERED = "is not for single points; it is an option of lobefem sweep itself"

# options of the commands that a study cannot give
_OWN = {
    "design": "is no option; write design = [...] above the tables",
    "mesh-study": "has no critical pressure of one mesh; vary divisions instead",
    "out": _STEERED, "overwrite": _STEERED, "resume": _STEERED, "json": _STEERED,
}  # fmt: skip


@dataclass(frozen=True)
class Point:
    """One combination.

    Attributes:
        values: by the name of what varies.
        command: of the command line.
        options: of the command line.
        design: as TOML with all defaults filled in; empty where there is none.
        fault: why there is no such design.
    """

    values: Mapping[str, Any]
    command: str
    options: tuple[str, ...]
    design: str
    fault: str = ""

    @property
    def name(self) -> str:
        """Hash of the inputs."""
        inputs = [__version__, self.command, *self.options, self.design]
        return hashlib.sha256("\0".join(inputs).encode()).hexdigest()[:16]


@dataclass(frozen=True)
class Study:
    """The points to compute, as a sweep file defines them.

    Attributes:
        command: of the command line.
        varied: names of what varies.
        points: in the order of the file: the last thing that varies changes fastest.
        text: of the file.
    """

    command: str
    varied: tuple[str, ...]
    points: tuple[Point, ...]
    text: str


def load(path: str | Path, known: Mapping[str, Collection[str]]) -> Study:
    """Read a study's file and make its points.

    Args:
        path: of a TOML file; designs are found from its folder.
        known: options that each command has, without their dashes.

    Raises:
        InputError: a file that cannot be read or describes no study, an unknown option or key, or
            one of which no point has a sound design.
    """
    path = Path(path)
    file, text = _read(path)
    names = [file.design] if isinstance(file.design, str) else file.design
    if not names:
        raise InputError(f"{path}: design = [] leaves nothing to study; give a design file")
    varied = ({"design": names} if len(names) > 1 else {}) | file.vary
    for name in (*file.options, *file.vary):
        option = name.replace("_", "-")
        if option in _OWN:
            raise InputError(f"{path}: {shown(name)} {_OWN[option]}")
        if "." not in name and option not in known[file.command]:
            raise InputError(
                f"{path}: {shown(name)} is no option of lobefem {file.command}; see lobefem "
                f"{file.command} --help, or write section.key for a key of the design"
            )
    count = math.prod(len(values) for values in varied.values())
    if count > _MOST:
        raise InputError(f"{path}: {count} combinations are more than {_MOST}; vary less in one sweep")
    designs = {name: Design.load(path.parent / name) for name in names}
    points = [
        _point(file, designs, dict(zip(varied, values, strict=True)))
        for values in itertools.product(*varied.values())
    ]
    if all(point.fault for point in points):
        raise InputError(f"{path}: {points[0].fault}")
    return Study(file.command, tuple(varied), tuple(points), text)


def _read(path: Path) -> tuple[_File, str]:
    tables, text, fault = read_toml(path, "sweep file", "docs/howto/sweep.md")
    if tables is None:
        raise InputError(fault)
    try:
        return _File.model_validate(tables), text
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        if first["type"] == "value_error":
            raise InputError(f"{path}: {first['ctx']['error']}") from None
        where = ".".join(str(part) for part in first["loc"][:2])
        if first["type"] == "missing":
            raise InputError(f"{path}: there is no {where}; add one, see docs/howto/sweep.md") from None
        words = {"extra_forbidden": "is no key of a sweep; use command, design, options, vary"}
        says = words.get(first["type"], f"is impossible ({first['msg'].lower()}); see docs/howto/sweep.md")
        raise InputError(f"{path}: {where} = {shown(first['input'])} {says}") from None


def _point(file: _File, designs: Mapping[str, Design], values: Mapping[str, Any]) -> Point:
    base = designs[values["design"]] if "design" in values else next(iter(designs.values()))
    changes = {name: value for name, value in values.items() if "." in name}
    given = file.options | {k: v for k, v in values.items() if k != "design" and k not in changes}
    design, fault = "", ""
    try:
        design = base.with_overrides(changes).to_toml()
    except InputError as error:
        fault = str(error)
    options = tuple(word for name, value in given.items() for word in _words(name, value))
    return Point(values, file.command, options, design, fault)


def _words(name: str, value: Any) -> list[str]:
    """An option of the command line; a switch is there or is not."""
    option = "--" + name.replace("_", "-")
    if isinstance(value, bool):
        off = [option.replace("--", "--no-", 1)] if name in ("contact", "release", "prestress") else []
        return [option] if value else off
    return [option, str(value)]
