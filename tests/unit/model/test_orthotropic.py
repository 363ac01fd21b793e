"""Orthotropic film: against the isotropic laws, against the best direction found by search, Taylor tests."""

import math
import time

import numpy as np
import pytest
from states import nodes, taylor_rates, unknowns, wavy

from lobefem.errors import InputError
from lobefem.fem.balloon import Balloon
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.linalg import dolfinx_compat, petsc
from lobefem.model.film import Isotropic
from lobefem.model.orthotropic import Orthotropic, OrthotropicTensionField
from lobefem.model.supports import Fixed
from lobefem.model.tension_field import TensionField

import basix.ufl
import ufl
from dolfinx import fem
from dolfinx.mesh import create_unit_interval
from mpi4py import MPI

ET = 3.5e9 * 5e-5
NASA = {"E1": 212.5e6, "E2": 246.6e6, "nu12": 0.58, "thickness": 38.1e-6}  # nu21 = 0.673
HUBER = math.sqrt(212.5e6 * 246.6e6) / (2 * (1 + 0.58 * math.sqrt(246.6 / 212.5)))
# shear moduli over Huber's: each scheme of steps, and none
FILMS = {
    "huber": NASA,
    "nearly": NASA | {"G12": 0.9 * HUBER},
    "soft": NASA | {"G12": 0.3 * HUBER, "angle": 0.3},
    "stiff": NASA | {"G12": 3 * HUBER},
    "fabric": {"E1": 1.2e9, "E2": 0.7e9, "nu12": 0.25, "G12": 2e7, "thickness": 1e-3, "angle": -0.7},
}


def modulus(film):
    """Stiffness on (11, 22, 2 12) in material axes [N/m]."""
    c = film.thickness / (1 - film.nu12 * film.nu21)
    G = film.shear_ratio * film.E / (2 * (1 + film.nu))
    return np.array(
        [
            [c * film.E1, c * film.nu21 * film.E1, 0],
            [c * film.nu12 * film.E2, c * film.E2, 0],
            [0, 0, G * film.thickness],
        ]
    )


def plain_stress(film, E):
    """Of strains (n, 2, 2) in the frame, by the modulus matrix and a turn of axes."""
    c, s = math.cos(film.angle), math.sin(film.angle)
    Q = np.array([[c, s], [-s, c]])
    e = Q @ E @ Q.T
    S11, S22, S12 = modulus(film) @ np.stack([e[:, 0, 0], e[:, 1, 1], 2 * e[:, 0, 1]])
    S = np.stack([np.stack([S11, S12], -1), np.stack([S12, S22], -1)], -1)
    return Q.T @ S @ Q


def best_pull(film, E):
    """The largest <e(x)>^2/(2 S(x)) over directions x, and the stress there, by search (n,), (n, 2, 2)."""
    D = np.linalg.inv(modulus(film))

    def along(x):
        d = np.stack([np.cos(x), np.sin(x)], -1)
        a = x - film.angle
        v = np.stack([np.cos(a) ** 2, np.sin(a) ** 2, np.cos(a) * np.sin(a)], -1)
        S = np.einsum("...i,ij,...j->...", v, D, v)
        return np.maximum(np.einsum("...i,...ij,...j->...", d, E, d), 0), S, d

    grid = np.linspace(0, math.pi, 721)[:, None] + np.zeros(len(E))
    e, S, _ = along(grid)
    x = grid[np.argmax(e**2 / S, axis=0), 0]
    width = math.pi / 720
    for _ in range(60):  # thirds
        low, high = x - width / 3, x + width / 3
        (a, s, _), (b, t, _) = along(low), along(high)
        x = np.where(a**2 / s > b**2 / t, low, high)
        width *= 0.7
    e, S, d = along(x)
    return e**2 / (2 * S), (e / S)[:, None, None] * d[:, :, None] * d[:, None, :]


def random_strains(count):
    """Of all states and sizes, (n, 2, 2)."""
    rng = np.random.default_rng(7)
    size = 10 ** rng.uniform(-7, -1, count)
    angle = rng.uniform(0, math.pi, count)
    # even in the angle whose tangent is minor over major strain
    ratio = rng.uniform(-0.75 * math.pi, 0.25 * math.pi, count)
    major, minor = size * np.cos(ratio), size * np.sin(ratio)
    c, s = np.cos(angle), np.sin(angle)
    Q = np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], -2)
    zero = 0 * major
    return Q @ np.stack([np.stack([major, zero], -1), np.stack([zero, minor], -1)], -2) @ Q.transpose(0, 2, 1)


def evaluated(law, E, d=None):
    """Energies (n,), stresses (n, 2, 2) of strains (n, 2, 2), and the stresses' derivatives along `d`.

    Compiled, on each rank for itself.
    """
    mesh = create_unit_interval(MPI.COMM_SELF, len(E))
    tensor = fem.functionspace(mesh, basix.ufl.element("DG", mesh.basix_cell(), 0, shape=(2, 2)))
    strain, along = fem.Function(tensor), fem.Function(tensor)
    strain.x.array[:] = np.asarray(E).reshape(-1)
    along.x.array[:] = 0 if d is None else np.asarray(d).reshape(-1)

    def number(value):
        return fem.Constant(mesh, float(value))

    S = law.stress(strain, number)
    parts = [law.energy(strain, number), S[0, 0], S[1, 1], S[0, 1]]
    if d is not None:
        parts += [ufl.derivative(part, strain, along) for part in parts[1:]]
    found = fem.Function(
        fem.functionspace(mesh, basix.ufl.element("DG", mesh.basix_cell(), 0, shape=(len(parts),)))
    )
    points = dolfinx_compat.interpolation_points(found.function_space.element)
    found.interpolate(fem.Expression(ufl.as_vector(parts), points))
    values = found.x.array.reshape(len(E), -1)

    def tensors(columns):
        return columns[:, [0, 2, 2, 1]].reshape(-1, 2, 2)

    return values[:, 0], tensors(values[:, 1:4]), tensors(values[:, 4:7]) if d is not None else None


def random_directions(E):
    """Symmetric, of the size of the strains."""
    d = np.random.default_rng(3).uniform(-1, 1, E.shape) * np.abs(E).max(axis=(1, 2))[:, None, None]
    return (d + d.swapaxes(1, 2)) / 2


def states(film, E):
    """Taut, wrinkled or slack (0, 1, 2), and how far from the border to the next, over the strain."""
    minor = np.linalg.eigvalsh(plain_stress(film, E))[:, 0] / (film.Et)
    major = np.linalg.eigvalsh(E)[:, 1]
    size = np.abs(E).max(axis=(1, 2))
    return np.where(minor >= 0, 0, np.where(major > 0, 1, 2)), np.minimum(np.abs(minor), np.abs(major)) / size


@pytest.mark.parametrize("name", FILMS)
def test_the_relaxed_energy_is_the_best_of_all_directions(name):
    film = OrthotropicTensionField(**FILMS[name], slack_stiffness=0)
    E = random_strains(1000)
    energy, stress, _ = evaluated(film, E)
    state, _ = states(film, E)
    assert np.all(np.bincount(state, minlength=3) > 50)
    scale = film.thickness * max(film.E1, film.E2) * np.abs(E).max(axis=(1, 2))
    plain = plain_stress(film, E)
    pulled, along = best_pull(film, E)
    expected = np.select([state == 0, state == 1], [(plain * E).sum(axis=(1, 2)) / 2, pulled], 0)
    size = np.abs(E).max(axis=(1, 2))
    np.testing.assert_allclose(energy / (scale * size), expected / (scale * size), rtol=0, atol=1e-13)
    expected = np.where((state == 0)[:, None, None], plain, along * (state == 1)[:, None, None])
    # thirds find a direction to the root of round-off only
    np.testing.assert_allclose(stress / scale[:, None, None], expected / scale[:, None, None], atol=1e-7)


@pytest.mark.parametrize("name", FILMS)
def test_never_above_the_plain_energy_and_never_compressed(name):
    film = OrthotropicTensionField(**FILMS[name], slack_stiffness=0)
    E = random_strains(10_000)
    relaxed, stress, _ = evaluated(film, E)
    plain, _, _ = evaluated(Orthotropic(**FILMS[name]), E)
    assert np.all(relaxed >= 0)
    assert np.all(relaxed <= plain * (1 + 1e-13))
    least = np.linalg.eigvalsh(stress)[:, 0]
    assert np.all(least >= -1e-14 * film.thickness * max(film.E1, film.E2) * np.abs(E).max(axis=(1, 2)))
    state, _ = states(film, E)
    slack = state == 2
    assert np.all(relaxed[slack] == 0)
    assert np.all(stress[slack] == 0)


@pytest.mark.parametrize("name", FILMS)
def test_taylor_of_the_law_in_taut_wrinkled_and_slack_film(name):
    """Energy, stress and tangent belong together, whatever the stress leaves out of the energy's gradient."""
    film = OrthotropicTensionField(**FILMS[name], slack_stiffness=1e-3)
    E = random_strains(4000)
    state, clear = states(film, E)
    E, state = E[clear > 0.1], state[clear > 0.1]
    size = np.abs(E).max(axis=(1, 2))
    stiff = film.thickness * max(film.E1, film.E2)
    d = 0.02 * random_directions(E)
    w, S, Cd = evaluated(film, E, d)
    other = random_directions(E)[::-1] / np.abs(E).max(axis=(1, 2))[::-1, None, None]
    Co = evaluated(film, E, other)[2]
    asymmetry = ((Co * d).sum(axis=(1, 2)) - (Cd * other).sum(axis=(1, 2))) / size
    assert np.abs(asymmetry).max() < 1e-12 * stiff
    slope = (S * d).sum(axis=(1, 2))
    curvature = (Cd * d).sum(axis=(1, 2))
    steps = [1.0, 0.5, 0.25]
    moved = [evaluated(film, E + h * d) for h in steps]
    rest = [(m[0] - w - h * slope - h**2 / 2 * curvature) for h, m in zip(steps, moved, strict=True)]
    stress_rest = [np.abs(m[1] - S - h * Cd).max(axis=(1, 2)) for h, m in zip(steps, moved, strict=True)]
    for of_state in (0, 1, 2):
        one = state == of_state
        energies = np.array([np.abs(r / (stiff * size**2))[one].mean() for r in rest])
        stresses = np.array([(r / (stiff * size))[one].mean() for r in stress_rest])
        if of_state == 1:
            np.testing.assert_allclose(np.log2(energies[:-1] / energies[1:]), 3, atol=0.2)
            np.testing.assert_allclose(np.log2(stresses[:-1] / stresses[1:]), 2, atol=0.2)
        else:  # quadratic
            assert energies.max() < 1e-14
            assert stresses.max() < 1e-14


@pytest.mark.parametrize("given", [None, 3.5e9 / 2.6])
@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_equal_moduli_make_it_isotropic(given, angle):
    E = random_strains(1000)
    E = E[np.abs(np.linalg.eigvalsh(E) @ [1, 0.3]) > 1e-6 * np.abs(E).max(axis=(1, 2))]  # off the border
    size, d = np.abs(E).max(axis=(1, 2)), random_directions(E)
    for share in (0.0, 1e-4, None):
        if share is None:
            pair = Orthotropic(G12=given, angle=angle), Isotropic()
        else:
            pair = (
                OrthotropicTensionField(G12=given, angle=angle, slack_stiffness=share),
                TensionField(slack_stiffness=share),
            )
        (w, S, C), (v, T, D) = (evaluated(law, E, d) for law in pair)
        np.testing.assert_allclose(w / size**2, v / size**2, rtol=0, atol=1e-12 * ET)
        for found, expected in ((S, T), (C, D)):
            error = (found - expected) / size[:, None, None]
            assert np.abs(error).max() < 1e-12 * ET


@pytest.mark.parametrize("name", FILMS)
def test_unstrained_and_evenly_strained_film_has_no_singular_root(name):
    film = OrthotropicTensionField(**FILMS[name])
    strains = np.array([np.zeros((2, 2)), 1e-3 * np.eye(2), -1e-3 * np.eye(2)])
    d = 1e-3 * np.array([[1.0, 0.4], [0.4, -0.3]]) + np.zeros((3, 1, 1))
    w, S, C = evaluated(film, strains, d)
    w0, S0, C0 = evaluated(Orthotropic(**FILMS[name]), strains, d)
    share = np.array([1, 1, film.slack_stiffness])
    np.testing.assert_allclose(w, share * w0, rtol=1e-12)
    np.testing.assert_allclose(S, share[:, None, None] * S0, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(C, share[:, None, None] * C0, rtol=1e-12, atol=1e-12)


def test_plain_stress_and_tangent():
    for parameters in FILMS.values():
        film, E = Orthotropic(**parameters), random_strains(20)
        _, S, C = evaluated(film, E, E)
        scale = 1e-12 * film.Et * np.abs(E).max(axis=(1, 2))[:, None, None]
        assert np.all(np.abs(S - plain_stress(film, E)) < scale)
        assert np.all(np.abs(C - S) < scale)


@pytest.mark.parametrize("kind", [Orthotropic, OrthotropicTensionField])
@pytest.mark.parametrize("name", FILMS)
def test_prestrain_carries_the_meridional_resultant_alone(kind, name):
    film, N = kind(**FILMS[name]), 1234.5
    E0 = film.prestrain(N)
    E0 = np.array([[float(E0[i, j](())) for j in range(2)] for i in range(2)])
    np.testing.assert_allclose(evaluated(film, E0[None])[1][0], [[N, 0], [0, 0]], rtol=1e-12, atol=1e-8)
    slack = film.prestrain(N, hoop_slack=2e-3)[1, 1]
    assert float(slack(())) == pytest.approx(E0[1, 1] - 2e-3, rel=1e-12)


@pytest.mark.parametrize("name", FILMS)
def test_regions(name):
    film = OrthotropicTensionField(**FILMS[name])
    E = random_strains(200)
    state, clear = states(film, E)
    for e, one in zip(E[clear > 1e-3], state[clear > 1e-3], strict=True):
        found = [float(part(())) for part in film.regions(ufl.as_matrix(e.tolist()))]
        assert found == [float(k == one) for k in range(3)]


def test_bad_numbers_are_refused_in_one_sentence():
    for kind in (Orthotropic, OrthotropicTensionField):
        for name in ("E1", "E2", "G12"):
            with pytest.raises(InputError, match=rf"^film {name} is .*; give a positive number \[Pa\]$"):
                kind(**{name: -1.0})
        with pytest.raises(InputError, match=r"^film nu12 = 0.9 gives nu21 = nu12 E2/E1 = 1.8"):
            kind(E1=1e9, E2=2e9, nu12=0.9)
        with pytest.raises(InputError, match=r"^film thickness is"):
            kind(thickness=0.0)
        with pytest.raises(InputError, match=r"^the angle of the film's first axis is nan"):
            kind(angle=math.nan)
        assert kind(**NASA).nu21 == pytest.approx(0.673, abs=5e-4)
    with pytest.raises(InputError, match=r"^film G12 = 1000 Pa is .*; give 0.05 to 8 times$"):
        OrthotropicTensionField(G12=1e3)
    with pytest.raises(InputError, match=r"^slack_stiffness = 1"):
        OrthotropicTensionField(slack_stiffness=1.0)


def test_balloon_of_orthotropic_film_compiles_in_seconds_and_passes_taylor(comm):
    """E(q + h d) = E + h r.d + h^2/2 d.K d + O(h^3) for a whole balloon in all three states."""
    film = OrthotropicTensionField(**FILMS["nearly"], slack_stiffness=1e-3)
    balloon = Balloon(lobed_cylinder(1, (4, 6), comm=comm), film, [Fixed("rim_bottom"), Fixed("rim_top")])
    began = time.process_time()
    _ = balloon.forms.elastic, balloon.forms.residual, balloon.forms.tangent
    assert time.process_time() - began < 30
    balloon.set_loads(20.0)
    q = unknowns(balloon, 0.05 * wavy(nodes(balloon), 1))
    d = unknowns(balloon, wavy(nodes(balloon), 2))
    r, Kd = q.duplicate(), q.duplicate()
    balloon.residual(q, r)
    K = balloon.tangent(q)
    assert petsc.asymmetry(K) < 1e-13
    K.mult(d, Kd)
    energy, slope, curvature = balloon.energy(q)[0], r.dot(d), Kd.dot(d)

    def second(h):
        moved = q.copy()
        moved.axpy(h, d)
        return balloon.energy(moved)[0] - energy - h * slope

    steps = [2e-4, 1e-4, 5e-5]
    np.testing.assert_allclose(taylor_rates(second, steps), 2, atol=0.1)
    np.testing.assert_allclose(taylor_rates(lambda h: second(h) - h**2 / 2 * curvature, steps), 3, atol=0.3)
    assert len(set(np.concatenate(comm.allgather(_states(balloon, q))))) == 3


def _states(balloon, q):
    """State (0, 1, 2) of each of this rank's cells."""
    balloon.set_unknowns(q)
    cells = fem.functionspace(balloon.mesh, ("DG", 0, (2, 2)))
    strain = fem.Function(cells)
    points = dolfinx_compat.interpolation_points(cells.element)
    strain.interpolate(fem.Expression(ufl.as_tensor(balloon.forms.strain), points))
    return states(balloon.film, strain.x.array.reshape(-1, 2, 2))[0]
