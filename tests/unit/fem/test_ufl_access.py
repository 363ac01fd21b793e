"""A balloon in UFL: its forms, its measures, and an energy of the user's own."""

import numpy as np
import pytest

from lobefem.equilibrium.inflation import inflate
from lobefem.errors import InputError
from lobefem.fem.balloon import Balloon
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.imp import PrescribedPath
from lobefem.model.supports import Fixed
from lobefem.model.tension_field import TensionField
from lobefem.stability.cyclic import sector_balloon
from tests.builders import stack

import dolfinx
import ufl
from mpi4py import MPI

COMM = MPI.COMM_WORLD


def total(form):
    return COMM.allreduce(dolfinx.fem.assemble_scalar(dolfinx.fem.form(form)), op=MPI.SUM)


def norm(form):
    """Of an assembled linear form."""
    b = dolfinx.fem.assemble_vector(dolfinx.fem.form(form))
    b.scatter_reverse(dolfinx.la.InsertMode.add)
    owned = b.index_map.size_local * b.block_size
    return np.sqrt(COMM.allreduce(float(b.array[:owned] @ b.array[:owned])))


def moved(balloon, size=1e-3):
    """The balloon displaced by a smooth field."""
    balloon.u.interpolate(lambda x: size * np.stack([np.sin(x[2]), x[0] * x[1], np.cos(x[0])]))
    balloon.set_loads(100.0)
    return balloon


def film(load="closed", **given):
    """Two lobes with both rims held."""
    return stack(film=TensionField(E=1e8), load=load, support="fixed", **given)


def test_residual_and_tangent_are_the_energy_s_derivatives():
    balloon = moved(film())
    u, V = balloon.u, balloon.V
    v, du = ufl.TestFunction(V), ufl.TrialFunction(V)
    direction = dolfinx.fem.Function(V)
    direction.interpolate(lambda x: np.stack([x[1], np.sin(x[2]), x[0] ** 2]))
    size = norm(balloon.residual_ufl)
    assert size > 1
    assert norm(ufl.derivative(balloon.energy_ufl, u, v) - balloon.residual_ufl) < 1e-12 * size
    change = ufl.derivative(balloon.residual_ufl, u, du) - balloon.tangent_ufl
    assert norm(ufl.action(change, direction)) < 1e-9 * norm(ufl.action(balloon.tangent_ufl, direction))


def test_energy_is_that_of_the_solver():
    """With both rims held, plates have no share in its changes."""
    balloon = film()
    state = inflate(balloon, 50.0)
    q = state.restore()
    energy = total(balloon.energy_ufl)
    rest = total(ufl.replace(balloon.energy_ufl, {balloon.u: dolfinx.fem.Function(balloon.V)}))
    first = balloon.energy(q)[0]
    at_rest = balloon.map.create_vector()
    assert energy - rest == pytest.approx(first - balloon.energy(at_rest)[0], rel=1e-9)


def test_loads_and_laws_without_potential_are_refused():
    with pytest.raises(InputError, match=r"the film load has no potential; use residual_ufl"):
        film("film").energy_ufl  # noqa: B018
    with pytest.raises(InputError, match="PrescribedPath film has no energy; use residual_ufl"):
        stack(film=PrescribedPath()).energy_ufl  # noqa: B018


def test_measures_of_named_parts():
    balloon = film(divisions=(4, 12))
    one = dolfinx.fem.Constant(balloon.mesh, 1.0)
    radius = balloon.surface.shape.edge_radius
    chord = 2 * 12 * radius * np.sin(np.pi / 12)
    assert total(one("+") * balloon.measure("seam_1")) == pytest.approx(chord, rel=1e-12)
    assert total(one * balloon.measure("rim_top")) == pytest.approx(chord, rel=1e-12)
    assert total(one * balloon.dx) == pytest.approx(balloon.reference_area, rel=1e-12)
    half = total(one * balloon.measure("lobe_1"))
    assert half == pytest.approx(balloon.reference_area / 2, rel=1e-9)
    assert balloon.surface.length("seam_1") == pytest.approx(chord, rel=1e-12)
    with pytest.raises(InputError, match="no group 'seam_2' on this surface; it has"):
        balloon.measure("seam_2")


def foundation(k):
    """Springs of k [N/m^3] on the whole film."""
    return lambda balloon: k / 2 * ufl.inner(balloon.u, balloon.u) * balloon.dx


def test_an_elastic_foundation_takes_part_in_equilibrium():
    """The stiffer it is the less the film moves; a stiff one carries the pressure alone, u = p n/k."""
    largest = []
    for k in (0.0, 1e4, 1e9):
        balloon = film(extra_energy=foundation(k)) if k else film()
        state = inflate(balloon, 100.0)
        assert state.relative_residual < 1e-8
        largest.append(state.max_displacement)
    assert largest[0] > largest[1] > largest[2]
    assert largest[2] == pytest.approx(100 / 1e9, rel=0.4)
    stiff = film(extra_energy=foundation(1e9))
    q = inflate(stiff, 100.0).restore()
    assert stiff.energy(q)[0] == pytest.approx(-total(foundation(1e9)(stiff)), rel=0.05)


@pytest.mark.parametrize(
    ("energy", "words"),
    [
        (3.0, "extra_energy is of type float; give a function"),
        (lambda balloon: 1.0, "extra_energy returns float; return an energy in UFL"),
        (
            lambda balloon: ufl.inner(balloon.u, ufl.TestFunction(balloon.V)) * balloon.dx,
            "extra_energy returns Form; return an energy",
        ),
    ],
)
def test_what_is_no_energy_is_refused(energy, words):
    with pytest.raises(InputError, match=words):
        film(extra_energy=energy)


def test_an_extra_energy_survives_changes_and_is_of_no_single_harmonic():
    energy = foundation(10.0)
    balloon = film(extra_energy=energy)
    assert balloon.with_changes(film=TensionField(E=2e8)).extra_energy is energy
    assert balloon.remeshed(lobed_cylinder(2, divisions=(2, 6))).extra_energy is energy
    with pytest.raises(InputError, match="an extra_energy need not be the same in all sectors"):
        sector_balloon(balloon)


def test_forms_of_film_without_plates():
    """The assembled residual is the solver's in the free components."""
    surface = film().surface
    parts = [GasPressure("closed"), Fixed("rim_bottom"), Fixed("rim_top")]
    balloon = Balloon(surface, TensionField(E=1e8), parts)
    q = inflate(balloon, 50.0).restore()
    balloon.set_loads(60.0)
    r = balloon.map.create_vector()
    balloon.residual(q, r)
    assembled = dolfinx.fem.assemble_vector(dolfinx.fem.form(balloon.residual_ufl))
    assembled.scatter_reverse(dolfinx.la.InsertMode.add)
    assert assembled.array[balloon.map.free] == pytest.approx(r.array_r, rel=1e-9, abs=1e-9 * r.norm())
