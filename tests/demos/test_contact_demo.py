"""The demo of two lobes pressed together, on a coarse mesh."""

import pytest
from loading import load

from mpi4py import MPI

pytestmark = pytest.mark.serial


def test_contact_demo_presses_two_lobes_together(shared_path):
    """A lower plate closes the seam, and a shorter reach of the contact changes next to nothing."""
    rows = load("contact").run((8, 12), (0.0, -0.4, -0.8, -1.2, -1.6, -1.8, -2.0), shared_path)
    assert not any(row["intersects"] for row in rows)
    assert rows[0]["force"] == 0.0
    full, half, quarter = rows[-3:]
    assert 0 < quarter["gap"] < half["gap"] < full["gap"] < full["activation"]
    assert half["force"] == pytest.approx(full["force"], rel=0.05)
    assert quarter["force"] == pytest.approx(half["force"], rel=0.03)
    assert quarter["volume"] == pytest.approx(full["volume"], rel=5e-3)
    if MPI.COMM_WORLD.rank == 0:
        assert len((shared_path / "table.md").read_text(encoding="utf-8").splitlines()) == len(rows) + 2
