"""Modes and critical pressures: pairs, bounds, subspaces, held plates, errors."""

from dataclasses import replace
from functools import partial

import builders
import numpy as np
import pytest
import scipy.linalg
from states import nodes, unknowns, wavy

from lobefem.equilibrium.displacement_control import distort
from lobefem.equilibrium.distortions import Bend
from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.newton import has_symmetric_load
from lobefem.equilibrium.state import ideal_state
from lobefem.errors import EigenError, InputError
from lobefem.fem.balloon import Balloon
from lobefem.geometry.isotensoid import Isotensoid
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.model.cables import Hoops
from lobefem.model.end_plates import EndPlates
from lobefem.model.film import Isotropic
from lobefem.model.fixed_wrinkles import FixedWrinkles
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.supports import Fixed
from lobefem.stability import modes as eigensolver
from lobefem.stability.harmonic_buckling import harmonic_pressures
from lobefem.stability.linear_buckling import critical_pressure
from lobefem.stability.modes import find_modes

from mpi4py import MPI

stack = partial(builders.stack, lobes=1, divisions=(6, 10), prestressed=True)


def dense(matrix):
    """A distributed matrix as an array on every rank."""
    comm = matrix.getComm().tompi4py()
    rows, columns, values = matrix.getValuesCSR()
    block = np.zeros((len(rows) - 1, matrix.getSize()[1]))
    block[np.repeat(np.arange(len(rows) - 1), np.diff(rows)), columns] = values
    return np.concatenate(comm.allgather(block))


@pytest.mark.slow
def test_stiff_hoops_do_not_hide_a_load_without_potential(comm):
    """At 5 Pa on 0.05 m the load's asymmetry is below the round-off of the hoops' 5e11 N/m."""
    surface = lobed_cylinder(2, (4, 8), shape=Isotensoid.from_edge_radius(0.05), comm=comm)
    found = {}
    for EA in (1e7, 2.15e9):
        parts = [GasPressure("film"), Hoops(EA=EA), EndPlates(support="clamped")]
        balloon = Balloon(surface, FixedWrinkles(), parts, prestressed=True)
        state = ideal_state(balloon, 5.0)
        assert not has_symmetric_load(balloon, state.restore())
        found[EA] = find_modes(state, 4), find_modes(state, 4, harmonics=range(5))
    for modes in found[2.15e9]:
        assert not modes.symmetric
        assert modes.num_negative is None
        np.testing.assert_allclose(modes.values, found[1e7][0].values, rtol=2e-3)
        assert abs(modes.values[0].imag) > 0
    parts = [GasPressure("film"), Hoops(), EndPlates("fixed")]
    held = Balloon(surface, FixedWrinkles(), parts, prestressed=True)
    assert find_modes(ideal_state(held, 5.0), 4).symmetric


@pytest.mark.parametrize("mass", ["unit", "nodal"])
@pytest.mark.parametrize("load", ["closed", "film"])
@pytest.mark.parametrize("film", [FixedWrinkles(), Isotropic()], ids=["wrinkled", "isotropic"])
def test_lowest_eigenvalues_are_those_of_dense_algebra(comm, film, load, mass):
    state = ideal_state(stack(comm, film, load), 1000.0)
    modes = find_modes(state, count=7, mass=mass)
    q = state.restore()
    K, B = dense(state.balloon.tangent(q)), dense(state.balloon.mass(q, mass))
    exact = scipy.linalg.eig(K, B, right=False)
    exact = exact[np.lexsort((-exact.imag, np.abs(exact.imag), np.round(exact.real, 5)))]
    found = modes.values
    np.testing.assert_allclose(found.real, exact.real[: len(found)], rtol=1e-7)
    np.testing.assert_allclose(found.imag, exact.imag[: len(found)], rtol=0, atol=1e-6 * abs(found[0]))
    assert modes.symmetric is (load == "closed")
    assert modes.mass == mass
    assert all(m.residual < 1e-6 for m in modes.modes)
    if load == "closed":
        assert np.all(found.imag == 0)
        assert modes.num_negative == int((exact.real < 0).sum())
    else:
        assert modes.num_negative is None
        assert modes.asymmetry > 1e-8
    np.testing.assert_allclose(np.sort(found.real), found.real)
    assert modes.stable is bool(found.real.min() > 0)


def test_negative_eigenvalues_are_found_from_the_lowest(comm):
    """Far beyond its critical pressure the film has many: inertia and list agree."""
    state = ideal_state(stack(comm, FixedWrinkles(), divisions=(8, 24)), 3e4)
    modes = find_modes(state, count=6)
    assert not modes.stable
    assert modes.num_negative >= 6
    K, B = (dense(m) for m in (state.balloon.tangent(state.restore()), state.balloon.mass(state.vector())))
    exact = scipy.linalg.eigh(K, B, eigvals_only=True)
    np.testing.assert_allclose(modes.values.real, exact[:6], rtol=1e-7)
    assert modes.num_negative == int((exact < 0).sum())


def test_a_double_eigenvalue_spans_the_subspace_of_its_rotations(comm):
    """The sway pair as a subspace: turned by one sector it stays in itself, however it was mixed."""
    balloon = stack(comm, Isotropic())
    modes = find_modes(ideal_state(balloon, 1000.0), count=4)
    pair = [m for m in modes.modes if m.kind == "sway"][:2]
    assert pair[0].value.real == pytest.approx(pair[1].value.real, rel=1e-9)
    owned = balloon.V.dofmap.index_map.size_local
    M = balloon.mass_matrix()

    def product(a, b):
        x, y = M.createVecs()
        x.array[:] = a[:owned].ravel()
        M.mult(x, y)
        z = x.duplicate()
        z.array[:] = b[:owned].ravel()
        return y.dot(z)

    u, v = (m.displacement for m in pair)
    gram = np.array([[product(a, b) for b in (u, v)] for a in (u, v)])
    assert np.linalg.cond(gram) < 1e3  # two independent modes
    # the top plate's sway directions of the two span the plane: no direction is preferred
    top = balloon.edge_nodes("rim_top")
    means = []
    for m in (u, v):
        mine = top[top < owned]
        total = comm.allreduce(m[mine].sum(axis=0))
        means.append(total / comm.allreduce(len(mine)))
    basis = np.linalg.cholesky(np.linalg.inv(gram)).T  # rows make the modes orthonormal
    motions = (basis @ np.array(means))[:, :2]
    s = np.linalg.svd(motions, compute_uv=False)
    assert s[0] == pytest.approx(s[1], rel=1e-6)


def test_complex_pairs_are_kept_whole(comm):
    state = ideal_state(stack(comm, FixedWrinkles(), "film"), 1000.0)
    all_modes = find_modes(state, count=6)
    first = all_modes[0].value
    assert first.imag > 0
    assert all_modes[1].value == pytest.approx(np.conj(first), rel=1e-9)
    one = find_modes(state, count=1)
    assert len(one) == 2  # it straddled the end
    assert one[1].value == pytest.approx(np.conj(one[0].value), rel=1e-9)
    assert np.abs(one[0].displacement_imag).max() > 1e-3
    np.testing.assert_allclose(
        comm.allreduce(
            float((np.abs(one[0].displacement + 1j * one[0].displacement_imag) ** 2).sum(axis=1).max()),
            op=MPI.MAX,
        ),
        1.0,
        rtol=1e-12,
    )


@pytest.mark.parametrize("mass", ["unit", "nodal"])
def test_the_eigenvalue_of_a_rigid_rotation_decides_nothing_however_large(comm, mass):
    for support in ("pinned", "clamped"):
        balloon = stack(comm, Isotropic(), lobes=2, divisions=(4, 6), prestressed=False, support=support)
        modes = find_modes(inflate(balloon, 1000.0), 1, mass=mass)
        assert modes.stable
        assert modes[0].rigid is (support == "pinned")
        one = replace(modes[0], value=complex(-1e3))
        assert replace(modes, modes=(one, *modes.modes[1:])).stable is (support == "pinned")


@pytest.mark.parametrize("lobes", [1, 2])
def test_a_complex_mode_by_harmonics_is_the_full_models_own(comm, lobes):
    """Of a pair each value has its own vector: e^{i theta} goes round one way, its conjugate the other."""
    balloon = stack(comm, FixedWrinkles(), "film", lobes=lobes)
    state = ideal_state(balloon, 1000.0)
    full, split = find_modes(state, 2), find_modes(state, 2, harmonics=[1])
    owned = balloon.V.dofmap.index_map.size_local
    for k, other in ((0, 1), (1, 0)):
        assert split[k].value == pytest.approx(full[k].value, rel=1e-8)
        assert abs(full[k].value.imag) > 0
        fields = [m.displacement[:owned] + 1j * m.displacement_imag[:owned] for m in (full[k], split[k])]
        wrong = full[other].displacement[:owned] + 1j * full[other].displacement_imag[:owned]
        products = [[np.vdot(a, b) for b in (*fields, wrong)] for a in (*fields, wrong)]
        gram = np.abs(comm.allreduce(np.array(products)))
        size = np.sqrt(np.diag(gram))
        alike = gram / np.outer(size, size)
        assert alike[0, 1] == pytest.approx(1, abs=1e-5)
        assert alike[1, 2] < 0.1


def test_second_variation_is_the_tangent_between_two_directions(comm):
    balloon = stack(comm, Isotropic(), lobes=4, divisions=(2, 5), prestressed=False)
    balloon.set_loads(2e4)
    x = nodes(balloon)
    q, a, b = (
        unknowns(balloon, size * wavy(x, seed, 2.0), size * np.linspace(-1, 2, 5))
        for seed, size in ((1, 0.03), (2, 1.0), (3, 1.0))
    )
    Kb = q.duplicate()
    balloon.tangent(q).mult(b, Kb)
    scale = Kb.norm() * a.norm()
    assert balloon.second_variation(q, a, b) == pytest.approx(Kb.dot(a), abs=1e-12 * scale)


@pytest.mark.parametrize("lobes", [1, 2])
def test_critical_pressure_is_where_the_lowest_eigenvalue_vanishes(comm, lobes):
    balloon = stack(comm, FixedWrinkles(), divisions=(8, 24), lobes=lobes, support="fixed")
    critical = critical_pressure(balloon, full=True)
    assert critical.divisions == (8, 24)
    assert critical.pressures[0] == critical.pressure
    assert list(critical.pressures) == sorted(critical.pressures)
    assert critical.mode.value == 0
    below, above = (
        find_modes(ideal_state(balloon, factor * critical.pressure), count=1)
        for factor in (1 - 1e-4, 1 + 1e-4)
    )
    assert below.num_negative == 0
    assert above.num_negative in (1, 2)
    # a mode of zero value: it crosses in proportion to the distance
    assert below[0].value.real == pytest.approx(-above[0].value.real, rel=1e-2)
    assert critical.mode.harmonic == above[0].harmonic


def test_finer_meshes_lower_the_critical_pressure(comm):
    """A property of the mesh (docs/theory/continuum.md): 24 around 11 900 Pa, 32 5 700 Pa, rims held."""
    found = [
        critical_pressure(stack(comm, FixedWrinkles(), divisions=(24, n), support="fixed")).pressure
        for n in (24, 32)
    ]
    np.testing.assert_allclose(found, [11900, 5700], rtol=0.02)


def test_errors(comm):
    balloon = stack(comm, Isotropic(), divisions=(2, 4), prestressed=False)
    state = inflate(balloon, 1.0)
    with pytest.raises(InputError, match=r"^mass 'lumped' is unknown; use 'unit' or 'nodal'$"):
        find_modes(state, mass="lumped")
    size = balloon.map.size
    for count in (0, -3, size + 1):
        with pytest.raises(InputError, match=rf"^count = {count} modes: choose between 1 and {size}$"):
            find_modes(state, count=count)
    with pytest.raises(InputError, match=r"^critical_pressure needs a prestressed balloon; pass pre"):
        critical_pressure(balloon)


@pytest.mark.parametrize(
    "support",
    [[EndPlates("fixed", lift=-0.004)], [Fixed("rim_top", displacement=np.ones_like), Fixed("rim_bottom")]],
)
def test_supports_that_move_the_film_leave_no_ideal_state(comm, support):
    balloon = Balloon(lobed_cylinder(1, (4, 8), comm=comm), FixedWrinkles(), support, prestressed=True)
    for look in (
        lambda: ideal_state(balloon, 5.0),
        lambda: critical_pressure(balloon),
        lambda: harmonic_pressures(balloon),
    ):
        with pytest.raises(InputError, match=r"the supports move the film by .* look at the inflated state"):
            look()


@pytest.fixture
def alike(comm):
    """Seven lobes between rigid rings, which a bend makes of seams: eigenvalues are seven or 14-fold."""
    start = inflate(stack(comm, Isotropic(), divisions=(4, 8), lobes=7, prestressed=False), 1000.0)
    return distort(start, Bend(1e-3), steps=1).state


@pytest.mark.parametrize("count", [1, 3])
def test_all_copies_of_a_value_of_many_are_looked_for(alike, count):
    """One run from a random vector brings one of them."""
    modes = find_modes(alike, count)
    assert modes.num_negative == 0
    many = find_modes(alike, 15)
    np.testing.assert_allclose(modes.values, many.values[:count], rtol=1e-9)


def test_what_a_solver_goes_on_missing_is_said(alike, monkeypatch):
    find, kept = eigensolver.run, []

    def blind(eps, count, seed=1):
        new = find(eps, count, seed)
        kept[:] = kept or new
        return kept

    monkeypatch.setattr(eigensolver, "run", blind)
    with pytest.raises(EigenError, match=r"missed copies of the lowest 1 modes in \d+ runs; .*eps_ncv 200'$"):
        find_modes(alike, 1)
