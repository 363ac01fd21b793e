"""Balloons with a gas of a given mass: sealed at a pressure, and filled with more or less of it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from lobefem import checks
from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.solver_options import NewtonOptions
from lobefem.equilibrium.state import Equilibrium
from lobefem.errors import ConvergenceError, InputError
from lobefem.model.gas_pressure import SealedGas

__all__ = ["fill", "seal"]

_LEAST = 1e-3  # step of an amount, as a share of the way


def seal(state: Equilibrium, ambient: float = 0.0) -> Equilibrium:
    """The same state with its gas sealed in: from here on its mass is given, and its pressure follows.

    Args:
        state: from `inflate`.
        ambient: pressure of the air around, from which that of the gas counts [Pa]. The higher it is, the
            less the volume can change.

    Raises:
        InputError: a state without a gas, or a balloon whose gas cannot be sealed in.

    Collective.
    """
    checks.having("state", state, "volume", "a state, from inflate")
    if checks.finite("the ambient pressure", ambient, "Pa") + state.pressure <= 0:
        raise InputError(
            f"at {state.pressure:g} Pa above an ambient pressure of {ambient:g} Pa there is no gas to seal "
            "in; inflate the balloon first"
        )
    gas = SealedGas.of(state.pressure, state.volume, ambient)
    return replace(state, balloon=state.balloon.with_gas(gas))


def fill(
    state: Equilibrium,
    amount: float,
    *,
    rtol: float = 1e-8,
    on_step: Callable[[Equilibrium], None] | None = None,
    progress: Callable[[str], None] | None = None,
) -> Equilibrium:
    """The equilibrium with another amount of sealed gas, in steps where one is too large.

    Args:
        state: of a sealed gas, from `seal`.
        amount: m R T of the gas then [J].
        rtol: as in `inflate`.
        on_step: called on all ranks with each equilibrium on the way.
        progress: called with a line of text after each solve.

    Raises:
        InputError: an amount that is not positive, or a state under a given pressure.
        ConvergenceError: no equilibrium found; its `state` is the last one that was.

    Collective.
    """
    checks.having("state", state, "volume", "a state, from inflate")
    gas = state.balloon.gas
    if gas is None:
        raise InputError("the state is one under a given pressure; seal its gas in first: seal(state)")
    checks.positive("the amount of sealed gas", amount, "J")
    first, ratio = gas.amount, amount / gas.amount
    share, step = 0.0, 1.0
    while True:
        target = min(1.0, share + step)
        balloon = state.balloon.with_gas(SealedGas(first * ratio**target, gas.ambient))
        try:
            guess = max(state.pressure, math.ulp(1.0))
            state = inflate(
                balloon,
                guess,
                prestress=state.prestress,
                start=state,
                options=NewtonOptions(rtol=rtol),
                progress=progress,
            )
        except ConvergenceError as error:
            step /= 2
            if step < _LEAST:
                raise ConvergenceError(
                    f"filling stopped at {first * ratio**share:.6g} J of {amount:.6g} J "
                    f"({error.data['reason']}); try film with slack_stiffness >= 1e-4",
                    state=state,
                    residual=error.data["residual"],
                    reason=error.data["reason"],
                ) from None
            continue
        if on_step is not None:
            on_step(state)
        share, step = target, 2 * step
        if share == 1.0:
            return state
