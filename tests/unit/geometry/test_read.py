"""Surfaces from meshes of others: names, senses, kinds of cells, refusals."""

import math

import numpy as np
import pytest

from lobefem import (
    Balloon,
    EndPlates,
    Fixed,
    FixedWrinkles,
    GasPressure,
    Isotropic,
    Surface,
    TensionField,
    inflate,
)
from lobefem.errors import InputError
from lobefem.geometry.orientation import turned
from tests.builders import gmsh_file, tube

import dolfinx
from dolfinx.mesh import CellType
from mpi4py import MPI

COMM = MPI.COMM_WORLD


def gas(surface, **given):
    return Balloon(surface, Isotropic(), [GasPressure("closed"), EndPlates()], **given)


@pytest.mark.parametrize(("order", "recombine"), [(1, False), (2, False), (1, True), (2, True)])
@pytest.mark.parametrize("reverse", [False, True])
def test_tube_from_a_file_encloses_its_volume(shared_path, order, recombine, reverse):
    """Whatever the cells and the sense in which they were drawn; quadratic cells are curved."""
    file = shared_path / "tube.msh"
    gmsh_file(file, lambda gmsh: tube(gmsh, order=order, recombine=recombine, turn=[1] if reverse else ()))
    surface = Surface.from_msh(file, plates=("left", "right"))
    balloon = gas(surface)
    assert balloon.reference_volume == pytest.approx(math.pi * 0.2**2, rel=1e-3 if order == 2 else 0.05)
    assert balloon.axis.direction == pytest.approx([1, 0, 0])
    assert surface.groups["skin"] == (2, 7)
    assert (surface.groups["rim_bottom"], surface.groups["rim_top"]) == ((1, 3), (1, 9))
    assert balloon.comm.allreduce(len(surface.edges.find(3))) > 0
    assert surface.tags("skin")[0].values.tolist() == [7] * len(surface.tags("skin")[0].values)


def test_state_is_the_same_for_reversed_cells(shared_path):
    volumes = []
    for name, turn in (("one.msh", ()), ("other.msh", [1])):
        file = gmsh_file(shared_path / name, lambda gmsh, turn=turn: tube(gmsh, turn=turn))
        volumes.append(inflate(gas(Surface.from_msh(file, plates=("left", "right"))), 1e4).volume)
    assert volumes[0] == pytest.approx(volumes[1], rel=1e-8)


def cube(gmsh, *, mixed=False, solid=False):
    gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
    gmsh.model.occ.synchronize()
    if mixed:
        gmsh.model.mesh.setRecombine(2, 1)
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.5)
    gmsh.model.mesh.generate(3 if solid else 2)


def test_closed_film_in_groups_of_gmsh_s_own_numbers(shared_path):
    """A box's faces are drawn in different senses; without groups each face and curve is one."""
    surface = Surface.from_msh(gmsh_file(shared_path / "cube.msh", cube))
    assert {f"surface_{k}" for k in range(1, 7)} | {f"curve_{k}" for k in range(1, 13)} == set(surface.groups)
    held = Fixed(on=lambda x: x[2] < 0.01)
    balloon = Balloon(surface, TensionField(E=1e9), [GasPressure("closed"), held])
    assert balloon.reference_volume == pytest.approx(1, rel=1e-12)
    state = inflate(balloon, 1e3)
    assert state.converged
    assert state.volume > 1.001


def test_faces_of_a_step_file(shared_path):
    """Its millimetres become metres."""

    def draw(gmsh):
        gmsh.model.occ.addSphere(0, 0, 0, 500)
        gmsh.model.occ.synchronize()

    file = gmsh_file(shared_path / "ball.step", draw)
    surface = Surface.from_step(file, 0.2, order=2)
    balloon = Balloon(surface, Isotropic(), [Fixed(on=lambda x: x[2] < -0.4)])
    assert balloon.reference_volume == pytest.approx(math.pi / 6, rel=1e-3)
    assert surface.groups["surface_1"] == (2, 1)
    with pytest.raises(InputError, match=r"size is 0; give a positive number"):
        Surface.from_step(file, 0)


@pytest.mark.parametrize(
    ("draw", "words"),
    [
        (lambda gmsh: cube(gmsh, solid=True), "is a volume mesh"),
        (lambda gmsh: cube(gmsh, mixed=True), "mixes triangle 3 and quadrilateral 4 cells"),
        (lambda gmsh: (cube(gmsh), gmsh.model.mesh.setOrder(3)), "has cells of kind triangle 10"),
        (lambda gmsh: gmsh.model.geo.addPoint(0, 0, 0), "no triangles or quadrilaterals"),
        (
            lambda gmsh: [cube(gmsh), *(gmsh.model.addPhysicalGroup(2, [1], name=n) for n in "ab")],
            "groups 'a' and 'b' have surface_1 in common",
        ),
    ],
)
def test_files_that_hold_something_else_are_refused(shared_path, draw, words):
    file = gmsh_file(shared_path / "other.msh", draw)
    with pytest.raises(InputError, match=words):
        Surface.from_msh(file)


def test_files_that_are_none_are_refused(shared_path):
    file = shared_path / "text.msh"
    with pytest.raises(InputError, match=r"there is no mesh file '.*text.msh'"):
        Surface.from_msh(file)
    COMM.Barrier()
    if COMM.rank == 0:
        file.write_text("no mesh")
    COMM.Barrier()
    with pytest.raises(InputError, match="Gmsh cannot read"):
        Surface.from_msh(file)


@pytest.mark.parametrize(
    ("plates", "words"),
    [
        (("left", "top"), r"no edge group 'top' on this surface; it has \['left', 'right'\]"),
        (("left",), "two"),
    ],
)
def test_rims_are_edge_groups(shared_path, plates, words):
    file = gmsh_file(shared_path / "tube.msh", tube)
    with pytest.raises(InputError, match=words):
        Surface.from_msh(file, plates=plates)


def test_edges_of_three_cells_and_moebius_bands_are_refused():
    three = np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4]])
    with pytest.raises(InputError, match="1 edges of the mesh belong to more than two cells"):
        turned(three, np.eye(5, 3))
    band = np.array([[0, 1, 2], [1, 2, 3], [2, 3, 4], [3, 4, 0], [4, 0, 1]])
    with pytest.raises(InputError, match="one side only"):
        turned(band, np.random.default_rng(1).random((5, 3)))


def test_mesh_of_dolfinx_s_with_names_as_its_gmsh_reader_gives_them(shared_path):
    """Points and volumes among the names do no harm; a flat sheet needs no axis."""
    file = gmsh_file(shared_path / "tube.msh", tube)
    read = Surface.from_msh(file)
    names = {"skin": (2, 7), "left": (1, 3), "right": (1, 9), "corner": (0, 1), "inside": (3, 1)}
    surface = Surface.from_mesh(read.mesh, read.edges, names, read.regions)
    assert dict(surface.groups) == dict(read.groups)
    assert not surface.of_revolution
    held = [Fixed(on=name) for name in ("left", "right")]
    state = inflate(Balloon(surface, TensionField(E=1e9), [GasPressure("film"), *held]), 1e3)
    assert state.converged
    assert state.max_displacement > 1e-6
    with pytest.raises(InputError, match="FixedWrinkles film has a direction"):
        Balloon(surface, FixedWrinkles(), held)
    with pytest.raises(InputError, match="no group 'top' on this surface"):
        surface.tags("top")


def test_volume_meshes_of_dolfinx_s_are_refused():
    box = dolfinx.mesh.create_unit_cube(COMM, 2, 2, 2, CellType.tetrahedron)
    with pytest.raises(InputError, match="tetrahedrons of 4 nodes"):
        Surface.from_mesh(box)
    with pytest.raises(InputError, match="names is 'rim'"):
        Surface.from_mesh(box, names="rim")


def test_stress_does_not_depend_on_the_frame_of_the_cells(shared_path):
    """A tube by its axis and by its cells: isotropic and tension-field film are the same."""
    file = gmsh_file(shared_path / "tube.msh", tube)
    energies = []
    for axis in (None, (1, 0, 0)):
        surface = Surface.from_msh(file, axis=axis)
        held = [Fixed(on=name) for name in ("left", "right")]
        balloon = Balloon(surface, TensionField(E=1e9), [GasPressure("film"), *held], quadrature_degree=4)
        energies.append(inflate(balloon, 1e3).strain_energy)
    assert energies[0] == pytest.approx(energies[1], rel=1e-9)
