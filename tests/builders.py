"""The balloons that most tests start from, on coarse meshes: stacks of the paper's lobes, pumpkins."""

import inspect
import math

from lobefem.fem.balloon import Balloon
from lobefem.geometry.gmsh import fresh_model
from lobefem.geometry.gore import ConstantAngle, Gore
from lobefem.geometry.pumpkin import PumpkinRecipe
from lobefem.geometry.pumpkin_curve import PumpkinCurve
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.model.cables import Hoops, Tendons
from lobefem.model.end_plates import EndPlates
from lobefem.model.film import Isotropic
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.tension_field import TensionField

from mpi4py import MPI

_PLATES, _MESH = (inspect.signature(made).parameters.keys() for made in (EndPlates, lobed_cylinder))


def stack(
    comm=MPI.COMM_WORLD,
    film=None,
    load="closed",
    *,
    surface=None,
    lobes=2,
    divisions=(4, 8),
    EA=None,
    plates=None,
    parts=(),
    **given,
):
    """A stack of lobes under gas, with a hoop on each seam and end plates, clamped if nothing is said.

    Args:
        comm: of the mesh.
        film: isotropic if None.
        load: of the gas.
        surface: one that there is already.
        lobes: number of lobes.
        divisions: of the mesh; None for one of another layout.
        EA: of the hoops [N], the paper's if None.
        plates: the end plates, if there are some already.
        parts: further parts.
        given: to `EndPlates`, `lobed_cylinder` and `Balloon`, each by the names of its arguments.
    """
    plate, mesh = ({name: given.pop(name) for name in names & given.keys()} for names in (_PLATES, _MESH))
    if divisions is not None:
        mesh["divisions"] = divisions
    if surface is None:
        surface = lobed_cylinder(lobes, comm=comm, **mesh)
    hoops = Hoops() if EA is None else Hoops(EA=EA)
    parts = [GasPressure(load), hoops, plates or EndPlates(**plate), *parts]
    return Balloon(surface, film or Isotropic(), parts, **given)


def pumpkin(
    comm=MPI.COMM_WORLD,
    film=None,
    gas=None,
    *,
    gores=8,
    angle=60,
    R0=5.0,
    fitting=0.25,
    lobes=None,
    divisions=(8, 4),
    cell="quadrilateral",
    order=1,
    grading=0.0,
    full=False,
    flat=False,
    tendons=None,
    parts=(),
    **given,
):
    """A pumpkin balloon, or one gore of it, with a tendon on each edge and fittings.

    Args:
        comm: of all gores.
        film: a tension field of 38 um if None.
        gas: the load, closed if None.
        gores: their number N.
        angle: half angle of lobes of constant angle [degrees].
        R0, fitting: radii of equator and fittings [m].
        lobes: of another kind.
        divisions, cell, order, grading, full: of the mesh.
        flat: cut from flat gores; free of stress as drawn otherwise.
        tendons: of EA = 100 kN if None.
        parts: further parts.
        given: to `Balloon`.
    """
    gore = Gore(PumpkinCurve(R0, fitting), gores, lobes or ConstantAngle(math.radians(angle)))
    recipe = PumpkinRecipe(gore, divisions, cell, order, grading, full)
    surface = recipe.surface(comm)
    film = film or TensionField(E=300e6, nu=0.4, thickness=38e-6)
    parts = [gas or GasPressure(), tendons or Tendons(EA=1e5), EndPlates(bar=False), *parts]
    return Balloon(surface, film, parts, pattern=recipe.pattern(surface) if flat else None, **given)


def isotensoid_pumpkin(
    gores=8,
    divisions=(6, 2),
    cell="quadrilateral",
    order=2,
    *,
    full=False,
    film=None,
    gas=None,
    angle=60.0,
    EA=1e5,
    plates=None,
    flat=False,
    parts=(),
    **given,
):
    """A pumpkin balloon on the isotensoid of 5 m radius, one gore of it or all, with a tendon on each cut.

    Args:
        gores: number of gores.
        divisions: rows and columns of cells of a gore.
        cell: of the mesh.
        order: of the mesh.
        full: True for all gores.
        film: tension field of 300 MPa and 38 um if None.
        gas: its pressure, closed if None.
        angle: half angle of the lobes [deg].
        EA: of the tendons [N].
        plates: the end fittings, free on top if None.
        flat: True for gores that are cut flat.
        parts: further parts.
        given: to `Balloon`.
    """
    gore = Gore(PumpkinCurve(5.0, (0.25, 0.25)), gores, ConstantAngle(math.radians(angle)))
    recipe = PumpkinRecipe(gore, divisions, cell, order, full=full)
    surface = recipe.surface()
    film = film or TensionField(E=300e6, nu=0.4, thickness=38e-6, slack_stiffness=1e-5)
    components = [gas or GasPressure("closed"), Tendons(EA=EA), plates or EndPlates(bar=False), *parts]
    pattern = recipe.pattern(surface) if flat else None
    return Balloon(surface, film, components, pattern=pattern, **given)


def gmsh_file(path, draw, comm=MPI.COMM_WORLD):
    """A file that Gmsh saves of what `draw(gmsh)` makes, on rank 0. Collective.

    Args:
        path: of the file, .msh or .step.
        draw: called with the module `gmsh` and a fresh model.
        comm: ranks that wait for it.
    """
    if comm.rank == 0:
        with fresh_model() as gmsh:
            draw(gmsh)
            gmsh.write(str(path))
    comm.Barrier()
    return path


def tube(gmsh, *, radius=0.2, length=1.0, size=0.1, order=1, recombine=False, groups=True, turn=()):
    """An open tube about the x axis, with groups skin, left and right."""
    occ = gmsh.model.occ
    ring = occ.addWire([occ.addCircle(0, 0, 0, radius, zAxis=[1, 0, 0])])
    occ.extrude([(1, curve) for _, curve in occ.getEntities(1)], length, 0, 0)
    occ.remove([(1, ring)])
    occ.synchronize()
    faces = [face for _, face in gmsh.model.getEntities(2)]
    for face in turn:
        gmsh.model.mesh.setReverse(2, face)
    if groups:
        gmsh.model.addPhysicalGroup(2, faces, 7, name="skin")
        for tag, name, at in ((3, "left", 0.0), (9, "right", length)):
            ends = gmsh.model.getEntitiesInBoundingBox(at - 1e-3, -1, -1, at + 1e-3, 1, 1, 1)
            gmsh.model.addPhysicalGroup(1, [curve for _, curve in ends], tag, name=name)
    gmsh.option.setNumber("Mesh.RecombineAll", int(recombine))
    gmsh.option.setNumber("Mesh.SubdivisionAlgorithm", int(recombine))
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.model.mesh.generate(2)
    gmsh.model.mesh.setOrder(order)
