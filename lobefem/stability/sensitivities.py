"""Sensitivities of one gore's symmetric state and of its stability, each quantity by one adjoint solve.

With R(q, x) = 0 the state and J(q, x) a quantity, K mu = -dJ/dq gives dJ/dx = J_x + mu . R_x for every
parameter x at once. An eigenvalue lambda = phi^H K phi, phi^H M phi = 1, is such a quantity with phi held:
what phi changes by counts for nothing. A pair of +-n has one complex phi, whose real and imaginary parts are
two real fields on the gore with free cuts; their second variations add up. A critical pressure changes by
dp = -d lambda/(d lambda/dp). See docs/theory/sensitivities.md.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse.linalg import splu

from lobefem import checks
from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.solver_options import NewtonOptions
from lobefem.equilibrium.state import Equilibrium
from lobefem.errors import EigenError, InputError
from lobefem.fem.balloon import Balloon
from lobefem.fem.functionals import cable_tensions, displacement_of, stiffness_scale
from lobefem.fem.parameter_forms import ParameterForms
from lobefem.fem.rigid_motions import free_to_rotate, is_turn
from lobefem.fem.rigid_plates import rotation
from lobefem.linalg.banded import as_scipy
from lobefem.stability.cell_stresses import cell_areas, cell_stresses, power_norm
from lobefem.stability.gore_modes import GoreMode, GorePencil, GoreSector
from lobefem.stability.sensitivity_record import PARAMETERS, Evaluation, Sensitivity
from lobefem.typing import Array, ComplexArray, Vec

__all__ = ["Adjoint", "critical_sensitivity"]


class Adjoint:
    """Sensitivities at a state of one gore; its tangent is factorised once.

    Args:
        state: of one sector.

    Raises:
        InputError: a whole balloon, or built-in stress, a load path, contact or a sealed gas.
    """

    def __init__(self, state: Equilibrium) -> None:
        checks.having("state", state, "balloon", "a state of one gore, from inflate")
        self._sector = GoreSector(state.balloon)
        if state.balloon.gas is not None:
            raise InputError("sensitivities are those at a given pressure; leave the sealed gas out")
        self.state = state
        self._balloon, self._copies = state.balloon, state.balloon.surface.copies
        self._forms = ParameterForms(state.balloon)
        self._q = self._restored()
        w, dw, _ = self._balloon.map.plate_parameters(self._balloon.map.parameters(self._q))
        self._w, self._dw = w, dw

    def _restored(self) -> Vec:
        return self.state.restore()

    @cached_property
    def _factor(self) -> Any:
        self._restored()
        return splu(as_scipy(self._balloon.tangent(self._q)).T.tocsc())

    @cached_property
    def _by_pressure(self) -> Array:
        """Derivative of the residual by ln p, in which it is linear."""
        self._restored()
        p = self.state.pressure
        residuals = []
        for load in (p, 2 * p):
            self._balloon.set_loads(load)
            out = self._q.duplicate()
            self._balloon.residual(self._q, out)
            residuals.append(out.array_r.copy())
        self._balloon.set_loads(p)
        return np.asarray(residuals[1] - residuals[0])

    def _reduced(self, nodal: Array, plates: Array | float = 0.0) -> Array:
        """A derivative by nodal displacements, and by the plates' motion, as one in q."""
        gradient, _ = self._balloon.map.plate_forces(nodal, self._w)
        out = self._balloon.map.create_vector()
        self._balloon.map.reduce(nodal, gradient + plates, self._dw, out)
        return np.asarray(out.array_r.copy())

    def _adjoint(self, gradient: Array) -> tuple[Array, Array]:
        """The adjoint mu in q, and its nodal displacements."""
        mu = self._factor.solve(-gradient)
        vector = self._q.duplicate()
        vector.array[:] = mu
        return mu, displacement_of(self._balloon, self._q, vector)

    def _residual_along(self, mu: Array, other: Balloon) -> float:
        """The work along mu of another balloon's residual in this displacement; it is left there."""
        other.set_loads(self.state.pressure, self.state.prestress)
        out = self._q.duplicate()
        other.residual(self._q, out)
        return float(mu @ out.array_r)

    def _finished(
        self,
        quantity: str,
        unit: str,
        value: float,
        gradient: Array,
        explicit: Mapping[str, float],
        pattern: Array | None,
        evaluate: Evaluation,
        *,
        along: tuple[Array | None, tuple[Array, ...]] = (None, ()),
        harmonic: int | None = None,
    ) -> Sensitivity:
        """The sensitivity of a quantity from its partial derivatives.

        Args:
            quantity: its name.
            unit: of it.
            value: of it.
            gradient: its derivative by q.
            explicit: its partial derivatives by parameters, without those that follow from `along`.
            pattern: that by the pattern.
            evaluate: its value on another balloon in this state's displacement.
            along: a nodal field that the residual acts on beside mu, and the fields along which the second
                variation is part of the quantity.
            harmonic: of a mode.
        """
        mu, eta = self._adjoint(gradient)
        other, modes = along
        forms = self._forms
        sums: dict[str, float] = {}
        for k, phi in enumerate(modes or (None,)):
            forms.set_directions((eta if other is None else eta + other) if k == 0 else None, phi)
            for name, part in forms.by_scalars().items():
                sums[name] = sums.get(name, 0.0) + part
            moved = forms.by_pattern()
            if moved is not None:
                pattern = moved if pattern is None else pattern + moved
        sums["foreshortening"] = sums.pop("shortening")
        sums["pressure"] = float(mu @ self._by_pressure)
        for name, part in explicit.items():
            sums[name] += part
        sums["foreshortening"] /= 1.0 - self._foreshortening
        by = {name: sums[name] for name in PARAMETERS}

        def evaluation(balloon: Balloon) -> float:
            return self._residual_along(mu, balloon) + evaluate(balloon)

        return Sensitivity(quantity, unit, value, harmonic, by, pattern, self.state, evaluation)

    @property
    def _foreshortening(self) -> float:
        cables = self._balloon.cables
        given = cables[0].foreshortening if cables else 0.0
        if callable(given):
            raise InputError(
                "the tendons' foreshortening varies along them, and sensitivities are by one number; give one"
            )
        return given

    # --- quantities -----------------------------------------------------------------------------------
    def volume(self) -> Sensitivity:
        """The enclosed volume [m^3]."""
        self._restored()
        forces, copies = self._balloon.plate_forces, self._copies
        plates = 0.0 if forces is None else forces.motion.volume_change(self._w)[1]
        gradient = copies * self._reduced(self._forms.volume_by_displacement(), plates)

        def evaluate(other: Balloon) -> float:
            other.set_unknowns(self._q)
            return copies * other.volume()

        return self._finished("volume", "m^3", self.state.volume, gradient, {}, None, evaluate)

    def tendon_tension(self) -> Sensitivity:
        """The mean tension of the tendons [N].

        Raises:
            InputError: a balloon without tendons, or with several kinds of them.
        """
        self._restored()
        if len(self._balloon.cables) != 1:
            raise InputError(
                f"the balloon has {len(self._balloon.cables)} kinds of cables; the tendons' tension needs one"
            )
        length = float(self._balloon.forms.lengths.sum())
        gradient: Any = self._reduced(self._forms.pull_by_displacement()) / length
        pull, by_share = self._forms.pull_by_shortening()
        explicit = {"EA": pull / length, "foreshortening": by_share / length}

        def evaluate(other: Balloon) -> float:
            other.set_unknowns(self._q)
            return cable_tensions(other)[0]

        return self._finished("tendon_tension", "N", pull / length, gradient, explicit, None, evaluate)

    def max_stress(self) -> Sensitivity:
        """The largest principal true stress of a cell [Pa]: that of the cell which has it in this state.

        Where another cell takes over, the largest stress has a corner; its derivative is that of one side.
        """
        self._restored()
        cell = int(cell_stresses(self._balloon)[0].argmax())
        return self._stress("max_stress", lambda stresses: (stresses[cell], np.eye(len(stresses))[cell]))

    def stress_norm(self, power: float = 40.0) -> Sensitivity:
        """A smooth measure of the largest stress [Pa].

        It is (sum of sigma^power)^(1/power) over the cells of half a gore, and exceeds the largest principal
        true stress of a cell by little, the less the larger the power.
        """
        self._restored()
        return self._stress("stress_norm", lambda stresses: power_norm(stresses, power))

    def _stress(self, quantity: str, of: Callable[[Array], tuple[float, Array]]) -> Sensitivity:
        """The sensitivity of a function of the cells' stresses, which returns its derivative by them, too."""
        stresses, slopes = cell_stresses(self._balloon)
        value, weights = of(stresses)
        forms = self._forms
        forms.pick.x.array[:] = (weights[:, None] * slopes / cell_areas(self._balloon)[:, None]).ravel()

        def evaluate(other: Balloon) -> float:
            other.set_unknowns(self._q)
            return of(cell_stresses(other)[0])[0]

        gradient = self._reduced(forms.picked_by_displacement())
        pattern = forms.picked_by_pattern()
        return self._finished(quantity, "Pa", float(value), gradient, {"E": value}, pattern, evaluate)

    def film_area(self) -> Sensitivity:
        """The area of all layers of unstressed film [m^2], by which its mass goes; no state changes it."""

        def area(other: Balloon) -> float:
            layers = 1.0 if other.layers is None else other.layers
            one = layers * other.forms.area_of_film * other.dx
            return self._copies * other.integrate(one)

        pattern = self._forms.area_by_pattern()
        by = dict.fromkeys(PARAMETERS, 0.0)
        scaled = None if pattern is None else self._copies * pattern
        return Sensitivity("film_area", "m^2", area(self._balloon), None, by, scaled, self.state, area)

    def eigenvalue(self, harmonic: int) -> Sensitivity:
        """The lowest eigenvalue of a harmonic [Pa/m], a pair of +-n as one.

        Raises:
            InputError: n out of range, or film without symmetric tangent.
            EigenError: it was not found.
        """
        self._restored()
        pencil = GorePencil(
            self._sector, self._balloon, "unit", 1e-2 * stiffness_scale(self._balloon, self.state.pressure)
        )
        mode = self._lowest(pencil, harmonic)
        complex_field = self._sector.displacement(pencil.own, mode.vector)
        fields = tuple(part for part in (complex_field.real, complex_field.imag) if np.any(part))
        bend, plates = self._of_plates(mode.vector)
        gradient = np.zeros(3 * len(self._balloon.X))
        for k, phi in enumerate(fields):
            self._forms.set_directions(bend if k == 0 else None, phi)
            gradient += self._forms.by_displacement()
        curvature = [self._curvature(self._sector, mode.vector, share) for share in (1, 2)]
        explicit = {"pressure": curvature[1] - curvature[0]}

        def evaluate(other: Balloon) -> float:
            sector = GoreSector(other)
            other.set_loads(self.state.pressure, self.state.prestress)
            other.set_unknowns(self._q)
            M = as_scipy(sector.balloon.mass(sector.balloon.unknowns_of(other), "unit"))
            mass = float(np.vdot(mode.vector, M @ mode.vector).real)
            return self._curvature(sector, mode.vector, 1, other) - mode.value * mass

        return self._finished(
            "eigenvalue",
            "Pa/m",
            mode.value,
            self._reduced(gradient) + plates,
            explicit,
            None,
            evaluate,
            along=(bend, fields),
            harmonic=harmonic,
        )

    def _lowest(self, pencil: GorePencil, harmonic: int) -> GoreMode:
        """The lowest mode that is no rotation which the supports leave free."""
        turns = harmonic == 1 and free_to_rotate(self._balloon)
        for mode in pencil.lowest(harmonic, 1 + turns):
            field = self._sector.displacement(pencil.own, mode.vector)
            if not (turns and is_turn(self._balloon, self.state.displacement, field.real)):
                return mode
        raise EigenError(f"harmonic {harmonic} has no mode beside the rotations; look at another one")

    def _curvature(
        self, sector: GoreSector, vector: ComplexArray, share: float, tied: Balloon | None = None
    ) -> float:
        """phi^H K phi at a multiple of the pressure."""
        balloon = self._balloon if tied is None else tied
        balloon.set_loads(share * self.state.pressure)
        balloon.set_unknowns(self._q)
        loose = sector.balloon
        own = loose.unknowns_of(balloon)
        value = 0.0
        for part in (vector.real, vector.imag):
            direction = own.duplicate()
            direction.array[:] = part
            value += loose.second_variation(own, direction, direction)
        balloon.set_loads(self.state.pressure)
        balloon.set_unknowns(self._q)
        return value

    def _of_plates(self, vector: ComplexArray) -> tuple[Array | None, Array | float]:
        """Of a mode that moves plates: the nodal field of its second order, and phi^H K phi by q of the gas.

        Nodes of a ring that turns move on arcs: the residual's work along their second derivative is part of
        phi^H K phi, and so is the gas on the plate. None and 0 for a mode without plates.
        """
        loose, places = self._sector.balloon, self._sector.plates
        if not places.size or not np.any(vector[places]):
            return None, 0.0
        maps, turned = loose.map, [part[places] for part in (vector.real, vector.imag)]
        _, dw, _ = loose.map.plate_parameters(loose.map.parameters(loose.unknowns_of(self._balloon)))
        arms = maps.ring_of_nodes()
        bend = np.zeros((len(self._balloon.X), 3))
        for k in range(len(self._w) // 6):
            nodes = np.flatnonzero(arms[:, 0] == k)
            _, _, d2R = rotation(self._w[6 * k + 3 : 6 * k + 6])
            for y in turned:
                t = (dw @ y)[6 * k + 3 : 6 * k + 6]
                bend[nodes] += np.einsum("abij,a,b,nj->ni", d2R, t, t, arms[nodes, 1:])
        return bend, self._dw_gas([dw @ y for y in turned])

    def _dw_gas(self, motions: list[Array]) -> Array:
        """Derivative by q of the second variation of what acts on the plates; it is quadratic in w."""
        forces = self._balloon.plate_forces
        found = np.zeros(self._balloon.map.size)
        if forces is None:
            return found
        for j in range(self._dw.shape[1]):
            sides = []
            for sign in (1.0, -1.0):
                hessian = np.zeros((len(self._w), len(self._w)))
                forces.add_to(np.zeros(len(self._w)), hessian, self._w + sign * 1e-2 * self._dw[:, j])
                sides.append(sum(float(m @ hessian @ m) for m in motions))
            found[len(found) - self._dw.shape[1] + j] = (sides[0] - sides[1]) / 2e-2
        return found


def critical_sensitivity(
    state: Equilibrium, harmonic: int, *, rtol: float = 1e-9, most: int = 20
) -> Sensitivity:
    """The critical pressure of a harmonic near a state, with its derivatives.

    Newton's method in the pressure, with the slope of the eigenvalue along the path by the adjoint.

    Args:
        state: of one gore, such as `GorePressures.state`; the nearer the better.
        harmonic: n.
        rtol: to which share of itself the critical pressure is found.
        most: iterations.

    Raises:
        InputError: as `Adjoint`, or an eigenvalue that does not change with the pressure.
        ConvergenceError: no equilibrium at a pressure on the way.
        EigenError: no zero was found.
    """
    for _ in range(most):
        found = Adjoint(state).eigenvalue(harmonic)
        slope = found.by["pressure"] / state.pressure
        if not slope:
            raise InputError(f"the eigenvalue of n = {harmonic} does not change with the pressure here")
        step = -found.value / slope
        if abs(step) <= rtol * state.pressure:
            break
        # no further than to twice or half of it, where the path is another one
        pressure = min(max(state.pressure + step, state.pressure / 2), 2 * state.pressure)
        state = inflate(state.balloon, pressure, start=state, options=NewtonOptions(rtol=1e-11))
    else:
        raise EigenError(
            f"the critical pressure of n = {harmonic} was not found near {state.pressure:.4g} Pa; start at a "
            "state nearer to it, that of critical_pressures say"
        )
    by = {name: -value / slope for name, value in found.by.items() if name != "pressure"}
    pattern: Any = None if found.by_pattern is None else -found.by_pattern / slope
    evaluation = found.evaluation
    return replace(
        found,
        quantity="critical_pressure",
        unit="Pa",
        value=state.pressure,
        by=by,
        by_pattern=pattern,
        evaluation=lambda balloon: -evaluation(balloon) / slope,
    )
