"""Buckling modes of a state by SLEPc.

A mode solves K phi = lambda B phi with K the tangent in the free unknowns, not symmetric where the
`film` load meets moving plates, and B the mass of unit areal density (mesh independent) or the
identity on nodal displacements (the paper's). The state is stable while every lambda has a positive
real part.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from lobefem import _petsc, _whole, checks
from lobefem._glance import Glance, Glanceable
from lobefem._records import Frozen
from lobefem._snes import has_symmetric_stiffness
from lobefem.balloon import Balloon
from lobefem.eigenpairs import Pair, distinct, order, refine, residual, run, solver, with_conjugates
from lobefem.equilibrium import Equilibrium, require_whole
from lobefem.errors import EigenError, InputError
from lobefem.films import require_one_tangent
from lobefem.harmonics import label, spectrum
from lobefem.log import logger
from lobefem.measures import displacement_of, free_to_turn, largest, stiffness_scale
from lobefem.profiling import timed

# isort: split
from petsc4py import PETSc
from slepc4py import SLEPc

__all__ = ["MASSES", "NEUTRAL", "Mode", "Modes", "check_request", "find_modes", "make_mode"]

Array = npt.NDArray[np.float64]
_SEEDS = (1, 2, 3)  # of the eigensolver's random starts
MASSES = ("unit", "nodal")
PREFIX = "lobefem_modes_"
# eigenvalues below this share of p/sqrt(A) are no sign of instability where a support leaves turns
NEUTRAL = 1e-6


@dataclass(frozen=True)
class Mode(Frozen):
    """One eigenpair.

    Attributes:
        value: eigenvalue lambda [Pa/m with unit mass, N/m with nodal mass].
        residual: ||K phi - lambda B phi||/||K phi||.
        harmonic: dominant circumferential harmonic n.
        harmonics: all harmonics with at least a tenth of the mode, strongest first.
        kind: "sway", "twist", "global" or "local" (see `lobefem.harmonics.label`).
        displacement: this rank's nodal displacements of phi, ghosts included, (nodes, 3), real part,
            largest nodal displacement 1.
        displacement_imag: imaginary part on the same scale; zero for a real eigenvalue.
    """

    value: complex
    residual: float
    harmonic: int
    harmonics: tuple[int, ...]
    kind: str
    displacement: Array = field(repr=False)
    displacement_imag: Array = field(repr=False)


@dataclass(frozen=True, repr=False)
class Modes(Glanceable):
    """The lowest modes of a state, sorted by the real part of lambda.

    Attributes:
        state: the state that they belong to.
        mass: "unit" or "nodal".
        symmetric: whether the tangent was found symmetric, and the Hermitian solver used.
        asymmetry: max|K - K^T|/max|K|.
        num_negative: eigenvalues below zero in the whole spectrum by the inertia of K, None where K
            is not symmetric or single harmonics were looked at.
        modes: the pairs.
    """

    state: Equilibrium = field(repr=False)
    mass: str
    symmetric: bool
    asymmetry: float
    num_negative: int | None
    modes: tuple[Mode, ...]

    @property
    def values(self) -> npt.NDArray[np.complex128]:
        """Eigenvalues (count,)."""
        return np.array([m.value for m in self.modes])

    @property
    def stable(self) -> bool:
        """Whether all eigenvalues have a positive real part.

        Those of the turns that a pinned support leaves are zero but for round-off of either sign.
        """
        return bool(self.values.real.min() > -_neutral(self.state, self.mass))

    def to_pyvista(self, index: int = 0) -> Any:
        """The film with one mode as a PyVista grid on rank 0, None elsewhere. Collective.

        Points are where the state's nodes are. Point data "mode" and "mode_imag" (largest length 1), and the
        state's "displacement" [m]; cell data "lobe". `grid.warp_by_vector("mode", factor=0.3)` is the
        balloon as it moves. Rank 0 gathers all of it: see `lobefem._whole.gather` for what that takes.

        Raises:
            InputError: no such mode.
        """
        if not 0 <= index < len(self):
            raise InputError(f"mode {index} is not there; choose from 0 to {len(self) - 1}")
        balloon, mode = self.state.balloon, self[index]
        fields = {
            "displacement": self.state.displacement,
            "mode": mode.displacement,
            "mode_imag": mode.displacement_imag,
        }
        nodal = {name: _whole.at_nodes(balloon.V, field) for name, field in fields.items()}
        whole = _whole.gather(balloon.mesh, nodal, {"lobe": balloon.surface.lobe_numbers()})
        if whole is None:
            return None
        grid = _whole.to_pyvista(whole)
        grid.points = whole.x + whole.nodal["displacement"]
        grid.set_active_vectors("mode")
        return grid

    def _glance(self) -> Glance:
        unit = "Pa/m" if self.mass == "unit" else "N/m"
        rows = tuple(
            (
                f"{mode.kind}, n = {mode.harmonic}",
                f"{mode.value.real:.6g}" + (f" {mode.value.imag:+.3g}i" if mode.value.imag else ""),
                f"{mode.residual:.0e}",
            )
            for mode in self.modes
        )
        verdict = "stable" if self.stable else "unstable"
        title = f"{len(self)} lowest at {self.state.pressure:g} Pa, {verdict}"
        return Glance(title, rows, ("mode", f"eigenvalue [{unit}]", "residual"))

    def __len__(self) -> int:
        return len(self.modes)

    def __getitem__(self, index: int) -> Mode:
        return self.modes[index]


@timed("eigensolver")
def find_modes(
    state: Equilibrium,
    count: int = 8,
    *,
    mass: str = "unit",
    tolerance: float = 1e-8,
    harmonics: int | Iterable[int] | None = None,
) -> Modes:
    """The lowest modes of a state.

    Shift-invert about a shift below the whole spectrum, which the inertia of the (symmetric part of
    the) tangent proves: by Bendixson's theorem no eigenvalue has a real part below it.

    Args:
        state: from `inflate` or `ideal_state`.
        count: how many; a complex pair that straddles the end is kept whole.
        mass: "unit" or "nodal".
        tolerance: of SLEPc.
        harmonics: look at this circumferential harmonic or these alone, each from one sector of a structured
            mesh (`lobefem.cyclic`): no full tangent is assembled or factorised.

    Raises:
        InputError: an unknown mass, a count below 1, harmonics that the mesh does not have, or the ideal
            state of film whose tangent jumps there (`lobefem.kink`).
        EigenError: fewer pairs converged than asked for.

    Collective.
    """
    checks.having("state", state, "balloon", "a state, from inflate or ideal_state")
    balloon = state.balloon
    asked = () if harmonics is None else checks.integers("a harmonic", harmonics, 0)
    check_request(balloon, count, mass)
    require_whole(balloon)
    if _is_held(state):
        require_one_tangent(balloon.film, balloon.hoop_slack)
    if harmonics is not None:
        return _of_harmonics(state, count, mass, asked)
    q = state.activate()
    K, B = balloon.tangent(q), balloon.mass(q, mass)
    skew = _petsc.asymmetry(K)
    symmetric = skew < _petsc.SYMMETRIC
    if symmetric and balloon.load.convention == "film":
        symmetric = has_symmetric_stiffness(balloon, q)
        K = balloon.tangent(q)  # where other values were
    wanted = min(count + 2, K.getSize()[0])
    eps = solver(K, B, wanted, symmetric, PREFIX)
    eps.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
    eps.setPurify(False)  # `run` does it anyway
    eps.setTolerances(tolerance, 500)
    st = eps.getST()
    st.setType(SLEPc.ST.Type.SINVERT)
    _petsc.set_direct_solver(st.getKSP(), symmetric, inertia=symmetric)
    eps.setFromOptions()
    shift = _shift_below(balloon, eps, K, B, symmetric)

    def curvature(v: Any, u: Any) -> float:
        return balloon.second_variation(q, v, u)

    transposed = None if symmetric else st.getKSP().solveTranspose
    cyclic = 0 if symmetric else _cyclic_order(state)
    pairs: list[Pair] = []
    for seed in _SEEDS:
        st.setShift(shift)
        new = run(eps, wanted, seed)
        if pairs:  # values as good as those that they are compared with
            new = refine(distinct(new, B, shift), B, curvature, transposed, shift)
        pairs = refine(distinct([*pairs, *new], B, shift), B, curvature, transposed, shift)
        found = with_conjugates(pairs)
        # a complex pair that straddles the end is kept whole
        chosen = found[: count + (found[count - 1].value.imag > 0)]
        modes = tuple(make_mode(balloon, q, p, residual(p, K, B, shift)) for p in chosen)
        proved = _proved(eps, found, count, shift) if symmetric else None
        if symmetric:
            complete = proved is not None
        elif cyclic:
            complete = _paired(cyclic, found, modes, shift)
        else:  # what the symmetric part tells is a sign, no proof
            complete = seed == _SEEDS[-1] or _as_many(K, B, found, count, shift)
        if complete:
            break
    else:
        raise EigenError(f"SLEPc missed copies of the lowest {count} modes; try another count")
    negative = None
    if symmetric:  # where not all of them are below what was proved, they are counted
        negative = sum(pair.value.real < 0 for pair in found[:proved])
        if not proved or negative == proved:
            negative = _num_below(eps, 0.0)
    eps.destroy()
    B.destroy()
    logger.info("modes at %g Pa: lowest %s", state.pressure, modes[0].value)
    return Modes(state, mass, symmetric, skew, negative, modes)


def _is_held(state: Equilibrium) -> bool:
    """Whether a state is the ideal one under load: its own stress, and nothing moved. Collective."""
    if not state.pressure == state.prestress != 0:
        return False
    return not state.balloon.comm.allreduce(int(np.any(state.unknowns)))


def check_request(balloon: Balloon, count: int, mass: str = "unit") -> None:
    """Refuse an unknown mass or an impossible number of modes with an InputError."""
    if mass not in MASSES:
        raise InputError(f"mass '{mass}' is unknown; use 'unit' or 'nodal'")
    if count < 1 or count > balloon.map.size:
        raise InputError(f"count = {count} modes: choose between 1 and {balloon.map.size}")


def _symmetric_part(K: Any, symmetric: bool) -> Any:
    if symmetric:
        return K
    transposed = K.transpose(PETSc.Mat())
    transposed.axpy(1.0, K)
    transposed.scale(0.5)
    return transposed


def _shift_below(balloon: Balloon, eps: Any, K: Any, B: Any, symmetric: bool) -> float:
    """A shift below every eigenvalue's real part, by inertia of K's symmetric part; `eps` has it then.

    Where K is symmetric the factorisation that proves it is the one that the solver inverts with.
    """
    shift = -_scale(balloon)
    S = _symmetric_part(K, symmetric)
    while True:
        eps.setTarget(shift)
        if symmetric:
            below = _num_below(eps, shift)
        else:
            shifted = S.copy()
            shifted.axpy(-shift, B)
            below = _petsc.num_negative(shifted)
            shifted.destroy()
        if not below or shift <= -1e15:
            break
        shift *= 8
    if S is not K:
        S.destroy()
    return shift


def _num_below(eps: Any, value: float) -> int:
    """Number of eigenvalues below a value, by the inertia of a solver's own factorisation there. Collective.

    Where the user has chosen an iterative solver, a factorisation of its own tells.
    """
    st = eps.getST()
    if st.getKSP().getPC().getType() != PETSc.PC.Type.CHOLESKY:
        K, B = eps.getOperators()
        shifted = K.copy()
        shifted.axpy(-value, B)
        below = _petsc.num_negative(shifted)
        shifted.destroy()
        return below
    st.setShift(value)
    eps.setUp()  # which gives it its matrices, the first time
    st.setUp()
    ksp = st.getKSP()
    ksp.setUp()
    return int(ksp.getPC().getFactorMatrix().getInertia()[0])


def _scale(balloon: Balloon) -> float:
    """A hundredth of p/sqrt(area), the stiffness scale of a pressurised film [Pa/m]."""
    pressure = max(abs(float(balloon.pressure.value)), abs(float(balloon.prestress.value)), 1e-3)
    return 1e-2 * stiffness_scale(balloon, pressure)


def _of_harmonics(state: Equilibrium, count: int, mass: str, harmonics: tuple[int, ...]) -> Modes:
    """The lowest modes of some harmonics, each value as often as the full model has it."""
    from lobefem.cyclic import Sector  # slow to import, as is SciPy with it: all modes need neither
    from lobefem.sector_modes import modes_of_harmonics

    balloon = state.balloon
    sector = Sector(balloon)
    for n in harmonics:
        sector.check(n)
    if not harmonics:
        raise InputError("no harmonics are given; leave them out for all")
    q = state.activate()
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
        modes += [make_mode(balloon, q, pair, one.residual) for pair in pairs]
    end = count + (len(modes) > count and modes[count - 1].value.imag > 0)
    skew = max(one.asymmetry for one in found)
    return Modes(state, mass, all(one.hermitian for one in found), skew, None, tuple(modes[:end]))


def _proved(eps: Any, pairs: list[Pair], count: int, shift: float) -> int | None:
    """How many of the lowest pairs are all that there are below a gap past the wanted ones, by inertia.

    None where copies are missing, 0 where no gap is among the pairs. The solver's shift stays as it was.
    """
    values = [pair.value.real for pair in pairs]
    for k in range(count, len(values)):
        if values[k] - values[k - 1] > 1e-6 * abs(values[k] - shift):
            below = _num_below(eps, (values[k] + values[k - 1]) / 2)
            return k if below == k else None
    return 0


def _paired(cyclic_order: int, pairs: list[Pair], modes: tuple[Mode, ...], shift: float) -> bool:
    """Whether each real mode of a harmonic 0 < n < N/2 of a cyclic shape has its partner."""
    for mode in modes[:-1]:
        if mode.value.imag or not mode.harmonic % cyclic_order:
            continue
        near = [p for p in pairs if abs(p.value - mode.value) <= 1e-6 * abs(mode.value - shift)]
        if len(near) < 2 and 2 * mode.harmonic % cyclic_order:
            return False
    return True


def _as_many(K: Any, B: Any, pairs: list[Pair], count: int, shift: float) -> bool:
    """Whether as many pairs were found below a gap as K's symmetric part has there, or more.

    Its eigenvalues are close to K's, whose skew part is that of the plates' load alone. A state that kept
    no symmetry, turned as a whole say, may have double values all the same.
    """
    values = [pair.value.real for pair in pairs]
    for k in range(count, len(values)):
        if values[k] - values[k - 1] > 1e-3 * abs(values[k] - shift):
            S = _symmetric_part(K, False)
            S.axpy(-(values[k] + values[k - 1]) / 2, B)
            below = _petsc.num_negative(S)
            S.destroy()
            return below <= k
    return True


def _cyclic_order(state: Equilibrium) -> int:
    """How many sectors of a state are alike, 0 if it did not keep its surface's symmetry. Collective.

    A distorted state has simple eigenvalues.
    """
    order_of_symmetry = state.balloon.surface.cyclic_order
    if order_of_symmetry is None:
        return 0
    places = state.balloon.X + state.displacement  # nodes may have been moved by hand, too
    power = spectrum(state.balloon, places, np.zeros_like(places))
    power[::order_of_symmetry] = 0.0
    broken = math.sqrt(power.sum()) * largest(state.balloon, places)
    return order_of_symmetry if broken <= 1e-9 * math.sqrt(state.balloon.reference_area) else 0


def make_mode(balloon: Balloon, q: Any, pair: Pair, error: float) -> Mode:
    """What is said of an eigenvector in q of relative residual `error`. Collective."""
    real, imag = displacement_of(balloon, q, pair.x), displacement_of(balloon, q, pair.y)
    scale = largest(balloon, real + 1j * imag)
    real /= scale
    imag /= scale
    power = spectrum(balloon, real, imag)
    strongest = np.argsort(-power)
    harmonics = tuple(int(n) for n in strongest if power[n] >= 0.1)
    return Mode(
        value=pair.value,
        residual=error,
        harmonic=int(strongest[0]),
        harmonics=harmonics,
        kind=label(balloon, real, imag, power),
        displacement=real,
        displacement_imag=imag,
    )


def _neutral(state: Equilibrium, mass: str) -> float:
    """What eigenvalues of the turns that a pinned support leaves may be off zero; 0 without them."""
    balloon = state.balloon
    if not free_to_turn(balloon):
        return 0.0
    scale = balloon.reference_area / balloon.V.dofmap.index_map.size_global if mass == "nodal" else 1.0
    return NEUTRAL * scale * stiffness_scale(balloon, state.pressure)
