"""The command as a process of its own: what it loads, its exit codes, an early interrupt."""

import json
import os
import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

SINGLE = str(Path(__file__).parents[2] / "meshes/single.toml")
COARSE = ("--divisions", "6x10")

# a launcher's children may not launch: MPICH and Open MPI refuse, or take them for their own
pytestmark = pytest.mark.serial


def start(*command, **variables):
    return subprocess.run(
        command,
        env=os.environ | variables,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )


def test_help_loads_nothing_heavy():
    program = textwrap.dedent("""
        import sys
        from lobefem.cli import main
        assert main(["--help"]) == main(["perturb", "--help"]) == 0
        heavy = {"dolfinx", "mpi4py", "petsc4py", "ufl", "numpy", "scipy", "pyvista", "gmsh", "matplotlib"}
        print(sorted(heavy & set(sys.modules)))
    """)
    done = start(sys.executable, "-c", program)
    assert done.returncode == 0
    assert done.stdout.splitlines()[-1] == "[]"


@pytest.mark.slow
@pytest.mark.parametrize("command", [["inflate"], ["modes", "--film", "isotropic", "--count", "2"]])
def test_a_solve_loads_nothing_that_it_does_not_need(command):
    program = textwrap.dedent(f"""
        import sys
        from lobefem.cli import main
        assert main([*{command!r}, {str(SINGLE)!r}, *{COARSE!r}, "--quiet"]) == 0
        needless = {{"scipy", "ipctk", "pyvista", "matplotlib", "lobefem.distortions", "lobefem.report"}}
        print(sorted(needless & set(sys.modules)))
    """)
    done = start(sys.executable, "-c", program)
    assert done.returncode == 0
    assert done.stdout.splitlines()[-1] == "[]"


@pytest.mark.slow
def test_a_process_prints_json_alone():
    done = start(sys.executable, "-m", "lobefem", "inflate", SINGLE, *COARSE, "--json", "-")
    assert done.returncode == 0
    assert json.loads(done.stdout)["converged"] is True


@pytest.mark.slow
def test_a_process_ends_with_the_exit_code():
    done = start(sys.executable, "-m", "lobefem", "inflate", SINGLE, "--film", "rubber")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.splitlines()[-1].startswith("lobefem: --film: 'rubber' is unknown")


def test_an_early_interrupt_shows_no_traceback():
    """While the command line's own packages are imported."""
    program = textwrap.dedent("""
        import os, signal, sys

        class Interrupt:
            def find_spec(self, name, path=None, target=None):
                if name == "typer":
                    os.kill(os.getpid(), signal.SIGINT)

        sys.meta_path.insert(0, Interrupt())
        from lobefem.__main__ import main
        main()
    """)
    done = start(sys.executable, "-c", program)
    assert (done.returncode, done.stdout, done.stderr) == (-signal.SIGINT, "", "")


# --- one end for all ranks ----------------------------------------------------------------------
