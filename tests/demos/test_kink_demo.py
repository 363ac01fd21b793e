"""The demo of the tension field's one-sided tangents, on coarse meshes."""

import numpy as np
import pytest
from loading import load

from mpi4py import MPI

pytestmark = pytest.mark.serial


def test_demo_of_the_kink(shared_path):
    numbers = load("kink").run((8, 16), out=shared_path, harmonics=(2,), around=(12, 16))
    for row, exact in zip(numbers["critical"], (45124,), strict=True):
        # the continuum's values of the wrinkled tangent, and what slack takes from them
        assert row["wrinkled"] == pytest.approx(exact, rel=0.03)
        values = [row["taut"], row["mean"], row["wrinkled"], *row["slack"].values()]
        assert (np.diff(values) < 0).all()
    lowest = [[mode["value"] for mode in modes] for modes in numbers["spectra"].values()]
    assert (np.diff(np.array([v[:6] for v in lowest]), axis=0) > 0).all()
    coarse, fine = numbers["mesh_study"]
    assert fine["wrinkled"] < fine["mean"]
    assert fine["wrinkled"] < coarse["wrinkled"]
    MPI.COMM_WORLD.Barrier()
    assert (shared_path / "kink.png").stat().st_size > 20_000
    assert "| 2 |" in (shared_path / "table.md").read_text(encoding="utf-8")
