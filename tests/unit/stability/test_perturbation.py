"""Perturbations from the pressurised balloon to its rest, and runs that were stopped."""

import json
from pathlib import Path

import builders
import numpy as np
import pytest
from PIL import Image

from lobefem.app import cli, perturb_command
from lobefem.equilibrium.distortions import Bend, Tip
from lobefem.errors import EigenError, InputError
from lobefem.io.checkpoints import load_state, save_state
from lobefem.io.design import Design
from lobefem.io.run_reader import load_run
from lobefem.model.self_contact import SelfContact
from lobefem.model.tension_field import TensionField
from lobefem.stability import relaxation as release_module
from lobefem.stability.perturbation import perturb
from lobefem.viz.frames import load_frames
from lobefem.viz.run_pictures import save_picture
from lobefem.viz.verdict import verdict

MESHES = Path(__file__).parents[3] / "meshes"
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


def test_the_papers_stack_of_sec_6_resists_and_fixed_wrinkles_say_that_they_do_not(lobefem_json):
    """Tip of two of its lobes: IMP with the load path's stress, and film that can neither shear nor fold."""
    push = ["perturb", MESHES / "stack5.toml", "--lobes", "2", "--divisions", "6x10", "--steps", "8"]
    push += ["--tip-displacement", "0.05", "--no-contact"]
    own, code = lobefem_json(*push)
    assert (code, own["warnings"]) == (0, [])
    assert (own["film"], own["load"], own["support"]) == ("imp", "film", "clamped")
    field, _ = lobefem_json(*push, "--film", "tension-field", "--setup", "initial-stress")
    assert own["reaction"] == pytest.approx(field["reaction"], rel=0.01)
    fixed, code = lobefem_json(*push, "--film", "fixed-wrinkles", "--setup", "initial-stress")
    assert code == 0
    assert fixed["warnings"][0].startswith("film with fixed wrinkles has no shear stiffness")
    assert fixed["reaction"] < 0.2 * own["reaction"]


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
    balloon.set_unknowns(state.vector())
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


def tired(*args, **options):
    raise EigenError("the eigensolver is tired; try coffee")


def test_a_ramp_is_kept_where_its_end_cannot_be_judged(capfd, monkeypatch, shared_path, comm):
    monkeypatch.setattr(perturb_command, "find_modes", tired)
    folder = shared_path / "run"
    code = cli.main([*STACK, "--bend", "2", "--steps", "2", "--out", str(folder), "--json", "-"])
    out, err = comm.bcast(tuple(capfd.readouterr()), root=0)
    results = json.loads(out)
    assert code == 0
    assert results["min_eigenvalue"] is None
    assert "error" not in results
    assert results["history"][-1]["parameter"] == pytest.approx(2.0)
    said = "the lowest eigenvalue at the end is not known: the eigensolver is tired; try coffee"
    assert said in results["warnings"]
    assert said in err
    if comm.rank == 0:
        assert (folder / "history.png").exists()


def test_a_release_is_kept_where_its_end_cannot_be_judged(capfd, monkeypatch, shared_path, comm):
    monkeypatch.setattr(release_module, "find_modes", tired)
    folder = shared_path / "run"
    arguments = ["--bend", "2", "--steps", "2", "--release", "--out", str(folder), "--json", "-"]
    code = cli.main([*STACK, *arguments])
    results = json.loads(comm.bcast(capfd.readouterr().out, root=0))
    assert code == 0
    assert results["outcome"] == "at rest, stability unknown"
    assert results["min_eigenvalue"] is None
    assert results["volume_final"] == pytest.approx(results["volume_original"], rel=1e-8)
    assert any("not known: the eigensolver is tired" in warning for warning in results["warnings"])
    (sentence,) = verdict(results)
    assert sentence.startswith(
        "After release the balloon came to rest; whether it is stable there could not be"
    )
    if comm.rank == 0:
        assert len(load_run(folder).steps) == 2
        save_picture(folder, "state", folder / "state.png", width=40)
