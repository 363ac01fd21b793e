"""The demo of table 2 on a coarse mesh."""

import json

import pytest
from loading import load

pytestmark = pytest.mark.serial


@pytest.fixture(scope="module")
def demo():
    """With half of the lobes."""
    module = load("table2")
    module.LOBES = 2
    return module


def test_a_bent_stack_returns_and_a_stopped_one_seems_to_stay(demo, out):
    case = next(c for c in demo.matrix([4.0]) if c.name == "closed, pinned, bend 4 degrees")
    numbers = demo.run((4, 6), [case], out, dampings=(1000.0,))
    name = f"4x6, {case.name}"
    found = numbers["runs"][name]
    assert found["outcome"] == "returned"
    assert found["volume_imposed"] < found["volume_final"]
    assert found["volume_final"] == pytest.approx(found["volume_original"], rel=1e-9)
    assert found["energy"]["error"] < 1e-2
    assert found["residual"] < 1e-6
    assert found["min_eigenvalue"] > 1
    # the constraint's work is the energy above the original's, and goes all into damping
    assert found["energy"]["damping"] == pytest.approx(found["work_of_constraint"], rel=1e-2)
    (stopped,) = numbers["stopped"][name]
    assert stopped["outcome"] == "not an equilibrium"
    assert stopped["middle"] > 0.8 * found["middle_imposed"]
    assert found["volume_imposed"] < stopped["volume"] < found["volume_final"]
    assert stopped["work_of_fading_forces"] < 0
    written = json.loads((out / "table2.json").read_text(encoding="utf-8"))
    assert written["runs"][name]["outcome"] == "returned"
    pictures = ["fig23_4", "landscape", f"fig24_{case.file}", f"ledger_{case.file}"]
    assert all((out / f"{picture}.png").stat().st_size > 20_000 for picture in pictures)
    # what is on file is not done again
    assert demo.run((4, 6), [case], out, numbers=written)["runs"] == written["runs"]
    assert any("returned" in line for line in demo.words(written))
