"""Values of command line options from their text; what cannot be is an InputError that names the option."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from lobefem.errors import InputError

if TYPE_CHECKING:
    from lobefem.io.design import Design

__all__ = [
    "chosen",
    "distortion",
    "divisions",
    "integer",
    "integers",
    "no_pressure",
    "one_of",
    "positive",
    "pressure",
    "settings",
    "share",
]


def pressure(name: str, text: str) -> float:
    """A positive pressure [Pa] from text, with or without its unit."""
    from lobefem.units import PRESSURE

    try:
        value = PRESSURE.read(text)
    except ValueError as error:
        raise InputError(f"{name}: {error}") from None
    if not 1e-15 <= value <= 1e15:  # as of the positive numbers of design files
        raise InputError(f"{name}: {text!r} is no positive pressure (1e-15 to 1e15 Pa); {PRESSURE.advice}")
    return value


def no_pressure(command: str, given: list[str] | None) -> None:
    """Refuse a pressure where one is looked for."""
    if given:
        end = ", up to --limit" if command == "critical" else ""
        raise InputError(
            f"--pressure: {command} looks for the pressure at which the balloon turns unstable{end}; lobefem "
            "modes says whether it is stable at a pressure that you give"
        )


def divisions(name: str, text: str | None) -> tuple[tuple[int, int], ...] | None:
    """Mesh divisions from "18x24,24x32,36x48"; None for None."""
    if text is None:
        return None
    pairs = []
    for part in text.split(","):
        ends = part.strip().split("x")
        if len(ends) != 2 or not all(end.isdecimal() and len(end) < 7 for end in ends):
            raise InputError(f"{name}: {text!r} is impossible; give divisions such as 18x24,24x32,36x48")
        pairs.append((int(ends[0]), int(ends[1])))
    return tuple(pairs)


def positive(name: str, text: str) -> float:
    """A positive finite number from text."""
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not 0 < value < float("inf"):
        raise InputError(f"{name}: {text!r} is no positive number; give one such as 0.1")
    return value


def share(name: str, text: str) -> float:
    """A share between 0 and 1 from "2%" or "0.02"."""
    number = text.strip()
    try:
        value = float(number.removesuffix("%")) / (100 if number.endswith("%") else 1)
    except ValueError:
        value = float("nan")
    if not 0 < value < 1:
        raise InputError(f"{name}: {text!r} is no share of the answer; give one such as 2% or 0.02")
    return value


def chosen(given: Mapping[str, str | None]) -> tuple[str, str]:
    """The one distortion that is given, as its option and its text."""
    found = [(name, text) for name, text in given.items() if text is not None]
    if len(found) != 1:
        raise InputError(f"perturb takes one distortion, not {len(found)}; give one of {', '.join(given)}")
    return found[0]


def distortion(name: str, text: str, design: Design) -> Any:
    """The distortion of a design that an option asks for."""
    if name == "--cleft":
        return _cleft(design)
    if name == "--harmonic-seed":
        return _harmonic_seed(text, design.size)
    from lobefem.equilibrium.distortions import Bend, Tip, Twist, Wave
    from lobefem.units import DEGREES, LENGTH

    harmonic = 0
    if name == "--wave":
        first, _, text = text.partition(":")
        harmonic = integer("--wave", first, 0)
    kind = DEGREES if name in ("--bend", "--twist") else LENGTH
    try:
        value = kind.read(text)
    except ValueError as error:
        raise InputError(f"{name}: {error}") from None
    if value == 0:
        raise InputError(f"{name}: {text!r} distorts nothing; give another number")
    if name == "--wave":
        return Wave(harmonic, value)
    kinds: dict[str, Any] = {"--tip-displacement": Tip, "--bend": Bend, "--twist": Twist}
    return kinds[name](value)


def _harmonic_seed(text: str, size: float) -> Any:
    """The distortion of --harmonic-seed.

    Args:
        text: harmonic and amplitude, a share of the size or a length, as "4:0.05" or "4:25 cm".
        size: radius of the balloon [m].
    """
    from lobefem.equilibrium.clefts import HarmonicSeed
    from lobefem.units import LENGTH, NUMBER

    name = "--harmonic-seed"
    first, colon, rest = text.partition(":")
    if not colon:
        raise InputError(f"{name}: {text!r} has no amplitude; give harmonic and share, such as 4:0.05")
    harmonic = integer(name, first, 2)
    try:
        amplitude = size * NUMBER.read(rest)
    except ValueError:
        try:
            amplitude = LENGTH.read(rest)
        except ValueError:
            raise InputError(
                f"{name}: {rest!r} is no share of the radius and no length; give one such as 4:0.05"
            ) from None
    if amplitude == 0:
        raise InputError(f"{name}: {text!r} distorts nothing; give another amplitude")
    return HarmonicSeed(harmonic, amplitude)


def _cleft(design: Design) -> Any:
    """The distortion of --cleft."""
    from math import degrees

    from lobefem.equilibrium.clefts import Cleft

    table, gores = design.cleft, design.shape.gores
    if gores is None:
        raise InputError(
            f"--cleft is one of a pumpkin's gores, and this design is of the kind {design.shape.kind!r}; try "
            "--wave"
        )
    if table.gores > gores // 2:
        raise InputError(f"cleft.gores = {table.gores} are more than half of the {gores} gores; give fewer")
    depth = 0.1 * design.size if table.depth is None else table.depth
    return Cleft(depth, 360.0 * table.gores / gores, degrees(table.turn))


def integer(name: str, text: str, least: int) -> int:
    """An integer from text, at least `least`."""
    if not text.strip().isdecimal() or len(text) > 9 or int(text) < least:
        raise InputError(f"{name}: {text!r} is impossible; give an integer, {least} or more")
    return int(text)


def integers(name: str, text: str | None) -> tuple[int, ...] | None:
    """Integers from "3", "0:8" (both ends) or "2,5,7"; None for None."""
    if text is None:
        return None
    numbers: list[int] = []
    for part in text.split(","):
        ends = [end.strip() for end in part.split(":")]
        if len(ends) > 2 or not all(end.isdecimal() and len(end) < 7 for end in ends):
            raise InputError(f"{name}: {text!r} is impossible; give integers such as 3, 0:8 or 2,5,7")
        first, last = int(ends[0]), int(ends[-1])
        numbers += range(first, last + 1)
    if not numbers:
        raise InputError(f"{name}: {text!r} holds no integer; give some such as 3, 0:8 or 2,5,7")
    return tuple(dict.fromkeys(numbers))


def one_of(name: str, word: str, words: tuple[str, ...]) -> None:
    """Refuse a word that is none of the known ones."""
    if word not in words:
        raise InputError(f"{name}: {word!r} is unknown; use {' or '.join(words)}")


def settings(name: str, texts: Iterable[str]) -> dict[str, Any]:
    """Values by key from "film.thickness=25 um": of TOML where they are, text otherwise."""
    values: dict[str, Any] = {}
    for text in texts:
        key, sign, value = (part.strip() for part in text.partition("="))
        section, _, rest = key.partition(".")
        if not (sign and section and rest and value):
            raise InputError(
                f"{name}: {text!r} is no section.key=value; give one such as film.thickness='25 um'"
            )
        if key in values:
            raise InputError(f"{name}: {key} is given twice; give it once")
        try:
            values[key] = tomllib.loads(f"value = {value}")["value"]
        except ValueError:
            values[key] = value
    return values
