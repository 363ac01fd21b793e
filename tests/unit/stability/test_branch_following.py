"""Branches by likeness: crossings, avoided crossings, pairs turned at will, ends of the window."""

import numpy as np
import pytest
from states import nodes, wavy

from lobefem import EndPlates, FixedWrinkles, Hoops, find_modes, ideal_state, lobed_cylinder
from lobefem.equilibrium.state import Equilibrium
from lobefem.fem.balloon import Balloon
from lobefem.stability.branch_following import follow, unclear
from lobefem.stability.mode_records import Mode, Modes


@pytest.fixture(scope="module")
def balloon():
    surface = lobed_cylinder(1, layout="unstructured", size=1.5)
    return Balloon(surface, FixedWrinkles(), [EndPlates()], prestressed=True)


class Scene:
    """Made-up modes on a real mesh, from a set of fields that its mass finds orthonormal."""

    def __init__(self, balloon, count=6):
        self.state = ideal_state(balloon, 1.0)
        M = balloon.mass_matrix()
        fields = [wavy(nodes(balloon), seed) for seed in range(count)]
        owned = balloon.V.dofmap.index_map.size_local
        gram = np.empty((count, count))
        for j, b in enumerate(fields):
            x, y = M.createVecs()
            x.array[:] = b[:owned].ravel()
            M.mult(x, y)
            gram[:, j] = [balloon.comm.allreduce(float(a[:owned].ravel() @ y.array_r)) for a in fields]
        self.fields = np.einsum("ij,jnk->ink", np.linalg.inv(np.linalg.cholesky(gram)), fields)

    def modes(self, pressure, rows):
        """Modes at a pressure from (value, combination of the fields), in the order of find_modes."""
        state = Equilibrium(**(vars(self.state) | {"pressure": pressure}))
        made = []
        for value, combination in sorted(rows, key=lambda r: (complex(r[0]).real, -complex(r[0]).imag)):
            c = np.zeros(len(self.fields), dtype=complex)
            c[: len(combination)] = combination
            # modes have any length and sign
            phi = -3.0 * np.einsum("i,ink->nk", c, self.fields)
            parts = (phi.real.copy(), phi.imag.copy())
            made.append(Mode(complex(value), 0.0, 0, (0,), "global", *parts, state.nodes()))
        return Modes(state, "unit", True, 0.0, 0, tuple(made))


@pytest.fixture(scope="module")
def scene(balloon):
    return Scene(balloon)


def values(branches):
    """(first pressure, values) of each branch."""
    return sorted((b.pressures[0], b.values.tolist()) for b in branches)


def test_curves_cross_where_the_order_swaps(scene):
    """One rises, one falls, one stays: by order there would be no crossing at all."""
    sweep = [scene.modes(p, [(p, [1]), (10 - p, [0, 1]), (5.3, [0, 0, 1])]) for p in (1.0, 3.0, 6.0, 9.0)]
    found = follow(sweep[::-1])  # in any order
    assert values(found) == [(1, [1, 3, 6, 9]), (1, [5.3] * 4), (1, [9, 7, 4, 1])]
    assert min(b.mac for b in found) == pytest.approx(1.0)
    (falling,) = (b for b in found if b.values[0] == 9)
    assert falling.members == ((2,), (2,), (0,), (0,))


def test_a_crossing_met_exactly_keeps_its_curves_apart(scene):
    """At p = 5 both are one space, in which any two vectors will do."""
    c, s = np.cos(1.1), np.sin(1.1)
    sweep = [scene.modes(p, [(p, [1]), (10 - p, [0, 1])]) for p in (4.0, 6.0)]
    sweep.append(scene.modes(5.0, [(5, [c, s]), (5, [-s, c])]))
    assert values(follow(sweep)) == [(4, [4, 5, 6]), (4, [6, 5, 4])]


def test_pairs_go_on_as_one_however_their_vectors_are_turned(scene):
    rng = np.random.default_rng(3)

    def pair(p):
        a, b = rng.uniform(0, 2 * np.pi, 2)
        turned = [(np.cos(a), np.sin(a)), (-np.sin(a), np.cos(a))]
        other = [(0, 0, np.cos(b), np.sin(b)), (0, 0, -np.sin(b), np.cos(b))]
        rows = [(p, c) for c in turned] + [(9 - p, c) for c in other]
        return scene.modes(p, [*rows, (5.2, [0, 0, 0, 0, 1])])

    found = follow([pair(p) for p in (1.0, 3.0, 5.0, 7.0)])
    assert values(found) == [(1, [1, 3, 5, 7]), (1, [5.2] * 4), (1, [8, 6, 4, 2])]
    assert [len(b.members[0]) for b in sorted(found, key=lambda b: b.values[0])] == [2, 1, 2]


def test_vectors_of_a_pair_need_not_be_orthogonal(scene):
    sweep = [
        scene.modes(1.0, [(1, [1, 0]), (1, [1, 0.1]), (3, [0, 0, 1])]),
        scene.modes(2.0, [(4, [1, 1]), (4, [1, 1.2]), (3, [0, 0, 1])]),
    ]
    assert values(follow(sweep)) == [(1, [1, 4]), (1, [3, 3])]


def test_complex_pairs_and_their_split_into_real_ones(scene):
    """A pair of any phase goes on; where it turns real it goes on as two curves."""

    def turning(p, value, phase):
        phi = np.exp(1j * phase) * np.array([1, 1j])
        return scene.modes(p, [(value, phi), (np.conj(value), phi.conj()), (3.0, [0, 0, 1])])

    sweep = [turning(1.0, 2 + 0.1j, 0.0), turning(2.0, 4 + 0.1j, 1.0)]
    assert values(follow(sweep)) == [(1, [2, 4]), (1, [3, 3])]
    split = scene.modes(3.0, [(5.0, [1, 0.2]), (7.0, [-0.2, 1]), (3.0, [0, 0, 1])])
    assert values(follow([*sweep, split])) == [(1, [2, 4, 5]), (1, [2, 4, 7]), (1, [3, 3, 3])]


def avoiding(scene, p, coupling):
    """Two values p and -p that a coupling keeps apart: +-sqrt(p^2 + c^2)."""
    found, vectors = np.linalg.eigh([[p, coupling], [coupling, -p]])
    return scene.modes(p + 10, [(found[0] + 10, vectors[:, 0]), (found[1] + 10, vectors[:, 1])])


def test_an_avoided_crossing_bends_in_small_steps_and_is_crossed_in_large_ones(scene):
    fine = [avoiding(scene, p, 1.0) for p in np.linspace(-5, 5, 21)]
    for branch in follow(fine):
        assert (branch.values > 10).all() or (branch.values < 10).all()
        assert branch.mac > 0.6
    coarse = [avoiding(scene, p, 1e-3) for p in (-2.0, -1.0, 1.0, 2.0)]
    for branch in follow(coarse):
        assert np.allclose(np.abs(np.diff(branch.values)), [1, 2, 1], atol=1e-5)


def test_a_step_is_unclear_where_modes_mix(scene):
    assert unclear(avoiding(scene, -2.0, 1.0), avoiding(scene, 0.5, 1.0))
    assert not unclear(avoiding(scene, -2.0, 1e-3), avoiding(scene, 2.0, 1e-3))
    # that a mode leaves the window is no reason for a smaller step
    gone = scene.modes(2.0, [(1, [1]), (2, [0, 0, 1])])
    assert not unclear(scene.modes(1.0, [(1, [1]), (2, [0, 1])]), gone)


def test_branches_begin_and_end_with_the_window(scene):
    sweep = [
        scene.modes(1.0, [(1, [1]), (2, [0, 1])]),
        scene.modes(2.0, [(1, [1]), (1.5, [0, 0, 1])]),
        scene.modes(3.0, [(1, [1]), (0.5, [0, 0, 1])]),
    ]
    assert values(follow(sweep)) == [(1, [1, 1, 1]), (1, [2]), (2, [1.5, 0.5])]
    # the second of a pair is cut off by the number of modes: no curve of its own
    sweep = [
        scene.modes(1.0, [(1, [0, 0, 1]), (2, [1]), (2, [0, 1])]),
        scene.modes(2.0, [(2, [0, 0, 1]), (3, [0.6, 0.8])]),
    ]
    assert values(follow(sweep)) == [(1, [1, 2]), (1, [2, 3])]


def test_real_curves_are_those_of_the_harmonics():
    """Local modes fall through the global ones: each branch keeps its harmonic and its kind."""
    balloon = Balloon(
        lobed_cylinder(2, divisions=(4, 10)), FixedWrinkles(), [Hoops(), EndPlates()], prestressed=True
    )
    sweep = [find_modes(ideal_state(balloon, p), 12) for p in (1000.0, 8000.0, 25000.0)]
    found = follow(sweep)
    swapped = 0
    for branch in found:
        members = [[m[i] for i in at] for m, at in zip(sweep, branch.members, strict=False)]
        if len(branch.pressures) == 3:
            assert {m.harmonic for at in members for m in at} == {branch.harmonic}
            swapped += len({at[0] for at in branch.members}) > 1
    assert swapped
    whole = {(b.kind, b.harmonic, b.rank): b for b in found}
    assert (np.diff(whole["sway", 1, 0].values) > 0).all()
    assert (np.diff(whole["twist", 0, 0].values) > 0).all()
