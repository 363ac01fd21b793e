"""`trend`: the limit of a number under mesh refinement, with an error bar, from its values on some meshes.

Richardson extrapolation in the form that is usual for grid convergence (Roache, Verification and
Validation in Computational Science and Engineering, 1998; Eca and Hoekstra, J. Comput. Phys. 262, 2014):
v = limit + C h^q is fitted to the finest three meshes. The error bar is the whole way from the finest mesh
to the limit, with no higher order than the cells have, and three times that where the meshes do not yet
follow the law.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from lobefem.errors import InputError
from lobefem.typing import Array

__all__ = ["Trend", "trend"]

_ORDER = 2.0  # of eigenvalues and critical pressures on linear cells, and of smooth solutions

_LOWEST = 0.5  # observed order of meshes that follow the law; a kink of the shape leaves 1

_BEYOND = 0.5  # by which an observed order may exceed the highest one

_SAFETY = 3.0  # on the error bar where they do not

_NEAR = 0.25  # the finest value is this near its limit where it converges, relative

_FALLEN = 0.1  # a limit below this share of the finest value is none

_MISFIT = 0.02  # relative, of four meshes that follow one law

_STALLED = 0.3  # order below which a fall shows no limit


@dataclass(frozen=True)
class Trend:
    """The trend of a number under mesh refinement.

    Attributes:
        values: one a mesh, from coarse to fine.
        behaviour: "converges" (the finest mesh is within a quarter of the limit), "falls" (no limit is in
            sight: v = C h^q describes the meshes as well, with an order of 0.5 or more, or the limit is
            below a tenth of the finest mesh's value) or "open" (the meshes do not tell).
        limit: of v = limit + C h^q through the finest three meshes, or the finest value where they swing
            about it; 0 where it falls, nan where it is open.
        order: q of that fit, or of v = C h^q where it falls; nan where there is none.
        uncertainty: of a limit, by what a fit to the finest four gives; else nan.
        error: half the width of the error bar about the limit over its size; nan without a limit.
        asymptotic: True where the finest three meshes follow such a law with an order from 0.5 to half above
            the highest one.
    """

    values: tuple[float, ...]
    behaviour: str
    limit: float = math.nan
    order: float = math.nan
    uncertainty: float = math.nan
    error: float = math.nan
    asymptotic: bool = False


def trend(
    h: Sequence[float], values: Sequence[float], *, signed: bool = False, highest: float = _ORDER
) -> Trend:
    """Fit v = limit + C h^q to the values on the finest meshes, and judge the fit.

    Args:
        h: mesh sizes in any unit, from coarse to fine; their ratio need not be constant.
        values: one for each, inf where there is none. Fewer than three leave it open.
        signed: True for what may be negative, an eigenvalue for example; else a value of 0 is a fall.
        highest: order that the cells can show; 4 for the eigenvalues of quadratic ones.

    Raises:
        InputError: sizes that do not fall from mesh to mesh.
    """
    all_values = tuple(float(v) for v in values)
    if any(not 0 < b < a for a, b in pairwise(h)):
        raise InputError(f"the mesh sizes {list(h)} do not fall; give meshes from coarse to fine")
    if all_values and all_values[-1] == 0 and not signed:
        return Trend(all_values, "falls", 0.0)
    known = [
        (size, v) for size, v in zip(h, all_values, strict=True) if math.isfinite(v) and (signed or v > 0)
    ]
    if len(known) < 3:
        return Trend(all_values, "open")
    sizes, v = (np.array(column[-4:]) for column in zip(*known, strict=True))
    wide_limit, _, misfit = _fit(sizes, v)
    limit, order, _ = _fit(sizes[-3:], v[-3:])
    before, last = np.diff(v[-3:])
    if before * last <= 0 and _SAFETY * max(abs(before), abs(last)) <= _NEAR * abs(v[-1]):
        # it swings about its limit, or does not move at all
        swing = _SAFETY * max(abs(before), abs(last)) / abs(v[-1])
        return Trend(all_values, "converges", float(v[-1]), error=swing)
    if misfit < _MISFIT and abs(v[-1] - limit) <= _NEAR * abs(limit):
        uncertainty = abs(limit - wide_limit) if len(v) > 3 else math.nan
        asymptotic = before * last > 0 and _LOWEST <= order <= highest + _BEYOND
        away = abs(last) / ((sizes[-2] / sizes[-1]) ** min(order, highest) - 1)
        error = max(away, abs(v[-1] - limit)) * (1.0 if asymptotic else _SAFETY)
        if len(v) > 3:
            error = max(error, uncertainty)
        return Trend(all_values, "converges", limit, order, uncertainty, error / abs(limit), asymptotic)
    if (np.diff(v) >= 0).any():
        return Trend(all_values, "open")
    if signed:
        return Trend(all_values, "falls" if order < _STALLED else "open")
    slope, strays = _power(sizes, v)
    if max(limit, wide_limit) < _FALLEN * v[-1] or (strays < _MISFIT and slope >= _LOWEST):
        return Trend(all_values, "falls", 0.0, slope)
    return Trend(all_values, "open")


def _power(h: Array, v: Array) -> tuple[float, float]:
    """Order of v = C h^q, which has no limit, by least squares, and the relative misfit."""
    x, y = np.log(h), np.log(v)
    slope, start = np.polyfit(x, y, 1)
    return float(slope), float(np.linalg.norm(y - start - slope * x))


def _fit(h: Array, v: Array) -> tuple[float, float, float]:
    """Limit and order of v = limit + C h^q by least squares, and the relative misfit."""
    h = h / h[0]
    weight = np.abs(v) + 1e-12 * np.abs(v).max() + np.finfo(float).tiny

    def linear(q: float) -> tuple[Array, float]:
        # each value counts by its own size: a fall runs over decades
        matrix = np.stack([np.ones_like(v), h**q], axis=1) / weight[:, None]
        coefficients: Any = np.linalg.lstsq(matrix, v / weight)[0]
        return coefficients, float(np.linalg.norm(matrix @ coefficients - v / weight))

    from scipy.optimize import minimize_scalar  # slow to import, and a study of meshes alone needs it

    found: Any = minimize_scalar(lambda q: linear(q)[1], bounds=(0.2, 12), method="bounded")
    coefficients, misfit = linear(float(found.x))
    return float(coefficients[0]), float(found.x), misfit
