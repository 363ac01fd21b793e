"""Surfaces that users bring: what is no film is refused, on one rank and on several."""

from dataclasses import replace

import numpy as np
import pytest
from broken import cases
from hypothesis import strategies as st

from lobefem.equilibrium.inflation import inflate
from lobefem.errors import InputError
from lobefem.fem.balloon import Balloon
from lobefem.geometry import distribute
from lobefem.geometry.stacks import cylinder
from lobefem.model.end_plates import EndPlates
from lobefem.model.film import Isotropic
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.supports import Fixed

RINGS, AROUND = 3, 6


def tube(comm, change=lambda cells: cells, twin=False):
    """A cylinder's surface from cells of one's own; with its twin beside it, tagged as one film."""
    k = np.arange(AROUND)
    angle = 2 * np.pi * k / AROUND
    points = np.concatenate(
        [np.column_stack([np.cos(angle), np.sin(angle), 0 * angle + z]) for z in range(RINGS + 1)]
    )
    cells = []
    for ring in range(RINGS):
        a, b = ring * AROUND + k, ring * AROUND + (k + 1) % AROUND
        cells += [*np.column_stack([a, b, b + AROUND]), *np.column_stack([a, b + AROUND, a + AROUND])]
    cells = np.array(cells)
    rims = [np.column_stack([k + j, (k + 1) % AROUND + j]) for j in (0, RINGS * AROUND)]
    if twin:
        cells = np.concatenate([cells, cells + len(points)])
        rims = [np.concatenate([rim, rim + len(points)]) for rim in rims]
        points = np.concatenate([points, points + np.array([5.0, 0.0, 0.0])])
    cells = change(cells)
    whole = (points, cells) if comm.rank == 0 else (None, None)
    mesh = distribute.distribute_mesh(comm, "triangle", 1, *whole)
    pattern = cylinder(1.0, float(RINGS), (RINGS, AROUND), comm=comm)
    values = [pattern.groups[name][1] for name in ("rim_bottom", "rim_top")]
    edges = distribute.edge_tags(mesh, rims, values, len(points))
    lobes = distribute.lobe_tags(mesh, np.array([0, len(cells)]))
    return replace(pattern, mesh=mesh, edges=edges, lobes=lobes, cyclic_order=None, divisions=None)


def balloon(surface):
    return Balloon(surface, Isotropic(E=1e7), [GasPressure("closed"), EndPlates("clamped", bar=False)])


def flipped(cells, at):
    cells = cells.copy()
    cells[at] = cells[at][..., ::-1]
    return cells


def test_a_sound_surface_of_ones_own_is_inflated(comm):
    mine = inflate(balloon(tube(comm)), 10.0)
    ours = inflate(balloon(cylinder(1.0, float(RINGS), (RINGS, AROUND), comm=comm)), 10.0)
    assert mine.volume == pytest.approx(ours.volume, rel=1e-9)


@pytest.mark.parametrize(
    ("change", "twin", "message"),
    [
        (lambda cells: flipped(cells, 5), False, "neighbours turned to opposite sides"),
        (lambda cells: flipped(cells, slice(None)), False, "the surface's cells are turned inwards"),
        (lambda cells: np.delete(cells, 14, axis=0), False, "the mesh has 3 free edges beside its two rims"),
        (lambda cells: cells, True, "falls apart into 2 pieces"),
    ],
    ids=["one-turned", "all-turned", "open", "disconnected"],
)
def test_what_is_no_film_is_refused(comm, change, twin, message):
    surface = tube(comm, change, twin)
    with pytest.raises(InputError, match=message):
        balloon(surface)


@cases(0.02, 3, some=st.sets(st.integers(0, 2 * RINGS * AROUND - 1), max_size=4), turned=st.booleans())
def test_cells_turned_or_left_out_at_random(comm, some, turned):
    """Any change of cells is refused, or the solve fails; never another volume."""
    at = sorted(some)
    surface = tube(comm, lambda c: flipped(c, at) if turned else np.delete(c, at, axis=0))
    if not some:
        assert balloon(surface).reference_volume == pytest.approx(RINGS * 6 * np.sqrt(3) / 4)
        return
    with pytest.raises(InputError):
        balloon(surface)


def test_a_third_cell_at_an_edge_is_refused(comm):
    with pytest.raises(InputError, match="edges of more than two cells"):
        balloon(tube(comm, lambda cells: np.concatenate([cells, [[0, 1, RINGS * AROUND + 2]]])))


def test_a_film_that_nothing_holds_takes_the_same_shape_as_one_just_held(comm):
    """Six rigid motions are free; three nodes that are held in 3, 2 and 1 directions take them away."""

    def near(x, y):
        return lambda points: np.linalg.norm(points.T - [x, y, 0.0], axis=1) < 1e-9

    surface = tube(comm)
    held = [
        Fixed(near(1, 0)),
        Fixed(near(-1, 0), components=(1, 2)),
        Fixed(near(0.5, np.sqrt(3) / 2), components=(2,)),
    ]
    states = [
        inflate(Balloon(surface, Isotropic(E=1e7), [GasPressure("film"), *parts]), 10.0)
        for parts in ([], held)
    ]
    assert states[0].strain_energy == pytest.approx(states[1].strain_energy, rel=1e-8)
    assert states[0].volume == pytest.approx(states[1].volume, rel=1e-8)
    assert states[0].strain_energy > 0
