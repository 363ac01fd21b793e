"""`lobefem sensitivities`: its table, and what it refuses."""

from pathlib import Path

import pytest

from lobefem.app import cli
from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.solver_options import NewtonOptions
from lobefem.io.design import Design
from lobefem.viz.sensitivity_table import sensitivity_table
from lobefem.viz.verdict import verdict

from mpi4py import MPI

PUMPKIN = str(Path(__file__).parents[3] / "meshes" / "pumpkin.toml")
COARSE = ("--divisions", "8x2")
MANY = ("--set", "shape.gores=96", *COARSE)  # far from converged


@pytest.mark.slow
def test_a_stable_harmonic_has_its_eigenvalue(lobefem_json):
    results, code = lobefem_json("sensitivities", PUMPKIN, *COARSE, "--harmonic", "4")
    assert code == 0
    assert results["critical_pressure"] is None
    assert "harmonic 4 loses no stability up to 1000 Pa" in results["warnings"][0]
    changes = {row["name"]: row["changes"] for row in results["parameters"]}
    assert len(changes) == 13
    sizes = [abs(row["changes"]["eigenvalue"]) for row in results["parameters"]]
    assert sizes == sorted(sizes, reverse=True)
    # wider gores have so much more film, and are less stable
    assert changes["half-width"]["film_area"] == pytest.approx(
        0.01 * results["quantities"]["film_area"], rel=0.02
    )
    assert changes["half-width"]["eigenvalue"] < 0
    parts = [changes[f"half-width at {s:g}"]["eigenvalue"] for s in (0.1, 0.3, 0.5, 0.7, 0.9)]
    assert sum(parts) == pytest.approx(changes["half-width"]["eigenvalue"], rel=0.2)  # all but the ends
    # what two solved states say of a half angle
    design = Design.load(PUMPKIN).with_overrides({"mesh.divisions": (8, 2)})
    angle, h = design.shape.half_angle, 1e-3
    volumes = []
    for share in (1 - h, 1 + h):
        other = design.with_overrides({"shape.half_angle": angle * share})
        volumes.append(
            inflate(
                other.balloon(other.surface(sector=True)), 100.0, options=NewtonOptions(rtol=1e-11)
            ).volume
        )
    found = changes["half angle"]["volume"]
    assert found == pytest.approx(0.01 * (volumes[1] - volumes[0]) / (2 * h), rel=1e-2)
    head, rows = sensitivity_table(results)
    assert head[:3] == ("", "step", "eigenvalue, %")
    assert len(rows) == 13
    assert "lowers the lowest eigenvalue of n = 4 by" in verdict(results)[0]


@pytest.mark.slow
def test_a_critical_pressure_and_its_report(capfd, shared_path):
    command = ["sensitivities", PUMPKIN, *MANY, "--harmonic", "4", "--json", str(shared_path / "found.json")]
    assert cli.main(command) == 0
    printed = MPI.COMM_WORLD.bcast(capfd.readouterr().out, root=0)
    assert "Sensitivities at 100 Pa, n = 4" in printed
    assert "p_cr, %" in printed
    assert "the critical pressure of n = 4 by" in printed


@pytest.mark.serial
def test_the_report_has_the_table(shared_path):
    command = ["sensitivities", PUMPKIN, *COARSE, "--harmonic", "4", "--limit", "120 Pa"]
    assert cli.main([*command, "--out", str(shared_path / "run"), "--report"]) == 0
    assert "What makes this balloon more stable" in (shared_path / "run" / "report.html").read_text()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((PUMPKIN,), "sensitivities are those of one harmonic; give it, --harmonic 4 say"),
        (
            (PUMPKIN, "--harmonic", "4", "--limit", "50 Pa"),
            "--limit is 50 Pa, and the design's pressure 100 Pa; give a higher one",
        ),
        ((PUMPKIN, "--harmonic", "33", *COARSE), "--harmonic: 64 gores have the harmonics 0 to 32, not 33"),
        (
            (PUMPKIN.replace("pumpkin", "stack4"),),  # before it is asked for what does not help it
            "lobefem sensitivities looks at pumpkins, and this design is of the kind 'isotensoid'",
        ),
    ],
)
def test_what_is_refused(refused, arguments, message):
    code, said = refused("sensitivities", *arguments)
    assert code == 2
    assert message in said
