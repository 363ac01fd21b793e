"""The demo of both ways to pressurise: initial stress, and the prescribed load path."""

import json
import re

import numpy as np
import pytest
from loading import load

from mpi4py import MPI


@pytest.fixture(scope="module")
def load_path():
    return load("load_path")


@pytest.fixture(scope="module")
def pressurised(load_path, out):
    return load_path.run((6, 12), out / "load_path")


def test_both_pressurisations_agree_with_eq_4(load_path, comm):
    """Paper fig. 20 on its own mesh: sigma_phi of every ring within 1 %, sigma_theta within 1.2 % of it."""
    surface = load_path.lobed_cylinder(2, (24, 32), cell="quadrilateral", comm=comm)
    for film, options, low in (
        (load_path.Isotropic(), {"prestressed": True}, -0.012),
        (load_path.PrescribedPath(), {}, 0.0),
    ):
        state = load_path.inflate(load_path.stack(surface, film, **options), load_path.PRESSURE)
        assert state.steps == (load_path.PRESSURE,)
        stress = {name: np.array(v) for name, v in load_path.along_the_meridian(state).items()}
        for word in ("min", "mean", "max"):
            np.testing.assert_allclose(stress[f"phi {word}"], stress["eq. 4"], rtol=0.01)
        # the initial stress method leaves some compression, the load path none (paper sec. 6)
        assert ((stress["theta min"] / stress["eq. 4"]).min() < -0.005) == (low < 0)
        assert (stress["theta min"] / stress["eq. 4"]).min() >= low
        assert (stress["theta max"] / stress["eq. 4"]).max() < -low + 1e-5


def test_what_the_standard_law_makes_of_the_load_path(pressurised):
    initial, path, kept, bare = pressurised["cases"].values()
    assert path["hoop"]["share"] < 1e-5
    assert kept["hoop"]["share"] < 0.1 * initial["hoop"]["share"]
    assert initial["hoop"]["least"] < 0 < initial["hoop"]["largest"]
    # a law of the whole strain forgets the path: the hoop stress that was left out is back
    assert bare["hoop"]["share"] > 0.5
    assert bare["error"] > 0.2 > 10 * abs(kept["error"] - path["error"])


def test_secant_and_tangent_counts(pressurised):
    for row in pressurised["iterations"]:
        # the same tangent; the last iteration is for round-off, which differs
        assert abs(row["IMP, consistent"] - row["tension field"]) <= 1
        assert row["IMP, secant"] >= row["IMP, consistent"]
    assert row["wrinkled"] == pytest.approx(1)
    assert row["IMP, secant"] > 5 * row["IMP, consistent"]


def test_load_path_files(pressurised, out):
    folder = out / "load_path"
    assert json.loads((folder / "load_path.json").read_text(encoding="utf-8")) == pressurised
    assert (folder / "fig20.png").stat().st_size > 20_000
    text = (folder / "table.md").read_text(encoding="utf-8")
    for row in pressurised["iterations"]:
        assert f"| {row['case']} | {row['tension field']} | " in text


def test_load_path_demo_refuses_bad_divisions(load_path, shared_path, capsys):
    assert load_path.main(["--divisions", "1x32", "--out", str(shared_path)]) == 2
    if MPI.COMM_WORLD.rank == 0:
        assert re.search(r"demo: .*divisions.*1", capsys.readouterr().err)
