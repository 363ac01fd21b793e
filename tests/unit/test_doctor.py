"""The doctor finds a sound installation sound, and says what to do about a broken one."""

import subprocess
import sys
import textwrap
from types import SimpleNamespace

import numpy as np
import pytest
from petsc4py import PETSc

from lobefem import _dolfinx, _petsc, cli, contact, doctor, rendering
from lobefem.errors import MissingDependencyError


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
        lambda m: m.setattr(_petsc, "num_negative", lambda matrix: 0),
        "counts 0 negative",
        "built with MUMPS",
    ),
    "BLAS": (
        lambda m: m.setattr(doctor, "_MAPS", NETLIB),
        "/usr/lib/x86_64-linux-gnu/blas/libblas.so.3.12.1 is Netlib's",
        "install an optimised one (Debian: libopenblas0-serial)",
    ),
    "compiler": (
        lambda m: m.setattr(_dolfinx, "form", raises),
        "something is broken",
        "install a C compiler (Debian: gcc",
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


@pytest.mark.serial
def test_where_nothing_is_installed_everything_is_said_to_be_missing():
    program = """
        import sys
        for name in "dolfinx dolfinx_solver petsc4py slepc4py mpi4py gmsh pyvista ipctk".split():
            sys.modules[name] = None
        from lobefem.cli import main
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
        contact._import_ipctk()
