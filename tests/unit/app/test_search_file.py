"""Search files: what they say, the designs they lead to, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from lobefem.app import search_file
from lobefem.errors import InputError

pytestmark = pytest.mark.serial

PUMPKIN = Path(__file__).parents[3] / "meshes" / "pumpkin.toml"

SEARCH = f"""
design = "{PUMPKIN}"
goal = "mass"
search_to = "1 kPa"
[set]
"mesh.divisions" = [8, 2]
[choose]
shape.gores = [48, 64]
[vary]
"shape.half_angle" = ["45 deg", "65 deg"]
[widths]
stations = [0.25, 0.5]
range = [0.9, 1.1]
[limits]
max_stress = "2 MPa"
critical_pressure = 300
"""


def load(path, old="", new=""):
    assert old in SEARCH
    (path / "search.toml").write_text(SEARCH.replace(old, new) if old else SEARCH)
    return search_file.load(path / "search.toml")


def test_a_search_and_its_designs(tmp_path):
    search = load(tmp_path)
    assert search.names == ("shape.half_angle", "half-width at 0.25", "half-width at 0.5")
    assert search.low == pytest.approx([np.radians(45), 0.9, 0.9])
    assert search.high == pytest.approx([np.radians(65), 1.1, 1.1])
    assert search.choices == ({"shape.gores": 48}, {"shape.gores": 64})
    assert search.limits == {"max_stress": 2e6, "critical_pressure": 300.0}
    assert search.harmonics == (3, 4, 5)
    assert search.base.mesh.divisions == (8, 2)
    design = search.design({"shape.gores": 48}, np.array([0.9, 1.05, 1.0]))
    drawn = search.base.with_overrides({"shape.gores": 48, "shape.half_angle": 0.9})
    shares = np.array([0.0, 0.25, 0.5, 1.0])
    s = shares * drawn.curve.arc_length
    factor = design.gore.half_width(s) / drawn.gore.half_width(s)
    assert factor == pytest.approx([1.0, 1.05, 1.0, 1.0], rel=1e-3)
    assert design.shape.lobe == "table"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('goal = "mass"', 'goal = "fame"', "goal = 'fame'"),
        ('goal = "mass"', "", "goal is missing; give it"),
        ("[set]", "[sets]", "sets is unknown; use design, goal, harmonics"),
        ("max_stress", "stress", "limits.stress is unknown; use max_stress, mass"),
        ('"2 MPa"', '"2 m"', "limits.max_stress = '2 m' is not a stress; give pascals"),
        ("[set]", '[set]\n"pressure.gas" = "isothermal"', "a search takes a given pressure, and"),
        ("[set]", '[set]\n"pressure.value" = 0', "pressure.value = 0 leaves the film without stress"),
        ('"2 MPa"', "0", "limits.max_stress = 0 must be above 0; give pascals"),
        ('"2 MPa"', '"-1 MPa"', "limits.max_stress = '-1 MPa' must be above 0"),
        ('"1 kPa"', "0", "search_to = 0 must be above 0; give pascals"),
        ('"1 kPa"', "nan", "search_to = nan is not a finite number"),
        ('["45 deg", "65 deg"]', '["65 deg", "45 deg"]', "must ascend"),
        ('["45 deg", "65 deg"]', '["65 deg"]', "must be the two ends between which it varies"),
        ('"shape.half_angle" = ["45 deg", "65 deg"]', '"shape.lobe" = ["flat", "table"]', "lobe"),
        ('"shape.half_angle" = ["45 deg", "65 deg"]', '"mesh.order" = [1, 2]',
         "vary.mesh.order = [1, 2] are whole numbers; list them in [choose]"),
        ("shape.gores = [48, 64]", '"shape.half_angle" = ["50 deg"]',
         "shape.half_angle stands in [choose] and in [vary]; leave it out of one"),
        ("[0.25, 0.5]", "[0.5, 0.25]", "must ascend between 0 and 1, as [0.25, 0.5, 0.75]"),
        ("[0.9, 1.1]", "[1.1, 0.9]", "must be two ascending factors from 0.5 to 2"),
        ("[48, 64]", "[]", "[choose] has a key without values"),
        ('goal = "mass"', 'goal = "mass"\nharmonics = [30]', "harmonics = [30] must lie from 0 to 24"),
        ('goal = "mass"', 'goal = "mass"\nharmonics = []', "harmonics = [] leaves no critical pressure"),
        ("pumpkin.toml", "stack4.toml", "is no pumpkin; only pumpkins are searched"),
        ("[set]", '[set]\n"shape.reference" = "lobe"', "widths need a design with shape.reference = 'flat'"),
    ],
)  # fmt: skip
def test_what_is_refused(tmp_path, old, new, message):
    with pytest.raises(InputError) as caught:
        load(tmp_path, old, new)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_film_without_mass_has_none_to_be_searched_for(tmp_path):
    light = "\n".join(
        line for line in PUMPKIN.read_text().splitlines() if not line.startswith(("density", "mass_per"))
    )
    (tmp_path / "light.toml").write_text(light)
    with pytest.raises(InputError, match=r"film and tendons without mass.*film\.density"):
        load(tmp_path, str(PUMPKIN), "light.toml")
