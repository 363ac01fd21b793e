"""A large perturbation from beginning to end (paper sec. 6): pressurise, distort, release.

Each accepted step of the ramp and of the release can be kept by the caller, as a state of the free
balloon with plain notes; a run that was stopped goes on from there and ends where it would have ended.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from lobefem.display import Summarized, Summary, number
from lobefem.equilibrium.displacement_control import distort, release_start
from lobefem.equilibrium.distortions import Distortion, require_distortion
from lobefem.equilibrium.energy_ledger import Ledger
from lobefem.equilibrium.gradient_flow import Record
from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.ramp import Increment
from lobefem.equilibrium.solver_options import FlowOptions
from lobefem.equilibrium.state import Checkpoint, Equilibrium, State, require_whole
from lobefem.errors import ConvergenceError, InputError
from lobefem.fem.balloon import Balloon
from lobefem.geometry.axis import across
from lobefem.model.film import require_energy
from lobefem.progress import plain
from lobefem.stability.relaxation import Released, release
from lobefem.typing import Array, Vec

__all__ = ["Perturbed", "Point", "perturb"]

Keep = Callable[[State, Mapping[str, Any]], None]


@dataclass(frozen=True)
class Point:
    """One accepted step of the ramp or of the release.

    Attributes:
        parameter: of the distortion [m or rad]; that of the ramp's end in a release.
        reaction: force that holds the distortion [N or N m]; 0 in a release.
        volume: enclosed [m^3].
        mid_hoop_displacement: sideways, of the middle hoop's centre or of an equator's [m].
        contact_force: [N].
        gap: smallest distance between parts of the film that share no node [m]; None without contact.
        time: in the release [s]; None in the ramp.
        residual: over the norm of the pressure's nodal forces.
        ledger: where the energy went since the pressurised balloon.
    """

    parameter: float
    reaction: float
    volume: float
    mid_hoop_displacement: float
    contact_force: float
    gap: float | None
    time: float | None
    residual: float
    ledger: Ledger


@dataclass(frozen=True, repr=False)
class Perturbed(Summarized):
    """The result of a distortion and its release.

    Attributes:
        distortion: what was imposed.
        original: the pressurised equilibrium.
        imposed: the distorted one; None where a resumed run found it passed.
        released: the release, None where there was none.
        history: all accepted steps, of earlier runs too.
    """

    distortion: Distortion
    original: Equilibrium = field(repr=False)
    imposed: Equilibrium | None = field(repr=False)
    released: Released | None
    history: tuple[Point, ...] = field(repr=False)

    def _summary(self) -> Summary:
        end, kind = self.ramp[-1], self.distortion
        rows = [
            ("volume, original", number(self.original.volume, "m^3")),
            ("volume, distorted", number(end.volume, "m^3")),
            ("reaction", number(end.reaction, kind.reaction_unit)),
            ("first contact", number(self.first_contact, kind.unit)),
        ]
        outcome = "held"
        if self.released is not None:
            outcome = f"released: {self.released.outcome}"
            rows.append(("evidence", self.released.reason))
        return Summary(f"{kind.kind} of {kind.parameter:.4g} {kind.unit}, {outcome}", tuple(rows))

    @property
    def ramp(self) -> tuple[Point, ...]:
        """The steps of the ramp."""
        return tuple(p for p in self.history if p.time is None)

    @property
    def first_contact(self) -> float | None:
        """Parameter at which the ramp brought the film into contact [m or rad], None without contact.

        Where the smallest gap reached the activation distance, interpolated between two steps.
        """
        contact = self.original.balloon.contact
        k = next((k for k, p in enumerate(self.ramp) if p.contact_force > 0), None)
        if k is None or contact is None:
            return None
        last, here = self.ramp[max(k - 1, 0)], self.ramp[k]
        if last.gap is None or here.gap is None or last.gap <= here.gap:
            return here.parameter
        share = min(max((last.gap - contact.activation) / (last.gap - here.gap), 0.0), 1.0)
        return last.parameter + share * (here.parameter - last.parameter)


def perturb(
    balloon: Balloon,
    pressure: float,
    distortion: Distortion,
    *,
    let_go: bool = False,
    steps: int = 20,
    damping: float = 1.0,
    original: Equilibrium | None = None,
    resume: Checkpoint | None = None,
    keep: Keep | None = None,
    progress: Callable[[str], None] | None = None,
) -> Perturbed:
    """Pressurise a balloon, distort it by a ramp, and release it if asked to.

    Args:
        balloon: without constraints.
        pressure: of the gas [Pa].
        distortion: what to impose.
        let_go: whether to release it at the end of the ramp.
        steps: increments of the ramp.
        damping: of the release, see `lobefem.stability.relaxation`.
        original: the pressurised balloon; by default `inflate` finds it. Of all gores of a pumpkin give that
            of `full_state`, in which all are alike.
        resume: what `keep` was last given in a run that was stopped.
        keep: called on all ranks after each accepted step, with a state of the free balloon and notes;
            its shape is that of notes["history"][notes["point"]].
        progress: called with a line of text now and then.

    Raises:
        InputError: the balloon cannot be distorted so, its film has no energy, or `resume` is of another
            study.
        ConvergenceError: no equilibrium; its `state` is the last one, and in a ramp `data` holds the
            `points` up to there.

    Collective.
    """
    require_whole(balloon)
    require_energy(balloon.film)
    require_distortion(distortion)
    study = {
        "distortion": repr(distortion),
        "pressure": pressure,
        "steps": steps,
        "damping": damping,
        "release": let_go,
        "contact": balloon.contact is not None,
    }
    notes = {} if resume is None else resume.notes
    if resume is not None and notes.get("study") != study:
        raise InputError(
            f"the run to go on with is of another study, {_said(notes.get('study'))}; repeat its options, or "
            "start afresh without --resume"
        )
    if original is None:
        original = inflate(balloon, pressure, progress=plain(progress))
    try:
        log = _Log(original, study, notes, keep)
    except (TypeError, KeyError, ValueError, AttributeError) as error:
        raise InputError(
            f"the notes of the run to go on with are damaged ({error}); start afresh without --resume"
        ) from None
    imposed: Equilibrium | None = None
    start: Any = resume
    if notes.get("phase") != "release":
        # the time left of the ramp is not that of the study where a release follows, whose nobody knows
        imposed = log.ramp(distortion, resume, steps, plain(progress) if let_go else progress)
        start = release_start(imposed)
    released = None
    if let_go:
        log.parameter = distortion.parameter
        released = release(
            start,
            undistorted=original,
            options=FlowOptions(damping=damping),
            ledger=next(p.ledger for p in reversed(log.history) if p.time is None),
            history=log.records,
            on_step=log.moved,
            progress=progress,
        )
    return Perturbed(distortion, original, imposed, released, tuple(log.history))


def _said(study: Any) -> str:
    return ", ".join(f"{k} = {v}" for k, v in study.items()) if isinstance(study, dict) else "without notes"


class _Log:
    """The record of a study, step by step."""

    def __init__(
        self, original: Equilibrium, study: Mapping[str, Any], notes: Mapping[str, Any], keep: Keep | None
    ) -> None:
        self.original, self.balloon, self.study, self.keep = original, original.balloon, study, keep
        self.history = [Point(**(p | {"ledger": Ledger(**p["ledger"])})) for p in notes.get("history", ())]
        self.records = [_record(r) for r in notes.get("records", ())]
        self.parameter = float(notes.get("parameter", 0.0))
        self._base = self.history[-1].ledger if self.history else Ledger()
        self._plates: tuple[Array, Array] | None = None
        self._dead = _dead_work(original)
        self._seen = len(self.records)

    # --- ramp -----------------------------------------------------------------------------------

    def ramp(
        self, distortion: Distortion, resume: Checkpoint | None, steps: int, progress: Any
    ) -> Equilibrium:
        """The equilibrium at the ramp's end."""
        start: Any = self.original
        begin = None
        if resume is not None:
            start, begin = resume, self.parameter
            self._plates = self._plates_of(self.balloon, resume.vector())
            if distortion.parameter:
                left = 1 - begin / distortion.parameter
                steps = max(math.ceil(steps * left - 1e-9), 1)
        try:
            done = distort(
                start,
                distortion,
                begin=begin,
                steps=steps,
                first=1 / 8,
                on_step=self._ramped,
                progress=progress,
            )
        except ConvergenceError as error:
            error.data["points"] = tuple(self.history)
            raise
        return done.state

    def _ramped(self, increment: Increment, state: Equilibrium) -> None:
        balloon, last = state.balloon, self.history[-1] if self.history else None
        plates = self._plates_of(balloon, state.vector())
        if last is not None and math.isclose(last.parameter, increment.parameter, abs_tol=1e-15):
            self._plates = plates  # a resumed ramp begins with the step that was kept
            return
        contact = balloon.contact.measure(balloon.u) if balloon.contact is not None else None
        before = last.volume if last is not None else self.original.volume
        gas = self._gas(before, increment.volume - before, plates)
        strain = (state.strain_energy or 0.0) - (self.original.strain_energy or 0.0)
        dead = _dead_work(state) - self._dead
        ledger = Ledger(
            strain=strain,
            contact=contact.energy if contact is not None else 0.0,
            pressure=(last.ledger.pressure if last is not None else 0.0) + gas,
            constraint=self._base.constraint + increment.work + dead,
            damping=self._base.damping + increment.damping,
        )
        self.parameter, self._plates = increment.parameter, plates
        self.history.append(
            Point(
                parameter=increment.parameter,
                reaction=increment.reaction,
                volume=increment.volume,
                mid_hoop_displacement=increment.mid_hoop_displacement,
                contact_force=contact.force if contact is not None else 0.0,
                gap=contact.gap if contact is not None else None,
                time=None,
                residual=increment.residual,
                ledger=ledger,
            )
        )
        self._keep(release_start(state) if self.keep is not None else None, "ramp", len(self.history) - 1)

    def _gas(self, before: float, gained: float, plates: tuple[Array, Array]) -> float:
        """Work of the gas over a step; what `film` load leaves out on the plates by the trapezoid rule."""
        balloon = self.balloon
        if balloon.load.convention == "film":
            old = self._plates or self._plates_of(balloon, self.original.vector())
            gained -= float(((old[0] + plates[0]) / 2 * (plates[1] - old[1])).sum())
        return balloon.gas_work(before, gained)

    @staticmethod
    def _plates_of(balloon: Balloon, q: Vec) -> tuple[Array, Array]:
        """Area vectors and displacements of the plates (2, 3). Collective."""
        if balloon.motion is None:
            return np.zeros((2, 3)), np.zeros((2, 3))
        w = balloon.map.plate_parameters(balloon.map.parameters(q))[0][:12]
        return balloon.motion.turned_area_vectors(w), w.reshape(2, 6)[:, :3]

    # --- release --------------------------------------------------------------------------------

    def moved(self, record: Record, before: State) -> None:
        """Write down a step of the release, at whose end the balloon is."""
        if record.number < self._seen:
            return  # the step that a resumed release takes again
        if record.number >= len(self.records):
            self.records.append(record)
        self._seen = record.number + 1
        balloon = self.balloon
        contact = balloon.contact.measure(balloon.u) if balloon.contact is not None else None
        sideways = across(balloon.axis.direction)[0]
        if record.number:
            self.history.append(
                Point(
                    parameter=self.parameter,
                    reaction=0.0,
                    volume=record.volume,
                    mid_hoop_displacement=float(np.asarray(record.middle) @ sideways),
                    contact_force=contact.force if contact is not None else 0.0,
                    gap=contact.gap if contact is not None else None,
                    time=record.time,
                    residual=record.relative_residual,
                    ledger=record.ledger,
                )
            )
        # the step began where the one before ended
        self._keep(before, "release", len(self.history) - (2 if record.number else 1))

    def _keep(self, state: State | None, phase: str, point: int) -> None:
        if self.keep is None or state is None:
            return
        notes = {
            "study": dict(self.study),
            "phase": phase,
            "point": point,
            "parameter": self.parameter,
            "history": [asdict(p) for p in self.history],
            "records": [asdict(r) for r in self.records],
        }
        self.keep(state, notes)


def _dead_work(state: Equilibrium) -> float:
    """Work of dead loads, weight and gradient from the reference shape to a state [J]. Collective."""
    state.restore()
    return state.balloon.dead_work()


def _record(data: Mapping[str, Any]) -> Record:
    top = data["top"]
    middle: Any = tuple(data["middle"])
    return replace(
        Record(**{**data, "ledger": Ledger(**data["ledger"])}),
        middle=middle,
        top=None if top is None else tuple(top),
    )
