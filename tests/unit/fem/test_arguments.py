"""What a balloon is given: kept in all that is made of it, or refused in one sentence."""

import copy
import dataclasses
import importlib
import inspect
import pickle
import pkgutil

import numpy as np
import pytest

import lobefem
from lobefem.equilibrium.displacement_control import distort
from lobefem.equilibrium.distortions import Tip
from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.state import ideal_state
from lobefem.errors import InputError
from lobefem.fem.balloon import Balloon
from lobefem.frozen import Frozen
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.geometry.surface import Surface
from lobefem.io.checkpoints import load_state, save_state
from lobefem.model.cables import Hoops
from lobefem.model.end_plates import EndPlates
from lobefem.model.film import Isotropic
from lobefem.model.fixed_wrinkles import FixedWrinkles
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.imp import IMP, PrescribedPath
from lobefem.model.kinematics import revolved_frame
from lobefem.model.supports import Fixed
from lobefem.model.tension_field import TensionField
from lobefem.stability.cyclic import sector_balloon
from lobefem.stability.harmonic_buckling import harmonic_pressures
from lobefem.stability.linear_buckling import critical_pressure
from lobefem.stability.modes import find_modes
from lobefem.stability.one_sided import one_sided_pressures
from lobefem.stability.perturbation import perturb
from lobefem.stability.relaxation import release

from dolfinx import fem

# each argument that is bound to no mesh, with a value that is not its default
GIVEN = {
    "film": FixedWrinkles(E=1e9, nu=0.2, thickness=2e-5, slack_stiffness=1e-3),
    "components": (GasPressure("film"), Hoops(EA=2e5), EndPlates("pinned"), Fixed("rim_bottom", (2,))),
    "prestressed": True,
    "hoop_slack": 1e-3,
    "quadrature_degree": 3,
}


def kept_of(balloon):
    """The arguments of `GIVEN` that a balloon has."""
    assert balloon.dx.metadata()["quadrature_degree"] == balloon.specification.quadrature_degree
    return {name: getattr(balloon.specification, name) for name in GIVEN}


@pytest.fixture
def path(comm):
    """The state of a load path, and what leads to it."""
    surface = lobed_cylinder(2, (4, 6), comm=comm)
    parts = [GasPressure("closed"), EndPlates("fixed")]
    return inflate(Balloon(surface, PrescribedPath(slack_stiffness=1e-3), parts), 1.0)


def test_each_argument_survives_another_surface_and_one_sector(comm):
    balloon = Balloon(lobed_cylinder(2, (4, 6), comm=comm), **GIVEN)
    finer = lobed_cylinder(2, (6, 8), comm=comm)
    assert kept_of(balloon.remeshed(finer)) == GIVEN
    assert balloon.remeshed(finer).surface is finer
    sector = sector_balloon(balloon)
    assert kept_of(sector) == GIVEN
    assert sector.surface.copies == 6


def test_each_argument_survives_another_film(comm, path):
    """Those that are bound to the mesh as well, which another surface and one sector refuse."""
    surface, film = lobed_cylinder(2, (4, 6), comm=comm), IMP(E=2e9)
    balloon = Balloon(surface, **GIVEN, frame=revolved_frame(surface.mesh, surface.axis))
    other = balloon.with_changes(film=film)
    assert kept_of(other) == GIVEN | {"film": film}
    assert other.surface is surface
    assert other.specification.frame is balloon.specification.frame is not None
    loaded = Balloon(path.balloon.surface, TensionField(), path.balloon.components, load_path=path)
    assert loaded.with_changes(film=IMP()).load_path is path
    layers = fem.Function(fem.functionspace(surface.mesh, ("DG", 0)))
    layers.x.array[:] = 2.0
    pattern = fem.Function(fem.functionspace(surface.mesh, ("DG", 1, (2,))))
    pattern.interpolate(lambda x: np.array([x[2], 2.0 * np.arctan2(x[1], x[0])]))
    cut = Balloon(surface, **GIVEN, pattern=pattern, layers=layers)
    assert cut.with_changes(film=film).pattern is pattern
    assert cut.with_changes(film=film).layers is layers
    for bound in (balloon, loaded, cut):
        for use in (sector_balloon, lambda b: b.remeshed(lobed_cylinder(2, (6, 8), comm=comm))):
            with pytest.raises(InputError, match=r"frame|load_path"):
                use(bound)
    known = {*GIVEN, "surface", "frame", "load_path", "pattern", "layers", "extra_energy"}
    assert set(inspect.signature(Balloon).parameters) == known  # a new argument belongs into these tests


def test_a_film_is_prestressed_alike_with_another_law(comm):
    """The built-in stress itself, not the flag: the same membrane force along the meridian."""
    balloon = Balloon(lobed_cylinder(1, (4, 6), comm=comm), Isotropic(), EndPlates("fixed"), prestressed=True)
    one, other = (ideal_state(b, 100.0) for b in (balloon, balloon.with_changes(film=FixedWrinkles())))
    assert other.strain_energy == pytest.approx(one.strain_energy, rel=1e-12)


@pytest.mark.parametrize(
    ("parts", "text"),
    [
        (None, r"^parts are None; give a list of them, such as \[GasPressure\(\), EndPlates\(\)\]$"),
        ("film", "^parts are 'film'; give a list of them"),
        (EndPlates, "^parts are <class .*EndPlates'>; give a list of them"),
        ([EndPlates], r"^EndPlates is a class and no part of a balloon; make one of it, EndPlates\(\)$"),
    ],
)
def test_what_is_no_row_of_parts_is_refused(comm, parts, text):
    with pytest.raises(InputError, match=text):
        Balloon(lobed_cylinder(1, (2, 4), comm=comm), TensionField(), parts)


def test_one_part_needs_no_brackets(comm):
    surface = lobed_cylinder(1, (2, 4), comm=comm)
    balloon = Balloon(surface, TensionField(), GasPressure("film"))
    assert balloon.components == (GasPressure("film"),)
    assert balloon.load.convention == "film"
    assert Balloon(surface, TensionField(), iter([GasPressure("film"), EndPlates()])).plates == EndPlates()


def test_suction_is_refused_of_film_that_carries_tension_only(comm):
    surface = lobed_cylinder(1, (4, 6), comm=comm)
    for law in (TensionField(), IMP(), PrescribedPath()):
        with pytest.raises(
            InputError, match=rf"^pressure = -5.0 Pa is suction, which {type(law).__name__} film"
        ):
            inflate(Balloon(surface, law, EndPlates("fixed")), -5.0)
    with pytest.raises(InputError, match=r"^pressure = -5.0 Pa is suction, which TensionField film"):
        ideal_state(Balloon(surface, TensionField(), EndPlates("fixed"), prestressed=True), -5.0)
    # a law that can be pressed is, and gives way as much as it bulges, at a pressure as small as this
    shell = Balloon(surface, Isotropic(), [GasPressure("closed"), EndPlates("fixed")])
    change = [inflate(shell, p).volume - shell.reference_volume for p in (-0.1, 0.1)]
    assert change[0] == pytest.approx(-change[1], rel=1e-3)


def test_things_of_another_kind_are_refused_in_one_sentence(comm, shared_path):
    surface = lobed_cylinder(1, (4, 6), comm=comm)
    balloon = Balloon(surface, Isotropic(), [GasPressure("closed"), EndPlates()], prestressed=True)
    state = inflate(balloon, 5.0)
    needs_balloon, needs_state = (
        "balloon is of type Equilibrium; give a Balloon",
        "is of type Balloon; give a state, ",
    )
    for act, text in (
        (
            lambda: Balloon(lobed_cylinder, Isotropic()),
            "surface is of type function; give a Surface, such as lobed",
        ),
        (
            lambda: Balloon(surface.mesh, Isotropic()),
            "surface is of type Mesh; give a Surface, such as lobed_cyl",
        ),
        (lambda: inflate(Balloon, 5.0), "balloon is the class Balloon; give a Balloon"),
        (lambda: inflate(None, 5.0), "balloon is None; give a Balloon"),
        (lambda: inflate(state, 5.0), needs_balloon),
        (lambda: ideal_state(state, 5.0), needs_balloon),
        (lambda: critical_pressure(state), needs_balloon),
        (lambda: harmonic_pressures(state), needs_balloon),
        (lambda: one_sided_pressures(state), needs_balloon),
        (lambda: perturb(state, 5.0, Tip(0.1)), needs_balloon),
        (lambda: perturb(balloon, 5.0, Tip), "distortion is the class Tip; give one such as Tip"),
        (lambda: distort(state, 0.1), "distortion is 0.1; give one such as Tip"),
        (lambda: distort(balloon, Tip(0.1)), needs_state),
        (lambda: find_modes(balloon), needs_state),
        (lambda: inflate(balloon, 5.0, start=balloon), needs_state.replace("a state, ", "a state, such as")),
        (lambda: release(balloon), needs_state),
        (lambda: save_state(shared_path / "state.npz", balloon), needs_state),
    ):
        with pytest.raises(InputError, match=text):
            act()


# --- records ------------------------------------------------------------------------------------


def test_states_and_modes_are_not_pickled_but_kept(comm, shared_path):
    surface = lobed_cylinder(1, (4, 6), comm=comm)
    balloon = Balloon(surface, Isotropic(), [GasPressure("closed"), EndPlates()], prestressed=True)
    state = inflate(balloon, 5.0)
    modes = find_modes(state, 2)
    for record in (state, modes, balloon, surface):
        for act in (pickle.dumps, copy.deepcopy):
            with pytest.raises(
                InputError, match=r"cannot be pickled or deep-copied.*save_state, modes by save_modes"
            ):
                act(record)
    save_state(shared_path / "state.npz", state)
    kept = load_state(shared_path / "state.npz", balloon)
    np.testing.assert_array_equal(kept.unknowns, state.unknowns)
    assert copy.copy(state).unknowns is state.unknowns  # a shallow copy shares all
    assert copy.copy(balloon).mesh is balloon.mesh
    again = pickle.loads(pickle.dumps(modes[0]))  # a mode has no mesh
    assert again.value == modes[0].value
    np.testing.assert_array_equal(again.displacement, modes[0].displacement)


def frozen_records():
    """All frozen dataclasses of the package."""
    for module in pkgutil.walk_packages(lobefem.__path__, "lobefem."):
        if module.name == "lobefem.__main__":
            continue
        for kind in vars(importlib.import_module(module.name)).values():
            here = inspect.isclass(kind) and kind.__module__ == module.name
            if here and dataclasses.is_dataclass(kind) and kind.__dataclass_params__.frozen:
                yield kind


def test_every_frozen_record_with_arrays_keeps_them_read_only(comm):
    mesh = lobed_cylinder(1, (4, 6), comm=comm).mesh
    found = set()
    for kind in frozen_records():
        names = {f.name for f in dataclasses.fields(kind) if any(w in str(f.type) for w in ARRAYS)}
        names -= {f.name for f in dataclasses.fields(kind) if "Callable" in str(f.type)}
        if not names:
            continue
        assert issubclass(kind, Frozen), kind
        found.add(kind.__name__)
        if kind is Surface:  # which looks at what it is given
            continue
        array, within = np.zeros(3), {"one": np.zeros(3), "two": 2}
        types = {f.name: str(f.type) for f in dataclasses.fields(kind)}
        arguments = dict.fromkeys(types, array)
        arguments |= {name: within for name in names if "Mapping" in types[name]}
        arguments |= {name: (array, array) for name in names if "tuple[" in types[name]}
        arguments |= {name: [array] for name in names if "list[" in types[name]}
        if kind is Surface:  # looks at what it is given
            arguments = {"mesh": mesh, "axis": array + 1.0, "origin": array}
        record = kind(**arguments)
        for name in names:
            value = getattr(record, name)
            one = (
                value["one"]
                if isinstance(value, dict)
                else value[0]
                if type(value) in (tuple, list)
                else value
            )
            with pytest.raises(ValueError, match="read-only"):
                one[0] = 1.0
        array[0] = within["one"][0] = 1.0  # whoever made them can
    with pytest.raises(ValueError, match="read-only"):
        lobed_cylinder(1, (2, 3)).axis[0] = 1.0
    assert {"Equilibrium", "Mode", "Checkpoint", "Surface", "Branch", "Form", "Run"} <= found


ARRAYS = ("Array", "Integers", "Reals", "Complex", "Index", "NDArray")


def test_the_arrays_of_what_was_found_are_read_only(comm):
    surface = lobed_cylinder(1, (4, 6), comm=comm)
    balloon = Balloon(surface, Isotropic(), [GasPressure("closed"), EndPlates()], prestressed=True)
    state = inflate(balloon, 5.0)
    mode = find_modes(state, 1)[0]
    arrays = (
        state.unknowns,
        state.displacement,
        mode.displacement,
        mode.displacement_imag,
        surface.axis,
        balloon.X,
    )
    for array in arrays:
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 1.0
    assert inflate(balloon, 5.0, start=state).iterations == 0


def test_the_public_names():
    """What `lobefem` exports; a change of it is a change for every user."""
    assert sorted(lobefem.__all__) == [
        "Adjoint", "Balloon", "Bend", "Branch", "Cables", "Cleft", "ConstantAngle", "ConstantRadius",
        "CriticalPoint", "CriticalPressure", "DeadWeight", "Deployment", "Design", "Distorted",
        "EndPlates", "Equilibrium", "Fixed", "FixedWrinkles", "FlatLobe", "FlowOptions", "Form",
        "FreeBody", "GasPressure", "Gore", "HarmonicPressures", "HarmonicSeed", "Hoops", "IMP",
        "Isotensoid", "Isotropic", "MeshStudy", "Mode", "Modes", "NaturalCurve", "NaturalShape",
        "NewtonOptions", "Orthotropic", "OrthotropicTensionField", "Perturbed", "PlateLoad", "Point",
        "PrescribedPath", "PumpkinCurve", "PumpkinRecipe", "Released", "RunFolder", "SealedGas",
        "SelfContact", "Sensitivity", "Surface", "TabulatedWidth", "TendonCurve", "Tendons",
        "TensionField", "Tip", "Trace", "Twist", "Wave", "__version__", "branches", "continuum_pressure",
        "critical_point", "critical_pressure", "critical_sensitivity", "cylinder", "deploy", "distort",
        "fill", "find_form", "find_modes", "full_state", "harmonic_pressures", "ideal_state", "inflate",
        "isotensoid_stiffness", "load_run", "load_state", "lobed_cylinder", "mesh_study",
        "one_sided_charts", "one_sided_modes", "one_sided_pressures", "perturb", "pressurise", "release",
        "release_start", "save_state", "seal", "slack_critical_pressure", "trace", "unstable_from",
        "write_report",
    ]  # fmt: skip
    assert dir(lobefem) == sorted(lobefem.__all__)
    for name in lobefem.__all__:
        assert getattr(lobefem, name) is not None
    with pytest.raises(AttributeError, match="module 'lobefem' has no attribute 'Ballon'"):
        lobefem.Ballon  # noqa: B018
