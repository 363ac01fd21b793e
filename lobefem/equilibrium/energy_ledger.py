"""The energy balance of a motion: what strain, contact, gas, constraint and damping have given and taken."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from lobefem.fem.balloon import Balloon
from lobefem.frozen import Frozen
from lobefem.typing import Array, Vec

__all__ = ["Energies", "Ledger", "measure"]


@dataclass(frozen=True)
class Ledger:
    """Energy balance since an equilibrium or a start [J].

    What is done on the balloon, pressure and constraint, is what strain and contact gained and damping
    took: `closure` is the difference.

    Attributes:
        strain: gain in strain energy of film, cables and bar.
        contact: gain in contact energy.
        pressure: work of the gas: p times the gain in volume, less the work p A n . dd on the plates'
            centres where the load is `film` (trapezoid over a step).
        constraint: work of temporary constraints, in a release that of their fading forces, and of dead loads
            on a plate, weight and the pressure's gradient.
        damping: work that the damping took, the integral of c |dq/dt|_B^2 dt.
        euler: the same as implicit Euler counts it, c |dq|_B^2/h a step. It lacks what the steps
            themselves take out of the motion; no part of the balance.
    """

    strain: float = 0.0
    contact: float = 0.0
    pressure: float = 0.0
    constraint: float = 0.0
    damping: float = 0.0
    euler: float = 0.0

    @property
    def closure(self) -> float:
        """Error of the energy balance [J]."""
        return self.pressure + self.constraint - self.strain - self.contact - self.damping

    @property
    def error(self) -> float:
        """|closure| over the largest term."""
        terms = (self.strain, self.contact, self.pressure, self.constraint, self.damping)
        largest = max(map(abs, terms))
        return abs(self.closure) / largest if largest else 0.0

    def after(
        self, balloon: Balloon, old: Energies, new: Energies, *, held: float, damping: float, euler: float
    ) -> Ledger:
        """The ledger after a step.

        Args:
            balloon: with its loads set.
            old: energies at the step's beginning.
            new: energies at its end.
            held: work of the temporary constraints in the step [J].
            damping: work that the damping took in it [J].
            euler: the same as implicit Euler counts it [J].
        """
        return replace(
            self,
            strain=self.strain + new.strain - old.strain,
            contact=self.contact + new.contact - old.contact,
            pressure=self.pressure + _work_of_gas(balloon, old, new),
            constraint=self.constraint + held + new.dead - old.dead,
            damping=self.damping + damping,
            euler=self.euler + euler,
        )


@dataclass(frozen=True)
class Energies(Frozen):
    """The energies of a state, and what the gas works on.

    Attributes:
        volume: enclosed by film and plates [m^3].
        strain: strain energy of film, cables and bar [J].
        contact: contact energy [J].
        areas: area vectors of the plates (2, 3) [m^2]; zero without plates.
        centres: displacements of the plates' centres (2, 3) [m].
        dead: see `Balloon.dead_work` [J].
    """

    volume: float
    strain: float
    contact: float
    areas: Array
    centres: Array
    dead: float


def measure(balloon: Balloon, q: Vec) -> Energies:
    """Measure energies, volume and the plates at q. Collective.

    Args:
        balloon: of film with an energy, its loads set.
        q: unknowns.
    """
    balloon.freeze_plates(q)
    balloon.set_unknowns(q)
    strain, volume = balloon.strain_energy(), balloon.volume()
    assert strain is not None  # `release` refuses film without an energy
    areas: Array = np.zeros((2, 3))
    centres: Array = np.zeros((2, 3))
    if balloon.motion is not None:
        w = balloon.map.plate_parameters(balloon.map.parameters(q))[0][:12]  # without a guide's seams
        areas, centres = balloon.motion.turned_area_vectors(w), w.reshape(2, 6)[:, :3]
    return Energies(volume, strain, balloon.assembly.barrier(), areas, centres, balloon.dead_work())


def _work_of_gas(balloon: Balloon, old: Energies, new: Energies) -> float:
    """Work of the gas over a step, the force on the plates' centres by the trapezoid rule [J]."""
    volume = new.volume - old.volume
    if balloon.load.convention == "film":
        volume -= float(((old.areas + new.areas) / 2 * (new.centres - old.centres)).sum())
    return balloon.gas_work(old.volume, volume)
