"""Command lines of any kind end with sound results, or with one sentence and exit code 2 or 3."""

import contextlib
import json
import shutil

from broken import cases, command_lines, fault, fault_of_results, leftovers, run
from hypothesis import given
from mpi4py import MPI


@cases(0.25, 12)
@given(command_lines())
def test_any_command_line_ends_well_or_in_one_sentence(tmp_path_factory, line):
    comm = MPI.COMM_WORLD
    folder = comm.bcast(tmp_path_factory.getbasetemp() / "any", root=0)
    if comm.rank == 0:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        (folder / "file").write_text("")
        (folder / "full").mkdir()
        (folder / "full" / "other").write_text("")
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
        if code == 2 and not wrong:
            kept = {p.name for p in folder.rglob("*")}
            wrong = f"bad input wrote {kept}" if kept - {"file", "full", "other"} else ""
    wrong = comm.bcast(wrong, root=0)
    assert not wrong, f"{wrong}: {line}\n{err}"
