"""Pictures and report of an inflated pumpkin: one gore stands for all."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from lobefem.app import cli
from lobefem.io.run_reader import load_run
from lobefem.viz import pumpkin_pictures
from lobefem.viz.pumpkin_pictures import STATIONS, all_gores, gore_map, is_one_gore, portrait
from lobefem.viz.report_pumpkin import pumpkin

PUMPKIN = Path(__file__).parents[3] / "meshes" / "pumpkin.toml"

pytestmark = [pytest.mark.serial, pytest.mark.slow]  # one process keeps one gore


def inflated(folder, *more):
    design = folder / "design.toml"
    design.write_text(PUMPKIN.read_text().replace("gores = 64", "gores = 16"))
    assert cli.main(["inflate", str(design), "--divisions", "12x4", "--out", str(folder / "run"), *more]) == 0
    return folder / "run"


@pytest.fixture(scope="module")
def one(tmp_path_factory):
    return inflated(tmp_path_factory.mktemp("one"))


@pytest.fixture(scope="module")
def full(tmp_path_factory):
    return inflated(tmp_path_factory.mktemp("full"), "--full")


def enclosed(shape):
    """Volume between triangles and fittings, whose rims are closed by fans [m^3]."""
    a, b, c = np.moveaxis(shape.points[shape.triangles], 1, 0)
    volume = np.einsum("ij,ij->", a, np.cross(b, c)) / 6
    for end, sense in ((0, -1), (-1, 1)):
        ring = shape.tendons[:, end]
        after = np.roll(ring, -1, axis=0)
        area = (ring[:, 0] * after[:, 1] - ring[:, 1] * after[:, 0]).sum() / 2
        volume += sense * area * ring[:, 2].mean() / 3
    return volume


def test_all_gores_enclose_the_volume(one, full):
    volumes = []
    for folder in (one, full):
        run = load_run(folder)
        shape = all_gores(run, run.steps[-1])
        assert shape.tendons.shape == (16, 25, 3)
        volumes.append(enclosed(shape))
        # of eight chords across arcs of 120 degrees: they leave out 2 % of the bulges' 14 %, and some along
        assert 0.985 < volumes[-1] / run.results["volume"] < 1
    assert volumes[0] == pytest.approx(volumes[1], rel=1e-8)


def test_one_gore_and_all_are_told_apart(one, full):
    assert is_one_gore(load_run(one))
    assert not is_one_gore(load_run(full))


@pytest.mark.parametrize("what", ["state", "stress", "curves"])
def test_lobefem_plot_draws_pumpkins(one, what, tmp_path, capfd):
    code = cli.main(["plot", str(one), "--what", what, "--width", "170", "--to", str(tmp_path / "p.png")])
    capfd.readouterr()
    assert code == 0
    with Image.open(tmp_path / "p.png") as image:
        assert image.width == pytest.approx(170 / 25.4 * 300, abs=2)
        assert len(image.convert("RGB").getcolors(1 << 22)) > 100


def test_a_pumpkin_is_painted_where_nothing_renders(one, monkeypatch):
    monkeypatch.setattr(pumpkin_pictures, "renders", lambda: False)
    run = load_run(one)
    figure = portrait(run, run.steps[-1])
    figure.canvas.draw()
    side, above = (axes.collections[0] for axes in figure.axes[:2])
    # the half that faces the viewer, less what the bulges hide and more what they show
    assert 0.4 * 16 * len(run.triangles) < len(side.get_paths()) < 0.7 * 16 * len(run.triangles)
    assert len(above.get_paths()) > 0.4 * 16 * len(run.triangles)


def test_a_narrow_picture_holds_its_words(one, monkeypatch):
    monkeypatch.setattr(pumpkin_pictures, "renders", lambda: False)
    run = load_run(one)
    figure = portrait(run, run.steps[-1], 85.0)
    figure.canvas.draw()
    for text in figure.texts:
        box = text.get_window_extent()
        assert figure.bbox.x0 <= box.x0 <= box.x1 <= figure.bbox.x1, text.get_text()


def test_the_gore_is_as_wide_and_long_as_it_is(one):
    run = load_run(one)
    axes = gore_map(run, run.steps[-1]).axes[0]
    box = axes.collections[0].get_datalim(axes.transData)
    assert box.y1 == pytest.approx(12.61, rel=5e-3)  # a tendon of r0 = 5 m and fittings of 25 cm
    assert box.width == pytest.approx(2 * 5 * np.sin(np.pi / 16), rel=0.2)


def test_charts_by_station(one):
    run = load_run(one)
    found = pumpkin(run).charts
    assert len(found) == len(STATIONS)
    assert found[0].series[0].y == run.results["tendon_tension"]
    # p = N_h/rho + N_m/R at the equator, R = r0/2 of the tendons and 2/3 of the bulge's rise more
    keys = ("hoop_resultant", "bulge_radius", "meridional_resultant")
    hoop, radius, along = (run.results[key][6] for key in keys)
    assert hoop / radius + along / (2.5 + 0.37) == pytest.approx(100, rel=0.07)  # means, on 4 columns


def test_the_report_shows_the_balloon(one):
    assert cli.main(["report", str(one)]) == 0
    page = (one / "report.html").read_text()
    for title in ("All 16 gores at 100 Pa", "One gore at 100 Pa", "Radius of the bulge"):
        assert title in page, title
    assert "16 gores, tension-field film" in page
    results = json.loads((one / "results.json").read_text())
    assert results["reference_volume"] == pytest.approx(results["volume"], rel=0.05)
