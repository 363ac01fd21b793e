"""Runs side by side: what differs between them, and their numbers against that in one chart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

from lobefem.viz.headline import Mark
from lobefem.viz.report_charts import Chart
from lobefem.viz.report_parameters import Point, parameter_chart, place, said
from lobefem.viz.report_part import Part
from lobefem.viz.report_provenance import flat
from lobefem.viz.report_section import Section
from lobefem.viz.report_tables import Table

__all__ = ["comparison", "with_meshes"]


def comparison(parts: Sequence[Part]) -> Section | None:
    """A table of runs and what differs, and a chart if they are of one kind and differ in one key or two."""
    told = [_settings(part) for part in parts]
    keys = list(dict.fromkeys(key for one in told for key in one))
    differing = [key for key in keys if len({repr(one.get(key)) for one in told}) > 1]
    leading = _leading(told, differing)
    head = ("run", *leading, "answer", "at")
    rows = [
        (part.run.name, *(said(one.get(key)) for key in leading), part.headline.word, part.headline.number)
        for part, one in zip(parts, told, strict=True)
    ]
    table = Table("Runs and what differs between them", head, tuple(rows))
    points = [
        Point(part.headline.value, one, f"{part.run.name}: {part.headline.word} {part.headline.number}")
        for part, one in zip(parts, told, strict=True)
        if part.headline.value is not None
    ]
    alike = len({part.headline.about for part in parts if part.headline.value is not None}) == 1
    chart = parameter_chart(points, leading, parts[0].headline.about) if alike else None
    sentences = [_trend(chart)] if chart is not None and leading == ["mesh.divisions"] else []
    return Section("Comparison", "compare", sentences, [chart] if chart is not None else [], [table])


def with_meshes(parts: Sequence[Part]) -> list[Part]:
    """The same with what one mesh tells of another, if the runs differ in their meshes alone."""
    told = [_settings(part) for part in parts]
    keys = list(dict.fromkeys(key for one in told for key in one))
    differing = [key for key in keys if len({repr(one.get(key)) for one in told}) > 1]
    values = [
        (place(one.get("mesh.divisions")), part.headline.value) for part, one in zip(parts, told, strict=True)
    ]
    if differing != ["mesh.divisions"] or any(at is None or not value for at, value in values):
        return list(parts)
    ordered = sorted(range(len(parts)), key=lambda k: values[k][0] or 0.0)
    made = list(parts)
    for coarse, fine in pairwise(ordered):
        change = 100 * (values[fine][1] / values[coarse][1] - 1)  # type: ignore[operator]
        text = f"{change:+.2g} % from {said(told[coarse]['mesh.divisions'])}".replace("-", "\N{MINUS SIGN}")
        head = made[fine].headline
        if any(mark.name == "Mesh" and mark.tone != "bad" for mark in head.marks):
            mark = Mark("Mesh", text, "good" if abs(change) < 3 else "open")
            marks = tuple(mark if one.name == "Mesh" else one for one in head.marks)
            made[fine] = replace(made[fine], headline=replace(head, marks=marks))
    return made


def _settings(part: Part) -> dict[str, Any]:
    """What a run was asked, by key."""
    results = part.run.results
    asked = {key: results[key] for key in ("command", "state", "distortion", "parameter") if key in results}
    return dict(flat(part.run.design)) | asked


def _leading(told: Sequence[Mapping[str, Any]], keys: Sequence[str]) -> list[str]:
    """Of the keys that differ those that the others follow: a film's law, not its slack stiffness."""
    found: list[str] = []
    for key in sorted(keys, key=lambda key: (-len({repr(one.get(key)) for one in told}), keys.index(key))):
        if not any(_follows(told, key, other) for other in found):
            found.append(key)
    return sorted(found, key=keys.index)[:4]


def _follows(told: Sequence[Mapping[str, Any]], key: str, other: str) -> bool:
    """True if equal values of `other` go with equal values of `key`."""
    seen: dict[str, str] = {}
    return all(
        seen.setdefault(repr(one.get(other)), repr(one.get(key))) == repr(one.get(key)) for one in told
    )


def _trend(chart: Chart) -> str:
    """How the number goes from mesh to mesh."""
    values = list(chart.series[0].y)
    changes = [100 * (b / a - 1) for a, b in pairwise(values) if a]
    if not changes:
        return ""
    told = ", ".join(f"{change:+.2g} %".replace("-", "\N{MINUS SIGN}") for change in changes)
    sentence = f"From mesh to mesh the number changes by {told}."
    if len(changes) > 1 and all(c < 0 for c in changes) and abs(changes[-1]) > 0.8 * abs(changes[0]) > 2:
        return f"{sentence} It falls with refinement: do not use it for design."
    return f"{sentence} Refine further while the last change is more than you can bear."
