"""`lobefem modes`, `critical` and `harmonics` of pumpkins."""

from pathlib import Path

import h5py
import numpy as np
import pytest

from lobefem import Design
from lobefem.app import cli
from lobefem.app.pumpkin_stability import search_end
from lobefem.equilibrium.inflation import inflate
from lobefem.stability import find_modes
from lobefem.viz.verdict import verdict

from mpi4py import MPI

PUMPKIN = str(Path(__file__).parents[3] / "meshes" / "pumpkin.toml")

COARSE = ("--divisions", "8x2")

# far from converged, and unstable soon; light, for weight on the bottom fitting sways at low pressure
LIGHT = {"shape.gores": 160, "shape.reference": "lobe", "film.density": 1.0, "tendons.mass_per_length": 0.0}
MANY = (PUMPKIN, *COARSE, *(f"--set={key}={value}" for key, value in LIGHT.items()))


def gore(*changes):
    """The balloon of one gore of the shipped pumpkin."""
    design = Design.load(PUMPKIN).with_overrides({"mesh.divisions": [8, 2]} | dict(changes))
    return design.balloon(design.surface(sector=True))


def test_modes_of_all_harmonics_from_one_gore(lobefem_json):
    results, code = lobefem_json("modes", PUMPKIN, *COARSE, "--pressure", "50", "--pressure", "100")
    assert code == 0
    assert results["state"] == "inflated"
    assert results["gores"] == 64
    assert results["looked_at"] == list(range(33))
    low, high = results["pressures"]
    balloon = gore()
    state = inflate(balloon, 50.0)
    own = find_modes(state, 8, harmonics=range(33))
    for entry, found in ((low, own), (high, find_modes(inflate(balloon, 100.0), 8, harmonics=range(33)))):
        assert [mode["real"] for mode in entry["modes"]] == pytest.approx(found.values.real, rel=1e-6)
        assert entry["num_negative"] == found.num_negative
        assert entry["stable"] is found.stable
        lowest = {row["harmonic"]: row["lowest"] for row in entry["by_harmonic"]}
        assert list(lowest) == list(range(33))
        assert min(lowest.values()) == pytest.approx(found.lowest, rel=1e-6)
        assert lowest[7] == pytest.approx(found.by_harmonic[7][1], rel=1e-6)
    said = verdict(results)
    assert "Stable at 100 Pa." in said
    # of 18 kg on its bottom fitting the low pressure does not hold it upright
    assert "Unstable at 50 Pa: the balloon sways sideways." in said


def test_a_range_of_harmonics(lobefem_json):
    results, code = lobefem_json("modes", PUMPKIN, *COARSE, "--harmonics", "2:4", "--count", "2")
    assert code == 0
    assert results["looked_at"] == [2, 3, 4]
    assert {row["harmonic"] for row in results["pressures"][0]["by_harmonic"]} == {2, 3, 4}
    assert results["pressures"][0]["num_negative"] is None


def test_the_first_loss_of_stability(lobefem_json):
    results, code = lobefem_json("critical", *MANY, "--up-to", "600")
    assert code == 0
    critical, n = results["critical_pressure"], results["harmonic"]
    balloon, state = gore(*LIGHT.items()), None
    for share, sign in ((0.998, 1), (1.002, -1)):
        state = inflate(balloon, share * critical, start=state)
        assert sign * find_modes(state, 1, harmonics=range(81)).lowest > 0
    assert find_modes(state, 1, harmonics=range(81)).modes[0].harmonic == n
    assert results["kind"] == "global"
    assert results["point"] == "bifurcation"
    assert results["searched_to"] < 600.0
    assert results["critical_pressure"] < results["searched_to"]
    assert results["stable"][0][1] == results["critical_pressure"]
    assert results["max_stress"] > 0
    assert [len(curve["values"]) for curve in results["curves"]] == [len(results["visited"])] * 81
    said = verdict(results)[0]
    assert said.startswith("Stable up to ")
    assert f"buckles as a whole ({n} waves around)" in said


def test_no_loss_up_to_the_end_of_the_search(lobefem_json):
    results, code = lobefem_json("critical", PUMPKIN, *COARSE, "--up-to", "300", "--harmonic", "3")
    assert code == 0
    assert results["critical_pressure"] is None
    assert results["searched_to"] == results["limit"] == 300.0
    assert results["only_harmonic"] == 3
    assert "no instability found up to 300 Pa" in results["reason"]
    assert verdict(results)[0].startswith(
        "Stable in harmonic 3 (no other was looked at) up to 300 Pa, the end of"
    )


def test_stability_that_is_gained(lobefem_json):
    results, code = lobefem_json("harmonics", PUMPKIN, *COARSE, "--up-to", "100", "--harmonics", "1,3",
                                 "--set", "film.density=1840")  # fmt: skip
    assert code == 0
    sway, other = results["chart"]
    assert sway["critical_pressure"] is other["critical_pressure"] is None
    assert other["stable_from"] < sway["stable_from"]
    assert sway["stable_from"] == results["stable"][0][0]
    assert [(c["harmonic"], c["lost"]) for c in results["crossings"]] == [(3, False), (1, False)]
    # at this pressure the sway has no stiffness
    balloon = gore(("film.density", 1840.0))
    below, above = (
        find_modes(inflate(balloon, share * sway["stable_from"]), 1, harmonics=[1]).lowest
        for share in (0.99, 1.01)
    )
    assert below < 0 < above
    assert "below" in verdict(results)[0]


def test_critical_pressures_by_harmonic(lobefem_json):
    results, code = lobefem_json("harmonics", *MANY, "--up-to", "400", "--harmonics", "3:5")
    assert code == 0
    by_harmonic = {row["harmonic"]: row["critical_pressure"] for row in results["chart"]}
    assert results["critical_pressure"] == min(p for p in by_harmonic.values() if p)
    one, _ = lobefem_json("critical", *MANY, "--up-to", "400", "--harmonic", "4")
    assert one["critical_pressure"] == pytest.approx(by_harmonic[4], rel=2e-3)


def test_a_run_is_kept_and_gone_on_with(lobefem_json, refused, shared_path):
    run = shared_path / "run"
    arguments = ("critical", *MANY, "--up-to", "600", "--harmonic", "4")
    first, code = lobefem_json(*arguments, "--out", run)
    assert code == 0
    again, code = lobefem_json(*arguments, "--out", run, "--resume")
    assert code == 0
    assert again["critical_pressure"] == first["critical_pressure"]
    assert again["curves"] == first["curves"]
    names = {path.name for path in run.iterdir()}
    assert {"fields.xdmf", "state.npz", "checkpoint.npz", "eigenvalues.png", "eigenvalues.csv"} <= names
    with h5py.File(run / "fields.h5") as file:
        mode = np.array(file["Function/mode_1/0"])
    assert len(mode) == 160 * 4 * 17  # nodes of all gores, four columns each
    assert np.linalg.norm(mode, axis=1).max() == pytest.approx(1.0)
    for what in ("modes", "curves"):
        assert cli.main(["plot", str(run), "--what", what]) == 0
    assert cli.main(["report", str(run)]) == 0
    text = MPI.COMM_WORLD.bcast((run / "report.html").read_text() if MPI.COMM_WORLD.rank == 0 else "")
    assert "are damaged" not in text
    assert "Stability is lost at" in text


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("modes", "--state", "ideal"), "a pumpkin has no ideal state"),
        (("critical", "--state", "ideal"), "a pumpkin has no ideal state"),
        (("modes", "--harmonics", "0:40"), "--harmonics: 64 gores have the harmonics 0 to 32, not 33"),
        (("critical", "--harmonic", "33"), "--harmonic: 64 gores have the harmonics 0 to 32, not 33"),
        (("harmonics", "--harmonics", "50"), "--harmonics: 64 gores have the harmonics 0 to 32, not 50"),
        (("critical", "--up-to", "-3"), "no positive pressure"),
        (("modes", "--harmonics", "5:2"), "holds no integer"),
    ],
)
def test_what_cannot_be_is_refused(refused, arguments, text):
    command, *options = arguments
    code, said = refused(command, PUMPKIN, *COARSE, *options)
    assert code == 2
    assert text in said


def test_stacks_know_no_search_of_harmonics(refused):
    single = str(Path(PUMPKIN).with_name("single.toml"))
    code, said = refused("harmonics", single, "--divisions", "4x8", "--up-to", "100")
    assert code == 2
    assert "--limit is for searches along inflated states" in said


def test_the_default_end_of_a_search():
    """Film that bulges on a radius rho is strained by p rho/(E t), a tendon by p pi r0^2/(N EA)."""
    design = Design.load(PUMPKIN)
    rho = 5.0 * np.sin(np.pi / 64) / np.sin(np.radians(60))
    by_film = 0.05 * 300e6 * 38e-6 / rho
    by_tendons = 0.05 * 1e5 * 64 / (25 * np.pi)
    assert search_end(design) == pytest.approx(min(by_film, by_tendons), rel=5e-3)
    assert search_end(design.with_overrides({"pressure.value": [5000.0]})) == 10000.0
    MPI.COMM_WORLD.Barrier()
