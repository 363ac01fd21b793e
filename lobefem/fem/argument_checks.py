"""Checks of the arguments of a `Balloon` against each other."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lobefem import checks
from lobefem.errors import InputError
from lobefem.fem.weak_forms import check_load_path
from lobefem.geometry.meridian import Lobe

if TYPE_CHECKING:
    from lobefem.fem.balloon import Balloon

__all__ = ["require_consistent"]


def require_consistent(balloon: Balloon) -> None:
    """Refuse built-in stress, a film or a further energy that do not go with the rest.

    Args:
        balloon: under construction; it has its arguments.

    Raises:
        InputError: which of these it is.
    """
    surface, film, load_path = balloon.surface, balloon.film, balloon.load_path
    hoop_slack, prestressed = balloon.hoop_slack, balloon.prestressed
    extra_energy, frame = balloon.extra_energy, balloon.given_frame
    if extra_energy is not None and not callable(extra_energy):
        raise InputError(
            f"extra_energy is of type {type(extra_energy).__name__}; give a function of the balloon"
        )
    if not 0 <= checks.finite("hoop_slack", hoop_slack, "") < 1:
        raise InputError(f"hoop_slack = {hoop_slack} must be a strain in [0, 1), such as 1e-3")
    if hoop_slack and not prestressed and load_path is None:
        raise InputError(
            f"hoop_slack = {hoop_slack} is part of a built-in stress and there is none; pass "
            "prestressed=True or a load_path, or leave it out"
        )
    if prestressed and not isinstance(surface.shape, Lobe):
        raise InputError("prestress needs an isotensoid or a formed lobe; this surface is another shape")
    if film.directional and frame is None and not surface.of_revolution:
        raise InputError(
            f"{type(film).__name__} film has a direction, and this surface runs around no axis; give "
            "a frame, such as tangent_frame makes, or TensionField or Isotropic film"
        )
    if load_path is not None:
        if prestressed:
            raise InputError("the film gets its stress from the load path or by prestress, not from both")
        check_load_path(load_path, surface, film)
    if film.leads_to_stress and (prestressed or load_path is not None):
        raise InputError(
            f"{type(film).__name__} film finds its stress from unstressed film; leave prestressed and "
            "load_path out, or give the law that takes over, such as TensionField"
        )
