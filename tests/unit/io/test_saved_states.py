"""States, modes and notes on file: every field of every record comes back as it was."""

import json
from dataclasses import asdict, fields, is_dataclass, replace

import numpy as np
import pytest
from states import nodes, unknowns, wavy

from lobefem.app import critical_command
from lobefem.equilibrium.distortions import Tip
from lobefem.equilibrium.energy_ledger import Ledger
from lobefem.equilibrium.gradient_flow import Record
from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.state import Checkpoint, Equilibrium, ideal_state
from lobefem.fem.balloon import Balloon
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.io.checkpoints import load_modes, load_state, save_modes, save_state
from lobefem.io.run_folder import RunFolder
from lobefem.model.cables import Hoops
from lobefem.model.end_plates import EndPlates
from lobefem.model.film import Isotropic
from lobefem.model.fixed_wrinkles import FixedWrinkles
from lobefem.model.gas_pressure import GasPressure
from lobefem.stability.harmonic_buckling import HarmonicPressures
from lobefem.stability.mode_records import Mode
from lobefem.stability.modes import find_modes
from lobefem.stability.perturbation import Point, perturb


def stack(comm, load="film", film=None, bar=True, lobes=2, support="pinned"):
    surface = lobed_cylinder(lobes, (4, 6), comm=comm)
    parts = [GasPressure(load), Hoops(), EndPlates(support, bar=bar)]
    return Balloon(surface, film or FixedWrinkles(), parts, prestressed=True)


def same(one, other):
    """The same to the last digit: arrays, records, tuples of them; nan is nan."""
    if isinstance(one, Balloon):
        return True
    if is_dataclass(one):
        return type(one) is type(other) and not different(one, other)
    if isinstance(one, (tuple, list)):
        return type(one) is type(other) and len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, np.ndarray):
        return np.array_equal(one, other)
    return type(one) is type(other) and (one == other or one != one)


def different(one, other):
    """Names of the fields in which two records differ."""
    return [f.name for f in fields(one) if not same(getattr(one, f.name), getattr(other, f.name))]


def marked(record, seed=0):
    """The record with another value in each of its plain fields, all of them unlike."""
    rng = np.random.default_rng(seed)
    change = {}
    for one in fields(record):
        value = getattr(record, one.name)
        if isinstance(value, bool):
            change[one.name] = not value
        elif isinstance(value, int):
            change[one.name] = int(rng.integers(100, 1000))
        elif isinstance(value, float) or value is None:
            change[one.name] = float(rng.uniform(1, 2))
        elif isinstance(value, complex):
            change[one.name] = complex(*rng.uniform(1, 2, 2))
        elif isinstance(value, str):
            change[one.name] = f"the {one.name}, \u00b5"
        elif isinstance(value, tuple):
            change[one.name] = tuple(
                type(v)(x) for v, x in zip(value, rng.integers(1, 9, len(value)), strict=True)
            )
        elif is_dataclass(value) and not isinstance(value, Balloon):
            change[one.name] = marked(value, seed + 1)
    return replace(record, **change)


class Placed:
    """A state whose displacement is given."""

    def __init__(self, state, displacement):
        self.balloon, self.pressure, self.prestress = state.balloon, state.pressure, state.prestress
        self.vector, self.displacement = state.vector, displacement


# --- states -------------------------------------------------------------------------------------


def test_a_state_keeps_its_pressure_and_its_built_in_stress_apart(comm, shared_path):
    balloon = stack(comm)
    state = inflate(balloon, 50.0, prestress=5.0)
    save_state(shared_path / "state.npz", state)
    again = load_state(shared_path / "state.npz", stack(comm))
    assert (again.pressure, again.prestress) == (50.0, 5.0)
    found = inflate(again.balloon, 50.0, prestress=5.0, start=again)
    assert found.iterations == 0
    assert found.volume == pytest.approx(state.volume, rel=1e-12)


@pytest.mark.parametrize("support", ["pinned", "clamped", "fixed"])
@pytest.mark.parametrize("bar", [True, 3e6, False])
def test_every_unknown_is_kept(comm, shared_path, support, bar):
    balloon = stack(comm, bar=bar, support=support)
    q = unknowns(balloon, 0.1 * wavy(nodes(balloon), 3), np.linspace(0.01, 0.05, balloon.map.num_parameters))
    balloon.set_unknowns(q)
    state = Checkpoint(balloon, 3.0, -2.0, q.array_r.copy())
    moved = balloon.u.x.array.reshape(-1, 3).copy()
    extra = {"one": moved * 2, "other": moved[:, ::-1].copy()}
    notes = {
        "number": 0.1 + 0.2,
        "none": None,
        "text": "\u00b5",
        "list": [1, [2.5, True]],
        "table": {"a": {"b": 1}},
    }
    save_state(shared_path / "state.npz", Placed(state, moved), notes, extra)
    again = load_state(shared_path / "state.npz", stack(comm, bar=bar, support=support))
    assert (again.pressure, again.prestress, again.notes) == (3.0, -2.0, notes)
    np.testing.assert_array_equal(again.unknowns, state.unknowns)
    assert set(again.fields) == {"one", "other"}
    for name, field in extra.items():
        np.testing.assert_array_equal(again.fields[name], field)


# --- modes --------------------------------------------------------------------------------------


def test_every_field_of_a_state_and_its_modes_is_kept(comm, shared_path):
    balloon = stack(comm, lobes=1)
    state = inflate(balloon, 50.0, prestress=5.0)
    modes = find_modes(state, 4).modes
    notes = {"entry": [1.5, None]}
    save_modes(shared_path / "modes.npz", state, modes, notes)
    again, found, kept = load_modes(shared_path / "modes.npz", stack(comm, lobes=1))
    assert kept == notes
    assert type(again) is Equilibrium
    assert comm.allreduce(different(state, again)) == []
    assert len(found) == len(modes)
    for one, other in zip(modes, found, strict=True):
        assert comm.allreduce(different(one, other)) == []


def test_every_field_is_kept_whatever_it_holds(comm, shared_path):
    """No field is computed anew or put into another's place: each has a value of its own."""
    balloon = stack(comm)
    state = inflate(balloon, 50.0)
    changed = marked(state)
    arrays = {
        f.name: getattr(state, f.name)
        for f in fields(state)
        if isinstance(getattr(state, f.name), np.ndarray)
    }
    changed = replace(changed, **arrays)
    assert set(different(state, changed)) == {f.name for f in fields(state)} - {"balloon", *arrays}
    modes = [marked(mode, k) for k, mode in enumerate(find_modes(state, 3).modes)]
    save_modes(shared_path / "modes.npz", changed, modes, {})
    again, found, _ = load_modes(shared_path / "modes.npz", stack(comm))
    pairs = [(changed, again), *zip(modes, found, strict=True)]
    assert comm.allreduce([different(*pair) for pair in pairs]) == [[]] * len(pairs) * comm.size
    for missing in ("bar_force", "strain_energy"):
        save_modes(shared_path / "modes.npz", replace(changed, **{missing: None}), modes, {})
        assert getattr(load_modes(shared_path / "modes.npz", balloon)[0], missing) is None


def test_complex_pairs_are_kept_with_their_own_vectors(comm, shared_path):
    balloon = stack(comm, lobes=1, support="clamped")
    modes = find_modes(ideal_state(balloon, 1000.0), 4)
    assert modes[0].value.imag > 0
    save_modes(shared_path / "modes.npz", modes.state, modes.modes, {})
    _, again, _ = load_modes(shared_path / "modes.npz", stack(comm, lobes=1, support="clamped"))
    assert [m.value for m in again] == [m.value for m in modes.modes]
    for one, other in zip(modes.modes, again, strict=True):
        np.testing.assert_array_equal(other.displacement, one.displacement)
        np.testing.assert_array_equal(other.displacement_imag, one.displacement_imag)
    assert np.abs(modes[0].displacement_imag).max(initial=0.0) > 0


def test_every_field_of_a_mode_is_kept_or_made_a_field(comm):
    """A field that is added to a record must be kept, too."""
    from lobefem.io import checkpoints

    assert {*checkpoints._MODE, "value", "displacement", "displacement_imag", "points"} == {
        f.name for f in fields(Mode)
    }
    assert {*checkpoints._OWN, *checkpoints._MEASURED} == {f.name for f in fields(Equilibrium)}


# --- notes of runs that go on -------------------------------------------------------------------

LEDGER = marked(Ledger())
POINT = marked(Point(0.0, 0.0, 0.0, 0.0, 0.0, None, None, 0.0, LEDGER))
RECORD = marked(Record(0, *(0.0,) * 2, 0.0, 0, *(0.0,) * 5, (0.0,) * 3, (0.0,) * 3, LEDGER))


def test_a_resumed_study_has_every_field_of_its_history(comm, shared_path):
    balloon, kept = stack(comm, "closed", Isotropic(), lobes=1, support="clamped"), []
    perturb(balloon, 5.0, Tip(0.02), steps=2, keep=lambda *given: kept.append(given))
    state, notes = kept[1]
    # of the last one the ramp goes on; what was before it nothing reads but the report
    history = [asdict(POINT), *notes["history"][1:]]
    save_state(shared_path / "kept.npz", state, notes | {"history": history})
    resume = load_state(shared_path / "kept.npz", balloon)
    again = perturb(balloon, 5.0, Tip(0.02), steps=2, resume=resume)
    assert different(again.history[0], POINT) == []


@pytest.mark.parametrize("top", [(1.0, 2.0, 3.0), None])
def test_every_field_of_a_record_of_motion_is_kept(top):
    from lobefem.stability.perturbation import _record

    record = replace(RECORD, top=top)
    assert different(_record(json.loads(json.dumps(asdict(record)))), record) == []


def test_every_field_of_a_chart_is_kept(comm, shared_path, monkeypatch):
    """By a mesh study that was stopped: infinite pressures and residuals that there are none of, too."""
    charts = tuple(
        HarmonicPressures((0, 2, 3), (np.inf, 20.5, 0.0), ("", "local", ""), (np.nan, 1e-9, np.nan), mesh, 4)
        for mesh in ((6, 8), (9, 12), (12, 16))
    )
    folder = RunFolder(shared_path / "run", comm)
    folder.begin("")

    class Stopped(Exception):  # noqa: N818  no error
        pass

    def study(balloon, divisions, *, known, keep, **options):
        assert known == []
        for chart in charts:
            keep(chart)
        raise Stopped

    from lobefem.io.design import Design

    monkeypatch.setattr(critical_command, "study_meshes", study)
    with pytest.raises(Stopped):
        critical_command.mesh_study(Design(), comm=comm, folder=folder)
    again = RunFolder(shared_path / "run", comm, resume=True)
    again.begin("")

    def look(balloon, divisions, *, known, keep, **options):
        assert [different(*pair) for pair in zip(charts, known, strict=True)] == [[]] * 3
        raise Stopped

    monkeypatch.setattr(critical_command, "study_meshes", look)
    with pytest.raises(Stopped):
        critical_command.mesh_study(Design(), comm=comm, folder=again)
