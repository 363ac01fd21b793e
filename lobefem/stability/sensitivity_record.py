"""The record of a sensitivity: a quantity of one gore's symmetric state, with its derivatives."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from lobefem.display import Summarized, Summary, number
from lobefem.equilibrium.state import Equilibrium
from lobefem.errors import InputError
from lobefem.fem.balloon import Balloon
from lobefem.frozen import Frozen
from lobefem.typing import Array

__all__ = ["PARAMETERS", "Evaluation", "Sensitivity"]

# what every sensitivity has a derivative by
PARAMETERS = ("E", "thickness", "EA", "foreshortening", "pressure")

Evaluation = Callable[[Balloon], float]


@dataclass(frozen=True, repr=False)
class Sensitivity(Frozen, Summarized):
    """A quantity of a state with its derivatives.

    Attributes:
        quantity: "volume", "max_stress", "stress_norm", "tendon_tension", "eigenvalue", "critical_pressure"
            or "film_area".
        unit: of it.
        value: of the whole balloon.
        harmonic: n of an eigenvalue or a critical pressure, else None.
        by: derivatives. By "E" (of orthotropic film all moduli together), "thickness" (with the film's
            weight), "EA" and "pressure" they are per relative change, dJ/d(ln x); by "foreshortening" per
            unit of this share.
        by_pattern: derivatives by the degrees of freedom of the balloon's flat pattern [unit/m]; None of
            film that is free of stress as drawn. See `along`.
        state: the state; of a critical pressure the critical one.
    """

    quantity: str
    unit: str
    value: float
    harmonic: int | None
    by: Mapping[str, float]
    by_pattern: Array | None = field(repr=False)
    state: Equilibrium = field(repr=False)
    evaluation: Evaluation = field(repr=False)

    def along(self, direction: Any) -> float:
        """Derivative as the pattern moves in a direction, `PumpkinRecipe.widening` for example.

        Args:
            direction: a function in the pattern's space [m], or its degrees of freedom.

        Raises:
            InputError: a balloon without flat pattern, or a direction of another space.
        """
        if self.by_pattern is None:
            raise InputError("this film is free of stress as drawn and has no pattern to vary; give one")
        values = direction.x.array if hasattr(direction, "x") else np.asarray(direction)
        if values.shape != self.by_pattern.shape:
            raise InputError(
                f"the direction has {values.size} numbers and the pattern {self.by_pattern.size}; give a "
                "function in the pattern's space"
            )
        return float(values @ self.by_pattern)

    def between(self, low: Balloon, high: Balloon) -> float:
        """Change of the quantity from one balloon to another near by, without solving for their states.

        The explicit change of residual and quantity at this state's displacement, with the adjoint: for a
        parameter of which no form has the derivative, such as a radius. It is exact to the second order of
        the step if this balloon is amid the two.

        Args:
            low: of one gore meshed as this balloon, with less of the parameter.
            high: with more of it.

        Raises:
            InputError: a balloon with other unknowns.
        """
        size = self.state.balloon.map.size
        for other in (low, high):
            if other.map.size != size:
                raise InputError(f"a balloon has {other.map.size} unknowns, not {size}; mesh all alike")
        return self.evaluation(high) - self.evaluation(low)

    def _summary(self) -> Summary:
        of = "" if self.harmonic is None else f" of n = {self.harmonic}"
        rows = [(name, number(value, self.unit), "") for name, value in self.by.items()]
        title = f"{self.quantity.replace('_', ' ')}{of}: {number(self.value, self.unit)}"
        return Summary(title, tuple(rows), ("parameter", "derivative", ""))
