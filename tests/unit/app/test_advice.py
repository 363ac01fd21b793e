"""What results warn of: designs, pressures and balances that make little sense."""

import pytest

from lobefem.app import advice
from lobefem.io.design import Design

pytestmark = pytest.mark.serial


@pytest.mark.parametrize(
    ("tables", "said"),
    [
        ({"shape": {"lobes": 2}}, "no hoops at the seams of the 2 lobes"),
        ({"shape": {"edge_radius": 1500.0}}, "a radius of 1500 m"),
        ({"shape": {"R0": 15.0}, "film": {"thickness": 0.038}}, "film of 38 mm is 1/395 of the radius"),
        ({"film": {"law": "isotropic", "slack_stiffness": 1e-4}}, "isotropic film has no slack part"),
    ],
)
def test_a_design_that_makes_little_sense(tables, said):
    assert any(sentence.startswith(said) for sentence in advice.of_design(Design.parse(tables)))


@pytest.mark.parametrize(
    "tables", [{}, {"shape": {"lobes": 2}, "hoops": {}}, {"shape": {"kind": "cylinder"}}]
)
def test_a_sound_design_is_not_warned_of(tables):
    assert advice.of_design(Design.parse(tables)) == []


@pytest.mark.parametrize("scale", [1e-3, 0.1, 10.0, 100.0])
@pytest.mark.parametrize("share", [0.02, 1.0, 40.0, 400.0])
def test_warnings_do_not_depend_on_the_size(scale, share):
    """Film of the same share of the radius, from two millimetres to 200 m."""

    def said(size):
        shape, film = {"edge_radius": 2.0 * size}, {"thickness": 5e-5 * size * share}
        return len(advice.of_design(Design.parse({"shape": shape, "film": film})))

    assert said(scale) == said(1.0) == (1 if share > 100 else 0)


def test_pressures_that_no_film_bears():
    design = Design.parse({"shape": {"R0": 4.0}})  # 5 % of 3.5 GPa in 0.05 mm
    limit = 0.05 * 3.5e9 * 5e-5 * 2 / 4.0
    assert advice.of_pressures(design, [0.99 * limit, None]) == []
    (said,) = advice.of_pressures(design, [5.0, 2.0 * limit])
    assert "about 350 MPa and strained by about 10 %" in said


def test_built_in_stress_that_a_design_leaves_out():
    assert advice.of_built_in(Design.parse({})) == []
    assert advice.of_built_in(Design.parse({"film": {"law": "isotropic"}})) == []
    (said,) = advice.of_built_in(Design.parse({"film": {"prestress": False}}))
    assert said.startswith("film.prestress = false has no effect here")
    (said,) = advice.of_design(Design.parse({"film": {"law": "tension-field", "hoop_slack": 1e-4}}))
    assert said.startswith("hoop_slack is part of the built-in stress")


def test_film_that_does_not_fold_is_distorted():
    for law in ("tension-field", "imp", "isotropic"):
        assert advice.of_distortion(Design.parse({"film": {"law": law}})) == []
    (said,) = advice.of_distortion(Design.parse({}))
    assert said.startswith("film with fixed wrinkles has no shear stiffness and does not fold")
    assert said.endswith("use --film tension-field or imp")


def test_shares_that_are_too_large():
    assert advice.of_balance(0.3) == advice.of_ledger(0.01) == []
    assert "2.4 of the load" in advice.of_balance(2.4)[0]
    assert advice.of_ledger(0.97)[0].startswith("97 % of the energy")
