"""Specification of self-contact: activation distance and stiffness of the barrier."""

from __future__ import annotations

from dataclasses import dataclass

from lobefem import checks

__all__ = ["SelfContact"]


@dataclass(frozen=True)
class SelfContact:
    """A part of a balloon: its film and end plates cannot pass through each other.

    Args:
        activation: distance below which film repels film [m]; by default a quarter of the smallest
            distance at rest between facets that share no node. Film in contact keeps a gap of about
            this size, so study its influence.
        stiffness: k of the barrier [Pa]; by default the gas pressure (or that of the built-in stress
            where it is higher), at least 1 Pa, so that the gap does not depend on the pressure.

    Raises:
        InputError: a number that is not positive and finite.
    """

    activation: float | None = None
    stiffness: float | None = None

    def __post_init__(self) -> None:
        if self.activation is not None:
            checks.positive("the contact's activation distance", self.activation, "m")
        if self.stiffness is not None:
            checks.positive("the contact's stiffness", self.stiffness, "Pa")
