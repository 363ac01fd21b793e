"""The demo of a tip displaced sideways, on a coarse stack of two."""

import json

import numpy as np
from loading import load
from mpi4py import MPI


def test_tip_displacement_softens_and_stays_stable(shared_path):
    """Fig. 22's shape on a coarse stack of two: stiff at first, soft beyond, never falling."""
    demo = load("tip_displacement")
    numbers = demo.run([(8, 12)], 0.3, shared_path, lobes=2)
    (found,) = numbers["curves"].values()
    slopes = np.diff(found["reaction"]) / np.diff(found["parameter"])
    assert (slopes > 0).all()
    assert slopes[0] > 10 * slopes[-1]
    assert (np.diff(found["volume"]) < 0).all()
    assert max(found["residual"]) < 1e-7
    if MPI.COMM_WORLD.rank == 0:
        assert json.loads((shared_path / "tip_displacement.json").read_text())["lobes"] == 2
        assert (shared_path / "tip_displacement.png").stat().st_size > 10_000
        assert "N/m at first" in demo.words(numbers)[0]
