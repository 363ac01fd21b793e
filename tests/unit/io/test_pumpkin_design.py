"""Pumpkins in design files: what their keys mean, and what is refused in which words."""

import math
import os
import tomllib
from pathlib import Path

import numpy as np
import pytest

from lobefem.errors import InputError
from lobefem.io.design import Design
from lobefem.io.gore_files import cutting_table
from lobefem.io.pumpkin_design import foreshortening
from lobefem.model.orthotropic import Orthotropic, OrthotropicTensionField

MESHES = Path(__file__).parents[3] / "meshes"
PUMPKIN = MESHES / "pumpkin.toml"

SHAPE = "[shape]\nkind = 'pumpkin'\nfitting_radius = 0.25\ngores = 64\n"
WHOLE = SHAPE + "equator_radius = 5\nhalf_angle = '60 deg'\n"
NATURAL = SHAPE + "curve = 'natural'\nlobe = 'flat'\n[fittings]\npayload = 10\n[film]\ndensity = 920\n"
TABLE = SHAPE + "equator_radius = 5\nlobe = 'table'\n"


def parse(text):
    return Design.parse(tomllib.loads(text))


@pytest.mark.parametrize("name", ["pumpkin", "superpressure"])
def test_shipped_designs_are_read_and_written_back(name):
    design = Design.load(MESHES / f"{name}.toml")
    assert parse(design.to_toml()) == design


def test_a_pumpkin_has_defaults_of_its_own():
    design = parse(WHOLE)
    assert (design.mesh.divisions, design.mesh.cell, design.mesh.order) == ((48, 8), "quadrilateral", 2)
    assert (design.film.law, design.pressure.load, design.plates.bar) == ("tension-field", "closed", False)
    assert (design.shape.curve, design.shape.lobe, design.shape.reference) == (
        "pumpkin", "constant-angle", "lobe",
    )  # fmt: skip
    assert not design.film.prestress
    assert design.gore.half_angle(np.array([3.0]))[0] == pytest.approx(math.pi / 3, rel=1e-15)


@pytest.mark.parametrize(
    ("size", "value"), [("equator_radius", 5.0), ("tendon_length", 12.610287458959784), ("volume", 343.0)]
)
def test_three_sizes(size, value):
    curve = parse(SHAPE + f"half_angle = '60 deg'\n{size} = {value}\n").curve
    assert {"equator_radius": curve.R0, "tendon_length": curve.arc_length, "volume": curve.volume}[
        size
    ] == pytest.approx(value, rel=1e-10)


def test_a_natural_shape_bears_its_payload():
    design = parse(NATURAL + "[pressure]\nvalue = 100\ngradient = 5\n")
    lift = 5 * design.curve.volume
    film = 9.80665 * 920 * 5e-5 * design.curve.area
    assert lift == pytest.approx(9.80665 * 10 + film, rel=1e-5)  # all that hangs on it
    assert design.size == design.curve.R0


def test_orthotropic_film():
    material = "[film]\nE1 = '212.5 MPa'\nE2 = '246.6 MPa'\nnu12 = 0.58\n"
    law = parse(WHOLE + material)._law("tension-field")
    assert isinstance(law, OrthotropicTensionField)
    assert (law.E1, law.E2, law.nu12) == (212.5e6, 246.6e6, 0.58)
    assert type(parse(WHOLE + material + "law = 'orthotropic'\n")._law("orthotropic")) is Orthotropic


def test_caps_are_layers_from_the_top():
    design = parse(
        WHOLE
        + "[mesh]\ndivisions = [8, 2]\n[[film.caps]]\nlength = 6\n[[film.caps]]\nlength = 3\nlayers = 3\n"
    )
    surface = design.surface(sector=True)
    balloon = design.balloon(surface)
    found = np.empty(16)
    found[surface.mesh.topology.original_cell_index] = balloon.layers.x.array
    rows = design.curve.arc_length / 8
    half = np.clip((rows * np.arange(1, 9) - (8 * rows - 6)) / rows, 0, 1)
    third = np.clip((rows * np.arange(1, 9) - (8 * rows - 3)) / rows, 0, 1)
    np.testing.assert_allclose(found.reshape(8, 2), np.repeat((1 + half + third * (2 - half))[:, None], 2, 1))
    assert parse(design.to_toml()) == design


def test_a_gore_table_is_read_beside_the_design(comm, shared_path):
    folder = shared_path / "designs"
    if comm.rank == 0:
        folder.mkdir()
        (folder / "gore.csv").write_text(
            "# a gore\ns/L, w [m]\n0, 0.1\n0.5, '0.3'\n1, 0.1\n".replace("'", "")
        )
        (folder / "pumpkin.toml").write_text(TABLE + "pattern = 'gore.csv'\n")
    comm.Barrier()
    design = Design.load(folder / "pumpkin.toml", comm)
    assert (design.shape.stations, design.shape.half_widths) == ((0.0, 0.5, 1.0), (0.1, 0.3, 0.1))
    assert design.shape.reference == "flat"
    assert parse(design.to_toml()) == design  # which needs no other file


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "cannot be read (No such file or directory); give a file beside the design"),
        ("", "is no table of text"),
        ("0, 0.1\n0.5 0.3\n1, 0.1\n", "has no pair of numbers in line 2"),
        ("s, w\n0, 0.1\n", "has less than two rows"),
    ],
)
def test_gore_tables_that_cannot_be_read(comm, shared_path, content, message):
    if comm.rank == 0:
        (shared_path / "pumpkin.toml").write_text(TABLE + "pattern = 'gore.csv'\n")
        if content is not None:
            (shared_path / "gore.csv").write_text(content)
    comm.Barrier()
    with pytest.raises(InputError) as caught:
        Design.load(shared_path / "pumpkin.toml", comm)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.serial
def test_a_gore_table_that_is_a_pipe_is_not_waited_for(tmp_path):
    (tmp_path / "pumpkin.toml").write_text(TABLE + "pattern = 'gore.csv'\n")
    os.mkfifo(tmp_path / "gore.csv")
    with pytest.raises(
        InputError, match=r"shape.pattern = 'gore.csv' is no file; give one beside the design"
    ):
        Design.load(tmp_path / "pumpkin.toml")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (SHAPE + "half_angle = 1\n", "shape.kind = 'pumpkin' lacks a size; give one of equator_radius, "
         "tendon_length or volume"),
        (WHOLE + "volume = 300\n", "shape.equator_radius = 5 and volume = 300 all give the size; give one"),
        (WHOLE.replace("gores = 64", ""), "shape.kind = 'pumpkin' lacks gores; give it"),
        (WHOLE.replace("60 deg", "100 deg"), "shape.half_angle: '100 deg' is 100 degrees; give 0 to 90"),
        (WHOLE.replace("0.25", "6"), "shape: the fitting radius 6 m is not smaller than the equator"),
        (SHAPE + "equator_radius = 5\n", "shape.lobe = 'constant-angle' lacks half_angle"),
        (WHOLE + "lobe = 'flat'\n", "shape.half_angle = 1.047 does not fit lobe = 'flat'; leave it out"),
        (WHOLE + "edge_radius = 2\n", "shape.edge_radius = 2.0 does not fit the kind 'pumpkin'"),
        (WHOLE + "lobes = 2\n", "shape.lobes = 2 does not fit the kind 'pumpkin'; leave it out"),
        (TABLE, "shape.lobe = 'table' lacks stations; give pattern"),
        (TABLE + "pattern = 'gore.csv'\n", "shape.pattern = 'gore.csv' is read with design files"),
        (TABLE + "stations = [0, 1]\nhalf_widths = [0.1, 0.1]\n", "less than the half chord"),
        (NATURAL + "[shape.x]\n", "'shape.x' is no key of [shape]"),
        (NATURAL.replace("lobe =", "volume = 3\nlobe ="), "shape.volume = 3 does not fit curve = 'natural'"),
        (NATURAL + "[pressure]\nvalue = 0\n", "shape: the pressure gradient is 0.0; give a positive number"),
        (WHOLE + "[film]\nE1 = 1e8\nE2 = 1e8\nnu12 = 1.2\n",
         "film.nu12 = 1.2 gives nu21 = nu12 E2/E1 = 1.2, and their product must be below 1"),
        (WHOLE + "[film]\nE1 = 1e8\n", "film.E1 is that of orthotropic film, which lacks E2"),
        (WHOLE + "[film]\nE1 = 1e8\nE = 1e8\n", "film.E = 1e+08 and E1 are of two materials; leave one out"),
        (WHOLE + "[film]\nlaw = 'imp'\n", "film.law = 'imp' does not fit a pumpkin; use isotropic"),
        (WHOLE + "[[film.caps]]\nlayers = 2\n", "film.caps.0.length is missing; give it"),
        (WHOLE + "[[film.caps]]\nlength = 1\nlayer = 2\n", "'film.caps.0.layer' is no key of [[film.caps]]; "
         "use length or layers (did you mean layers?)"),
        (WHOLE + "[film]\ncaps = 3\n", "film.caps: 3 is not a list of tables; write [[film.caps]]"),
        (WHOLE + "[hoops]\n", "hoops.enabled = true does not fit a pumpkin"),
        (WHOLE + "[plates]\nbar = true\n", "plates.bar = true does not fit a pumpkin, which has no bar"),
        (WHOLE + "[mesh]\nlayout = 'unstructured'\nsize = 1\n", "mesh.layout = 'unstructured' does not fit"),
        (WHOLE + "[fittings]\npayload = 1000\n[pressure]\ngradient = 5\n",
         "fittings.payload = 1000 kg weighs 9807 N, more than the lift of"),
        (WHOLE + "[tendons]\nforeshortening = 0.7\n", "tendons.foreshortening: 0.7 must be in (-0.5, 0.5)"),
        (WHOLE + "[tendons]\nforeshortening = [[0, 0], [1, 0.7]]\n", "foreshortening: 0.7 must be in"),
        (WHOLE + "[tendons]\nforeshortening = [[0, 0], [0.5, 0.1]]\n", "are no stations; let them ascend"),
        (WHOLE + "[tendons]\nforeshortening = [0, 0.1]\n", "is no table; give rows of a station and a share"),
        (WHOLE + "[tendons]\nforeshortening = 'short.csv'\n", "'short.csv' is read with design files"),
        ("[tendons]\nEA = 1\n", "[tendons] are those of a pumpkin, not of the kind 'isotensoid'"),
        ("[film]\ndensity = 920\n", "film.density = 920.0 is that of a pumpkin"),
    ],
)  # fmt: skip
def test_refusals_name_key_value_and_remedy(text, message):
    with pytest.raises(InputError) as caught:
        parse(text)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_foreshortening_is_a_table_in_the_design_or_beside_it(comm, shared_path):
    rows = ((0.0, 0.0), (0.5, 0.02), (1.0, 0.01))
    design = parse(WHOLE + "[tendons]\nforeshortening = [[0, 0], [0.5, 0.02], [1, 0.01]]\n")
    assert design.tendons.foreshortening == rows
    assert parse(design.to_toml()) == design
    if comm.rank == 0:
        (shared_path / "short.csv").write_text("station, share\n0, 0\n0.5, 0.02\n1, 0.01\n")
        (shared_path / "own.toml").write_text(WHOLE + "[tendons]\nforeshortening = 'short.csv'\n")
    comm.Barrier()
    assert Design.load(shared_path / "own.toml", comm) == design
    table = cutting_table(design.gore, foreshortening(design), 5)
    # of the lower half 1 % is taken, of the upper one 1.5 %
    half = design.curve.arc_length / 2
    assert table.tendon[2] == pytest.approx(0.99 * half, rel=1e-9)
    assert table.tendon[4] == pytest.approx(0.99 * half + 0.985 * half, rel=1e-9)
