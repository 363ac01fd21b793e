"""The `lobefem` command: options over a design file, results as a table, as JSON and in a folder.

Nothing heavy is imported before a command runs, so that --help answers at once. All ranks parse the
same arguments; rank 0 alone prints. Exit codes: 0 done, 1 a fault of lobefem, 2 bad input, 3 a solve
that failed, 130 interrupted.
"""

from __future__ import annotations

import io
import os
import sys
import traceback
from contextlib import nullcontext, redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lobefem.app import options, parsing, reference
from lobefem.app.process import Ranks
from lobefem.app.progress_bar import reporting
from lobefem.app.runner import Interrupted, loudness, one_line, overridden, run_task
from lobefem.app.tables import printable, show_rows
from lobefem.errors import InputError, LobefemError
from lobefem.terminal import settle
from lobefem.version import __version__

if TYPE_CHECKING:
    from lobefem.app.states_command import Outcome
    from lobefem.io.design import Design

__all__ = ["app", "main"]

app = typer.Typer(
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Tell whether a lobed balloon is stable: inflated shape, buckling modes, critical pressure.",
    epilog="Start with: [bold]lobefem new stack4 > mine.toml[/bold], then [bold]lobefem critical mine.toml "
    "--film tension-field --state inflated --load closed[/bold]",
)


def _tasks() -> Any:
    import lobefem.app.states_command

    return lobefem.app.states_command


def _studies() -> Any:
    import lobefem.app.critical_command

    return lobefem.app.critical_command


def _of(plan: Design, stacks: Any) -> Any:
    """The module with the commands of a design's kind."""
    if not plan.is_pumpkin:
        return stacks()
    import lobefem.app.pumpkin_stability

    return lobefem.app.pumpkin_stability


def _state(plan: Design, given: str | None) -> str:
    """Of --state, or the default of a design's kind."""
    return given or ("inflated" if plan.is_pumpkin else "ideal")


def _meshes() -> Any:
    import lobefem.app.mesh_study_command

    return lobefem.app.mesh_study_command


def _request(context: typer.Context, wanted: bool, meshes: str | None, tolerance: str | None) -> Any:
    """The mesh study that options ask for, None without one."""
    pairs = parsing.divisions("--meshes", meshes)
    share = None if tolerance is None else parsing.share("--tolerance", tolerance)
    if pairs is not None and not (wanted or share):
        raise InputError("--meshes are those of a mesh study; add --mesh-study")
    if pairs is not None and context.params["divisions"] is not None:
        raise InputError("--divisions are those of the coarsest mesh and --meshes those of all; give one")
    return _meshes().Request(pairs, share) if wanted or share else None


def _what_if(plan: Design, asked: dict[str, Any]) -> Outcome:
    """`critical` with the options asked for, and with other assumptions."""
    from lobefem.app.what_if_command import what_if

    def run(one: Design, progress: Any, folder: Any) -> Outcome:
        return _studies().critical(one, **{**asked, "progress": progress, "folder": folder})  # type: ignore[no-any-return]

    return what_if(plan, run, progress=asked.get("progress"), folder=asked.get("folder"))


def _examples(*lines: str) -> str:
    return "Examples:\n\n" + "\n\n".join(f"[bold]{line}[/bold]" for line in lines)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"lobefem {__version__}")
        raise typer.Exit


@app.callback()
def _lobefem(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version."),
    ] = False,
    quiet: options.Quiet = False,
    verbose: options.Verbose = False,
) -> None:
    pass


@app.command(
    epilog=_examples(
        "lobefem inflate meshes/stack4.toml --film tension-field --pressure 5 --out run",
        "mpirun -n 2 lobefem inflate meshes/single.toml --divisions 96x128 --json -",
    )
)
@options.sharing(options.DESIGN, options.OUTPUT)
def inflate(
    context: typer.Context,
    design: options.DesignFile,
    lift: options.Lift = None,
    prestress: options.Prestress = None,
    setup: options.Setup = None,
    pressure: options.OnePressure = None,
    full: options.Full = False,
    petsc: options.Petsc = None,
) -> None:
    """Find the equilibrium under gas pressure: volume, stress, forces, wrinkles."""
    run_task(context, lambda plan, **run: _tasks().inflate(plan, full=full, **run))


@app.command(
    epilog=_examples(
        "lobefem modes meshes/single.toml --pressure 1000 --pressure 2000 --count 4",
        "lobefem modes meshes/stack4.toml --load closed --mass nodal --out run",
        "lobefem modes meshes/pumpkin.toml --pressure 50 --pressure 100 --harmonics 0:32",
    )
)
@options.sharing(options.DESIGN, options.OUTPUT)
def modes(
    context: typer.Context,
    design: options.DesignFile,
    lift: options.Lift = None,
    prestress: options.Prestress = None,
    setup: options.Setup = None,
    pressure: options.Pressures = None,
    state: options.State = None,
    count: options.Count = "8",
    mass: options.Mass = "unit",
    harmonics: options.Harmonics = None,
    mesh_study: options.MeshStudy = False,
    meshes: options.Meshes = None,
    tolerance: options.Tolerance = None,
    petsc: options.Petsc = None,
) -> None:
    """Find the lowest buckling modes at each pressure; a negative real part means unstable."""
    number = parsing.integer("--count", count, 1)
    parsing.one_of("--state", state or "ideal", ("ideal", "inflated"))
    parsing.one_of("--mass", mass, ("unit", "nodal"))
    chosen = parsing.integers("--harmonics", harmonics)
    request = _request(context, mesh_study, meshes, tolerance)

    def study(plan: Design, **run: Any) -> Outcome:
        asked = {"state": _state(plan, state), "count": number, "mass": mass, "harmonics": chosen, **run}
        if request is not None:
            return _meshes().modes_on_meshes(plan, request, **asked)  # type: ignore[no-any-return]
        return _of(plan, _tasks).modes(plan, **asked)  # type: ignore[no-any-return]

    run_task(context, study)


@app.command(
    epilog=_examples(
        "lobefem critical meshes/stack4.toml --film tension-field --state inflated --load closed",
        "lobefem critical meshes/stack4.toml --film tension-field --state inflated --mesh-study",
        "lobefem critical meshes/stack4.toml --film tension-field --state inflated --what-if",
        "lobefem critical meshes/single.toml --mesh-study --out run",
        "lobefem critical meshes/single.toml --divisions 32x48 --harmonic 3 --json -",
        "lobefem critical meshes/pumpkin.toml --up-to '2 kPa' --out run",
    )
)
@options.sharing(options.DESIGN, options.OUTPUT)
def critical(
    context: typer.Context,
    design: options.DesignFile,
    lift: options.Lift = None,
    state: options.State = None,
    harmonic: options.Harmonic = None,
    limit: options.Limit = None,
    pressure: options.SearchPressure = None,
    mesh_study: options.MeshStudy = False,
    meshes: options.Meshes = None,
    tolerance: options.Tolerance = None,
    what_if: options.WhatIf = False,
    petsc: options.Petsc = None,
) -> None:
    """Find the pressure at which the balloon becomes unstable.

    With --mesh-study it is found on finer and finer meshes and has an error bar; with --what-if also for
    another bar, load and film stiffness.
    """
    parsing.no_pressure("critical", pressure)
    number = None if harmonic is None else parsing.integer("--harmonic", harmonic, 0)
    parsing.one_of("--state", state or "ideal", ("ideal", "inflated"))
    highest = None if limit is None else parsing.pressure("--limit", limit)
    request = _request(context, mesh_study, meshes, tolerance)
    if what_if and request is not None:
        raise InputError("--what-if and --mesh-study are two studies; give one of them")

    def study(plan: Design, **run: Any) -> Outcome:
        asked = {"state": _state(plan, state), "harmonic": number, "limit": highest, **run}
        if what_if:
            return _what_if(plan, asked)
        if request is not None and asked["state"] == "ideal":
            if number is not None or highest is not None or context.params["divisions"] is not None:
                raise InputError(
                    "--mesh-study of the ideal state looks at all harmonics on meshes of its own; leave out "
                    "--harmonic, --limit and --divisions, or add --state inflated"
                )
            if request.tolerance is not None:
                raise InputError(
                    "--tolerance refines the search along inflated states; add --state inflated, or use "
                    "--mesh-study"
                )
            return _studies().mesh_study(plan, divisions=request.meshes, **run)  # type: ignore[no-any-return]
        if request is not None:
            return _meshes().critical_on_meshes(plan, request, **asked)  # type: ignore[no-any-return]
        return _of(plan, _studies).critical(plan, **asked)  # type: ignore[no-any-return]

    run_task(context, study)


@app.command(
    epilog=_examples(
        "lobefem harmonics meshes/single.toml --divisions 96x256 --out run",
        "lobefem harmonics meshes/stack4.toml --film isotropic --harmonics 0:8",
        "lobefem harmonics meshes/pumpkin.toml --up-to '2 kPa' --out run",
    )
)
@options.sharing(options.DESIGN, options.OUTPUT)
def harmonics(
    context: typer.Context,
    design: options.DesignFile,
    lift: options.Lift = None,
    harmonics: options.Harmonics = None,
    limit: options.Limit = None,
    pressure: options.SearchPressure = None,
) -> None:
    """Find the critical pressure for each number of waves around the axis."""
    parsing.no_pressure("harmonics", pressure)
    chosen = parsing.integers("--harmonics", harmonics)
    highest = None if limit is None else parsing.pressure("--limit", limit)
    run_task(
        context,
        lambda plan, **run: _of(plan, _studies).harmonics(plan, harmonics=chosen, limit=highest, **run),
    )


@app.command(
    epilog=_examples(
        "lobefem sensitivities meshes/pumpkin.toml --harmonic 4",
        "lobefem sensitivities meshes/pumpkin.toml --harmonic 4 --pressure '200 Pa' --out run --report",
    )
)
@options.sharing(options.DESIGN, options.OUTPUT)
def sensitivities(
    context: typer.Context,
    design: options.DesignFile,
    harmonic: options.Harmonic = None,
    pressure: options.OnePressure = None,
    limit: options.Limit = None,
    petsc: options.Petsc = None,
) -> None:
    """Find what makes a pumpkin more stable: the effect of each parameter on stability, stress and volume."""
    if harmonic is None:
        raise InputError(
            "sensitivities are those of one harmonic; give it, --harmonic 4 say, and try its neighbours"
        )
    number = parsing.integer("--harmonic", harmonic, 0)
    highest = None if limit is None else parsing.pressure("--limit", limit)

    def study(plan: Design, **run: Any) -> Outcome:
        from lobefem.app.sensitivities_command import sensitivities as look

        return look(plan, harmonic=number, limit=highest, **run)

    run_task(context, study)


@app.command(
    epilog=_examples(
        "lobefem perturb meshes/stack4.toml --film tension-field --pressure 5 --bend 7.5 --release --out run",
        "lobefem perturb meshes/pumpkin.toml --order 1 --divisions 16x4 --harmonic-seed 4:0.05 --release",
    )
)
@options.sharing(options.DESIGN, options.OUTPUT)
def perturb(
    context: typer.Context,
    design: options.DesignFile,
    tip_displacement: options.TipDisplacement = None,
    bend: options.Bend = None,
    twist: options.Twist = None,
    wave: options.Wave = None,
    harmonic_seed: options.HarmonicSeed = None,
    cleft: options.Cleft = False,
    setup: options.Setup = None,
    pressure: options.OnePressure = None,
    release: options.Release = False,
    contact: options.Contact = True,
    steps: options.Steps = "20",
    damping: options.Damping = "1",
    petsc: options.Petsc = None,
) -> None:
    """Distort the balloon in steps, release it, and tell whether it returns."""
    given = {
        "--tip-displacement": tip_displacement, "--bend": bend, "--twist": twist, "--wave": wave,
        "--harmonic-seed": harmonic_seed, "--cleft": "" if cleft else None,
    }  # fmt: skip
    chosen = parsing.chosen(given)
    count, factor = parsing.integer("--steps", steps, 1), parsing.positive("--damping", damping)

    def study(plan: Design, **run: Any) -> Outcome:
        from lobefem.app.perturb_command import perturb

        imposed = parsing.distortion(*chosen, plan)
        return perturb(plan, imposed, let_go=release, contact=contact, steps=count, damping=factor, **run)

    run_task(context, study)


@app.command(
    epilog=_examples(
        "lobefem plot run --what modes",
        "lobefem plot run --what stress --width 170 --to stress.svg",
        "lobefem plot run --what release --format gif",
    )
)
def plot(
    context: typer.Context,
    folder: options.RunDir,
    what: options.What,
    to: options.PictureFile = None,
    format: options.Format = None,  # noqa: A002  --format
    pressure: options.AtPressure = None,
    mode: options.ModeNumbers = None,
    width: options.Width = "85",
) -> None:
    """Plot what a run folder holds, for print or screen; GIF and MP4 are animated."""
    at = None if pressure is None else parsing.pressure("--pressure", pressure)
    numbers, wide = parsing.integers("--mode", mode), parsing.positive("--width", width)
    if context.obj.is_root:
        from lobefem.viz.run_pictures import save_picture

        path = save_picture(folder, what, to, format, pressure=at, modes=numbers, width=wide)
        if not loudness(context)["quiet"]:
            print(f"The picture is {printable(path)}")


@app.command(
    epilog=_examples(
        "lobefem sweep demos/lobes.toml --out run",
        "lobefem sweep demos/lobes.toml --out run --resume --workers 4",
        "mpirun -n 17 lobefem sweep demos/lobes.toml --out run",
    )
)
def sweep(
    context: typer.Context,
    file: options.SweepFile,
    out: options.SweepFolder,
    workers: options.Workers = None,
    overwrite: options.Overwrite = False,
    resume: options.Resume = False,
    report: options.Report = False,
    json: options.Json = None,
    quiet: options.Quiet = False,
    verbose: options.Verbose = False,
) -> int:
    """Run one command for many designs, pressures or films, with a table and a chart."""
    from lobefem.app import sweep_command as runs
    from lobefem.app.sweep_file import load
    from lobefem.files import on_root

    if resume and overwrite:
        raise InputError("--resume goes on with a sweep and --overwrite replaces it; give one of them")
    number = len(os.sched_getaffinity(0)) if workers is None else parsing.integer("--workers", workers, 1)
    commands = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    known = {
        name: {o.lstrip("-") for p in one.params if not getattr(p, "hidden", False) for o in p.opts}
        for name, one in commands.items()
    }
    ranks = context.obj

    def prepare() -> Any:
        study = load(file, known)
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


@app.command(
    epilog=_examples(
        "lobefem optimise demos/search.toml --out run",
        "lobefem optimise demos/search.toml --out run --resume --random 100",
    )
)
def optimise(
    context: typer.Context,
    file: options.SearchFile,
    out: options.SearchFolder,
    starts: options.Starts = "3",
    random: options.RandomDesigns = "0",
    overwrite: options.Overwrite = False,
    resume: options.Resume = False,
    json: options.Json = None,
    quiet: options.Quiet = False,
    verbose: options.Verbose = False,
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

    plan = search_file.load(file)
    solved = begin(plan, out, resume=resume, overwrite=overwrite)
    ranks.stop.note = lambda: f"; solved designs are in {out}, go on with --resume"
    with reporting(ranks.is_root, ranks.stop, **said) as progress:
        ended = search(plan, solved, starts=numbers[0], random=numbers[1], progress=progress)
    found = finish(plan, solved, ended, out)
    show_search(plan, ended, found, out, json=json, quiet=said["quiet"])
    return 0 if found["best"] is not None else 3


@app.command(
    epilog=_examples(
        "lobefem gores meshes/pumpkin.toml --out run/gores",
        "lobefem gores meshes/superpressure.toml --out run/gores --marks 101",
    )
)
def gores(
    context: typer.Context,
    design: options.DesignFile,
    out: options.GoreFolder,
    marks: options.Marks = "51",
    overwrite: options.Overwrite = False,
    quiet: options.Quiet = False,
    verbose: options.Verbose = False,
) -> None:
    """A pumpkin's gore to be cut: a table as CSV, the piece at 1:1 as SVG and DXF."""
    number, said = parsing.integer("--marks", marks, 2), loudness(context)
    if context.obj.is_root:
        from lobefem.app.gores_command import gores as cut

        rows, paths = cut(design, out, marks=number, overwrite=overwrite)
        if not said["quiet"]:
            show_rows(rows)
            print(f"The gore is in {', '.join(printable(path) for path in paths)}")


app.command(
    epilog=_examples(
        "lobefem new --list", "lobefem new stack4 > mine.toml", "lobefem new superpressure --out mine"
    )
)(reference.new)
app.command(epilog=_examples("lobefem schema", "lobefem schema > design.schema.json"))(reference.schema)


@app.command(
    epilog=_examples(
        "lobefem check meshes/stack4.toml",
        "lobefem check meshes/stack4.toml --film tension-field --bar none --divisions 48x64",
    )
)
@options.sharing(options.DESIGN, {})
def check(context: typer.Context, design: options.DesignFile) -> None:
    """Print a design in full: each key, whether it is a default, and what it does to the answer."""
    from lobefem.app.check_command import check as examine

    rows, sentences = examine(overridden({**context.params, "design": design}, None))
    if context.obj.is_root:
        show_rows([("key", "value", "from", "note"), *rows])
        for sentence in sentences:
            print(sentence)


app.command(epilog=_examples("lobefem report run", "lobefem report out/demo"))(reference.report)
app.command(epilog=_examples("lobefem export run --to csv", "lobefem export out/demo --to vtu"))(
    reference.export
)
app.command(epilog=_examples("lobefem units", "lobefem units force"))(reference.units)
app.command(epilog=_examples("lobefem materials", "lobefem materials mylar-a"))(reference.materials)


@app.command(epilog=_examples("lobefem doctor", "mpirun -n 2 lobefem doctor"))
def doctor(context: typer.Context, quiet: options.Quiet = False, verbose: options.Verbose = False) -> int:
    """Check this installation part by part and advise on what does not work (exit code 1)."""
    from lobefem.app.doctor import examine
    from lobefem.app.tables import show_findings

    ranks = context.obj
    with reporting(ranks.is_root, ranks.stop, **loudness(context)) as progress:
        findings = examine(progress)
    if ranks.is_root:
        show_findings([f for f in findings if not (f.fine and loudness(context)["quiet"])])
    return 0 if all(finding.fine for finding in findings) else 1


def main(arguments: list[str] | None = None) -> int:
    """Run the command.

    Args:
        arguments: default: those of the process.

    Returns:
        the exit code, on all ranks.
    """
    given = arguments
    for name in ("stdout", "stderr"):  # closed ones, of a service for example, are None
        setattr(sys, name, getattr(sys, name) or open(os.devnull, "w"))  # noqa: SIM115  to the end
    settle()
    if given is None:
        given = sys.argv[1:]
    ranks = Ranks()
    if arguments is None:
        ranks.stop.install()
    usage_error: Any = typer.BadParameter.__mro__[1]  # click's, which newer typer keeps to itself
    try:
        with nullcontext() if ranks.is_root else redirect_stdout(io.StringIO()):  # help, say, once for all
            code = app(given or ["--help"], prog_name="lobefem", standalone_mode=False, obj=ranks)
    except LobefemError as error:
        return ranks.end(error.exit_code, f"lobefem: {one_line(error)}")
    except (Interrupted, KeyboardInterrupt) as error:
        return ranks.end(130, f"lobefem: interrupted{error}", patience=1.0)
    except BrokenPipeError:  # the reader of stdout, `head` say, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        return ranks.end(141)
    except usage_error as error:
        return ranks.end(2, f"lobefem: {_usage(error)}")
    except OSError as error:
        where = f" ({error.filename})" if error.filename else ""
        return ranks.end(2, f"lobefem: the system refuses: {one_line(f'{error.strerror or error}{where}')}")
    except MemoryError:
        return ranks.end(3, "lobefem: out of memory; try a coarser mesh, or more ranks on more machines")
    except Exception as error:
        if os.environ.get("LOBEFEM_DEBUG"):
            traceback.print_exc()
        what = one_line(f"{type(error).__name__}: {error}")
        return ranks.end(1, f"lobefem: internal error: {what} (set LOBEFEM_DEBUG=1 for the traceback)")
    return ranks.end(code if isinstance(code, int) else 0)


def _usage(error: Any) -> str:
    """Click's words for a wrong command line as one sentence."""
    text = one_line(error.format_message()).rstrip(".")
    command = error.ctx.command_path if error.ctx is not None else "lobefem"
    return f"{text}; see {command} --help"
