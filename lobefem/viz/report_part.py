"""One run's part of a report: its answer, chart, shapes and sections, be its results damaged."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from lobefem.io.run_reader import Run
from lobefem.log import logger
from lobefem.viz import (
    pumpkin_charts,
    pumpkin_pictures,
    report_charts,
    report_maps,
    report_pictures,
    report_provenance,
    report_shapes,
    report_tables,
)
from lobefem.viz.assumptions import assumptions
from lobefem.viz.headline import Headline, headline
from lobefem.viz.report_charts import Chart
from lobefem.viz.report_motion import motion
from lobefem.viz.report_parameters import sweep
from lobefem.viz.report_pictures import Picture
from lobefem.viz.report_pumpkin import pumpkin
from lobefem.viz.report_section import Folded, Section
from lobefem.viz.report_shapes import Scene
from lobefem.viz.report_tables import Table
from lobefem.viz.sweep_map import map_picture
from lobefem.viz.verdict import verdict

__all__ = ["Part", "part"]

_COMMANDS = {
    "inflate": "Equilibrium under gas pressure",
    "modes": "Buckling modes",
    "critical": "Critical pressure",
    "harmonics": "Critical pressure of each number of waves around",
    "mesh-study": "Critical pressure under mesh refinement",
    "perturb": "Distortion and release",
    "sweep": "Sweep",
    "sensitivities": "What makes the balloon more stable",
}

_DAMAGE = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError)


@dataclass(frozen=True)
class Part:
    """One run's part of the page.

    Attributes:
        run: as read.
        id: of its anchor.
        title: what was computed.
        subtitle: of what, in a line.
        headline: the answer.
        verdict: more sentences on it.
        faults: of the run or of its files, which must be seen.
        warnings: for who takes a number from the page.
        sections: below the answer.
        chart: the one beside the view, None without one.
        scene: what the view shows, None without a shape.
        pictures: of modes.
        pictures_left: number of modes without one.
    """

    run: Run
    id: str
    title: str
    subtitle: str
    headline: Headline
    verdict: list[str]
    faults: list[str]
    warnings: list[str]
    sections: list[Section]
    chart: Chart | None
    scene: Scene | None
    pictures: list[Picture]
    pictures_left: int
    still: Picture | None = field(default=None, repr=False)

    @property
    def picture(self) -> Picture | None:
        """The picture beside the answer: of the lowest mode, or of the shape."""
        own = self._own
        return own if own is not None else self.still

    @property
    def picture_view(self) -> str:
        """The view of that picture, with its run."""
        own = self._own
        if own is None or self.scene is None:
            return ""
        view = self.scene.mode(own.step, own.mode)
        return f"{self.id.removeprefix('run-')}:{view}" if view else ""

    @property
    def _own(self) -> Picture | None:
        """Of the mode that the answer names, or else of the lowest."""
        found = self.run.results.get("pressures")
        entries = found if isinstance(found, list) else []
        first = next(
            (k for k, e in enumerate(entries) if isinstance(e, dict) and e.get("stable") is False), None
        )
        wanted = [self.run.results.get(key) for key in ("kind", "harmonic")]
        for picture in self.pictures:
            mode = report_tables.stored_modes(self.run, picture.step)[picture.mode]
            if picture.step == first or (
                None not in wanted and [mode.get("kind"), mode.get("harmonic")] == wanted
            ):
                return picture
        # a picture of another mode than that of the answer would mislead
        return self.pictures[0] if self.pictures and None in wanted else None


def part(run: Run, name: str, room: int, pictures: int) -> Part:
    """Part of a report that shows one run.

    Args:
        run: as read.
        name: its anchor.
        room: bytes for its shapes.
        pictures: of modes at most.
    """
    results = run.results
    faults: list[str] = []

    def made[T](title: str, make: Callable[[Run], T]) -> T | None:
        try:
            return make(run)
        except _DAMAGE as error:
            logger.debug("report: %s: %r", title, error)
            faults.append(f"The results are damaged, so a part of '{title}' is missing.")
            return None

    drawn, left = made("Modes", partial(report_pictures.mode_pictures, most=pictures)) or ([], 0)
    scene = made("Shapes", partial(report_shapes.scene, room=room))
    mode = scene.mode if scene is not None else lambda step, mode: ""
    point = scene.point if scene is not None else lambda point: ""
    by_gores: Any = pumpkin_charts if "gores" in results else report_charts
    moving = made("Ramp and release", partial(motion, at=point)) or []
    charts = _present(
        made("Sweep", sweep),
        made("Eigenvalues", partial(by_gores.eigenvalues, show=mode)),
        made("Harmonics", partial(by_gores.harmonics, show=mode)),
        made("Mesh study", report_charts.refinement),
        *moving,
    )
    own = made("Gores and tendons", pumpkin)
    makers = (report_tables.pressures, report_tables.modes, report_tables.sweep, report_tables.sensitivities)
    tables = [made("Results", make) for make in makers]
    trends = made("Mesh study", report_tables.trends) or []
    of_stress = report_maps.stress_maps if own is None else _gore_maps
    maps = made("Stress and wrinkles", of_stress) or []
    whole = isinstance(results.get("gores"), int) and not drawn  # no mode is shown beside the answer
    portrait = made("Shape", _portrait) if whole else None
    taut = made("Stress and wrinkles", report_maps.taut_everywhere)
    convergence = made("Convergence", report_tables.convergence) or []
    answer = made("Answer", lambda run: headline(run.results))
    said = made("Answer", lambda run: verdict(run.results)) or []
    more = own or Section("", "")
    behind = (
        [Folded(f"The numbers of the chart: {charts[0].title}", [charts[0].table])]
        if charts and charts[0].table
        else []
    )
    sections = [
        Section("Numbers", f"{name}-numbers", _sentences(run), [*charts[1:], *more.charts],
                _present(*tables, *trends, *more.tables), _present(made("Map", map_picture)), behind),
        Section("Stress and wrinkles", f"{name}-stress", [taut] if taut else [],
                pictures=[*more.pictures, *maps]),
        Section("Details", f"{name}-details", tables=_present(made("Design", report_provenance.changes)),
                folded=_details(run, convergence)),
    ]  # fmt: skip
    return Part(
        run,
        name,
        str(results.get("title") or _COMMANDS.get(str(results.get("command")), run.name)),
        _subtitle(run),
        answer or Headline("open", "No verdict", "", "The results cannot be read."),
        said[1:] if said else [],
        [*_faults(run), *dict.fromkeys(faults)],
        [text for text in report_tables.warnings(run) if text not in _faults(run)],
        [section for section in sections if not section.is_empty],
        charts[0] if charts else None,
        scene,
        drawn,
        left,
        portrait,
    )


def _portrait(run: Run) -> Picture | None:
    """All gores of a pumpkin at the last pressure."""
    if not run.steps:
        return None
    step = run.steps[-1]
    title = f"All {run.results['gores']} gores at {report_pictures.pressure_name(step)}"
    alt = f"{title}, with their tendons, from the side."
    return Picture(title, alt, report_pictures.png(pumpkin_pictures.side_view(run, step)))


def _gore_maps(run: Run) -> list[Picture]:
    """Stress and the state of the film over one gore at the last pressure."""
    if not run.steps or "stress_resultants" not in run.steps[-1].cells:
        return []
    step = run.steps[-1]
    title = f"One gore at {report_pictures.pressure_name(step)}: stress resultants and state of the film"
    alt = f"{title}, over its width and length."
    return [Picture(title, alt, report_pictures.png(pumpkin_pictures.gore_map(run, step)), wide=True)]


def _faults(run: Run) -> list[str]:
    """Sentences that must be seen: a run that failed, files that cannot be read."""
    found = [f"The run failed: {run.results['error']}"] if run.results.get("error") else []
    return [text.rstrip(".") + "." for text in (*found, *run.faults)]


def _details(run: Run, convergence: Sequence[Table]) -> list[Folded]:
    found = [
        Folded("All numbers of this run", _present(report_tables.numbers(run))),
        Folded("How well the numbers are known", _present(*convergence)),
        Folded("The whole design", _present(report_provenance.design(run))),
        Folded("design.toml", text=run.design_text),
        Folded("Versions", _present(report_provenance.versions(run))),
        Folded("Log", text=run.log),
    ]
    return [one for one in found if one.tables or one.text]


def _sentences(run: Run) -> list[str]:
    """A demo's sentences on its meshes; those of a mesh study are its verdict."""
    found = run.results.get("verdict")
    if not isinstance(found, list) or run.results.get("command") == "mesh-study":
        return []
    return [str(sentence) for sentence in found]


def _present(*found: Any) -> list[Any]:
    """Blocks that are there, tables without rows left out."""
    return [one for one in found if one is not None and not (isinstance(one, Table) and not one.rows)]


def _subtitle(run: Run) -> str:
    """The design in a line."""
    results = run.results
    lobes, mesh, gores = results.get("lobes"), results.get("divisions"), results.get("gores")
    said = [] if lobes is None or gores else ["1 lobe" if lobes == 1 else f"{lobes} lobes"]
    said += [f"{gores} gores"] if gores else []
    said += [f"{results['film']} film"] if results.get("film") else []
    said += assumptions(results)
    if isinstance(mesh, list) and results.get("command") != "mesh-study":
        said.append("×".join(map(str, mesh)) + " divisions")
    return ", ".join(said)
