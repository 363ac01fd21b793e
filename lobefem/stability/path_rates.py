"""States of a path and their rates: the load's growth, a mode's stiffness, a step against its tangent."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from lobefem.equilibrium.newton import has_symmetric_stiffness
from lobefem.equilibrium.state import Equilibrium
from lobefem.fem.balloon import Balloon
from lobefem.fem.functionals import displacement_of
from lobefem.fem.rigid_motions import num_turns
from lobefem.linalg import petsc
from lobefem.stability.free_rotations import FreeRotations
from lobefem.stability.mode_records import Mode, Modes
from lobefem.stability.modes import find_modes
from lobefem.typing import Array, Mat, Vec

from petsc4py import PETSc

__all__ = ["jumped", "length", "load_rate", "load_share", "rayleigh", "without_turns"]

# from linear prediction to a fold u ~ sqrt(p* - p) is a factor of 2; more is another equilibrium
_JUMP = 4.0


def without_turns(state: Equilibrium, count: int) -> Modes:
    """The lowest modes of a state but for the rotations that its supports leave. Collective."""
    balloon = state.balloon
    modes = find_modes(state, min(count + num_turns(balloon), balloon.map.size))
    return replace(modes, modes=tuple(m for m in modes.modes if not m.rigid))


def load_rate(state: Equilibrium, q: Vec) -> Any:
    """The change dr/dp of the residual with the pressure, and the built-in stress with it. Collective."""
    balloon, p, p0 = state.balloon, state.pressure, state.prestress
    step = 1e-3 * abs(p)
    share = 1.0 if balloon.prestressed else 0.0
    rate, lower = q.duplicate(), q.duplicate()
    for sign, r in ((1, rate), (-1, lower)):
        balloon.set_loads(p + sign * step, p0 + sign * share * step)
        balloon.residual(q, r)
    rate.axpy(-1.0, lower)
    rate.scale(1 / (2 * step))
    balloon.set_loads(p, p0)
    return rate


def _factor(matrix: Mat, symmetric: bool) -> Any:
    ksp = PETSc.KSP().create(matrix.getComm())
    ksp.setOptionsPrefix("lobefem_path_")
    ksp.setOperators(matrix)
    petsc.set_direct_solver(ksp, symmetric)
    return ksp


def length(balloon: Balloon, displacement: Array) -> float:
    """Root of u . M u [m^2]. Collective."""
    M = balloon.mass_matrix()
    x, y = M.createVecs()
    x.array[:] = displacement.ravel()[: x.getLocalSize()]
    M.mult(x, y)
    return math.sqrt(max(x.dot(y), 0.0))


def _weighted(state: Equilibrium, q: Vec, displacement: Array) -> Any:
    """J^T M u of nodal displacements: B dq where they are u = J dq. Collective."""
    balloon = state.balloon
    M = balloon.mass_matrix()
    w, dw, _ = balloon.map.plate_parameters(balloon.map.parameters(q))
    x, y = M.createVecs()
    x.array[:] = displacement.ravel()[: x.getLocalSize()]
    M.mult(x, y)
    reduced = q.duplicate()
    balloon.map.jacobian(w, dw).multTranspose(y, reduced)
    return reduced


def rayleigh(state: Equilibrium, displacement: Array) -> float:
    """phi.K phi/phi.B phi of nodal displacements at a state. Collective."""
    q = state.restore()
    B = state.balloon.mass(q)
    inverse = _factor(B, True)
    weighted = _weighted(state, q, displacement)
    phi = q.duplicate()
    inverse.solve(weighted, phi)
    inverse.destroy()
    B.destroy()
    return state.balloon.second_variation(q, phi, phi) / phi.dot(weighted)


def jumped(before: Equilibrium, after: Equilibrium) -> bool:
    """True if a step went much further than the tangent K dq/dp = -dr/dp says.

    Rotations that the supports leave are no part of it. Collective.
    """
    balloon = before.balloon
    q = before.restore()
    B = balloon.mass(q)
    rotations = FreeRotations(balloon, q, B)
    B.destroy()
    rate = load_rate(before, q)
    symmetric = has_symmetric_stiffness(balloon, q)
    K = balloon.tangent(q)
    symmetric = symmetric and petsc.asymmetry(K) < petsc.SYMMETRIC
    A = rotations.bordered(K)
    ksp = _factor(A, symmetric)
    dq = q.duplicate()
    rotations.through(ksp.solve, A)(rate, dq)
    ksp.destroy()
    predicted = length(balloon, displacement_of(balloon, q, dq)) * abs(after.pressure - before.pressure)
    moved = after.displacement - before.displacement
    weighted = _weighted(before, q, moved)
    turned = math.hypot(*(t.dot(weighted) for t in rotations.vectors))
    return math.sqrt(max(length(balloon, moved) ** 2 - turned**2, 0.0)) > _JUMP * predicted


def load_share(modes: Modes, mode: Mode) -> float:
    """`CriticalPoint.projection` of a mode. Collective."""
    state = modes.state
    balloon = state.balloon
    q = state.restore()
    f = load_rate(state, q)
    B = balloon.mass(q)
    rotations = FreeRotations(balloon, q, B)  # as near zero as the mode, and none
    K = rotations.bordered(balloon.tangent(q))
    ksp = _factor(K, modes.symmetric)
    solve: Callable[[Any, Any], None] = rotations.through(
        ksp.solve if modes.symmetric else ksp.solveTranspose, K
    )
    inverse = _factor(B, True)
    z, g = q.duplicate(), q.duplicate()
    inverse.solve(f, g)
    size, share = math.sqrt(f.dot(g)), 0.0
    for part in (mode.displacement, mode.displacement_imag):
        Bz = _weighted(state, q, part)
        if Bz.norm() == 0.0 or size == 0.0:
            continue
        for _ in range(2):  # inverse iteration: K is all but singular
            solve(Bz, z)
            z.scale(1 / z.norm())
            B.mult(z, Bz)
        share = max(share, abs(z.dot(f)) / (math.sqrt(z.dot(Bz)) * size))
    for solver in (ksp, inverse):
        solver.destroy()
    B.destroy()
    return share
