"""What is summed over the ranks is what one rank finds, of fields that differ on all of them."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from states import nodes, unknowns, wavy

from lobefem.equilibrium import form_finding
from lobefem.equilibrium.displacement_control import constrain
from lobefem.equilibrium.distortions import Bend, Tip, Wave
from lobefem.equilibrium.energy_ledger import Ledger
from lobefem.equilibrium.gradient_flow import GradientFlow
from lobefem.equilibrium.state import record
from lobefem.fem import functionals, rigid_motions
from lobefem.fem.balloon import Balloon
from lobefem.fem.functionals import mid_hoop_displacement
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.linalg import petsc
from lobefem.model.cables import Hoops
from lobefem.model.end_plates import EndPlates
from lobefem.model.film import Isotropic
from lobefem.model.gas_pressure import GasPressure
from lobefem.stability import branch_following, path_rates
from lobefem.stability.cyclic import Sector
from lobefem.stability.fourier import spectrum
from lobefem.stability.mode_kinds import kind_of

from mpi4py import MPI


def stack(comm, support="pinned", load="closed", lobes=2, **mesh):
    surface = lobed_cylinder(lobes, **({"divisions": (4, 8)} | mesh), comm=comm)
    return Balloon(surface, Isotropic(), [GasPressure(load), Hoops(EA=2e5), EndPlates(support)])


def field(balloon, seed=1):
    """Displacements that no symmetry makes alike on two ranks."""
    x = nodes(balloon)
    return (0.02 + 0.05 * x[:, :1] + 0.1 * x[:, 2:] ** 2) * wavy(x, seed, 2.0)


def turned(balloon):
    x, centre = nodes(balloon), balloon.motion.centres[0]
    return Rotation.from_rotvec([0.1, 0.2, 0]).apply(x - centre) + centre - x + 0.1 * field(balloon, 2)


def placed(balloon, seed=1):
    parameters = np.linspace(-0.02, 0.03, balloon.map.num_parameters)
    q = unknowns(balloon, 0.05 * field(balloon, seed), parameters)
    balloon.set_loads(50.0)
    balloon.set_unknowns(q)
    return q


def state(balloon):
    return record(balloon, placed(balloon), True, "placed", 0, ())


def residual(balloon):
    q = placed(balloon)
    r, d = q.duplicate(), placed(balloon, 3)
    balloon.residual(q, r)
    return r.norm(), r.dot(d), float(balloon.map.parameters(r).sum())


def tangent(balloon):
    q, a, b = (placed(balloon, seed) for seed in (1, 2, 3))
    K, B = balloon.tangent(q), balloon.mass(q)
    found = [petsc.largest_entry(K), petsc.num_negative(K)]
    for matrix in (K, B):
        out = a.duplicate()
        matrix.mult(a, out)
        found += [matrix.norm(), out.dot(b)]
    return (*found, balloon.second_variation(q, a, b))


def plates(balloon):
    """What the rims pull at the plates, and its curvature."""
    placed(balloon)
    r = balloon.assembly.residual()
    gradient, curvature = balloon.map.plate_forces(r, balloon.w)
    return (*gradient, *curvature.ravel())


def areas(balloon):
    found = functionals.nodal_areas(balloon)
    return balloon.comm.allreduce(found @ balloon.X[: len(found)])


def guided(distortion):
    def reaction(balloon):
        led = constrain(balloon, distortion)
        led.prescribed.parameter = distortion.parameter / 2
        return led.reaction(placed(led))

    return reaction


def middle(balloon):
    """The mean displacement of the middle ring, as a release writes it down."""
    flow = GradientFlow(balloon, placed(balloon), damping=1.0, tolerance=1.0, settled=1e99, ledger=Ledger())
    try:
        flow.run()
        return (*flow.history[0].middle, flow.history[0].residual)
    finally:
        flow.destroy()


def table_of_a_sector(balloon):
    """The mean over the sectors of a state that is nearly the same in all of them."""
    x = balloon.X
    q = unknowns(balloon, x * [0.02, 0.02, 0.1] * np.sin(x[:, 2:]), 0.0)
    own = Sector(balloon).restrict(balloon, q)
    return own.norm(), float(own.array @ np.arange(own.array.size))


def mac(mass):
    """Inner products of motions with a mass, by which modes are followed."""

    def products(balloon):
        owned = 3 * balloon.V.dofmap.index_map.size_local
        columns = np.array([field(balloon, seed).ravel()[:owned] for seed in (1, 2, 3)]).T
        return branch_following._inner(SimpleNamespace(state=state(balloon), mass=mass), columns, columns)

    return products


MEASURES = {
    "areas at nodes": areas,
    "bar and cables": lambda b: (state(b).bar_force, *state(b).hoop_tension),
    "distance": lambda b: rigid_motions.distance_of(b, field(b, 3), turned(b)),
    "energies": lambda b: (*b.energy(placed(b)), b.strain_energy(), b.volume(), b.load_norm(placed(b))),
    "harmonics": lambda b: spectrum(b, field(b), field(b, 2)),
    "largest": lambda b: (
        functionals.largest(b, field(b) + 1j * field(b, 2)),
        rigid_motions.largest_of_state(b, turned(b)),
    ),
    "length by mass": lambda b: path_rates.length(b, field(b)),
    "likeness by area": mac("unit"),
    "likeness by nodes": mac("nodal"),
    "middle hoop": lambda b: mid_hoop_displacement(b, state(b).displacement),
    "middle ring": middle,
    "means of rows": lambda b: form_finding.row_means(state(b)),
    "plates": plates,
    "reference": lambda b: (b.reference_area, b.reference_volume),
    "regions": lambda b: placed(b) and functionals.region_areas(b),
    "residual": residual,
    "share of strain": lambda b: functionals.straining_share(b, field(b), field(b, 2)),
    "state in one sector": table_of_a_sector,
    "tangent": tangent,
    "tip": guided(Tip(0.3)),
    "bend": guided(Bend(5.0)),
    "wave": guided(Wave(2, 0.1)),
}


def compare(find, comm, **options):
    """All ranks look at what each has found, so that none waits where another fails."""
    many, one = (np.asarray(find(stack(group, **options)), dtype=float) for group in (comm, MPI.COMM_SELF))
    assert np.abs(one).max() > 0
    for found in comm.allgather(many):
        np.testing.assert_allclose(found, one, rtol=1e-10, atol=1e-10 * np.abs(one).max())


@pytest.mark.parametrize("support", ["pinned", "clamped"])
@pytest.mark.parametrize("name", MEASURES)
def test_measures(comm, name, support):
    compare(MEASURES[name], comm, support=support)


@pytest.mark.parametrize("name", ["residual", "tangent", "plates", "energies", "bend"])
def test_measures_under_film_pressure(comm, name):
    compare(MEASURES[name], comm, load="film")


def test_the_middle_of_an_odd_number_of_lobes(comm):
    for name in ("middle hoop", "middle ring"):
        compare(MEASURES[name], comm, lobes=3)


def test_kinds_of_modes(comm):
    """Twist or swelling is told by sums over all nodes, local or global by an integral."""
    for swelling in (0.7, 1.3):

        def kinds(balloon, swelling=swelling):
            x, radius = balloon.X, np.linalg.norm(balloon.X[:, :2], axis=1)
            around = np.stack([-x[:, 1], x[:, 0], 0 * radius], axis=1) * x[:, 2:] ** 2
            outwards = (x * [1, 1, 0]) * (x[:, 2:] - balloon.motion.length) ** 2
            return kind_of(balloon, around + swelling * outwards + 0j, 0)

        expected = "twist" if swelling < 1 else "global"
        assert set(comm.allgather(kinds(stack(comm)))) == {kinds(stack(MPI.COMM_SELF))} == {expected}
