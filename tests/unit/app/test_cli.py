"""The command line: its numbers, its words, its exit codes, and silence on standard output."""

import io
import json
import os
import re
import sys
from contextlib import redirect_stdout
from pathlib import Path

import numpy as np
import pytest
import typer

import lobefem
from lobefem.app import cli, options, process
from lobefem.errors import ConvergenceError, SolveError
from lobefem.io.design import Design
from lobefem.linalg import petsc

from mpi4py import MPI

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
    for line in (["--quiet", *arguments], [*arguments, "-q"]):
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


# --- what is refused ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--bad",), "No such option: --bad; see lobefem --help"),
        (("detonate",), "No such command 'detonate'; see lobefem --help"),
        (("inflate", SINGLE, "--set", "film.E"), "--set: 'film.E' is no section.key=value; give one such as"),
        (("inflate", SINGLE, "--set", "film.thicknes=1"), "'film.thicknes' is no key of [film]; use"),
        (("inflate", SINGLE, "--set", "film.nu=9"), "film.nu: 9 must be in (-1, 0.5]"),
        (("inflate", SINGLE, "--set", "film.nu=0", "--set", "film.nu=0.1"), "--set: film.nu is given twice"),
        (("inflate", SINGLE, "--set", "film.law=imp", "--film", "imp"),
         "--set film.law and --film give the same key; leave out one"),
        (("inflate", SINGLE, "--set", "hoops.EA=1", "--hoops", "2"), "--set hoops.EA and --hoops give the"),
        (("inflate", SINGLE, "--hoops", "5 m"), "--hoops: '5 m' is not a force; give newtons"),
        (("inflate", SINGLE, "--bar", "steel"), "--bar: 'steel' is no bar; give true (rigid), false (none)"),
        (("materials", "wood"), "'wood' is no material here; use mylar-a, aluminium-6061-t6"),
        (("units", "colour"), "'colour' is no quantity with units; use length, pressure, stress, force"),
        (("critical", SINGLE, "--pressure", "5"),
         "--pressure: critical looks for the pressure at which the balloon turns unstable, up to --limit"),
        (("harmonics", SINGLE, "--pressure", "5"), "--pressure: harmonics looks for the pressure at which"),
        (("modes",), "Missing argument 'DESIGN.toml'; see lobefem modes --help"),
        (("modes", SINGLE, "--presure", "5"), "No such option: --presure"),
        (("modes", SINGLE, "--film"), "requires an argument; see lobefem"),
        (("modes", "none.toml"), "there is no design file 'none.toml'; see meshes/ for examples"),
        (("modes", SINGLE, "--count", "0"),
         "--count: '0' is impossible; give an integer, 1 or more"),
        (("modes", SINGLE, "--count", "x"), "--count: 'x' is impossible; give an integer"),
        (("modes", SINGLE, "--state", "flat"), "--state: 'flat' is unknown; use ideal or inflated"),
        (("modes", SINGLE, "--mass", "2"), "--mass: '2' is unknown; use unit or nodal"),
        (("modes", SINGLE, "--pressure", "-5"),
         "--pressure: '-5' is below 0, and a film carries no suction; give pascals, e.g. 5.0"),
        (("modes", SINGLE, "--pressure", "5 m"), "--pressure: '5 m' is not a pressure; give"),
        (("inflate", SINGLE, "--film", "rubber"), "--film: 'rubber' is unknown; use isotropic, "),
        (("inflate", SINGLE, "--load", "open"), "--load: 'open' is unknown; use film or closed"),
        (("inflate", SINGLE, "--support", "hung"), "--support: 'hung' is unknown; use clamped, "),
        (("inflate", SINGLE, "--lift", "0.004"),
         "plates.lift = 0.004 needs support = 'fixed', not 'clamped'; change one of them"),
        (("inflate", SINGLE, "--divisions", "24"), "--divisions: '24' is no mesh division; give"),
        (("inflate", SINGLE, "--lobes", "0"), "--lobes: '0' is impossible; give an integer"),
        (("inflate", SINGLE, "--edge-radius", "2 Pa"), "--edge-radius: '2 Pa' is not a length"),
        (("inflate", CYLINDER, "--edge-radius", "0"), "--edge-radius: '0' must be positive"),
        (("inflate", SINGLE, "--slack-stiffness", "2"), "--slack-stiffness: '2' must be in [0, 1)"),
        (("inflate", SINGLE, "--pressure", "5", "--pressure", "6"),
         "inflate takes one pressure, not 5, 6 Pa; give one, e.g. --pressure 6"),
        (("inflate", SINGLE, "--petsc", "snes_monitor"), "--petsc: 'snes_monitor' is no option; write"),
        (("inflate", SINGLE, "--petsc", "-lobefem_inflat_snes_monitor"),
         "--petsc: no solver takes '-lobefem_inflat_snes_monitor'; theirs begin with -lobefem_inflate_"),
        (("--quiet", "inflate", SINGLE, "--verbose"), "--quiet and --verbose contradict each other"),
        (("inflate", SINGLE, "--json", "none/x.json"), "none' cannot be written to; give another"),
        (("inflate", SINGLE, "--out", SINGLE), "is a file, not a folder; give another --out"),
        (("inflate", SINGLE, "--out", MESHES), "is not empty; give another --out, or --overwrite"),
        (("inflate", SINGLE, "--lobes", "2000"), "the number of lobes is 2000; give 1000 or less"),
        (("inflate", SINGLE, "--lobes", "9" * 5000), "is impossible; give an integer, 1 or more"),
        (("inflate", SINGLE, "--divisions", "9999x5000"), "a mesh of 5e+07 nodes needs about 500 GB"),
        (("inflate", SINGLE, "--divisions", f"4x{'9' * 5000}"), "is no mesh division"),
        (("modes", SINGLE, "--count", "9" * 5000), "is impossible; give an integer, 1 or more"),
        (("inflate", SINGLE, *COARSE, "--petsc", "-lobefem_inflate_snes_type foo"),
         "--petsc: PETSc refuses '-lobefem_inflate_snes_type foo' (Unable to find requested SNES type foo)"),
        (("modes", SINGLE, *COARSE, "--petsc", "-lobefem_modes_eps_nev -3"),
         "--petsc: PETSc refuses '-lobefem_modes_eps_nev -3' (Illegal value of nev. Must be > 0)"),
        (("inflate", "/dev/zero"), "/dev/zero is no TOML (more than 50000 bytes)"),
        (("inflate", SINGLE, *COARSE, "--json", "/dev/full"), "'/dev/full': No space left on device"),
        (("inflate", "a\nb\x1b.toml"), "there is no design file 'a\\nb\\x1b.toml'"),
        (("critical", SINGLE, "--harmonic", "-1"), "--harmonic: '-1' is impossible; give an int"),
        (("modes", SINGLE, "--harmonics", "2:"),
         "--harmonics: '2:' is impossible; give integers such as 3, 0:8 or 2,5,7"),
        (("harmonics", SINGLE, "--harmonics", "5:2"), "--harmonics: '5:2' holds no integer"),
        (("harmonics", SINGLE, "--harmonics", "17"),
         "harmonic = 17: a mesh of 32 equal sectors has harmonics 0 to 16; try more divisions"),
        (("harmonics", CYLINDER), "a cylinder has no ideal state, for it carries no pressure as it"),
        (("critical", SINGLE, "--state", "inflated", "--harmonic", "2"),
         "--harmonic looks at the ideal state; leave it out with --state inflated"),
        (("critical", SINGLE, "--limit", "5 kPa"), "--limit is for the search along inflated states"),
        (("critical", SINGLE, "--state", "inflated", "--limit", "-5"),
         "--limit: '-5' is no positive pressure; give pascals"),
        (("critical", SINGLE, "--limit", "5 m"), "--limit: '5 m' is not a pressure; give pascals"),
        (("critical", SINGLE, "--meshes", "6x8,8x12"), "add --mesh-study"),
        (("critical", SINGLE, "--mesh-study", "--harmonic", "2"), "leave out --harmonic, --state"),
        (("critical", SINGLE, "--mesh-study", "--meshes", "6x8,8"), "--meshes: '6x8,8' is impossible"),
        (("critical", SINGLE, "--mesh-study", "--meshes", "6x8"), "mesh study"),
        (("critical", CYLINDER), "a cylinder has no ideal state, for it carries no pressure as it"),
        (("modes", CYLINDER), "a cylinder has no ideal state, for it carries no pressure as it"),
        (("modes", CYLINDER, "--lobes", "2"),
         "shape.lobes = 2 does not fit the kind 'cylinder'; leave it out"),
    ],
)  # fmt: skip
def test_bad_input_gets_one_sentence_and_exit_code_2(refused, arguments, message):
    code, words = refused(*arguments)
    assert code == 2
    assert message in words
    assert words.startswith("lobefem: ")
    assert words.count("\n") == 1
    assert words.endswith("\n")


def test_bad_input_writes_nothing(refused, shared_path):
    folder, file = shared_path / "run", shared_path / "x.json"
    code, _ = refused("critical", CYLINDER, "--out", folder, "--json", file)
    assert code == 2
    assert list(shared_path.iterdir()) == []


# --- what fails ---------------------------------------------------------------------------------


def test_a_solve_that_fails_keeps_the_last_state_and_exits_3(capfd, monkeypatch, shared_path, comm):
    from lobefem.app import states_command

    def stop_halfway(balloon, pressure, **options):
        state = solve(balloon, pressure / 2, **options)
        raise ConvergenceError("inflate stopped at 500 Pa; try more", state=state, reason="halfway")

    solve = states_command.find_equilibrium
    monkeypatch.setattr(states_command, "find_equilibrium", stop_halfway)
    folder = shared_path / "run"
    code = cli.main(["inflate", SINGLE, *COARSE, "--out", str(folder), "--json", "-"])
    out, err = comm.bcast(tuple(capfd.readouterr()), root=0)
    assert code == 3
    assert err == (f"lobefem: inflate stopped at 500 Pa; try more; the last converged state is in {folder}\n")
    results = json.loads(out)
    assert results["converged"] is False
    assert results["reason"] == "halfway"
    assert results["pressure"] == 500.0
    assert results["volume"] > 0
    assert results["error"] in err
    assert json.loads((folder / "results.json").read_text()) == results
    assert (folder / "fields.xdmf").exists()
    with np.load(folder / "state.npz") as state:
        assert state["pressure"] == 500.0
        reached = np.linalg.norm(state["displacement"], axis=1).max()
        assert reached == pytest.approx(results["max_displacement"], rel=1e-12)


def test_a_solve_that_fails_at_once_has_null_results(capfd, comm):
    code = cli.main(["inflate", CYLINDER, "--divisions", "4x8", "--slack-stiffness", "0", "--json", "-"])
    out, err = MPI.COMM_WORLD.bcast(tuple(capfd.readouterr()), root=0)
    assert code == 3
    assert "last converged state" not in err
    results = json.loads(out)
    assert results["converged"] is False
    assert results["volume"] is None


def test_modes_before_a_failure_are_kept(capfd, monkeypatch, comm):
    from lobefem.stability import modes

    def fail_at_second(state, count, **options):
        if state.pressure > 60:
            raise SolveError("the eigensolver is tired; try coffee")
        return found(state, count, **options)

    found = modes.find_modes
    monkeypatch.setattr(modes, "find_modes", fail_at_second)
    pressures = ["--pressure", "50", "--pressure", "100"]
    assert cli.main(["modes", SINGLE, *COARSE, "--count", "1", *pressures, "--json", "-"]) == 3
    out, err = MPI.COMM_WORLD.bcast(tuple(capfd.readouterr()), root=0)
    warning, error = err.splitlines()
    assert "depends on the mesh and goes to zero" in warning
    assert error == "lobefem: the eigensolver is tired; try coffee"
    results = json.loads(out)
    assert [entry["pressure"] for entry in results["pressures"]] == [50.0]
    assert results["reason"] == "SolveError"


def test_standard_streams_may_be_closed(monkeypatch):
    monkeypatch.setattr("sys.stdout", None)
    monkeypatch.setattr("sys.stderr", None)
    assert cli.main(["inflate", SINGLE, *COARSE]) == 0
    assert cli.main(["inflate", "none.toml"]) == 2
    sys.stdout.close()
    sys.stderr.close()


@pytest.mark.parametrize(
    ("raised", "code", "message"),
    [
        (MemoryError(), 3, "lobefem: out of memory; try a coarser mesh, or more ranks on more machines\n"),
        (OSError(5, "Input/output error", "x"), 2, "lobefem: the system refuses: Input/output error (x)\n"),
        (
            KeyboardInterrupt(),
            130,
            "lobefem: interrupted; with --out DIR a run keeps its steps, and --resume goes on from them\n",
        ),
        (ConvergenceError("no luck; try again"), 3, "lobefem: no luck; try again\n"),
        (
            ZeroDivisionError("one\ntwo"),
            1,
            "lobefem: internal error: ZeroDivisionError: one two (set LOBEFEM_DEBUG=1 for the traceback)\n",
        ),
    ],
)
def test_whatever_is_raised_ends_in_one_sentence(refused, monkeypatch, raised, code, message):
    from lobefem.app import states_command

    def fail(*arguments, **options):
        raise raised

    monkeypatch.delenv("LOBEFEM_DEBUG", raising=False)
    monkeypatch.setattr(states_command, "inflate", fail)
    assert refused("inflate", SINGLE) == (code, message)


def test_a_traceback_on_request(refused, monkeypatch):
    from lobefem.app import states_command

    monkeypatch.setenv("LOBEFEM_DEBUG", "1")
    monkeypatch.setattr(states_command, "inflate", lambda *a, **k: 1 / 0)
    code, words = refused("inflate", SINGLE)
    assert code == 1
    assert "Traceback (most recent call last)" in words


# --- help and processes -------------------------------------------------------------------------


@pytest.mark.serial
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], ["inflate", "modes", "critical", "lobefem critical meshes/stack4.toml"]),
        (["--help"], ["inflate", "modes", "critical"]),
        (["inflate", "--help"], ["--film", "--lift", "--slack-stiffness", "--prestress", "--out"]),
        (["modes", "-h"], ["--pressure", "--state", "--count", "--mass", "Examples:"]),
        (
            ["critical", "--help"],
            ["--harmonic", "--json", "Examples:", "lobefem critical meshes/stack4.toml --film tension-field"],
        ),
        (["harmonics", "--help"], ["--harmonics", "--divisions", "Examples:"]),
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
        words = line[line.index("lobefem ") :].split()
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
    assert options.design_files("") == ["designs/one.toml", "designs/two.toml"]
    assert options.design_files("designs/t") == ["designs/two.toml"]
    assert options.design_files("none/") == []
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
