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
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lobefem import __version__, options, profiling, texts
from lobefem.console import Ranks, progress_line, show, show_profile, stdout_to_stderr
from lobefem.errors import InputError, LobefemError

if TYPE_CHECKING:
    from lobefem.design import Design
    from lobefem.tasks import Outcome

__all__ = ["app", "main"]

app = typer.Typer(
    add_completion=False,
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
) -> None:
    pass


@app.command(
    epilog=_examples(
        "lobefem inflate meshes/stack4.toml --film tension-field --pressure 5 --out run",
        "mpirun -n 2 lobefem inflate meshes/single.toml --divisions 96x128 --json -",
    )
)
def inflate(
    context: typer.Context,
    design: options.DesignFile,
    film: options.FilmLaw = None,
    load: options.Load = None,
    support: options.Support = None,
    lift: options.Lift = None,
    slack_stiffness: options.Slack = None,
    prestress: options.Prestress = None,
    divisions: options.Divisions = None,
    cell: options.Cell = None,
    order: options.Order = None,
    lobes: options.Lobes = None,
    edge_radius: options.EdgeRadius = None,
    pressure: options.OnePressure = None,
    petsc: options.Petsc = None,
    profile: options.Profile = False,
    out: options.Out = None,
    overwrite: options.Overwrite = False,
    json: options.Json = None,
) -> None:
    """The equilibrium under gas pressure: volume, stress, forces, wrinkles."""
    _run(context, lambda plan, progress: _tasks().inflate(plan, progress=progress))


@app.command(
    epilog=_examples(
        "lobefem modes meshes/single.toml --pressure 1000 --pressure 2000 --count 4",
        "lobefem modes meshes/stack4.toml --load closed --mass nodal --out run",
    )
)
def modes(
    context: typer.Context,
    design: options.DesignFile,
    film: options.FilmLaw = None,
    load: options.Load = None,
    support: options.Support = None,
    lift: options.Lift = None,
    slack_stiffness: options.Slack = None,
    prestress: options.Prestress = None,
    divisions: options.Divisions = None,
    cell: options.Cell = None,
    order: options.Order = None,
    lobes: options.Lobes = None,
    edge_radius: options.EdgeRadius = None,
    pressure: options.Pressures = None,
    state: options.State = "ideal",
    count: options.Count = "8",
    mass: options.Mass = "unit",
    harmonics: options.Harmonics = None,
    petsc: options.Petsc = None,
    profile: options.Profile = False,
    out: options.Out = None,
    overwrite: options.Overwrite = False,
    json: options.Json = None,
) -> None:
    """The lowest buckling modes at each pressure; a negative real part means unstable."""
    number = texts.integer("--count", count, 1)
    texts.one_of("--state", state, ("ideal", "inflated"))
    texts.one_of("--mass", mass, ("unit", "nodal"))
    chosen = texts.integers("--harmonics", harmonics)
    _run(
        context,
        lambda plan, progress: _tasks().modes(
            plan, state=state, count=number, mass=mass, harmonics=chosen, progress=progress
        ),
    )


@app.command(
    epilog=_examples(
        "lobefem critical meshes/stack4.toml --state inflated",
        "lobefem critical meshes/single.toml --mesh-study --out run",
        "lobefem critical meshes/single.toml --divisions 32x48 --harmonic 3 --json -",
    )
)
def critical(
    context: typer.Context,
    design: options.DesignFile,
    film: options.FilmLaw = None,
    load: options.Load = None,
    support: options.Support = None,
    lift: options.Lift = None,
    slack_stiffness: options.Slack = None,
    divisions: options.Divisions = None,
    cell: options.Cell = None,
    order: options.Order = None,
    lobes: options.Lobes = None,
    edge_radius: options.EdgeRadius = None,
    state: options.State = "ideal",
    harmonic: options.Harmonic = None,
    limit: options.Limit = None,
    mesh_study: options.MeshStudy = False,
    meshes: options.Meshes = None,
    petsc: options.Petsc = None,
    profile: options.Profile = False,
    out: options.Out = None,
    overwrite: options.Overwrite = False,
    json: options.Json = None,
) -> None:
    """The lowest pressure at which the balloon turns unstable; whether that depends on the mesh."""
    number = None if harmonic is None else texts.integer("--harmonic", harmonic, 0)
    texts.one_of("--state", state, ("ideal", "inflated"))
    highest = None if limit is None else texts.pressure("--limit", limit)
    pairs = texts.divisions("--meshes", meshes)
    if mesh_study:
        if number is not None or state != "ideal" or highest is not None or divisions is not None:
            raise InputError(
                "--mesh-study looks at all harmonics of the ideal state on meshes of its own; leave out "
                "--harmonic, --state, --limit and --divisions"
            )
        _run(context, lambda plan, progress: _studies().mesh_study(plan, divisions=pairs, progress=progress))
        return
    if pairs is not None:
        raise InputError("--meshes are those of a mesh study; add --mesh-study")
    _run(
        context,
        lambda plan, progress: _studies().critical(
            plan, state=state, harmonic=number, limit=highest, progress=progress
        ),
    )


@app.command(
    epilog=_examples(
        "lobefem harmonics meshes/single.toml --divisions 96x256 --out run",
        "lobefem harmonics meshes/stack4.toml --film isotropic --harmonics 0:8",
    )
)
def harmonics(
    context: typer.Context,
    design: options.DesignFile,
    film: options.FilmLaw = None,
    load: options.Load = None,
    support: options.Support = None,
    lift: options.Lift = None,
    slack_stiffness: options.Slack = None,
    divisions: options.Divisions = None,
    cell: options.Cell = None,
    order: options.Order = None,
    lobes: options.Lobes = None,
    edge_radius: options.EdgeRadius = None,
    harmonics: options.Harmonics = None,
    profile: options.Profile = False,
    out: options.Out = None,
    overwrite: options.Overwrite = False,
    json: options.Json = None,
) -> None:
    """The critical pressure of each circumferential harmonic, from one sector of the mesh."""
    chosen = texts.integers("--harmonics", harmonics)
    _run(context, lambda plan, progress: _studies().harmonics(plan, harmonics=chosen, progress=progress))


@app.command(
    epilog=_examples(
        "lobefem perturb meshes/stack4.toml --film tension-field --pressure 5 --bend 7.5 --release --out run",
        "lobefem perturb meshes/stack5.toml --film tension-field --tip-displacement 0.7 --json -",
    )
)
def perturb(
    context: typer.Context,
    design: options.DesignFile,
    tip_displacement: options.TipDisplacement = None,
    bend: options.Bend = None,
    twist: options.Twist = None,
    wave: options.Wave = None,
    film: options.FilmLaw = None,
    load: options.Load = None,
    support: options.Support = None,
    slack_stiffness: options.Slack = None,
    divisions: options.Divisions = None,
    cell: options.Cell = None,
    order: options.Order = None,
    lobes: options.Lobes = None,
    edge_radius: options.EdgeRadius = None,
    pressure: options.OnePressure = None,
    release: options.Release = False,
    contact: options.Contact = True,
    steps: options.Steps = "20",
    damping: options.Damping = "1",
    petsc: options.Petsc = None,
    profile: options.Profile = False,
    out: options.Out = None,
    overwrite: options.Overwrite = False,
    resume: options.Resume = False,
    json: options.Json = None,
) -> None:
    """A large distortion, imposed by a ramp and released: does the balloon return?"""
    given = {"--tip-displacement": tip_displacement, "--bend": bend, "--twist": twist, "--wave": wave}
    chosen = [(name, text) for name, text in given.items() if text is not None]
    if len(chosen) != 1:
        raise InputError(f"perturb takes one distortion, not {len(chosen)}; give one of {', '.join(given)}")
    count, factor = texts.integer("--steps", steps, 1), texts.positive("--damping", damping)
    if resume and out is None:
        raise InputError("--resume goes on with the run in --out; give that folder")
    if resume and overwrite:
        raise InputError("--resume goes on with a run and --overwrite replaces it; give one of them")

    def study(plan: Design, progress: Any, folder: Any) -> Outcome:
        return _studies().perturb(
            plan, texts.distortion(*chosen[0]), let_go=release, contact=contact, steps=count,
            damping=factor, progress=progress, folder=folder,
        )  # fmt: skip

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


@app.command(epilog=_examples("lobefem doctor", "mpirun -n 2 lobefem doctor"))
def doctor(context: typer.Context) -> int:
    """Does this installation work, part by part; what to do about what does not. Exit code 1 if so."""
    from lobefem.console import show_findings
    from lobefem.doctor import examine

    ranks = context.obj
    with progress_line(ranks) as progress:
        findings = examine(progress)
    if ranks.is_root:
        show_findings(findings)
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


@contextmanager
def _petsc_options(text: str | None) -> Iterator[None]:
    """PETSc options in its database for the time of a run, on all ranks."""
    from lobefem._dolfinx import PETSc

    database = PETSc.Options()
    before = database.getAll()
    database.insertString(text or "")
    try:
        yield
    finally:
        for name in set(database.getAll()) - set(before):
            database.delValue(name)


def _run(context: typer.Context, task: Callable[..., Outcome]) -> None:
    """One command from the design file to its results; raises what ends it early.

    Args:
        context: of the command line.
        task: (design, progress) -> what it found; one whose steps are kept takes the run folder, too.
    """
    given, ranks = context.params, context.obj
    to_stdout = given["json"] == "-"
    profile = profiling.start() if given["profile"] else None
    with stdout_to_stderr(to_stdout), progress_line(ranks) as progress:
        with profiling.stage("import"):
            from lobefem import _files, storage, tasks  # noqa: F401
            from lobefem.provenance import provenance

            # isort: split
            from mpi4py import MPI
        if not gc.isenabled():  # see main
            gc.freeze()
            gc.enable()

        comm = MPI.COMM_WORLD
        design = _overridden(given, comm)
        folder = None
        if given["out"] is not None:
            folder = storage.RunFolder(
                given["out"], comm, overwrite=given["overwrite"], resume=given.get("resume", False)
            )
        if given["json"] and not to_stdout:
            _files.check_file(given["json"], comm)
        with folder or nullcontext():
            try:
                with _petsc_options(given.get("petsc")):
                    arguments = (design, progress, folder) if "resume" in given else (design, progress)
                    outcome = task(*arguments)
            except KeyboardInterrupt:
                on = f"; go on with --resume --out {folder.path}" if folder and "resume" in given else ""
                raise _Interrupted(on) from None
            outcome.results["versions"] = provenance(comm)
            if profile is not None:
                outcome.results["profile"] = profile.as_dict()
            if folder is not None:
                with profiling.stage("output"):
                    folder.save(design.to_toml(), outcome.results, outcome.snapshots, outcome.figures)
        if given["json"] and not to_stdout:
            _files.save_json(given["json"], outcome.results, comm)
    if ranks.is_root:
        for warning in outcome.results["warnings"]:
            print(f"lobefem: warning: {warning}", file=sys.stderr)
        if to_stdout:
            sys.stdout.write(_files.to_json(outcome.results))
        elif outcome.error is None:
            show(outcome.results)
            if folder is not None:
                print(f"Results and fields for ParaView are in {folder.path}")
        sys.stdout.flush()
        if profile is not None:
            show_profile(profile.as_dict())
    if outcome.error is not None:
        kept = f"; the last converged state is in {folder.path}" if folder and outcome.snapshots else ""
        raise type(outcome.error)(f"{outcome.error}{kept}")


def main(arguments: list[str] | None = None) -> int:
    """Run the command.

    Args:
        arguments: default: those of the process.

    Returns:
        the exit code, on all ranks.
    """
    given = arguments
    if given is None:
        given = sys.argv[1:]
        # what is imported lives to the end: looking for garbage in it takes a quarter of a second
        gc.disable()
    ranks = Ranks()
    usage_error: Any = typer.BadParameter.__mro__[1]  # click's, which newer typer keeps to itself
    try:
        code = app(given or ["--help"], prog_name="lobefem", standalone_mode=False, obj=ranks)
    except LobefemError as error:
        return ranks.end(error.exit_code, f"lobefem: {error}")
    except (_Interrupted, KeyboardInterrupt) as error:
        return ranks.end(130, f"lobefem: interrupted{error}", patience=1.0)
    except BrokenPipeError:  # the reader of stdout, `head` say, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        return ranks.end(141)
    except usage_error as error:
        return ranks.end(2, f"lobefem: {_usage(error)}")
    except Exception as error:
        if os.environ.get("LOBEFEM_DEBUG"):
            traceback.print_exc()
        what = " ".join(f"{type(error).__name__}: {error}".split())
        return ranks.end(1, f"lobefem: internal error: {what} (set LOBEFEM_DEBUG=1 for the traceback)")
    return ranks.end(code if isinstance(code, int) else 0)


def _usage(error: Any) -> str:
    """Click's words for a wrong command line as one sentence."""
    text = " ".join(error.format_message().split()).rstrip(".")
    command = error.ctx.command_path if error.ctx is not None else "lobefem"
    return f"{text}; see {command} --help"


if __name__ == "__main__":
    sys.exit(main())
