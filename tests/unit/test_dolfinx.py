"""The seams to DOLFINx that a user can run into."""

import dolfinx
import pytest
import ufl

from lobefem import _dolfinx
from lobefem.errors import MissingDependencyError
from lobefem.surface import lobed_cylinder


def test_a_killed_compilation_is_cleared_away(comm, shared_path, monkeypatch):
    """FFCx waits for a file that never comes, and says which entry of its cache is stale."""
    surface = lobed_cylinder(1, (2, 3))
    stale = shared_path / "libffcx_forms_0.c"
    stale.touch()
    real, calls = dolfinx.fem.form, []

    def form(*args, **options):
        calls.append(options)
        if len(calls) == 1:
            where = f"Try cleaning cache (e.g. remove {stale}) or increase timeout option."
            raise TimeoutError(where if comm.rank == 0 else "JIT compilation failed on rank 0.")
        return real(*args, **options)

    monkeypatch.setattr(dolfinx.fem, "form", form)
    one = dolfinx.fem.Constant(surface.mesh, 1.0)
    assert _dolfinx.form(one * ufl.dx(surface.mesh)) is not None
    assert len(calls) == 2
    comm.barrier()
    assert not stale.exists()


def test_an_interrupt_leaves_no_form_half_made(comm, shared_path, monkeypatch):
    """The next run would wait a minute for it."""
    surface = lobed_cylinder(1, (2, 3))
    half_made, made = (shared_path / f"libffcx_forms_{k}.c" for k in range(2))

    def form(*args, **options):
        if comm.rank == 0:
            half_made.touch()
            made.touch()
            made.with_suffix(".c.cached").touch()
        comm.barrier()
        _dolfinx.abandon()  # as Ctrl-C does it
        raise KeyboardInterrupt

    monkeypatch.setattr(dolfinx.fem, "form", form)
    one = dolfinx.fem.Constant(surface.mesh, 1.0)
    with pytest.raises(KeyboardInterrupt):
        _dolfinx.form(one * ufl.dx(surface.mesh), shared_path)
    left = comm.bcast((made.exists(), half_made.exists()) if comm.rank == 0 else None)
    assert left == (True, False)
    if comm.rank == 0:
        half_made.touch()
    _dolfinx.abandon()  # nothing is being made now
    assert comm.bcast(half_made.exists() if comm.rank == 0 else None)


def test_no_compiler_is_said_so(comm, monkeypatch):
    surface = lobed_cylinder(1, (2, 3))

    def form(*args, **options):
        raise RuntimeError("Failed JIT compilation of form: command 'gcc' failed")

    monkeypatch.setattr(dolfinx.fem, "form", form)
    one = dolfinx.fem.Constant(surface.mesh, 1.0)
    with pytest.raises(MissingDependencyError, match=r"command 'gcc' failed.* install gcc"):
        _dolfinx.form(one * ufl.dx(surface.mesh))


def test_wheels_that_do_not_go_together_are_seen(tmp_path):
    petsc4py = tmp_path / "petsc4py"
    for name in ("dolfinx_solver_real-0.11.0", "numpy-2.4.0", "mpi4py-4.1.1"):
        (tmp_path / f"{name}.dist-info").mkdir()
    assert not _dolfinx.mixed_wheels(tmp_path, petsc4py)
    assert _dolfinx.mixed_wheels(tmp_path, tmp_path / "elsewhere" / "petsc4py")
    for name in ("petsc-3.25.0", "slepc4py-3.25.0", "dolfinx_solver_complex-0.11.0"):
        other = tmp_path / f"{name}.dist-info"
        other.mkdir()
        assert _dolfinx.mixed_wheels(tmp_path, petsc4py)
        other.rmdir()
