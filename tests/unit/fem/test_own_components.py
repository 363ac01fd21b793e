"""Components of a user's own class: an energy in UFL, forces at nodes."""

import numpy as np
import pytest
from states import nodes, unknowns, wavy
from taylor import assert_derivatives

from lobefem.errors import InputError
from lobefem.fem.balloon import Balloon
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.linalg.assembly import NodalVector
from lobefem.model.end_plates import EndPlates
from lobefem.model.film import Isotropic
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.supports import FreeBody
from lobefem.stability.cyclic import sector_balloon

import ufl
from dolfinx import fem

WIND = np.array([30.0, -20.0, 50.0])  # [Pa]


class Bed:
    """Springs that harden."""

    def __init__(self, stiffness=1e5):
        self.stiffness = stiffness

    def potential(self, balloon):
        square = ufl.inner(balloon.u, balloon.u)
        return fem.Constant(balloon.mesh, self.stiffness) * (square / 2 + square**2) * balloon.dx


class Wind:
    """A dead load as an energy."""

    def potential(self, balloon):
        return -ufl.inner(fem.Constant(balloon.mesh, WIND), balloon.u) * balloon.dx


class NodalWind:
    """The same as forces at nodes."""

    def forces(self, balloon):
        v = ufl.TestFunction(balloon.V)
        form = fem.form(ufl.inner(fem.Constant(balloon.mesh, WIND), v) * balloon.dx)
        owned = NodalVector(form).assemble(form)
        found = np.zeros(balloon.X.size)
        found[: owned.size] = owned
        return found.reshape(-1, 3)


def balloon_of(comm, *own):
    surface = lobed_cylinder(1, (4, 8), cell="quadrilateral", comm=comm)
    return Balloon(surface, Isotropic(E=1e8), [GasPressure(), EndPlates(), *own])


def test_derivatives_with_own_components(comm):
    balloon = balloon_of(comm, Bed(), NodalWind(), Wind())
    balloon.set_loads(1e4)
    q = unknowns(balloon, 0.02 * wavy(nodes(balloon), 4, 2.0), 0.01)
    d = unknowns(balloon, wavy(nodes(balloon), 5, 2.0), 0.1)
    assert_derivatives(balloon, q, d, 1e-5, energy=1e-5, residual=1e-5)


def test_forces_at_nodes_are_those_of_the_same_energy(comm):
    one, other, bare = (balloon_of(comm, *own) for own in ([Wind()], [NodalWind()], []))
    q = unknowns(one, 0.02 * wavy(nodes(one), 4, 2.0), 0.01)
    forces, works = [], []
    for balloon in (one, other, bare):
        balloon.set_loads(1e4)
        r = q.duplicate()
        balloon.residual(q, r)
        forces.append(r)
        works.append(balloon.energy(q)[0])
    size = forces[0].copy()
    size.axpy(-1, forces[2])
    assert size.norm() > 1.0  # the wind is there
    forces[0].axpy(-1, forces[1])
    assert forces[0].norm() < 1e-10 * size.norm()
    assert works[0] == pytest.approx(works[1], rel=1e-12)
    assert abs(works[0] - works[2]) > 1e-3


def test_own_components_survive_changes(comm):
    balloon = balloon_of(comm, Bed())
    finer = balloon.remeshed(lobed_cylinder(1, (6, 8), cell="quadrilateral", comm=comm))
    assert finer.components == balloon.components
    with pytest.raises(InputError, match=r"a component of your own need not be the same in all sectors"):
        sector_balloon(balloon)
    single = Balloon(balloon.surface, balloon.film, Bed())
    assert len(single.components) == 1


class Flat:
    def forces(self, balloon):
        return np.zeros(3)


class Number:
    def potential(self, balloon):
        return 1.0


class Words:
    def forces(self, balloon):
        return "none"


class Complex:
    def forces(self, balloon):
        return 1j * balloon.X


@pytest.mark.parametrize(
    ("part", "words"),
    [
        (Words(), r"Words.forces returns an array of shape \(\) of <U4; return finite forces at the nodes"),
        (Complex(), r"Complex.forces returns an array of shape .* of complex128; return finite forces"),
        (
            Flat(),
            r"Flat.forces returns an array of shape \(3,\) of float64; return finite forces at the nodes",
        ),
        (Number(), r"Number.potential returns float; return an energy in UFL"),
        (object(), r"is no part of a balloon; .* or a part of your own with a method potential or forces"),
        (Bed, r"Bed is a class and no part of a balloon; make one of it, Bed\(\)"),
    ],
)
def test_what_is_no_component_is_refused(comm, part, words):
    with pytest.raises(InputError, match=words):
        balloon_of(comm, part)


def test_a_free_body_has_no_loads_of_its_own(comm):
    surface = lobed_cylinder(1, (4, 8), comm=comm)
    with pytest.raises(InputError, match=r"leave a component of your own out, or FreeBody"):
        Balloon(surface, Isotropic(), [FreeBody(), Bed()])
