"""What the gas in a balloon does: its volume, its load, and where it is sealed in the law that it follows."""

from __future__ import annotations

from typing import Any, NamedTuple

from lobefem.errors import InputError
from lobefem.model.gas_pressure import SealedGas
from lobefem.typing import Array, Vec

__all__ = ["GasAccess", "GasStiffness"]


class GasStiffness(NamedTuple):
    """Part of rank one that a sealed gas adds to a tangent: factor times vector vector^T.

    Attributes:
        factor: -dp/dV [Pa/m^3].
        vector: dV/dq [m^2, m^3].
    """

    factor: float
    vector: Any

    def along(self, v: Vec, u: Vec) -> float:
        """Its second variation along two changes of q [J]. Collective."""
        return self.factor * float(self.vector.dot(v)) * float(self.vector.dot(u))


class GasAccess:
    """The gas of a balloon under a given pressure, or of a given mass."""

    surface: Any
    assembly: Any
    map: Any
    motion: Any
    plate_forces: Any
    pressure: Any
    contact: Any
    load: Any
    u: Any
    reference_volume: float
    w: Array
    gas: SealedGas | None = None  # None under a given pressure
    _under: Any  # the balloon under other constraints

    def with_gas(self, gas: SealedGas | None) -> Any:
        """This balloon with a gas sealed in, or with None under a given pressure. Collective.

        Its pressure then follows from the volume; what `set_loads` says holds until the next residual. The
        two share displacement, loads and forms; `Equilibrium.restore` puts in those of a state.

        Raises:
            InputError: the `film` load, which has no potential, or contact whose stiffness is to follow
                the pressure.
        """
        if gas is not None and self.load.convention != "closed":
            raise InputError("a sealed gas presses on film and plates; use GasPressure('closed')")
        if gas is not None and self.contact is not None and self.contact.part.stiffness is None:
            raise InputError(
                "the stiffness of the contact follows the gas pressure, and that of a sealed gas changes on "
                "the way; give one, as SelfContact(stiffness=100)"
            )
        other = self._under(self.map)
        other.gas = gas
        return other

    def volume(self) -> float:
        """Volume enclosed by film and plates [m^3] in the present displacement. Collective."""
        change = self.assembly.volume()
        change += self.plate_forces.volume(self.w) if self.plate_forces else 0.0
        return self.reference_volume + float(change)

    def follow_gas(self) -> None:
        """Give a sealed gas the pressure of the present displacement. Collective."""
        if self.gas is not None:
            self.pressure.value = self.gas.pressure(self.surface.copies * self.volume())

    def gas_work(self, volume: float, gain: float) -> float:
        """Work of the gas as this surface's volume gains [J], without that of a pressure's gradient."""
        if self.gas is None:
            return float(self.pressure.value) * gain
        copies = self.surface.copies
        return self.gas.work(copies * volume, copies * gain) / copies

    def gas_stiffness(self, q: Vec) -> GasStiffness | None:
        """Part that a sealed gas adds to the tangent at q; None under a given pressure. Collective.

        It resists what changes the volume alone: at a shape that is the same in all sectors the harmonic 0.
        """
        if self.gas is None:
            return None
        self.w, dw, _ = self.map.displace(q, self.u)
        g = self.assembly.volume_gradient()
        out = self.map.create_vector()
        gradient, _ = self.map.plate_forces(g, self.w)
        if self.motion is not None:
            gradient[:12] += self.motion.volume_change(self.w[:12])[1]
        self.map.reduce(g, gradient, dw, out)
        copies = self.surface.copies
        return GasStiffness(copies * self.gas.stiffness(copies * self.volume()), out)

    def load_norm(self, q: Vec) -> float:
        """Norm of the pressure's reduced nodal forces p dV/dq at q [N, N m]. Collective."""
        self.w, dw, _ = self.map.displace(q, self.u)
        g = self.assembly.load()
        out = self.map.create_vector()
        self.map.reduce(g, self.map.plate_forces(g, self.w)[0], dw, out)
        return abs(float(self.pressure.value)) * float(out.norm())
