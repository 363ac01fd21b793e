"""`lobefem inflate`: its numbers."""

from pathlib import Path

import pytest

import lobefem

MESHES = Path(__file__).parents[3] / "meshes"
SINGLE, CYLINDER = str(MESHES / "single.toml"), str(MESHES / "cylinder.toml")
COARSE = ("--divisions", "6x10")


def test_the_common_problem(lobefem_json):
    """One lobe, both rims held, the top one 4 mm higher, unstressed tension-field film, 5 Pa.

    The volume is Surface Evolver's and NGSolve's, to the digits on which they agree.
    """
    lobe = lobefem.Isotensoid(3.8182)
    results, code = lobefem_json(
        "inflate", SINGLE, "--film", "tension-field", "--support", "fixed", "--lift", "4 mm",
        "--slack-stiffness", "1e-4", "--pressure", "5", "--edge-radius", repr(lobe.edge_radius),
        "--divisions", "24x32",
    )  # fmt: skip
    assert code == 0
    assert results["converged"] is True
    assert results["volume"] == pytest.approx(148.77577996, rel=1e-10)
    assert results["max_displacement"] == pytest.approx(0.004, rel=1e-12)
    assert results["iterations"] <= 10
    assert results["num_dofs"] == 3 * 25 * 32
    areas = [results[f"{kind}_area"] for kind in ("taut", "wrinkled", "slack")]
    assert areas[1] / sum(areas) > 0.9
    assert results["bar_force"] is None  # both rims are held
    assert results["hoop_tension"] == []
    assert results["pressure"] == 5.0
    assert results["strain_energy"] > 0
    assert 0 <= results["residual"] < 1e-6
    assert isinstance(results["reason"], str)


def test_the_cylinder_finds_the_isotensoids_form(lobefem_json):
    """The design's film stretches by 42 % to an isotensoid of its edge radius (paper figs 8-10)."""
    results, code = lobefem_json("inflate", CYLINDER, "--divisions", "12x16")
    lobe = lobefem.Isotensoid.from_edge_radius(2.0)
    assert code == 0
    # facets of 16 around enclose 16/(2 pi) sin(2 pi/16) = 0.974 of the volume
    assert results["volume"] == pytest.approx(0.974 * lobe.volume, rel=0.03)
    assert results["max_displacement"] == pytest.approx(lobe.R0 - 2.0, rel=0.03)


@pytest.mark.parametrize(
    ("options", "prestress"),
    [
        ((), 5.0),
        (("--no-prestress",), 0.0),
        (("--film", "isotropic"), 0.0),
        (("--film", "tension-field"), 0.0),
        (("--film", "isotropic", "--prestress"), 5.0),
    ],
)
def test_only_fixed_wrinkles_are_prestressed_unless_asked(lobefem_json, options, prestress):
    results, code = lobefem_json("inflate", SINGLE, *COARSE, "--pressure", "5", *options)
    assert code == 0
    assert results["prestress"] == prestress


def test_slack_stiffness_of_isotropic_film_is_said_to_do_nothing(lobefem_json):
    results, _ = lobefem_json("inflate", SINGLE, *COARSE, "--film", "isotropic", "--slack-stiffness", "1e-4")
    assert results["warnings"] == ["isotropic film has no slack part, so slack_stiffness has no effect"]
