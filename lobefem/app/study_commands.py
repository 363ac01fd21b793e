"""Commands that run many designs: a sweep, and the search for the best one.

Nothing heavy is imported before a command runs.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import typer

from lobefem.app import output_options, parsing, run_options
from lobefem.app.progress_bar import reporting
from lobefem.app.runner import loudness
from lobefem.app.tables import printable, show_rows
from lobefem.errors import InputError

__all__ = ["optimise", "sweep"]


def sweep(
    context: typer.Context,
    file: run_options.SweepFile,
    out: output_options.SweepFolder,
    workers: run_options.Workers = None,
    overwrite: output_options.Overwrite = False,
    resume: output_options.Resume = False,
    report: output_options.Report = False,
    json: output_options.Json = None,
    quiet: output_options.Quiet = False,
    verbose: output_options.Verbose = False,
) -> int:
    """Run one command for many designs, pressures or films, with a table and a chart."""
    from lobefem.app import sweep_command as runs
    from lobefem.app.sweep_file import load
    from lobefem.files import on_root, require_file

    if resume and overwrite:
        raise InputError("--resume goes on with a sweep and --overwrite replaces it; give one of them")
    number = len(os.sched_getaffinity(0)) if workers is None else parsing.integer("--workers", workers, 1)
    commands = context.find_root().command.commands  # type: ignore[attr-defined]
    known = {
        name: {o.lstrip("-") for p in one.params if not getattr(p, "hidden", False) for o in p.opts}
        for name, one in commands.items()
    }
    ranks = context.obj

    def prepare() -> Any:
        study = load(file, known)
        if json and json != "-":
            require_file(json)
        runs.begin(study, out, resume=resume, overwrite=overwrite)
        return study

    said = loudness(context)
    study = prepare() if ranks.comm is None else on_root(ranks.comm, file, prepare)
    ranks.stop.note = lambda: f"; finished points are in {out}, go on with --resume"
    with (
        runs.workers(number, ranks.comm) as executor,
        reporting(ranks.is_root, ranks.stop, **said) as progress,
    ):
        if executor is None:
            return 0
        rows = runs.run(study, out, executor, progress=progress)
    code = _swept(study, rows, out, json, said["quiet"])
    if report:
        from lobefem.viz.report import write_report

        write_report(out)
    return code


def _swept(study: Any, rows: Any, out: Any, json: str | None, quiet: bool) -> int:
    """The end of a sweep, on rank 0: files, table, exit code."""
    from lobefem.app import sweep_command as runs
    from lobefem.app.sweep_command import parameter_chart
    from lobefem.files import replace, replacing, to_json
    from lobefem.viz.sweep_map import draw_map, sweep_map
    from lobefem.viz.verdict import verdict

    found = runs.results(study, rows)
    text = to_json(found)
    cells = sweep_map(found)
    with replacing(out / "sweep.png") as stream:
        figure = parameter_chart(study, rows) if cells is None else draw_map(cells)
        figure.savefig(stream, format="png")
    replace(out / "table.csv", runs.as_csv(study, rows))
    replace(out / "results.json", text)
    for warning in found["warnings"]:
        print(f"lobefem: warning: {warning}", file=sys.stderr)
    if json == "-":
        sys.stdout.write(text)
    else:
        if json:
            replace(Path(json), text)
        if not quiet:
            show_rows(list(runs.table(study, rows)))
            for sentence in verdict(found):
                print(sentence)
            print(f"Table, chart and the run folders of the points are in {printable(out)}")
    sys.stdout.flush()
    return 3 if found["failed"] == len(rows) else 0


def optimise(
    context: typer.Context,
    file: run_options.SearchFile,
    out: output_options.SearchFolder,
    starts: run_options.Starts = "3",
    random: run_options.RandomDesigns = "0",
    overwrite: output_options.Overwrite = False,
    resume: output_options.Resume = False,
    json: output_options.Json = None,
    quiet: output_options.Quiet = False,
    verbose: output_options.Verbose = False,
) -> int:
    """Search for the best pumpkin: all designs kept, a Pareto chart, and the best one's gores."""
    if resume and overwrite:
        raise InputError("--resume goes on with a search and --overwrite replaces it; give one of them")
    numbers = parsing.integer("--starts", starts, 1), parsing.integer("--random", random, 0)
    ranks, said = context.obj, loudness(context)
    if ranks.comm is not None:
        raise InputError("a search is one process; start it without mpirun")
    from lobefem.app import search_file
    from lobefem.app.optimise_command import begin, search
    from lobefem.app.search_results import finish, show_search
    from lobefem.files import require_file

    plan = search_file.load(file)
    if json and json != "-":
        require_file(json)
    solved = begin(plan, out, resume=resume, overwrite=overwrite)
    ranks.stop.note = lambda: f"; solved designs are in {out}, go on with --resume"
    with reporting(ranks.is_root, ranks.stop, **said) as progress:
        ended = search(plan, solved, starts=numbers[0], random=numbers[1], progress=progress)
    found = finish(plan, solved, ended, out)
    show_search(plan, ended, found, out, json=json, quiet=said["quiet"])
    return 0 if found["best"] is not None else 3
