"""The film laws by the names that design files use."""

from __future__ import annotations

from lobefem.model.film import Film, Isotropic
from lobefem.model.fixed_wrinkles import FixedWrinkles
from lobefem.model.imp import IMP, PrescribedPath
from lobefem.model.tension_field import TensionField

__all__ = ["FILMS", "STRESS_LAWS"]

FILMS: dict[str, type[Film]] = {law.name: law for law in (Isotropic, FixedWrinkles, TensionField)}

STRESS_LAWS: dict[str, type[IMP]] = {law.name: law for law in (IMP, PrescribedPath)}
