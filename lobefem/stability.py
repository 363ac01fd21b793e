"""Buckling modes of a state by SLEPc.

A mode solves K phi = lambda B phi with K the tangent in the free unknowns, not symmetric where the
`film` load meets moving plates, and B the mass of unit areal density (mesh independent) or the
identity on nodal displacements (the paper's). The state is stable while every lambda has a positive
real part.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from lobefem import _petsc
from lobefem.balloon import Balloon
from lobefem.eigenpairs import Pair, distinct, refine, residual, run, solver, with_conjugates
from lobefem.equilibrium import Equilibrium
from lobefem.errors import EigenError, InputError
from lobefem.harmonics import label, spectrum
from lobefem.log import logger

# isort: split
from petsc4py import PETSc
from slepc4py import SLEPc

__all__ = ["MASSES", "Mode", "Modes", "check_request", "find_modes", "make_mode"]

Array = npt.NDArray[np.float64]
MASSES = ("unit", "nodal")
PREFIX = "lobefem_modes_"


@dataclass(frozen=True)
class Mode:
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


@dataclass(frozen=True)
class Modes:
    """The lowest modes of a state, sorted by the real part of lambda.

    Attributes:
        state: the state that they belong to.
        mass: "unit" or "nodal".
        symmetric: whether the tangent was found symmetric, and the Hermitian solver used.
        asymmetry: max|K - K^T|/max|K|.
        num_negative: eigenvalues below zero in the whole spectrum by the inertia of K, None where K
            is not symmetric.
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
        """Whether all eigenvalues have a positive real part."""
        return bool(self.values.real.min() > 0)

    def __len__(self) -> int:
        return len(self.modes)

    def __getitem__(self, index: int) -> Mode:
        return self.modes[index]


def find_modes(
    state: Equilibrium,
    count: int = 8,
    *,
    mass: str = "unit",
    tolerance: float = 1e-8,
) -> Modes:
    """The lowest modes of a state.

    Shift-invert about a shift below the whole spectrum, which the inertia of the (symmetric part of
    the) tangent proves: by Bendixson's theorem no eigenvalue has a real part below it.

    Args:
        state: from `inflate` or `ideal_state`.
        count: how many; a complex pair that straddles the end is kept whole.
        mass: "unit" or "nodal".
        tolerance: of SLEPc.

    Raises:
        InputError: an unknown mass or a count below 1.
        EigenError: fewer pairs converged than asked for.

    Collective.
    """
    check_request(state.balloon, count, mass)
    balloon = state.balloon
    q = state.activate()
    K, B = balloon.tangent(q), balloon.mass(q, mass)
    skew = _petsc.asymmetry(K)
    symmetric = skew < _petsc.SYMMETRIC
    shift, negative = _shift_below(balloon, K, B, symmetric)
    wanted = min(count + 2, K.getSize()[0])
    eps = solver(K, B, wanted, symmetric, PREFIX)
    eps.setTarget(shift)
    eps.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
    eps.setTolerances(tolerance, 500)
    st = eps.getST()
    st.setType(SLEPc.ST.Type.SINVERT)
    _petsc.set_direct_solver(st.getKSP(), symmetric)

    def curvature(v: Any, u: Any) -> float:
        return balloon.second_variation(q, v, u)

    transposed = None if symmetric else st.getKSP().solveTranspose
    pairs: list[Pair] = []
    for seed in (1, 2, 3):
        pairs = distinct([*pairs, *run(eps, wanted, seed)], B, shift)
        pairs = refine(pairs, B, curvature, transposed)
        found = with_conjugates(pairs)
        # a complex pair that straddles the end is kept whole
        chosen = found[: count + (found[count - 1].value.imag > 0)]
        modes = tuple(make_mode(balloon, q, p, residual(p, K, B, shift)) for p in chosen)
        if _complete(K, B, found, count, shift) if symmetric else _paired(state, found, modes, shift):
            break
    else:
        raise EigenError(f"SLEPc missed copies of the lowest {count} modes; try another count")
    eps.destroy()
    B.destroy()
    logger.info("modes at %g Pa: lowest %s", state.pressure, modes[0].value)
    return Modes(state, mass, symmetric, skew, negative if symmetric else None, modes)


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


def _shift_below(balloon: Balloon, K: Any, B: Any, symmetric: bool) -> tuple[float, int]:
    """A shift below every eigenvalue's real part, and the number of negative ones.

    Both by inertia of K's symmetric part; the first guess is a hundredth of p/sqrt(area), the
    stiffness scale of a pressurised film.
    """
    S = _symmetric_part(K, symmetric)
    pressure = max(abs(float(balloon.pressure.value)), abs(float(balloon.prestress.value)), 1e-3)
    shift = -1e-2 * pressure / math.sqrt(balloon.reference_area)
    negative = below = _petsc.num_negative(S)
    while below and shift > -1e15:
        shifted = S.copy()
        shifted.axpy(-shift, B)
        below = _petsc.num_negative(shifted)
        shifted.destroy()
        if below:
            shift *= 8
    if S is not K:
        S.destroy()
    return shift, negative


def _complete(K: Any, B: Any, pairs: list[Pair], count: int, shift: float) -> bool:
    """Whether the number of pairs below a gap past the wanted ones is the inertia there."""
    values = [pair.value.real for pair in pairs]
    for k in range(count, len(values)):
        if values[k] - values[k - 1] > 1e-6 * abs(values[k] - shift):
            S = K.copy()
            S.axpy(-(values[k] + values[k - 1]) / 2, B)
            proved = _petsc.num_negative(S)
            S.destroy()
            return proved == k
    return True


def _paired(state: Equilibrium, pairs: list[Pair], modes: tuple[Mode, ...], shift: float) -> bool:
    """Whether each real mode of a harmonic 0 < n < N/2 of a cyclic shape has its partner."""
    order_of_symmetry = state.balloon.surface.cyclic_order
    if order_of_symmetry is None or not _is_cyclic(state, order_of_symmetry):
        return True
    for mode in modes[:-1]:
        if mode.value.imag or not mode.harmonic % order_of_symmetry:
            continue
        near = [p for p in pairs if abs(p.value - mode.value) <= 1e-6 * abs(mode.value - shift)]
        if len(near) < 2 and 2 * mode.harmonic % order_of_symmetry:
            return False
    return True


def _is_cyclic(state: Equilibrium, order_of_symmetry: int) -> bool:
    """Whether a state kept its surface's symmetry; a distorted one has simple eigenvalues. Collective."""
    if not state.max_displacement:
        return True
    power = spectrum(state.balloon, state.displacement, np.zeros_like(state.displacement))
    power[::order_of_symmetry] = 0.0
    broken = math.sqrt(power.sum()) * state.max_displacement
    return broken <= 1e-9 * math.sqrt(state.balloon.reference_area)


def make_mode(balloon: Balloon, q: Any, pair: Pair, error: float) -> Mode:
    """What is said of an eigenvector in q of relative residual `error`. Collective."""
    real, imag = balloon.displacement_of(q, pair.x), balloon.displacement_of(q, pair.y)
    scale = balloon.largest(real + 1j * imag)
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
