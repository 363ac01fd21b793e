"""The demo of a tip displaced sideways, on a coarse stack of two."""

import json

import numpy as np
from loading import load

from mpi4py import MPI


def test_tip_displacement_softens_goes_back_and_returns(shared_path):
    """Fig. 22's shape on a coarse stack of two: stiff at first, soft beyond, never falling, and back."""
    demo = load("tip_displacement")
    numbers = demo.run([(6, 8)], 0.2, shared_path, lobes=2)
    free, touching = numbers["curves"].values()
    slopes = np.diff(free["reaction"]) / np.diff(free["parameter"])
    assert (slopes > 0).all()
    assert slopes[0] > 5 * slopes[-1]
    assert (np.diff(free["volume"]) < 0).all()
    assert max(free["residual"]) < 1e-7
    assert free["ledger_error"][-1] < 0.02
    # nothing touches
    np.testing.assert_allclose(touching["reaction"], free["reaction"], rtol=1e-6, atol=1e-6)
    assert touching["first_contact"] is None
    back = numbers["let_go"]
    assert back["difference"] < 1e-6
    assert back["damping"] == 0
    slow, fast = back["releases"]
    assert slow["outcome"] == fast["outcome"] == "returned"
    # a tenth of the damping: the same path in a tenth of the time
    np.testing.assert_allclose(fast["time"], np.array(slow["time"]) / 10, rtol=1e-3)
    np.testing.assert_allclose(fast["top"], slow["top"], atol=1e-4)
    if MPI.COMM_WORLD.rank == 0:
        assert json.loads((shared_path / "tip_displacement.json").read_text())["lobes"] == 2
        assert (shared_path / "tip_displacement.png").stat().st_size > 10_000
        assert "N/m at first" in demo.words(numbers)[0]


def test_the_mesh_study_writes_into_a_folder_that_is_not_there_yet(shared_path):
    demo = load("tip_displacement")
    out = shared_path / "new"
    rows = demo.mesh_study(out, MPI.COMM_WORLD, lambda text: None, [((4, 6), "quadrilateral", 1, 0.5)])
    assert rows[0]["force"] > 0
    assert rows[0]["stopped"] is None
    assert "| 4 x 6 | quadrilateral | 1 | 0.5 |" in demo.table(rows)
    if MPI.COMM_WORLD.rank == 0:
        assert json.loads((out / "mesh_study.json").read_text())["rows"][0]["grading"] == 0.5
