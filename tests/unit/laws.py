"""Film laws at the strain of a point: UFL's derivatives, and the closed forms to compare with."""

import math
from functools import cache

import numpy as np

import basix.ufl
import ufl
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives

ET, NU = 3.5e9 * 5e-5, 0.3
STATES = ("taut", "wrinkled", "slack")


@cache
def derivatives(law):
    """The strain as a UFL symbol, and the scalar expressions of energy, stress and tangent.

    An energy's gradient is the stress; a law written as a stress gives its own, and maybe no energy.
    """
    triangle = basix.ufl.element("Lagrange", "triangle", 1, shape=(2,))
    constant = basix.ufl.element("DG", "triangle", 0, shape=(2, 2))
    symbol = ufl.Coefficient(ufl.FunctionSpace(ufl.Mesh(triangle), constant))
    E = ufl.variable(symbol)
    w = law.energy(E)
    S = law.stress(E) if law.by_stress else ufl.diff(w, E)
    C = ufl.diff(S, E)
    parts = [ufl.zero() if w is None else w]
    parts += [S[i] for i in np.ndindex(2, 2)]
    parts += [C[i] for i in np.ndindex(2, 2, 2, 2)]
    return symbol, parts


@cache
def evaluated(law, part):
    """One of the expressions of `derivatives`, ready for numbers."""
    return apply_derivatives(apply_algebra_lowering(derivatives(law)[1][part]))


def values(law, strain, parts):
    """Numbers of some of the expressions of `derivatives`."""
    at_point = {derivatives(law)[0]: tuple(map(tuple, np.asarray(strain, dtype=float).tolist()))}
    return np.array([float(evaluated(law, part)((), at_point)) for part in parts])


def stress(law, strain):
    """Resultant (2, 2), symmetrised, of UFL's own derivatives."""
    s = values(law, strain, range(1, 5)).reshape(2, 2)
    return (s + s.T) / 2


def at(law, strain):
    """Energy, resultant (2, 2) and tangent (2, 2, 2, 2), symmetrised, by UFL's own derivatives."""
    c = values(law, strain, range(5, 21)).reshape(2, 2, 2, 2)
    c = (c + c.transpose(1, 0, 2, 3)) / 2
    c = (c + c.transpose(0, 1, 3, 2)) / 2
    return values(law, strain, [0])[0], stress(law, strain), c


def turn(tensor, angle):
    """Components in axes turned by `angle` (of a tensor of any order)."""
    c, s = math.cos(angle), math.sin(angle)
    Q = np.array([[c, -s], [s, c]])
    for axis in range(tensor.ndim):
        tensor = np.moveaxis(np.tensordot(Q, tensor, axes=(1, axis)), 0, axis)
    return tensor


def plane_stress(strain):
    """Eq. 10's D_t on (11, 22, gamma)."""
    D = ET / (1 - NU**2) * np.array([[1, NU, 0], [NU, 1, 0], [0, 0, (1 - NU) / 2]])
    s = D @ [strain[0, 0], strain[1, 1], 2 * strain[0, 1]]
    return np.array([[s[0], s[2]], [s[2], s[1]]])


def wrinkled_stress(strain):
    """Eq. 11's secant D_w on (11, 22, gamma), P and Q the direction of the major strain."""
    e1, e2 = np.linalg.eigvalsh(strain)[::-1]
    P, Q = (strain[0, 0] - strain[1, 1]) / (e1 - e2), 2 * strain[0, 1] / (e1 - e2)
    D = ET / 4 * np.array([[2 * (1 + P), 0, Q], [0, 2 * (1 - P), Q], [Q, Q, 1]])
    s = D @ [strain[0, 0], strain[1, 1], 2 * strain[0, 1]]
    return np.array([[s[0], s[2]], [s[2], s[1]]])


def three_way(strain):
    """The paper's test: taut by the minor stress, slack by the major strain, else wrinkled."""
    e1 = np.linalg.eigvalsh(strain)[1]
    if np.linalg.eigvalsh(plane_stress(strain))[0] >= 0:
        return "taut"
    return "slack" if e1 <= 0 else "wrinkled"


def strains(state, count=6):
    """Random strains of one state, its principal values clear of the others' borders."""
    rng = np.random.default_rng(STATES.index(state))
    for _ in range(count):
        scale, angle = 10 ** rng.uniform(-7, -1), rng.uniform(0, math.pi)
        ratio = {
            "taut": rng.uniform(-0.9 * NU, 0.999),
            "wrinkled": rng.uniform(-3, -1.1 * NU),
            "slack": rng.uniform(1.001, 5),
        }[state]
        major = -scale if state == "slack" else scale
        strain = turn(np.diag([major, ratio * major]), angle)
        assert three_way(strain) == state
        yield strain, angle
