"""A sweep over nothing but the mesh is read as a mesh study."""

import pytest

from lobefem.app.sweep_meshes import mesh_study
from lobefem.viz.verdict import verdict

pytestmark = pytest.mark.serial

MESHES = ("24x32", [36, 48], "54x72")


def studied(pressures, meshes=MESHES, name="divisions"):
    return mesh_study([name], [{name: mesh} for mesh in meshes], pressures)


@pytest.mark.parametrize("name", ["divisions", "mesh.divisions"])
def test_three_meshes_have_a_limit(name):
    found = studied([2284.0, 2311.0, 2373.0], MESHES[::-1], name)
    assert [row["divisions"] for row in found["meshes"]] == [[24, 32], [36, 48], [54, 72]]
    assert found["mesh_behaviour"] == "converges"
    assert found["mesh_limit"] == pytest.approx(2263, abs=1)
    first, second = verdict({"command": "sweep", "of": "critical", "lobes": 4, **found})
    assert first == "The critical pressure is 2263 Pa ± 0.95 %."
    assert second == "Mesh: checked, ± 0.95 % (3 meshes, the finest of 54 x 72 divisions)."


def test_a_fall_is_named():
    found = studied([278.6, 164.9, 101.5])
    assert found["mesh_error"] is None
    first = verdict({"command": "sweep", "of": "critical", **found})[0]
    assert first.startswith("There is no critical pressure to quote: it falls as the mesh is refined")


def test_other_sweeps_are_no_mesh_studies():
    assert mesh_study(["divisions", "film"], [{}] * 3, [1.0] * 3) == {}
    assert studied([1.0, 2.0], MESHES[:2]) == {}
    assert studied([1.0, 2.0, 3.0], ("24x32", "32x24", "8x8")) == {}  # of one size
    assert studied([1.0, 2.0, 3.0], ("24x32", "none", 7)) == {}
    assert verdict({"command": "sweep", "of": "critical", "rows": []}) == []
