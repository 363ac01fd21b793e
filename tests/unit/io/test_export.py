"""Tables and VTU files of runs: the numbers are those of the run."""

import csv
import json
import sys
from pathlib import Path

import numpy as np
import pytest
import pyvista

from lobefem import Isotensoid
from lobefem.app import cli
from lobefem.errors import InputError
from lobefem.io.export import export
from lobefem.io.run_reader import load_run

from mpi4py import MPI

ROOT = Path(__file__).parents[3]
SINGLE = str(ROOT / "meshes" / "single.toml")
alone = pytest.mark.serial


def table(path):
    with path.open(newline="") as stream:
        return list(csv.DictReader(stream))


@pytest.fixture
def run(shared_path):
    folder = shared_path / "run"
    arguments = ["--divisions", "6x8", "--pressure", "500", "--pressure", "1000", "--count", "3"]
    assert cli.main(["modes", SINGLE, *arguments, "--out", str(folder), "--quiet"]) == 0
    MPI.COMM_WORLD.Barrier()
    return folder


def test_every_run_folder_has_its_tables(run):
    """Eigenvalues as in results.json; N_m = p R0^2/(2 R) in each row of cells of the ideal state."""
    told = json.loads((run / "results.json").read_text())["pressures"]
    rows = table(run / "eigenvalues.csv")
    assert [float(row["pressure [Pa]"]) for row in rows] == [500.0] * 3 + [1000.0] * 3
    modes = [mode for entry in told for mode in entry["modes"]]
    assert [float(row["real [Pa/m]"]) for row in rows] == [mode["real"] for mode in modes]
    assert [row["kind"] for row in rows] == [mode["kind"] for mode in modes]
    rows = table(run / "stations.csv")
    assert len(rows) == 2 * 6
    heights = [float(row["height [m]"]) for row in rows[:6]]
    assert heights == sorted(heights)
    R0 = Isotensoid.from_edge_radius(2.0).R0
    for row in rows:
        p, R = float(row["pressure [Pa]"]), float(row["radius [m]"])
        assert float(row["N_m [N/m]"]) == pytest.approx(p * R0**2 / (2 * R), rel=0.15)
        assert row["deformed radius [m]"] == row["radius [m]"]
        assert float(row["wrinkled"]) == pytest.approx(1.0)
    assert not (run / "history.csv").exists()


def test_the_history_of_a_perturbation_is_a_table(shared_path):
    folder = shared_path / "push"
    arguments = ["--divisions", "4x6", "--film", "tension-field", "--load", "closed", "--pressure", "5",
                 "--tip-displacement", "0.01", "--steps", "2", "--no-contact"]  # fmt: skip
    assert cli.main(["perturb", SINGLE, *arguments, "--out", str(folder), "--quiet"]) == 0
    MPI.COMM_WORLD.Barrier()
    history = json.loads((folder / "results.json").read_text())["history"]
    rows = table(folder / "history.csv")
    assert [float(row["reaction [N]"]) for row in rows] == [one["reaction"] for one in history]
    assert [float(row["energy_strain [J]"]) for row in rows] == [one["ledger"]["strain"] for one in history]


@alone
@pytest.mark.parametrize("cell", [(), ("--cell", "quadrilateral"), ("--order", "2")])
def test_fields_as_vtu(tmp_path, cell, capsys):
    folder = tmp_path / "run"
    arguments = ["inflate", SINGLE, "--divisions", "4x8", "--pressure", "5", "--out", str(folder)]
    assert cli.main([*arguments, *cell]) == 0
    capsys.readouterr()
    assert cli.main(["export", str(folder), "--to", "vtu"]) == 0
    assert capsys.readouterr().out == f"Written: {folder / 'fields-1.vtu'}\n"
    grid, kept = pyvista.read(folder / "fields-1.vtu"), load_run(folder)
    np.testing.assert_allclose(grid.points, kept.x, rtol=0, atol=1e-6)
    np.testing.assert_allclose(grid["displacement"], kept.steps[0].nodal["displacement"])
    area = float(grid.compute_cell_sizes()["Area"].sum())
    results = json.loads((folder / "results.json").read_text())
    assert area == pytest.approx(
        sum(results[f"{k}_area"] for k in ("taut", "wrinkled", "slack")), rel=0.03
    )  # curved cells are cut
    # a new run leaves nothing of the old one behind
    assert cli.main([*arguments, "--overwrite"]) == 0
    assert not (folder / "fields-1.vtu").exists()


@alone
def test_tables_of_older_runs_are_made_again(run):
    text = (run / "stations.csv").read_text()
    (run / "stations.csv").unlink()
    assert {path.name for path in export(run.parent, "csv")} == {"eigenvalues.csv", "stations.csv"}
    assert (run / "stations.csv").read_text() == text


@alone
def test_what_cannot_be_exported_is_refused(tmp_path):
    with pytest.raises(InputError, match="--to: 'xls' is unknown; use csv, vtu or xlsx"):
        export(tmp_path, "xls")
    with pytest.raises(InputError, match="holds no run"):
        export(tmp_path, "csv")
    (tmp_path / "results.json").write_text('{"pressures": [3], "history": "x", "visited": [[1]]}')
    for kind in ("csv", "vtu"):
        with pytest.raises(InputError, match="holds no "):
            export(tmp_path, kind)


@alone
@pytest.mark.slow
def test_a_workbook_has_the_results_and_the_tables_as_numbers(run):
    openpyxl = pytest.importorskip("openpyxl")
    (path,) = export(run, "xlsx")
    book = openpyxl.load_workbook(path)
    assert book.sheetnames == ["results", "eigenvalues", "stations"]
    head, *rows = book["eigenvalues"].iter_rows(values_only=True)
    told = table(run / "eigenvalues.csv")
    assert list(head) == list(told[0])
    values = [float(one["real [Pa/m]"]) for one in told]
    assert [row[2] for row in rows] == pytest.approx(values, rel=1e-12)
    numbers = {row[0]: row[1:] for row in book["results"].iter_rows(values_only=True)}
    assert numbers["thickness"][0] == 5e-5
    assert numbers["thickness"][1] == "m"
    assert numbers["divisions"][0] == "6; 8"
    assert "mesh_error" not in numbers  # null


@alone
def test_text_in_a_workbook_is_no_formula(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    (tmp_path / "run.json").write_text("{}")
    (tmp_path / "design.toml").write_text("")
    (tmp_path / "results.json").write_text(json.dumps({"schema": 1, "command": "modes", "film": "=1+1"}))
    (path,) = export(tmp_path, "xlsx")
    cells = {row[0].value: row[1] for row in openpyxl.load_workbook(path)["results"].iter_rows()}
    assert (cells["film"].value, cells["film"].data_type) == ("=1+1", "s")


@alone
def test_without_openpyxl_a_workbook_names_the_way_out(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    (tmp_path / "run.json").write_text("{}")
    (tmp_path / "results.json").write_text(json.dumps({"schema": 1, "command": "modes"}))
    with pytest.raises(InputError, match="xlsx needs openpyxl: pip install"):
        export(tmp_path, "xlsx")
