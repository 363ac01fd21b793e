"""What a balloon's own components and its `extra_energy` add to it: an energy in UFL, forces at nodes."""

from __future__ import annotations

from typing import Any

import numpy as np

from lobefem.errors import InputError
from lobefem.fem.specification import Specification
from lobefem.typing import Array, Form, Unchecked

import ufl

__all__ = ["further_energy", "nodal_forces"]


def further_energy(given: Specification, balloon: Any) -> Form | None:
    """The further energy of a balloon under construction in UFL [J]; None without any.

    Raises:
        InputError: something that is no energy.
    """
    forms = []
    if given.extra_energy is not None:
        forms.append(_energy("extra_energy", given.extra_energy(balloon)))
    forms += [
        _energy(f"{type(part).__name__}.potential", part.potential(balloon))
        for part in given.parts.own
        if hasattr(part, "potential")
    ]
    return sum(forms[1:], forms[0]) if forms else None


def nodal_forces(given: Specification, balloon: Any) -> Array | None:
    """Constant forces at the nodes of this rank, ghosts included (components,) [N]; None without any.

    Raises:
        InputError: forces of another shape, or that are no finite numbers. All ranks raise alike.

    Collective.
    """
    total = None
    for part in given.parts.own:
        if not hasattr(part, "forces"):
            continue
        given_forces = np.asarray(part.forces(balloon))
        real = given_forces.dtype.kind in "iuf"  # neither words nor complex numbers
        forces = given_forces.astype(float) if real else np.full(given_forces.shape, np.nan)
        wrong = forces.shape != balloon.X.shape or not np.isfinite(forces).all()
        if balloon.comm.allreduce(int(wrong)):
            raise InputError(
                f"{type(part).__name__}.forces returns an array of shape {forces.shape} of "
                f"{given_forces.dtype}; return finite forces at the nodes of balloon.X, of its shape "
                f"{balloon.X.shape}"
            )
        total = forces.ravel() if total is None else total + forces.ravel()
    return total


def _energy(name: str, form: Unchecked) -> Form:
    if not isinstance(form, ufl.Form) or form.arguments():
        raise InputError(
            f"{name} returns {type(form).__name__}; return an energy in UFL that is integrated, as "
            "k / 2 * ufl.inner(balloon.u, balloon.u) * balloon.dx"
        )
    return form
