"""Eigenvalues of the held ideal geometry over the pressure, as branches.

On a cyclic mesh every harmonic is a small problem of its own (`lobefem.stability.cyclic`), and with the
geometry held K(p) = K_m + p K_g: so all branches of a sweep cost little more than two assemblies.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import get_args

import numpy as np

from lobefem import checks
from lobefem.display import Summarized, Summary
from lobefem.equilibrium.inflation import Progress, inflate
from lobefem.equilibrium.state import Checkpoint, Equilibrium, ideal_state, require_drawn
from lobefem.errors import InputError, SolveError
from lobefem.fem.balloon import Balloon
from lobefem.linalg.banded import HERMITIAN, asymmetry, lowest
from lobefem.stability.branch_following import Branch, follow, unclear
from lobefem.stability.cyclic import Sector, own_pairs
from lobefem.stability.harmonic_buckling import sector_pencil
from lobefem.stability.mode_kinds import kind_of
from lobefem.stability.mode_records import Modes
from lobefem.stability.modes import check_request, find_modes
from lobefem.stability.sector_modes import mass_matrix
from lobefem.typing import Array, ComplexArray, Mass, StateKind

__all__ = ["STATES", "Trace", "branches", "trace"]

STATES: tuple[str, ...] = get_args(StateKind)


@dataclass(frozen=True, repr=False)
class Trace(Summarized):
    """Modes along a path.

    Attributes:
        state: "ideal" or "inflated".
        modes: the lowest ones at each pressure in the path's order, each with its `state`.
        branches: the same as curves over the pressure.
    """

    state: StateKind
    modes: tuple[Modes, ...] = field(repr=False)
    branches: tuple[Branch, ...]

    def _summary(self) -> Summary:
        rows = tuple(
            (
                b.name,
                f"{b.pressures[0]:.6g} to {b.pressures[-1]:.6g}",
                f"{b.values[0]:.5g} to {b.values[-1]:.5g}",
            )
            for b in self.branches
        )
        first = next((m.state.pressure for m in self.modes if not m.stable), None)
        verdict = "stable all along" if first is None else f"unstable at {first:g} Pa"
        title = f"{self.state} state at {len(self.modes)} pressures, {verdict}"
        return Summary(title, rows, ("branch", "pressures [Pa]", "eigenvalues"))

    @property
    def states(self) -> tuple[Equilibrium, ...]:
        """The state at each pressure."""
        return tuple(modes.state for modes in self.modes)

    @property
    def pressures(self) -> Array:
        """Pressures (points,) [Pa], refined ones included."""
        return np.array([state.pressure for state in self.states])


def trace(
    balloon: Balloon,
    pressures: Sequence[float],
    *,
    count: int = 8,
    state: StateKind = "ideal",
    mass: Mass = "unit",
    refinements: int = 0,
    progress: Progress | None = None,
) -> Trace:
    """The lowest modes along a path of pressures, and their branches.

    Args:
        balloon: prestressed for the ideal state.
        pressures: rising or falling [Pa].
        count: modes at each pressure.
        state: "ideal" or "inflated".
        mass: "unit" or "nodal".
        refinements: how often a step is halved in which modes mix (see `branch_following.unclear`).
        progress: called with a line of text now and then.

    Raises:
        InputError: an argument that cannot be used.
        SolveError: no equilibrium (`ConvergenceError`) or no modes (`EigenError`); its data["trace"]
            is the `Trace` up to there.

    Collective.
    """
    _check_state(balloon, state)
    check_request(balloon, count, mass)
    p = checks.numbers("the path of pressures", pressures, "Pa")
    steps = np.diff(p)
    if not p or not ((steps > 0).all() or (steps < 0).all()):
        raise InputError(f"pressures {list(pressures)} must rise or fall")
    if refinements < 0:
        raise InputError(f"refinements = {refinements} must be 0 or more")
    found: list[Modes] = []

    def at(pressure: float, start: Equilibrium | None) -> Modes:
        held = _state(balloon, state, pressure, start, progress)
        if progress is not None:
            progress(f"modes at {pressure:g} Pa")
        return find_modes(held, count, mass=mass)

    def between(first: Modes, second: Modes, left: int) -> list[Modes]:
        if not left or not unclear(first, second):
            return []
        middle = at((first.state.pressure + second.state.pressure) / 2, first.state)
        return [*between(first, middle, left - 1), middle, *between(middle, second, left - 1)]

    try:
        for pressure in p:
            modes = at(pressure, found[-1].state if found else None)
            if found:
                found += between(found[-1], modes, refinements)
            found.append(modes)
    except SolveError as error:
        error.data["trace"] = Trace(state, tuple(found), tuple(follow(found)))
        raise
    return Trace(state, tuple(found), tuple(follow(found)))


def _check_state(balloon: Balloon, state: StateKind) -> None:
    if state not in STATES:
        raise InputError(f"state '{state}' is unknown; use 'ideal' or 'inflated'")
    if state == "ideal" and not balloon.prestressed:
        raise InputError("the ideal state needs a prestressed balloon; pass prestressed=True")


def _state(
    balloon: Balloon,
    kind: StateKind,
    pressure: float,
    start: Equilibrium | Checkpoint | None,
    progress: Progress | None,
) -> Equilibrium:
    if kind == "ideal":
        return ideal_state(balloon, pressure)
    return inflate(balloon, pressure, start=start, progress=progress)  # type: ignore[arg-type]


def branches(
    balloon: Balloon,
    pressures: Sequence[float],
    *,
    count: int = 4,
    harmonics: int | Iterable[int] | None = None,
    mass: Mass = "unit",
) -> list[Branch]:
    """The lowest branches of each harmonic, for the held isotensoid with its stress proportional to p.

    Each rank solves the same small problems of one sector; rigid rotations that the supports leave are left
    out.

    Args:
        balloon: prestressed, on a cyclic mesh.
        pressures: ascending [Pa].
        count: branches of each harmonic; of n = 0 as many twists and as many others, or fewer.
        harmonics: that or those looked at; by default all that the mesh has, 0 to N/2.
        mass: "unit" or "nodal".

    Raises:
        InputError: the balloon is not prestressed, pressures do not ascend, or the mesh is not cyclic.

    Collective.
    """
    if not balloon.prestressed:
        raise InputError("a sweep of the ideal state needs a prestressed balloon; pass prestressed=True")
    require_drawn(balloon)
    check_request(balloon, count, mass)
    p = np.array(checks.numbers("the path of pressures", pressures, "Pa"))
    if p.size == 0 or (np.diff(p) <= 0).any():
        raise InputError(f"pressures {list(pressures)} must ascend")
    asked = () if harmonics is None else checks.integers("a harmonic", harmonics, 0)
    sector = Sector(balloon)
    M = mass_matrix(sector, sector.balloon.map.create_vector(), mass)
    K_m, K_g, _ = sector_pencil(sector)
    found: list[Branch] = []
    for n in sector.harmonics if harmonics is None else asked:
        K_mn, K_gn, M_n = (sector.reduce(A, n) for A in (K_m, K_g, M))
        # rows: pressures; columns: the lowest, ascending
        wanted = count if n else 4 * count  # of n = 0 there are two kinds
        hermitian = asymmetry(K_gn) < HERMITIAN
        turn = sector.rotation(sector.balloon.map.create_vector(), M_n, n)
        c = None if turn is None else M_n @ turn
        scale = 1e-2 / np.sqrt(balloon.reference_area * balloon.surface.copies)
        pairs = [
            own_pairs(
                sector,
                n,
                partial(lowest, K_mn + v * K_gn, M_n, scale=max(scale * v, 1e-6), hermitian=hermitian, c=c),
                wanted,
                K_mn.shape[0] - (c is not None),
            )[:2]
            for v in p
        ]
        if n == 0:
            both = _axisymmetric(pairs, p, 3 * sector.num_slots)
            found += [b for b in both if b.rank < count and len(b.values) == len(p)]
            continue
        values = np.array([values.real for values, _ in pairs])
        for k in range(values.shape[1]):
            kind = kind_of(sector.balloon, sector.displacement(pairs[-1][1][:, k], n), n)
            found.append(Branch(kind, n, k, p, values[:, k]))
    return found


def _axisymmetric(pairs: Sequence[tuple[ComplexArray, ComplexArray]], p: Array, film: int) -> list[Branch]:
    """Branches of n = 0, twists (mostly hoopwise) apart from the others."""
    rows: dict[tuple[str, int], list[tuple[float, float]]] = {}
    for pressure, (values, vectors) in zip(p, pairs, strict=True):
        components = (np.abs(vectors[:film]) ** 2).reshape(-1, 3, len(values)).sum(axis=0)
        ranks = {"twist": 0, "global": 0}
        for k, value in enumerate(values):
            kind = "twist" if components[1, k] > components[:, k].sum() / 2 else "global"
            rows.setdefault((kind, ranks[kind]), []).append((pressure, value.real))
            ranks[kind] += 1
    table = {key: np.array(points) for key, points in rows.items()}
    return [Branch(kind, 0, rank, t[:, 0], t[:, 1]) for (kind, rank), t in sorted(table.items())]
