"""Commands on one balloon: its inflated shape, modes, critical pressures, sensitivities and distortions.

Nothing heavy is imported before a command runs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import typer

from lobefem.app import design_options, options, output_options, parsing, run_options
from lobefem.app.runner import run_task
from lobefem.errors import InputError

if TYPE_CHECKING:
    from lobefem.app.states_command import Outcome
    from lobefem.io.design import Design

__all__ = ["critical", "harmonics", "inflate", "modes", "perturb", "sensitivities"]


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


@options.sharing(design_options.DESIGN, output_options.OUTPUT)
def inflate(
    context: typer.Context,
    design: design_options.DesignFile,
    lift: design_options.Lift = None,
    prestress: design_options.Prestress = None,
    setup: design_options.Setup = None,
    pressure: run_options.OnePressure = None,
    full: run_options.Full = False,
    petsc: run_options.Petsc = None,
) -> None:
    """Find the equilibrium under gas pressure: volume, stress, forces, wrinkles."""
    run_task(context, lambda plan, **run: _tasks().inflate(plan, full=full, **run))


@options.sharing(design_options.DESIGN, output_options.OUTPUT)
def modes(
    context: typer.Context,
    design: design_options.DesignFile,
    lift: design_options.Lift = None,
    prestress: design_options.Prestress = None,
    setup: design_options.Setup = None,
    pressure: run_options.Pressures = None,
    state: run_options.State = None,
    count: run_options.Count = "8",
    mass: run_options.Mass = "unit",
    harmonics: run_options.Harmonics = None,
    mesh_study: run_options.MeshStudy = False,
    meshes: run_options.Meshes = None,
    tolerance: run_options.Tolerance = None,
    petsc: run_options.Petsc = None,
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


@options.sharing(design_options.DESIGN, output_options.OUTPUT)
def critical(
    context: typer.Context,
    design: design_options.DesignFile,
    lift: design_options.Lift = None,
    state: run_options.State = None,
    harmonic: run_options.Harmonic = None,
    limit: run_options.Limit = None,
    pressure: run_options.SearchPressure = None,
    mesh_study: run_options.MeshStudy = False,
    meshes: run_options.Meshes = None,
    tolerance: run_options.Tolerance = None,
    what_if: run_options.WhatIf = False,
    petsc: run_options.Petsc = None,
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


@options.sharing(design_options.DESIGN, output_options.OUTPUT)
def harmonics(
    context: typer.Context,
    design: design_options.DesignFile,
    lift: design_options.Lift = None,
    harmonics: run_options.Harmonics = None,
    limit: run_options.Limit = None,
    pressure: run_options.SearchPressure = None,
) -> None:
    """Find the critical pressure for each number of waves around the axis."""
    parsing.no_pressure("harmonics", pressure)
    chosen = parsing.integers("--harmonics", harmonics)
    highest = None if limit is None else parsing.pressure("--limit", limit)
    run_task(
        context,
        lambda plan, **run: _of(plan, _studies).harmonics(plan, harmonics=chosen, limit=highest, **run),
    )


@options.sharing(design_options.DESIGN, output_options.OUTPUT)
def sensitivities(
    context: typer.Context,
    design: design_options.DesignFile,
    harmonic: run_options.Harmonic = None,
    pressure: run_options.OnePressure = None,
    limit: run_options.SensitivityLimit = None,
    petsc: run_options.Petsc = None,
) -> None:
    """Find what makes a pumpkin more stable: the effect of each parameter on stability, stress and volume."""
    number = None if harmonic is None else parsing.integer("--harmonic", harmonic, 0)
    highest = None if limit is None else parsing.pressure("--limit", limit)

    def study(plan: Design, **run: Any) -> Outcome:
        from lobefem.app.sensitivities_command import sensitivities as look

        return look(plan, harmonic=number, limit=highest, **run)

    run_task(context, study)


@options.sharing(design_options.DESIGN, output_options.OUTPUT)
def perturb(
    context: typer.Context,
    design: design_options.DesignFile,
    tip_displacement: run_options.TipDisplacement = None,
    bend: run_options.Bend = None,
    twist: run_options.Twist = None,
    wave: run_options.Wave = None,
    harmonic_seed: run_options.HarmonicSeed = None,
    cleft: run_options.Cleft = False,
    setup: design_options.Setup = None,
    pressure: run_options.OnePressure = None,
    release: run_options.Release = False,
    contact: run_options.Contact = True,
    steps: run_options.Steps = "20",
    damping: run_options.Damping = "1",
    petsc: run_options.Petsc = None,
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
