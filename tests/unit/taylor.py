"""What Taylor tests of energies, residuals and tangents share: a state, a direction, derivatives."""

import numpy as np
import pytest
from states import cell_strains, kink_distance, nodes, unknowns, wavy

from lobefem.model.tension_field import TensionField

from mpi4py import MPI

PRESSURE = 2e4
STEPS = 0.5 ** np.arange(4)


def state_and_direction(balloon):
    """A state far from rest, and a direction along which no cell changes its state.

    The film sees strains of some per cent, taut, wrinkled and slack, the plates turn by some
    hundredths of a radian. Of several states the one is taken whose cells are farthest from a change.
    """
    balloon.set_loads(PRESSURE, PRESSURE / 2 if balloon.prestressed else 0.0)
    kinked = isinstance(balloon.film, TensionField)
    strains, best = cell_strains(balloon), (-1.0, None, None)
    for seed in range(10, 34 if kinked else 11):
        q, d = _random_state(balloon, seed)
        here = strains(q)
        there = q.copy()
        there.axpy(1e-5, d)
        rate = np.abs(strains(there) - here).max(axis=1) / 1e-5
        limit = 2e-3 / rate.max(initial=1e-300)
        if kinked:
            minor, major = here.T
            taut = minor + balloon.film.nu * major >= 0
            slack = major <= 0
            counts = balloon.comm.allreduce(np.array([f.sum() for f in (taut, slack, ~taut & ~slack)]))
            if np.any(counts < 5):
                continue
            distance = kink_distance(here, balloon.film.nu)
            limit = min(limit, (0.5 * distance / rate).min(initial=np.inf))
        limit = balloon.comm.allreduce(limit, op=MPI.MIN)
        if limit > best[0]:
            best = (limit, q, d)
    limit, q, d = best
    assert limit > 0
    d.scale(limit)
    return q, d


def _random_state(balloon, seed):
    x, rng = nodes(balloon), np.random.default_rng(seed)
    n = balloon.map.num_parameters
    q = unknowns(balloon, 0.03 * wavy(x, seed, 2.0), rng.uniform(-0.03, 0.03, n))
    return q, unknowns(balloon, wavy(x, -seed % 1000), rng.uniform(-1, 1, n))


def moved(q, h, d):
    new = q.copy()
    new.axpy(h, d)
    return new


def gradient_and_curvature(balloon, q, d):
    r = q.duplicate()
    balloon.residual(q, r)
    Kd = q.duplicate()
    balloon.tangent(q).mult(d, Kd)
    return r, Kd


def assert_derivatives(balloon, q, d, h, energy=1e-6, residual=1e-6):
    """Residual and tangent along d are central differences of energy and residual, to relative tolerances."""
    r, Kd = gradient_and_curvature(balloon, q, d)
    plus, minus = (balloon.energy(moved(q, sign * h, d))[0] for sign in (1, -1))
    assert (plus - minus) / (2 * h) == pytest.approx(r.dot(d), rel=energy)
    change, lower = q.duplicate(), q.duplicate()
    balloon.residual(moved(q, h, d), change)
    balloon.residual(moved(q, -h, d), lower)
    change.axpy(-1, lower)
    change.scale(1 / (2 * h))
    change.axpy(-1, Kd)
    assert change.norm() < residual * Kd.norm()
