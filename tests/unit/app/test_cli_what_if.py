"""`lobefem critical --what-if`: which assumption decides."""

from pathlib import Path

import pytest

from lobefem.app.what_if_command import changes
from lobefem.io.design import Design
from lobefem.viz.verdict import verdict

pytestmark = pytest.mark.serial

ROOT = Path(__file__).parents[3]
SINGLE, STACK4, PUMPKIN = (str(ROOT / "meshes" / f"{name}.toml") for name in ("single", "stack4", "pumpkin"))
REAL = ("--film", "tension-field", "--load", "closed", "--state", "inflated", "--divisions", "6x8")


def test_assumptions_without_a_part_in_the_answer_are_not_tried():
    def tried(**plates):
        return [
            words for words, _ in changes(Design.parse({"plates": plates, "pressure": {"load": "closed"}}))
        ]

    film = ["half the film stiffness", "double the film stiffness"]
    assert tried(support="clamped") == ["no bar", "load film", *film]
    assert tried(support="clamped", bar=False) == ["a rigid bar", "load film", *film]
    assert tried(support="clamped", bar="2 MN") == ["no bar", "a rigid bar", "load film", *film]
    assert tried(support="fixed") == film


@pytest.mark.slow
def test_the_bar_decides_and_the_film_scales_the_pressure(lobefem_json):
    """Beside a rigid bar and hoops of 2.15 GN the film's stiffness is all that a pressure can scale with."""
    results, code = lobefem_json("critical", STACK4, *REAL, "--what-if")
    assert code == 0
    rows = {row["change"]: row for row in results["what_if"]}
    given = rows["as given"]["critical_pressure"]
    assert given == results["critical_pressure"] > 0
    assert rows["no bar"]["critical_pressure"] is None or rows["no bar"]["critical_pressure"] > 2 * given
    assert rows["load film"]["settings"] == {"pressure.load": "film"}
    assert rows["half the film stiffness"]["critical_pressure"] == pytest.approx(given / 2, rel=0.01)
    assert rows["double the film stiffness"]["critical_pressure"] == pytest.approx(2 * given, rel=0.01)
    said = [sentence for sentence in verdict(results) if "' changes most: " in sentence]
    assert len(said) == 1
    alone, _ = lobefem_json("critical", STACK4, *REAL, "--bar", "none")
    assert alone["critical_pressure"] == rows["no bar"]["critical_pressure"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((SINGLE, "--mesh-study"), "--what-if and --mesh-study are two studies; give one of them"),
        ((PUMPKIN,), "lobefem sensitivities tells what a pumpkin's stability depends on"),
    ],
)
def test_what_it_does_not_go_with_is_refused(refused, arguments, said):
    code, words = refused("critical", *arguments, "--what-if")
    assert code == 2
    assert said in words
