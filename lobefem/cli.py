"""The `lobefem` command: options over a design file, results as a table, as JSON and in a folder.

Nothing heavy is imported before a command runs, so that --help answers at once. All ranks parse the
same arguments; rank 0 alone speaks. Exit codes: 0 done, 1 a fault of ours, 2 bad input, 3 a solve
that failed, 130 interrupted.
"""

from __future__ import annotations

import gc
import os
import sys
import traceback
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lobefem import __version__, options, profiling, texts
from lobefem.console import Ranks, show, show_profile, show_rows, stdout_to_stderr
from lobefem.errors import InputError, LobefemError
from lobefem.reporting import reporting

if TYPE_CHECKING:
    from lobefem.design import Design
    from lobefem.tasks import Outcome

__all__ = ["app", "main"]

app = typer.Typer(
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Is a lobed thin-film balloon stable? Its equilibrium, buckling modes, critical pressure.",
    epilog="Start with: [bold]lobefem modes meshes/single.toml --pressure 1000[/bold]",
)


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
        typer.Option("--version", callback=_print_version, is_eager=True, help="Show the version."),
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
    petsc: options.Petsc = None,
) -> None:
    """The equilibrium under gas pressure: volume, stress, forces, wrinkles."""
    _run(context, lambda plan, **run: _tasks().inflate(plan, **run))


@app.command(
    epilog=_examples(
        "lobefem modes meshes/single.toml --pressure 1000 --pressure 2000 --count 4",
        "lobefem modes meshes/stack4.toml --load closed --mass nodal --out run",
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
    state: options.State = "ideal",
    count: options.Count = "8",
    mass: options.Mass = "unit",
    harmonics: options.Harmonics = None,
    petsc: options.Petsc = None,
) -> None:
    """The lowest buckling modes at each pressure; a negative real part means unstable."""
    number = texts.integer("--count", count, 1)
    texts.one_of("--state", state, ("ideal", "inflated"))
    texts.one_of("--mass", mass, ("unit", "nodal"))
    chosen = texts.integers("--harmonics", harmonics)
    _run(
        context,
        lambda plan, **run: _tasks().modes(
            plan, state=state, count=number, mass=mass, harmonics=chosen, **run
        ),
    )


@app.command(
    epilog=_examples(
        "lobefem critical meshes/stack4.toml --state inflated",
        "lobefem critical meshes/single.toml --mesh-study --out run",
        "lobefem critical meshes/single.toml --divisions 32x48 --harmonic 3 --json -",
    )
)
@options.sharing(options.DESIGN, options.OUTPUT)
def critical(
    context: typer.Context,
    design: options.DesignFile,
    lift: options.Lift = None,
    state: options.State = "ideal",
    harmonic: options.Harmonic = None,
    limit: options.Limit = None,
    mesh_study: options.MeshStudy = False,
    meshes: options.Meshes = None,
    petsc: options.Petsc = None,
) -> None:
    """The lowest pressure at which the balloon turns unstable; whether that depends on the mesh."""
    number = None if harmonic is None else texts.integer("--harmonic", harmonic, 0)
    texts.one_of("--state", state, ("ideal", "inflated"))
    highest = None if limit is None else texts.pressure("--limit", limit)
    pairs = texts.divisions("--meshes", meshes)
    if mesh_study:
        given = context.params["divisions"]
        if number is not None or state != "ideal" or highest is not None or given is not None:
            raise InputError(
                "--mesh-study looks at all harmonics of the ideal state on meshes of its own; leave out "
                "--harmonic, --state, --limit and --divisions"
            )
        _run(context, lambda plan, **run: _studies().mesh_study(plan, divisions=pairs, **run))
        return
    if pairs is not None:
        raise InputError("--meshes are those of a mesh study; add --mesh-study")
    _run(
        context,
        lambda plan, **run: _studies().critical(plan, state=state, harmonic=number, limit=highest, **run),
    )


@app.command(
    epilog=_examples(
        "lobefem harmonics meshes/single.toml --divisions 96x256 --out run",
        "lobefem harmonics meshes/stack4.toml --film isotropic --harmonics 0:8",
    )
)
@options.sharing(options.DESIGN, options.OUTPUT)
def harmonics(
    context: typer.Context,
    design: options.DesignFile,
    lift: options.Lift = None,
    harmonics: options.Harmonics = None,
) -> None:
    """The critical pressure of each circumferential harmonic, from one sector of the mesh."""
    chosen = texts.integers("--harmonics", harmonics)
    _run(context, lambda plan, **run: _studies().harmonics(plan, harmonics=chosen, **run))


@app.command(
    epilog=_examples(
        "lobefem perturb meshes/stack4.toml --film tension-field --pressure 5 --bend 7.5 --release --out run",
        "lobefem perturb meshes/stack5.toml --film tension-field --tip-displacement 0.7 --json -",
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
    setup: options.Setup = None,
    pressure: options.OnePressure = None,
    release: options.Release = False,
    contact: options.Contact = True,
    steps: options.Steps = "20",
    damping: options.Damping = "1",
    petsc: options.Petsc = None,
) -> None:
    """A large distortion, imposed by a ramp and released: does the balloon return?"""
    given = {"--tip-displacement": tip_displacement, "--bend": bend, "--twist": twist, "--wave": wave}
    chosen = [(name, text) for name, text in given.items() if text is not None]
    if len(chosen) != 1:
        raise InputError(f"perturb takes one distortion, not {len(chosen)}; give one of {', '.join(given)}")
    count, factor = texts.integer("--steps", steps, 1), texts.positive("--damping", damping)

    def study(plan: Design, **run: Any) -> Outcome:
        imposed = texts.distortion(*chosen[0])
        return _studies().perturb(
            plan, imposed, let_go=release, contact=contact, steps=count, damping=factor, **run
        )

    _run(context, study)


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
    """A picture of what a run folder holds, for paper or screen; modes and releases move as GIF or MP4."""
    at = None if pressure is None else texts.pressure("--pressure", pressure)
    numbers, wide = texts.integers("--mode", mode), texts.positive("--width", width)
    if context.obj.is_root:
        from lobefem.pictures import save_picture

        path = save_picture(folder, what, to, format, pressure=at, modes=numbers, width=wide)
        print(f"The picture is {path}")


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
    """One command over many designs, pressures, films: a table and a chart, each point kept."""
    from lobefem import parameter_runs as runs
    from lobefem._files import on_root
    from lobefem.parameter_study import load

    if resume and overwrite:
        raise InputError("--resume goes on with a sweep and --overwrite replaces it; give one of them")
    number = len(os.sched_getaffinity(0)) if workers is None else texts.integer("--workers", workers, 1)
    commands = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    known = {name: {p.opts[0].lstrip("-") for p in one.params} for name, one in commands.items()}
    ranks = context.obj

    def prepare() -> Any:
        study = load(file, known)
        runs.begin(study, out, resume=resume, overwrite=overwrite)
        return study

    volume = _volume(context)
    study = prepare() if ranks.comm is None else on_root(ranks.comm, file, prepare)
    ranks.stop.note = lambda: f"; finished points are in {out}, go on with --resume"
    with (
        runs.workers(number, ranks.comm) as executor,
        reporting(ranks.is_root, ranks.stop, **volume) as progress,
    ):
        if executor is None:
            return 0
        rows = runs.run(study, out, executor, progress=progress)
    code = _swept(study, rows, out, json, volume["quiet"])
    if report:
        from lobefem.report import write_report

        write_report(out)
    return code


def _swept(study: Any, rows: Any, out: Any, json: str | None, quiet: bool) -> int:
    """The end of a sweep, on rank 0: files, table, exit code."""
    from lobefem import parameter_runs as runs
    from lobefem._files import replace, replacing, to_json
    from lobefem.parameter_chart import parameter_chart

    found = runs.results(study, rows)
    text = to_json(found)
    with replacing(out / "sweep.png") as stream:
        parameter_chart(study, rows).savefig(stream, format="png")
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
            print(f"Table, chart and the points' own folders are in {out}")
    sys.stdout.flush()
    return 3 if found["failed"] == len(rows) else 0


@app.command(epilog=_examples("lobefem report run", "lobefem report out/demo"))
def report(
    context: typer.Context,
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A run folder, or a folder of them.")],
) -> None:
    """One page of all that a run folder holds: DIR/report.html, which needs no network."""
    if context.obj.is_root:
        from lobefem.report import write_report

        print(f"The report is {_printable(write_report(folder))}")


@app.command(epilog=_examples("lobefem doctor", "mpirun -n 2 lobefem doctor"))
def doctor(context: typer.Context, quiet: options.Quiet = False, verbose: options.Verbose = False) -> int:
    """Does this installation work, part by part; what to do about what does not. Exit code 1 if so."""
    from lobefem.console import show_findings
    from lobefem.doctor import examine

    ranks = context.obj
    with reporting(ranks.is_root, ranks.stop, **_volume(context)) as progress:
        findings = examine(progress)
    if ranks.is_root:
        show_findings([f for f in findings if not (f.fine and _volume(context)["quiet"])])
    return 0 if all(finding.fine for finding in findings) else 1


# --- running ------------------------------------------------------------------------------------


class _Interrupted(Exception):  # noqa: N818  no error
    """KeyboardInterrupt, which versions of typer each turn into something else."""


def _tasks() -> Any:
    import lobefem.tasks

    return lobefem.tasks


def _studies() -> Any:
    import lobefem.studies

    return lobefem.studies


def _overridden(given: dict[str, Any], comm: Any) -> Design:
    """The design file with the options put over it."""
    from lobefem.design import Design

    design = Design.load(given["design"], comm)
    changes = {options.KEYS[name]: value for name, value in given.items() if name in options.KEYS}
    changes["pressure.value"] = changes.get("pressure.value") or None  # [] where it is not given
    return design.with_overrides(changes, options.NAMES)


def _volume(context: typer.Context) -> dict[str, bool]:
    """Whether to be quiet or verbose, said before the command or after it."""
    before = context.parent.params if context.parent is not None else {}
    volume = {name: bool(before.get(name) or context.params.get(name)) for name in ("quiet", "verbose")}
    if all(volume.values()):
        raise InputError("--quiet and --verbose contradict each other; give one of them")
    return volume


def _study(context: typer.Context) -> dict[str, Any]:
    """What is looked for, beside the design: the command and its own options."""
    no_part = {"design", "petsc", *options.KEYS, *options.OUTPUT}
    own = {name: value for name, value in context.params.items() if name not in no_part and value is not None}
    return {"command": context.info_name} | own


def _reached(folder: Any) -> str:
    """Where a run that was stopped is kept, after "interrupted"."""
    if folder is None:
        return "; with --out DIR a run keeps its steps, and --resume goes on from them"
    if not folder.has_steps:
        return f"; there was no step yet to keep in {folder.path}"
    return f"; the last accepted step is in {folder.path}, the same command with --resume goes on from it"


def _folder(given: dict[str, Any], comm: Any) -> Any:
    """The run folder that --out asks for, None without."""
    from lobefem.storage import RunFolder

    resume = given.get("resume", False)
    if resume and given["out"] is None:
        raise InputError("--resume goes on with the run in --out; give that folder")
    if resume and given["overwrite"]:
        raise InputError("--resume goes on with a run and --overwrite replaces it; give one of them")
    if given["report"] and given["out"] is None:
        raise InputError("--report is written into the folder of --out; give one")
    if given["out"] is None:
        return None
    return RunFolder(given["out"], comm, overwrite=given["overwrite"], resume=resume)


def _run(context: typer.Context, task: Callable[..., Outcome]) -> None:
    """One command from the design file to its results; raises what ends it early.

    Args:
        context: of the command line.
        task: (design, progress=, folder=) -> what it found.
    """
    given, ranks = context.params, context.obj
    to_stdout = given["json"] == "-"
    volume = _volume(context)
    profile = profiling.start() if given["profile"] else None
    with stdout_to_stderr(to_stdout), reporting(ranks.is_root, ranks.stop, **volume) as progress:
        with profiling.stage("import"):
            from lobefem import _files, _petsc, storage, tasks  # noqa: F401
            from lobefem.provenance import provenance

            # isort: split
            from mpi4py import MPI
        if not gc.isenabled():  # see main
            gc.freeze()
            gc.enable()
            ranks.stop.install()

        comm = MPI.COMM_WORLD
        design = _overridden(given, comm)
        folder = _folder(given, comm)
        if given["json"] and not to_stdout:
            _files.check_file(given["json"], comm)
        versions = provenance(comm)
        ranks.stop.note = lambda: _reached(folder)
        with folder or nullcontext(), _petsc.user_options(given.get("petsc") or "") as unused:
            if folder is not None:
                folder.begin(design.to_toml(), _study(context), versions)
            try:
                outcome = task(design, progress=progress, folder=folder)
            except KeyboardInterrupt:
                raise _Interrupted(_reached(folder)) from None
            _warn(outcome.results["warnings"], unused(), versions, folder)
            outcome.results["versions"] = versions
            if profile is not None:
                outcome.results["profile"] = profile.as_dict()
            unsaved = None
            if folder is not None:
                try:
                    with profiling.stage("output"):
                        folder.save(design.to_toml(), outcome.results, outcome.snapshots, outcome.figures)
                        if given["report"]:
                            from lobefem.report import write_report

                            _files.on_root(comm, folder.path, lambda: write_report(folder.path))
                except InputError as error:  # a full disk, say; what was found is shown nevertheless
                    unsaved = error
        if given["json"] and not to_stdout:
            _files.save_json(given["json"], outcome.results, comm)
    if ranks.is_root:
        for warning in outcome.results["warnings"]:
            print(f"lobefem: warning: {warning}", file=sys.stderr)
        if to_stdout:
            sys.stdout.write(_files.to_json(outcome.results))
        elif outcome.error is None and not volume["quiet"]:
            show(outcome.results)
            if folder is not None and unsaved is None:
                print(f"Results and fields for ParaView are in {_printable(folder.path)}")
                if given["report"]:
                    print(f"The report is {_printable(folder.path / 'report.html')}")
        sys.stdout.flush()
        if profile is not None:
            show_profile(profile.as_dict())
    if unsaved is not None:
        raise unsaved
    if outcome.error is not None:
        kept = f"; the last converged state is in {folder.path}" if folder and outcome.snapshots else ""
        raise type(outcome.error)(f"{outcome.error}{kept}")


def _warn(warnings: list[str], unused: list[str], versions: dict[str, Any], folder: Any) -> None:
    """Add what a user must know of the run itself."""
    if unused:
        names = ", ".join(f"-{name}" for name in unused)
        warnings.append(f"no solver of this run has read the PETSc options {names}; check their spelling")
    first = versions if folder is None else folder.versions
    changed = [
        name for name in ("lobefem", "revision", "dolfinx", "petsc") if first.get(name) != versions[name]
    ]
    if changed:
        said = ", ".join(f"{name} {first.get(name)} then and {versions[name]} now" for name in changed)
        warnings.append(f"the steps before --resume were made with other versions: {said}")


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
    if given is None:
        given = sys.argv[1:]
        # what is imported lives to the end: looking for garbage in it takes a quarter of a second
        gc.disable()
    ranks = Ranks()
    if arguments is None:
        ranks.stop.install()
    usage_error: Any = typer.BadParameter.__mro__[1]  # click's, which newer typer keeps to itself
    try:
        code = app(given or ["--help"], prog_name="lobefem", standalone_mode=False, obj=ranks)
    except LobefemError as error:
        return ranks.end(error.exit_code, f"lobefem: {_one_line(error)}")
    except (_Interrupted, KeyboardInterrupt) as error:
        return ranks.end(130, f"lobefem: interrupted{error}", patience=1.0)
    except BrokenPipeError:  # the reader of stdout, `head` say, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        return ranks.end(141)
    except usage_error as error:
        return ranks.end(2, f"lobefem: {_usage(error)}")
    except OSError as error:
        where = f" ({error.filename})" if error.filename else ""
        return ranks.end(2, f"lobefem: the system refuses: {_one_line(f'{error.strerror or error}{where}')}")
    except MemoryError:
        return ranks.end(3, "lobefem: out of memory; try a coarser mesh, or more ranks on more machines")
    except Exception as error:
        if os.environ.get("LOBEFEM_DEBUG"):
            traceback.print_exc()
        what = _one_line(f"{type(error).__name__}: {error}")
        return ranks.end(1, f"lobefem: internal error: {what} (set LOBEFEM_DEBUG=1 for the traceback)")
    return ranks.end(code if isinstance(code, int) else 0)


def _usage(error: Any) -> str:
    """Click's words for a wrong command line as one sentence."""
    text = _one_line(error.format_message()).rstrip(".")
    command = error.ctx.command_path if error.ctx is not None else "lobefem"
    return f"{text}; see {command} --help"


def _one_line(words: object) -> str:
    """Words on one line, safe to print."""
    return _printable(" ".join(str(words).split()))


def _printable(words: object) -> str:
    """Words with what no terminal should get, in names of files for example, escaped."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in str(words))


if __name__ == "__main__":
    sys.exit(main())
