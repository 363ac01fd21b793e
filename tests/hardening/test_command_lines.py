"""Command lines of any kind end with sound results, or with one sentence and exit code 2 or 3."""

import contextlib
import json
import shutil
from pathlib import Path

import pytest
from broken import SINGLE, cases, command_lines, fault, fault_of_results, leftovers, run

from mpi4py import MPI

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """A run of modes, for what reads one."""
    folder = MPI.COMM_WORLD.bcast(tmp_path_factory.getbasetemp() / "kept", root=0)
    assert run(["modes", SINGLE, "--divisions", "4x6", "--count", "2", "--out", folder])[0] == 0
    return folder


@cases(0.25, 12, line=command_lines())
def test_any_command_line_ends_well_or_in_one_sentence(tmp_path_factory, kept, line):
    """And writes only where it is told to: nothing in the repository, where a folder was once left."""
    comm = MPI.COMM_WORLD
    folder = comm.bcast(tmp_path_factory.getbasetemp() / "any", root=0)
    if comm.rank == 0:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        (folder / "file").write_text("")
        (folder / "full").mkdir()
        (folder / "full" / "other").write_text("")
        shutil.copytree(kept, folder / "run")
        before = {p.relative_to(folder) for p in folder.rglob("*")}
        around = {*ROOT.iterdir(), *folder.parent.iterdir()}
    comm.Barrier()
    arguments = [word.replace("OUT", str(folder)) for word in line]
    if arguments[0] in ("inflate", "modes", "critical", "harmonics", "perturb") and "--json" not in line:
        arguments += ["--json", str(folder / "results.json")]
    with contextlib.chdir(folder):  # where --out '' writes
        code, out, err = run(arguments)
    wrong = ""
    if comm.rank == 0:
        wrong = fault(code, out, err)
        for path in folder.rglob("*.json"):
            results = json.loads(path.read_text())
            if code == 0 and path.name != "run.json":
                wrong = wrong or fault_of_results(results)
        wrong = wrong or "".join(f"{path} is left over" for path in leftovers(folder))
        # a device that is full is found out at the end: the run folder holds what was found
        if code == 2 and not wrong and "No space left on device" not in err:
            more = {p.relative_to(folder) for p in folder.rglob("*")} - before
            wrong = f"bad input wrote {more}" if more else ""
        beside = {*ROOT.iterdir(), *folder.parent.iterdir()} - around
        wrong = wrong or (f"{beside} are left beside the folder" if beside else "")
    wrong = comm.bcast(wrong, root=0)
    assert not wrong, f"{wrong}: {line}\n{err}"
