"""Design files that come with lobefem: the same in the source tree and in a package, with their schema."""

import json
import tomllib
from importlib import resources
from pathlib import Path

import pytest

from lobefem.app import cli
from lobefem.errors import InputError
from lobefem.io.design import Design
from lobefem.io.design_schema import design_schema
from lobefem.io.shipped_designs import copy_design, needed_files, read_design, shipped_designs

MESHES = Path(__file__).parents[3] / "meshes"


def test_a_package_holds_the_files_of_meshes():
    held = {f.name: f.read_bytes() for f in (resources.files("lobefem") / "designs").iterdir() if f.is_file()}
    there = {file.name: file.read_bytes() for file in MESHES.iterdir() if file.is_file()}
    assert held.items() >= {n: b for n, b in there.items() if not n.endswith(".py")}.items()


def test_every_shipped_design_is_listed_with_a_title():
    titles = shipped_designs()
    assert set(titles) == {file.stem for file in MESHES.glob("*.toml")}
    assert titles["stack4"].startswith("The paper's balloon: four lobes")
    assert not any(title.endswith("sec") for title in titles.values())


@pytest.mark.parametrize("name", sorted(shipped_designs()))
def test_a_copied_design_has_all_that_it_reads(name, tmp_path):
    path, *others = copy_design(name, tmp_path)
    assert Design.load(path) == Design.load(MESHES / f"{name}.toml").with_overrides(
        {"shape.file": str(tmp_path / "airbeam.msh")} if name == "airbeam" else {}
    )
    assert [file.name for file in others] == [*needed_files(name), "design.schema.json"]
    with pytest.raises(InputError, match="exists; give another --out"):
        copy_design(name, tmp_path)


def test_new_prints_a_design(capfd, comm):
    assert cli.main(["new", "stack4"]) == 0
    assert capfd.readouterr().out == (read_design("stack4") if comm.rank == 0 else "")
    assert cli.main(["new", "stak4"]) == 2
    if comm.rank == 0:
        assert "(did you mean stack4?)" in capfd.readouterr().err


@pytest.mark.serial
def test_the_schema_beside_the_designs_is_that_of_the_models(capsys):
    assert cli.main(["schema"]) == 0
    text = capsys.readouterr().out
    assert text == design_schema()
    found = (MESHES / "design.schema.json").read_text(encoding="utf-8")
    assert found == text, "lobefem schema > meshes/design.schema.json"
    for file in MESHES.glob("*.toml"):
        assert file.read_text(encoding="utf-8").startswith("#:schema design.schema.json\n")


def test_the_schema_takes_the_shipped_designs_and_nothing_else():
    jsonschema = pytest.importorskip("jsonschema")
    check = jsonschema.Draft202012Validator(json.loads(design_schema()))
    for file in MESHES.glob("*.toml"):
        check.validate(tomllib.loads(file.read_text(encoding="utf-8")))
    for wrong in (
        {"film": {"thicknes": 1.0}},
        {"shape": {"kind": "cube"}},
        {"shape": {"lobes": 0}},
    ):
        assert not check.is_valid(wrong)
    assert check.is_valid({"plates": {"bar": "2.15 GN"}, "mesh": {"divisions": "24x32"}})
    assert check.is_valid({"pressure": {"value": [100, "2 kPa"]}})
