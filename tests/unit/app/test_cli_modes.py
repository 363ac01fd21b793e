"""`lobefem modes`: its numbers."""

from pathlib import Path

import pytest

import lobefem

SINGLE = str(Path(__file__).parents[3] / "meshes" / "single.toml")
COARSE = ("--divisions", "6x10")


def test_the_modes_of_the_single_lobe(lobefem_json):
    """docs/validation.md, R0 = 4.2/1.1 m: 47.70 +- 0.031i (sway), 156.6 (twist), both to 1 %."""
    radius = lobefem.Isotensoid(4.2 / 1.1).edge_radius
    results, code = lobefem_json(
        "modes", SINGLE, "--edge-radius", repr(radius), "--count", "3",
        "--pressure", "1000", "--pressure", "2 kPa",
    )  # fmt: skip
    assert code == 0
    assert [entry["pressure"] for entry in results["pressures"]] == [1000.0, 2000.0]
    first, second = results["pressures"]
    assert [m["kind"] for m in first["modes"]] == ["sway", "sway", "twist"]
    assert [m["harmonic"] for m in first["modes"]] == [1, 1, 0]
    assert [m["real"] for m in first["modes"]] == pytest.approx([47.70, 47.70, 156.6], rel=1e-3)
    assert [m["imag"] for m in first["modes"]] == pytest.approx([0.031, -0.031, 0], abs=1e-3)
    assert max(m["residual"] for m in first["modes"]) < 1e-6
    assert first["stable"] is True
    assert second["modes"][0]["real"] > first["modes"][0]["real"]
    assert results["state"] == "ideal"
    assert results["mass"] == "unit"


def test_modes_of_some_harmonics(lobefem_json):
    options = ("--divisions", "6x10", "--count", "4")
    some, code = lobefem_json("modes", SINGLE, *options, "--harmonics", "2:3")
    assert code == 0
    found = some["pressures"][0]["modes"]
    assert {m["harmonic"] for m in found} <= {2, 3}
    full, _ = lobefem_json("modes", SINGLE, "--divisions", "6x10", "--count", "30")
    values = [m["real"] for m in full["pressures"][0]["modes"] if m["harmonic"] in (2, 3)]
    assert [m["real"] for m in found] == pytest.approx(values[:4], rel=1e-8)


def test_a_mass_of_one_a_node_gives_other_eigenvalues_of_the_same_modes(lobefem_json):
    unit, _ = lobefem_json("modes", SINGLE, *COARSE, "--count", "1")
    nodal, _ = lobefem_json("modes", SINGLE, *COARSE, "--count", "1", "--mass", "nodal")
    one, other = (r["pressures"][0]["modes"][0] for r in (unit, nodal))
    assert one["kind"] == other["kind"] == "sway"
    assert one["real"] != pytest.approx(other["real"], rel=0.1)


def test_modes_of_inflated_states(lobefem_json):
    """Fixed wrinkles with prestress hardly move: the modes are close to those held."""
    options = (*COARSE, "--count", "1", "--pressure", "50", "--pressure", "100")
    held, _ = lobefem_json("modes", SINGLE, *options)
    inflated, code = lobefem_json("modes", SINGLE, *options, "--state", "inflated")
    assert code == 0
    assert inflated["state"] == "inflated"
    for a, b in zip(held["pressures"], inflated["pressures"], strict=True):
        assert a["modes"][0]["real"] == pytest.approx(b["modes"][0]["real"], rel=0.1)
        assert b["state_residual"] < 1e-8 < a["state_residual"]
