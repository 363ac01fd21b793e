"""Maps of what a sweep over two numbers has found."""

import math

import numpy as np
import pytest

from lobefem.files import to_json
from lobefem.io.run_reader import load_run
from lobefem.viz.report import write_report
from lobefem.viz.sweep_map import draw_map, map_picture, sweep_map

pytestmark = pytest.mark.serial


def row(gores, angle, **found):
    values = {"shape.gores": gores, "shape.half_angle": angle}
    return {"values": values, "exit_code": 0, "reason": "", "found": found}


def swept(**changes):
    """Results of a sweep: p = 1e6/(N a), but one cell is stable, one is never, and one failed."""
    rows = []
    for n in (40, 80, 160):
        for angle in (30, 45, 60):
            pressure = 1e6 / (n * angle)
            row = {
                "values": {"shape.gores": n, "shape.half_angle": f"{angle} deg"},
                "exit_code": 0,
                "reason": "",
            }
            rows.append(row | {"found": {"critical_pressure": pressure}})
    rows[0]["found"] = {"critical_pressure": None}
    rows[8]["found"] = {"critical_pressure": 0.0}
    rows[2] |= {"exit_code": 3, "reason": "inflate stopped", "found": {}}
    varied = ["shape.gores", "shape.half_angle"]
    return {"of": "critical", "varied": varied, "rows": rows, "design_pressure": 250.0} | changes


def test_cells_lie_where_their_values_are():
    cells = sweep_map(swept())
    assert cells.x.tolist() == [40, 80, 160]
    assert cells.y.tolist() == [30, 45, 60]
    assert cells.units == ("", "deg")
    assert cells.pressure[1, 1] == pytest.approx(1e6 / (80 * 45))
    assert cells.pressure[1, 2] == pytest.approx(1e6 / (160 * 45))
    assert math.isinf(cells.pressure[0, 0])
    assert cells.pressure[2, 2] == 0
    assert np.isnan(cells.pressure[2, 0])
    assert cells.reasons == {(2, 0): "inflate stopped"}


def test_what_is_unstable_at_the_designs_pressure():
    unstable = sweep_map(swept()).unstable()
    assert unstable.tolist() == [[False, False, True], [False, False, True], [False, True, True]]


@pytest.mark.parametrize(
    "changes",
    [
        {"varied": ["shape.gores"]},
        {"of": "inflate"},
        {"rows": []},
        {"rows": [row(n, word) for n in (1, 2) for word in ("a", "b")]},
        {"rows": [row(1, angle) for angle in (1, 2)]},
    ],
)
def test_what_is_no_map(changes):
    assert sweep_map(swept(**changes)) is None


def test_the_drawn_map_says_what_its_cells_are():
    figure = draw_map(sweep_map(swept()))
    axes = figure.axes[0]
    assert axes.get_xlabel() == "gores"
    assert axes.get_ylabel() == "half angle [deg]"
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == [
        "stable up to the end of the search",
        "never stable in its search",
        "failed, see its reason in the table",
        "unstable at the design's 250 Pa",
    ]
    # cells with a fill or hatch of their own: one each, and three with a critical pressure below 250 Pa
    assert len(axes.patches) == 6


def test_a_map_without_any_critical_pressure_is_drawn():
    results = swept()
    for one in results["rows"]:
        one["found"] = {"critical_pressure": None}
    assert len(draw_map(sweep_map(results)).axes) == 1


def test_the_report_of_a_sweep_has_its_map(tmp_path):
    results = swept(schema=1, command="sweep", warnings=[])
    (tmp_path / "results.json").write_text(to_json(results))
    told = map_picture(load_run(tmp_path)).alt
    assert told.startswith(
        "Critical pressure from 138.9 Pa to 555.6 Pa over gores and half angle: of 9 cells 1 are"
    )
    assert told.endswith("1 are never stable, 1 failed.")
    page = write_report(tmp_path).read_text()
    assert told in page
    (tmp_path / "results.json").write_text(to_json(results | {"varied": ["shape.gores"]}))
    assert map_picture(load_run(tmp_path)) is None
