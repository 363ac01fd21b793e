"""Stability of a tension field where its tangent jumps, and beside it.

The ideal isotensoid carries no hoop stress: e2 + nu e1 = 0 in the principal strains, the boundary
between taut and wrinkled film. The energy has no second derivative there, but two one-sided ones. With
C_w the wrinkled tangent and C_t the taut (isotropic) one, in axes 11, 22 and shear angle,

    C_w = diag(E t, 0, G),   C_t = C_w + E t/(1 - nu^2) a a^T,   a = (nu, 1, 0),   G = E t/(2 (1 + nu)):

both states have the same shear stiffness, N1/(2 (e1 - e2)) with e1 - e2 = (1 + nu) N1/(E t). To second
order the potential grows along a motion u by q[u]/2, where q takes C_t at points where a . e(u) > 0 and
C_w at the others. So with the quadratic forms K_w and K_t of the two tangents

    K_w[u] <= q[u] <= K_t[u],   q[u] + q[-u] = K_w[u] + K_t[u],

and q is no quadratic form: it has no eigenvalues of its own, but bounds (where K is symmetric: rims held,
or `closed` load).

- Below the lowest critical pressure of K_w the film is stable against every motion: a lower bound.
- Above that of K_t it is unstable, and so it is above that of the mean (K_w + K_t)/2, because of u and -u
  one grows no more than the mean: the sharper upper bound. A motion of one harmonic n > 0 turns into its
  opposite when it is turned by half a wave: along it the growth is the mean's, exactly.
- The lowest value of q[u]/u . B u lies between the lowest eigenvalues of K_w and of the mean. The k-th
  eigenvalues are in the order wrinkled, mean, taut (Courant and Fischer).

With a hoop slack s > 0 built in, e2 + nu e1 = -s: the film is wrinkled, the energy smooth near by, and the
tangent is C_w with e1 - e2 = (1 + nu) N1/(E t) + s. It holds for motions that leave the film wrinkled, of
hoop strains below s; as s tends to 0 its critical pressures tend to those of K_w.

The wrinkled tangent's critical pressures converge under refinement for n <= 12 (paper's lobe, rims held);
from n = 13 on the continuum has none, for K_w is indefinite at any pressure. Over all harmonics its lowest
critical pressure belongs to the mesh, as that of fixed wrinkles does from n = 7 on.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from lobefem import checks
from lobefem.equilibrium.state import ideal_state
from lobefem.errors import EigenError, InputError
from lobefem.fem.balloon import Balloon
from lobefem.model.film import Film
from lobefem.progress import part
from lobefem.stability.harmonic_buckling import HarmonicPressures, Row, harmonic_pressures, pressure_limit
from lobefem.stability.linear_buckling import CriticalPressure, critical_pressure
from lobefem.stability.mode_records import Modes
from lobefem.stability.modes import check_request, find_modes
from lobefem.typing import Comm, Mass

__all__ = [
    "OneSidedModes",
    "OneSidedPressures",
    "has_kink",
    "one_sided_charts",
    "one_sided_modes",
    "one_sided_pressures",
    "slack_critical_pressure",
]

_TOLERANCE = 1e-9


@dataclass(frozen=True)
class OneSidedModes:
    """Spectra of the ideal state's tangents; see the module's text for what they bound.

    Attributes:
        wrinkled: of the wrinkled tangent: below.
        mean: of the mean of both: above, for the lowest one.
        taut: of the taut tangent.
    """

    wrinkled: Modes
    mean: Modes
    taut: Modes

    @property
    def bounds(self) -> tuple[float, float]:
        """Bounds of the least growth q[u]/u . B u over all motions [as the eigenvalues]."""
        return self.wrinkled.lowest, self.mean.lowest


@dataclass(frozen=True)
class OneSidedPressures:
    """Critical pressures of the ideal geometry's tangents; see the module's text for what they bound.

    Attributes:
        wrinkled: of the wrinkled tangent: below.
        mean: of the mean of both: above, and exact for a motion of one harmonic n > 0.
        taut: of the taut tangent.
    """

    wrinkled: CriticalPressure
    mean: CriticalPressure
    taut: CriticalPressure

    @property
    def bounds(self) -> tuple[float, float]:
        """Bounds of the pressure at which the film turns unstable [Pa]."""
        return self.wrinkled.pressure, self.mean.pressure


def has_kink(balloon: Balloon) -> bool:
    """True if the ideal state's energy has two tangents: tension-field film without hoop slack."""
    return balloon.film.one_sided is not None and not balloon.hoop_slack


def one_sided_modes(
    balloon: Balloon,
    pressure: float,
    count: int = 8,
    *,
    mass: Mass = "unit",
    harmonics: int | Iterable[int] | None = None,
) -> OneSidedModes:
    """The lowest modes of the wrinkled, the mean and the taut tangent of the ideal state.

    Args:
        balloon: prestressed, of tension-field film without hoop slack.
        pressure: p [Pa], positive.
        count: modes of each.
        mass: "unit" or "nodal".
        harmonics: as for `find_modes`.

    Raises:
        InputError: another film, hoop slack, no prestress, or a pressure that is not positive.
        EigenError: SLEPc failed.

    Collective.
    """
    films = _films(balloon)
    check_request(balloon, count, mass)
    if not pressure > 0:
        raise InputError(f"pressure = {pressure} Pa: unstressed film has no wrinkled tangent; give p > 0")
    chosen = None if harmonics is None else checks.integers("a harmonic", harmonics, 0)
    spectra = [
        find_modes(ideal_state(balloon.with_changes(film=film), pressure), count, mass=mass, harmonics=chosen)
        for film in films
    ]
    return OneSidedModes(*spectra)


def one_sided_pressures(balloon: Balloon, *, harmonic: int | None = None) -> OneSidedPressures:
    """The critical pressures of the wrinkled, the mean and the taut tangent of the ideal geometry.

    Without slack G does not depend on p, and K(p) = K_m + p K_g for all three.

    Args:
        balloon: prestressed, of tension-field film without hoop slack.
        harmonic: as for `critical_pressure`.

    Raises:
        InputError: another film, hoop slack, no prestress, or no such harmonic.
        EigenError: SLEPc failed.

    Collective.
    """
    branches = [balloon.with_changes(film=film) for film in _films(balloon)]
    return OneSidedPressures(*(critical_pressure(branch, harmonic=harmonic) for branch in branches))


def one_sided_charts(
    balloon: Balloon,
    harmonics: int | Iterable[int] | None = None,
    *,
    comm: Comm = None,
    known: Sequence[Mapping[int, Row]] = ({}, {}, {}),
    keep: Callable[[int, dict[int, Row]], None] | None = None,
    progress: Callable[[str], None] | None = None,
) -> tuple[HarmonicPressures, HarmonicPressures, HarmonicPressures]:
    """The critical pressures of each harmonic of the wrinkled, the mean and the taut tangent.

    Args:
        balloon: prestressed, of tension-field film without hoop slack; one sector will do.
        harmonics: as for `harmonic_pressures`.
        comm: the ranks that share the work.
        known: rows of an earlier run, as for `harmonic_pressures`, of each tangent.
        keep: called as for `harmonic_pressures`, with the tangent's number, 0 to 2, first.
        progress: called with a line of text for each harmonic of this rank.

    Raises:
        InputError: another film, hoop slack, no prestress, or no such harmonic.
        EigenError: a harmonic's problem did not converge.

    Collective.
    """
    chosen = None if harmonics is None else checks.integers("a harmonic", harmonics, 0)
    wrinkled, mean, taut = (
        harmonic_pressures(
            balloon.with_changes(film=film),
            chosen,
            comm=comm,
            known=known[side],
            keep=None if keep is None else partial(keep, side),
            progress=part(progress, side / 3, (side + 1) / 3),
        )
        for side, film in enumerate(_films(balloon))
    )
    return wrinkled, mean, taut


def slack_critical_pressure(balloon: Balloon, *, harmonic: int | None = None) -> CriticalPressure:
    """The critical pressure of film with a hoop slack s > 0, of its one smooth tangent.

    K(p) is not linear in p here, for G depends on p. The pencil K(p0) + (p - p0) K' is solved, K' a
    difference at p0, and its critical pressure is the next p0 (successive linear problems, Ruhe 1973).
    K(p)/p is concave in 1/p, so that the pencil lies above it: from above all reason the pressures fall
    towards the answer, and the first one at which K is singular is not missed.

    Args:
        balloon: prestressed, of tension-field film with hoop slack.
        harmonic: as for `critical_pressure`.

    Raises:
        InputError: another film, no hoop slack, no prestress, or no such harmonic.
        EigenError: SLEPc failed, or the pressures did not settle.

    Collective.
    """
    _check(balloon, balloon.film.turns)
    if not balloon.hoop_slack:
        raise InputError("without hoop slack a tension field has two tangents; use one_sided_pressures")
    p = pressure_limit(balloon)
    for _ in range(20):
        found = critical_pressure(balloon, harmonic=harmonic, at=(p, 1.01 * p))
        if found.mode is None or abs(found.pressure - p) <= _TOLERANCE * p:
            return found
        p = found.pressure
    raise EigenError(f"the critical pressure did not settle near {p:.6g} Pa; try another hoop_slack")


def _check(balloon: Balloon, fits: bool) -> None:
    if not fits:
        film = type(balloon.film).__name__
        raise InputError(f"{film} film has one tangent; use critical_pressure or find_modes")
    if not balloon.prestressed:
        raise InputError("the ideal state needs a prestressed balloon; pass prestressed=True")


def _films(balloon: Balloon) -> tuple[Film, Film, Film]:
    """Laws whose tangents at the ideal state are the wrinkled, the mean and the taut one."""
    checks.having("balloon", balloon, "reference_area", "a Balloon")
    films = balloon.film.one_sided
    _check(balloon, films is not None)
    assert films is not None
    if balloon.hoop_slack:
        raise InputError(
            f"film with hoop slack {balloon.hoop_slack:g} has one tangent; use slack_critical_pressure or "
            "find_modes"
        )
    return films
