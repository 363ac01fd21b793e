"""The full balloon of one sector: its equilibrium from that of the sector."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from lobefem import checks
from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.solver_options import NewtonOptions
from lobefem.equilibrium.state import Equilibrium, record
from lobefem.errors import InputError
from lobefem.fem.balloon import Balloon
from lobefem.fem.cyclic_symmetry import about_axis, images
from lobefem.typing import Comm

from mpi4py import MPI

__all__ = ["full_balloon", "full_state", "spread_state"]


def full_balloon(sector: Balloon, comm: Comm = MPI.COMM_WORLD) -> Balloon:
    """All gores of a pumpkin of which a balloon is one gore: the same film and components. Collective.

    Args:
        sector: on the surface that a `PumpkinRecipe` made.
        comm: of the full mesh.

    Raises:
        InputError: a surface without such a recipe, or a frame or layers that are the gore's own.
    """
    checks.having("balloon", sector, "reference_area", "a Balloon")
    recipe: Any = sector.surface.recipe
    if sector.surface.copies < 2 or not hasattr(recipe, "full"):
        raise InputError("all sectors are meshed from one gore of a pumpkin alone; give the whole balloon")
    if sector.specification.frame is not None or sector.layers is not None:
        raise InputError("the gore's frame or layers are functions of its own mesh; give the whole balloon")
    whole = dataclasses.replace(recipe, full=True)
    surface = whole.surface(comm)
    pattern = None if sector.pattern is None else whole.pattern(surface)
    return sector.with_changes(surface=surface, pattern=pattern)


def spread_state(state: Equilibrium, balloon: Balloon) -> Equilibrium:
    """One sector's state in all sectors of the full balloon, measured and not solved for. Collective.

    Args:
        state: of one sector.
        balloon: the whole one.

    Raises:
        InputError: a state of a whole balloon, or a balloon whose nodes are not images of the sector's.
    """
    checks.having("state", state, "balloon", "a state, from inflate")
    sector = state.balloon
    if not sector.map.tied:
        raise InputError("the state is that of a whole balloon; give one of one sector")
    sectors, nodes = images(sector, balloon)
    state.restore()
    alpha = 2.0 * np.pi / sector.surface.copies
    rotations = np.stack([about_axis(sector.axis.direction, j * alpha) for j in range(sector.surface.copies)])
    balloon.u.x.array[:] = np.einsum("kij,kj->ki", rotations[sectors], state.displacement[nodes]).ravel()
    q = balloon.map.unknowns(balloon.u, sector.w)
    balloon.set_loads(state.pressure, state.prestress)
    return record(balloon, q, state.converged, state.reason, state.iterations, state.steps)


def full_state(state: Equilibrium, balloon: Balloon | None = None, *, rtol: float = 1e-8) -> Equilibrium:
    """The full balloon's equilibrium from one sector's, in which all sectors are alike. Collective.

    `inflate` starts there: what is in equilibrium is so in the full model too, stable or not.

    Args:
        state: of one sector.
        balloon: the whole one; by default `full_balloon` of the state's.
        rtol: as in `inflate`.

    Raises:
        InputError: a state of a whole balloon, or a balloon whose nodes are not images of the sector's.
        ConvergenceError: no equilibrium found.
    """
    checks.having("state", state, "balloon", "a state, from inflate")
    if not state.balloon.map.tied:
        raise InputError("the state is that of a whole balloon; give one of one sector")
    whole = full_balloon(state.balloon) if balloon is None else balloon
    start = spread_state(state, whole)
    prestress = state.prestress if whole.prestressed else None
    return inflate(whole, state.pressure, prestress=prestress, start=start, options=NewtonOptions(rtol=rtol))
