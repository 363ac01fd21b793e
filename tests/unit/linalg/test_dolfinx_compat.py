"""The seams to DOLFINx that a user can run into, and its cache of compiled forms."""

import hashlib
import os
import shutil
import sys

import cffi
import pytest

from lobefem import progress
from lobefem.errors import MissingDependencyError
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.linalg import dolfinx_compat, form_cache

import dolfinx
import dolfinx.jit
import ufl


def make(comm, folder):
    """A form of a film's area, from a cache."""
    mesh = lobed_cylinder(1, (2, 3), comm=comm).mesh
    return dolfinx_compat.form(dolfinx.fem.Constant(mesh, 1.0) * ufl.dx(mesh), folder)


def area(comm, form):
    return comm.allreduce(dolfinx.fem.assemble_scalar(form))


@pytest.fixture
def compiled(monkeypatch):
    """Where forms are compiled from now on, one folder for each time."""
    real, places = dolfinx.jit.ffcx_jit, []

    def ffcx_jit(comm, form, *args, **options):
        given = options.get("jit_options") or args[1]
        if given["cache_dir"].name.startswith("lobefem-"):
            places.append(given["cache_dir"])
        return real(comm, form, *args, **options)

    monkeypatch.setattr(dolfinx.jit, "ffcx_jit", ffcx_jit)
    return places


@pytest.fixture
def entry(comm, shared_path):
    """A form in a cache: its C file, what says that it is there, and its library."""
    first, second = shared_path / "first", shared_path / "second"
    make(comm, first)
    if comm.rank == 0:
        # Python would not look again at a library that it has loaded
        shutil.copytree(first, second)
    comm.barrier()
    (source,) = second.glob("*.c")
    (library,) = second.glob("*.so")
    comm.barrier()
    return source, source.with_suffix(".c.cached"), library


def renew(path, data):
    """Another file in the place of one that may be in use."""
    path.unlink()
    path.write_bytes(data)


def of_another_system(source, ready, library):
    renew(library, b"no library of this system")
    ready.write_text(f"{hashlib.sha256(library.read_bytes()).hexdigest()}  {library.name}\n")


FAULTS = {
    "cut short": lambda c, ready, so: renew(so, so.read_bytes()[:100]),
    "cut in its middle": lambda c, ready, so: renew(so, so.read_bytes()[:-5000]),
    "zeros": lambda c, ready, so: renew(so, so.read_bytes()[:8000] + bytes(so.stat().st_size - 8000)),
    "empty": lambda c, ready, so: renew(so, b""),
    "lost": lambda c, ready, so: so.unlink(),
    "half made": lambda c, ready, so: (so.unlink(), ready.unlink()),
    "half moved": lambda c, ready, so: c.unlink(),
    "word cut short": lambda c, ready, so: renew(ready, ready.read_bytes()[:70]),
    "word empty": lambda c, ready, so: renew(ready, b""),
    "of another system": of_another_system,
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_bad_entry_of_the_cache_is_compiled_again(comm, entry, compiled, fault):
    if comm.rank == 0:
        FAULTS[fault](*entry)
    comm.barrier()
    folder = entry[0].parent
    right = area(comm, make(comm, folder))
    assert right == pytest.approx(area(comm, make(comm, folder)), rel=1e-14)
    assert right > 1
    assert comm.allreduce(len(compiled)) == 1
    assert sorted(path.name for path in folder.iterdir()) == sorted(path.name for path in entry)
    assert form_cache.examine(folder) == (1, {})


def test_a_whole_entry_is_loaded_as_it_is(comm, entry, compiled):
    before = entry[2].stat().st_mtime_ns
    assert area(comm, make(comm, entry[0].parent)) > 1
    assert comm.allreduce(len(compiled)) == 0
    assert entry[2].stat().st_mtime_ns == before


def test_a_rank_that_cannot_load_a_form_compiles_it_for_all(comm, entry, compiled, monkeypatch):
    """On machines of unlike systems that share a home."""
    real, last = dolfinx.fem.form, comm.size - 1
    refused = iter([comm.rank == last])

    def form(*args, **options):
        made = real(*args, **options)
        if next(refused, False):
            raise ImportError("libc.so.6: version `GLIBC_2.99' not found")
        return made

    monkeypatch.setattr(dolfinx.fem, "form", form)
    assert area(comm, make(comm, entry[0].parent)) > 1
    assert comm.allgather(len(compiled)) == [0] * last + [1]


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (cffi.VerificationError("CompileError: command 'gcc' failed"), "command 'gcc' failed.* install a C"),
        (OSError(28, "No space left on device"), "cannot be kept in .*No space left on device.*; make room"),
        (
            ImportError("failed to map segment"),
            "cannot be loaded .*map segment.*; if .* is mounted noexec",
        ),
        (TypeError("a fault\n of our own"), None),
    ],
)
def test_why_a_form_cannot_be_compiled_is_said_so(comm, shared_path, monkeypatch, error, said):
    def ffcx_jit(*args, **options):
        raise error

    monkeypatch.setattr(dolfinx.jit, "ffcx_jit", ffcx_jit)
    expected = MissingDependencyError if said or comm.rank else type(error)
    with pytest.raises(expected, match=said or "a fault\\s+of our own"):
        make(comm, shared_path / "cache")
    assert not list((shared_path / "cache").iterdir())


def test_a_form_that_never_loads_is_given_up(comm, shared_path, compiled, monkeypatch):
    def form(*args, **options):
        raise ImportError("wrong ELF class")

    monkeypatch.setattr(dolfinx.fem, "form", form)
    with pytest.raises(MissingDependencyError, match=r"cannot be loaded .wrong ELF class"):
        make(comm, shared_path)
    assert comm.allreduce(len(compiled)) == 3


def test_an_interrupt_leaves_no_form_half_made(comm, shared_path, monkeypatch):
    left = []

    def ffcx_jit(comm, form, compiler_options, jit_options):
        (jit_options["cache_dir"] / "libffcx_forms_0.c").touch()
        dolfinx_compat.abandon()  # as Ctrl-C does it, and then ends the process
        left.extend(shared_path.iterdir())
        raise ImportError

    monkeypatch.setattr(dolfinx.jit, "ffcx_jit", ffcx_jit)
    with pytest.raises(MissingDependencyError):
        make(comm, shared_path)
    assert not left
    dolfinx_compat.abandon()  # nothing is being made now


def test_what_killed_runs_have_left_is_removed_after_a_day(shared_path, comm):
    if comm.rank == 0:
        old, new = (form_cache.workplace(shared_path) for _ in range(2))
        (old / "libffcx_forms_0.c").touch()
        os.utime(old, (1e9, 1e9))
        third = form_cache.workplace(shared_path)
        assert sorted(shared_path.iterdir()) == sorted([new, third])


def test_a_run_that_ends_meanwhile_does_not_disturb(shared_path, comm):
    """Its folder is listed, and gone when it is looked at: so is a link to nowhere."""
    if comm.rank == 0:
        gone = shared_path / "lobefem-gone"
        gone.symlink_to(shared_path / "nowhere")
        assert form_cache.workplace(shared_path).is_dir()
        assert gone.is_symlink()


def test_compiling_is_said_while_it_lasts(comm, shared_path):
    lines = []
    with progress.announced(lines.append):
        make(comm, shared_path)
        assert len(lines) == (comm.rank == 0)
        make(comm, shared_path)
    assert all(line.startswith("compiling form ") for line in lines)
    make(comm, shared_path / "another")
    assert len(lines) == (comm.rank == 0)


def test_arguments_that_are_not_utf8_are_not_shown_to_cpp(monkeypatch):
    given = ["lobefem", "/tmp/L\udcf6sung/design.toml", "-q"]
    monkeypatch.setattr(sys, "argv", given)
    with dolfinx_compat._readable_arguments():
        assert sys.argv == ["lobefem", "/tmp/L?sung/design.toml", "-q"]
    assert sys.argv is given


def test_wheels_that_do_not_go_together_are_seen(tmp_path):
    petsc4py = tmp_path / "petsc4py"
    for name in ("dolfinx_solver_real-0.11.0", "numpy-2.4.0", "mpi4py-4.1.1"):
        (tmp_path / f"{name}.dist-info").mkdir()
    assert not dolfinx_compat.mixed_wheels(tmp_path, petsc4py)
    assert dolfinx_compat.mixed_wheels(tmp_path, tmp_path / "elsewhere" / "petsc4py")
    for name in ("petsc-3.25.0", "slepc4py-3.25.0", "dolfinx_solver_complex-0.11.0"):
        other = tmp_path / f"{name}.dist-info"
        other.mkdir()
        assert dolfinx_compat.mixed_wheels(tmp_path, petsc4py)
        other.rmdir()
