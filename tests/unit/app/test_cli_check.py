"""`lobefem check`: a design in full, what is a default, and its size."""

from pathlib import Path

import pytest

from lobefem.app import cli
from lobefem.app.check_command import check, unknowns
from lobefem.io.design import Design

pytestmark = pytest.mark.serial

ROOT = Path(__file__).parents[3]
LOBES = {"shape": {"kind": "isotensoid", "lobes": 3, "edge_radius": 1.2}, "film": {"law": "tension-field"}}


def rows(tables):
    return {key: (value, origin, note) for key, value, origin, note in check(Design.parse(tables))[0]}


def test_each_key_says_whether_it_was_given():
    found = rows(LOBES | {"mesh": {"divisions": [8, 12]}})
    assert found["shape.edge_radius"] == ("1.2 m", "given", "")
    assert found["mesh.divisions"][1] == "given"
    assert found["film.E"] == ("3.5 GPa", "default", "")
    assert found["film.slack_stiffness"][1] == "default"  # it follows the law


def test_keys_that_decide_say_what_they_do():
    found = rows(LOBES | {"pressure": {"load": "closed"}})
    assert found["hoops.enabled"] == (
        "no",
        "default",
        "no hoops at the seams, for the file has no table of hoops",
    )
    assert "hoops.EA" not in found
    assert found["plates.bar"][1:] == (
        "default",
        "rigid: it decides much in a closed balloon; false if yours has none",
    )
    assert found["film.strength"] == ("none", "default", "nothing is compared with the film's stress")
    other = rows(
        {"hoops": {"enabled": False}, "plates": {"bar": False}, "pressure": {"load": "film"}, **LOBES}
    )
    assert other["hoops.enabled"][1:] == ("given", "no hoops at the seams, for enabled = false")
    assert other["plates.bar"][2] == ""
    assert other["pressure.load"][2].startswith("the gas does not press on the end plates")
    assert rows({"plates": {"support": "fixed"}, **LOBES})["plates.bar"][2] == ""
    assert rows({})["film.law"][2].startswith("the paper's film: its critical pressure goes to zero")
    assert rows({"hoops": {}, **LOBES})["hoops.EA"] == ("2.15 GN", "default", "")


def test_what_a_material_gives_is_no_default():
    hoops = {"material": "aluminium-6061-t6", "area": 4e-4}
    found = rows(LOBES | {"film": {"material": "mylar-a", "nu": 0.4}, "hoops": hoops})
    assert found["film.E"][:2] == ("4.805 GPa", "material")
    assert found["film.nu"][1] == "given"
    assert found["film.strength"][1] == "material"
    assert found["hoops.E"][1] == "material"
    assert found["hoops.EA"][:2] == ("27.56 MN", "E, area")
    said = check(Design.parse(LOBES | {"hoops": hoops}))[1]
    assert ", 2 follow from them, " in said[0]


@pytest.mark.parametrize("order", [1, 2])
def test_unknowns_are_those_of_the_balloon(order):
    design = Design.parse(LOBES | {"mesh": {"divisions": [4, 6], "order": order}})
    assert unknowns(design) == 3 * len(design.balloon(design.surface()).X) > 0
    size = {"mesh": {"layout": "unstructured", "size": 0.5}}
    assert unknowns(Design.parse(LOBES | size)) is None


def test_the_command_takes_the_options_of_the_others(capfd):
    stack4, pumpkin = (str(ROOT / "meshes" / f"{name}.toml") for name in ("stack4", "pumpkin"))
    assert cli.main(["check", stack4, "--bar", "none", "--divisions", "48x64"]) == 0
    said = capfd.readouterr().out
    assert "15 settings are given, 16 have their defaults." in said
    assert "The mesh has 37 056 unknowns" in said
    assert "plates.bar" in said
    assert cli.main(["check", pumpkin]) == 0
    assert "tendons.EA" in capfd.readouterr().out
