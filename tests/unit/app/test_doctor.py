"""The doctor finds a sound installation sound, and says what to do about a broken one."""

import subprocess
import sys
import textwrap
from types import SimpleNamespace

import numpy as np
import pytest

from lobefem.app import cli, doctor
from lobefem.errors import MissingDependencyError
from lobefem.fem import contact_potential
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.linalg import dolfinx_compat, form_cache, petsc
from lobefem.viz import rendering

import ufl
from petsc4py import PETSc


@pytest.mark.slow
def test_a_sound_installation(capfd, comm):
    assert cli.main(["doctor"]) == 0
    lines = [line for line in capfd.readouterr().out.splitlines() if line]
    if comm.rank == 0:
        assert [line[:2] for line in lines] == ["ok"] * len(doctor.CHECKS)
        assert any("DOLFINx 0." in line and "SLEPc 3." in line for line in lines)


def missing(name):
    """A module that cannot be imported."""
    return lambda monkeypatch: monkeypatch.setitem(sys.modules, name, None)


def raises(*arguments, **options):
    raise RuntimeError("something is\n  broken")


# a line of a process's memory map where Debian's libblas3 is all there is
NETLIB = SimpleNamespace(
    read_text=lambda **_: (
        "7f1-7f2 r-xp 0 00:1f 11 /usr/lib/libm.so.6\n"
        "7f3-7f4 r-xp 0 00:1f 12 /usr/lib/x86_64-linux-gnu/blas/libblas.so.3.12.1\n"
    )
)

FAULTS = {
    "finite elements": (
        missing("slepc4py"),
        "slepc4py",
        "on Debian 13 install python3-dolfinx-real python3-slepc4py-real, elsewhere",
    ),
    "scalars": (
        lambda m: m.setattr(PETSc, "ScalarType", np.complex128),
        "complex128",
        "use a PETSc of real double-precision",
    ),
    "MUMPS": (
        lambda m: m.setattr(petsc, "num_negative", lambda matrix: 0),
        "counts 0 negative",
        "built with MUMPS",
    ),
    "BLAS": (
        lambda m: m.setattr(doctor, "_MAPS", NETLIB),
        "/usr/lib/x86_64-linux-gnu/blas/libblas.so.3.12.1 is Netlib's",
        "install an optimised one (Debian: libopenblas0-serial)",
    ),
    "compiler": (
        lambda m: m.setattr(dolfinx_compat, "form", raises),
        "something is broken",
        "install a C compiler (Debian: gcc",
    ),
    "compiled forms": (
        lambda m: m.setattr(form_cache, "examine", lambda folder: (3, {"libffcx_forms_0": "cut short"})),
        "1 of 3 in ",
        "a run that needs one of these compiles it again by itself",
    ),
    "MPI": (
        lambda m: m.setenv("PMI_SIZE", "64") or m.delenv("OMPI_COMM_WORLD_SIZE", raising=False),
        "64 processes were started, and",
        "start all ranks with the mpirun of the MPI",
    ),
    "Gmsh": (missing("gmsh"), "gmsh", "install Gmsh with its system libraries (Debian: python3-gmsh"),
    "pictures": (
        lambda m: m.setattr(rendering, "can_render", lambda: False),
        "draws nothing off-screen",
        "install OpenGL",
    ),
    "contact": (missing("ipctk"), "ipctk", "pip install 'ipctk"),
}


@pytest.mark.parametrize(
    ("touch", "said"),
    [
        ("import os, signal; os.kill(os.getpid(), signal.SIGILL)", "ends by SIGILL: it was built"),
        ("print(False)", "finds no contact"),
    ],
)
def test_a_contact_that_ends_its_process_is_a_finding(monkeypatch, touch, said):
    monkeypatch.setattr(doctor, "_TOUCH", touch)
    with pytest.raises(RuntimeError, match=said):
        doctor.CHECKS["contact"][0]()


def test_every_check_has_a_fault():
    assert {*FAULTS, "Python"} == set(doctor.CHECKS)  # an older Python cannot even begin


@pytest.mark.parametrize("name", FAULTS)
def test_every_fault_is_said_with_its_remedy(monkeypatch, capfd, comm, name):
    fault, found, advice = FAULTS[name]
    monkeypatch.setattr(doctor, "CHECKS", {"sound": (lambda: "1.0", "never said"), name: doctor.CHECKS[name]})
    with monkeypatch.context() as patch:
        fault(patch)
        code = cli.main(["doctor", "--quiet"])
    assert code == 1
    out = " ".join(capfd.readouterr().out.split())
    if comm.rank == 0:
        assert out.startswith(f"FAIL {name} ")
        assert found in out
        assert f"-> {advice}" in out or advice in out.partition("->")[2]
        assert "sound" not in out.replace(name, "")


def test_forms_are_compiled_where_runs_keep_theirs(monkeypatch, shared_path, comm):
    """Not among temporary files, where Docker lets no library be loaded."""
    monkeypatch.setattr(dolfinx_compat, "cache_folder", lambda: shared_path)
    real, folders = dolfinx_compat.form, []

    def form(expression, cache_dir):
        folders.append(cache_dir.parent)
        return real(expression, cache_dir)

    monkeypatch.setattr(dolfinx_compat, "form", form)
    assert doctor.CHECKS["compiler"][0]() == "compiles forms"
    assert folders == [shared_path]
    comm.barrier()
    assert not list(shared_path.iterdir())


def test_a_cache_that_cannot_be_used_is_not_taken_for_a_missing_compiler(monkeypatch, shared_path, comm):
    if comm.rank == 0:
        (shared_path / "file").touch()
    comm.barrier()
    monkeypatch.setattr(dolfinx_compat, "cache_folder", lambda: shared_path / "file")
    monkeypatch.setattr(doctor, "CHECKS", {"compiler": doctor.CHECKS["compiler"]})
    (finding,) = doctor.examine()
    assert not finding.fine
    assert finding.found.startswith(f"compiled forms cannot be kept in {shared_path}/file/")
    assert finding.advice == "make room there, or set XDG_CACHE_HOME to a folder that you may write to"


def test_bad_entries_among_compiled_forms_are_found(monkeypatch, shared_path, comm):
    monkeypatch.setattr(dolfinx_compat, "cache_folder", lambda: shared_path)
    mesh = lobed_cylinder(1, (2, 3), comm=comm).mesh
    for k in range(2):
        dolfinx_compat.form(ufl.SpatialCoordinate(mesh)[k] * ufl.dx(mesh))
    if comm.rank == 0:
        (shared_path / "libffcx_forms_0.c").touch()  # another program compiles it
    comm.barrier()
    assert doctor.CHECKS["compiled forms"][0]() == f"2 in {shared_path}"
    comm.barrier()
    if comm.rank == 0:
        library = min(shared_path.glob("*.so"))
        data = library.read_bytes()
        library.unlink()
        library.write_bytes(data[:100])
    comm.barrier()
    with pytest.raises(RuntimeError, match=r"^1 of 2 in .* cannot be used, as libffcx_forms_.*cut short"):
        doctor.CHECKS["compiled forms"][0]()


@pytest.mark.serial
def test_where_nothing_is_installed_everything_is_said_to_be_missing():
    program = """
        import sys
        for name in "dolfinx dolfinx_solver petsc4py slepc4py mpi4py gmsh pyvista ipctk".split():
            sys.modules[name] = None
        from lobefem.app.cli import main
        sys.exit(main(["doctor"]))
    """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(program)],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert done.returncode == 1
    assert done.stderr == ""
    assert done.stdout.count("FAIL") == len(doctor.CHECKS) - 1
    assert done.stdout.count("->") == len(doctor.CHECKS) - 1


def test_contact_refuses_wheels_that_end_the_process(monkeypatch):
    ipctk = pytest.importorskip("ipctk")
    monkeypatch.setattr(ipctk, "__version__", "1.6.1")
    with pytest.raises(MissingDependencyError, match="end the process on a processor without AVX-512"):
        contact_potential._import_ipctk()
