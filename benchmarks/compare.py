"""The common problem by lobefem and by other programs, side by side: time, memory, right answers.

    python -m benchmarks.compare --runs 5 --out out/bench
    python -m benchmarks.compare --short        # lobefem and Surface Evolver on the two finest meshes

Each run is a whole process on one core (OMP_NUM_THREADS=1), from its input file to its answer; the
programs take turns, so that a busy spell of the machine meets all of them. Times and memory are medians.
A program's time counts only where its answer is right (`benchmarks.problem`): the volume to 1e-7 and the
largest displacement to 1e-5. A program that is not there is left out with a word. Compiled forms are kept
with the results, so that the first run, which is not among the others, tells what their compilation takes.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path
from statistics import median
from typing import Any

from benchmarks.problem import CASES, MESHES, Case
from benchmarks.programs import ROOT, Job, calculix, evolver, kratos, lobefem, newton, ngsolve
from benchmarks.report import write_report

PROGRAMS = {module.NAME: module for module in (lobefem, newton, evolver, ngsolve, kratos, calculix)}
SHORT = (["lobefem", "lobefem, Newton", "Surface Evolver"], ["96x128", "192x256"])
_DROPPED = ("PYTHONDONTWRITEBYTECODE", "PYTHONPROFILEIMPORTTIME")  # they slow Python programs down


def run(job: Job, folder: Path, limit: float) -> dict[str, Any]:
    """Run a job in a folder: seconds, CPU seconds, peak memory [MB], exit code (`benchmarks.measure`)."""
    environment = {k: v for k, v in os.environ.items() if k not in _DROPPED} | {"OMP_NUM_THREADS": "1"}
    what = {
        "command": job.command,
        "folder": str(folder),
        "environment": environment | job.environment,
        "stdin": job.stdin,
        "limit": limit,
    }
    measure = [sys.executable, "-I", str(ROOT / "benchmarks/measure.py")]
    done = subprocess.run(measure, input=json.dumps(what), capture_output=True, text=True, check=True)
    record: dict[str, Any] = json.loads(done.stdout)
    return record


def attempt(name: str, case: Case, limit: float) -> dict[str, Any]:
    """One run of one program: its time and whether its answer is right."""
    module = PROGRAMS[name]
    with tempfile.TemporaryDirectory(prefix="lobefem-bench-") as path:
        folder = Path(path)
        record = run(module.prepare(case, folder), folder, limit)
        record |= {"right": False, "reason": "", "iterations": None}
        if record["code"] is None:
            return record | {"reason": f"not in {limit:g} s"}
        try:
            found = module.answer(case, folder, (folder / "stdout").read_text(encoding="utf-8"))
        except (OSError, ValueError, LookupError):
            return record | {"reason": "no answer"}
        volume, displacement = found.errors(case)
        record |= {
            "volume": found.volume,
            "displacement": found.displacement,
            "iterations": found.iterations,
            "volume_error": volume,
            "displacement_error": displacement,
            "right": found.right(case),
        }
        if not record["right"]:
            record["reason"] = f"wrong: V by {volume:.0e}, displacement by {displacement:.0e}"
        if module in (lobefem, newton):
            record["profile"] = lobefem.results(folder)["profile"]
    return record


def compare(names: Iterable[str], cases: Iterable[Case], runs: int, limit: float) -> list[dict[str, Any]]:
    """All runs: programs take turns within each case, there and back; what fails once is not tried again.

    A process that takes more memory than the one before waits for pages that the machine has to find first,
    on a virtual one for a good part of a second; so none has the same one before it each time.
    """
    names, records = list(names), []
    for case in cases:
        failed: set[str] = set()
        for number in range(runs):
            for name in names if number % 2 == 0 else reversed(names):
                if name in failed:
                    continue
                label = {"program": name, "case": case.name, "divisions": case.divisions}
                label |= {"unknowns": case.unknowns, "run": number}
                why = PROGRAMS[name].missing() or PROGRAMS[name].unable(case)
                if why:
                    record: dict[str, Any] = {"right": False, "reason": why}
                else:
                    record = attempt(name, case, limit)
                records.append(label | record)
                if not record["right"]:
                    failed.add(name)
                divisions = "{}x{}".format(*case.divisions)
                said = record["reason"] or f"{record['seconds']:.2f} s, {record['memory']:.0f} MB"
                print(f"{case.name} {divisions} run {number + 1}: {name}: {said}", flush=True)
    return records


def medians(records: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """One row for each program and case: medians of its runs, all right, or why there is none."""
    rows: dict[tuple[Any, ...], list[dict[str, Any]]] = {}
    for record in records:
        key = (record["case"], tuple(record["divisions"]), record["program"])
        rows.setdefault(key, []).append(record)
    result = []
    for (case, divisions, program), group in rows.items():
        row = {"program": program, "case": case, "divisions": divisions, "unknowns": group[0]["unknowns"]}
        wrong = [record for record in group if not record["right"]]
        row |= {"runs": len(group), "right": not wrong, "reason": wrong[0]["reason"] if wrong else ""}
        for key in ("seconds", "cpu", "memory", "iterations", "volume_error", "displacement_error"):
            values = [record[key] for record in group if record.get(key) is not None]
            row[key] = median(values) if values else None
        profiles = [record["profile"] for record in group if "profile" in record]
        if profiles:
            row["over_floor"] = median(profile["solve"] / profile["floor"] for profile in profiles)
            row |= {key: median(profile[key] for profile in profiles) for key in ("solve", "floor")}
            row["stages"] = {
                name: median(profile["stages"][name]["seconds"] for profile in profiles)
                for name in profiles[0]["stages"]
            }
        result.append(row)
    return result


def main() -> None:
    """Run the comparison and write results.json, results.md and scaling.png."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/bench"), help="folder for the results")
    parser.add_argument("--runs", type=int, default=5, help="of each program and case (default 5)")
    parser.add_argument("--limit", type=float, default=300.0, help="seconds for one run (default 300)")
    meshes = ["{}x{}".format(*divisions) for divisions in MESHES]
    parser.add_argument("--meshes", nargs="+", choices=meshes, default=meshes)
    parser.add_argument("--cases", nargs="+", choices=list(CASES), default=list(CASES))
    parser.add_argument("--programs", nargs="+", choices=list(PROGRAMS), default=list(PROGRAMS))
    parser.add_argument(
        "--short", action="store_true", help=f"{' and '.join(SHORT[0])} on {' and '.join(SHORT[1])} only"
    )
    given = parser.parse_args()
    if given.short:
        given.programs, given.meshes = SHORT
    chosen = [divisions for divisions, text in zip(MESHES, meshes, strict=True) if text in given.meshes]
    cases = [Case(name, divisions) for divisions in chosen for name in given.cases]
    os.environ["XDG_CACHE_HOME"] = str((given.out / "cache").resolve())
    # once for the caches: compiled forms, bytecode, the files of the programs
    first = compare(given.programs, [Case(name, MESHES[0]) for name in given.cases], 1, given.limit)
    records = compare(given.programs, cases, given.runs, given.limit)
    rows = medians(records)
    given.out.mkdir(parents=True, exist_ok=True)
    text = json.dumps({"rows": rows, "records": records, "first": first}, indent=1)
    (given.out / "results.json").write_text(text, encoding="utf-8")
    write_report(given.out, rows, first)
    print((given.out / "results.md").read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
