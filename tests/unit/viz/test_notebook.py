"""What a notebook shows of results, and results as PyVista grids."""

from functools import partial
from html.parser import HTMLParser

import builders
import numpy as np
import pytest

from lobefem import (
    FixedWrinkles,
    critical_pressure,
    find_modes,
    harmonic_pressures,
    ideal_state,
    inflate,
    trace,
)
from lobefem.display import Summarized, Summary
from lobefem.errors import InputError

balloon_of = partial(builders.stack, film=FixedWrinkles(), prestressed=True)


@pytest.fixture(scope="module")
def modes():
    return find_modes(inflate(balloon_of(), 1000.0), count=3)


def area(grid):
    return float(np.abs(grid.compute_cell_sizes(length=False, volume=False)["Area"]).sum())


@pytest.mark.parametrize(
    ("mesh", "vtk_type"),
    [
        ({}, 5),
        ({"cell": "quadrilateral"}, 9),
        ({"order": 2}, 22),
        ({"cell": "quadrilateral", "order": 2}, 28),
    ],
)
def test_a_state_goes_to_pyvista_in_one_call(mesh, vtk_type, comm):
    balloon = balloon_of(**mesh)
    grid = ideal_state(balloon, 1000.0).to_pyvista()
    assert (grid is None) == (comm.rank != 0)
    if grid is None:
        return
    assert set(grid.celltypes) == {vtk_type}
    assert grid.n_points == balloon.V.dofmap.index_map.size_global
    # nodes of a cell taken in the right order make up the film; VTK cuts curved cells into flat ones
    assert area(grid) == pytest.approx(balloon.reference_area, rel=0.03)
    shape, middle = balloon.surface.shape, grid.cell_centers().points
    assert set(grid["lobe"][middle[:, 2] < shape.height]) == {1}
    assert set(grid["lobe"][middle[:, 2] > shape.height]) == {2}
    # N_m = p R0^2/(2 R) at each cell's own place: fields lie on their cells
    N = 1000.0 * shape.R0**2 / (2 * np.hypot(middle[:, 0], middle[:, 1]))
    np.testing.assert_allclose(grid["stress_resultants"][:, 0], N, rtol=0.12)
    assert np.corrcoef(grid["stress_resultants"][:, 0], N)[0, 1] > 0.98
    np.testing.assert_array_equal(grid["regions"], np.tile([0, 1, 0], (grid.n_cells, 1)))


def test_points_of_a_states_grid_are_where_its_nodes_are(modes, comm):
    state = modes.state
    drawn, moved, along = state.balloon.surface.to_pyvista(), state.to_pyvista(), modes.to_pyvista(0)
    if comm.rank:
        return
    way = np.linalg.norm(moved["displacement"], axis=1)
    assert way.max() == pytest.approx(state.max_displacement, rel=1e-12)
    assert way.max() > 1e-6
    for grid in (moved, along):
        np.testing.assert_array_equal(grid["displacement"], moved["displacement"])
        np.testing.assert_allclose(grid.points - grid["displacement"], drawn.points, rtol=0, atol=1e-12)


@pytest.mark.parametrize("mesh", [{}, {"cell": "quadrilateral", "order": 2}])
def test_grids_have_the_order_of_the_displacement(mesh, comm):
    """One order for nodes(), displacement and grids: a script that combines them is right."""
    state = ideal_state(balloon_of(**mesh), 1000.0)
    modes = find_modes(state, count=1)
    mode, own = modes[0], state.balloon.V.dofmap.index_map.size_local
    np.testing.assert_array_equal(mode.nodes(), state.nodes())
    x, moved = (np.concatenate(comm.allgather(f[:own])) for f in (state.nodes(), mode.displacement))
    grids = state.balloon.surface.to_pyvista(), state.to_pyvista(), modes.to_pyvista(0)
    if comm.rank == 0:
        for grid in grids:
            np.testing.assert_allclose(grid.points, x, rtol=0, atol=1e-12)
        np.testing.assert_array_equal(grids[2]["mode"], moved)
        # cells still join their own nodes
        assert area(grids[0]) == pytest.approx(state.balloon.reference_area, rel=0.03)


def test_modes_and_surfaces_do_too(modes, comm):
    state = modes.state
    flat = state.balloon.surface.to_pyvista()
    grids = [modes.to_pyvista(k) for k in range(3)]
    with pytest.raises(InputError, match="mode 3 is not there; choose from 0 to 2"):
        modes.to_pyvista(3)
    if comm.rank != 0:
        assert flat is None
        assert grids == [None] * 3
        return
    np.testing.assert_allclose(grids[0].points, flat.points + grids[0]["displacement"], rtol=0, atol=1e-12)
    for grid in grids:
        size = np.linalg.norm(grid["mode"] + 1j * grid["mode_imag"], axis=1)
        assert size.max() == pytest.approx(1.0)
        assert size[flat.points[:, 2] < 1e-9].max() < 1e-12  # the bottom plate is clamped
        assert grid.active_vectors_name == "mode"
    # the twist turns about the axis, so that points move neither along it nor away from it
    x, y, z = grids[2]["mode"].T
    radius = flat.points[:, :2] / np.linalg.norm(flat.points[:, :2], axis=1, keepdims=True)
    assert np.abs(z).max() < 0.02
    assert np.abs((radius * np.stack([x, y], axis=1)).sum(axis=1)).max() < 0.05


class Table(HTMLParser):
    """Texts of a table's cells; fails where tags do not match."""

    def __init__(self, text):
        super().__init__()
        self.open, self.cells = [], []
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag, attributes):
        self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] in ("td", "th"):
            self.cells.append(data)


@pytest.mark.serial
def test_results_tell_their_state_at_a_glance(modes):
    state, balloon = modes.state, modes.state.balloon
    finer, lines = balloon_of(lobes=1, divisions=(8, 16)), []
    chart = harmonic_pressures(finer, range(5))
    critical = critical_pressure(finer, harmonic=4, progress=lines.append)
    path = trace(balloon, [500.0, 1000.0], count=2)
    assert lines == (["critical pressure of harmonic 4"] if finer.comm.rank == 0 else [])
    expected = [
        (balloon.surface, "Surface(2 lobes; mesh 4 x 8; cells 128 triangles; nodes 72", "128 triangles"),
        (balloon, "Balloon(2 lobes, 4 x 8; film FixedWrinkles, 0.05 mm", "clamped, bar rigid"),
        (state, "Equilibrium(1000 Pa, converged", f"{state.volume:.8g} m^3"),
        (modes, "Modes(3 lowest at 1000 Pa, stable; sway, n = 1", f"{modes[0].value.real:.6g}"),
        (chart, f"HarmonicPressures(lowest {chart.pressure:.6g} Pa at n = {chart.lowest}, 8 x 16", "local"),
        (
            critical,
            f"CriticalPressure(unstable from {critical.pressure:.6g} Pa; mode local",
            "8 x 16 divisions",
        ),
        (path, "Trace(ideal state at 2 pressures, stable all along; sway, n = 1", "500 to 1000"),
    ]
    for result, line, cell in expected:
        assert repr(result).startswith(line), repr(result)
        assert "\n" not in repr(result)
        assert cell in Table(result._repr_html_()).cells


@pytest.mark.serial
def test_names_from_outside_cannot_write_html():
    class Odd(Summarized):
        def _summary(self):
            return Summary("<b>", (("<script>", "a & b"),), ("<i>", ""))

    text = Odd()._repr_html_()
    assert "<script>" not in text
    assert Table(text).cells == ["<i>", "<script>", "a & b"]
    assert repr(Odd()) == "Odd(<b>; <script> a & b)"
