"""Perturbations from the pressurised balloon to its rest, and runs that were stopped."""

import json
from pathlib import Path

import builders
import numpy as np
import pytest
from PIL import Image

from lobefem import cli
from lobefem.contact import SelfContact
from lobefem.design import Design
from lobefem.distortions import Bend, Tip
from lobefem.errors import InputError
from lobefem.films import TensionField
from lobefem.frames import load_frames
from lobefem.perturbation import perturb
from lobefem.pictures import save_picture
from lobefem.states import load_state, save_state

MESHES = Path(__file__).parents[2] / "meshes"
STACK = [
    "perturb", str(MESHES / "stack4.toml"), "--film", "tension-field", "--pressure", "5",
    "--divisions", "6x8", "--lobes", "2", "--load", "closed",
]  # fmt: skip


def stack(load="closed", support="pinned", contact=False):
    parts = [SelfContact()] if contact else []
    mesh = {"divisions": (6, 8)}
    return builders.stack(
        film=TensionField(), load=load, support=support, parts=parts, prestressed=True, **mesh
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("load", "support"), [("closed", "pinned"), pytest.param("film", "clamped", marks=pytest.mark.serial)]
)
def test_a_bent_stack_returns_and_its_ledger_closes(load, support):
    found = perturb(stack(load, support, contact=True), 5.0, Bend(6.0), let_go=True, steps=12)
    assert found.released.outcome == "returned"
    assert found.released.state.volume == pytest.approx(found.original.volume, rel=1e-8)
    assert found.ramp[-1].volume < 0.99 * found.original.volume
    assert found.first_contact is None
    assert min(p.gap for p in found.history) > 0
    times = [p.time for p in found.history if p.time is not None]
    assert times == sorted(times)
    end = found.history[-1].ledger
    assert end.error < 0.01
    assert end.constraint > 0
    if load == "closed":  # all that was put in; `film` load works on the tilting plates, too
        assert end.damping == pytest.approx(end.constraint, rel=0.02)


class Stopped(Exception):  # noqa: N818  no error
    """What ends a run early."""


@pytest.fixture(scope="module")
def whole():
    """A study that nothing stops; clamped: a pinned stack may come to rest turned, at no cost in energy."""
    return perturb(stack(support="clamped"), 5.0, Bend(6.0), let_go=True, steps=4)


@pytest.mark.slow
@pytest.mark.parametrize("stop", [2, 12, *(pytest.param(n, marks=pytest.mark.serial) for n in (5, 20))])
def test_a_stopped_study_goes_on_and_ends_alike(whole, shared_path, stop):
    file, count = shared_path / "kept.npz", 0

    def keep(state, notes):
        nonlocal count
        save_state(file, state, notes)
        count += 1
        if count == stop:
            raise Stopped

    with pytest.raises(Stopped):
        perturb(stack(support="clamped"), 5.0, Bend(6.0), let_go=True, steps=4, keep=keep)
    balloon = stack(support="clamped")
    resume = load_state(file, balloon)
    assert resume.notes["phase"] == ("ramp" if stop < 8 else "release")
    again = perturb(balloon, 5.0, Bend(6.0), let_go=True, steps=4, resume=resume)
    assert again.released.outcome == whole.released.outcome
    assert (
        np.abs(again.released.state.displacement - whole.released.state.displacement).max(initial=0.0) < 1e-6
    )
    assert again.history[-1].ledger.error < 0.05
    numbers = [p.time for p in again.history if p.time is not None]
    assert len(set(numbers)) == len(numbers)  # no step is there twice


def test_only_the_same_study_goes_on(shared_path):
    file = shared_path / "kept.npz"
    balloon = stack()

    def keep(state, notes):
        save_state(file, state, notes)
        raise Stopped

    with pytest.raises(Stopped):
        perturb(balloon, 5.0, Tip(0.1), steps=4, keep=keep)
    resume = load_state(file, balloon)
    with pytest.raises(InputError, match=r"another study, distortion = Tip\(displacement=0.1\)"):
        perturb(balloon, 5.0, Tip(0.2), steps=4, resume=resume)


@pytest.mark.slow
def test_the_command(capfd, shared_path, comm):
    folder = shared_path / "run"
    code = cli.main([*STACK, "--bend", "4", "--steps", "6", "--release", "--out", str(folder), "--json", "-"])
    printed = comm.bcast(capfd.readouterr().out, root=0)
    results = json.loads(printed)
    assert code == 0
    assert results["outcome"] == "returned"
    assert results["volume_final"] == pytest.approx(results["volume_original"], rel=1e-8)
    assert results["volume_imposed"] < results["volume_original"]
    assert results["min_eigenvalue"] > 0
    assert results["residual"] < 1e-7
    assert results["first_contact"] is None
    ramp = [row for row in results["history"] if row["time"] is None]
    assert ramp[-1]["parameter"] == pytest.approx(4.0)
    assert [row["reaction"] for row in results["history"] if row["time"]][-1] == 0
    assert set(results["energy"]) >= {"pressure", "strain", "contact", "damping", "constraint", "closure"}
    if comm.rank == 0:
        assert (folder / "history.png").stat().st_size > 20_000
        assert (folder / "checkpoint.npz").exists()
        save_picture(folder, "release", folder / "release.gif", width=40)
        kept = load_frames(folder)
        assert {0, len(ramp) - 1, len(results["history"]) - 1} <= set(kept.points)
        sizes = [np.linalg.norm(u, axis=1).max() for u in kept.displacements]
        assert int(np.argmax(sizes)) == kept.points.index(len(ramp) - 1)
        assert sizes[-1] < 1e-3 * max(sizes)
        with Image.open(folder / "release.gif") as image:
            assert image.n_frames >= len(kept.points)
    # a run that is complete goes on to the same end at once
    code = cli.main(
        [*STACK, "--bend", "4", "--steps", "6", "--release", "--out", str(folder), "--resume", "--json", "-"]
    )
    again = json.loads(comm.bcast(capfd.readouterr().out, root=0))
    assert code == 0
    assert again["volume_final"] == pytest.approx(results["volume_final"], rel=1e-9)
    assert again["volume_imposed"] == results["volume_imposed"]


@pytest.mark.slow
def test_the_state_that_a_distortion_ends_at_can_be_read_back(capfd, shared_path, comm):
    folder = shared_path / "run"
    arguments = [*STACK, "--tip-displacement", "0.05", "--steps", "2", "--out", str(folder), "--json", "-"]
    assert cli.main(arguments) == 0
    results = json.loads(comm.bcast(capfd.readouterr().out, root=0))
    design = Design.load(folder / "design.toml", comm)
    balloon = design.balloon(design.surface(comm), prestressed=True)
    state = load_state(folder / "state.npz", balloon)
    balloon.set_loads(state.pressure, state.prestress)
    balloon.place(state.vector())
    assert balloon.volume() == pytest.approx(results["volume_imposed"], rel=1e-12)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "perturb takes one distortion, not 0; give one of --tip-displacement"),
        (("--bend", "5", "--twist", "3"), "perturb takes one distortion, not 2"),
        (("--bend", "x"), "--bend: 'x' is not a"),
        (("--bend", "95"), "half-angle is 95"),
        (("--wave", "2"), "--wave: '' is not a length"),
        (("--wave", "x:0.1"), "--wave: 'x' is impossible; give an integer"),
        (("--tip-displacement", "0"), "distorts nothing"),
        (("--tip-displacement", "0.1", "--damping", "0"), "--damping: '0' is no positive number"),
        (("--bend", "5", "--resume"), "--resume goes on with the run in --out"),
    ],
)
def test_bad_input_gets_one_sentence(capfd, comm, arguments, message):
    assert cli.main([*STACK, *arguments]) == 2
    words = comm.bcast(capfd.readouterr().err, root=0)
    assert message in words
    assert words.count("\n") == 1
