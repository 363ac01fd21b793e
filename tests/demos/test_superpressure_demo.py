"""NASA's superpressure balloon on coarse meshes."""

import json

import pytest
from loading import load

from mpi4py import MPI


@pytest.mark.slow
def test_demo_writes_sizes_and_stability(shared_path):
    demo = load("superpressure")
    numbers = demo.run((16, 4), out=shared_path, variants=1, comm=MPI.COMM_WORLD)
    *_, finer, finest = numbers["meshes"]
    for key in ("volume", "diameter", "height"):
        assert finest[key] == pytest.approx(finer[key], rel=2e-3), key
    assert finest["volume"] == pytest.approx(532_379, rel=0.01)
    assert finest["diameter"] == pytest.approx(114.5, rel=0.02)
    assert finest["height"] == pytest.approx(68.96, rel=0.025)
    theirs, ours = (numbers["another_program"][key] for key in ("theirs", "ours"))
    for key in ("volume", "diameter", "height"):
        assert ours[key] == pytest.approx(theirs[key], rel=3e-3), key
    assert ours["tension"] == pytest.approx(theirs["tension"], rel=0.01)
    (built,) = numbers["stability"]
    coarse, fine = built["meshes"]
    assert coarse["critical_pressure"] is fine["critical_pressure"] is None
    assert coarse["searched_to"] == demo.HIGHEST
    assert all(value > 0 for chart in fine["charts"].values() for value in chart)
    assert json.loads((shared_path / "superpressure.json").read_text())["published"] == demo.PUBLISHED
    assert (shared_path / "superpressure.png").read_bytes().startswith(b"\x89PNG")
    assert "more than 1000 Pa" in (shared_path / "tables.md").read_text()


@pytest.mark.slow
def test_gores_that_are_a_little_wider_are_unstable():
    """The published gores are stable by the width that the film stretches in the hoop."""
    demo = load("superpressure")
    found = demo.stability((16, 4), {"widths": 1.05})
    assert found["critical_pressure"] == 0
    assert min(found["charts"]["4"]) < 0
