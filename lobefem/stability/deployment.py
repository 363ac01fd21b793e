"""At which pressure a clefted balloon deploys: released again and again as the pressure rises or falls."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from lobefem.display import Summarized, Summary, number
from lobefem.equilibrium.solver_options import FLOW, FlowOptions
from lobefem.equilibrium.state import Equilibrium, State
from lobefem.errors import InputError
from lobefem.stability.relaxation import RETURNED, Released, release

__all__ = ["Deployment", "deploy"]


@dataclass(frozen=True, repr=False)
class Deployment(Summarized):
    """The result of a deployment.

    Attributes:
        symmetric: the symmetric states at the pressures.
        released: where the balloon came to rest at each of them.
    """

    symmetric: tuple[Equilibrium, ...] = field(repr=False)
    released: tuple[Released, ...] = field(repr=False)

    @property
    def deployed_from(self) -> float | None:
        """First pressure at which the balloon came to rest in its symmetric shape [Pa], None without one."""
        found = zip(self.symmetric, self.released, strict=True)
        return next((state.pressure for state, end in found if end.outcome == RETURNED), None)

    def _summary(self) -> Summary:
        rows = tuple(
            (f"{state.pressure:.4g} Pa", f"{end.outcome}, lowest eigenvalue {number(end.lowest, 'Pa/m')}")
            for state, end in zip(self.symmetric, self.released, strict=True)
        )
        since = self.deployed_from
        return Summary("stays clefted" if since is None else f"deploys at {since:.4g} Pa", rows)


def deploy(
    start: State,
    pressures: Sequence[float],
    symmetric: Callable[[float], Equilibrium],
    *,
    options: FlowOptions = FLOW,
    progress: Callable[[str], None] | None = None,
) -> Deployment:
    """Release a clefted balloon at pressures in turn, each from the shape at the last, until it deploys.

    Args:
        start: clefted or seeded, at any pressure, of a balloon under a given pressure.
        pressures: ascending or descending [Pa].
        symmetric: the state of the same balloon at a pressure in which all gores are alike, such as
            `full_state` makes from one gore's.
        options: of the damped motion.
        progress: called with a line of text now and then.

    Raises:
        InputError: pressures that go up and down, or a sealed gas.
        ConvergenceError: no symmetric state at a pressure.

    Collective.
    """
    steps = [after - before for before, after in pairwise(pressures)]
    one_way = all(step > 0 for step in steps) or all(step < 0 for step in steps)
    if not pressures or min(pressures) <= 0 or not one_way:
        raise InputError(f"the pressures are {tuple(pressures)} Pa; give positive ones that rise or fall")
    if start.balloon.gas is not None:
        raise InputError("the gas is sealed in, so its pressure follows; use fill, or deploy without seal")
    states: list[Equilibrium] = []
    ends: list[Released] = []
    for pressure in pressures:
        states.append(symmetric(pressure))
        begin = State(start.balloon, pressure, start.prestress, start.unknowns)
        ends.append(release(begin, undistorted=states[-1], options=options, progress=progress))
        if ends[-1].outcome == RETURNED:
            break
        start = ends[-1].state or begin
    return Deployment(tuple(states), tuple(ends))
