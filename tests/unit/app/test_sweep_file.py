"""Parameter studies: points from a file, each run once and kept, a row whatever comes of it."""

import json
import os
import subprocess

import pytest

from lobefem.app import sweep_command
from lobefem.app.cli import main
from lobefem.app.sweep_command import parameter_chart
from lobefem.app.sweep_file import load
from lobefem.errors import InputError

from mpi4py import MPI

KNOWN = {"critical": {"divisions", "state"}, "perturb": {"bend", "contact"}}
DESIGN = """
[mesh]
divisions = [4, 6]
[pressure]
value = 5.0
"""
STUDY = """
command = "inflate"
design = "one.toml"
[options]
film = "isotropic"
[vary]
film.thickness = [5e-5, "0.05 mm", 1.0]
pressure.value = [5, [5, 6]]
"""


@pytest.fixture
def folder(shared_path):
    if MPI.COMM_WORLD.rank == 0:
        for name in ("one", "two"):
            (shared_path / f"{name}.toml").write_text(DESIGN)
        (shared_path / "study.toml").write_text(STUDY)
    MPI.COMM_WORLD.Barrier()
    return shared_path


def study_of(folder, text):
    path = folder / f"s{MPI.COMM_WORLD.rank}.toml"
    path.write_text(text)
    return load(path, KNOWN)


@pytest.mark.serial
def test_points_are_all_combinations_and_known_by_their_inputs(folder):
    study = study_of(
        folder,
        'command = "perturb"\ndesign = ["one.toml", "two.toml"]\noptions = {contact = false}\n'
        '[vary]\nbend = [5, 7.5]\n"film.law" = ["isotropic"]\n',
    )
    assert study.varied == ("design", "bend", "film.law")
    assert [(p.values["design"], p.values["bend"]) for p in study.points] == [
        ("one.toml", 5), ("one.toml", 7.5), ("two.toml", 5), ("two.toml", 7.5),
    ]  # fmt: skip
    assert study.points[1].options == ("--no-contact", "--bend", "7.5")
    names = [p.name for p in study.points]
    assert names[:2] == names[2:]  # the two files hold the same design
    assert names[0] != names[1]


@pytest.mark.serial
@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("command = 'critical'", "there is no design"),
        ("command = 'crit'\ndesign = 'one.toml'", "command = 'crit' is impossible"),
        ("command = 'critical'\ndesign = []", "leaves nothing"),
        ("command = 'critical'\ndesign = 'three.toml'", "no design file"),
        ("command = 'critical'\ndesign = 'one.toml'\nvary = 3", "vary = 3 is impossible"),
        ("command = 'critical'\ndesign = 'one.toml'\n[vary]\nstate = 'ideal'", "no list of values"),
        ("command = 'critical'\ndesign = 'one.toml'\n[vary]\nbend = [3]", "'bend' is no option of lobefem"),
        ("command = 'critical'\ndesign = 'one.toml'\n[vary]\ndesign = ['one.toml']", "write design = [...]"),
        ("command = 'critical'\ndesign = 'one.toml'\n[options]\nmesh_study = true", "vary divisions instead"),
        ("command = 'critical'\ndesign = 'one.toml'\n[options]\nout = 'x'", "option of lobefem sweep itself"),
        ("command = 'critical'\ndesign = 'one.toml'\n[vary]\nfilm.lw = [3]", "'film.lw' is no key"),
        ("command = 'critical'\ndesign = 'one.toml'\nvery = 1", "very = 1 is no key of a sweep"),
        ("command = ", "is no TOML"),
        (
            "command = 'critical'\ndesign = 'one.toml'\n[vary]\nfilm.E = [3.5 GPa]",
            'write film.E = ["3.5 GPa"]',
        ),
        ("command = 'critical'\noptions.count = " + "9" * 5000, "is no TOML (not such a text)"),
        (
            "command = 'critical'\ndesign = 'one.toml'\n[vary]\n"
            + "".join(f"film.{key} = {list(range(1, 100))}\n" for key in ("E", "nu", "thickness")),
            "970299 combinations are more than 100000",
        ),
    ],
)
def test_what_is_no_study_is_said_in_a_sentence(folder, text, said):
    with pytest.raises(InputError) as error:
        study_of(folder, text)
    assert said in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.serial
def test_a_switch_is_said_either_way(folder):
    file = folder / "switch.toml"
    if MPI.COMM_WORLD.rank == 0:
        file.write_text("command = 'inflate'\ndesign = 'one.toml'\n[vary]\nprestress = [true, false]")
    MPI.COMM_WORLD.Barrier()
    study = load(file, {"inflate": {"prestress"}})
    assert [point.options for point in study.points] == [("--prestress",), ("--no-prestress",)]


@pytest.mark.slow
def test_a_sweep_runs_each_point_once_and_keeps_failures_as_rows(folder, comm, capfd, monkeypatch):
    """Six points: two designs alike, thick film refused by the design, two pressures by the command."""
    arguments = ["sweep", str(folder / "study.toml"), "--out", str(folder / "out"), "--workers", "2"]
    if comm.size > 1 and MPI.Query_thread() < MPI.THREAD_SERIALIZED:  # PETSc may have started MPI so
        assert main(arguments) == 2
        assert comm.rank or "started without threads" in capfd.readouterr().err
        return
    assert main(arguments) == 0
    if comm.rank == 0:
        results = json.loads((folder / "out" / "results.json").read_text())
        rows = results["rows"]
        assert [row["exit_code"] for row in rows] == [0, 2, 0, 2, 2, 2]
        assert rows[0]["folder"] == rows[2]["folder"]
        assert 80 < rows[0]["found"]["volume"] < 170
        assert rows[0]["found"] == rows[2]["found"]
        assert "inflate takes one pressure" in rows[1]["reason"]
        assert "thickness" in rows[4]["reason"]
        assert (results["failed"], rows[0]["reason"]) == (4, "")
        point = json.loads((folder / "out" / rows[0]["folder"] / "results.json").read_text())
        assert point["volume"] == rows[0]["found"]["volume"]
        assert (folder / "out" / "sweep.png").stat().st_size > 1000
        table = (folder / "out" / "table.csv").read_text().splitlines()
        assert table[0].startswith("film.thickness,pressure.value,volume [m^3],")
        assert len(table) == 7
    comm.Barrier()
    # once more: only what was refused is tried again, for a disk may have been full or a library missing
    runs, run = [], subprocess.run
    monkeypatch.setattr(subprocess, "run", lambda *a, **k: [runs.append(a[0]), run(*a, **k)][1])
    assert main(arguments) == 2
    assert main([*arguments, "--resume", "--json", str(folder / "again.json")]) == 0
    assert comm.allreduce(len(runs)) == 1
    if comm.rank == 0:
        again = json.loads((folder / "again.json").read_text())
        for row in again["rows"] + results["rows"]:
            row["seconds"] = 0.0
        assert again == results
        assert "is not empty" in capfd.readouterr().err
    comm.Barrier()


@pytest.mark.serial
@pytest.mark.parametrize(("code", "said"), [(-9, "signal 9"), (143, "said nothing"), (2, "said nothing")])
def test_a_process_that_dies_is_a_row_and_not_kept(folder, monkeypatch, code, said):
    study = load(folder / "study.toml", {"inflate": {"film"}})
    died = subprocess.CompletedProcess([], code, "", "")
    monkeypatch.setattr(sweep_command.subprocess, "run", lambda *a, **k: died)
    sweep_command.begin(study, folder / "out")
    with sweep_command.workers(1) as executor:
        rows = sweep_command.run(study, folder / "out", executor)
    assert rows[0].exit_code == code
    assert said in rows[0].reason
    assert not [name for name in os.listdir(folder / "out" / "points") if name.endswith(".json")]
    figure = parameter_chart(study, rows)
    assert "no point found anything" in [text.get_text() for text in figure.axes[0].texts]
