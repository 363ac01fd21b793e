"""Designs of a search: each solved once, with its quantities and their derivatives, and kept in a file."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from lobefem.app.search_file import Search
from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.solver_options import NewtonOptions
from lobefem.equilibrium.state import Equilibrium
from lobefem.errors import InputError, SolveError
from lobefem.fem.functionals import stiffness_scale
from lobefem.files import plain, replace
from lobefem.io.design import Design
from lobefem.io.pumpkin_design import masses
from lobefem.stability.cell_stresses import stress_norm
from lobefem.stability.gore_buckling import critical_pressures
from lobefem.stability.modes import find_modes
from lobefem.stability.sensitivities import Adjoint, critical_sensitivity
from lobefem.stability.sensitivity_record import Sensitivity
from lobefem.typing import Array
from lobefem.version import __version__

__all__ = ["Record", "Solved"]

_FIRST = 0.05  # of the highest pressure, where the path of states begins
_KEY = 1e-6  # of the range of a parameter, half of the way between two balloons


class Record(NamedTuple):
    """Record of a design that was looked at.

    Attributes:
        name: of its files.
        choice: index of the choice.
        x: parameters (parameters,) [SI].
        values: quantities [SI]; critical pressures by harmonic are "p_3", ...
        gradients: of each by the parameters (parameters,), None where they were not asked for.
        fault: why there are none, or empty.
    """

    name: str
    choice: int
    x: tuple[float, ...]
    values: Mapping[str, float]
    gradients: Mapping[str, Array] | None
    fault: str = ""


class Solved:
    """Designs of a search, kept in a folder.

    Args:
        search: what to vary.
        folder: of the files, which exists.
    """

    def __init__(self, search: Search, folder: Path) -> None:
        self._search, self._folder = search, folder
        self.records: dict[str, Record] = {}
        self._last: tuple[str, _Point] | None = None

    def __call__(self, choice: int, x: Array, *, gradients: bool = False) -> Record:
        """The record of a design, solved if it is not known."""
        search = self._search
        x = np.clip(x, search.low, search.high)
        try:
            design = search.design(search.choices[choice], x)
        except InputError as error:
            return Record("", choice, tuple(map(float, x)), {}, None, str(error))
        what = (__version__, design.to_toml(), str(search.harmonics), f"{search.search_to!r}")
        name = hashlib.sha256("\0".join(what).encode()).hexdigest()[:16]
        record = self.records.get(name) or self._read(name, choice, x)
        if record is None or (gradients and record.gradients is None and not record.fault):
            record = self._solve(name, choice, x, design, record, gradients)
            self._write(record, design)
        self.records[name] = record
        return record

    def _read(self, name: str, choice: int, x: Array) -> Record | None:
        try:
            found = json.loads((self._folder / f"{name}.json").read_text(encoding="utf-8"))
            gradients = found["gradients"]
            if gradients is not None:
                gradients = {key: np.array(value) for key, value in gradients.items()}
            return Record(name, choice, tuple(map(float, x)), found["values"], gradients, found["fault"])
        except (OSError, ValueError, KeyError, TypeError):
            return None

    def _write(self, record: Record, design: Design) -> None:
        known = record.gradients
        data = {
            "choice": dict(self._search.choices[record.choice]),
            "parameters": dict(zip(self._search.names, record.x, strict=True)),
            "values": record.values,
            "gradients": None if known is None else {key: value.tolist() for key, value in known.items()},
            "fault": record.fault,
        }
        replace(self._folder / f"{record.name}.toml", design.to_toml())
        replace(self._folder / f"{record.name}.json", json.dumps(plain(data), indent=2) + "\n")

    def _solve(
        self, name: str, choice: int, x: Array, design: Design, known: Record | None, gradients: bool
    ) -> Record:
        try:
            kept = self._last
            point = kept[1] if kept is not None and kept[0] == name else _Point(self._search, design)
            self._last = name, point
            values = point.values() if known is None else known.values
            found = point.gradients(self._search.choices[choice], x) if gradients else None
        except (SolveError, InputError) as error:
            return Record(name, choice, tuple(map(float, x)), {}, None, str(error))
        return Record(name, choice, tuple(map(float, x)), values, found)


class _Point:
    """A design with its balloon of one gore, its state at the design's pressure and its critical states."""

    def __init__(self, search: Search, design: Design) -> None:
        self._search, self._design = search, design
        self.balloon = design.balloon(design.surface(sector=True))
        (pressure,) = design.pressure.value
        self._state = inflate(self.balloon, pressure, options=NewtonOptions(rtol=1e-10))
        self._critical: dict[int, tuple[float, Equilibrium | None]] = {}

    def values(self) -> dict[str, float]:
        """All quantities [SI]."""
        state, search = self._state, self._search
        found = {
            "volume": state.volume,
            "mass": masses(self._design, self.balloon),
            "max_stress": state.max_stress().value,
            "stress_norm": stress_norm(self.balloon),
            "tendon_tension": state.hoop_tension[0],
        }
        if not search.harmonics:
            return found
        self._search_path()
        found |= {f"p_{n}": self._critical[n][0] for n in search.harmonics}
        return found | {"critical_pressure": min(found[f"p_{n}"] for n in search.harmonics)}

    def _search_path(self) -> None:
        """Critical pressure of each harmonic, with a state there.

        Where a harmonic is stable up to the highest pressure it is that one; where it is unstable at the
        first one, p_1 exp(lambda sqrt(A)/p_1), which goes on smoothly below p_1.
        """
        search, first = self._search, _FIRST * self._search.search_to
        begin = inflate(self.balloon, first, options=NewtonOptions(rtol=1e-10))
        path = critical_pressures(begin, search.harmonics, up_to=search.search_to, growth=2.0, rtol=1e-5)
        for n in search.harmonics:
            p = path[n]
            if p is None:
                self._critical[n] = path.searched_to, None
            elif p == 0.0:
                value = find_modes(begin, 1, harmonics=[n]).lowest
                exponent = value / stiffness_scale(self.balloon, first)
                self._critical[n] = first * math.exp(max(exponent, -20.0)), begin
            else:
                self._critical[n] = (
                    p,
                    inflate(self.balloon, p, start=path.state or begin, options=NewtonOptions(rtol=1e-11)),
                )

    def _sensitivities(self) -> dict[str, tuple[Sensitivity, float] | None]:
        """Sensitivities, and by what their derivatives are multiplied; None of what does not change."""
        adjoint = Adjoint(self._state)
        found: dict[str, tuple[Sensitivity, float] | None] = {
            "volume": (adjoint.volume(), 1.0),
            "stress_norm": (adjoint.stress_norm(), 1.0),
            "tendon_tension": (adjoint.tendon_tension(), 1.0),
        }
        if self._search.harmonics and not self._critical:
            self._search_path()
        for n, (p, state) in self._critical.items():
            if state is None:
                found[f"p_{n}"] = None
            elif state.pressure == p:
                found[f"p_{n}"] = critical_sensitivity(state, n, rtol=1e-3), 1.0
            else:
                scale = p / stiffness_scale(self.balloon, state.pressure)
                found[f"p_{n}"] = Adjoint(state).eigenvalue(n), scale
        return found

    def gradients(self, choice: Mapping[str, Any], x: Array) -> dict[str, Array]:
        """Derivatives of all quantities by the parameters (parameters,), each from two balloons, none solved.

        Half-widths, too: by the pattern alone the stress would keep the weights of its cells' means.
        """
        search = self._search
        sensitivities = self._sensitivities()
        found: dict[str, Array] = {name: np.zeros(search.size) for name in (*sensitivities, "mass")}
        for k in range(search.size):
            step = _KEY * (search.high[k] - search.low[k])
            sides = [x.copy(), x.copy()]
            sides[0][k] -= step
            sides[1][k] += step
            low, high = (search.design(choice, side) for side in sides)
            balloons = [side.balloon(side.surface(sector=True)) for side in (low, high)]
            for name, one in sensitivities.items():
                if one is not None:
                    found[name][k] = one[1] * one[0].between(balloons[0], balloons[1]) / (2 * step)
            found["mass"][k] = (masses(high, balloons[1]) - masses(low, balloons[0])) / (2 * step)
        return found
