"""The laws of the paper's sec. 4, and the stress that a load path sets up, from the command line."""

from pathlib import Path

import pytest

from lobefem.app import cli

STACK = str(Path(__file__).parents[3] / "meshes" / "stack4.toml")
COARSE = ("--lobes", "2", "--divisions", "4x8", "--pressure", "5")
PATH = ("--film", "tension-field", "--setup", "load-path")


def test_imp_finds_the_tension_fields_equilibrium(lobefem_json):
    volumes = []
    for law in ("imp", "tension-field"):
        results, code = lobefem_json("inflate", STACK, *COARSE, "--film", law)
        assert code == 0
        assert results["film"] == law
        volumes.append(results["volume"])
    assert volumes[0] == pytest.approx(volumes[1], rel=1e-10)


def test_the_law_that_takes_over_keeps_the_load_paths_shape(lobefem_json):
    path, _ = lobefem_json("inflate", STACK, *COARSE, "--film", "load-path")
    assert path["strain_energy"] is None
    kept, code = lobefem_json("inflate", STACK, *COARSE, *PATH)
    bare, _ = lobefem_json("inflate", STACK, *COARSE, "--film", "tension-field")
    assert code == 0
    assert kept["prestress"] == 0.0  # none in closed form
    assert kept["strain_energy"] > 0
    assert abs(kept["volume"] - path["volume"]) < 0.1 * abs(bare["volume"] - path["volume"])


@pytest.mark.serial
@pytest.mark.slow
def test_a_balloon_that_a_load_path_set_up_is_distorted_and_returns(lobefem_json):
    results, code = lobefem_json(
        "perturb", STACK, *COARSE, *PATH, "--load", "closed", "--bend", "2", "--steps", "2", "--release"
    )
    assert code == 0
    assert results["outcome"] == "returned"
    assert results["volume_imposed"] < results["volume_original"]
    assert results["volume_final"] == pytest.approx(results["volume_original"], rel=1e-8)
    assert results["energy"]["error"] < 0.05


def test_its_inflated_state_has_modes(lobefem_json):
    results, code = lobefem_json("modes", STACK, *COARSE, *PATH, "--state", "inflated", "--count", "2")
    assert code == 0
    assert results["pressures"][0]["stable"] is True


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("modes", *PATH, "--pressure", "5"),
            "film.setup = 'load-path' finds its stress in the inflated state",
        ),
        (("modes", "--film", "load-path"), "film.law = 'load-path' finds its stress in the inflated state"),
        (
            ("perturb", "--film", "load-path", "--pressure", "5", "--bend", "2"),
            "film.law = 'load-path' is a way",
        ),
        (
            ("inflate", "--setup", "load-path", "--pressure", "5", "--no-prestress"),
            "leave out prestress = false",
        ),
        (("inflate", "--setup", "path"), "--setup: 'path' is unknown; use initial-stress or load-path"),
    ],
)
def test_what_does_not_go_together_is_said_in_one_sentence(capfd, comm, arguments, message):
    command, *options = arguments
    assert cli.main([command, STACK, *options]) == 2
    said = " ".join(capfd.readouterr().err.split())
    if comm.rank == 0:
        assert message in said
        assert said.count("lobefem:") == 1


def test_no_search_through_pressures_with_the_stress_of_one(capfd, comm, shared_path):
    design = shared_path / "path.toml"
    if comm.rank == 0:
        design.write_text("[film]\nlaw = 'tension-field'\nsetup = 'load-path'\n[pressure]\nvalue = 5\n")
    comm.barrier()
    for arguments, message in (
        (
            ("critical", "--state", "inflated"),
            "sets up the stress of one pressure, and a search goes through",
        ),
        (("critical",), "finds its stress in the inflated state"),
        (("harmonics",), "finds its stress in the inflated state"),
    ):
        command, *options = arguments
        assert cli.main([command, str(design), *options]) == 2
        said = " ".join(capfd.readouterr().err.split())
        assert comm.rank or message in said
