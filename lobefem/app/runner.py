"""One command, from the design file to its results: table, JSON, run folder and report."""

from __future__ import annotations

import gc
import sys
from collections.abc import Callable
from contextlib import nullcontext
from typing import TYPE_CHECKING, Any

from lobefem import profiling
from lobefem.app import design_options, output_options, parsing
from lobefem.app.process import stdout_to_stderr
from lobefem.app.progress_bar import reporting
from lobefem.app.tables import printable, show, show_profile
from lobefem.errors import InputError

if TYPE_CHECKING:
    import typer

    from lobefem.app.states_command import Outcome
    from lobefem.io.design import Design
    from lobefem.typing import Comm

__all__ = ["Interrupted", "loudness", "one_line", "overridden", "run_task"]

_MOST = 600  # letters of a sentence

_OF_SEALED_GAS = ("inflate", "perturb")


class Interrupted(Exception):  # noqa: N818  no error
    """KeyboardInterrupt, which versions of typer each turn into something else."""


def overridden(given: dict[str, Any], comm: Comm) -> Design:
    """The design file with the options put over it."""
    from lobefem.io.design import Design

    design = Design.load(given["design"], comm)
    changes = {
        design_options.KEYS[name]: value for name, value in given.items() if name in design_options.KEYS
    }
    changes["pressure.value"] = changes.get("pressure.value") or None  # [] where it is not given
    hoops, names = given.get("hoops"), design_options.NAMES | {"hoops.EA": "--hoops"}
    if hoops is not None:
        changes |= {"hoops.enabled": hoops != "none", "hoops.EA": None if hoops == "none" else hoops}
    settings = parsing.settings("--set", given.get("settings") or ())
    for key in settings:
        if changes.get(key) is not None:
            raise InputError(f"--set {key} and {names.get(key, '--hoops')} give the same key; leave out one")
        names.pop(key, None)
    return design.with_overrides(changes | settings, names)


def loudness(context: typer.Context) -> dict[str, bool]:
    """True if to be quiet or verbose, said before the command or after it."""
    before = context.parent.params if context.parent is not None else {}
    said = {name: bool(before.get(name) or context.params.get(name)) for name in ("quiet", "verbose")}
    if all(said.values()):
        raise InputError("--quiet and --verbose contradict each other; give one of them")
    return said


def _study(context: typer.Context) -> dict[str, Any]:
    """The command and its own options, which with the design identify a study."""
    no_part = {"design", "petsc", *design_options.KEYS, *design_options.DESIGN, *output_options.OUTPUT}
    own = {name: value for name, value in context.params.items() if name not in no_part and value is not None}
    return {"command": context.info_name} | own


def _reached(folder: Any) -> str:
    """The folder of an interrupted run, as the words after "interrupted"."""
    if folder is None:
        return "; with --out DIR a run keeps its steps, and --resume goes on from them"
    if not folder.has_steps:
        return f"; there was no step yet to keep in {folder.path}"
    return f"; the last accepted step is in {folder.path}, the same command with --resume goes on from it"


def _folder(given: dict[str, Any], comm: Comm) -> Any:
    """The run folder that --out asks for, None without."""
    from lobefem.io.run_folder import RunFolder

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


def run_task(context: typer.Context, task: Callable[..., Outcome]) -> None:
    """One command from the design file to its results; raises what ends it early.

    Args:
        context: of the command line.
        task: (design, progress=, folder=) -> what it found.
    """
    given, ranks = context.params, context.obj
    to_stdout = given["json"] == "-"
    said = loudness(context)
    profile = profiling.start() if given["profile"] else None
    with stdout_to_stderr(to_stdout), reporting(ranks.is_root, ranks.stop, **said) as progress:
        with profiling.stage("import"):
            from lobefem import files
            from lobefem.io.provenance import provenance
            from lobefem.linalg import dolfinx_compat, petsc

            # isort: split
            from mpi4py import MPI
        if not gc.isenabled():  # see `lobefem.__main__`
            gc.freeze()
            gc.enable()
            ranks.stop.install()

        ranks.stop.abandon = dolfinx_compat.abandon
        comm = MPI.COMM_WORLD
        design = overridden(given, comm)
        if design.pressure.gas != "given" and context.info_name not in _OF_SEALED_GAS:
            raise InputError(
                f"lobefem {context.info_name} takes a given pressure, and pressure.gas is 'isothermal'; "
                "leave it out: but for harmonic 0 a sealed gas changes no critical pressure"
            )
        folder = _folder(given, comm)
        if given["json"] and not to_stdout:
            files.check_file(given["json"], comm)
        versions = provenance(comm)
        ranks.stop.note = lambda: _reached(folder)
        with folder or nullcontext(), petsc.user_options(given.get("petsc") or "") as unused:
            if folder is not None:
                folder.begin(design.to_toml(), _study(context), versions)
            try:
                outcome = task(design, progress=progress, folder=folder)
            except KeyboardInterrupt:
                raise Interrupted(_reached(folder)) from None
            _warn(outcome.results["warnings"], unused(), versions, folder)
            outcome.results["versions"] = versions
            if profile is not None:
                outcome.results["profile"] = profile.as_dict()
            unsaved = None
            if folder is not None:
                try:
                    with profiling.stage("output"):
                        snapshots = [*outcome.snapshots, *(make() for make in outcome.later)]
                        made = outcome.design or design
                        folder.save(made.to_toml(), outcome.results, snapshots, outcome.figures)
                        if given["report"]:
                            from lobefem.viz.report import write_report

                            files.on_root(comm, folder.path, lambda: write_report(folder.path))
                except InputError as error:  # a full disk, say; what was found is shown nevertheless
                    unsaved = error
        if given["json"] and not to_stdout:
            files.save_json(given["json"], outcome.results, comm)
    if ranks.is_root:
        for warning in outcome.results["warnings"]:
            print(f"lobefem: warning: {warning}", file=sys.stderr)
        if to_stdout:
            sys.stdout.write(files.to_json(outcome.results))
        elif outcome.error is None and not said["quiet"]:
            show(outcome.results)
            if folder is not None and unsaved is None:
                print(f"Results and fields for ParaView are in {printable(folder.path)}")
                if given["report"]:
                    print(f"The report is {printable(folder.path / 'report.html')}")
        sys.stdout.flush()
        if profile is not None and not said["quiet"]:
            show_profile(profile.as_dict())
    if unsaved is not None:
        raise unsaved
    if outcome.error is not None:
        kept = (
            f"; the last converged state is in {folder.path}"
            if folder and (outcome.snapshots or outcome.later)
            else ""
        )
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


def one_line(words: object) -> str:
    """Words on one line, safe to print; of endless ones their beginning and end."""
    line = printable(" ".join(str(words).split()))
    return line if len(line) <= _MOST else f"{line[: _MOST - 200]} ... {line[-150:]}"
