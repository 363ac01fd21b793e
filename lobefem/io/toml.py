"""TOML files of a user: read with one sentence for whatever is wrong, and written.

What TOML itself says of a number with its unit, "Expected newline or end of document", helps nobody.
A line of which the reason can be told is quoted with what to write instead.
"""

from __future__ import annotations

import codecs
import json
import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from lobefem.units import shown

__all__ = ["read_toml", "to_toml"]

_MAX_BYTES = 50_000  # of a file; whatever it holds is then read in seconds

# what TOML says of a table or key given twice, and of a value that is none of its own
_TWICE = ("Cannot declare", "Cannot overwrite a value")

_NO_VALUE = ("Invalid value", "Expected newline or end of document", "Unclosed array")

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"

_WITH_UNIT = re.compile(rf"({_NUMBER})\s*([A-Za-zµμ][\w/^µμ]*)")

_COMMA = re.compile(r"[-+]?\d+,\d+(?:\s*[A-Za-zµμ][\w/^µμ]*)?")

_DIVISIONS = re.compile(r"(\d+)\s*[xX×]\s*(\d+)")

_WORD = re.compile(r"[A-Za-z][A-Za-z_-]*")

# what word processors make of quotes and blanks, and what browsers copy
_QUOTES = re.compile("[\u2018-\u201f\u2032\u2033\u00ab\u00bb]")

_BLANKS = re.compile("[\u00a0\u2000-\u200d\u202f\u2060\u3000\ufeff]")

_STRING = re.compile(r"\"[^\"]*\"|'[^']*'")

_DOT = re.compile(r"([-+]?)(\.\d+|\d+\.)([eE][-+]?\d+)?")


def read_toml(path: Path, what: str, see: str) -> tuple[dict[str, Any] | None, str, str]:
    """The tables of a TOML file.

    Args:
        path: of the file.
        what: it is, for messages: "design file".
        see: where there are examples, for messages.

    Returns:
        the tables, the file's text and ""; or None, "" and what is wrong with the file, in one sentence.
    """
    text = ""
    try:
        with path.open("rb") as file:
            content = file.read(_MAX_BYTES + 1)  # a device may have no end
        if len(content) > _MAX_BYTES:
            return None, "", f"{path} is no TOML (more than {_MAX_BYTES} bytes); see {see}"
        fault = _encoding(content)
        if fault:
            return None, "", f"{path}{fault}"
        text = content.removeprefix(codecs.BOM_UTF8).decode().replace("\r\n", "\n")
        return tomllib.loads(text), text, ""
    except FileNotFoundError:
        return None, "", f"there is no {what} {str(path)!r}; see {see}"
    except OSError as error:
        return None, "", f"cannot read {str(path)!r} ({error.strerror}); give a TOML {what}"
    except tomllib.TOMLDecodeError as error:
        told = _told(str(error), text)
        reason = str(error)  # which may quote a key of thousands of parts
        reason = reason if len(reason) <= 200 else f"{reason[:100]}...{reason[-60:]}"
        return None, "", f"{path}, {told}" if told else f"{path} is no TOML ({reason}); see {see}"
    except (ValueError, RecursionError):  # also an integer of thousands of digits
        return None, "", f"{path} is no TOML (not such a text); see {see}"


def _encoding(content: bytes) -> str:
    """A sentence on a file's bytes, to follow its path; "" for text in UTF-8."""
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) or b"\0" in content:
        return " is no text in UTF-8 but maybe in UTF-16; save it as UTF-8"
    try:
        text = content.decode()
    except UnicodeDecodeError as error:
        lines = content[: error.start].splitlines()
        number = max(len(lines), 1) + content[: error.start].endswith((b"\n", b"\r"))
        byte = f"byte 0x{content[error.start]:02x}"
        return f", line {number}: {byte} is no UTF-8 but maybe Latin-1; save it as UTF-8"
    bare = re.search("\r(?!\n)", text)
    if bare is None:
        return ""
    number = text[: bare.start()].count("\n") + 1
    return f", line {number} ends in a carriage return alone; save it with the line ends of Unix or Windows"


def _told(reason: str, text: str) -> str:
    """A sentence on the line at which reading ended, with the correction; "" if that is not clear."""
    found = re.search(r"at line (\d+)", reason)
    number = int(found[1]) if found is not None else text.rstrip("\n").count("\n") + 1  # the document's end
    line = text.split("\n")[number - 1].partition("#")[0]
    odd = _odd(line)
    if odd and not reason.startswith(_TWICE):
        return f"line {number}: {odd}"
    key, equals, value = (part.strip() for part in line.partition("="))
    if reason.startswith(_TWICE):
        return f"line {number}: {shown(key)[1:-1]} is there a second time; keep one of the two" if key else ""
    if found is None or not reason.startswith(_NO_VALUE):
        return ""
    if not equals or not value or "=" in value:
        return ""
    instead, why = _instead(value)
    if not instead:
        return ""
    return f"line {number}: {shown(value)[1:-1]} {why}; write {shown(f'{key} = {instead}')[1:-1]}"


def _odd(line: str) -> str:
    """A sentence on what a word processor has put into a line, and what to write; "" for a line without."""
    line = _STRING.sub("", line)  # within quotes any of them is fine
    quote, blank = _QUOTES.search(line), _BLANKS.search(line)
    if quote:
        return f'{quote[0]} is a curly quote; write the straight one, "'
    if blank:
        before = line[: blank.start()].rstrip()
        where = f" after {shown(before)[1:-1]}" if before else ""
        return f"there is a no-break or other special blank (U+{ord(blank[0]):04X}){where}; write a plain one"
    return ""


def _instead(value: str) -> tuple[str, str]:
    """The correction of a value and the reason; nothing for one that seems right."""
    if value[:1] == "[" and value[-1:] == "]":
        parts = [part.strip() for part in value[1:-1].split(",")]
        found = [_instead(part) for part in parts]
        first = next((why for instead, why in found if instead), "")
        mended = [instead or part for (instead, _), part in zip(found, parts, strict=True)]
        return (f"[{', '.join(mended)}]", f"holds what {first}") if first else ("", "")
    divisions = _DIVISIONS.fullmatch(value)
    if divisions:
        return f"[{divisions[1]}, {divisions[2]}]", "is no value of TOML"
    if _COMMA.fullmatch(value):
        whole = value.replace(",", ".")
        return _instead(whole)[0] or whole, "has a comma where a decimal point belongs"
    if _WITH_UNIT.fullmatch(value):
        return f'"{value}"', "is a number with a unit, which needs quotes"
    dot = _DOT.fullmatch(value)
    if dot:
        digits = "0" + dot[2] if dot[2][0] == "." else dot[2] + "0"
        return f"{dot[1]}{digits}{dot[3] or ''}", "needs digits on both sides of its point"
    if _WORD.fullmatch(value):
        if value.lower() in ("true", "false", "yes", "no"):
            return ("true" if value.lower() in ("true", "yes") else "false"), "is no value of TOML"
        return f'"{value}"', "is a word, which needs quotes"
    return "", ""


def to_toml(tables: Mapping[str, Mapping[str, Any] | Sequence[Mapping[str, Any]]]) -> str:
    """Sections of plain values, or lists of such, as TOML; what has no value is left out."""
    lines: list[str] = []
    for section, content in tables.items():
        one = isinstance(content, Mapping)
        for keys in [content] if isinstance(content, Mapping) else content:
            given = [f"{key} = {_value(value)}" for key, value in keys.items() if value is not None]
            if given:
                lines += ["", f"[{section}]" if one else f"[[{section}]]", *given]
    return "\n".join(lines[1:]) + "\n"


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return f"[{', '.join(map(_value, value))}]"
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{key} = {_value(one)}' for key, one in value.items())}}}"
    if not isinstance(value, str):
        return repr(value)
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")  # TOML escapes one more
