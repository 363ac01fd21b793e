"""The only file that knows that DOLFINx versions differ (0.9 and later).

Each function is one seam: it names the upstream change and dispatches by what is there, not by
version number. Importing this module first also orders `mpi4py.MPI` ahead of PyPI's wheel stack.
"""

from __future__ import annotations

import os
import shutil
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from importlib.util import find_spec
from inspect import signature
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from lobefem.errors import MissingDependencyError
from lobefem.linalg import form_cache
from lobefem.profiling import timed
from lobefem.progress import announce
from lobefem.typing import Comm, Expr, Mesh

__all__ = [
    "abandon",
    "cache_folder",
    "create_mesh",
    "entity_nodes",
    "form",
    "geometry_dofmap",
    "gmshio",
    "interpolation_points",
    "mixed_wheels",
    "mixes_cells",
    "shared_facet_partitioner",
]

# Scotch 7 shares out the cells by threads, as their timing has it: meshes, and what was kept of states on
# them, would be numbered in another way in each run
os.environ.setdefault("SCOTCH_DETERMINISTIC", "1")

os.environ.setdefault("SCOTCH_PTHREAD_NUMBER", "1")

# A process that no launcher has started talks to nobody; Open MPI would look for fabrics for over a second
if not {"PMIX_RANK", "PMI_RANK"} & os.environ.keys():
    os.environ.setdefault("OMPI_MCA_btl", "^ofi")


def mixed_wheels(site: Path, petsc4py: Path) -> bool:
    """True if PyPI's wheel stack in a folder is mixed with another PETSc, or of both scalars.

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


@contextmanager
def _readable_arguments() -> Iterator[None]:
    """Arguments that C++ can read: DOLFINx passes them on at its import, and paths need not be UTF-8."""
    arguments = sys.argv
    sys.argv = [argument.encode(errors="replace").decode() for argument in arguments]
    try:
        yield
    finally:
        sys.argv = arguments


try:
    _check_wheels()
    from mpi4py import MPI  # the wheels' libraries want it before all others

    with warnings.catch_warnings(), _readable_arguments():
        # DOLFINx 0.9 warns that it runs without numba
        warnings.filterwarnings("ignore", "Could not import numba", ImportWarning)
        import dolfinx
    import cffi

    import dolfinx.fem
    import dolfinx.jit
    import ffcx.codegeneration.jit
    from petsc4py import PETSc
except ImportError as error:
    raise MissingDependencyError(
        f"DOLFINx with PETSc cannot be imported ({error})",
        "on Debian 13 install python3-dolfinx-real, elsewhere run: pip install 'lobefem[wheel]'",
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


def shared_facet_partitioner() -> Callable[..., Any]:
    """The cell partitioner with ghosts over shared facets, without which `dS` is lost in parallel.

    DOLFINx 0.10 added `max_facet_to_cell_links` to `create_cell_partitioner`.
    """
    from dolfinx.mesh import GhostMode, create_cell_partitioner

    try:
        return create_cell_partitioner(GhostMode.shared_facet, 2)
    except TypeError:
        return create_cell_partitioner(GhostMode.shared_facet)


def create_mesh(comm: Comm, cells: npt.NDArray[np.int64], element: Any, x: npt.NDArray[np.float64]) -> Any:
    """A distributed mesh with ghosts over facets; `cells` in DOLFINx order, `x` of shape (n, 3).

    DOLFINx 0.10 swapped the positions of `x` and `e`. Collective.
    """
    return dolfinx.mesh.create_mesh(comm, cells=cells, x=x, e=element, partitioner=shared_facet_partitioner())


_workplace: Path | None = None  # where a form is being compiled

_made = 0  # forms that this process has compiled


def abandon() -> None:
    """Remove what an interrupt leaves half-made in the cache of forms."""
    if _workplace is not None:
        shutil.rmtree(_workplace, ignore_errors=True)


def cache_folder() -> Path:
    """The folder of compiled forms."""
    return dolfinx.jit.get_options()["cache_dir"]


@timed("form compilation")
def form(expression: Expr, cache_dir: Path | None = None) -> Any:
    """Compile a UFL form, or load it from the cache: the user's, if none is given.

    An entry of the cache that is not whole, or that a rank cannot load, is replaced: by rank 0, or by the
    rank that cannot load it, since on unlike machines what an older system has compiled serves all.

    Raises:
        MissingDependencyError: it cannot be compiled, kept or loaded.

    Collective.
    """
    folder = cache_folder() if cache_dir is None else cache_dir
    options = dolfinx.jit.get_options(
        {
            # the C compiler's warnings about generated code are for nobody here
            "cffi_extra_compile_args": ["-O2", "-g0", "-w"],
            "cache_dir": _readable(folder),
        }
    )
    # each rank loads by itself, so that all know who cannot (DOLFINx 0.10 added `jit_comm`; before, ranks
    # other than 0 fail alone)
    alone = {"jit_comm": MPI.COMM_SELF} if "jit_comm" in signature(dolfinx.fem.form).parameters else {}
    comm = expression.ufl_domain().ufl_cargo().comm
    maker, anew = 0, False
    for _ in range(3):
        fault, error = None, None
        if comm.rank == maker:
            try:
                fault = _provide(expression, options, folder, anew)
            except Exception as other:  # no rank is left waiting
                fault, error = (f"a form could not be compiled ({_line(other)})", ""), other
        fault = comm.bcast(fault, root=maker)
        if fault is not None:
            raise error or MissingDependencyError(*fault)
        made, failure = None, ""
        try:
            made = dolfinx.fem.form(expression, jit_options=options, **alone)
        except (ImportError, OSError, RuntimeError) as other:
            failure = _line(other)
        failures = comm.allgather(failure)
        if not any(failures):
            return made
        maker, anew = next(rank for rank, why in enumerate(failures) if why), True
    raise MissingDependencyError(*_unloaded(failures[maker], folder))


def _provide(expression: Expr, options: dict[str, Any], folder: Path, anew: bool) -> tuple[str, str] | None:
    """Compile a form into the cache where it is not there, or `anew`; what was wrong, and advice."""
    cache = options["cache_dir"]
    if not anew and form_cache.is_whole(cache, _entry(expression, options)):
        return None
    global _workplace, _made
    _made += 1
    announce(f"compiling form {_made}, once: later runs find it")
    try:
        place = _workplace = form_cache.workplace(cache)
        try:
            scalar = {"scalar_type": dolfinx.default_scalar_type}
            dolfinx.jit.ffcx_jit(MPI.COMM_SELF, expression, scalar, options | {"cache_dir": place})
            form_cache.publish(place, cache)
        except ImportError as error:
            return _unloaded(_line(error), folder)
        finally:
            _workplace = None
            shutil.rmtree(place, ignore_errors=True)
    except cffi.VerificationError as error:
        advice = "install a C compiler with its headers (Debian: gcc libc6-dev), or set CC to yours"
        return f"a form could not be compiled ({_line(error)})", advice
    except OSError as error:
        advice = "make room there, or set XDG_CACHE_HOME to a folder that you may write to"
        return f"compiled forms cannot be kept in {folder} ({error.strerror or _line(error)})", advice
    return None


@lru_cache
def _readable(folder: Path) -> Path:
    """A folder by a name in UTF-8, without which Python 3.12 loads no library."""
    try:
        str(folder).encode()
    except UnicodeEncodeError:
        folder.mkdir(parents=True, exist_ok=True)
        return Path(f"/proc/self/fd/{os.open(folder, os.O_RDONLY)}")  # to the end of the process
    return folder


def _entry(expression: Expr, options: dict[str, Any]) -> str:
    """The name under which FFCx keeps a form, for which it has no function."""
    jit = ffcx.codegeneration.jit
    settings = ffcx.get_options({"scalar_type": dolfinx.default_scalar_type})
    compiler = jit._compilation_signature(options["cffi_extra_compile_args"], options["cffi_debug"])
    tag = jit._compute_option_signature(settings) + compiler
    return "libffcx_forms_" + ffcx.naming.compute_signature([expression], tag)


def _unloaded(why: str, folder: Path) -> tuple[str, str]:
    return (
        f"a compiled form cannot be loaded ({why})",
        f"if {folder} is mounted noexec, set XDG_CACHE_HOME to a folder on another file system",
    )


def _line(error: Exception) -> str:
    return " ".join(str(error).split())[:300] or type(error).__name__


def interpolation_points(element: Any) -> npt.NDArray[np.float64]:
    """Interpolation points of an element (DOLFINx 0.10 made the method a property)."""
    points = element.interpolation_points
    return points() if callable(points) else points


def geometry_dofmap(mesh: Mesh) -> npt.NDArray[np.int32]:
    """Nodes of this rank's cells, ghosts included, shape (cells, nodes per cell).

    DOLFINx 0.10 turned `dofmap` into a list, one a cell type, and warns about the old name.
    """
    dofmaps = getattr(mesh.geometry, "dofmaps", None)
    return dofmaps[0] if isinstance(dofmaps, (list, tuple)) else mesh.geometry.dofmap


def mixes_cells(mesh: Mesh) -> bool:
    """True of a mesh with cells of several kinds, which DOLFINx 0.10 can make from Python."""
    dofmaps = getattr(mesh.geometry, "dofmaps", None)
    return isinstance(dofmaps, (list, tuple)) and len(dofmaps) > 1


def entity_nodes(mesh: Mesh, dim: int, entities: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """Nodes of mesh entities, vertices first, shape (entities, nodes per entity).

    DOLFINx 0.9 dies of a division by zero (SIGFPE) where a rank has none to ask about.
    """
    if len(entities) == 0:
        return np.empty((0, dim + 1), dtype=np.int32)
    nodes = dolfinx.mesh.entities_to_geometry(mesh, dim, entities)
    return nodes.reshape(len(entities), -1)
