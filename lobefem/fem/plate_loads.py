"""`PlateForces`: what acts on the end plates besides the film: gas, dead loads and the bar."""

from __future__ import annotations

import numpy as np

from lobefem.errors import InputError
from lobefem.fem.rigid_plates import PlateMotion
from lobefem.model.end_plates import PlateLoad
from lobefem.typing import Array, Constant

__all__ = ["PlateForces"]


class PlateForces:
    """Energy, gradient and Hessian, in the plates' displacements and turns w, of what acts on them.

    Args:
        motion: how the plates move.
        load: dead load on the top plate, of which a sector's plate bears its share.
        closed: whether the gas bears on the plates, as in a `closed` load; a `film` load does not.
        pressure: the gas pressure, a constant [Pa].
        prestress: pressure p0 of the built-in stress, a constant [Pa].
        excess: what the film's built-in pull on a plate exceeds p0 A by, over p0 [m^2]; None of a film
            without built-in stress.
        gradient: of the gas pressure along the axis [Pa/m].
        level: where the gas has the pressure `pressure`, along the axis [m].

    Attributes:
        top_force: the film's and the gas's force on the top plate at the last `add_to` [N].

    Raises:
        InputError: a dead load on a plate that does not move.
    """

    def __init__(
        self,
        motion: PlateMotion,
        load: PlateLoad | None,
        closed: bool,
        pressure: Constant,
        prestress: Constant,
        excess: float | None,
        gradient: float = 0.0,
        level: float = 0.0,
    ) -> None:
        if load is not None and not motion.moving:
            raise InputError(f"{load} needs EndPlates of which the top one moves, as with support 'clamped'")
        self.motion, self.closed, self.excess = motion, closed, excess
        self.gradient, self.level = gradient if closed else 0.0, level
        self.pressure, self.prestress = pressure, prestress
        dead = np.zeros(6) if load is None else np.concatenate([load.force, load.moment])
        self.dead = np.concatenate([np.zeros(6), dead / motion.copies])
        self.top_force: Array = np.zeros(3)
        self._frozen = motion.area_vectors

    @property
    def bar_built_in(self) -> float:
        """Force in an elastic bar at its reference length: what the plates' gas leaves of the film's pull."""
        if self.excess is None:
            return 0.0
        # the film's pull on a plate is p0 A and its excess over that; with `closed` load the gas bears p0 A
        area = 0.0 if self.closed else float(np.linalg.norm(self.motion.area_vectors[1]))
        return -float(self.prestress.value) * (area + self.excess)

    def freeze(self, w: Array) -> None:
        """Keep the plates' area vectors at w for the volumes that follow."""
        self._frozen = self.motion.turned_area_vectors(w)

    def bar_energy(self, w: Array) -> float:
        """Strain energy of the bar [J]."""
        return self.motion.bar_energy(w, self.bar_built_in)[0]

    def volume(self, w: Array) -> float:
        """The plates' change of the enclosed volume [m^3]."""
        return self.motion.volume_change(w)[0]

    def moment_work(self, w: Array) -> float:
        """Work of the pressure's gradient on the plates [J]."""
        return self.gradient * self.motion.moment_change(w, self.level)[0] if self.gradient else 0.0

    def centre_volume(self, w: Array) -> float:
        """Of `volume`, what a `film` load leaves out: the centres' way along the last frozen areas [m^3]."""
        return 0.0 if self.closed else float((self._frozen * w[:12].reshape(2, 6)[:, :3]).sum())

    def dead_work(self, w: Array) -> float:
        """Work of the dead load [J]."""
        return float(self.dead @ w[:12])

    def add_to(self, gradient: Array, hessian: Array, w: Array) -> None:
        """Add the potential energy's gradient and Hessian in w to those of the film, in place."""
        p = float(self.pressure.value) if self.closed else 0.0
        _, g, h = self.motion.volume_change(w)
        gradient[:12] -= p * g + self.dead
        hessian[:12, :12] -= p * h
        if self.gradient:
            _, g, h = self.motion.moment_change(w, self.level)
            gradient[:12] -= self.gradient * g
            hessian[:12, :12] -= self.gradient * h
        self.top_force = gradient[6:9].copy()
        _, g, h = self.motion.bar_energy(w, self.bar_built_in)
        gradient[:12] += g
        hessian[:12, :12] += h
