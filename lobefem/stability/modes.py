"""Buckling modes of a state by SLEPc.

A mode solves K phi = lambda B phi with K the tangent in the free unknowns, not symmetric where the
`film` load meets moving plates, and B the mass of unit areal density (mesh independent) or the
identity on nodal displacements (the paper's). The state is stable while every lambda has a positive
real part.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import Any, get_args

import numpy as np

from lobefem import checks
from lobefem.equilibrium.newton import has_symmetric_stiffness
from lobefem.equilibrium.operator import Operator
from lobefem.equilibrium.state import Equilibrium
from lobefem.errors import EigenError, InputError
from lobefem.fem.balloon import Balloon
from lobefem.fem.functionals import largest, stiffness_scale
from lobefem.fem.rigid_motions import num_turns
from lobefem.files import on_all, share_of
from lobefem.linalg import petsc
from lobefem.linalg.slepc import Pair, distinct, order, refine, residual, run, solver, with_conjugates
from lobefem.log import logger
from lobefem.model.film import require_one_tangent
from lobefem.outcomes import RIGID
from lobefem.profiling import timed
from lobefem.stability.fourier import cyclic_order
from lobefem.stability.free_rotations import FreeRotations
from lobefem.stability.inertia import as_many, num_below, num_proved, shift_below, vary
from lobefem.stability.mode_kinds import kind_of
from lobefem.stability.mode_records import NEUTRAL, Mode, Modes, is_rotation, make_mode
from lobefem.typing import Comm, Mass, Vec

from slepc4py import SLEPc

__all__ = ["MASSES", "check_request", "find_modes"]

# runs of the eigensolver from random starts: where nothing proves that no copy is missing; at most, where
# something does; and those in a row that bring nothing new, after which it is given up
_USUAL, _MOST, _IDLE = 3, 40, 3

MASSES: tuple[str, ...] = get_args(Mass)

PREFIX = "lobefem_modes_"


@timed("eigensolver")
def find_modes(
    state: Equilibrium,
    count: int = 8,
    *,
    mass: Mass = "unit",
    tolerance: float = 1e-8,
    harmonics: int | Iterable[int] | None = None,
    comm: Comm | None = None,
) -> Modes:
    """The lowest modes of a state.

    Shift-invert about a shift below the whole spectrum, which the inertia of the (symmetric part of
    the) tangent proves: by Bendixson's theorem no eigenvalue has a real part below it.

    Where a gas is sealed in, its own stiffness is part of the tangent: under a given pressure it is not.

    Args:
        state: from `inflate` or `ideal_state`.
        count: how many; a complex pair that straddles the end is kept whole.
        mass: "unit" or "nodal".
        tolerance: of SLEPc.
        harmonics: look at this circumferential harmonic or these alone, each from one sector of a structured
            mesh (`lobefem.stability.cyclic`): no full tangent is assembled or factorised. Of a state of one
            sector they are needed, and n counts the phase between neighbours, 0 to N/2
            (`lobefem.stability.gore_modes`); its modes come in pairs as the full model's do.
        comm: the ranks that share the harmonics of a state of one sector; each by itself by default.

    Raises:
        InputError: an unknown mass, a count below 1, harmonics that the mesh does not have, or the ideal
            state of film whose tangent jumps there (`lobefem.stability.one_sided`).
        EigenError: fewer pairs converged than asked for.

    Collective.
    """
    checks.having("state", state, "balloon", "a state, from inflate or ideal_state")
    balloon = state.balloon
    asked = () if harmonics is None else checks.integers("a harmonic", harmonics, 0)
    check_request(balloon, count, mass)
    if balloon.surface.copies > 1 and not asked:
        raise InputError(
            f"this is a state of one of {balloon.surface.copies} equal sectors, whose modes are found "
            f"harmonic by harmonic; give harmonics, such as range({balloon.surface.copies // 2 + 1}) for all"
        )
    if balloon.gas is not None and 0 in asked:
        raise InputError(
            "harmonic 0 of a balloon with a sealed gas is not found from one sector; leave harmonics out, or "
            "0 of them: the others are those at the same pressure"
        )
    if _is_held(state):
        require_one_tangent(balloon.film, balloon.hoop_slack)
    if harmonics is not None:
        if balloon.map.tied:
            return _of_sector(state, count, mass, asked, balloon.comm if comm is None else comm)
        return _of_harmonics(state, count, mass, asked)
    q = state.restore()
    if balloon.floating:
        balloon = balloon.afloat()
        q = balloon.unknowns_of(state.balloon)
    B = balloon.mass(q, mass)
    rotations = FreeRotations(balloon, q, B)
    K = balloon.tangent(q)
    skew = petsc.asymmetry(K)
    symmetric = skew < petsc.SYMMETRIC
    if symmetric and balloon.load.convention == "film":
        symmetric = has_symmetric_stiffness(balloon, q)
        K = balloon.tangent(q)  # where other values were
    wanted = min(count + 2, balloon.map.size - len(rotations))
    A, M = rotations.bordered(K), rotations.bordered(B, constrained=False)
    eps = solver(A, M, wanted, symmetric, PREFIX)
    eps.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
    eps.setPurify(False)  # `run` does it anyway
    eps.setTolerances(tolerance, 500)
    st = eps.getST()
    st.setType(SLEPc.ST.Type.SINVERT)
    petsc.set_direct_solver(st.getKSP(), symmetric, inertia=symmetric)
    eps.setFromOptions()
    whole = Operator(balloon).at(q, K)
    shift = shift_below(_scale(balloon), eps, K, B, symmetric, len(rotations))

    def curvature(v: Vec, u: Vec) -> float:
        own = balloon.second_variation(q, v, u)
        return own if rotations.gas is None else own + rotations.gas.along(v, u)

    transposed = None if symmetric else rotations.through(st.getKSP().solveTranspose, A)
    cyclic = 0 if symmetric else cyclic_order(state.balloon, state.displacement)
    pairs: list[Pair] = []
    idle = 0
    for seed in range(1, _MOST + 1):
        vary(eps, shift, pairs, wanted, idle)
        new = [p._replace(x=rotations.cut(p.x), y=rotations.cut(p.y)) for p in run(eps, wanted, seed)]
        known = len(pairs)
        if pairs:  # values as good as those that they are compared with
            new = refine(distinct(new, B, shift), B, curvature, transposed, shift)
        pairs = refine(distinct([*pairs, *new], B, shift), B, curvature, transposed, shift)
        found = with_conjugates(pairs)
        least = min(count, len(found))
        # a complex pair that straddles the end is kept whole
        chosen = found[: least + (found[least - 1].value.imag > 0)]
        modes = [make_mode(balloon, q, p, residual(p, whole, B, shift, rotations.project)) for p in chosen]
        proved = num_proved(eps, found, least, shift, len(rotations)) if symmetric else None
        if symmetric:
            complete = proved is not None
        elif cyclic:
            complete = _paired(cyclic, found, modes, shift)
        else:  # what the symmetric part tells is a sign, no proof
            complete = seed == _USUAL or as_many(A, M, found, least, shift, len(rotations))
        if complete:
            break
        idle = 0 if len(pairs) > known else idle + 1
        if idle == _IDLE or seed == _MOST:
            raise EigenError(
                f"SLEPc missed copies of the lowest {count} modes in {seed} runs; a larger search space may "
                "have them: --petsc '-lobefem_modes_eps_ncv 200'"
            )
    negative = None
    if symmetric:  # where not all of them are below what was proved, they are counted
        negative = sum(pair.value.real < 0 for pair in found[:proved])
        if not proved or negative == proved:
            negative = num_below(eps, 0.0, len(rotations))
    eps.destroy()
    turns = [make_mode(balloon, q, p, 0.0) for p in rotations.pairs(curvature)]
    B.destroy()
    logger.info("modes at %g Pa: lowest %s", state.pressure, modes[0].value)
    return Modes(state, mass, symmetric, skew, negative, _with_rotations(modes, turns, count))


def _with_rotations(own: Sequence[Mode], turns: Sequence[Mode], count: int) -> tuple[Mode, ...]:
    """The lowest modes and the free rotations in order: `count` of them, with one at least that is none.

    A complex pair that straddles the end is kept whole.
    """
    modes = sorted([*own, *turns], key=lambda m: m.value.real)
    first = next(k for k, mode in enumerate(modes) if not mode.rigid)
    end = max(count, first + 1)
    return tuple(modes[: end + (len(modes) > end and modes[end - 1].value.imag > 0)])


def _is_held(state: Equilibrium) -> bool:
    """True if a state is the ideal one under load: its own stress, and nothing moved. Collective."""
    if not state.pressure == state.prestress != 0:
        return False
    return not state.balloon.comm.allreduce(int(np.any(state.unknowns)))


def check_request(balloon: Balloon, count: int, mass: Mass = "unit") -> None:
    """Refuse an unknown mass or an impossible number of modes with an InputError."""
    if mass not in MASSES:
        raise InputError(f"mass '{mass}' is unknown; use 'unit' or 'nodal'")
    if count < 1 or count > balloon.map.size:
        raise InputError(f"count = {count} modes: choose between 1 and {balloon.map.size}")


def _scale(balloon: Balloon) -> float:
    """A hundredth of p/sqrt(area), the stiffness scale of a pressurised film [Pa/m]."""
    pressure = max(abs(float(balloon.pressure.value)), abs(float(balloon.prestress.value)), 1e-3)
    return 1e-2 * stiffness_scale(balloon, pressure)


def _of_sector(state: Equilibrium, count: int, mass: Mass, harmonics: tuple[int, ...], comm: Comm) -> Modes:
    """The lowest modes of some harmonics of a state of one sector; values as often as the full model's."""
    # slow to import, as is SciPy with it
    from lobefem.stability.gore_modes import GoreMode, GorePencil, GoreSector

    balloon = state.balloon
    sector = GoreSector(balloon)
    for n in harmonics:
        sector.check(n)
    q = state.restore()
    pencil = GorePencil(sector, balloon, mass, _scale(balloon))
    free = num_turns(balloon)
    wanted = sorted(set(harmonics))
    most = {n: math.ceil(count / sector.copies(n)) + (free > 0 and n == 1) for n in wanted}
    asked = {n: 1 + (free > 0 and n == 1) for n in wanted}
    by_harmonic: dict[int, list[GoreMode]] = {}
    more, last = wanted, math.inf
    while more:  # where the highest of a harmonic is among the lowest of all, the next one may be, too
        for part in on_all(comm, partial(_lowest, pencil, {n: asked[n] for n in share_of(more, comm)})):
            by_harmonic |= part
        values = sorted(
            one.value for n, each in by_harmonic.items() for one in each for _ in range(sector.copies(n))
        )
        last = values[count + free - 1] if len(values) >= count + free else math.inf
        more = [n for n in wanted if asked[n] < most[n] and by_harmonic[n][-1].value <= last]
        asked |= {n: min(2 * asked[n], most[n]) for n in more}
    found = [one for n in wanted for one in by_harmonic[n]]
    skew = max(comm.allgather(pencil.asymmetry))
    modes: list[Mode] = []
    for one in found:
        if one.value > last:
            continue
        n, field = one.harmonic, sector.displacement(pencil.own, one.vector)
        field /= largest(balloon, field)
        rigid = is_rotation(balloon, q, field.real, field.imag)
        kind = RIGID if rigid else kind_of(balloon, field, n)
        for turned in (field, -1j * field)[: sector.copies(n)]:
            parts = turned.real.copy(), turned.imag.copy()
            modes.append(Mode(complex(one.value), one.residual, n, (n,), kind, *parts, balloon.X))
    negative = None
    if set(harmonics) == set(sector.harmonics):
        edge = -NEUTRAL * 1e2 * _scale(balloon)
        negative = pencil.num_below(edge, {n: sector.copies(n) for n in sector.harmonics})
    turns, own = ([m for m in modes if m.rigid is rigid] for rigid in (True, False))
    ascending = {n: sorted(one.value for one in found if one.harmonic == n) for n in wanted}
    firsts = tuple((n, values[1 if turns and n == 1 else 0]) for n, values in ascending.items())
    return Modes(state, mass, True, skew, negative, _with_rotations(own, turns, count), firsts)


def _lowest(pencil: Any, counts: Mapping[int, int]) -> dict[int, list[Any]]:
    """The lowest modes of some harmonics, as many of each as are asked for."""
    return {n: pencil.lowest(n, count) for n, count in counts.items()}


def _of_harmonics(state: Equilibrium, count: int, mass: Mass, harmonics: tuple[int, ...]) -> Modes:
    """The lowest modes of some harmonics, each value as often as the full model has it."""
    from lobefem.stability.cyclic import Sector  # slow to import, as is SciPy with it: all modes need neither
    from lobefem.stability.sector_modes import modes_of_harmonics

    balloon = state.balloon
    sector = Sector(balloon)
    for n in harmonics:
        sector.check(n)
    if not harmonics:
        raise InputError("no harmonics are given; leave them out for all")
    q = state.restore()
    sector.balloon.set_loads(state.pressure, state.prestress)
    found = modes_of_harmonics(
        sector,
        sector.restrict(balloon, q),
        sorted(set(harmonics)),
        count,
        mass=mass,
        scale=_scale(balloon),
        comm=balloon.comm,
    )
    modes: list[Mode] = []
    for one in found:
        vector = one.vector
        if sector.copies(one.harmonic) == 1:  # of a real matrix: its phase is arbitrary
            largest = vector[np.abs(vector).argmax()]
            vector = vector * (abs(largest) / largest)
        x, y = sector.expand(balloon, vector, one.harmonic)
        zero = x.duplicate()
        if sector.copies(one.harmonic) == 1:
            pairs = [Pair(complex(one.value.real), x, zero)]
        elif abs(one.value.imag) > 1e-8 * abs(one.value):
            # that of n, e^{i n theta}, and the conjugate, that of -n
            minus_y = y.copy()
            minus_y.scale(-1.0)
            pairs = sorted([Pair(one.value, x, y), Pair(one.value.conjugate(), x, minus_y)], key=order)
        else:  # real: the wave's cosine and its sine
            pairs = [Pair(complex(one.value.real), v, zero) for v in (x, y)]
        modes += [make_mode(balloon, q, pair, one.residual, one.harmonic) for pair in pairs]
    skew = max(one.asymmetry for one in found)
    turns = [mode for mode in modes if mode.rigid]
    modes = [mode for mode in modes if not mode.rigid]
    together = _with_rotations(modes, turns, count)
    return Modes(state, mass, all(one.hermitian for one in found), skew, None, together)


def _paired(sectors: int, pairs: list[Pair], modes: Sequence[Mode], shift: float) -> bool:
    """True if each real mode of a harmonic 0 < n < N/2 of a cyclic shape has its partner."""
    for mode in modes[:-1]:
        if mode.value.imag or not mode.harmonic % sectors:
            continue
        near = [p for p in pairs if abs(p.value - mode.value) <= 1e-6 * abs(mode.value - shift)]
        if len(near) < 2 and 2 * mode.harmonic % sectors:
            return False
    return True
