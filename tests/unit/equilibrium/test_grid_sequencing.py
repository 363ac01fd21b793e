"""From a coarser mesh to a finer one, and the start that `inflate` takes from there."""

import numpy as np
import pytest
from states import nodes, unknowns

from lobefem.equilibrium import grid_sequencing
from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.solver_options import NewtonOptions
from lobefem.fem.balloon import Balloon
from lobefem.geometry.isotensoid import Isotensoid
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.model.cables import Hoops
from lobefem.model.end_plates import EndPlates
from lobefem.model.film import Isotropic
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.supports import Fixed
from lobefem.model.tension_field import TensionField

import ufl
from mpi4py import MPI

SEAM = Isotensoid.from_edge_radius().height


def field(x):
    """A smooth displacement of points (n, 3), bent at the seam of two lobes."""
    theta, height = np.arctan2(x[:, 1], x[:, 0]), np.abs(x[:, 2] - SEAM)
    return np.column_stack((np.cos(2 * theta), np.sin(theta) * height, height**2))


def interpolation_error(comm, divisions, **mesh):
    fine = Balloon(lobed_cylinder(2, divisions, comm=comm, **mesh), Isotropic())
    coarse = grid_sequencing.coarser_balloon(fine, above=0)
    fine.set_unknowns(grid_sequencing.interpolate(coarse, unknowns(coarse, field(nodes(coarse))), fine))
    error = np.abs(fine.u.x.array.reshape(-1, 3) - field(nodes(fine))).max(axis=1)
    exact = comm.allreduce(np.count_nonzero(error[: fine.map.owned // 3] < 1e-12))
    return comm.allreduce(error.max(), op=MPI.MAX), exact, coarse.V.dofmap.index_map.size_global


@pytest.mark.parametrize("mesh", [{}, {"order": 2, "cell": "quadrilateral"}], ids=["linear", "quadratic"])
def test_interpolation_is_cubic_within_each_lobe(comm, mesh):
    coarse, exact, common = interpolation_error(comm, (8, 12), **mesh)
    fine, _, _ = interpolation_error(comm, (16, 24), **mesh)
    assert exact >= common
    assert coarse / fine > 7  # third order next to a seam, fourth elsewhere


@pytest.mark.parametrize("load", ["closed", "film"])
def test_a_nested_start_leads_to_the_same_state_of_a_stack_with_hoops(comm, load):
    parts = [GasPressure(load), Hoops(), EndPlates(support="clamped", bar=True)]
    balloon = Balloon(lobed_cylinder(2, (16, 12), comm=comm), TensionField(slack_stiffness=1e-4), parts)
    said = []
    found, direct = (
        inflate(balloon, 5.0, nested=True, options=NewtonOptions(nest_above=0), progress=said.append),
        inflate(balloon, 5.0),
    )
    assert ["on 8x6" in line for line in said] == [True, False]
    assert found.steps == direct.steps
    assert found.volume == pytest.approx(direct.volume, rel=1e-9)
    difference = np.abs(found.displacement - direct.displacement).max(initial=0.0)
    assert comm.allreduce(difference, op=MPI.MAX) < 1e-6 * direct.max_displacement


def test_what_has_no_coarser_mesh_starts_as_it_is(comm):
    surface = lobed_cylinder(1, (8, 9), comm=comm)
    held = [Fixed(rim) for rim in ("rim_bottom", "rim_top")]
    assert grid_sequencing.coarser_balloon(Balloon(surface, Isotropic(), held), above=0) is None
    assert inflate(
        Balloon(surface, Isotropic(), held), 5.0, nested=True, options=NewtonOptions(nest_above=0)
    ).converged


def test_where_the_coarse_start_leads_nowhere_the_reference_shape_does(comm, monkeypatch):
    balloon = Balloon(lobed_cylinder(1, (8, 8), comm=comm), Isotropic(), [EndPlates(support="clamped")])

    def astray(coarse, q, fine):
        return unknowns(fine, 1e3 * nodes(fine)[:, [1, 2, 0]])

    monkeypatch.setattr("lobefem.equilibrium.inflation.interpolate", astray)
    said = []
    found = inflate(
        balloon,
        5.0,
        nested=True,
        options=NewtonOptions(max_iterations=12, nest_above=0),
        progress=said.append,
    )
    assert found.converged
    assert len(said) == 3


def test_film_bound_to_its_mesh_has_no_coarser_one():
    """Layers, a pattern or functions belong to one mesh; such film is inflated on that alone."""
    surface = lobed_cylinder(1, divisions=(6, 12))
    layers = ufl.conditional(ufl.gt(ufl.SpatialCoordinate(surface.mesh)[2], 1.0), 2.0, 1.0)
    for given in ({"layers": layers}, {"film": Isotropic(E=surface.by_region({"lobe_1": 1e9}))}):
        film = given.pop("film", Isotropic())
        assert (
            grid_sequencing.coarser_balloon(Balloon(surface, film, [EndPlates()], **given), above=0) is None
        )
