"""Modes of the full balloon from those of one sector, for pictures and files."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lobefem import checks
from lobefem.equilibrium.full_model import full_state
from lobefem.errors import InputError
from lobefem.fem.balloon import Balloon
from lobefem.fem.cyclic_symmetry import about_axis, images
from lobefem.fem.functionals import largest
from lobefem.stability.mode_records import Mode, Modes

__all__ = ["full_mode", "full_modes"]


def full_mode(sector: Balloon, mode: Mode, whole: Balloon) -> Mode:
    """A mode of one sector on all of them, real: Re(R^j phi e^{2 pi i n j/N}) in the j-th one. Collective.

    Args:
        sector: balloon of one sector.
        mode: from `find_modes` of a state of it.
        whole: balloon of all sectors.

    Raises:
        InputError: a whole balloon whose nodes are not images of the sector's.
    """
    sectors, nodes = images(sector, whole)
    alpha = 2.0 * np.pi / sector.surface.copies
    turns = np.stack([about_axis(sector.axis.direction, j * alpha) for j in range(sector.surface.copies)])
    phases = np.exp(1j * mode.harmonic * alpha * sectors)[:, None]
    field = ((mode.displacement + 1j * mode.displacement_imag)[nodes] * phases).real
    field = np.einsum("kij,kj->ki", turns[sectors], field)
    field /= largest(whole, field)
    return replace(mode, displacement=field, displacement_imag=np.zeros_like(field))


def full_modes(modes: Modes, balloon: Balloon | None = None) -> Modes:
    """The modes of one sector as those of the full balloon, at its equilibrium. Collective.

    Args:
        modes: from `find_modes` of a state of one sector.
        balloon: the whole one; by default `lobefem.equilibrium.full_model.full_balloon` of the sector's.

    Raises:
        InputError: modes of a whole balloon, or nodes that are not images of the sector's.
        ConvergenceError: no equilibrium of the full balloon found.
    """
    checks.having("modes", modes, "state", "modes, from find_modes")
    sector = modes.state.balloon
    if not sector.map.tied:
        raise InputError("the modes are those of a whole balloon; give modes of one sector")
    state = full_state(modes.state, balloon)
    found = tuple(full_mode(sector, mode, state.balloon) for mode in modes.modes)
    return replace(modes, state=state, modes=found)
