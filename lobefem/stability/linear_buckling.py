"""`critical_pressure`: where the held ideal geometry turns unstable, as an eigenvalue itself.

With the geometry held at the ideal isotensoid and its stress proportional to p, the tangent is
K(p) = K_m + p K_g, and K_m phi = -p K_g phi has the critical pressures for eigenvalues. Of fixed
wrinkles the lowest one belongs to the mesh: it tends to zero under refinement (docs/theory/continuum.md).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Literal, overload

from lobefem.display import Summarized, Summary, number
from lobefem.equilibrium.state import require_whole
from lobefem.errors import EigenError, InputError
from lobefem.fem.balloon import Balloon
from lobefem.linalg import petsc
from lobefem.linalg.slepc import Pair, distinct, order, residual, run, solver
from lobefem.profiling import timed
from lobefem.stability.cyclic import Sector
from lobefem.stability.free_rotations import FreeRotations
from lobefem.stability.harmonic_buckling import (
    LINEAR,
    fixed_shape_pencil,
    pressure_limit,
    require_prestress,
    solve_harmonics,
    stable_below,
)
from lobefem.stability.mode_records import Mode, make_mode
from lobefem.stability.modes import check_request
from lobefem.stability.nonlinear_buckling import SEARCH_END, CriticalPoint, critical_point
from lobefem.typing import Sparse, StateKind

from petsc4py import PETSc
from slepc4py import SLEPc

__all__ = ["CriticalPressure", "critical_pressure"]

PREFIX = "lobefem_critical_"


@dataclass(frozen=True, repr=False)
class CriticalPressure(Summarized):
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

    def _summary(self) -> Summary:
        rows = [("next", ", ".join(number(p, "Pa") for p in self.pressures[1:]) or "none")]
        if self.mode is not None:
            rows.insert(0, ("mode", f"{self.mode.kind}, n = {self.mode.harmonic}"))
        if self.divisions is not None:
            rows.append(("mesh", "{} x {} divisions".format(*self.divisions)))
        if math.isinf(self.pressure):
            return Summary("stable at any pressure that the film can bear", tuple(rows))
        return Summary(f"unstable from {number(self.pressure, 'Pa')}", tuple(rows))


@overload
def critical_pressure(
    balloon: Balloon,
    *,
    state: Literal["ideal"] = "ideal",
    harmonic: int | None = None,
    count: int = 2,
    full: bool = False,
    at: tuple[float, float] = LINEAR,
    progress: Callable[[str], None] | None = None,
) -> CriticalPressure: ...


@overload
def critical_pressure(
    balloon: Balloon,
    *,
    state: Literal["inflated"],
    limit: float = SEARCH_END,
    progress: Callable[[str], None] | None = None,
) -> CriticalPoint: ...


@timed("eigensolver")
def critical_pressure(
    balloon: Balloon,
    *,
    state: StateKind = "ideal",
    limit: float | None = None,
    harmonic: int | None = None,
    count: int = 2,
    full: bool = False,
    at: tuple[float, float] = LINEAR,
    progress: Callable[[str], None] | None = None,
) -> CriticalPressure | CriticalPoint:
    """The pressure at which the balloon turns unstable; to quote is that of `state="inflated"`.

    Of the inflated balloon it is found along its equilibria, by `critical_point`. Of the held ideal geometry
    it is an eigenvalue of K_m phi = -p K_g phi. From a pressure p0 at which K is positive definite,
    K_g phi = nu K(p0) phi, nu = -1/(p - p0), is a definite pencil, and the critical pressure nearest to p0
    has the largest |nu|. On a cyclic mesh each harmonic is solved on its own, from one sector
    (`lobefem.stability.harmonic_buckling`).

    Args:
        balloon: a prestressed balloon for the ideal state.
        state: "inflated" or "ideal"; what follows `limit` is for the ideal state.
        limit: pressure at which the search along inflated states gives up [Pa]; 20 kPa by default.
        harmonic: look at this circumferential harmonic alone; None for all of them.
        count: how many critical pressures to look for; of each harmonic, if it is alone.
        full: use the full model on a cyclic mesh too.
        at: the pressures [Pa] whose two tangents make K_m and K_g. Where K is linear in p they do not
            matter.
        progress: called with a line of text before each harmonic of this rank.

    Raises:
        InputError: the balloon is not prestressed, its mesh has no such harmonic, or an argument is for the
            other state.
        EigenError: the eigenvalue problem was not solved.
        ConvergenceError: the path of inflated states ends before stability is lost.

    Collective.
    """
    if state == "inflated":
        if harmonic is not None or full:
            raise InputError("harmonic and full are for the ideal state; leave them out")
        end = SEARCH_END if limit is None else limit
        return critical_point(balloon, limit=end, start=min(100.0, end / 20), progress=progress)
    if state != "ideal":
        raise InputError(f"state '{state}' is unknown; use 'ideal' or 'inflated'")
    if limit is not None:
        raise InputError("limit is that of a search along inflated states; add state='inflated'")
    require_prestress(balloon)
    check_request(balloon, count)
    require_whole(balloon)
    if harmonic is not None and full:
        raise InputError(f"harmonic = {harmonic} is looked at on one sector; leave out full=True")
    sector = _sector(balloon, harmonic) if not full else None
    if sector is None:
        return _of_full_model(balloon, count, at)
    chosen = sector.harmonics if harmonic is None else (harmonic,)
    found = solve_harmonics(sector, chosen, count, comm=balloon.comm, at=at, progress=progress)
    first = min(found, key=lambda n: found[n].pressures[0])
    one, divisions = found[first], balloon.surface.divisions
    if one.vector is None:
        return CriticalPressure(one.pressures[0], None, (), divisions, harmonic)
    x = sector.expand(balloon, one.vector, first)[0]
    pair = Pair(0j, x, x.duplicate())
    mode = make_mode(balloon, balloon.map.create_vector(), pair, one.residual, first)
    pressures = one.pressures
    if harmonic is None:  # each as often as the full model has it
        pressures = tuple(
            sorted(p for n in found for p in found[n].pressures for _ in range(sector.copies(n)))[:count]
        )
    return CriticalPressure(one.pressures[0], mode, pressures, divisions, harmonic)


def _sector(balloon: Balloon, harmonic: int | None) -> Sector | None:
    """One sector; None where the balloon has none and no harmonic was asked for. Collective."""
    try:
        return Sector(balloon)
    except InputError:
        if harmonic is None:
            return None
        raise


def _of_full_model(balloon: Balloon, count: int, at: tuple[float, float]) -> CriticalPressure:
    q = balloon.map.create_vector()
    K_m, K_g = fixed_shape_pencil(balloon, *at)
    M, plates = balloon.mass(q), balloon.map.num_parameters
    divisions = balloon.surface.divisions
    symmetric = petsc.asymmetry(K_g) < petsc.SYMMETRIC
    limit = pressure_limit(balloon)
    rotations = FreeRotations(balloon, q, M)
    A_m, A_g = rotations.bordered(K_m), rotations.bordered(K_g, constrained=False)
    judged = (A_m, A_g, len(rotations)) if symmetric else (*_of_film(K_m, K_g, plates), 0)
    p0 = stable_below(_is_stable(*judged), limit)
    if p0 in (0.0, math.inf):
        return CriticalPressure(p0, None, (), divisions)
    K_0 = _combine(A_m, p0, A_g)
    # a constraint makes K(p0) indefinite, which leaves the values real
    eps = solver(A_g, K_0, count, symmetric and not len(rotations), PREFIX)
    eps.setWhichEigenpairs(SLEPc.EPS.Which.LARGEST_MAGNITUDE)
    eps.setTolerances(1e-10, 2000)
    petsc.set_direct_solver(eps.getST().getKSP(), symmetric)
    eps.setFromOptions()
    found = [p._replace(x=rotations.cut(p.x), y=rotations.cut(p.y)) for p in run(eps, 1)]
    pairs = [p._replace(value=p0 - 1 / p.value) for p in distinct(found, M, 0.0) if p.value.real]
    eps.destroy()
    critical = sorted((p for p in pairs if p.value.real > 0 and abs(p.value.imag) < 1e-6 * p0), key=order)
    if not critical:
        raise EigenError(f"no critical pressure found near {p0:.6g} Pa, where one was proved to be")
    if critical[0].value.real > limit:
        return CriticalPressure(math.inf, None, (), divisions)
    K_g.scale(-1.0)
    first = critical[0]
    error = residual(first, K_m, K_g, project=rotations.project)
    mode = replace(make_mode(balloon, q, first, error), value=0j)
    pressures = tuple(pair.value.real for pair in critical[:count])
    return CriticalPressure(pressures[0], mode, pressures, divisions)


def _combine(K_m: Sparse, p: float, K_g: Sparse) -> Any:
    K = K_m.copy()
    K.axpy(p, K_g)
    return K


def _of_film(K_m: Sparse, K_g: Sparse, plates: int) -> tuple[Any, Any]:
    """Two matrices without their last rows and columns, of the plates. Collective."""
    if not plates:
        return K_m, K_g
    start, end = K_m.getOwnershipRange()
    end = min(end, K_m.getSize()[0] - plates)
    film = PETSc.IS().createStride(max(end - start, 0), start, 1, comm=K_m.getComm())
    return K_m.createSubMatrix(film, film), K_g.createSubMatrix(film, film)


def _is_stable(K_m: Sparse, K_g: Sparse, borders: int) -> Callable[[float], bool]:
    """True if K(p) is positive definite under its constraint of so many rows, by inertia."""

    def stable(p: float) -> bool:
        K = _combine(K_m, p, K_g)
        negative = petsc.num_negative(K)
        K.destroy()
        return negative == borders

    return stable
