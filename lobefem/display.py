"""Records that tell their state at a glance: in one line by repr, as a table in a notebook."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass, field
from html import escape
from typing import Any

__all__ = ["Summarized", "Summary", "number"]

_ROWS = 5  # in one line


@dataclass(frozen=True)
class Summary:
    """Title and rows of an object's summary.

    Attributes:
        title: what it is and how it stands, in a few words.
        rows: cells of a table; those without anything to tell are left out.
        head: over the columns, if they need it.
    """

    title: str
    rows: tuple[tuple[str, ...], ...] = field(default=())
    head: tuple[str, ...] = ()


class Summarized(ABC):
    """Base class of results with a summary as their repr.

    It needs no communication, so that one rank alone may print it.
    """

    @abstractmethod
    def _summary(self) -> Summary:
        """The summary."""

    def __repr__(self) -> str:
        told = self._summary()
        rows = [" ".join(cell for cell in row if cell) for row in told.rows]
        more = ["..."] if len(rows) > _ROWS else []
        return f"{type(self).__name__}({'; '.join([told.title, *rows[:_ROWS], *more])})"

    def _repr_html_(self) -> str:
        told = self._summary()
        lines = [f"<table><caption><b>{type(self).__name__}</b>: {escape(told.title)}</caption>"]
        if told.head:
            lines.append(_row("th", told.head))
        for name, *cells in told.rows:
            first = f'<th scope="row" style="text-align:left">{escape(name)}</th>'
            lines.append(f"<tr>{first}{''.join(_cell('td', cell) for cell in cells)}</tr>")
        return "\n".join([*lines, "</table>"])


def _row(tag: str, cells: Iterable[str]) -> str:
    return f"<tr>{''.join(_cell(tag, cell) for cell in cells)}</tr>"


def _cell(tag: str, text: str) -> str:
    return f"<{tag}>{escape(text)}</{tag}>"


def number(value: Any, unit: str = "", digits: int = 6) -> str:
    """A number with its unit; "none" for None."""
    return "none" if value is None else f"{value:.{digits}g} {unit}".strip()
