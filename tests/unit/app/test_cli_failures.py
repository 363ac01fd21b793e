"""The command line where something is wrong: one sentence, the exit code, what is kept."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from lobefem.app import cli
from lobefem.errors import ConvergenceError, SolveError

from mpi4py import MPI

MESHES = Path(__file__).parents[3] / "meshes"
SINGLE, STACK4 = str(MESHES / "single.toml"), str(MESHES / "stack4.toml")
CYLINDER, PUMPKIN = str(MESHES / "cylinder.toml"), str(MESHES / "pumpkin.toml")
COARSE = ("--divisions", "6x10")


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
        (("modes", "none.toml"), "there is no design file 'none.toml'; see lobefem new --list"),
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
         "--limit: '-5' is no positive pressure (1e-15 to 1e15 Pa); give pascals"),
        (("critical", SINGLE, "--limit", "5 m"), "--limit: '5 m' is not a pressure; give pascals"),
        (("critical", SINGLE, "--meshes", "6x8,8x12"), "add --mesh-study"),
        (("critical", SINGLE, "--mesh-study", "--harmonic", "2"), "leave out --harmonic, --limit"),
        (("critical", SINGLE, "--tolerance", "2%"), "--tolerance refines the search along inflated states"),
        (("critical", SINGLE, "--tolerance", "2"), "--tolerance: '2' is no share of the answer; give one"),
        (("modes", SINGLE, "--mesh-study", "--meshes", "6x8,8x12,12x16", "--divisions", "4x8"), "give one"),
        (("modes", SINGLE, "--meshes", "6x8,8x12,12x16"), "add --mesh-study"),
        (("critical", SINGLE, "--mesh-study", "--meshes", "6x8,8"), "--meshes: '6x8,8' is impossible"),
        (("critical", SINGLE, "--mesh-study", "--meshes", "6x8"), "mesh study"),
        (("modes", SINGLE, "--mesh-study", "--meshes", "8x12,8x12,12x16"),
         "--meshes: 8 x 12 divisions are no finer than 8 x 12 divisions; give meshes from coarse to fine"),
        (("critical", PUMPKIN, "--up-to", "1e-300"), "--limit: '1e-300' is no positive pressure (1e-15 to"),
        (("perturb", SINGLE, "--bend", "5", "--pressure", "0"),
         "perturb takes one pressure above 0, not 0 Pa; give --pressure 5, say"),
        (("sensitivities", PUMPKIN, "--harmonic", "40"),
         "--harmonic: 64 gores have the harmonics 0 to 32, not 40; give one of them"),
        (("sensitivities", PUMPKIN, "--harmonic", "4", "--set", "tendons.foreshortening=[[0, 0], [1, 0.02]]"),
         "tendons.foreshortening varies along the tendons, and sensitivities are by one number; give one"),
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
