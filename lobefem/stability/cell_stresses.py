"""Stress of each cell of one gore, and a smooth measure of the largest of all, with derivatives."""

from __future__ import annotations

from typing import Any

import numpy as np

from lobefem.fem.balloon import Balloon
from lobefem.fem.functionals import true_resultants
from lobefem.linalg import dolfinx_compat
from lobefem.typing import Array

import ufl
from dolfinx import fem

__all__ = ["cell_areas", "cell_stresses", "power_norm", "stress_norm"]


def _major(tensors: Array) -> tuple[Array, Array]:
    """Major principal values (n,) of symmetric tensors (xx, yy, xy) (n, 3), and their derivatives (n, 3)."""
    xx, yy, xy = tensors.T
    half = (xx - yy) / 2
    radius = np.hypot(half, xy)
    safe = np.where(radius > 0, radius, 1.0)
    slope = half / (2 * safe)
    return (xx + yy) / 2 + radius, np.stack([0.5 + slope, 0.5 - slope, xy / safe], axis=1)


def cell_stresses(balloon: Balloon) -> tuple[Array, Array]:
    """Largest principal true stress of each cell (cells,) [Pa]; its derivatives by the resultants [1/m]."""
    major: Any
    slopes: Any
    major, slopes = _major(true_resultants(balloon).x.array.reshape(-1, 3))
    return major / balloon.film.thickness, slopes / balloon.film.thickness


def cell_areas(balloon: Balloon) -> Array:
    """Drawn area of each cell (cells,) [m^2]."""
    W = fem.functionspace(balloon.mesh, ("DG", 0))
    return np.asarray(fem.assemble_vector(dolfinx_compat.form(ufl.TestFunction(W) * balloon.dx)).array)


def power_norm(stresses: Array, power: float) -> tuple[float, Array]:
    """The power norm of half of all stresses, those of the gore's one half, and its derivative by them."""
    largest = stresses.max()
    ratios = np.maximum(stresses / largest, 0.0)
    total = (ratios**power).sum() / 2
    norm = total ** (1 / power)
    return float(largest * norm), ratios ** (power - 1) * norm ** (1 - power) / 2


def stress_norm(balloon: Balloon, power: float = 40.0) -> float:
    """The value of `Adjoint.stress_norm` in the present displacement of a balloon of one gore [Pa]."""
    return power_norm(cell_stresses(balloon)[0], power)[0]
