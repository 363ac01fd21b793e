"""Measures of a pumpkin in a state, for a balloon engineer: sizes, tendon tension, bulges, stress, masses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from lobefem.equilibrium.state import Equilibrium
from lobefem.fem.functionals import strains, true_resultants
from lobefem.frozen import Frozen
from lobefem.typing import Array

if TYPE_CHECKING:
    from lobefem.fem.balloon import Balloon

__all__ = ["PumpkinMeasures", "measure"]


@dataclass(frozen=True)
class PumpkinMeasures(Frozen):
    """Of the whole balloon; by station those of one gore, each amid an edge of the tendon.

    Attributes:
        diameter: twice the largest distance of the film from the axis, over the bulges [m].
        tendon_diameter: the same of the tendons [m].
        height: from fitting to fitting [m].
        stations: arc length along the drawn tendon from the bottom, over the whole.
        tendon_tension: in the tendon there [N].
        bulge_half_angle: half angle of the arc through both tendons and the gore's middle there [rad].
        bulge_radius: radius of that arc [m].
        resultants: mean true (N_m, N_h) of a layer across the gore there (stations, 2) [N/m].
        strains: mean (E_m, E_h) across the gore there, of Green and Lagrange (stations, 2).
        max_stress: largest principal true stress of a cell [Pa], see `Equilibrium.max_stress`.
    """

    diameter: float
    tendon_diameter: float
    height: float
    stations: Array
    tendon_tension: Array
    bulge_half_angle: Array
    bulge_radius: Array
    resultants: Array
    strains: Array
    max_stress: float


def measure(state: Equilibrium) -> PumpkinMeasures:
    """Measure a state of one gore or of all gores of a pumpkin. Collective.

    Args:
        state: of a balloon on a surface that a `lobefem.geometry.pumpkin.PumpkinRecipe` has made, with
            tendons.
    """
    state.restore()
    balloon = state.balloon
    recipe = balloon.surface.recipe
    grid, order = recipe.grid, recipe.order
    drawn = recipe.gore.position(grid.s, grid.xi).reshape(grid.rows, grid.columns, 3)
    x = drawn + _displacements(balloon, state.displacement, drawn.reshape(-1, 3)).reshape(drawn.shape)
    r = np.hypot(x[..., 0], x[..., 1])
    s = grid.s.reshape(grid.rows, grid.columns)[:, 0]
    ends = np.arange(0, grid.rows, order)
    middle = (s[ends[1:]] + s[ends[:-1]]) / 2
    if order == 2:
        middle = s[1::2]
    (cable,) = [cable for cable in balloon.cables if cable.tension_only]
    edge, before = x[ends, 0], drawn[ends, 0]
    # the derivative amid an edge of either degree is the chord's
    stretch = np.linalg.norm(np.diff(edge, axis=0), axis=1) / np.linalg.norm(np.diff(before, axis=0), axis=1)
    stretch = stretch / (1 - cable.shares((before[1:] + before[:-1]) / 2))
    tension = cable.EA * np.maximum((stretch**2 - 1) / 2, 0.0) * stretch
    angle = _half_angles(x)
    chord = np.linalg.norm(x[:, -1] - x[:, 0], axis=1) / 2
    with np.errstate(divide="ignore"):  # of flat film the radius is infinite, but not between it and a bulge
        radius = 1 / np.interp(middle, s, np.sin(angle) / chord)
    across = _across(balloon, true_resultants(balloon), strains(balloon))
    return PumpkinMeasures(
        diameter=2 * _peak(r.max(axis=1)),
        tendon_diameter=2 * _peak(r[:, 0]),
        height=float(x[-1, :, 2].mean() - x[0, :, 2].mean()),
        stations=middle / recipe.gore.curve.arc_length,
        tendon_tension=tension,
        bulge_half_angle=np.interp(middle, s, angle),
        bulge_radius=radius,
        resultants=across[:, :2],
        strains=across[:, 3:5],
        max_stress=state.max_stress().value,
    )


def _displacements(balloon: Balloon, displacement: Array, places: Array) -> Array:
    """Displacements (n, 3) at places of the first gore's nodes, on all ranks. Collective."""
    from scipy.spatial import cKDTree

    span = float(np.ptp(places, axis=0).max())
    near, node = cKDTree(balloon.X).query(places) if len(balloon.X) else (np.full(len(places), np.inf), None)
    here = near < 1e-8 * span
    sums = np.zeros((len(places), 4))
    if node is not None:
        sums[here, :3], sums[here, 3] = displacement[node[here]], 1.0
    sums = balloon.comm.allreduce(sums)
    return np.asarray(sums[:, :3] / sums[:, 3:])


def _across(balloon: Balloon, *fields: Any) -> Array:
    """Means over each row of the first gore's cells of fields of three components (rows, 3 n). Collective."""
    recipe = balloon.surface.recipe
    rows = recipe.grid.cells.min(axis=1) // (recipe.grid.columns * recipe.order)
    own = balloon.mesh.topology.index_map(2).size_local
    cells = np.asarray(balloon.mesh.topology.original_cell_index)[:own]
    first = cells < len(rows)
    values = np.hstack([field.x.array.reshape(-1, 3)[:own][first] for field in fields])
    sums = np.zeros((int(rows.max()) + 1, values.shape[1] + 1))
    np.add.at(sums, rows[cells[first]], np.column_stack([values, np.ones(len(values))]))
    sums = balloon.comm.allreduce(sums)
    return np.asarray(sums[:, :-1] / sums[:, -1:])


def _peak(values: Array) -> float:
    """The vertex of the parabola through the largest value and its neighbours."""
    k = min(max(int(np.argmax(values)), 1), len(values) - 2)
    a, b, c = values[k - 1 : k + 2]
    bend = a - 2 * b + c
    return float(b - (c - a) ** 2 / (8 * bend)) if bend < 0 else float(max(a, b, c))


def _half_angles(x: Array) -> Array:
    """Half angles (rows,) of the arcs through both tendons and the node nearest to the middle."""
    crown = x[:, x.shape[1] // 2]
    # the angle there between the tendons is pi less the half angle, wherever on the arc it is
    a, b = x[:, 0] - crown, x[:, -1] - crown
    return np.pi - np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.einsum("ij,ij->i", a, b))
