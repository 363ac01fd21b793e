"""A run's results as one Excel workbook: single numbers with units and meanings, and each table a sheet."""

from __future__ import annotations

import io
import math
from collections.abc import Iterator, Sequence
from typing import Any

from lobefem.errors import InputError
from lobefem.io import spreadsheets
from lobefem.io.result_keys import COMMANDS, COMMON, described
from lobefem.io.run_reader import Run
from lobefem.typing import Unchecked

__all__ = ["NAME", "workbook"]

NAME = "results.xlsx"


def workbook(run: Run) -> bytes | None:
    """The file of a run; None of one without results.

    Raises:
        InputError: openpyxl is not installed.
    """
    if not run.results:
        return None
    try:
        from openpyxl import Workbook  # a part of this alone
    except ModuleNotFoundError:
        raise InputError("xlsx needs openpyxl: pip install 'openpyxl>=3.1', or use --to csv") from None
    book = Workbook()
    first: Any = book.active
    first.title = "results"
    _fill(first, [("key", "value", "unit", "meaning"), *_numbers(run)])
    for name, rows in spreadsheets.records(run).items():
        _fill(book.create_sheet(name.removesuffix(".csv")), rows)
    stream = io.BytesIO()
    book.save(stream)
    return stream.getvalue()


def _numbers(run: Run) -> Iterator[Sequence[Any]]:
    """Keys of results with one value, or a short list of them."""
    command = str(run.results.get("command"))
    for key, value in run.results.items():
        values = value if isinstance(value, list) else [value]
        if value is None or any(isinstance(one, (dict, list)) for one in values):
            continue
        known = described(command, key)
        unit, meaning = (COMMON | COMMANDS.get(command, {}))[known] if known else ("", "")
        text = "; ".join(map(str, values)) if isinstance(value, list) else value
        yield (key, text, unit, meaning)


def _fill(sheet: Any, rows: Sequence[Sequence[Any]]) -> None:
    """Write rows, the head in bold and in view; text stays text, whatever it begins with."""
    from openpyxl.styles import Font

    for k, row in enumerate(rows, 1):
        for column, value in enumerate(row, 1):
            cell = sheet.cell(row=k, column=column, value=_plain(value))
            if isinstance(value, str):
                cell.data_type = "s"
            if k == 1:
                cell.font = Font(bold=True)
    sheet.freeze_panes = "A2"
    for letter, width in zip("ABCD", (26, 22, 12, 90), strict=True):
        sheet.column_dimensions[letter].width = width if sheet.title == "results" else 18


def _plain(value: Unchecked) -> Any:
    """A value as a cell takes it: nothing for what is no number."""
    if value == "" or (isinstance(value, float) and not math.isfinite(value)):
        return None
    return value
