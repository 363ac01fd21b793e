"""The command as a process of its own: what it loads, its exit codes, an early interrupt."""

import json
import os
import shutil
import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

SINGLE = str(Path(__file__).parents[3] / "meshes/single.toml")
COARSE = ("--divisions", "6x10")

MPIRUN = shutil.which("mpirun", path=f"{Path(sys.executable).parent}:{os.environ.get('PATH', '')}")

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
        from lobefem.app.cli import main
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
        from lobefem.app.cli import main
        assert main([*{command!r}, {str(SINGLE)!r}, *{COARSE!r}, "--quiet"]) == 0
        needless = {{"scipy", "ipctk", "pyvista", "matplotlib", "lobefem.viz.report"}}
        needless |= {{"lobefem.equilibrium.displacement_control", "lobefem.equilibrium.ramp"}}
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


@pytest.mark.parametrize("arguments", [["--version"], ["--help"], ["modes", "--help"], []])
def test_what_needs_no_run_is_printed_once(arguments):
    one, two = (
        start(*launcher, sys.executable, "-m", "lobefem", *arguments)
        for launcher in ([], [MPIRUN, "-n", "2"])
    )
    assert (two.returncode, two.stdout) == (one.returncode, one.stdout) != (0, "")


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


def test_paths_that_are_not_utf8(tmp_path):
    """A folder of Latin-1, of which the forms are compiled too; stdout takes UTF-8 and nothing else."""
    folder = os.fsdecode(os.fsencode(tmp_path) + b"/L\xf6sung")
    os.mkdir(folder)
    shutil.copy(SINGLE, folder)
    given = {"PYTHONIOENCODING": "utf-8:strict", "XDG_CACHE_HOME": f"{folder}/cache"}
    module = (sys.executable, "-m", "lobefem")
    run = start(*module, "modes", f"{folder}/single.toml", *COARSE, "--count", "1", "--out", f"{folder}/run",
                "--json", f"{folder}/modes.json", **given)  # fmt: skip
    assert run.returncode == 0, run.stderr
    assert f"are in {tmp_path}/L\\udcf6sung/run\n" in run.stdout
    (found,) = json.loads(Path(folder, "modes.json").read_text(encoding="utf-8"))["pressures"]
    assert [mode["kind"] for mode in found["modes"]] == ["sway", "sway"]
    assert found["modes"][0]["real"] == pytest.approx(87.3, rel=1e-4)
    assert len(list(Path(folder, "cache/fenics").glob("*.so"))) > 3
    for command in (
        ("plot", f"{folder}/run", "--what", "modes", "--to", f"{folder}/modes.png"),
        ("report", f"{folder}/run"),
        ("doctor",),
    ):
        done = start(*module, *command, **given)
        assert done.returncode == 0, done.stderr
        assert f"{tmp_path}/L\\udcf6sung/" in "".join(done.stdout.splitlines())
    missing = start(*module, "inflate", f"{folder}/none.toml", **given)
    assert missing.returncode == 2
    assert missing.stderr.startswith(f"lobefem: there is no design file '{tmp_path}/L\\udcf6sung/none.toml'")


@pytest.mark.parametrize(
    "absent", ["dolfinx dolfinx_solver petsc4py slepc4py mpi4py cffi basix ufl ffcx", "cffi", "dolfinx"]
)
def test_without_dolfinx_every_way_in_says_how_to_get_it(absent):
    """As after `pip install lobefem` without the extra."""
    program = f"""
        import sys
        for name in {absent.split()}:
            sys.modules[name] = None
        from lobefem.app.cli import main
        sys.exit(main(sys.argv[1:]))
    """
    for command in (
        ("inflate", SINGLE),
        ("modes", SINGLE, *COARSE),
        ("critical", SINGLE),
        ("harmonics", SINGLE),
    ):
        run = start(sys.executable, "-c", textwrap.dedent(program), *command)
        assert run.stderr.startswith("lobefem: DOLFINx with PETSc cannot be imported ("), run.stderr
        assert run.stderr.endswith("elsewhere run: pip install 'lobefem[wheel]'\n")
        assert (run.returncode, run.stdout) == (2, "")


_COMPILES = """
import sys
from pathlib import Path
import ufl
from lobefem.linalg import dolfinx_compat
from lobefem.geometry.stacks import lobed_cylinder
x = ufl.SpatialCoordinate(lobed_cylinder(1, (2, 3)).mesh)
for k in range(3):
    assert dolfinx_compat.form(x[k] * ufl.dx, Path(sys.argv[1])) is not None
"""


def test_two_processes_compile_into_one_cache_at_once(tmp_path):
    both = [subprocess.Popen([sys.executable, "-c", _COMPILES, tmp_path]) for _ in range(2)]
    assert [one.wait(timeout=300) for one in both] == [0, 0]
    from lobefem.linalg import form_cache

    assert form_cache.examine(tmp_path) == (3, {})
    assert len(list(tmp_path.iterdir())) == 9  # nothing else is left
