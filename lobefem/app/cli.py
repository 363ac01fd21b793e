"""The `lobefem` command: its commands with their examples, errors and exit codes.

Nothing heavy is imported before a command runs, so that --help answers at once. All ranks parse the
same arguments; rank 0 alone prints. Exit codes: 0 done, 1 a fault of lobefem, 2 bad input, 3 a solve
that failed, 130 interrupted.
"""

from __future__ import annotations

import io
import os
import sys
import traceback
from collections.abc import Callable
from contextlib import nullcontext, redirect_stdout
from typing import Annotated, Any

import typer

from lobefem.app import output_options, reference, stability_commands, study_commands
from lobefem.app.process import Ranks
from lobefem.app.runner import Interrupted, one_line
from lobefem.errors import LobefemError
from lobefem.terminal import settle
from lobefem.version import __version__

__all__ = ["app", "main"]

app = typer.Typer(
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Tell whether a lobed balloon is stable: inflated shape, buckling modes, critical pressure.",
    epilog="Start with: [bold]lobefem new stack4 > mine.toml[/bold], then [bold]lobefem critical mine.toml "
    "--film tension-field --state inflated --load closed[/bold]",
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
        typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version."),
    ] = False,
    quiet: output_options.Quiet = False,
    verbose: output_options.Verbose = False,
) -> None:
    pass


# all commands in the order of the help, each with its examples
_COMMANDS: dict[Callable[..., Any], tuple[str, ...]] = {
    stability_commands.inflate: (
        "lobefem inflate meshes/stack4.toml --film tension-field --pressure 5 --out run",
        "mpirun -n 2 lobefem inflate meshes/single.toml --divisions 96x128 --json -",
    ),
    stability_commands.modes: (
        "lobefem modes meshes/single.toml --pressure 1000 --pressure 2000 --count 4",
        "lobefem modes meshes/stack4.toml --load closed --mass nodal --out run",
        "lobefem modes meshes/pumpkin.toml --pressure 50 --pressure 100 --harmonics 0:32",
    ),
    stability_commands.critical: (
        "lobefem critical meshes/stack4.toml --film tension-field --state inflated --load closed",
        "lobefem critical meshes/stack4.toml --film tension-field --state inflated --mesh-study",
        "lobefem critical meshes/stack4.toml --film tension-field --state inflated --what-if",
        "lobefem critical meshes/single.toml --mesh-study --out run",
        "lobefem critical meshes/single.toml --divisions 32x48 --harmonic 3 --json -",
        "lobefem critical meshes/pumpkin.toml --up-to '2 kPa' --out run",
    ),
    stability_commands.harmonics: (
        "lobefem harmonics meshes/single.toml --divisions 96x256 --out run",
        "lobefem harmonics meshes/stack4.toml --film isotropic --harmonics 0:8",
        "lobefem harmonics meshes/pumpkin.toml --up-to '2 kPa' --out run",
    ),
    stability_commands.sensitivities: (
        "lobefem sensitivities meshes/pumpkin.toml --harmonic 4",
        "lobefem sensitivities meshes/pumpkin.toml --harmonic 4 --pressure '200 Pa' --out run --report",
    ),
    stability_commands.perturb: (
        "lobefem perturb meshes/stack4.toml --film tension-field --pressure 5 --bend 7.5 --release --out run",
        "lobefem perturb meshes/pumpkin.toml --order 1 --divisions 16x4 --harmonic-seed 4:0.05 --release",
    ),
    reference.plot: (
        "lobefem plot run --what modes",
        "lobefem plot run --what stress --width 170 --to stress.svg",
        "lobefem plot run --what release --format gif",
    ),
    study_commands.sweep: (
        "lobefem sweep demos/lobes.toml --out run",
        "lobefem sweep demos/lobes.toml --out run --resume --workers 4",
        "mpirun -n 17 lobefem sweep demos/lobes.toml --out run",
    ),
    study_commands.optimise: (
        "lobefem optimise demos/search.toml --out run",
        "lobefem optimise demos/search.toml --out run --resume --random 100",
    ),
    reference.gores: (
        "lobefem gores meshes/pumpkin.toml --out run/gores",
        "lobefem gores meshes/superpressure.toml --out run/gores --marks 101",
    ),
    reference.new: (
        "lobefem new --list",
        "lobefem new stack4 > mine.toml",
        "lobefem new superpressure --out mine",
    ),
    reference.schema: (
        "lobefem schema",
        "lobefem schema > design.schema.json",
    ),
    reference.check: (
        "lobefem check meshes/stack4.toml",
        "lobefem check meshes/stack4.toml --film tension-field --bar none --divisions 48x64",
    ),
    reference.report: (
        "lobefem report run",
        "lobefem report out/demo",
    ),
    reference.export: (
        "lobefem export run --to csv",
        "lobefem export out/demo --to vtu",
    ),
    reference.units: (
        "lobefem units",
        "lobefem units force",
    ),
    reference.materials: (
        "lobefem materials",
        "lobefem materials mylar-a",
    ),
    reference.doctor: (
        "lobefem doctor",
        "mpirun -n 2 lobefem doctor",
    ),
}

for _command, _lines in _COMMANDS.items():
    app.command(epilog=_examples(*_lines))(_command)


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
