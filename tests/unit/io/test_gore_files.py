"""A gore's cutting table and drawings."""

import builtins
import math
import re
from pathlib import Path
from xml.etree import ElementTree

import ezdxf
import numpy as np
import pytest

from lobefem.app import cli
from lobefem.errors import InputError
from lobefem.geometry.gore import ConstantAngle, Gore
from lobefem.geometry.pumpkin_curve import PumpkinCurve
from lobefem.io.gore_files import COLUMNS, cutting_table, save_gore

pytestmark = pytest.mark.serial

MESHES = Path(__file__).parents[3] / "meshes"


@pytest.fixture(scope="module")
def gore():
    return Gore(PumpkinCurve(5.0, (0.25, 0.25)), 64, ConstantAngle(math.radians(60)))


def test_the_table(gore):
    table = cutting_table(gore, foreshortening=0.01, marks=11)
    assert table.s.shape == (11,)
    # (excess of the centre line) 2 H sin(pi/N) tan(alpha/2), of a constant angle
    excess = 2 * gore.curve.height * math.sin(math.pi / 64) * math.tan(math.pi / 6)
    assert table.length - gore.curve.arc_length == pytest.approx(excess, rel=0.02)
    assert table.width / 2 == pytest.approx(
        5 * math.sin(math.pi / 64) / math.sin(math.pi / 3) * math.pi / 3, rel=1e-6
    )
    assert table.tendon[-1] == pytest.approx(0.99 * gore.curve.arc_length, rel=1e-12)
    np.testing.assert_allclose(np.diff(table.tendon), table.tendon[1], rtol=1e-12)
    # the seam of a tapered gore is longer than its centre line, and marks lie on it
    assert table.seam[-1] > table.length
    fine = cutting_table(gore, marks=401)
    assert table.seam[-1] == pytest.approx(fine.seam[-1], rel=1e-6)
    assert table.area == pytest.approx(fine.area, rel=1e-4)


def test_the_files(gore, tmp_path):
    table = cutting_table(gore, marks=11)
    csv, svg, dxf = save_gore(tmp_path / "new", table, {"gores": 64, "note": "a < b"})
    lines = csv.read_text().splitlines()
    assert lines[:3] == ["# gores: 64", "# note: a < b", ", ".join(COLUMNS)]
    rows = np.array([[float(v) for v in line.split(",")] for line in lines[3:]])
    np.testing.assert_allclose(
        rows, np.stack([table.s, table.half_width, table.seam, table.tendon], 1), atol=1e-6
    )
    root = ElementTree.parse(svg).getroot()
    # user units are millimetres: the drawing is at 1:1
    box = [float(v) for v in root.get("viewBox").split()]
    assert root.get("width") == f"{box[2]:.3f}mm"
    assert box[2] == pytest.approx(1e3 * table.length + 20, abs=1e-3)
    points = np.array(
        [[float(v) for v in p.split(",")] for p in root.find(".//{*}polygon").get("points").split()]
    )
    assert np.ptp(points, axis=0) == pytest.approx([1e3 * table.length, 1e3 * table.width], abs=2e-3)
    assert len(re.findall("M", root.findall(".//{*}path")[1].get("d"))) == 2 * 11
    drawing = ezdxf.readfile(dxf)
    assert drawing.units == ezdxf.units.MM
    (outline,) = drawing.modelspace().query("LWPOLYLINE")
    np.testing.assert_allclose(np.array(outline.get_points("xy")), points, atol=1e-3)
    assert len(drawing.modelspace().query('LINE[layer=="MARKS"]')) == 2 * 11
    assert {text.dxf.text for text in drawing.modelspace().query("TEXT")} == {"gores: 64", "note: a < b"}


def test_without_ezdxf_one_sentence(gore, tmp_path, monkeypatch):
    plain = builtins.__import__

    def without(name, *rest):
        if name == "ezdxf":
            raise ImportError(name)
        return plain(name, *rest)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(InputError, match=r"needs ezdxf, which is not installed; pip install ezdxf"):
        save_gore(tmp_path / "new", cutting_table(gore), {})
    assert not (tmp_path / "new").exists()


def test_the_command(tmp_path, capfd):
    assert cli.main(["gores", str(MESHES / "superpressure.toml"), "--out", str(tmp_path / "cut")]) == 0
    said = capfd.readouterr().out
    assert "280" in said
    assert "1.3056" in said  # twice the table's 0.6528 m
    assert {path.name for path in (tmp_path / "cut").iterdir()} == {"gore.csv", "gore.svg", "gore.dxf"}
    assert cli.main(["gores", str(MESHES / "superpressure.toml"), "--out", str(tmp_path / "cut")]) == 2
    assert "holds a gore already; give another --out, or --overwrite" in capfd.readouterr().err
    assert (
        cli.main(["gores", str(MESHES / "pumpkin.toml"), "--out", str(tmp_path / "cut"), "--overwrite"]) == 0
    )


def test_other_designs_have_no_gores(tmp_path, capfd):
    assert cli.main(["gores", str(MESHES / "single.toml"), "--out", str(tmp_path / "cut")]) == 2
    assert "cuts pumpkins, and this design is of the kind 'isotensoid'" in capfd.readouterr().err
