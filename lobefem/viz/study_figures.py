"""Figures of studies: critical pressures by harmonic and by mesh, perturbations.

Matplotlib is used through its objects: no window system is needed, no global state is touched.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator

from lobefem.io.run_reader import Run
from lobefem.stability.branch_following import Branch
from lobefem.typing import Axes, Unchecked
from lobefem.units import pascals
from lobefem.viz import harmonic_curves, mode_figures, study_figures
from lobefem.viz.style import COLOURS, LEDGER, MM, STYLE

if TYPE_CHECKING:
    from lobefem.stability.harmonic_buckling import HarmonicPressures
    from lobefem.stability.mesh_convergence import MeshStudy
    from lobefem.stability.perturbation import Point

__all__ = ["curves", "harmonic_pressures_figure", "lowest_along_path", "perturbation", "refinement"]


def harmonic_pressures_figure(chart: HarmonicPressures, *, title: str = "", width: float = 85.0) -> Figure:
    """p_crit(n) on a logarithmic axis; harmonics that never turn unstable lie on the upper edge.

    Args:
        chart: from `lobefem.stability.harmonic_buckling`.
        title: over the figure; by default lobes and mesh.
        width: of the figure [mm].
    """
    n, p = np.array(chart.harmonics), np.array(chart.pressures)
    kinds = np.array(chart.kinds)
    crossing = np.isfinite(p) & (p > 0)
    lobes = "1 lobe" if chart.lobes == 1 else f"{chart.lobes} lobes"
    with rc_context(STYLE):
        figure = Figure(figsize=(width * MM, 0.72 * width * MM), layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.add_subplot()
        axes.set_yscale("log")
        axes.plot(n[crossing], p[crossing], "-", color="0.75", lw=0.7, zorder=1)
        for kind, colour in COLOURS.items():
            chosen = crossing & (kinds == kind)
            if chosen.any():
                axes.plot(n[chosen], p[chosen], "o", ms=3, color=colour, label=kind, zorder=2)
        low, high = (p[crossing].min(), p[crossing].max()) if crossing.any() else (1.0, 10.0)
        axes.set_ylim(low / 2, 4 * high)
        never = np.isinf(p)
        if never.any():
            axes.plot(
                n[never], np.full(never.sum(), 3 * high), "^", ms=3, mfc="none", mec="0.4", mew=0.7,
                label="never unstable",
            )  # fmt: skip
        if crossing.any():
            first = int(np.argmin(np.where(crossing, p, np.inf)))
            axes.annotate(
                f"{pascals(p[first])}, n = {n[first]}",
                (n[first], p[first]),
                xytext=(0, -8),
                textcoords="offset points",
                ha="center",
                va="top",
                fontsize=6.5,
            )
            axes.set_ylim(low / 3, 4 * high)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set(xlabel="harmonic $n$", ylabel="critical pressure [Pa]")
        mesh = f"{chart.divisions[0]} × {chart.divisions[1]} divisions"
        axes.set_title(title or f"{lobes}, {mesh}", loc="left")
        axes.spines[["top", "right"]].set_visible(False)
        axes.legend(frameon=False, fontsize=6, loc="best")
    return figure


def refinement(study: MeshStudy, *, title: str = "", width: float = 85.0) -> Figure:
    """Critical pressures against divisions around, both logarithmic: what converges and what does not.

    The lowest of all harmonics, each low harmonic with its limit at the right edge, and the published
    pressure with the divisions at which the lowest one passes it.

    Args:
        study: from `lobefem.stability.mesh_convergence`.
        title: over the figure; by default lobes and film.
        width: of the figure [mm].
    """
    around = np.array(study.around)
    lobes = "1 lobe" if study.lobes == 1 else f"{study.lobes} lobes"
    right = 1.18 * around[-1]
    with rc_context(STYLE):
        figure = Figure(figsize=(width * MM, 0.85 * width * MM), layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.add_subplot()
        axes.set(xscale="log", yscale="log", xlabel="divisions around", ylabel="critical pressure [Pa]")
        ends = []
        for n, one in study.low.items():
            p = _drawable(one.values)
            axes.plot(around, p, ".-", color="0.6", ms=2.5, lw=0.7, zorder=2)
            if one.behaviour == "converges":
                axes.plot(right, one.limit, "_", color="0.3", ms=5, mew=0.9, clip_on=False, zorder=3)
            last = one.limit if one.behaviour == "converges" else p[-1]
            if math.isfinite(last):
                ends.append((last, f"n = {n}"))
        lowest = _drawable(study.lowest.values)
        axes.plot(around, lowest, "o-", color=COLOURS["local"], ms=3.2, lw=1.2, zorder=4)
        axes.set_xticks(around, [str(n) for n in around])
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set(xlim=(0.93 * around[0], right))
        low, high = axes.get_ylim()
        axes.set_ylim(low * (low / high) ** 0.12, high)  # room for a name below the curve
        if high < 20 * low:
            axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 3, 5)))
            axes.yaxis.set_major_formatter("{x:.0f}")
            axes.yaxis.set_minor_locator(NullLocator())
        _name_ends(axes, right, ends)
        _name_lowest(axes, study, lowest)
        if study.published is not None:
            _place(axes, study.published, study.published_around)
        axes.text(0.03, 0.03, "bars: limits of single harmonics", transform=axes.transAxes, fontsize=5.5)
        axes.set_title(title or f"{lobes}, {study.film.replace('-', ' ')}", loc="left")
        axes.spines[["top", "right"]].set_visible(False)
    return figure


def _drawable(pressures: tuple[float, ...]) -> np.ndarray:
    """Pressures with gaps where there is none or it is zero, for a logarithmic axis."""
    p = np.array(pressures)
    return np.where(np.isfinite(p) & (p > 0), p, np.nan)


def _name_lowest(axes: Axes, study: MeshStudy, lowest: np.ndarray) -> None:
    known = np.flatnonzero(np.isfinite(lowest))
    if not known.size:
        return
    words = {"falls": "no limit", "converges": "converges", "open": "undecided"}[study.lowest.behaviour]
    axes.annotate(
        f"lowest of all harmonics: {words}",
        (study.around[known[-1]], lowest[known[-1]]),
        xytext=(0, -5),
        textcoords="offset points",
        ha="right",
        va="top",
        fontsize=6.5,
        color=COLOURS["local"],
    )


def _place(axes: Axes, pressure: float, around: float | None) -> None:
    """A published pressure as a line, and where the lowest critical pressure passes it."""
    blue = COLOURS["sway"]
    axes.axhline(pressure, color=blue, lw=0.7, ls=(0, (4, 3)), zorder=1)
    note = f"paper: {pressure:.0f} Pa" + (f",\nreached at {around:.0f} divisions" if around else "")
    axes.annotate(
        note,
        (around or axes.get_xlim()[0], pressure),
        xytext=(0.03, 0.42),
        textcoords="axes fraction",
        fontsize=6.5,
        color=blue,
        arrowprops={"arrowstyle": "-", "lw": 0.5, "color": blue, "shrinkB": 3},
    )
    if around:
        axes.plot(around, pressure, "D", ms=3.5, mfc="white", mec=blue, zorder=5)


def _name_ends(axes: Axes, right: float, ends: list[tuple[float, str]]) -> None:
    """Names beside the limits, pushed apart where they are close."""
    low, high = axes.get_ylim()
    gap, placed = 0.042 * math.log(high / low), -math.inf
    for value, name in sorted(ends):
        placed = max(math.log(value), placed + gap)
        axes.annotate(
            name,
            (right * 1.01, value),
            xytext=(right * 1.09, math.exp(placed)),
            va="center",
            fontsize=6,
            color="0.3",
            annotation_clip=False,
            arrowprops={"arrowstyle": "-", "lw": 0.4, "color": "0.5", "shrinkA": 0, "shrinkB": 0},
        )


def lowest_along_path(
    visited: Sequence[tuple[float, float]],
    *,
    title: str = "",
    critical: float | None = None,
    mode: str = "",
    width: float = 85.0,
) -> Figure:
    """The lowest eigenvalue at the pressures that a search along a path has visited.

    Args:
        visited: pressure [Pa] and lowest real part of lambda [Pa/m], in any order.
        title: over the figure.
        critical: the critical pressure that was found [Pa], None without one.
        mode: that turns unstable there.
        width: of the figure [mm].
    """
    p, lowest = np.array(sorted(visited)).T
    with rc_context(STYLE):
        figure = Figure(figsize=(width * MM, 0.72 * width * MM), layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.add_subplot()
        axes.axhline(0.0, color="0.2", lw=0.7, zorder=1)
        axes.plot(p, lowest, ".-", ms=3, lw=1.0, color=COLOURS["sway"])
        if critical is not None:
            axes.plot(critical, 0.0, "o", ms=4.5, mfc="white", mec="black", mew=0.9, zorder=5)
            axes.annotate(
                f"unstable from {critical:.0f} Pa\n({mode})",
                (critical, 0.0),
                xytext=(-5, -4),
                textcoords="offset points",
                ha="right",
                va="top",
                fontsize=6.5,
            )
            axes.set_ylim(min(lowest.min(), -0.22 * lowest.max()), None)
        axes.set(xlabel="pressure $p$ [Pa]", ylabel=r"lowest eigenvalue $\lambda$ [Pa/m]")
        axes.set_xlim(0, None)
        axes.set_title(title, loc="left")
        axes.spines[["top", "right"]].set_visible(False)
    return figure


def perturbation(history: Sequence[Point], *, unit: str, reaction_unit: str, width: float = 170.0) -> Figure:
    """Reaction over the ramp, then volume and energies over the release (paper figs 22 and 23).

    Args:
        history: steps of a perturbation.
        unit: of the parameter, "m" or "degrees".
        reaction_unit: "N" or "N m".
        width: of the figure [mm].
    """
    ramp = [p for p in history if p.time is None]
    motion = [p for p in history if p.time is not None and p.time > 0]
    factor = 180 / np.pi if unit == "degrees" else 1.0
    with rc_context(STYLE):
        count = 3 if motion else 2
        wide = width > 120
        height = 0.36 * width if wide else 0.6 * width * count
        figure = Figure(figsize=(width * MM, height * MM), layout="constrained")
        FigureCanvasAgg(figure)
        panels = figure.subplots(*((1, count) if wide else (count, 1)))
        axes = panels[0]
        axes.plot([factor * p.parameter for p in ramp], [p.reaction for p in ramp], ".-", ms=3, lw=1.0)
        axes.set(xlabel=f"distortion [{unit}]", ylabel=f"reaction [{reaction_unit}]", title="Ramp")
        axes = panels[1]
        if motion:
            time = [p.time for p in motion]
            axes.semilogx(time, [p.volume for p in motion], lw=1.0)
            axes.set(xlabel="time [s]", ylabel="volume [m³]", title="Release")
            axes = panels[2]
            terms = {
                "gas": [p.ledger.pressure for p in motion],
                "constraint": [p.ledger.constraint for p in motion],
                "strain": [-p.ledger.strain for p in motion],
                "contact": [-p.ledger.contact for p in motion],
                "damping": [-p.ledger.damping for p in motion],
                "sum": [p.ledger.closure for p in motion],
            }
            for (name, values), colour in zip(terms.items(), LEDGER, strict=True):
                axes.semilogx(time, values, lw=1.6 if name == "sum" else 1.0, color=colour, label=name)
            axes.set(xlabel="time [s]", ylabel="energy [J]", title="Ledger")
            axes.legend(frameon=False, fontsize=6, loc="center left", bbox_to_anchor=(1, 0.5))
        else:
            axes.plot([factor * p.parameter for p in ramp], [p.volume for p in ramp], ".-", ms=3, lw=1.0)
            axes.set(xlabel=f"distortion [{unit}]", ylabel="volume [m³]", title="Volume")
            axes.ticklabel_format(axis="y", useOffset=False)
        for axes in panels:
            axes.spines[["top", "right"]].set_visible(False)
    return figure


def curves(run: Run, width: float) -> Figure:
    """The figure of a run's curves: eigenvalues, a path, harmonics, meshes or a history.

    Args:
        run: that holds some.
        width: of the figure [mm].
    """
    results = run.results
    if "gores" in results:
        return harmonic_curves.curves(results, width=width)
    if results.get("branches"):
        branches = [
            Branch(
                b["kind"],
                b["harmonic"],
                b["rank"],
                np.array(b["pressures"], float),
                np.array(b["values"], float),
            )
            for b in results["branches"]
        ]
        return mode_figures.eigenvalue_curves(
            branches, mass=results["mass"], title=_name(results), width=width
        )
    if results.get("visited"):
        return study_figures.lowest_along_path(
            results["visited"],
            title=_name(results),
            critical=results["critical_pressure"],
            mode=f"{results['kind']}, n = {results['harmonic']}",
            width=width,
        )
    if results.get("chart"):
        return study_figures.harmonic_pressures_figure(_chart(results), width=width)
    if results.get("meshes"):
        return study_figures.refinement(_study(results), width=width)
    return study_figures.perturbation(
        _history(results), unit=results["unit"], reaction_unit=results["reaction_unit"], width=width
    )


def _name(results: dict[str, Any] | Any) -> str:
    lobes = "1 lobe" if results["lobes"] == 1 else f"{results['lobes']} lobes"
    return f"{lobes}, {results['film'].replace('-', ' ')}, {results['state']} state"


def _number(value: Unchecked, missing: float) -> float:
    return missing if value is None else float(value)


def _chart(results: Any) -> Any:
    from lobefem.stability.harmonic_buckling import HarmonicPressures

    rows = results["chart"]
    return HarmonicPressures(
        tuple(row["harmonic"] for row in rows),
        tuple(_number(row["critical_pressure"], math.inf) for row in rows),
        tuple(row["kind"] for row in rows),
        tuple(_number(row["residual"], math.nan) for row in rows),
        tuple(results["divisions"]),
        results["lobes"],
    )


def _study(results: Any) -> Any:
    from lobefem.stability.harmonic_buckling import HarmonicPressures
    from lobefem.stability.mesh_convergence import MeshStudy
    from lobefem.stability.refinement import Trend

    def trend(data: dict[str, Any]) -> Trend:
        values = tuple(_number(p, math.inf) for p in data["values"])
        limit, order, uncertainty, error = (
            _number(data[name], math.nan) for name in ("limit", "order", "uncertainty", "error")
        )
        return Trend(values, data["behaviour"], limit, order, uncertainty, error, data["asymptotic"])

    return MeshStudy(
        results["film"],
        results["lobes"],
        tuple(
            HarmonicPressures(
                (row["harmonic"],), (_number(row["critical_pressure"], math.inf),), ("",), (math.nan,),
                tuple(row["divisions"]), results["lobes"],
            )
            for row in results["meshes"]
        ),
        trend(results["lowest"]),
        {int(n): trend(data) for n, data in results["low_harmonics"].items()},
        (),
        results["published"],
        results["published_around"],
    )  # fmt: skip


def _history(results: Any) -> Any:
    from lobefem.equilibrium.energy_ledger import Ledger
    from lobefem.stability.perturbation import Point

    factor = math.pi / 180 if results["unit"] == "degrees" else 1.0
    names = {"reaction", "volume", "mid_hoop_displacement", "contact_force", "time", "residual"}
    ledger = Ledger.__dataclass_fields__
    return [
        Point(
            parameter=factor * p["parameter"],
            gap=None,
            ledger=Ledger(**{name: p["ledger"][name] for name in ledger}),
            **{name: p[name] for name in names},
        )
        for p in results["history"]
    ]
