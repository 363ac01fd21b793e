"""Runs side by side: what differs between them, and their numbers against that in one chart."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

from lobefem.stability.refinement import Trend, trend
from lobefem.units import scaled
from lobefem.viz.headline import Mark
from lobefem.viz.mesh_verdict import percent
from lobefem.viz.report_parameters import Point, parameter_chart, place, said
from lobefem.viz.report_part import Part
from lobefem.viz.report_provenance import flat
from lobefem.viz.report_section import Section
from lobefem.viz.report_tables import Table

__all__ = ["comparison", "with_meshes"]

_FINE = 0.03  # an error bar or a change from mesh to mesh that most designs bear


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
    meshes = chart is not None and leading == ["mesh.divisions"]
    sentences = _trend(parts, told) if meshes else []
    return Section("Comparison", "compare", sentences, [chart] if chart is not None else [], [table])


def with_meshes(parts: Sequence[Part]) -> list[Part]:
    """The same with what one mesh tells of another, if the runs differ in their meshes alone."""
    told = [_settings(part) for part in parts]
    keys = list(dict.fromkeys(key for one in told for key in one))
    differing = [key for key in keys if len({repr(one.get(key)) for one in told}) > 1]
    sizes, values, places = _ordered(parts, told)
    made = list(parts)
    if differing != ["mesh.divisions"] or len(places) < len(parts) or len(set(sizes)) < len(sizes):
        return made
    study = _judged(trend(sizes, values))
    for k, (coarse, fine) in enumerate(pairwise(places), 1):
        change = 100 * (values[k] / values[k - 1] - 1)
        text = f"{change:+.2g} % from {said(told[coarse]['mesh.divisions'])}".replace("-", "\N{MINUS SIGN}")
        head = made[fine].headline
        if any(mark.name == "Mesh" and mark.tone != "bad" for mark in head.marks):
            mark = Mark("Mesh", text, "good" if abs(change) < 100 * _FINE else "open")
            mark = study if study is not None and fine == places[-1] else mark
            marks = tuple(mark if one.name == "Mesh" else one for one in head.marks)
            made[fine] = replace(made[fine], headline=replace(head, marks=marks))
    return made


def _settings(part: Part) -> dict[str, Any]:
    """Settings of a run, by key."""
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


def _trend(parts: Sequence[Part], told: Sequence[Mapping[str, Any]]) -> list[str]:
    """Sentences on the trend of the number from mesh to mesh, and its limit."""
    sizes, values, _ = _ordered(parts, told)
    changes = [100 * (b / a - 1) for a, b in pairwise(values)]
    if not changes:
        return []
    words = ", ".join(f"{change:+.2g} %".replace("-", "\N{MINUS SIGN}") for change in changes)
    found = trend(sizes, values)
    unit = parts[0].headline.about.rpartition("[")[2].rstrip("]")
    if found.behaviour == "converges" and math.isfinite(found.error):
        end = f"The runs are a mesh study: its limit is {scaled(found.limit, unit)} ± {percent(found.error)}."
    elif found.behaviour == "falls":
        end = (
            "The runs are a mesh study: the number falls with refinement, with no limit in sight. Do not use "
            "it for design."
        )
    else:
        end = "Refine further while the last change is more than you can bear."
        end = f"These meshes do not show a limit. {end}" if len(values) > 2 else end
    return [f"From mesh to mesh the number changes by {words}. {end}"]


def _ordered(
    parts: Sequence[Part], told: Sequence[Mapping[str, Any]]
) -> tuple[list[float], list[float], list[int]]:
    """Mesh sizes, values and places of the runs that have both, from coarse to fine."""
    known = [
        (1 / at, part.headline.value, k)
        for k, (part, one) in enumerate(zip(parts, told, strict=True))
        if (at := place(one.get("mesh.divisions"))) and part.headline.value
    ]
    known.sort(key=lambda one: -one[0])
    sizes, values, places = ([one[k] for one in known] for k in range(3))
    return sizes, values, places  # type: ignore[return-value]


def _judged(found: Trend) -> Mark | None:
    """The mark of the finest mesh, from all of them; None where they do not tell."""
    if found.behaviour == "falls":
        return Mark("Mesh", "falls with refinement: not for design", "bad")
    if found.behaviour == "converges" and math.isfinite(found.error):
        text = f"± {percent(found.error)} ({len(found.values)} meshes)"
        return Mark("Mesh", text, "good" if found.error < _FINE else "open")
    return None
