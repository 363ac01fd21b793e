"""The command line: its numbers, its words, its exit codes, and silence on standard output."""

import io
import json
import os
import re
import shlex
from contextlib import redirect_stdout
from pathlib import Path

import pytest
import typer

import lobefem
from lobefem.app import cli, design_options, process
from lobefem.io.design import Design
from lobefem.linalg import petsc

MESHES = Path(__file__).parents[3] / "meshes"
SINGLE, STACK4 = str(MESHES / "single.toml"), str(MESHES / "stack4.toml")
CYLINDER = str(MESHES / "cylinder.toml")
COARSE = ("--divisions", "6x10")


# --- output -------------------------------------------------------------------------------------


def test_the_run_folder_repeats_the_run(lobefem_json, shared_path, comm):
    folder = shared_path / "run"
    arguments = ("modes", STACK4, *COARSE, "--lobes", "2", "--count", "2", "--load", "closed")
    results, code = lobefem_json(*arguments, "--out", folder)
    assert code == 0
    assert json.loads((folder / "results.json").read_text()) == results
    assert results["versions"]["lobefem"] == lobefem.__version__
    assert results["versions"]["ranks"] == comm.size
    assert "modes at 1000 Pa" in (folder / "log.txt").read_text()
    written = Design.load(folder / "design.toml")
    assert (written.shape.lobes, written.pressure.load) == (2, "closed")
    assert written.mesh.divisions == (6, 10)
    again, _ = lobefem_json("modes", folder / "design.toml", "--count", "2")
    one, other = ([m["real"] for m in r["pressures"][0]["modes"]] for r in (results, again))
    assert one == pytest.approx(other, rel=1e-9)
    names = {"design.toml", "run.json", "results.json", "fields.xdmf", "fields.h5", "state.npz", "log.txt"}
    names |= {"modes-1.npz", "eigenvalues.csv", "stations.csv"}
    assert {p.name for p in folder.iterdir()} == names


def test_a_table_where_no_json_is_asked_for(shared_path, capfd, comm):
    path = shared_path / "results.json"
    arguments = ["modes", SINGLE, *COARSE, "--count", "1", "--json", str(path)]
    assert cli.main(arguments) == 0
    out, err = capfd.readouterr()
    # no progress, for this is no terminal: the warning alone, from rank 0
    assert len(err.splitlines()) == (1 if comm.rank == 0 else 0)
    mode = json.loads(path.read_text())["pressures"][0]["modes"][0]
    if comm.rank == 0:
        assert f"{mode['real']:.4g}" in out
        assert (
            "1 lobe, radius 2 m, 0.05 mm of fixed-wrinkles film, 6x10\nfilm load, clamped, rigid bar\n" in out
        )
        assert "Stable at 1000 Pa.\n" in out
    else:
        assert out == ""


def test_tables_of_the_other_commands(capfd, comm):
    assert cli.main(["inflate", SINGLE, *COARSE, "--lobes", "3", "--pressure", "5"]) == 0
    out, _ = capfd.readouterr()
    if comm.rank == 0:
        row = next(line for line in out.splitlines() if "hoop tension" in line).split()
        assert row[3::2] == ["N,", "N"]  # one number a hoop
        # T = p R0^2 cos(phi), on this coarse mesh
        tension = lobefem.Isotensoid.from_edge_radius(2.0).seam_tension(5.0)
        assert float(row[2]) == pytest.approx(tension, rel=0.1)
    assert cli.main(["critical", SINGLE, *COARSE]) == 0
    out, err = capfd.readouterr()
    if comm.rank == 0:
        assert "Critical pressure of the ideal state" in out
        assert err.startswith(
            "lobefem: warning: with fixed wrinkles the critical pressure depends on the mesh"
        )
    else:
        assert out == err == ""


def test_bar_hoops_and_any_key_are_changed_and_named(shared_path, lobefem_json, capfd, comm):
    folder = shared_path / "run"
    common = ("inflate", SINGLE, *COARSE, "--lobes", "2", "--pressure", "5")
    results, code = lobefem_json(*common, "--out", folder, "--bar", "none", "--hoops", "1 MN",
                                 "--set", "film.thickness=25 um", "--set", "film.prestress=true",
                                 "--set", "mesh.cell='quadrilateral'")  # fmt: skip
    assert code == 0
    assert (results["bar"], results["hoops"], results["thickness"]) == (None, 1e6, 2.5e-5)
    assert results["bar_force"] is None
    assert results["prestress"] == 5.0
    assert 'cell = "quadrilateral"' in (folder / "design.toml").read_text()
    results, _ = lobefem_json(*common, "--bar", "2 GN", "--hoops", "none")
    assert (results["bar"], results["hoops"], results["hoop_tension"]) == (2e9, None, [])
    capfd.readouterr()
    assert cli.main([*map(str, common), "--load", "closed"]) == 0
    out, _ = capfd.readouterr()
    if comm.rank == 0:
        assert "\nclosed load, clamped, rigid bar, hoops of EA 2.15 GN\n" in out


def test_the_units_are_listed(capfd, comm):
    assert cli.main(["units"]) == 0
    out, _ = capfd.readouterr()
    assert all(word in out for word in ("micron", "mil", "ksi", "lbf", "deg")) == (comm.rank == 0)


def test_the_materials_are_listed_with_their_sources(capfd, comm):
    from lobefem.io.materials import MATERIALS

    assert cli.main(["materials"]) == 0
    out, _ = capfd.readouterr()
    if comm.rank == 0:
        words = " ".join(out.split())
        for name, one in MATERIALS.items():
            line = next(line for line in out.splitlines() if line.split()[:1] == [name])
            assert f"{one.density:g} kg/m^3" in line
            assert one.title.split()[0] in words
        assert "The list is short on purpose" in words


def test_petsc_options_reach_the_solver_and_leave(capfd, comm):
    from petsc4py import PETSc

    arguments = ["inflate", SINGLE, *COARSE, "--json", "-"]
    given = "-lobefem_inflate_snes_monitor -lobefem_inflate_snes_max_itt 9"
    assert cli.main([*arguments, "--petsc", given]) == 0
    out, err = capfd.readouterr()
    assert not [name for name in PETSc.Options().getAll() if name.startswith("lobefem_inflate_snes_m")]
    if comm.rank == 0:
        assert "SNES Function norm" in err  # PETSc prints on stdout, which is for JSON here
        told = "no solver of this run has read the PETSc options -lobefem_inflate_snes_max_itt; check their"
        warned = [told in warning for warning in json.loads(out)["warnings"]]
        # petsc4py before 3.23 cannot say what was read
        assert warned == ([True] if hasattr(PETSc.Options(), "used") else [])
        assert (told in err) == bool(warned)


def test_the_prefixes_of_petsc_options_are_those_of_the_solvers():
    sources = (Path(lobefem.__file__).parent).rglob("*.py")
    used = {name for source in sources for name in re.findall(r'"(lobefem_[a-z]+_)"', source.read_text())}
    assert set(petsc.PREFIXES) == used


@pytest.mark.slow
def test_quiet_and_verbose_may_stand_before_the_command_or_after_it(capfd, comm):
    arguments = ["modes", SINGLE, *COARSE, "--count", "1"]
    for line in (["--quiet", *arguments], [*arguments, "-q", "--profile"]):
        assert cli.main(line) == 0
        out, err = capfd.readouterr()
        assert out == ""
        assert err.startswith("lobefem: warning: ") == (comm.rank == 0)
    for line in (["-v", *arguments], [*arguments, "--verbose"]):
        assert cli.main(line) == 0
        out, err = capfd.readouterr()
        if comm.rank == 0:
            assert "modes at 1000 Pa: lowest" in err
            assert "Stable at 1000 Pa.\n" in out
        else:
            assert out == err == ""


# --- help and processes -------------------------------------------------------------------------


@pytest.mark.serial
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], ["inflate", "modes", "critical", "lobefem new stack4 > mine.toml"]),
        (["--help"], ["inflate", "modes", "critical"]),
        (["inflate", "--help"], ["--film", "--lift", "--slack-stiffness", "--prestress", "--out"]),
        (["modes", "-h"], ["--pressure", "--state", "--count", "--mass", "Examples:"]),
        (
            ["critical", "--help"],
            ["--harmonic", "--json", "Examples:", "lobefem critical meshes/stack4.toml --film tension-field"],
        ),
        (["harmonics", "--help"], ["--harmonics", "--divisions", "Examples:"]),
        (["perturb", "--help"], ["[cleft]", "[degrees]"]),
        (["--version"], [f"lobefem {lobefem.__version__}"]),
    ],
)
def test_help_teaches(capfd, arguments, words):
    assert cli.main(arguments) == 0
    out, _ = capfd.readouterr()
    for word in words:
        assert word in out


COMMANDS = typer.main.get_command(cli.app).commands


@pytest.mark.serial
@pytest.mark.parametrize("name", COMMANDS)
def test_examples_of_the_help_are_sound(name):
    """Each command's epilog has two or more; their options exist, and their files."""
    examples = re.findall(r"\[bold\](.*?)\[/bold\]", COMMANDS[name].epilog)
    assert len(examples) >= 2
    for line in examples:
        words = shlex.split(line[line.index("lobefem ") :].partition(" > ")[0])
        assert words[:2] == ["lobefem", name]
        COMMANDS[name].make_context(name, words[2:])  # raises what is wrong
        assert all((MESHES.parent / word).is_file() for word in words if word.endswith(".toml"))


def test_completion_knows_commands_options_and_design_files(shared_path, monkeypatch, comm):
    if comm.rank == 0:
        (shared_path / "designs").mkdir()
        for name in ("designs/one.toml", "designs/two.toml", "notes.txt", ".hidden.toml"):
            (shared_path / name).touch()
    comm.Barrier()
    monkeypatch.chdir(shared_path)
    assert design_options.design_files("") == ["designs/one.toml", "designs/two.toml"]
    assert design_options.design_files("designs/t") == ["designs/two.toml"]
    assert design_options.design_files("none/") == []
    monkeypatch.setenv("_LOBEFEM_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_CWORD", "2")
    monkeypatch.setenv("COMP_WORDS", "lobefem modes --cou")
    said = io.StringIO()
    with redirect_stdout(said), pytest.raises(SystemExit) as end:
        cli.main(["modes"])
    assert (end.value.code, said.getvalue().split()) == (0, ["--count"] if comm.rank == 0 else [])


def test_json_on_stdout_is_safe_from_compiled_prints(capfd):
    with process.stdout_to_stderr(True):
        os.write(1, b"library\n")
    os.write(1, b"ours\n")
    out, err = capfd.readouterr()
    assert (out, err) == ("ours\n", "library\n")


def test_all_ranks_end_together(capfd, comm):
    ranks = process.Ranks()
    assert ranks.is_root == (comm.rank == 0)
    assert ranks.end(2, "all of us") == 2
    assert capfd.readouterr().err == ("all of us\n" if comm.rank == 0 else "")


class _LonelyComm:
    """A communicator on which no other rank ever arrives; Abort does not return."""

    rank = 1

    def Ibarrier(self):
        return self

    def Test(self):
        return False

    def Abort(self, code):
        raise SystemExit(f"aborted with {code}")


def test_a_rank_alone_with_its_failure_speaks_and_aborts_all(capfd):
    ranks = process.Ranks()
    ranks._comm = _LonelyComm()
    with pytest.raises(SystemExit, match="aborted with 1"):
        ranks.end(1, "lobefem: internal error", patience=0.01)
    assert capfd.readouterr().err == "lobefem: internal error (rank 1)\n"


def test_endless_words_are_not_repeated_whole(capfd, comm):
    assert cli.main(["inflate", SINGLE, "9" * 5000]) == 2
    words = capfd.readouterr().err
    if comm.rank == 0:
        assert words.startswith("lobefem: Got unexpected extra argument")
        assert words.endswith("; see lobefem inflate --help\n")
        assert len(words) < 700
