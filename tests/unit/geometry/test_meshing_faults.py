"""Meshing that fails: Gmsh's session, what it may get wrong, arguments that make no mesh."""

import math
import signal
import sys
from types import SimpleNamespace

import gmsh
import numpy as np
import pytest

from lobefem.errors import InputError, MissingDependencyError, SolveError
from lobefem.geometry import gmsh as mesher
from lobefem.geometry import grid
from lobefem.geometry.flat_cylinder import Cylinder
from lobefem.geometry.isotensoid import Isotensoid
from lobefem.geometry.stacks import cylinder, lobed_cylinder

# --- Gmsh's session ----------------------------------------------------------------------------


def test_gmsh_is_closed_again_and_silent(comm, capfd):
    before = signal.getsignal(signal.SIGINT)
    lobed_cylinder(1, (3, 5), comm=comm)
    assert not gmsh.isInitialized()
    assert signal.getsignal(signal.SIGINT) is before
    assert capfd.readouterr().out == ""


def test_a_callers_open_gmsh_session_is_left_as_it_was(comm):
    gmsh.initialize([], readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.ElementOrder", 3)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.123)
        gmsh.model.add("mine")
        gmsh.model.occ.addSphere(0, 0, 0, 1)
        gmsh.model.occ.synchronize()
        entities = gmsh.model.getEntities()
        surface = lobed_cylinder(1, layout="unstructured", size=1.0, comm=comm)
        assert surface.mesh.ufl_domain().ufl_coordinate_element().basix_element.degree == 1
        assert gmsh.isInitialized()
        assert gmsh.model.getCurrent() == "mine"
        assert gmsh.model.getEntities() == entities
        assert [name for name in gmsh.model.list() if name.startswith("lobefem")] == []
        assert gmsh.option.getNumber("Mesh.ElementOrder") == 3
        assert gmsh.option.getNumber("Mesh.MeshSizeMax") == 0.123
    finally:
        gmsh.finalize()


@pytest.mark.parametrize(
    ("thrown", "caught", "match"),
    [
        (Exception("Invalid boundary mesh"), SolveError, r"Gmsh could not .* \(Invalid boundary"),
        (SolveError("gaps"), SolveError, "^gaps$"),
        (MissingDependencyError("no Gmsh"), MissingDependencyError, "^no Gmsh$"),
    ],
)
def test_failure_on_rank_0_is_raised_on_every_rank(comm, monkeypatch, thrown, caught, match):
    def fail(*_):
        raise thrown

    monkeypatch.setattr(mesher, "unstructured", fail)  # only rank 0 ever calls it
    with pytest.raises(caught, match=match):
        lobed_cylinder(layout="unstructured", size=1.0, comm=comm)


def test_missing_gmsh_says_what_to_install(comm, monkeypatch):
    monkeypatch.setitem(sys.modules, "gmsh", None)
    with pytest.raises(MissingDependencyError, match="install python3-gmsh"):
        lobed_cylinder(layout="unstructured", size=1.0, comm=comm)


def test_a_mesh_that_gmsh_got_wrong_is_refused():
    shape = Isotensoid.from_edge_radius()
    raw = mesher.structured(shape, 2, (3, 8))
    surface_grid = grid.structured_grid(raw, shape, (3, 8), "same")
    assert len(surface_grid.cells) == 2 * 2 * 3 * 8

    def changed(**fields):
        return SimpleNamespace(**{**vars(raw), **fields})

    lost = changed(cells=raw.cells[1:], lobes=raw.lobes[1:])
    swapped = changed(lobes=1 - raw.lobes)
    for bad in (lost, swapped):
        with pytest.raises(SolveError, match="not the grid of 6 x 8 cells"):
            grid.structured_grid(bad, shape, (3, 8), "same")
    with pytest.raises(SolveError, match="not the grid of 6 x 16 cells"):
        grid.structured_grid(raw, shape, (3, 16), "same")
    with pytest.raises(SolveError, match=r"m off the surface"):
        grid.structured_grid(changed(points=1.01 * raw.points), shape, (3, 8), "same")

    # what several ranks number by themselves, some of them without a row, is the same
    shares = [grid.grid(shape, 2, (3, 8), "same", 0.0, k, 7) for k in range(7)]
    for name in ("t", "theta", "cells"):
        np.testing.assert_array_equal(
            np.concatenate([getattr(s, name) for s in shares]), getattr(surface_grid, name)
        )

    free = mesher.unstructured(shape, 2, 1.0, 3)
    assert len(grid.unstructured_grid(free, shape).cells) == len(free.cells)
    for cells, lobes in (
        (free.cells[1:], free.lobes[1:]),  # a hole
        (np.vstack((free.cells, free.cells[:1])), np.append(free.lobes, 0)),  # a double cell
    ):
        torn = SimpleNamespace(**{**vars(free), "cells": cells, "lobes": lobes})
        with pytest.raises(SolveError, match="gaps or folds"):
            grid.unstructured_grid(torn, shape)


@pytest.mark.parametrize("corners", [3, 4])
def test_cells_are_turned_outwards_however_gmsh_turned_them(corners):
    shape = Isotensoid.from_edge_radius()
    raw = mesher.unstructured(shape, 1, 1.0, corners)
    mixed = raw.cells.copy()
    mixed[::3] = mixed[::3, ::-1]
    for cells in (raw.cells, mixed, raw.cells[:, ::-1]):
        surface_grid = grid.unstructured_grid(SimpleNamespace(**{**vars(raw), "cells": cells}), shape)
        x = grid.place(shape, 1, surface_grid.t, surface_grid.theta)[surface_grid.cells]
        # DOLFINx's normal: along x1 - x0 and, for either cell, the vertex numbered 2
        normal = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
        assert np.all(np.sum(normal[:, :2] * x.mean(axis=1)[:, :2], axis=1) > 0)


# --- arguments ---------------------------------------------------------------------------------


class NoCommunication:
    """A communicator that must not be used: bad input is refused before any collective call."""

    def __getattr__(self, name):
        raise AssertionError(f"communicated ({name}) before refusing bad input")


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        ({"lobes": 0}, "number of lobes is 0; give 1 or more"),
        ({"lobes": 2.0}, r"number of lobes is 2.0; give an integer"),
        ({"lobes": True}, "number of lobes is True; give an integer"),
        ({"divisions": 24}, "divisions is 24; give two integers"),
        ({"divisions": (24, 32, 1)}, r"divisions is \(24, 32, 1\); give two"),
        ({"divisions": (1, 32)}, "along the meridian is 1; give 2 or more"),
        ({"divisions": (24, 2)}, "around the axis is 2; give 3 or more"),
        ({"divisions": (24.0, 32)}, "along the meridian is 24.0; give an integer"),
        ({"divisions": (24, True)}, "around the axis is True; give an integer"),
        ({"divisions": (10_000, 10_000)}, "more than 50000000; try fewer"),
        ({"divisions": (24, 33), "diagonals": "alternating"}, "even number .* not 33; try 34"),
        ({"diagonals": "left"}, "diagonals is 'left'; give 'same' or 'alternating'"),
        ({"diagonals": "alternating", "cell": "quadrilateral"}, "needs structured triangles"),
        (
            {"diagonals": "alternating", "layout": "unstructured", "size": 1.0},
            "structured triangles",
        ),
        ({"cell": "tetrahedron"}, "cell is 'tetrahedron'; give 'triangle' or 'quadrilateral'"),
        ({"cell": ["triangle"]}, r"cell is \['triangle'\]"),
        ({"order": 3}, "order is 3; give 1 or 2"),
        ({"order": 0}, "order is 0; give 1 or more"),
        ({"layout": "free"}, "layout is 'free'; give 'structured' or 'unstructured'"),
        ({"size": 0.3}, "size is 0.3 but the layout is structured"),
        ({"layout": "unstructured"}, "needs its target size"),
        ({"layout": "unstructured", "size": 0.0}, "size is 0.0; give a positive number"),
        ({"layout": "unstructured", "size": math.nan}, "size is nan; give a finite number"),
        ({"layout": "unstructured", "size": "1 m"}, "size is '1 m'; give a number"),
        ({"layout": "unstructured", "size": 2.5}, "size is 2.5 m, more than the edge radius 2 m"),
        ({"layout": "unstructured", "size": 1e-5}, "gives more than 50000000 cells"),
        ({"shape": Cylinder()}, "shape is Cylinder.*give an Isotensoid"),
    ],
)
def test_bad_arguments_are_refused_before_any_communication(arguments, match):
    with pytest.raises(InputError, match=match):
        lobed_cylinder(**arguments, comm=NoCommunication())


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        ({"radius": 0.0}, "radius is 0.0; give a positive"),
        ({"length": -1.0}, "length is -1.0; give a positive"),
        ({"length": math.inf}, "length is inf; give a finite"),
        ({"divisions": (0, 32)}, "along the meridian is 0; give 1 or more"),
    ],
)
def test_bad_cylinders_are_refused_before_any_communication(arguments, match):
    with pytest.raises(InputError, match=match):
        cylinder(**arguments, comm=NoCommunication())
