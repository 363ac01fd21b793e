"""Parts of a report without a browser: pairs, sorted units, what differs between runs, gores as copies."""

import base64
import json

import numpy as np
import pytest

from lobefem.io.design import Design
from lobefem.io.run_reader import Run, Step
from lobefem.viz import report_provenance, report_shapes, report_tables
from lobefem.viz.report_compare import comparison, with_meshes
from lobefem.viz.report_parameters import sweep
from lobefem.viz.report_part import part

pytestmark = pytest.mark.serial

NONE = np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)


def run(path, results, design=None, x=NONE[0], triangles=NONE[1], steps=()):
    tables = {} if design is None else json.loads(design.model_dump_json())
    owners = np.arange(len(triangles))
    return Run(path, tables, "", results, "", x, triangles, triangles, owners, steps)


def test_equal_modes_that_follow_each_other_are_one_row():
    modes = [{"kind": "sway", "harmonic": 1, "real": v} for v in (2.0, 2.0000001, 5.0)]
    modes += [{"kind": "twist", "harmonic": 0, "real": 7.0}] * 2
    assert [numbers for numbers, _ in report_tables.pairs(modes)] == [(1, 2), (3,), (4,), (5,)]


def test_a_column_has_one_unit(tmp_path):
    assert report_tables.column("pressure", "Pa", [2e5, None, 500.0]) == (
        "pressure [kPa]",
        ["200", "none", "0.5"],
    )
    table = report_tables.rows_of(("a", "b"), (["x", "y"], [1.0, -2.0]), "")
    assert table.numeric == (False, True)
    assert table.rows[1] == ("y", "\N{MINUS SIGN}2")


def test_the_design_shows_first_what_is_not_a_default(tmp_path):
    design = Design.parse({"shape": {"lobes": 3}, "film": {"thickness": "25 um"}})
    found = dict(report_provenance.changes(run(tmp_path, {}, design)).rows)
    assert found == {"shape.kind": "isotensoid", "shape.lobes": "3", "film.thickness": "0.025 mm"}
    assert report_provenance.changes(run(tmp_path, {}, Design.parse({}))).rows == (
        ("shape.kind", "isotensoid"),
    )


def compared(tmp_path, values):
    parts = []
    for around, pressure in values:
        design = Design.parse(
            {"mesh": {"divisions": [around // 2, around]}, "film": {"law": "tension-field"}}
        )
        results = {"command": "critical", "critical_pressure": pressure, "kind": "sway", "harmonic": 1,
                   "lobes": 1, "film": "tension-field", "divisions": [around // 2, around]}  # fmt: skip
        parts.append(part(run(tmp_path / f"m{around}", results, design), f"run-{around}", 1000, 2))
    return parts


def test_runs_that_differ_in_one_key_are_a_chart_against_it(tmp_path):
    parts = with_meshes(compared(tmp_path, [(48, 4040.0), (24, 5000.0), (32, 4100.0)]))
    section = comparison(parts)
    (chart,) = section.charts
    assert chart.series[0].x == [24.0, 32.0, 48.0]
    assert chart.series[0].y == [5000.0, 4100.0, 4040.0]
    assert section.sentences[0].startswith("From mesh to mesh the number changes by \N{MINUS SIGN}18 %, ")
    assert section.tables[0].head == ("run", "mesh.divisions", "answer", "at")
    assert mesh(parts[0]) == ("± 3.6 % (3 meshes)", "open")
    assert mesh(parts[2]) == ("\N{MINUS SIGN}18 % from 12×24", "open")
    two = with_meshes(compared(tmp_path, [(48, 4040.0), (32, 4100.0)]))
    assert mesh(two[0]) == ("\N{MINUS SIGN}1.5 % from 16×32", "good")


def mesh(part):
    return next((mark.text, mark.tone) for mark in part.headline.marks if mark.name == "Mesh")


@pytest.mark.parametrize(
    ("values", "mark", "said"),
    [
        (
            (5681.0, 5555.0, 5497.0),
            ("± 0.91 % (3 meshes)", "good"),
            "The runs are a mesh study: its limit is 5448 Pa ± 0.91 %.",
        ),
        (
            (278.6, 164.9, 101.5),
            ("falls with refinement: not for design", "bad"),
            "The runs are a mesh study: the number falls with refinement, with no limit in sight. Do not use",
        ),
        (
            (100.0, 300.0, 120.0),
            ("\N{MINUS SIGN}60 % from 24×48", "open"),
            "These meshes do not show a limit.",
        ),
    ],
)
def test_runs_that_differ_in_their_mesh_only_are_a_mesh_study(tmp_path, values, mark, said):
    parts = with_meshes(compared(tmp_path, zip((32, 48, 72), values, strict=True)))
    assert mesh(parts[-1]) == mark
    assert said in comparison(parts).sentences[0]


def test_a_law_brings_its_own_defaults_which_are_no_second_key(tmp_path):
    parts = []
    for law in ("isotropic", "tension-field"):
        results = {"command": "critical", "critical_pressure": 10.0, "film": law, "lobes": 1}
        parts.append(part(run(tmp_path / law, results, Design.parse({"film": {"law": law}})), law, 1000, 2))
    section = comparison(parts)
    assert section.tables[0].head == ("run", "film.law", "answer", "at")
    assert list(section.charts[0].x.names) == ["isotropic", "tension-field"]


def test_a_sweep_over_two_keys_is_a_curve_for_each_value_of_one(tmp_path):
    rows = [
        {"values": {"film.law": law, "shape.lobes": lobes}, "found": {"critical_pressure": 100.0 * lobes}}
        for law in ("isotropic", "fixed-wrinkles")
        for lobes in (1, 2, 3)
    ]
    chart = sweep(run(tmp_path, {"command": "sweep", "rows": rows}))
    assert [one.name for one in chart.series] == ["film.law = isotropic", "film.law = fixed-wrinkles"]
    assert chart.series[1].x == [1.0, 2.0, 3.0]


def test_one_gore_stands_for_all(tmp_path):
    """It is repeated as often as there are gores; its tendons and its two ends are known by its angle."""
    gores, rows, columns = 12, 4, 3
    angle, z = np.meshgrid(np.linspace(0, 2 * np.pi / gores, columns), np.linspace(-1, 1, rows))
    r = np.sqrt(2 - z**2)
    x = np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=2).reshape(-1, 3)
    at = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]
    triangles = np.concatenate([np.stack(t, axis=2).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    state = Step(5.0, {"displacement": 0.01 * x}, {})
    found = report_shapes.scene(run(tmp_path, {"gores": gores}, None, x, triangles, (state,)), 10**6)
    assert found.data["copies"] == gores

    def nodes(text):
        return np.frombuffer(base64.b64decode(text), "<u4").tolist()

    assert [nodes(line["nodes"]) for line in found.data["lines"]] == [at[:, 0].tolist(), at[:, -1].tolist()]
    assert [nodes(end) for end in found.data["plates"]] == [at[0].tolist(), at[-1].tolist()]
