"""`critical_pressure`: where the held ideal geometry turns unstable, as an eigenvalue itself.

With the geometry held at the ideal isotensoid and its stress proportional to p, the tangent is
K(p) = K_m + p K_g, and K_m phi = -p K_g phi has the critical pressures for eigenvalues. Of fixed
wrinkles the lowest one belongs to the mesh: it tends to zero under refinement (physics, sec. 5).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from lobefem import _petsc
from lobefem.balloon import Balloon
from lobefem.cyclic import CyclicReduction
from lobefem.eigenpairs import Pair, distinct, order, residual, run, solver
from lobefem.errors import EigenError, InputError
from lobefem.harmonics import spectrum
from lobefem.stability import Mode, check_request, make_mode

# isort: split
from petsc4py import PETSc
from slepc4py import SLEPc

__all__ = ["CriticalPressure", "beyond_reason", "critical_pressure", "of_pencil"]

PREFIX = "lobefem_critical_"


@dataclass(frozen=True)
class CriticalPressure:
    """The lowest pressure at which the held ideal geometry loses stability.

    Attributes:
        pressure: p [Pa]; inf where no pressure makes it unstable, 0 where any does.
        mode: the mode that turns unstable (its value is 0), None without one.
        pressures: the critical pressures that were found, ascending [Pa].
        divisions: (along a lobe, around) of the mesh it depends on, None on an unstructured one.
        harmonic: the harmonic that was asked for, None for the lowest of all.
    """

    pressure: float
    mode: Mode | None
    pressures: tuple[float, ...]
    divisions: tuple[int, int] | None
    harmonic: int | None = None


def critical_pressure(balloon: Balloon, *, harmonic: int | None = None, count: int = 2) -> CriticalPressure:
    """The pressure at which the held ideal geometry turns unstable: K_m phi = -p K_g phi.

    From a pressure p0 at which K is positive definite, K_g phi = nu K(p0) phi, nu = -1/(p - p0), is a
    definite pencil, and the critical pressure nearest to p0 has the largest |nu|.

    Args:
        balloon: a prestressed balloon.
        harmonic: look at this circumferential harmonic alone, from one sector of a structured mesh;
            None for all of them, on the full model. A sector with several nodes around (quadratic
            cells) also holds N - n, N + n, ...; the result is the lowest that is mostly of n.
        count: how many critical pressures to look for.

    Raises:
        InputError: the balloon is not prestressed, or its mesh has no such harmonic.
        EigenError: SLEPc failed.

    Collective.
    """
    if not balloon.prestressed:
        raise InputError("critical_pressure needs a prestressed balloon; pass prestressed=True")
    check_request(balloon, count)
    return of_pencil(balloon, balloon.held_pencil(), harmonic, count)


def of_pencil(
    balloon: Balloon, pencil: tuple[Any, Any], harmonic: int | None = None, count: int = 2
) -> CriticalPressure:
    """The lowest positive p at which K_m + p K_g is singular, as `critical_pressure`.

    Args:
        balloon: whose tangents they are.
        pencil: (K_m, K_g); K_g is overwritten.
        harmonic: as above.
        count: as above.

    Collective.
    """
    q = balloon.map.create_vector()
    K_m, K_g = pencil
    M, plates = balloon.mass(q), balloon.map.num_parameters
    expand: Callable[[Any], Any] | None = None
    if harmonic is not None:
        reduction = CyclicReduction(balloon)
        K_m, plates = reduction.reduce(K_m, harmonic)
        K_g, M = reduction.reduce(K_g, harmonic)[0], reduction.reduce(M, harmonic)[0]

        def expand(x: Any) -> Any:
            return reduction.expand(x.array_r, harmonic, plates)[0]

    divisions = balloon.surface.divisions
    symmetric = _petsc.asymmetry(K_g) < _petsc.SYMMETRIC
    moving = 0 if symmetric else plates
    p0 = _stable_below(K_m, K_g, moving, beyond_reason(balloon))
    if p0 in (0.0, math.inf):
        return CriticalPressure(p0, None, (), divisions, harmonic)
    K_0 = _combine(K_m, p0, K_g)
    found = _search(p0, None, K_g, K_0, M, count, symmetric)
    if not found:
        raise EigenError(f"no critical pressure found near {p0:.6g} Pa, where one was proved to be")
    if harmonic is not None and expand is not None and _aliased(balloon):
        found = _own(balloon, expand, harmonic, p0, K_m, K_g, M, moving, symmetric)
        if not found:
            return CriticalPressure(math.inf, None, (), divisions, harmonic)
    K_g.scale(-1.0)
    first = found[0]
    error = residual(first, K_m, K_g)
    if expand is not None:
        x = expand(first.x)
        first = first._replace(x=x, y=x.duplicate())
    mode = replace(make_mode(balloon, q, first, error), value=0j)
    pressures = tuple(pair.value.real for pair in found[:count])
    return CriticalPressure(pressures[0], mode, pressures, divisions, harmonic)


def _search(
    p0: float, target: float | None, K_g: Any, K_0: Any, M: Any, count: int, symmetric: bool
) -> list[Pair]:
    """Critical pressures nearest to `target` (None: to p0, where K_0 is the tangent), with vectors."""
    eps = solver(K_g, K_0, count, symmetric, PREFIX)
    eps.setTolerances(1e-10, 2000)
    st = eps.getST()
    if target is None:
        eps.setWhichEigenpairs(SLEPc.EPS.Which.LARGEST_MAGNITUDE)
    else:
        eps.setTarget(-1 / (target - p0))
        eps.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
        st.setType(SLEPc.ST.Type.SINVERT)
    _petsc.set_direct_solver(st.getKSP(), symmetric)
    pairs = [p._replace(value=p0 - 1 / p.value) for p in distinct(run(eps, 1), M, 0.0) if p.value.real]
    eps.destroy()
    return sorted((p for p in pairs if p.value.real > 0 and abs(p.value.imag) < 1e-6 * p0), key=order)


def _aliased(balloon: Balloon) -> bool:
    """Whether a sector has several nodes around, so that its harmonic n holds N - n, N + n, ... too."""
    divisions, sectors = balloon.surface.divisions, balloon.surface.cyclic_order
    return divisions is not None and sectors is not None and divisions[1] * balloon.order > sectors


def _own(
    balloon: Balloon,
    expand: Callable[[Any], Any],
    harmonic: int,
    p0: float,
    K_m: Any,
    K_g: Any,
    M: Any,
    plates: int,
    symmetric: bool,
) -> list[Pair]:
    """The lowest critical pressure whose mode is mostly of this harmonic, and its copy; empty without one.

    Searched upwards, doubling the pressure; the inertia (of the film, as in `_stable_below`) tells how
    many there are up to each.
    """
    q = balloon.map.create_vector()
    highest = balloon.surface.divisions[1] * balloon.order // 2
    A, G = _without_plates(K_m, K_g, plates)
    base = p0 / 2  # well below all that is wanted
    K_0 = _combine(K_m, base, K_g)

    def negatives(p: float) -> int:
        K = _combine(A, p, G)
        count = _petsc.num_negative(K)
        K.destroy()
        return count

    low, below = p0, 0
    while low < beyond_reason(balloon):
        high = 2 * low
        above = negatives(high)
        if above > below:
            wanted = min(above - below + 4, K_g.getSize()[0])
            pairs = _search(base, math.sqrt(low * high), K_g, K_0, M, wanted, symmetric)
            for pair in pairs:
                if low <= pair.value.real <= high:
                    x = balloon.displacement_of(q, expand(pair.x))
                    if spectrum(balloon, x, 0 * x, highest)[harmonic] > 0.5:
                        return [other for other in pairs if abs(other.value - pair.value) < 1e-6 * high]
        low, below = high, above
    return []


def beyond_reason(balloon: Balloon) -> float:
    """A pressure [Pa] beyond all reason: p R0/2 = N = 10 E t, a film strain of 1000 %."""
    return 20 * balloon.film.Et / float(balloon.surface.shape.R0)


def _combine(K_m: Any, p: float, K_g: Any) -> Any:
    K = K_m.copy()
    K.axpy(p, K_g)
    return K


def _without_plates(K_m: Any, K_g: Any, plates: int) -> tuple[Any, Any]:
    """The matrices without their last rows and columns, which belong to the plates."""
    if not plates:
        return K_m, K_g
    start, end = K_m.getOwnershipRange()
    end = min(end, K_m.getSize()[0] - plates)
    film = PETSc.IS().createStride(max(end - start, 0), start, 1, comm=K_m.getComm())
    return K_m.createSubMatrix(film, film), K_g.createSubMatrix(film, film)


def _stable_below(K_m: Any, K_g: Any, plates: int, limit: float) -> float:
    """A pressure [Pa], within a tenth of the lowest critical one, at which K is positive definite.

    The bracket is by inertia. Where K is not symmetric (`film` load on moving plates) it is that of
    the film with its plates held, which is: the skin fails first and hardly moves a plate.

    Args:
        K_m: material part of the tangent.
        K_g: its part per Pa.
        plates: number of last rows to leave out.
        limit: pressure at which to give up [Pa].

    Returns:
        the pressure; 0 where none down to 1e-6 Pa is stable, inf where all up to `limit` are.
    """
    K_m, K_g = _without_plates(K_m, K_g, plates)

    def stable(p: float) -> bool:
        K = _combine(K_m, p, K_g)
        negative = _petsc.num_negative(K)
        K.destroy()
        return negative == 0

    low = next((p for p in (1.0, 1e-3, 1e-6) if stable(p)), 0.0)
    if low == 0.0:
        return 0.0
    high = 4 * low
    while stable(high):
        low, high = high, 4 * high
        if low > limit:
            return math.inf
    while high > 1.1 * low:
        middle = math.sqrt(low * high)
        low, high = (middle, high) if stable(middle) else (low, middle)
    return low
