"""`lobefem inflate` of pumpkins, and what other commands say to them."""

import math
from pathlib import Path

import numpy as np
import pytest

from lobefem.app import cli
from lobefem.viz.assumptions import assumptions
from lobefem.viz.verdict import verdict

from mpi4py import MPI

MESHES = Path(__file__).parents[3] / "meshes"
PUMPKIN, NASA = str(MESHES / "pumpkin.toml"), str(MESHES / "superpressure.toml")


def design(shared_path, **changes):
    """The shipped pumpkin with other lines, as a file of all ranks."""
    text = Path(PUMPKIN).read_text()
    for old, new in changes.values():
        assert old in text
        text = text.replace(old, new)
    if MPI.COMM_WORLD.rank == 0:
        (shared_path / "own.toml").write_text(text)
    MPI.COMM_WORLD.Barrier()
    return shared_path / "own.toml"


def test_the_shipped_pumpkin(lobefem_json):
    results, code = lobefem_json("inflate", PUMPKIN, "--divisions", "16x6")
    assert code == 0
    assert results["gores"] == 64
    assert results["volume"] == pytest.approx(363.1, rel=1e-3)
    assert 9.9 < results["tendon_diameter"] < results["diameter"] < 10.4
    assert results["height"] == pytest.approx(5.99, rel=2e-3)
    # the tendons bear what the gas presses on the equator's plane, and film and weight little of it
    tension = np.array(results["tendon_tension"])
    assert tension[8] == pytest.approx(100 * math.pi * 25 / 64, rel=0.05)
    assert len(results["stations"]) == len(results["bulge_half_angle"]) == len(tension) == 16
    assert results["hoop_tension"][0] == pytest.approx(tension.mean(), rel=0.01)
    assert math.degrees(results["bulge_half_angle"][8]) == pytest.approx(60, abs=1.5)
    area, rope = 308.398, 64 * 12.6103
    assert results["mass"] == pytest.approx(920 * 38e-6 * area + 0.01 * rope, rel=1e-4)
    assert results["lift"] is None
    assert 0.5e6 < results["max_stress"] < 1e6
    assert 0 < results["max_strain"] < 0.02
    assert verdict(results)[0] == "Equilibrium found at 100 Pa. Run lobefem modes to check its stability."
    assert assumptions(results) == ["closed load", "clamped"]
    assert results["warnings"] == []


def test_the_table_has_tendons_and_no_hoops(capfd):
    assert cli.main(["inflate", PUMPKIN, "--divisions", "8x4"]) == 0
    printed = MPI.COMM_WORLD.bcast(capfd.readouterr().out, root=0)
    assert "tendon tension, bottom middle top" in printed
    assert "hoop tension" not in printed


@pytest.mark.slow
def test_all_gores_are_one_gore(lobefem_json, shared_path):
    few = design(
        shared_path,
        gores=("gores = 64", "gores = 8"),
        cap=("[tendons]", "[[film.caps]]\nlength = 5\n[tendons]"),
    )
    coarse = (few, "--divisions", "8x4")
    one, _ = lobefem_json("inflate", *coarse)
    full, code = lobefem_json("inflate", *coarse, "--full")
    assert code == 0
    assert one["iterations"] > 0
    assert full["iterations"] == 0  # the state of one gore, in all of them, is theirs
    for key in ("volume", "strain_energy", "diameter", "tendon_diameter", "height", "mass", "max_stress"):
        assert full[key] == pytest.approx(one[key], rel=1e-8), key
    assert full["tendon_tension"] == pytest.approx(one["tendon_tension"], rel=1e-7)
    assert full["bulge_half_angle"] == pytest.approx(one["bulge_half_angle"], rel=1e-7)


@pytest.mark.slow
def test_nasas_superpressure_balloon(lobefem_json):
    """Published: 532 379 m^3, 114.5 m by 68.96 m. A model of uniform pressure gave 530 495 m^3, 115.13 m."""
    results, code = lobefem_json("inflate", NASA)
    assert code == 0
    assert results["volume"] == pytest.approx(532379, rel=0.01)
    assert results["volume"] == pytest.approx(530495, rel=0.003)
    assert results["diameter"] == pytest.approx(114.5, rel=0.02)
    assert results["diameter"] == pytest.approx(115.13, rel=0.003)
    assert results["height"] == pytest.approx(68.96, rel=0.03)
    assert 5954 < min(results["tendon_tension"]) < max(results["tendon_tension"]) < 6300
    assert results["max_stress"] == pytest.approx(8.4e6, rel=0.05)
    assert results["mass"] == pytest.approx(2331 + 2273, rel=0.02)
    assert results["lift"] == pytest.approx(0.084887 * results["volume"], rel=1e-12)
    assert results["taut_area"] > 0.98 * (results["taut_area"] + results["wrinkled_area"])


def test_tendons_that_are_slack_everywhere_are_told(lobefem_json, shared_path):
    loose = design(shared_path, tendons=("[tendons]", "[tendons]\nforeshortening = -0.1"),
                   law=('"tension-field"', '"isotropic"'), cut=('"flat"', '"lobe"'))  # fmt: skip
    results, code = lobefem_json("inflate", loose, "--divisions", "8x4", "--slack-stiffness", "0")
    assert code == 0
    assert set(results["tendon_tension"]) == {0.0}
    assert "the tendons are slack everywhere" in " ".join(results["warnings"])


def test_a_pumpkin_has_no_seams_to_bend(refused):
    code, said = refused("perturb", PUMPKIN, "--bend", "5", "--divisions", "4x2", "--order", "1")
    assert code == 2
    assert "needs seams, and the gores of a pumpkin have none; use --harmonic-seed or --cleft" in said


def test_full_is_for_pumpkins(refused):
    code, said = refused("inflate", str(MESHES / "single.toml"), "--full")
    assert code == 2
    assert "--full computes all gores of a pumpkin, and this design is none" in said


@pytest.mark.serial
def test_a_run_of_one_gore_is_kept(lobefem_json, tmp_path):
    run = str(tmp_path / "run")
    first, code = lobefem_json("inflate", PUMPKIN, "--divisions", "8x4", "--out", run, "--report")
    assert code == 0
    assert {"fields.xdmf", "state.npz", "report.html"} <= {path.name for path in Path(run).iterdir()}
    again, code = lobefem_json("inflate", PUMPKIN, "--divisions", "8x4", "--out", run, "--resume")
    assert code == 0
    assert again["volume"] == pytest.approx(first["volume"], rel=1e-10)
