"""Designs on a mesh of one's own: sections, building, refusals, the command line."""

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

from lobefem.errors import InputError
from lobefem.io.design import Design
from tests.builders import gmsh_file, tube

from mpi4py import MPI

COMM = MPI.COMM_WORLD
AIRBEAM = Path(__file__).parents[3] / "meshes" / "airbeam.toml"
SHAPE = {"kind": "mesh", "file": "beam.msh"}


def written(path, text):
    """A file with a text, on all ranks."""
    if COMM.rank == 0:
        path.write_text(text, encoding="utf-8")
    COMM.Barrier()
    return path


def test_a_mesh_lies_beside_its_design_file(shared_path, monkeypatch):
    monkeypatch.chdir("/")
    file = written(shared_path / "beam.toml", '[shape]\nkind = "mesh"\nfile = "in/beam.msh"\n')
    assert Design.load(file, COMM).shape.file == str(shared_path / "in" / "beam.msh")
    assert Design.parse({"shape": SHAPE}).shape.file == "beam.msh"


def test_the_airbeam_survives_being_written():
    design = Design.load(AIRBEAM)
    assert design.mesh.divisions is None
    assert not design.has_plates
    assert design.fixed[0].components == "xyz"
    assert design.cables[0].EA == 2e4
    again = written_design(design)
    assert again == design
    assert again.to_toml() == design.to_toml()
    assert "[supports]" not in design.to_toml()


def written_design(design):
    """The design as it is read after it was written."""
    return Design.parse(tomllib.loads(design.to_toml()))


@pytest.mark.parametrize("name", ['say "beam".msh', "a\\b.msh", "tab\t.msh", "ä\x7f.msh"])
def test_any_file_name_survives_being_written(name):
    design = Design.parse({"shape": SHAPE | {"file": name}})
    assert written_design(design).shape.file == name


def test_defaults_of_a_mesh():
    design = Design.parse({"shape": SHAPE, "fixed": {"on": "rim"}})
    assert design.film.law == "tension-field"
    assert not design.film.prestress
    assert [part.components for part in design.fixed] == ["xyz"]
    assert Design.parse({"shape": SHAPE, "film": {"law": "isotropic"}}).film.law == "isotropic"
    step = Design.parse(
        {"shape": SHAPE | {"file": "a.STEP"}, "mesh": {"layout": "unstructured", "size": 0.1}}
    )
    assert step.mesh.size == 0.1
    assert written_design(step) == step


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        ({"shape": {"kind": "mesh"}}, "shape.file is missing"),
        ({"shape": {"file": "a.msh"}}, "shape.file = 'a.msh' does not fit the kind 'isotensoid'"),
        ({"shape": SHAPE | {"file": ""}}, "is no file; give that of a mesh"),
        ({"shape": SHAPE | {"lobes": 2}}, "lobes = 2 does not fit the kind 'mesh'"),
        ({"shape": SHAPE, "film": {"law": "imp"}}, "film.law = 'imp' follows a lobe's own directions"),
        ({"shape": SHAPE, "film": {"prestress": True}}, "needs an isotensoid; leave it out for a mesh"),
        ({"shape": SHAPE, "hoops": {}}, r"hoops are on seams.*\[\[cables\]\]"),
        ({"shape": SHAPE, "mesh": {"divisions": [24, 32]}}, r"mesh.divisions = \[24, 32\] does not fit"),
        ({"shape": SHAPE, "mesh": {"order": 2}}, "mesh.order = 2 does not fit 'beam.msh', which has cells"),
        ({"shape": SHAPE | {"file": "a.stp"}}, "mesh.size is missing"),
        (
            {
                "shape": SHAPE | {"file": "a.stp"},
                "mesh": {"layout": "unstructured", "size": 1, "cell": "quadrilateral"},
            },
            "mesh.cell = 'quadrilateral' does not fit 'a.stp', which is meshed in triangles",
        ),
        ({"shape": SHAPE, "plates": {"bottom": "a"}}, "plates.bottom = 'a' lacks a top"),
        ({"shape": SHAPE, "plates": {"support": "pinned"}}, "plates.support = 'pinned' is of end plates"),
        ({"plates": {"bottom": "a", "top": "b"}}, "plates.bottom needs a mesh of your own"),
        ({"fixed": [{"on": "rim"}]}, "fixed needs a mesh of your own"),
        ({"supports": {"free": True}}, "supports.free needs a mesh of your own"),
        ({"supports": {"free": 1}}, "supports.free: 1 is neither true nor false"),
        ({"shape": SHAPE, "supports": {"free": True}, "fixed": [{"on": "a"}]}, "fixed holds film that supp"),
        ({"cables": [{"on": "rim", "EA": 1e4}]}, "cables needs a mesh of your own"),
        ({"shape": SHAPE, "fixed": 5}, r"fixed: 5 is not a table; write \[\[fixed\]\]"),
        ({"shape": SHAPE, "fixed": [{"on": "a"}, 5]}, r"fixed\[1\]: 5 is not a table; write \[\[fixed\]\]"),
        ({"shape": SHAPE, "fixed": [{}]}, r"fixed\[0\].on is missing; give the name"),
        ({"shape": SHAPE, "fixed": [{"on": 3}]}, r"fixed\[0\].on: 3 is no name"),
        ({"shape": SHAPE, "fixed": [{"on": "a", "components": "xw"}]}, r"components: 'xw' are no components"),
        ({"shape": SHAPE, "fixed": [{"on": "a", "compnents": "x"}]},
         r"fixed\[0\].compnents' is no key of \[\[fixed\]\]; use on or components \(did you mean components"),
        ({"shape": SHAPE, "cables": [{"on": "a"}]}, r"cables\[0\].EA is missing; give the stiffness"),
        ({"shape": SHAPE, "cables": [{"on": "a", "EA": -1}]}, r"cables\[0\].EA: -1 must be positive"),
        (
            {"shape": SHAPE, "cables": [{"on": "a", "EA": 1, "rest_length": 1, "foreshortening": 0.1}]},
            r"cables\[0\].rest_length = 1.0 and foreshortening = 0.1 both give",
        ),
    ],
)  # fmt: skip
def test_what_does_not_go_with_a_mesh_is_refused(tables, words):
    with pytest.raises(InputError, match=words):
        Design.parse(tables)


def test_a_change_of_the_mesh_is_refused_by_its_option():
    with pytest.raises(InputError, match=r"mesh.divisions = \[6, 9\] does not fit"):
        Design.load(AIRBEAM).with_overrides({"mesh.divisions": "6x9"})


TUBE = """
[shape]
kind = "mesh"
file = "tube.msh"
[film]
E = "1 GPa"
thickness = "0.1 mm"
[pressure]
load = "closed"
value = "10 kPa"
"""


def test_rims_that_plates_close(shared_path):
    """The tube between two plates: its end force is carried by the film."""
    gmsh_file(shared_path / "tube.msh", tube)
    text = TUBE + '[plates]\nbottom = "left"\ntop = "right"\nbar = false\n'
    design = Design.load(written(shared_path / "tube.toml", text), COMM)
    balloon = design.balloon(design.surface(COMM))
    assert balloon.plates.support == "clamped"
    assert balloon.reference_volume == pytest.approx(math.pi * 0.2**2, rel=0.05)
    assert balloon.axis.direction == pytest.approx([1, 0, 0])


def test_a_cable_s_length_at_rest(shared_path):
    """Of the whole edge, here a polygon of the circle; one that is too far off is refused."""
    gmsh_file(shared_path / "tube.msh", tube)
    cable = '[[fixed]]\non = "left"\n[[cables]]\non = "right"\nEA = 1e4\nrest_length = {}\n'
    design = Design.load(written(shared_path / "tube.toml", TUBE + cable.format(1.2)), COMM)
    surface = design.surface(COMM)
    assert surface.length("right") == pytest.approx(2 * math.pi * 0.2, rel=0.03)
    cables = design.balloon(surface).cables
    assert cables[0].foreshortening == pytest.approx(1 - 1.2 / surface.length("right"), rel=1e-12)
    assert cables[0].tension_only
    far = Design.load(written(shared_path / "far.toml", TUBE + cable.format(12)), COMM)
    with pytest.raises(InputError, match=r"cables\[0\].rest_length = 12 m is far from the 1.2"):
        far.balloon(surface)
    with pytest.raises(InputError, match="no edge group 'skin' on this surface"):
        surface.length("skin")


def test_curved_edges_have_their_arc_length(shared_path):
    file = gmsh_file(shared_path / "tube.msh", lambda gmsh: tube(gmsh, order=2))
    surface = Design.parse({"shape": {"kind": "mesh", "file": str(file)}}).surface(COMM)
    assert surface.length("left") == pytest.approx(2 * math.pi * 0.2, rel=1e-4)


@pytest.mark.slow
def test_the_airbeam_from_the_command_line(lobefem_json):
    """Its tube strains as a closed cylinder's film does; it bends in two directions alike."""
    results, code = lobefem_json("inflate", str(AIRBEAM))
    assert code == 0
    assert (results["lobes"], results["radius"], results["support"], results["divisions"]) == (None,) * 4
    N = 2e4 * 0.1 / (1e9 * 2e-4)
    hoop, along = N * (1 - 0.3 / 2), N * (1 / 2 - 0.3)
    cylinder, sphere = math.pi * 0.1**2 * 1.2, 4 / 3 * math.pi * 0.1**3
    growth = cylinder * (2 * hoop + along) + sphere * 3 * N / 2 * (1 - 0.3)
    assert results["reference_volume"] == pytest.approx(cylinder + sphere, rel=0.06)
    # second order, coarse facets and held ring: a fifth
    assert results["volume"] - results["reference_volume"] == pytest.approx(growth, rel=0.2)
    assert results["slack_area"] == 0
    found, code = lobefem_json("modes", str(AIRBEAM), "--state", "inflated", "--count", "2")
    assert code == 0
    first, second = found["pressures"][0]["modes"]
    assert first["kind"] == second["kind"] == "sway"
    assert first["real"] == pytest.approx(second["real"], rel=0.01)
    assert first["real"] > 0


AIRBAG = """
[shape]
kind = "mesh"
file = "airbag.msh"
[film]
E = "588 MPa"
nu = 0.4
thickness = "0.6 mm"
slack_stiffness = 1e-4
[[fixed]]
on = "x0"
components = "x"
[[fixed]]
on = "y0"
components = "y"
[[fixed]]
on = "edge"
components = "z"
[pressure]
value = "5 kPa"
"""


def quarter(gmsh, n=16):
    """A quarter of the upper sheet of the square airbag of diagonal 1.2 m, in n x n squares cut in two."""
    half = 0.6 / math.sqrt(2)
    face = gmsh.model.occ.addRectangle(0, 0, 0, half, half)
    gmsh.model.occ.synchronize()
    for tag, name, curves in ((1, "y0", [1]), (2, "edge", [2, 3]), (3, "x0", [4])):
        gmsh.model.addPhysicalGroup(1, curves, tag, name=name)
    gmsh.model.addPhysicalGroup(2, [face], 1, name="sheet")
    for curve in range(1, 5):
        gmsh.model.mesh.setTransfiniteCurve(curve, n + 1)
    gmsh.model.mesh.setTransfiniteSurface(face, "Right")
    gmsh.model.mesh.generate(2)


@pytest.mark.slow
def test_the_square_airbag_from_the_command_line(lobefem_json, shared_path):
    """Drawn flat, its centre rises by 217 mm; no start is asked for."""
    gmsh_file(shared_path / "airbag.msh", quarter)
    file = written(shared_path / "airbag.toml", AIRBAG)
    results, code = lobefem_json("inflate", str(file))
    assert code == 0
    assert results["max_displacement"] == pytest.approx(217e-3, abs=2e-3)
    assert results["wrinkled_area"] > results["taut_area"]
    assert results["reference_volume"] == pytest.approx(0, abs=1e-12)
    assert np.isfinite(results["volume"])


FREE = """
[shape]
kind = "mesh"
file = "airbag.msh"
[film]
E = "588 MPa"
nu = 0.4
thickness = "0.6 mm"
slack_stiffness = 1e-4
[supports]
free = true
[pressure]
value = "5 kPa"
"""


def both_sheets(gmsh, n=8):
    """The square airbag, turned and shifted: two squares upon each other, joined at their edges."""
    half = 0.6 / math.sqrt(2)
    geo = gmsh.model.geo
    corners = [geo.addPoint(x * half, y * half, 0) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    lines = [geo.addLine(corners[k], corners[(k + 1) % 4]) for k in range(4)]
    loop = geo.addCurveLoop(lines)
    for _ in range(2):
        geo.addPlaneSurface([loop])
    geo.synchronize()
    for _, curve in gmsh.model.getEntities(1):
        gmsh.model.mesh.setTransfiniteCurve(curve, 2 * n + 1)
    # no diagonal across a corner belongs to both sheets
    for (_, sheet), way in zip(gmsh.model.getEntities(2), ("Left", "Right"), strict=True):
        gmsh.model.mesh.setTransfiniteSurface(sheet, way)
    gmsh.model.mesh.generate(2)
    gmsh.model.mesh.affineTransform([0.8, 0, 0.6, 1, 0, 1, 0, 2, -0.6, 0, 0.8, 3])


@pytest.mark.slow
def test_the_whole_airbag_that_nothing_holds(lobefem_json, shared_path):
    """Its energy is eight times that of the quarter of one sheet, its rise the same."""
    gmsh_file(shared_path / "airbag.msh", both_sheets)
    file = written(shared_path / "airbag.toml", FREE)
    whole, code = lobefem_json("inflate", str(file))
    assert code == 0
    gmsh_file(shared_path / "airbag.msh", lambda gmsh: quarter(gmsh, 8))
    part, code = lobefem_json("inflate", str(written(shared_path / "quarter.toml", AIRBAG)))
    assert code == 0
    assert whole["strain_energy"] == pytest.approx(8 * part["strain_energy"], rel=0.05)
    assert whole["max_displacement"] == pytest.approx(part["max_displacement"], rel=0.03)
    assert whole["volume"] == pytest.approx(0.123, rel=0.03)
    assert whole["reference_volume"] == pytest.approx(0, abs=1e-12)
    assert whole["wrinkled_area"] > whole["taut_area"]


def test_a_file_that_is_missing_is_said(refused, shared_path):
    file = written(shared_path / "beam.toml", '[shape]\nkind = "mesh"\nfile = "beam.msh"\n')
    code, said = refused("inflate", file)
    assert code == 2
    assert f"there is no mesh file '{shared_path / 'beam.msh'}'" in said
