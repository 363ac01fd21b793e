"""`mesh_study`: does a critical pressure converge as the mesh is refined, and to what?

On every mesh the held ideal geometry has a critical pressure, but of film with fixed wrinkles it tends to
zero under refinement. A study computes the chart of all harmonics on a sequence of meshes, fits
p = p_inf + C h^q, and says in words what of it is a property of the balloon.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from lobefem import checks
from lobefem.display import Summarized, Summary, number
from lobefem.errors import InputError
from lobefem.fem.balloon import Balloon
from lobefem.geometry.isotensoid import Isotensoid
from lobefem.geometry.meridian import Lobe
from lobefem.model.film import Film, Isotropic
from lobefem.model.fixed_wrinkles import FixedWrinkles
from lobefem.model.tension_field import TensionField
from lobefem.progress import part, said
from lobefem.stability.continuum import continuum_pressure, unstable_from
from lobefem.stability.harmonic_buckling import HarmonicPressures, harmonic_pressures
from lobefem.stability.refinement import Trend, trend
from lobefem.typing import Comm

__all__ = ["DIVISIONS", "LOW", "PUBLISHED", "Continuum", "MeshStudy", "mesh_study"]

# of a lobe along its meridian, and around: the paper's 24 x 32 refined in both directions
DIVISIONS = tuple((3 * n // 4, n) for n in (24, 32, 36, 40, 48, 64, 96, 128))

LOW = (2, 3, 4, 5, 6)

# where isotropic film has its lowest critical pressure: n = 7 of the paper's lobe
_SEARCHED = range(2, 25)

# the paper's sec. 5: its film with fixed wrinkles, by number of lobes [Pa]
PUBLISHED = {1: 4600.0, 4: 3000.0}

_MAKING = 4000  # what a mesh costs before its harmonics, in nodes of one


@dataclass(frozen=True)
class Continuum:
    """One lobe with both rims held, without a mesh (`lobefem.stability.continuum`).

    Attributes:
        law: film law; "tension field, wrinkled" is that side of its kink in the ideal state and a lower
            bound, "tension field, mean" the mean of both sides and an upper bound.
        pressures: critical pressure of each low harmonic, by n [Pa].
        lowest: of all harmonics [Pa], 0 where some are unstable at any pressure.
        unstable_from: the lowest harmonic that is, None without one.
    """

    law: str
    pressures: dict[int, float]
    lowest: float
    unstable_from: int | None


@dataclass(frozen=True, repr=False)
class MeshStudy(Summarized):
    """Critical pressures on a sequence of meshes.

    Attributes:
        film: its law, as design files call it.
        lobes: number of lobes.
        charts: of each mesh, ordered by divisions around.
        lowest: how the lowest critical pressure of all harmonics moves.
        low: the same of each low harmonic, by n.
        continuum: what one lobe of this shape and film does without a mesh.
        published: a critical pressure from elsewhere [Pa], None without one.
        published_around: divisions around at which the lowest critical pressure passes it, None where
            no mesh of the study is on its other side.
        verdict: what it all means, in sentences.
    """

    film: str
    lobes: int
    charts: tuple[HarmonicPressures, ...] = field(repr=False)
    lowest: Trend
    low: dict[int, Trend]
    continuum: tuple[Continuum, ...]
    published: float | None
    published_around: float | None
    verdict: tuple[str, ...] = ()

    def _summary(self) -> Summary:
        rows = tuple(
            ("{} x {}".format(*c.divisions), number(c.pressure, "Pa"), f"n = {c.lowest}") for c in self.charts
        )
        behaviour = {"falls": "falls without limit", "open": "undecided"}
        found = behaviour.get(self.lowest.behaviour, f"converges to {number(self.lowest.limit, 'Pa')}")
        return Summary(f"critical pressure {found}", rows, ("mesh", "critical pressure", "harmonic"))

    @property
    def around(self) -> tuple[int, ...]:
        """Divisions around of each mesh."""
        return tuple(chart.divisions[1] for chart in self.charts)


def mesh_study(
    make_balloon: Callable[[tuple[int, int]], Balloon],
    divisions: Sequence[tuple[int, int]] = DIVISIONS,
    *,
    harmonics: int | Iterable[int] = LOW,
    published: float | None = None,
    comm: Comm = None,
    known: Sequence[HarmonicPressures] = (),
    keep: Callable[[HarmonicPressures], None] | None = None,
    progress: Callable[[str], None] | None = None,
) -> MeshStudy:
    """Critical pressures on a sequence of meshes, whether they converge, and what that means.

    Args:
        make_balloon: the balloon on given divisions (along a lobe's meridian, around): prestressed, of
            isotensoid lobes, linear, structured. One sector will do (`lobed_cylinder(sector=True)`).
        divisions: of the meshes, three or more, each with more around than the one before.
        harmonics: the low one or ones that are followed one by one.
        published: a critical pressure from elsewhere [Pa] to place on the curve; by default the paper's
            for its own balloon with fixed wrinkles and one lobe or four.
        comm: the ranks that share the harmonics, as for `harmonic_pressures`.
        known: charts of an earlier run, of meshes that are not to be looked at again.
        keep: called on all ranks with each new chart.
        progress: called with a line of text before each mesh.

    Raises:
        InputError: fewer than three meshes, meshes not in order, a harmonic that the coarsest lacks, or
            tension-field film, whose ideal state lies on a kink.
        EigenError: a harmonic's problem did not converge.

    Collective.
    """
    meshes = _checked(divisions)
    low = tuple(sorted(set(checks.integers("a harmonic", harmonics, 0))))
    if low and low[-1] > meshes[0][1] // 2:
        raise InputError(
            f"harmonic {low[-1]} is more than half of {meshes[0][1]} divisions around, the coarsest mesh's; "
            "give lower harmonics or finer meshes"
        )
    charts: list[HarmonicPressures] = []
    done = {chart.divisions: chart for chart in known}
    # harmonics take their share by the mesh's nodes; each mesh is made first, and at the end there is a fit
    sizes = [along * around for along, around in meshes]
    work = np.cumsum([0.0, *(_MAKING + size for size in sizes), _MAKING])
    for k, mesh in enumerate(meshes):
        if mesh in done and mesh != meshes[-1]:
            charts.append(done[mesh])
            continue
        ready = work[k + 1] - 0.75 * sizes[k]
        on_mesh = part(progress, ready / work[-1], work[k + 1] / work[-1])
        if progress is not None:
            progress(said(f"mesh study: {mesh[0]} x {mesh[1]} divisions", work[k] / work[-1]))
        balloon = make_balloon(mesh)
        _check_balloon(balloon)
        charts.append(done.get(mesh) or harmonic_pressures(balloon, comm=comm, progress=on_mesh))
        if keep is not None and mesh not in done:
            keep(charts[-1])
    film, lobes = balloon.film, balloon.surface.num_lobes
    if published is None and _is_the_papers(balloon):
        published = PUBLISHED.get(lobes)
    h = [1 / around for _, around in meshes]
    lowest = trend(h, [chart.pressure for chart in charts])
    followed = {n: trend(h, [chart[n] for chart in charts]) for n in low}
    shape = balloon.surface.lobe
    continuum = tuple(_continuum(name, one, shape, low) for name, one in _sides(film))
    passed = None if published is None else _crossing(charts, published)
    study = MeshStudy(film.name, lobes, tuple(charts), lowest, followed, continuum, published, passed)
    return replace(study, verdict=_verdict(study))


def _is_the_papers(balloon: Balloon) -> bool:
    """True if a balloon is that of which the paper gives critical pressures, to the digits it gives."""
    # where load and supports are others they change harmonics 0 and 1 only
    shape, film = balloon.surface.lobe, balloon.film
    papers = FixedWrinkles()
    numbers = [(shape.edge_radius, 2.0), (film.Et, papers.Et), (film.nu, papers.nu)]
    return (
        film.shares == papers.shares
        and isinstance(shape, Isotensoid)
        and all(math.isclose(value, given, rel_tol=1e-2) for value, given in numbers)
    )


def _checked(divisions: Sequence[tuple[int, int]]) -> list[tuple[int, int]]:
    meshes = [(int(along), int(around)) for along, around in divisions]
    if len(meshes) < 3:
        raise InputError(f"a mesh study of {len(meshes)} mesh(es) shows no trend; give three or more")
    if any(b[1] <= a[1] for a, b in pairwise(meshes)):
        raise InputError(f"the divisions around in {meshes} do not rise; give meshes from coarse to fine")
    return meshes


def _check_balloon(balloon: Balloon) -> None:
    if balloon.film.one_sided is not None:
        raise InputError(
            "the ideal state of tension-field film lies on the border of taut and wrinkled, where its "
            "tangent jumps, so there is no one critical pressure to refine; study isotropic film or fixed "
            "wrinkles, whose verdict has its bounds"
        )
    if balloon.film.shares is None:
        raise InputError(
            f"a mesh study is of isotropic film or fixed wrinkles, not of {type(balloon.film).__name__}"
        )
    if balloon.order != 1:
        raise InputError(
            "a mesh study needs linear cells (order 1): with curved ones a harmonic n of N divisions also "
            "holds the waves N - n"
        )


def _sides(film: Film) -> list[tuple[str, Film]]:
    """The film itself and, in the same material, the bounds of the tension field, and isotropic film."""
    material: dict[str, float] = {"E": film.E, "nu": film.nu, "thickness": film.thickness}
    sides: list[tuple[str, Film]] = [
        ("tension field, wrinkled", TensionField(**material, slack_stiffness=0.0)),
        # half of the isotropic hoop stiffness blended in: the mean of both sides
        ("tension field, mean", TensionField(**material, slack_stiffness=0.5)),
        ("isotropic", Isotropic(**material)),
    ]
    return [(film.name, film), *sides]


def _continuum(law: str, film: Film, shape: Lobe, low: Sequence[int]) -> Continuum:
    pressures = {n: continuum_pressure(n, film, shape) for n in low if n}
    first = unstable_from(film, shape)
    lowest = 0.0
    if first is None:
        lowest = min(continuum_pressure(n, film, shape, degree=14) for n in _SEARCHED)
    return Continuum(law, pressures, lowest, first)


def _crossing(charts: Sequence[HarmonicPressures], pressure: float) -> float | None:
    """Divisions around where the lowest critical pressure passes a value, on a line in log-log."""
    for coarse, fine in pairwise(charts):
        a, b = coarse.pressure, fine.pressure
        if math.isfinite(a) and b > 0 and b <= pressure <= a and a > b:
            share = math.log(a / pressure) / math.log(a / b)
            return float(coarse.divisions[1] * (fine.divisions[1] / coarse.divisions[1]) ** share)
    return None


# --- in words -----------------------------------------------------------------------------------
def _verdict(study: MeshStudy) -> tuple[str, ...]:
    first, last = study.charts[0], study.charts[-1]
    own, wrinkled, mean, isotropic = study.continuum
    span = (
        f"from {_pa(first.pressure)} (n = {first.lowest}) on {first.divisions[0]} x {first.divisions[1]} "
        f"divisions to {_pa(last.pressure)} (n = {last.lowest}) on {last.divisions[0]} x {last.divisions[1]}"
    )
    said = []
    if study.lowest.behaviour == "converges":
        said.append(
            f"The lowest critical pressure converges: {span}, limit "
            f"{_pa(study.lowest.limit, study.lowest.uncertainty)}{_without_mesh(study, own.lowest)}."
        )
    elif study.lowest.behaviour == "falls":
        rate = f" like (divisions around)^-{study.lowest.order:.1f}" if study.lowest.order > 0 else ""
        said.append(
            f"The lowest critical pressure does NOT converge: it falls {span},{rate} without a limit."
        )
    else:
        said.append(f"These meshes do not show whether the lowest critical pressure converges: {span}.")
    if own.unstable_from is not None:
        said.append(
            f"It tends to 0: in the continuum this film has no critical pressure, since from n = "
            f"{own.unstable_from} on every harmonic is unstable at any pressure"
            + (" (one lobe with its rims held; a stack is no stiffer)." if study.lobes > 1 else ".")
        )
    if study.published is not None:
        said.append(_placed(study))
    said += [_low(study), _others(wrinkled, mean, isotropic)]
    return tuple(sentence for sentence in said if sentence)


def _placed(study: MeshStudy) -> str:
    assert study.published is not None
    if study.published_around is None:
        return f"The published {_pa(study.published)} lies outside the pressures of these meshes."
    return (
        f"The published {_pa(study.published)} is the value at {study.published_around:.0f} divisions "
        "around: a point on this curve, not a property of the balloon."
    )


def _low(study: MeshStudy) -> str:
    """The low harmonics that do not depend on the mesh, with their limits."""
    own = study.continuum[0]
    words, open_ = [], []
    for n, one in study.low.items():
        if one.behaviour != "converges":
            open_.append(str(n))
            continue
        beside = _without_mesh(study, own.pressures[n]) if n > 1 else ""
        words.append(f"n = {n}: {_pa(one.limit, one.uncertainty)}{beside}")
    said = f"These do not depend on the mesh: {', '.join(words)}." if words else ""
    return said + (f" Not converged on these meshes: n = {', '.join(open_)}." if open_ else "")


def _without_mesh(study: MeshStudy, pressure: float) -> str:
    """Critical pressures of one lobe in the continuum; n >= 2 moves no plate: rims count as fixed."""
    known = study.lobes == 1 and 0 < pressure < math.inf
    return f" (without a mesh {_pa(pressure)})" if known else ""


def _others(wrinkled: Continuum, mean: Continuum, isotropic: Continuum) -> str:
    """Isotropic and tension-field film of the same material, one lobe without a mesh."""
    said = (
        f"Without a mesh, one lobe with its rims held: isotropic film {_pa(isotropic.lowest)}; tension-field "
        f"film, whose ideal state lies on the kink of taut and wrinkled, between {_pa(wrinkled.lowest)} "
        f"(wrinkled side) and {_pa(mean.lowest)} (mean of both sides)"
    )
    if wrinkled.unstable_from is not None:
        low = [
            f"n = {n}: {_pa(p)} to {_pa(mean.pressures[n])}"
            for n, p in wrinkled.pressures.items()
            if p and n > 1
        ]
        said += f"; the lower bound is 0 from n = {wrinkled.unstable_from} on" + (
            f", and by harmonics {', '.join(low)}" if low else ""
        )
    return said + "."


def _pa(pressure: float, uncertainty: float = math.nan) -> str:
    """A pressure in Pa or kPa, to four digits or to those that its uncertainty leaves."""
    if math.isinf(pressure):
        return "no pressure"
    unit, scale = ("kPa", 1e-3) if abs(pressure) >= 1e4 else ("Pa", 1.0)
    value, error = scale * pressure, scale * uncertainty
    if not error > 0:
        return f"{value:.4g} {unit}"
    digits = max(0, math.ceil(-math.log10(error)))
    return f"{value:.{digits}f} +- {error:.{digits}f} {unit}"
