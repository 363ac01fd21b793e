"""Pictures of a run folder: what is drawn, what moves, and what is refused in one sentence."""

import json
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from lobefem import Balloon, Isotropic, lobed_cylinder
from lobefem.app import cli, states_command
from lobefem.errors import ConvergenceError, InputError
from lobefem.io.run_reader import load_run
from lobefem.viz.frames import FRAMES, keep_frame, load_frames
from lobefem.viz.run_pictures import held, picture, save_picture
from lobefem.viz.style import REGIONS
from lobefem.viz.views import Panel, Scale, blank, paint, window

from mpi4py import MPI

SINGLE = str(Path(__file__).parents[3] / "meshes" / "single.toml")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = MPI.COMM_WORLD.bcast(tmp_path_factory.mktemp("pictures") / "run", root=0)
    arguments = ["modes", SINGLE, "--divisions", "6x10", "--count", "3", "--out", str(path)]
    assert cli.main([*arguments, "--pressure", "1000", "--pressure", "2000"]) == 0
    return path


def seen(image):
    """How many different colours a picture has."""
    return len(np.unique(np.asarray(image.convert("RGB")).reshape(-1, 3), axis=0))


@pytest.mark.slow
def test_a_command_draws_the_modes_and_lets_them_swing(folder, shared_path, capfd):
    code = cli.main(["plot", str(folder), "--what", "modes", "--to", str(shared_path / "m.png")])
    said = capfd.readouterr().out
    assert code == 0
    if MPI.COMM_WORLD.rank:
        return
    assert said == f"The picture is {shared_path / 'm.png'}\n"
    with Image.open(shared_path / "m.png") as image:
        assert image.width == pytest.approx(85 / 25.4 * 300, abs=2)  # one column at 300 dots an inch
        assert seen(image) > 100
    save_picture(folder, "modes", shared_path / "m.gif", modes=[3], pressure=1000.0, width=30)
    with Image.open(shared_path / "m.gif") as image:
        assert image.n_frames == 24
        frames = []
        for k in (0, 6, 12):  # out, at rest, and out on the other side
            image.seek(k)
            frames.append(np.asarray(image.convert("L"), dtype=float))
    assert np.abs(frames[0] - frames[2]).mean() > np.abs(frames[0] - frames[1]).mean() > 0.5


@pytest.mark.serial
def test_the_second_of_a_pair_is_left_out(folder):
    run = load_run(folder)
    kinds = [mode["kind"] for mode in run.results["pressures"][-1]["modes"]]
    assert kinds == ["sway", "sway", "twist"]
    titles = [text.get_text() for text in picture(run, "modes").figure().texts]
    assert [t.splitlines()[0] for t in titles if "lambda" in t] == ["mode 1", "mode 3"]
    assert "1 lobe, fixed wrinkles film, 2000 Pa" in titles


@pytest.mark.serial
def test_curves_go_through_the_results(folder):
    figure = picture(load_run(folder), "curves").figure()
    results = json.loads((folder / "results.json").read_text())
    values = {entry["pressure"]: [m["real"] for m in entry["modes"]] for entry in results["pressures"]}
    drawn = [line for line in figure.axes[0].get_lines() if len(line.get_xdata()) == 2]
    for line in drawn[-2:]:
        for p, value in zip(*line.get_data(), strict=True):
            assert min(abs(value - v) for v in values[p]) < 1e-12 * abs(value)


@pytest.mark.serial
def test_what_is_not_there_is_said_in_one_sentence(folder, shared_path):
    cases = (
        ("release", {}, "holds no release; it holds modes, stress, state, curves"),
        ("colours", {}, "'colours' is unknown; use modes, stress, state, curves, release"),
        ("modes", {"modes": [7]}, r"modes \[7\] are not in"),
        ("state", {"pressure": 3.0}, "holds nothing at 3 Pa; it holds 1000, 2000 Pa"),
        ("stress", {"modes": [1]}, "--mode is of modes, not of stress; leave it out"),
        ("curves", {"pressure": 1000.0}, "curves are of all pressures; leave --pressure out"),
        ("curves", {"format": "gif"}, "has no motion; use png or svg"),
        ("curves", {"path": "x.doc"}, "format 'doc' is unknown; use png, svg, gif, mp4"),
        ("curves", {"width": 1.0}, "width = 1.0 mm is no width of a picture"),
        ("curves", {"path": shared_path / "no" / "x.svg"}, "No such file or directory"),
    )
    for what, given, words in cases:
        with pytest.raises(InputError, match=words):
            save_picture(folder, what, **given)
    with pytest.raises(InputError, match="there is no folder"):
        save_picture(shared_path / "nothing", "modes")
    shutil.copytree(folder, shared_path / "other")
    (shared_path / "other" / "results.json").write_text('{"command": "modes", "branches": [1]}')
    for what in ("modes", "curves"):
        with pytest.raises(InputError, match=r"do not fit each other \((Key|Type)Error: .*\); run it again"):
            save_picture(shared_path / "other", what)
    (shared_path / "other" / "results.json").unlink()
    with pytest.raises(InputError, match=r"holds no modes: (there is n|N)o results\.json: this run"):
        save_picture(shared_path / "other", "modes")


def test_modes_are_those_that_there_are_where_a_run_failed(comm, shared_path, monkeypatch):
    """Its last step is the state before the failure, without modes."""
    folder, calls = shared_path / "run", []

    def inflate(balloon, pressure, **options):
        state = tasks_inflate(balloon, 1000.0 + 500.0 * len(calls), **options)
        calls.append(pressure)
        if len(calls) == 2:
            raise ConvergenceError("no", state=state, reason="by force", residual=1.0)
        return state

    tasks_inflate = states_command.find_equilibrium
    monkeypatch.setattr(states_command, "find_equilibrium", inflate)
    arguments = ["modes", SINGLE, "--divisions", "4x8", "--state", "inflated", "--film", "isotropic"]
    arguments += ["--pressure", "1000", "--pressure", "2000", "--count", "2", "--out", str(folder)]
    assert cli.main(arguments) == 3
    if MPI.COMM_WORLD.rank:
        return
    assert save_picture(folder, "modes").is_file()
    with pytest.raises(InputError, match="holds no modes at 1500 Pa; it does at 1000 Pa"):
        save_picture(folder, "modes", pressure=1500.0)


def test_the_command_refuses_with_exit_code_2(folder, capfd, comm):
    """Rank 0 alone draws; the others end with it."""
    code = cli.main(["plot", str(folder), "--what", "release"])
    words = capfd.readouterr().err
    assert code == (0 if comm.rank else 2)
    assert ("holds no release; it holds modes, stress, state, curves" in words) == (comm.rank == 0)


@pytest.mark.serial
def test_stresses_share_a_scale_and_film_has_its_colours(folder):
    run = load_run(folder)
    assert held(run) == ("modes", "stress", "state", "curves")
    figure = picture(run, "stress").figure()
    film = figure.axes[0].collections  # side and top view of each map
    # fixed wrinkles: N_m = p R0^2/(2 R), no hoop stress, all wrinkled
    first, hoop, regions = (np.unique(c.get_facecolor()[:, :3], axis=0) for c in (film[0], film[2], film[4]))
    assert len(first) > 3
    plate, low = (0.88, 0.88, 0.88), Scale().mappable().to_rgba(0.0)[:3]
    assert {tuple(np.round(c, 6)) for c in hoop} == {plate, tuple(np.round(low, 6))}
    blue = tuple(int(REGIONS["wrinkled"][k : k + 2], 16) / 255 for k in (1, 3, 5))
    assert any(np.allclose(c, blue) for c in regions)


@dataclass
class Moved:
    balloon: Any
    displacement: Any


def test_frames_are_thinned_and_lie_on_their_nodes(comm, shared_path):
    balloon = Balloon(lobed_cylinder(1, (4, 6)), Isotropic())
    x = balloon.V.tabulate_dof_coordinates()
    points = [0, 40, 47, 48, 49, 50, 95, 96, 100]
    for point in points:
        keep_frame(shared_path, point, Moved(balloon, point * x), always=(47,))
    if comm.rank == 0:
        assert FRAMES == 48
        frames = load_frames(shared_path)
        assert frames.points == (0, 40, 47, 48, 96, 100)
        for point, displacement in zip(frames.points, frames.displacements, strict=True):
            np.testing.assert_allclose(displacement, point * frames.film_mesh.x, rtol=1e-6, atol=1e-5)
        # what is drawn of them stays inside
        e1, e2 = np.eye(3)[:2]
        panel = Panel("", 1.2 * frames.film_mesh.x, (e1, e2))
        view = window(frames.film_mesh, [panel])
        assert view.reach > 0.6 * frames.film_mesh.diameter > 0.9 * view.reach
        figure = blank()
        paint(figure, frames.film_mesh, [panel], view, width=85.0)
        assert figure.get_figwidth() == pytest.approx(85 / 25.4)
        (shared_path / "frames" / "000040.npz").write_bytes(b"PK nonsense")
        with pytest.raises(InputError, match=r"000040.npz' cannot be read"):
            load_frames(shared_path)
