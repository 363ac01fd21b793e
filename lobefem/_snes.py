"""SNES as every solve here uses it: one factorisation a step, and a line search in the energy."""

from __future__ import annotations

from typing import Any

from lobefem import _petsc
from lobefem.balloon import Balloon

# isort: split
from petsc4py import PETSc

__all__ = ["REASONS", "EnergySearch", "has_symmetric_load", "set_up"]

_WORDS = {
    "CONVERGED_FNORM_ABS": "converged, residual below tolerance",
    "DIVERGED_MAX_IT": "too many iterations",
    "DIVERGED_LINE_SEARCH": "line search failed",
    "DIVERGED_LINEAR_SOLVE": "linear solve failed",
    "DIVERGED_FNORM_NAN": "residual is not a number",
    "DIVERGED_FUNCTION_NANORINF": "residual is not a number",
}
REASONS: dict[int, str] = {
    value: _WORDS.get(name, name.lower().replace("_", " "))
    # the named ones last: PETSc has several names for some values
    for name, value in sorted(vars(PETSc.SNES.ConvergedReason).items(), key=lambda item: item[0] in _WORDS)
    if isinstance(value, int)
}


class EnergySearch:
    """SNES's objective: the energy (see `Balloon.energy`).

    A change within the energy's round-off counts as none. Newton's last steps lower the energy by less
    than it can resolve; Armijo's test then fails by chance, where the approximate one of Hager and
    Zhang (2005), E <= E0 + eps, accepts.

    Args:
        balloon: whose energy.
    """

    def __init__(self, balloon: Balloon) -> None:
        self.balloon = balloon
        self._base: float | None = None

    def tangent(self, x: Any) -> Any:
        """The balloon's tangent at x, from where a new line search starts. Collective."""
        self._base = None
        return self.balloon.tangent(x)

    def __call__(self, snes: Any, x: Any) -> float:
        """The objective at x. Collective."""
        if self._base is None:
            self.balloon.freeze_plates(x)
        energy, size = self.balloon.energy(x)
        if self._base is None:
            self._base = energy
        return self._base if abs(energy - self._base) <= 1e-12 * size else energy


def has_symmetric_load(balloon: Balloon, q: Any) -> bool:
    """Whether the load stiffness is symmetric at q, by its assembled matrix at 1 Pa. Collective.

    `closed` pressure has a potential; `film` pressure has none where an edge of the film moves.
    """
    if balloon.load.convention == "closed":
        return True
    loads = float(balloon.pressure.value), float(balloon.prestress.value)
    balloon.set_loads(1.0, 0.0)
    skew = _petsc.asymmetry(balloon.tangent(q))
    balloon.set_loads(*loads)
    return skew < _petsc.SYMMETRIC


def set_up(snes: Any, search: EnergySearch, symmetric: bool) -> None:
    """Newton's method with one factorisation a step, and with the energy search where there is one.

    Args:
        snes: with its options prefix, function and Jacobian.
        search: its objective.
        symmetric: whether the Jacobian is.
    """
    snes.setType(PETSc.SNES.Type.NEWTONLS)
    # only the plates' share of a load without potential can be frozen over a line search
    if symmetric or search.balloon.motion is not None:
        snes.setObjective(search)
    _petsc.set_direct_solver(snes.getKSP(), symmetric)
    # petsc4py before 3.23 has no handle on the line search
    with _petsc.options(snes.getOptionsPrefix(), {"snes_linesearch_type": "bt"}):
        snes.setFromOptions()
