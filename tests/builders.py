"""The balloons that most tests start from: stacks of the paper's lobes on coarse meshes."""

import inspect

from lobefem.fem.balloon import Balloon
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.model.cables import Hoops
from lobefem.model.end_plates import EndPlates
from lobefem.model.film import Isotropic
from lobefem.model.gas_pressure import GasPressure

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
