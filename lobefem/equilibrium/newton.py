"""SNES as every solve here uses it: one factorisation a step, and a line search in the energy."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from lobefem.equilibrium.operator import Operator
from lobefem.equilibrium.solver_options import NewtonOptions
from lobefem.fem.balloon import Balloon
from lobefem.linalg import petsc
from lobefem.typing import SNES, Array, Vec

from mpi4py import MPI
from petsc4py import PETSc

__all__ = [
    "REASONS",
    "STUCK",
    "EnergySearch",
    "Newton",
    "Separation",
    "follow_pattern",
    "free_share",
    "has_symmetric_load",
    "has_symmetric_stiffness",
    "lengths",
    "lever",
    "revealing_pressure",
    "round_off",
    "set_up",
    "too_far",
]

# Newton steps with a kept tangent that cost less than a new one, its factorisation and its own steps, on
# a large mesh
_CHEAP_STEPS = 10

# a residual that falls to this share in one step vouches for the next one with the same tangent
_FAST = 0.25

_WORDS = {
    "CONVERGED_FNORM_ABS": "converged, residual below tolerance",
    "DIVERGED_MAX_IT": "too many iterations",
    "DIVERGED_DTOL": "residual grows without bound",
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

# whole steps whose residual is so many times the load lead nowhere: the film would be strained by 1
_WILD = 1e6

# a step of which contact leaves less does not help
STUCK = 1e-3


def lever(balloon: Balloon) -> float:
    """The length that stands for one radian where lengths and angles are compared [m].

    A tenth of the square root of the film's area: about a plate's radius.
    """
    return 0.1 * math.sqrt(balloon.reference_area)


def lengths(balloon: Balloon) -> Any:
    """Factors that make lengths of all unknowns: 1, for an angle its `lever`, as a vector. Collective."""
    found, constraint = balloon.map.create_vector(), balloon.map
    found.set(1.0)
    motion = constraint.motion
    with found as array:
        if motion is not None and array.size > constraint.free.size:
            angles = [motion.is_angle(name) for name in motion.names]
            array[constraint.free.size :] = np.where(angles, lever(balloon), 1.0)
    return found


def too_far(balloon: Balloon, step: Vec) -> bool:
    """True if a step of the unknowns is no sensible one: with a motion beyond a `lever`. Collective."""
    scaled = lengths(balloon)
    scaled.pointwiseMult(scaled, step)
    largest = scaled.norm(PETSc.NormType.NORM_INFINITY)
    scaled.destroy()
    return not largest <= lever(balloon)


class EnergySearch:
    """SNES's objective: the energy (see `Balloon.energy`).

    A change within the energy's round-off counts as none. Newton's last steps lower the energy by less
    than it can resolve; Armijo's test then fails by chance, where the approximate one of Hager and
    Zhang (2005), E <= E0 + eps, accepts.

    A step with a kept tangent, one of a series whose residual falls fast, is judged by that: its energy is
    that of the quadratic model, E0 + r.dx/2, which takes no integration.

    Args:
        balloon: whose energy.
        options: whether and where a tangent is kept, see `tangent`, and a factorisation compressed.

    Attributes:
        limit: residual beyond which whole steps lead nowhere [N, N m].
        separation: what cuts the steps of a balloon with contact.
    """

    def __init__(self, balloon: Balloon, options: NewtonOptions) -> None:
        self.balloon, self.options = balloon, options
        # the barrier of film in contact is too steep for the tangent of another place
        large = balloon.map.size > options.keep_above
        self._keeps = options.keep_tangent and balloon.contact is None and large
        self.limit = math.inf
        self.separation: Separation | None = None
        self._base: float | None = None
        self._operator = Operator(balloon)
        self._stiffness: Any = None
        self._tangent_at: Array | None = None  # where SNES's matrix was assembled
        self._norm = math.inf
        self._kept: Any = None  # where the step with a kept tangent starts
        self._known: tuple[Array, tuple[float, float]] | None = None  # the last energy, and where

    def assemble(self, x: Vec, before: Vec | None = None) -> Any:
        """The operator and the tangent at x, which `tangent` need not assemble again there. Collective.

        Args:
            x: unknowns.
            before: those before the last step, for the stress that it predicted.
        """
        K = self.balloon.tangent(x, iteration=True, before=before)
        self._stiffness = K.getDiagonal(self._stiffness)
        self._tangent_at = self._place(x)
        return self._operator.at(x, K), K

    def tangent(self, snes: SNES, x: Vec, last: Vec | None = None) -> None:
        """Bring the tangent, from where a new line search starts, up to date at x. Collective.

        It stays as it is, and so does its factorisation, on a large mesh where the residual falls so
        fast that `_CHEAP_STEPS` more with it will do. With a predicted stress it is one of the last step,
        and new each time.

        Args:
            snes: that asks.
            x: unknowns.
            last: those before the last step, for the stress that it predicted; x is written there.
        """
        self._base, self._kept = None, None
        before, self._norm = self._norm, snes.getFunctionNorm()
        begins = not snes.getIterationNumber()
        if last is not None:
            self.assemble(x, None if begins else last)
            x.copy(last)
        else:
            _, atol, _, _ = snes.getTolerances()
            falls = not begins and self._norm < before
            if self._keeps and falls and self._norm * (self._norm / before) ** _CHEAP_STEPS <= atol:
                if self._norm < _FAST * before:
                    self._kept = x.copy()
                return
            if self._same(self._tangent_at, x):
                return
            self.assemble(x)
        follow_pattern(snes, self.balloon)

    def __call__(self, snes: SNES, x: Vec) -> float:
        """The objective at x. Collective."""
        if self._kept is not None:
            step = x - self._kept
            change = snes.getFunction()[0].dot(step) / 2
            step.destroy()
            return float(change)
        if self._base is None:
            self.balloon.freeze_plates(x)
            if self.balloon.load.convention != "closed":  # the plates' area vectors are others now
                self._known = None
        # a line search starts where the last one ended
        if self._known is None or not self._same(self._known[0], x):
            self._known = self._place(x), self.balloon.energy(x)
        energy, size = self._known[1]
        if self._base is None:
            self._base = energy
        return self._base if abs(energy - self._base) <= 1e-12 * size else energy

    def _place(self, x: Vec) -> Array:
        return np.append(x.array_r, (self.balloon.pressure.value, self.balloon.prestress.value))

    def _same(self, place: Array | None, x: Vec) -> bool:
        """True if a place is x under the present loads. Collective."""
        same = place is not None and np.array_equal(place, self._place(x))
        return bool(self.balloon.comm.allreduce(same, op=MPI.LAND))

    def converged(self, snes: SNES, iteration: int, norms: tuple[float, float, float]) -> Any:
        """True if the residual is below the tolerance, or below what it can resolve. Collective."""
        why: Any = PETSc.SNES.ConvergedReason
        if not math.isfinite(norms[2]):
            # PETSc 3.24 renamed it
            return getattr(why, "DIVERGED_FUNCTION_NANORINF", None) or why.DIVERGED_FNORM_NAN
        if norms[2] > self.limit:
            return why.DIVERGED_DTOL
        cut = self.separation.share if iteration and self.separation is not None else 1.0
        if self.limit < math.inf and cut < STUCK:
            return why.DIVERGED_LINE_SEARCH
        floor = round_off(self._stiffness, snes.getSolution()) if iteration else 0.0
        _, atol, _, _ = snes.getTolerances()
        return why.CONVERGED_FNORM_ABS if norms[2] <= max(atol, floor) else why.CONVERGED_ITERATING


def round_off(stiffness: Vec, q: Vec) -> float:
    """The residual that the last digit of the unknowns makes [N, N m]. Collective.

    A hoop of 5e9 N/m an edge turns the rounding of a displacement of 0.3 m into 1e-7 N.

    Args:
        stiffness: diagonal of the tangent.
        q: unknowns.
    """
    noise = stiffness.duplicate()
    noise.pointwiseMult(stiffness, q)
    floor = np.finfo(float).eps * noise.norm()  # of the products and of their sums
    noise.destroy()
    return float(floor)


def has_symmetric_load(balloon: Balloon, q: Vec) -> bool:
    """True if the tangents at q are symmetric as far as it is up to load and film. Collective.

    A film whose stress is no energy's gradient has no symmetric tangent under any load.
    """
    return balloon.forms.has_energy and has_symmetric_stiffness(balloon, q)


def has_symmetric_stiffness(balloon: Balloon, q: Vec) -> bool:
    """True if the load's stiffness is symmetric at q, by assembled tangents. Collective.

    `closed` pressure has a potential; `film` pressure has none where an edge of the film moves. Assembles
    other values into the balloon's tangent.
    """
    if balloon.load.convention == "closed":
        return True
    loads = float(balloon.pressure.value), float(balloon.prestress.value)
    try:
        balloon.set_loads(1.0, 0.0)
        K = balloon.tangent(q)
        if petsc.asymmetry(K) >= petsc.SYMMETRIC:
            return False
        balloon.set_loads(revealing_pressure(balloon, petsc.largest_entry(K)), 0.0)
        return petsc.asymmetry(balloon.tangent(q)) < petsc.SYMMETRIC
    finally:
        balloon.set_loads(*loads)


def revealing_pressure(balloon: Balloon, stiffness: float) -> float:
    """A pressure [Pa] whose stiffness is of the order of a tangent's largest entry.

    Beside hoops of 5e9 N/m the asymmetry that a few pascals make on a small balloon is round-off.

    Args:
        balloon: for its size.
        stiffness: max|K| [N/m].
    """
    return max(1.0, stiffness / math.sqrt(balloon.reference_area))


def follow_pattern(snes: SNES, balloon: Balloon) -> None:
    """Factorise anew from the symbolic part on where contact changed the tangent's pattern. Collective."""
    if balloon.contact is not None and balloon.contact.new_pattern:
        # PETSc does not always see that a pattern was replaced by another one
        snes.getKSP().getPC().reset()


class Separation:
    """Cuts Newton's steps where the film would touch itself.

    Args:
        snes: whose steps.
        balloon: with contact, or nothing is done unless steps are `limited`.
        residual: the vector of SNES's function.
        downhill: whether the residual is a gradient; a step that an indefinite tangent sends uphill is
            then turned round.
        limited: a step that goes too far is not gone at all: it leads nowhere, and to look for what it
            would touch takes long.
        turned: turn steps also where there is no contact.

    Attributes:
        share: of the last step that was gone.
    """

    def __init__(
        self,
        snes: SNES,
        balloon: Balloon,
        residual: Vec,
        downhill: bool,
        limited: bool = False,
        turned: bool = False,
    ) -> None:
        self.share = 1.0
        self._balloon, self._residual, self._downhill, self._limited = balloon, residual, downhill, limited
        if balloon.contact is not None or limited or turned:
            snes.setLineSearchPreCheck(self._shorten)

    def _shorten(self, x: Vec, step: Vec) -> bool:
        """Change Newton's step, x - step; whether it was."""
        uphill = self._downhill and self._residual.dot(step) < 0
        if not uphill:
            step.scale(-1.0)
        wild = self._limited and too_far(self._balloon, step)
        self.share = 0.0 if wild else free_share(self._balloon, x, step)
        step.scale(-self.share)
        return uphill or self.share < 1


def set_up(snes: SNES, search: EnergySearch, symmetric: bool, line_search: str = "bt") -> None:
    """Newton's method with one factorisation a step, and with the energy search where there is one.

    Args:
        snes: with its options prefix, function and Jacobian.
        search: its objective.
        symmetric: whether the Jacobian is.
        line_search: PETSc's name of it, if the user gives none.
    """
    snes.setType(PETSc.SNES.Type.NEWTONLS)
    # only the plates' share of a load without potential can be frozen over a line search
    if search.balloon.forms.has_energy and (symmetric or search.balloon.motion is not None):
        snes.setObjective(search)
    snes.setConvergenceTest(search.converged)
    q = search.balloon.map
    compressed = q.size >= search.options.compress_above
    exact = search.balloon.gas is None
    petsc.set_direct_solver(
        snes.getKSP(), symmetric, compressed=compressed, whole_nodes=q.whole_nodes, exact=exact
    )
    # petsc4py before 3.23 has no handle on the line search
    with petsc.options(snes.getOptionsPrefix(), {"snes_linesearch_type": line_search}):
        snes.setFromOptions()


class Newton:
    """SNES on a balloon's reduced residual and tangent.

    Args:
        balloon: with its loads set.
        q: unknowns, for their size.
        options: tolerance, iterations of one solve, and whether tangents are kept (see `EnergySearch`).
        prefix: of PETSc's options.
        line_search: see `set_up`.
        predicted: solve with the stress that the last step predicted (`WeakForms.predicted`), for
            whole steps.
        turned: turn a step round that an indefinite tangent sends to higher energy. The line search would end
            there; but near an unstable equilibrium such steps are those that lead to it.

    Attributes:
        norm: of the last residual [N, N m].
        symmetric: whether the tangent is.
    """

    def __init__(
        self,
        balloon: Balloon,
        q: Vec,
        options: NewtonOptions,
        prefix: str,
        line_search: str = "bt",
        predicted: bool = False,
        turned: bool = False,
    ) -> None:
        self.balloon, self.rtol, self.norm = balloon, options.rtol, math.inf
        self._r = q.duplicate()
        self._last = q.duplicate() if predicted else None
        self._search = search = EnergySearch(balloon, options)
        self.symmetric = symmetric = has_symmetric_load(balloon, q)
        J, K = search.assemble(q)
        self.snes = snes = PETSc.SNES().create(balloon.comm)
        snes.setOptionsPrefix(prefix)
        snes.setFunction(lambda snes, x, f: balloon.residual(x, f), self._r)
        snes.setJacobian(lambda snes, x, J, P: search.tangent(snes, x, self._last), J, K)
        snes.setTolerances(rtol=0.0, stol=0.0, max_it=options.max_iterations)
        set_up(snes, search, symmetric, line_search)
        downhill = symmetric or balloon.motion is not None
        turned = turned and downhill and balloon.forms.has_energy
        search.separation = Separation(snes, balloon, self._r, downhill, predicted, turned)
        if snes.getKSP().getPC().getType() == PETSc.PC.Type.GAMG:  # the user's choice
            x = balloon.X
            K.setNearNullSpace(
                PETSc.NullSpace().create(vectors=balloon.map.rigid_motions(x), comm=balloon.comm)
            )

    def solve(self, q: Vec) -> tuple[int, int]:
        """Solve from q in place; returns SNES's converged reason and iterations. Collective."""
        scale = self.balloon.load_norm(q)
        self.balloon.residual(q, self._r)
        if scale == 0.0:
            scale = self._r.norm() or 1.0
        self.snes.setTolerances(atol=self.rtol * scale)
        if self._last is not None:
            self._search.limit = max(_WILD * scale, 10 * self._r.norm())
        self.snes.solve(None, q)
        self.norm = self.snes.getFunctionNorm()
        reason: Any = self.snes.getConvergedReason()
        if reason == PETSc.SNES.ConvergedReason.DIVERGED_LINEAR_SOLVE:
            # PETSc keeps a factorisation that failed as such for the solves that follow
            self.snes.getKSP().getPC().reset()
        return reason, self.snes.getIterationNumber()

    def destroy(self) -> None:
        """Free the PETSc objects and with them the references to the balloon."""
        self.snes.destroy()
        self._r.destroy()
        if self._last is not None:
            self._last.destroy()


def free_share(balloon: Balloon, q: Vec, step: Vec) -> float:
    """Share (0, 1] of a step from q that the film can go without touching itself. Collective.

    Nodes are taken to move straight; on a plate that turns they do so to first order.
    """
    if balloon.contact is None:
        return 1.0
    end = q.copy()
    end.axpy(1.0, step)
    balloon.set_unknowns(end)
    end.destroy()
    there = balloon.u.x.array.copy()
    balloon.set_unknowns(q)
    return balloon.contact.free_share(balloon.u, there)
