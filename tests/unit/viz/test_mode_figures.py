"""The gathered film and the arguments of the figures."""

from itertools import pairwise

import numpy as np
import pytest

from lobefem import (
    Balloon,
    EndPlates,
    FixedWrinkles,
    GasPressure,
    Hoops,
    find_modes,
    ideal_state,
    lobed_cylinder,
)
from lobefem.errors import InputError
from lobefem.stability.branch_following import Branch, follow
from lobefem.viz.film_mesh import facing, gather, normals, outline, polygons
from lobefem.viz.mode_figures import eigenvalue_curves, mode_caption, mode_panel, mode_shapes, spread_labels
from lobefem.viz.rendering import render_modes
from lobefem.viz.views import blank, paint, window


@pytest.fixture(scope="module")
def modes():
    surface = lobed_cylinder(2, (4, 8))
    parts = [GasPressure("film"), Hoops(), EndPlates(bar=True)]
    balloon = Balloon(surface, FixedWrinkles(), parts, prestressed=True)
    return find_modes(ideal_state(balloon, 1000.0), count=6)


def test_gather_holds_every_node_and_cell_once(modes):
    balloon = modes.state.balloon
    film_mesh = gather(balloon, modes[0].displacement)
    assert (film_mesh is None) == (balloon.comm.rank != 0)
    if film_mesh is not None:
        assert film_mesh.x.shape == film_mesh.fields[0].shape == (9 * 8, 3)
        assert film_mesh.faces.shape == (2 * 4 * 8 * 2, 3)
        assert film_mesh.grid.shape == (9, 8)
        assert sorted(film_mesh.grid.ravel()) == list(range(72))
        # rings are level, columns lie in a plane with the axis
        x = film_mesh.x[film_mesh.grid]
        assert np.ptp(x[:, :, 2], axis=1).max() < 1e-9
        assert np.abs(np.diff(np.arctan2(x[:, :, 1], x[:, :, 0]), axis=0)).max() < 1e-9
        assert film_mesh.height == pytest.approx(2 * balloon.surface.shape.height)
        assert np.linalg.norm(film_mesh.fields[0], axis=1).max() <= 1 + 1e-12


def test_polygons_cover_the_film_with_outward_normals(modes):
    film_mesh = gather(modes.state.balloon)
    if film_mesh is not None:
        for step in (1, 2):
            film, top, bottom = polygons(film_mesh, step)
            centre = film_mesh.x[film].mean(axis=1)
            outward = normals(film_mesh.x[film])
            assert len(film) == 8 * 8 // step**2
            assert (np.einsum("ni,ni->n", outward[:, :2], centre[:, :2]) > 0).all()
            assert normals(film_mesh.x[top])[0] == pytest.approx([0, 0, 1])
            assert normals(film_mesh.x[bottom])[0] == pytest.approx([0, 0, -1])
        z, r = outline(film_mesh)
        assert (z[0], r[0]) == pytest.approx((0, 2.0))
        assert (np.diff(z) > 0).all()


def test_sways_are_seen_from_the_side(modes):
    mode = modes[0]
    assert mode.kind == "sway"
    film_mesh = gather(modes.state.balloon, mode.displacement)
    if film_mesh is not None:
        e1, e2 = facing(film_mesh, film_mesh.fields[0])
        top = film_mesh.fields[0][film_mesh.grid[-1]].mean(axis=0)
        assert top @ e1 > 10 * abs(top @ e2)
        assert np.cross(e1, e2) == pytest.approx([0, 0, 1])


def test_labels_are_pushed_apart_and_stay_inside():
    placed = spread_labels(np.array([0.0, 1.0, 1.5, 50.0]), 7.0, 0.0, 60.0)
    assert (np.diff(placed) > 6.9).all()
    assert placed.min() >= 0
    assert placed.max() <= 60
    assert placed[-1] == pytest.approx(50)


def test_unstructured_quadrilaterals_are_drawn_as_cells():
    surface = lobed_cylinder(1, cell="quadrilateral", layout="unstructured", size=1.0)
    balloon = Balloon(surface, FixedWrinkles(), [EndPlates()], prestressed=True)
    film_mesh = gather(balloon)
    if film_mesh is not None:
        (cells,) = polygons(film_mesh, 2)
        area = 0.5 * np.linalg.norm(
            np.cross(film_mesh.x[cells], np.roll(film_mesh.x[cells], -1, axis=1)).sum(axis=1), axis=1
        )
        # corners taken round each cell, not crosswise: the facets make up the film
        assert area.sum() == pytest.approx(surface.shape.area, rel=0.05)


def test_figures_refuse_what_they_cannot_draw(modes, shared_path):
    with pytest.raises(InputError, match=r"modes \[99\] cannot be drawn; choose from 0 to"):
        mode_shapes(modes, [99])
    with pytest.raises(InputError, match="cannot be drawn"):
        render_modes(modes, [], shared_path / "none.png")
    with pytest.raises(InputError, match="two pressures or more"):
        eigenvalue_curves(follow([modes]))


def test_a_mode_at_one_pressure_only_is_seen():
    """One that falls fast may be among the lowest at the last pressure alone, and be the unstable one."""
    rising = Branch("sway", 1, 0, np.array([500.0, 1000.0]), np.array([1.0, 2.0]), ((0,), (0,)), 1.0)
    late = Branch("local", 7, 0, np.array([1000.0]), np.array([-3.0]), ((1,),), 1.0)
    (axes,) = eigenvalue_curves([rising, late]).axes
    assert any(list(line.get_ydata()) == [-3.0] and line.get_marker() == "." for line in axes.lines)
    assert "n = 7" in {text.get_text() for text in axes.texts}
    low, high = axes.get_ylim()
    assert low < -3.0
    assert high > 2.0


def test_captions_of_neighbours_do_not_touch(modes):
    film_mesh = gather(modes.state.balloon, modes[0].displacement)
    if film_mesh is not None:
        long = mode_caption("mode 1", "local", 12, -1234.56, "Pa/m")
        panels = [mode_panel(long, "local", film_mesh, film_mesh.fields[0]) for _ in range(4)]
        figure = blank()
        paint(figure, film_mesh, panels, window(film_mesh, panels), width=85.0)
        boxes = [t.get_window_extent() for t in figure.texts if t.get_text() == long]
        assert len(boxes) == 4
        assert all(a.x1 < b.x0 for a, b in pairwise(boxes))
        assert boxes[0].x0 > 0
        assert boxes[-1].x1 < figure.bbox.width
