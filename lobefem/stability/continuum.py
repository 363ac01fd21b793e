"""Critical pressures of one lobe without a mesh, to judge those of meshes by.

The second variation of the held ideal isotensoid with both rims held. Around the axis
u_m = U cos n theta, v = V sin n theta, w = W cos n theta; along the meridian U, V and W are polynomials
that vanish at the rims, so a few dozen unknowns give all digits. With the linear strains

    e_m = U' + k W,  e_h = (R' U + n V + z' W)/R,  g = V' - (n U + R' V)/R,  k = R/c

half the second variation per unit of pi is, over the area R ds,

    E t e_m^2 + c_h E t/(1 - nu^2) (e_h + nu e_m)^2 + c_g G t g^2
    + p [c/R |u_,s|^2 - u . (u_,s x h + m x u_,h)],

where c = R N_phi/p, R0^2/2 of an isotensoid, and c_h = c_g = 1 for isotropic film, 0 for fixed wrinkles, and
c_h = 0, c_g = 1 for tension-field film on the wrinkled side of its kink. Independent of the finite
elements: no mesh and no UFL, NumPy and SciPy only.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np
import scipy.linalg
from numpy.polynomial import legendre

from lobefem import checks
from lobefem.errors import InputError
from lobefem.geometry.isotensoid import Isotensoid
from lobefem.geometry.meridian import Lobe
from lobefem.model.film import Film, require_film
from lobefem.typing import Array

__all__ = ["continuum_pressure", "unstable_from"]


def continuum_pressure(harmonic: int, film: Film, shape: Lobe | None = None, *, degree: int = 20) -> float:
    """The critical pressure of one circumferential harmonic of one lobe, both rims held, without a mesh.

    Args:
        harmonic: n, 1 or more.
        film: its law; tension-field film is taken on the wrinkled side of its kink, on whose taut side
            it is isotropic.
        shape: the lobe, the paper's isotensoid by default.
        degree: number of polynomials for each displacement component.

    Returns:
        p [Pa]; 0 where the lobe is unstable at any pressure above zero, inf where no pressure up to a
        film strain of 1000 % makes it unstable.

    Raises:
        InputError: no film law or one without such shares, another shape, or an impossible harmonic.
    """
    n = checks.integer("the harmonic", harmonic, 1)
    shape = Isotensoid.from_edge_radius() if shape is None else shape
    if not isinstance(shape, Lobe):
        raise InputError(f"shape is {shape!r}; give an Isotensoid, a NaturalShape, or None for the paper's")
    _shares(film)
    return _critical(n, film, shape, checks.integer("the degree", degree, 2))


@lru_cache(maxsize=1024)  # studies of one shape and material ask for the same
def _critical(n: int, film: Film, shape: Lobe, degree: int) -> float:
    K_m, K_g = _pencil(n, film, shape, degree)

    def stable(p: float) -> bool:
        try:
            scipy.linalg.cholesky(K_m + p * K_g, check_finite=False)
        except scipy.linalg.LinAlgError:
            return False
        return True

    # p R0/2 = E t at the equator: a film strain of 100 %
    scale = 2 * film.Et / math.sqrt(2 * shape.meridional_tension)
    low, high = 1e-6 * scale, 10 * scale
    if not stable(low):
        return 0.0
    if stable(high):
        return math.inf
    while high > 1.1 * low:
        middle = math.sqrt(low * high)
        low, high = (middle, high) if stable(middle) else (low, middle)
    nu = scipy.linalg.eigh(K_g, K_m + low * K_g, eigvals_only=True, subset_by_index=[0, 0])
    return low - 1 / float(nu[0])


def unstable_from(film: Film, shape: Lobe | None = None, *, highest: int = 64) -> int | None:
    """The lowest harmonic that is unstable at any pressure above zero, None up to `highest`.

    Such a motion of one lobe leaves its rims at rest, so it is one of a stack of such lobes too.
    """
    if min(_shares(film)) > 0:
        return None  # no motion is without strain energy, which outweighs a small pressure
    return next((n for n in range(1, highest + 1) if continuum_pressure(n, film, shape) == 0.0), None)


def _shares(film: Film) -> tuple[float, float]:
    """c_h and c_g: which shares of the isotropic hoop and shear stiffness the film has."""
    require_film(film)
    if film.shares is None:
        raise InputError(
            f"{type(film).__name__} film tells no hoop and shear stiffness of its own (shares); give "
            "Isotropic, FixedWrinkles, TensionField or IMP film"
        )
    return film.shares


def _pencil(n: int, film: Film, shape: Lobe, degree: int) -> tuple[Array, Array]:
    """K_m and K_g in the coefficients of U, V and W."""
    x, weights = legendre.leggauss(2 * degree + 24)
    half = shape.arc_length / 2
    s = half * x
    R, (dR, dz) = shape.radius(s), shape.slope(s)
    area, curvature = weights * half * R, R / shape.meridional_tension

    bubble = np.array([2 / 3, 0, -2 / 3])  # 1 - x^2 in Legendre polynomials
    functions = [legendre.legmul(bubble, np.eye(degree)[j]) for j in range(degree)]
    f = np.stack([legendre.legval(x, c) for c in functions], axis=1)
    df = np.stack([legendre.legval(x, legendre.legder(c)) for c in functions], axis=1) / half
    size = np.linalg.norm(df, axis=0)
    f, df = f / size, df / size

    zero = np.zeros_like(f)
    U, V, W = (np.hstack([f if i == j else zero for i in range(3)]) for j in range(3))
    dU, dV, dW = (np.hstack([df if i == j else zero for i in range(3)]) for j in range(3))

    def times(a: Any, operator: Array) -> Array:
        return np.asarray(a)[:, None] * operator

    def product(a: Array, b: Array) -> Array:
        return a.T @ times(area, b)

    e_m = dU + times(curvature, W)
    e_h = times(dR / R, U) + times(n / R, V) + times(dz / R, W)
    g = dV - times(n / R, U) - times(dR / R, V)
    turn = dW - times(curvature, U)
    c_h, c_g = _shares(film)
    hoop = e_h + film.nu * e_m
    K_m = film.Et * product(e_m, e_m)
    K_m += c_h * film.Et / (1 - film.nu**2) * product(hoop, hoop)
    K_m += c_g * film.Et / (2 * (1 + film.nu)) * product(g, g)

    resultant = shape.meridional_tension / R
    K_g = sum(product(d, times(resultant, d)) for d in (e_m, dV, turn))
    volume = (
        product(W, e_m) - product(U, turn) + product(W, e_h) + product(V, times(n / R, W) + times(dz / R, V))
    )
    return K_m, K_g - (volume + volume.T) / 2
