"""A heading of a report and what is below it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from lobefem.viz.report_charts import Chart
from lobefem.viz.report_pictures import Picture
from lobefem.viz.report_tables import Table

__all__ = ["Folded", "Section"]


@dataclass(frozen=True)
class Folded:
    """Block that is folded, one click away."""

    title: str
    tables: Sequence[Table] = ()
    text: str = ""


@dataclass(frozen=True)
class Section:
    """A heading of the page and what is below it."""

    title: str
    id: str
    sentences: Sequence[str] = ()
    charts: Sequence[Chart] = ()
    tables: Sequence[Table] = ()
    pictures: Sequence[Picture] = ()
    folded: Sequence[Folded] = ()

    @property
    def is_empty(self) -> bool:
        """True if there is nothing below the heading."""
        return not (self.sentences or self.charts or self.tables or self.pictures or self.folded)
