"""`lobefem perturb` of pumpkins: seeds, a sealed gas, and what is said of the end."""

import pytest

from lobefem.app import cli
from lobefem.viz.verdict import verdict

from mpi4py import MPI

DESIGN = """
[shape]
kind = "pumpkin"
equator_radius = "5 m"
gores = 8
fitting_radius = "25 cm"
lobe = "constant-angle"
half_angle = "60 deg"

[mesh]
divisions = [6, 4]
cell = "quadrilateral"
order = 1

[film]
E = "300 MPa"
nu = 0.4
thickness = "38 um"
slack_stiffness = 1e-5

[tendons]
EA = "100 kN"

[pressure]
value = "200 Pa"
{gas}
[cleft]
gores = 2
depth = "30 cm"
turn = "60 deg"
"""


@pytest.fixture
def design(shared_path):
    def write(gas=""):
        path = shared_path / "pumpkin.toml"
        if MPI.COMM_WORLD.rank == 0:
            path.write_text(DESIGN.format(gas=gas))
        MPI.COMM_WORLD.Barrier()
        return str(path)

    return write


@pytest.mark.slow
@pytest.mark.parametrize("gas", ["", 'gas = "isothermal"\nambient = "500 Pa"\n'], ids=["given", "sealed"])
@pytest.mark.parametrize("seed", [("--harmonic-seed", "2:0.05"), ("--cleft",)], ids=["harmonic", "cleft"])
def test_a_pumpkin_deploys(lobefem_json, design, seed, gas):
    results, code = lobefem_json("perturb", design(gas), *seed, "--release", "--steps", "4")
    assert code == 0
    assert results["outcome"] == "returned"
    assert results["contact"]
    assert results["symmetric_eigenvalue"] > 0
    assert results["symmetric_harmonic"] in range(5)
    assert results["min_eigenvalue"] == results["eigenvalues"][0]
    assert results["eigenvalues"][0] == pytest.approx(results["symmetric_eigenvalue"], rel=1e-5)
    assert abs(results["volume_deficit"]) < 1e-8
    assert abs(results["energy_above"]) < 1e-4 * results["energy"]["damping"]
    assert results["pressure_final"] == pytest.approx(200.0, rel=1e-6)
    assert results["contact_force"] == results["contact_area"] == 0
    assert results["energy"]["error"] < 0.01
    assert results["parameter"] == pytest.approx(0.25 if seed[1:] else 0.3)
    assert verdict(results)[0].startswith("The balloon returned to its shape after release")
    assert results["warnings"] == []


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--harmonic-seed", "4"), "--harmonic-seed: '4' has no amplitude"),
        (("--harmonic-seed", "4:deep"), "'deep' is no share of the radius and no length"),
        (("--harmonic-seed", "1:0.1"), "'1' is impossible; give an integer, 2 or more"),
        (("--harmonic-seed", "4:0"), "distorts nothing"),
        (("--cleft", "--set", "cleft.gores=5"), "more than half of the 8 gores"),
        (("--set", "pressure.ambient=5", "--cleft"), "ambient = 5 Pa has no effect under a given pressure"),
        ((), "perturb takes one distortion, not 0"),
    ],
)
def test_what_is_refused(design, capfd, options, message):
    assert cli.main(["perturb", design(), *options]) == 2
    if MPI.COMM_WORLD.rank == 0:
        assert message in " ".join(capfd.readouterr().err.split())


def test_a_sealed_gas_is_for_perturb(design, capfd):
    assert cli.main(["modes", design('gas = "isothermal"\n'), "--state", "inflated"]) == 2


def test_a_stack_has_no_gores_to_pull_in(capfd):
    assert cli.main(["perturb", "meshes/stack4.toml", "--pressure", "5", "--cleft"]) == 2
