"""Form finding: a cylinder of fixed-direction film becomes a lobe (paper sec. 5, figs 8-10).

Inflates the cylinder at rising pressures, compares the three shapes of fig. 9 with the closed form and
the meridional stress with eq. 4, and analyses the formed lobe at 5 Pa beside the exact isotensoid. Runs
serially or under mpirun.

    python demos/form_finding.py --out out/form
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

import lobefem.linalg.dolfinx_compat  # noqa: F401  first: it finds the stack

# isort: split
from command import exit_code, pair, parser
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from paper_words import Row, to_markdown

from lobefem import (
    Balloon,
    EndPlates,
    FixedWrinkles,
    Form,
    GasPressure,
    Hoops,
    Isotensoid,
    NaturalShape,
    critical_pressure,
    cylinder,
    find_form,
    find_modes,
    ideal_state,
    inflate,
    lobed_cylinder,
)
from lobefem.equilibrium.form_finding import row_means
from lobefem.files import save_json

from mpi4py import MPI

Array = npt.NDArray[np.float64]

SHOWN = (0.75, 10.0, 37.5)  # [Pa], of the paper's fig. 9
BETWEEN = (0.05, 3.0, 20.0)  # [Pa], drawn too, for fig. 8
PRESSURE = 5.0  # [Pa], of the analysis
ARC_OF_THE_PAPER = 5.0  # [m]

_STYLE: Any = {"font.size": 7, "axes.titlesize": 7.5, "axes.linewidth": 0.6, "figure.dpi": 300}


class Analysed(NamedTuple):
    """A formed lobe at 5 Pa: arc length of the rows of cells [m], and their N_phi [N/m]."""

    s: Array
    N_phi: Array
    displacement: float


def balloon(surface: Any) -> Balloon:
    """The paper's film, hoops, plates and bar on a surface, its own stress built in. Collective."""
    parts = [GasPressure("film"), Hoops(), EndPlates(support="clamped", bar=True)]
    return Balloon(surface, FixedWrinkles(), parts, prestressed=True)


def analyse(form: Form, divisions: tuple[int, int]) -> Analysed:
    """The formed lobe's equilibrium at 5 Pa with the paper's film. Collective."""
    state = inflate(balloon(form.surface(1, divisions)), PRESSURE)
    s = form.shape.stations(divisions[0])
    return Analysed((s[1:] + s[:-1]) / 2, row_means(state)[0, :, 0], state.max_displacement)


def summary(form: Form, exact: NaturalShape, analysed: Analysed) -> dict[str, Any]:
    """One form beside the closed form, in SI."""
    s = exact.stations(len(form.rings) - 1)
    off = np.hypot(form.rings[:, 0] - exact.radius(s), form.rings[:, 1] - exact.z(s)).max()
    # the same share of the arc is the same piece of film
    at = analysed.s / form.shape.arc_length * exact.arc_length
    N = exact.meridional_resultant(PRESSURE, exact.radius(at))
    return {
        "pressure": form.pressure,
        "Et": form.Et,
        "iterations": form.state.iterations,
        "m": form.shape.m,
        "exact_m": exact.m,
        "equator_radius": form.shape.R0,
        "exact_equator_radius": exact.R0,
        "arc_length": form.shape.arc_length,
        "exact_arc_length": exact.arc_length,
        "off_exact": off / exact.R0,
        "off_family": form.distance / exact.R0,
        "tension_spread": float(np.ptp(form.tension) / form.tension.mean()),
        "tension_error": float(np.abs(form.tension / form.pressure / exact.meridional_tension - 1).max()),
        "hoop_share": float(np.abs(form.N_theta).max() / form.N_phi.max()),
        "sigma_at_5_pascals": (analysed.N_phi / FixedWrinkles.thickness).tolist(),
        "sigma_error_at_5_pascals": float(np.abs(analysed.N_phi / N - 1).max()),
        "displacement_at_5_pascals": analysed.displacement,
    }


def later_steps(surface: Any) -> dict[str, Any]:
    """Lowest modes of the held lobes at 5 Pa and their critical pressure. Collective."""
    b = balloon(surface)
    modes = find_modes(ideal_state(b, PRESSURE), 4)
    critical = critical_pressure(b)
    return {
        "modes": [{"kind": m.kind, "harmonic": m.harmonic, "value": m.value.real} for m in modes.modes],
        "residual": modes.state.relative_residual,
        "critical_pressure": critical.pressure,
        "critical_harmonic": None if critical.mode is None else critical.mode.harmonic,
    }


def run(
    divisions: tuple[int, int] = (24, 32),
    out: str | Path = "out/form",
    *,
    between: Sequence[float] = BETWEEN,
    stack: int = 4,
    comm: Any = MPI.COMM_WORLD,
) -> dict[str, Any]:
    """The whole demo; returns its numbers on every rank. Collective.

    Args:
        divisions: of the cylinder and of each formed lobe, along and around.
        out: folder of figures and tables; the same on all ranks.
        between: forming pressures drawn besides those of the paper [Pa].
        stack: number of lobes of the stack that is analysed besides the single lobe.
        comm: MPI communicator.
    """
    out = Path(out)
    design = Isotensoid.from_edge_radius()
    flat = cylinder(design.edge_radius, design.height, divisions, comm=comm)
    forms = {p: find_form(flat, p) for p in sorted({*SHOWN, *between})}
    exact = {p: NaturalShape.inflated(design.edge_radius, design.height, f.Et, p) for p, f in forms.items()}
    analysed = {p: analyse(forms[p], divisions) for p in SHOWN}
    last = forms[SHOWN[-1]]
    numbers: dict[str, Any] = {
        "divisions": list(divisions),
        "radius": design.edge_radius,
        "length": design.height,
        "forms": [summary(forms[p], exact[p], analysed[p]) for p in SHOWN],
        "formed": {},
        "isotensoid": {},
    }
    for n in (1, stack):
        numbers["formed"][f"{n} lobe{'s' * (n > 1)}"] = later_steps(last.surface(n, divisions))
        numbers["isotensoid"][f"{n} lobe{'s' * (n > 1)}"] = later_steps(
            lobed_cylinder(n, divisions, comm=comm)
        )
    numbers["paper"] = [row._asdict() for row in compare(numbers)]
    if comm.rank == 0:
        out.mkdir(parents=True, exist_ok=True)
        _draw_shapes(forms, exact, analysed).savefig(out / "shapes.png")
        _draw_stress(last, analysed[last.pressure], design).savefig(out / "stress.png")
        (out / "table.md").write_text(table(numbers), encoding="utf-8")
    comm.Barrier()
    save_json(out / "form_finding.json", numbers, comm)
    return numbers


def table(numbers: dict[str, Any]) -> str:
    """All statements and numbers in Markdown."""
    rows = [Row(**row) for row in numbers["paper"]]
    return to_markdown(rows, _header(numbers)) + _tables(numbers)


# --- beside the paper ---------------------------------------------------------------------------


def compare(numbers: dict[str, Any]) -> list[Row]:
    """The paper's words on figs 8-10 beside what was found, with a verdict by the numbers."""
    low, middle, last = numbers["forms"]
    radii = [f["equator_radius"] for f in numbers["forms"]]
    arc = last["arc_length"]
    return [
        Row(
            "a cylinder 4.2 m long with a radius of 2.0 m; no E t is given",
            f"{numbers['length']:.4f} m, the height of the design's lobe; E t = {last['Et']:.1f} N/m by "
            "formula, so that 37.5 Pa give the isotensoid",
            "4.2 m is that height rounded",
        ),
        Row(
            "depending on the pressure, different shapes: 0.75, 10 and 37.5 Pa (fig. 9)",
            "equator radii {:.3f}, {:.3f} and {:.3f} m; closed form {:.3f}, {:.3f}, {:.3f} m".format(
                *radii, *(f["exact_equator_radius"] for f in numbers["forms"])
            ),
            _agree(low["off_exact"] < 5e-3 and middle["off_exact"] < 5e-3 and radii == sorted(radii)),
        ),
        Row(
            "at 37.5 Pa the surface is a piece of an isotensoid (fig. 9c)",
            f"rings within {100 * last['off_exact']:.2f} % of R0 of it; N_phi R constant within "
            f"{100 * last['tension_spread']:.2f} %; N_theta below {100 * last['hoop_share']:.2f} % of N_phi",
            _agree(last["off_exact"] < 5e-3 and last["tension_spread"] < 5e-3),
        ),
        Row(
            f"its meridian has an arc length of {ARC_OF_THE_PAPER:.0f} m",
            f"{arc:.3f} m; exact {last['exact_arc_length']:.3f} m",
            _agree(abs(arc / ARC_OF_THE_PAPER - 1) < 0.05)
            + (
                ""
                if abs(arc / ARC_OF_THE_PAPER - 1) < 0.05
                else ": no isotensoid of 5 m fits between these rims"
            ),
        ),
        Row(
            "sigma_phi at 5 Pa essentially identical to eq. 4 (fig. 10)",
            f"within {100 * last['sigma_error_at_5_pascals']:.2f} % in every row of cells; the lobe moves by "
            f"{1000 * last['displacement_at_5_pascals']:.1f} mm at most",
            _agree(last["sigma_error_at_5_pascals"] < 0.01),
        ),
    ]


def _agree(holds: bool) -> str:
    return "agrees" if holds else "differs"


def _header(numbers: dict[str, Any]) -> str:
    return (
        "Cylinder of fixed-direction film without any hoop or shear stiffness, inflated between held rims, "
        "{} x {} linear triangles; then one lobe of the formed surface with the paper's film, its stress "
        "built in, bottom plate clamped, bar.".format(*numbers["divisions"])
    )


def _tables(numbers: dict[str, Any]) -> str:
    """The forms beside the closed form, and the formed lobe beside the isotensoid."""
    lines = [
        "",
        "| forming pressure [Pa] | Newton steps | R0 [m] | closed form | m | closed form | "
        "off the closed form, of R0 | N_phi R constant within | sigma_phi at 5 Pa within |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for f in numbers["forms"]:
        cells = (
            f"{f['pressure']:g}",
            f"{f['iterations']}",
            f"{f['equator_radius']:.4f}",
            f"{f['exact_equator_radius']:.4f}",
            f"{f['m']:.4f}",
            f"{f['exact_m']:.4f}",
            f"{100 * f['off_exact']:.3f} %",
            f"{100 * f['tension_spread']:.2f} %",
            f"{100 * f['sigma_error_at_5_pascals']:.2f} %",
        )
        lines.append(f"| {' | '.join(cells)} |")
    lines += ["", "| 5 Pa, geometry held | formed | isotensoid | difference |", "|---|---|---|---|"]
    for name, formed in numbers["formed"].items():
        drawn = numbers["isotensoid"][name]
        pairs = [
            (f"{a['kind']} {a['harmonic']} [Pa/m]", a["value"], b["value"])
            for a, b in zip(formed["modes"], drawn["modes"], strict=False)
        ]
        what = f"critical pressure (n = {formed['critical_harmonic']}) [Pa]"
        pairs.append((what, formed["critical_pressure"], drawn["critical_pressure"]))
        lines += [f"| {name}, {w} | {a:.4g} | {b:.4g} | {100 * (a / b - 1):+.2f} % |" for w, a, b in pairs]
    return "\n".join(lines) + "\n"


# --- figures ------------------------------------------------------------------------------------


def _figure(width: float, height: float) -> Figure:
    figure = Figure(figsize=(width / 25.4, height / 25.4), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _draw_shapes(
    forms: dict[float, Form], exact: dict[float, NaturalShape], analysed: dict[float, Analysed]
) -> Figure:
    """Meridians on the way (fig. 8) and the three lobes seen from the side, coloured by stress (fig. 9)."""
    with rc_context(_STYLE):
        figure = _figure(180.0, 84.0)
        grid = figure.subplots(1, 1 + len(analysed), width_ratios=[1.1] + [1.0] * len(analysed))
        around = forms[SHOWN[-1]].state.balloon.surface.divisions[1]
        axes = grid[0]
        rim = forms[SHOWN[-1]].shape
        axes.plot([rim.edge_radius] * 2, [-rim.half_height, rim.half_height], color="0.6", lw=0.8, ls="--")
        for p, form in forms.items():
            s = exact[p].stations(100)
            colour = "#0072B2" if p in analysed else "0.55"
            axes.plot(exact[p].radius(s), exact[p].z(s), color=colour, lw=0.8)
            axes.plot(*form.rings.T, ".", color=colour, ms=2.2)
            axes.annotate(
                f"{p:g} Pa", (form.shape.R0, 0.0), (1.5, 0), textcoords="offset points", fontsize=5.5,
                rotation=90, va="center", color=colour,
            )  # fmt: skip
        axes.set(xlabel="distance from the axis [m]", ylabel="height [m]", aspect="equal", xlim=(1.85, 4.15))
        axes.set_title("Inflation of the cylinder\n(lines: closed form, dots: film's rings)", loc="left")
        top = max(float(a.N_phi.max()) for a in analysed.values()) / FixedWrinkles.thickness / 1e6
        for ax, (p, a) in zip(grid[1:], analysed.items(), strict=True):
            shape = forms[p].shape
            s, across = shape.stations(len(a.s)), np.sin(np.linspace(-np.pi / 2, np.pi / 2, around // 2 + 1))
            x, z = np.outer(shape.radius(s), across), np.tile(shape.z(s)[:, None], len(across))
            sigma = np.tile(a.N_phi[:, None] / FixedWrinkles.thickness / 1e6, len(across) - 1)
            drawn = ax.pcolormesh(x, z, sigma, vmin=0.0, vmax=top, cmap="viridis", ec=(0, 0, 0, 0.4), lw=0.1)
            ax.set(aspect="equal", xlim=(-4.0, 4.0), ylim=(-2.3, 2.3), xlabel="[m]")
            ax.set_title(f"formed at {p:g} Pa\n$m$ = {shape.m:.3f}, $R_0$ = {shape.R0:.3f} m", loc="left")
        bar = figure.colorbar(drawn, ax=list(grid[1:]), location="bottom", aspect=40)
        bar.set_label(rf"$\sigma_\phi$ at {PRESSURE:g} Pa [MPa]")
    return figure


def _draw_stress(form: Form, analysed: Analysed, design: Isotensoid) -> Figure:
    """sigma_phi along the meridian against eq. 4 (fig. 10), and the differences."""
    t = FixedWrinkles.thickness
    s = design.stations(200)

    def eq_4(s: Array) -> Array:
        return PRESSURE * design.radius(s) / (2 * t * np.sin(design.angle(s)))

    with rc_context(_STYLE):
        figure = _figure(85.0, 85.0)
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[2.2, 1])
        upper.plot(s, eq_4(s) / 1e6, color="0.3", lw=0.9, label="eq. 4, exact isotensoid")
        lower.axhline(0.0, color="0.3", lw=0.9)
        for at, N, marker, colour, name in (
            (form.s, form.N_phi * PRESSURE / form.pressure, "x", "#D55E00", "forming film, scaled to 5 Pa"),
            (analysed.s, analysed.N_phi, ".", "#0072B2", "formed lobe, analysed at 5 Pa"),
        ):
            at = at / form.shape.arc_length * design.arc_length
            upper.plot(at, N / t / 1e6, marker, color=colour, ms=3.5, mew=0.8, label=name)
            lower.plot(at, 100 * (N / t / eq_4(at) - 1), marker, color=colour, ms=3.5, mew=0.8)
        upper.set(ylabel=r"$\sigma_\phi$ [MPa]", ylim=(0, None))
        upper.legend(frameon=False, loc="lower right")
        upper.set_title(f"Meridional stress of the formed lobe at {PRESSURE:g} Pa", loc="left")
        lower.set(xlabel="arc length from the equator $s$ [m]", ylabel="off eq. 4 [%]")
        most = 1.15 * max(1.0, *(float(np.abs(line.get_ydata()).max()) for line in lower.lines))
        lower.set_ylim(-most, most)
        for axes in (upper, lower):
            axes.spines[["top", "right"]].set_visible(False)
    return figure


def main(argv: Sequence[str] | None = None) -> int:
    """Run the demo from the command line."""
    of = "of the cylinder along its axis, and around"
    line = parser("Form finding of a lobe (paper figs 8-10)", "out/form", "24x32", of)
    options, comm = line.parse_args(argv), MPI.COMM_WORLD
    divisions = pair(options, line)

    def task() -> list[str]:
        numbers = run(divisions, options.out, comm=comm)
        found = numbers["forms"][-1]["Et"]
        return [table(numbers), f"figures and tables are in {options.out}; E t = {found:.2f} N/m"]

    return exit_code(comm, task)


if __name__ == "__main__":
    sys.exit(main())
