"""The only file that knows that DOLFINx versions differ (0.9 and later).

Each function is one seam: it names the upstream change and dispatches by what is there, not by
version number. Importing this module first also orders `mpi4py.MPI` ahead of PyPI's wheel stack.
"""

from __future__ import annotations

import os
import re
import time
import warnings
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import cffi
import numpy as np
import numpy.typing as npt

from lobefem.errors import MissingDependencyError
from lobefem.profiling import timed

# Scotch 7 shares out the cells by threads, as their timing has it: meshes, and what was kept of states on
# them, would be numbered in another way in each run
os.environ.setdefault("SCOTCH_DETERMINISTIC", "1")
os.environ.setdefault("SCOTCH_PTHREAD_NUMBER", "1")

# A process that no launcher has started talks to nobody; Open MPI would look for fabrics for over a second
if not {"PMIX_RANK", "PMI_RANK"} & os.environ.keys():
    os.environ.setdefault("OMPI_MCA_btl", "^ofi")


def mixed_wheels(site: Path, petsc4py: Path) -> bool:
    """Whether PyPI's wheel stack in a folder is mixed with another PETSc, or of both scalars.

    Args:
        site: where the packages lie.
        petsc4py: where that package would be imported from.
    """
    names = {path.name.partition("-")[0] for path in site.glob("*.dist-info")}
    others = {"petsc", "petsc4py", "slepc", "slepc4py"}
    both = {"dolfinx_solver_real", "dolfinx_solver_complex"} <= names
    return bool(names & others) or both or petsc4py.resolve().parent != site.resolve()


def _check_wheels() -> None:
    """Have PyPI's wheel stack refuse a mixture. Debian has no such package."""
    solver, petsc4py = (find_spec(name) for name in ("dolfinx_solver", "petsc4py"))
    places = [Path(spec.origin).parent for spec in (solver, petsc4py) if spec is not None and spec.origin]
    if len(places) == 2 and mixed_wheels(places[0].parent, places[1]):
        # it reads all metadata there is, which takes a tenth of a second: only where it has a word to say
        import dolfinx_solver  # noqa: F401


try:
    _check_wheels()
    from mpi4py import MPI  # noqa: F401  the wheels' libraries want it before all others

    with warnings.catch_warnings():  # DOLFINx 0.9 warns that it runs without numba
        warnings.filterwarnings("ignore", "Could not import numba", ImportWarning)
        import dolfinx
    import dolfinx.fem
    from petsc4py import PETSc
except ImportError as error:
    raise MissingDependencyError(
        f"DOLFINx with PETSc cannot be imported ({error}); on Debian 13 install python3-dolfinx-real, "
        "elsewhere run: pip install 'lobefem[wheel]'"
    ) from error

try:
    from dolfinx.io import gmsh as gmshio  # DOLFINx >= 0.10
except ImportError:
    from dolfinx.io import gmshio  # DOLFINx 0.9

if np.issubdtype(PETSc.ScalarType, np.complexfloating):
    raise MissingDependencyError(
        "lobefem needs a PETSc of real scalars and found a complex one; install python3-dolfinx-real "
        "(Debian) or dolfinx-solver-real (PyPI)"
    )

__all__ = [
    "abandon",
    "create_mesh",
    "entity_nodes",
    "form",
    "geometry_dofmap",
    "gmshio",
    "interpolation_points",
    "mixed_wheels",
    "shared_facet_partitioner",
]


def shared_facet_partitioner() -> Callable[..., Any]:
    """The cell partitioner with ghosts over shared facets, without which `dS` is lost in parallel.

    DOLFINx 0.10 added `max_facet_to_cell_links` to `create_cell_partitioner`.
    """
    from dolfinx.mesh import GhostMode, create_cell_partitioner

    try:
        return create_cell_partitioner(GhostMode.shared_facet, 2)
    except TypeError:
        return create_cell_partitioner(GhostMode.shared_facet)


def create_mesh(comm: Any, cells: npt.NDArray[np.int64], element: Any, x: npt.NDArray[np.float64]) -> Any:
    """A distributed mesh with ghosts over facets; `cells` in DOLFINx order, `x` of shape (n, 3).

    DOLFINx 0.10 swapped the positions of `x` and `e`. Collective.
    """
    return dolfinx.mesh.create_mesh(comm, cells=cells, x=x, e=element, partitioner=shared_facet_partitioner())


_compiling: tuple[Path | None, float] | None = None  # cache of the form that is being made, and since when


def abandon() -> None:
    """Remove what an interrupt leaves half-made in the cache of forms: the next run would wait for it."""
    if _compiling is None:
        return
    folder, since = _compiling
    if folder is None:
        folder = Path(str(dolfinx.jit.get_options()["cache_dir"])).expanduser()
    for entry in folder.glob("libffcx_forms_*.c"):
        # the file system's clock may lag behind
        if entry.stat().st_mtime > since - 1.0 and not entry.with_suffix(".c.cached").exists():
            entry.unlink(missing_ok=True)


@timed("form compilation")
def form(expression: Any, cache_dir: Path | None = None) -> Any:
    """Compile a UFL form, into another cache than the user's if one is given.

    A killed run can leave a half-made entry in the cache of compiled forms, for which FFCx then waits
    in vain: after a minute it is removed. The C compiler's warnings about generated code are for
    nobody here.

    Raises:
        MissingDependencyError: it cannot be compiled; there may be no C compiler.

    Collective.
    """
    options: dict[str, Any] = {"timeout": 60, "cffi_extra_compile_args": ["-O2", "-g0", "-w"]}
    if cache_dir is not None:
        options["cache_dir"] = cache_dir
    comm = expression.ufl_domain().ufl_cargo().comm
    global _compiling
    if comm.rank == 0:  # it compiles for all
        _compiling = cache_dir, time.time()
    try:
        return dolfinx.fem.form(expression, jit_options=options)
    except (RuntimeError, OSError, cffi.VerificationError) as error:
        stale = re.search(r"remove (\S+\.c)\)", str(error))  # on rank 0, in FFCx's own words
        if stale and comm.rank == 0:
            Path(stale[1]).unlink(missing_ok=True)
        if comm.bcast(bool(stale)):
            return dolfinx.fem.form(expression, jit_options=options)
        raise MissingDependencyError(
            f"a form could not be compiled ({str(error).strip()[:300]}); lobefem needs a C compiler when it "
            "runs and a writable cache: install gcc, or set XDG_CACHE_HOME to a folder of yours"
        ) from error
    finally:
        _compiling = None


def interpolation_points(element: Any) -> npt.NDArray[np.float64]:
    """Interpolation points of an element (DOLFINx 0.10 made the method a property)."""
    points = element.interpolation_points
    return points() if callable(points) else points


def geometry_dofmap(mesh: Any) -> npt.NDArray[np.int32]:
    """Nodes of this rank's cells, ghosts included, shape (cells, nodes per cell).

    DOLFINx 0.10 turned `dofmap` into a list, one a cell type, and warns about the old name.
    """
    dofmaps = getattr(mesh.geometry, "dofmaps", None)
    return dofmaps[0] if isinstance(dofmaps, (list, tuple)) else mesh.geometry.dofmap


def entity_nodes(mesh: Any, dim: int, entities: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """Nodes of mesh entities, vertices first, shape (entities, nodes per entity).

    DOLFINx 0.9 dies of a division by zero (SIGFPE) where a rank has none to ask about.
    """
    if len(entities) == 0:
        return np.empty((0, dim + 1), dtype=np.int32)
    nodes = dolfinx.mesh.entities_to_geometry(mesh, dim, entities)
    return nodes.reshape(len(entities), -1)
