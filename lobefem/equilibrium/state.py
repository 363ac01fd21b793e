"""States: unknowns with their loads, and `Equilibrium` with what was measured on it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from lobefem import checks
from lobefem.display import Summarized, Summary, number
from lobefem.errors import InputError
from lobefem.fem import functionals, peaks, rigid_motions
from lobefem.fem.balloon import Balloon
from lobefem.fem.peaks import Peak
from lobefem.frozen import Frozen
from lobefem.geometry import gather
from lobefem.linalg import petsc
from lobefem.model.film import require_pressure
from lobefem.typing import Array, Vec

from dolfinx import fem

__all__ = [
    "Checkpoint",
    "Equilibrium",
    "State",
    "ideal_state",
    "placed_state",
    "record",
    "require_drawn",
    "require_whole",
]


@dataclass(frozen=True)
class State(Frozen):
    """A balloon's loads and unknowns, in equilibrium or not: a start, a moment of a motion.

    Attributes:
        balloon: the balloon this is a state of.
        pressure: gas pressure p [Pa].
        prestress: pressure p0 [Pa] whose meridional stress is built into film and cables.
        unknowns: this rank's part of q (see `lobefem.fem.constraint_map`).
        parameter: of the prescribed motion of the balloon [m or rad], 0 without one.
    """

    balloon: Balloon = field(repr=False)
    pressure: float
    prestress: float
    unknowns: Array = field(repr=False)
    parameter: float = field(default=0.0, kw_only=True)

    @cached_property
    def displacement(self) -> Array:
        """This rank's nodal displacements, ghosts included, (nodes, 3) [m]. Collective."""
        u, motion = fem.Function(self.balloon.V), self.balloon.prescribed
        if motion is not None:
            before, motion.parameter = motion.parameter, self.parameter
        self.balloon.map.displace(self.vector(), u)
        if motion is not None:
            motion.parameter = before
        found: Array = u.x.array.reshape(-1, 3).copy()
        found.flags.writeable = False
        return found

    def vector(self) -> Vec:
        """The unknowns q as a PETSc vector. Collective."""
        q = self.balloon.map.create_vector()
        q.array[:] = self.unknowns
        return q

    def restore(self) -> Vec:
        """Put this state's loads and displacement back into its balloon; returns q. Collective."""
        self.balloon.set_loads(self.pressure, self.prestress)
        if self.balloon.prescribed is not None:
            self.balloon.prescribed.parameter = self.parameter
        q = self.vector()
        self.balloon.set_unknowns(q)
        return q


@dataclass(frozen=True)
class Checkpoint(State):
    """A state read back: `inflate(balloon, pressure, start=checkpoint)` goes on from it.

    Attributes:
        notes: what was kept with it.
        fields: other nodal fields that were, by name: this rank's values, ghosts included (nodes, 3).
    """

    notes: Mapping[str, Any] = field(default_factory=dict, repr=False)
    fields: Mapping[str, Array] = field(default_factory=dict, repr=False)


@dataclass(frozen=True, repr=False)
class Equilibrium(Summarized, State):
    """A state, and what was measured on it.

    Attributes:
        displacement: this rank's nodal displacements, ghosts included, (nodes, 3) [m].
        converged, reason, iterations: of SNES (all steps together); reason in words.
        residual: norm of the reduced residual [N, N m].
        relative_residual: the same over the norm of the pressure's nodal forces.
        volume: enclosed by film and plates [m^3].
        strain_energy: of film, cables and bar [J], built-in stress included; None for a film whose
            stress is no energy's gradient.
        max_displacement: largest nodal displacement [m], without the tilt that a pinned support leaves free.
        bar_force: [N], tension positive; None without a bar or with both rims held.
        hoop_tension: mean tension of each cable group [N].
        taut_area, wrinkled_area, slack_area: reference areas [m^2].
        num_dofs: displacement components of all nodes.
        steps: pressures at which Newton's method converged on the way [Pa].
    """

    displacement: Array = field(repr=False)
    converged: bool
    reason: str
    iterations: int
    residual: float
    relative_residual: float
    volume: float
    strain_energy: float | None
    max_displacement: float
    bar_force: float | None
    hoop_tension: tuple[float, ...]
    taut_area: float
    wrinkled_area: float
    slack_area: float
    num_dofs: int
    steps: tuple[float, ...] = ()

    def nodes(self) -> Array:
        """This rank's nodes as meshed, in the order of `displacement`, ghosts included, (nodes, 3) [m]."""
        return self.balloon.X

    def stress_resultants(self) -> Any:
        """Cell means of (N_m, N_h, N_mh) [N/m] as a piecewise constant function. Collective."""
        self.restore()
        return functionals.stress_resultants(self.balloon)

    def max_stress(self) -> Peak:
        """The film's largest principal true stress [Pa], thickness as built, and where. Collective."""
        self.restore()
        return peaks.largest_stress(self.balloon)

    def max_strain(self) -> Peak:
        """The film's largest principal strain, built-in strain included, and where. Collective."""
        self.restore()
        return peaks.largest_strain(self.balloon)

    def regions(self) -> Any:
        """Shares (taut, wrinkled, slack) of each cell as a piecewise constant function. Collective."""
        self.restore()
        return functionals.region_shares(self.balloon)

    def to_pyvista(self) -> Any:
        """The film in this state as a PyVista grid on rank 0, None elsewhere. Collective.

        Points are where the nodes are now, in the order of `nodes()` and `displacement`, those of rank 0
        first. Point data "displacement" [m]; cell data "stress_resultants"
        (N_m, N_h, N_mh) [N/m], "regions" (shares of taut, wrinkled and slack film) and "lobe". Rank 0
        gathers all of it: see `lobefem.geometry.gather.gather` for what that takes.
        """
        balloon = self.balloon
        cellwise = {
            "stress_resultants": self.stress_resultants().x.array.reshape(-1, 3),
            "regions": self.regions().x.array.reshape(-1, 3),
            "lobe": balloon.surface.lobe_numbers(),
        }
        nodal = {"displacement": gather.at_nodes(balloon.V, self.displacement)}
        whole = gather.gather(balloon.mesh, nodal, cellwise, balloon.V)
        if whole is None:
            return None
        grid = gather.to_pyvista(whole)
        grid.points = whole.x + whole.nodal["displacement"]
        return grid

    def _summary(self) -> Summary:
        area = self.taut_area + self.wrinkled_area + self.slack_area
        components = {"taut": self.taut_area, "wrinkled": self.wrinkled_area, "slack": self.slack_area}
        film = ", ".join(f"{100 * part / area:.3g} % {name}" for name, part in components.items())
        rows = [
            ("volume", number(self.volume, "m^3", 8)),
            ("largest displacement", number(self.max_displacement, "m")),
            ("film", film),
            ("residual over load", f"{self.relative_residual:.1e}"),
            ("iterations", str(self.iterations)),
            ("built-in stress of", number(self.prestress, "Pa")),
            ("strain energy", number(self.strain_energy, "J")),
            ("bar force", number(self.bar_force, "N")),
            ("cable tension", ", ".join(number(t, "N") for t in self.hoop_tension) or "none"),
            ("displacement components", str(self.num_dofs)),
        ]
        return Summary(f"{self.pressure:g} Pa, {self.reason}", tuple(rows))

    def true_resultants(self) -> Any:
        """Cell means of the true (N_phi, N_theta, N_phitheta) [N/m], see `measures`. Collective."""
        self.restore()
        return functionals.true_resultants(self.balloon)


def ideal_state(balloon: Balloon, pressure: float) -> Equilibrium:
    """The lobes as they were drawn, geometry held, their stress proportional to the pressure.

    The paper's sec. 5 takes its eigenvalues here. Exact equilibrium up to discretisation, whose
    residual is reported.

    Args:
        balloon: a prestressed balloon.
        pressure: p [Pa].

    Collective.
    """
    require_whole(balloon)
    require_pressure(balloon.film, pressure)
    require_drawn(balloon)
    if not balloon.prestressed:
        raise InputError("the ideal state needs a prestressed balloon; pass prestressed=True")
    balloon.set_loads(pressure, pressure)
    q = balloon.map.create_vector()
    return record(balloon, q, True, "held geometry", 0, ())


def placed_state(balloon: Balloon, displacement: Array) -> Equilibrium:
    """A displacement as a state to start `inflate` from, without load; in equilibrium only by chance.

    Args:
        balloon: what to displace.
        displacement: this rank's nodal displacements, ghosts included, (nodes, 3) [m]; nodes that are
            held or belong to a plate stay where they are.

    Collective.
    """
    balloon.set_loads(0.0)
    q = balloon.map.create_vector()
    with q as array:
        free = balloon.map.free
        array[: free.size] = displacement.reshape(-1)[free]
    return record(balloon, q, False, "placed", 0, ())


def record(
    balloon: Balloon,
    q: Vec,
    converged: bool,
    reason: str,
    iterations: int,
    steps: tuple[float, ...],
) -> Equilibrium:
    """Measure a state at q under the balloon's present loads. Collective."""
    petsc.tidy(balloon.comm)  # what the way here has left
    r = q.duplicate()
    balloon.residual(q, r)
    norm, scale = r.norm(), balloon.load_norm(q)
    bar_force = balloon.bar_force()
    r.destroy()
    displacement = balloon.u.x.array.reshape(-1, 3).copy()
    copies = balloon.surface.copies  # of a sector, whose state stands for the whole balloon's
    taut, wrinkled, slack = (copies * area for area in functionals.region_areas(balloon))
    energy = balloon.strain_energy()
    return Equilibrium(
        balloon=balloon,
        pressure=float(balloon.pressure.value),
        prestress=float(balloon.prestress.value),
        unknowns=q.array_r.copy(),
        displacement=displacement,
        converged=converged,
        reason=reason,
        iterations=iterations,
        residual=norm,
        relative_residual=norm / scale if scale else norm,
        volume=copies * balloon.volume(),
        strain_energy=None if energy is None else copies * energy,
        max_displacement=rigid_motions.largest_of_state(balloon, displacement),
        bar_force=None if bar_force is None else copies * bar_force,
        hoop_tension=functionals.cable_tensions(balloon),
        taut_area=taut,
        wrinkled_area=wrinkled,
        slack_area=slack,
        num_dofs=3 * balloon.V.dofmap.index_map.size_global,
        steps=steps,
        parameter=balloon.prescribed.parameter if balloon.prescribed is not None else 0.0,
    )


def require_whole(balloon: Balloon) -> None:
    """Refuse one sector of a balloon, or no balloon, where a whole one is needed."""
    checks.having("balloon", balloon, "reference_area", "a Balloon")
    if balloon.surface.copies != 1:
        raise InputError("this is one sector of a balloon; mesh the whole surface (sector=False)")


def require_drawn(balloon: Balloon) -> None:
    """Refuse supports that move nodes where the lobes are looked at as they were drawn. Collective."""
    checks.having("balloon", balloon, "reference_area", "a Balloon")
    balloon.set_unknowns(balloon.map.create_vector())
    moved = functionals.largest(balloon, balloon.u.x.array.reshape(-1, 3))
    if moved > 1e-9 * math.sqrt(balloon.reference_area):  # more than round-off
        raise InputError(
            f"the supports move the film by {moved:.3g} m, and the ideal state is that of the lobes as they "
            "were drawn; leave lift or displacement out, or look at the inflated state"
        )
