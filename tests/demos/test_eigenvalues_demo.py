"""The demo of eigenvalue curves on coarse meshes."""

import numpy as np
import pytest
from loading import load

from mpi4py import MPI

pytestmark = pytest.mark.serial


@pytest.fixture(scope="module")
def paths(tmp_path_factory):
    """The demo of held and inflated states, and where it wrote to."""
    folder = MPI.COMM_WORLD.bcast(tmp_path_factory.mktemp("paths"), root=0)
    return load("eigenvalues").run((4, 24), (500.0, 4000.0, 16000.0), folder, around=(), count=16), folder


def rank_zero(numbers, state, case, kind, harmonic):
    (found,) = [
        b
        for b in numbers[state]["cases"][case]["branches"]
        if (b["kind"], b["harmonic"], b["rank"]) == (kind, harmonic, 0)
    ]
    return found


@pytest.mark.parametrize("state", ["held", "inflated"])
@pytest.mark.parametrize("size", ["single", "stack"])
def test_global_modes_of_held_and_of_inflated_lobes_rise(paths, state, size):
    for kind, harmonic in (("sway", 1), ("twist", 0)):
        branch = rank_zero(paths[0], state, f"{size}, fixed-wrinkles", kind, harmonic)
        assert branch["pressures"][:2] == [500, 4000]
        assert (np.array(branch["values"]) > 0).all()
        assert (np.diff(branch["values"]) > 0).all()


@pytest.mark.parametrize("size", ["single", "stack"])
def test_inflated_wrinkled_film_crosses_near_the_held_one_and_below(paths, size):
    held, inflated = (paths[0][s]["cases"][f"{size}, fixed-wrinkles"] for s in ("held", "inflated"))
    assert 0.8 * held["critical_pressure"] < inflated["critical_pressure"] < held["critical_pressure"]
    assert inflated["critical_harmonic"] == held["critical_harmonic"]
    assert inflated["point"] == "bifurcation"
    assert inflated["projection"] < 1e-6
    stable, unstable = inflated["bracket"]
    assert stable <= inflated["critical_pressure"] <= unstable
    # the curve of that harmonic says the same
    local = rank_zero(paths[0], "inflated", f"{size}, fixed-wrinkles", "local", held["critical_harmonic"])
    assert local["values"][-1] < 0


def test_isotropic_film_that_the_gas_stretches_has_no_local_mode(paths):
    """One lobe stays stable; a stack that bulges enough goes sideways as a whole."""
    single, stack = (paths[0]["inflated"]["cases"][f"{size}, isotropic"] for size in ("single", "stack"))
    assert single["critical_pressure"] is None
    assert min(min(b["values"]) for b in single["branches"]) > 0
    assert stack["critical_harmonic"] == 1
    assert paths[0]["held"]["cases"]["stack, isotropic"]["critical_pressure"] > 1e5
    assert not any(b["kind"] == "local" for case in (single, stack) for b in case["branches"])


def test_each_redrawn_figure_stands_beside_the_papers_words(paths):
    numbers, folder = paths
    text = (folder / "eigenvalues.md").read_text(encoding="utf-8")
    for figure in (13, 15, 17, 19):
        for state in ("held", "inflated"):
            assert (folder / f"fig{figure}_{state}.png").read_bytes().startswith(b"\x89PNG")
            assert f"](fig{figure}_{state}.png)" in text
            for row in numbers[state]["paper"]:
                assert row["here"] in text
    sections = text.split("## Fig. ")[1:]
    assert [s[:2] for s in sections] == ["13", "15", "17", "19"]
    assert "4600 Pa" in sections[0]
    assert "3000 Pa" in sections[2]
