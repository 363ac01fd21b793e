"""Film cut from flat patterns, in layers, with weight: areas, energies, Taylor tests."""

import numpy as np
import pytest
from builders import pumpkin
from states import nodes, unknowns, wavy
from taylor import assert_derivatives

from lobefem.fem.balloon import Balloon
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.model.cables import Hoops
from lobefem.model.dead_weight import DeadWeight
from lobefem.model.end_plates import EndPlates
from lobefem.model.film import Isotropic
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.orthotropic import Orthotropic
from lobefem.model.tension_field import TensionField

from dolfinx import fem


def field(surface, order, components, f):
    """A discontinuous field of a surface's mesh, from f of positions (3, n)."""
    V = fem.functionspace(surface.mesh, ("DG", order, (components,) if components > 1 else ()))
    found = fem.Function(V)
    found.interpolate(f)
    return found


def rolled_out(x):
    """The film of a stack laid flat, longer than it is along the axis and askew."""
    return np.array([1.02 * x[2] + 0.02 * x[0], 2.0 * np.arctan2(x[1], x[0])])


@pytest.mark.parametrize("full", [False, True])
@pytest.mark.parametrize(("cell", "order"), [("triangle", 1), ("quadrilateral", 2)])
def test_the_film_of_a_flat_gore_is_as_large_as_the_gore(comm, full, cell, order):
    balloon = pumpkin(comm, gores=8, divisions=(16, 4), cell=cell, order=order, full=full, flat=True)
    gore = balloon.surface.recipe.gore
    s = np.linspace(0, gore.curve.arc_length, 4001)
    area = 2 * np.trapezoid(gore.half_width(s), gore.along(s)) * (8 if full else 1)
    # gores have straight edges between the nodes of linear cells
    assert balloon.reference_area == pytest.approx(area, rel=1e-2 if order == 1 else 1e-4)


@pytest.mark.parametrize("film", [Isotropic(), TensionField(slack_stiffness=1e-3)], ids=["plain", "tension"])
def test_a_pattern_may_show_either_side_of_the_film(comm, film):
    surface = lobed_cylinder(1, (4, 8), comm=comm)
    found = []
    for side in (1.0, -1.0):
        pattern = field(surface, 1, 2, lambda x, side=side: rolled_out(x) * [[1.0], [side]])
        balloon = Balloon(surface, film, [GasPressure(), EndPlates()], pattern=pattern)
        balloon.set_loads(2e4)
        q = unknowns(balloon, 0.03 * wavy(nodes(balloon), 3, 2.0), 0.01)
        r = q.duplicate()
        balloon.residual(q, r)
        found.append((balloon.reference_area, balloon.energy(q)[0], r.norm()))
    np.testing.assert_allclose(*found, rtol=1e-11)
    assert found[0][0] > 0


def test_facets_laid_flat_one_by_one_are_film_as_it_was_drawn(comm):
    surface = lobed_cylinder(1, (4, 8), comm=comm)
    drawn = Balloon(surface, Isotropic(), [GasPressure(), EndPlates()])
    pattern = field(surface, 1, 2, lambda x: x[:2])
    points = nodes(drawn)
    cells = drawn.V.dofmap.list
    flat = pattern.x.array.reshape(-1, 2)
    for corners, places in zip(cells, pattern.function_space.dofmap.list, strict=True):
        a, b, c = points[corners]
        e1 = (b - a) / np.linalg.norm(b - a)
        n = np.cross(b - a, c - a)
        e2 = np.cross(n / np.linalg.norm(n), e1)
        flat[places] = [[(p - a) @ e1, (p - a) @ e2] for p in (a, b, c)]
    balloon = Balloon(surface, Isotropic(), [GasPressure(), EndPlates()], pattern=pattern)
    q = unknowns(balloon, 0.03 * wavy(points, 3, 2.0), 0.01)
    assert balloon.energy(unknowns(balloon, 0 * points))[0] == pytest.approx(0, abs=1e-12)
    assert balloon.reference_area == pytest.approx(drawn.reference_area, rel=1e-12)
    assert balloon.energy(q)[0] == pytest.approx(drawn.energy(q)[0], rel=1e-10)


def test_two_layers_are_film_of_twice_the_thickness(comm):
    surface = lobed_cylinder(2, (4, 8), comm=comm)
    energies = []
    for layers, thickness in ((2.0, 1e-4), (None, 2e-4)):
        given = None if layers is None else field(surface, 0, 1, lambda x: np.full(x.shape[1], 2.0))
        parts = [GasPressure(), Hoops(), EndPlates(), DeadWeight(film=3.0 if layers else 6.0)]
        balloon = Balloon(surface, Isotropic(thickness=thickness), parts, layers=given)
        balloon.set_loads(2e4)
        q = unknowns(balloon, 0.03 * wavy(nodes(balloon), 5, 2.0), 0.01)
        energies.append(balloon.energy(q)[0])
    assert energies[0] == pytest.approx(energies[1], rel=1e-12)


LAWS = {
    "plain": Isotropic(),
    "tension": TensionField(slack_stiffness=1e-3),
    "orthotropic": Orthotropic(E1=2e8, E2=3e8, nu12=0.4, thickness=1e-4, angle=0.3),
}


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize(("cell", "order"), [("triangle", 1), ("quadrilateral", 2)])
def test_gradient_and_tangent_of_patterns_layers_weight_and_gradient(comm, law, cell, order):
    surface = lobed_cylinder(2, (4, 8), cell=cell, order=order, comm=comm)
    pattern = field(surface, order, 2, rolled_out)
    layers = field(surface, 0, 1, lambda x: 1.0 + (x[2] > 0.4))
    parts = [GasPressure(gradient=3.0, level=0.2), Hoops(), EndPlates(bar=False)]
    parts.append(DeadWeight(film=5.0, cables=30.0))
    balloon = Balloon(surface, LAWS[law], parts, pattern=pattern, layers=layers)
    balloon.set_loads(2e4)
    q = unknowns(balloon, 0.02 * wavy(nodes(balloon), 4, 2.0), 0.01)
    d = unknowns(balloon, wavy(nodes(balloon), 5, 2.0), 0.1)
    assert_derivatives(balloon, q, d, 1e-5, energy=1e-5, residual=2e-4)
