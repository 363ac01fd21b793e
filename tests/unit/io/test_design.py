"""The design file: what it means, how options change it, what is built from it."""

import re
import tomllib
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lobefem.equilibrium.inflation import inflate
from lobefem.errors import InputError
from lobefem.geometry.isotensoid import Isotensoid
from lobefem.io.design import Design
from lobefem.model.imp import IMP, PrescribedPath

MESHES = Path(__file__).parents[3] / "meshes"
SHIPPED = ("single", "stack4", "stack5", "cylinder", "formed")


def parse(text):
    return Design.parse(tomllib.loads(text))


# --- what a design means ------------------------------------------------------------------------


def test_the_default_is_the_papers_design():
    design = Design()
    assert design.shape.edge_radius == 2.0
    assert design.shape.truncation == 0.55
    assert (design.film.E, design.film.nu, design.film.thickness) == (3.5e9, 0.3, 5e-5)
    assert design.plates.bar is True
    assert not design.hoops.enabled
    assert parse("[hoops]").hoops.enabled
    assert parse("[hoops]").hoops.EA == 2.15e9


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_designs_are_read_and_written_back(name):
    design = Design.load(MESHES / f"{name}.toml")
    assert parse(design.to_toml()) == design
    if name != "cylinder":  # the paper's own numbers are the defaults
        paper, film = Design().film, design.film
        assert (film.E, film.nu, film.thickness) == (paper.E, paper.nu, paper.thickness)
        assert (design.shape.edge_radius or design.shape.radius) == Design().shape.edge_radius


@pytest.mark.parametrize(
    ("name", "lobes", "law", "setup", "support"),
    [
        ("single", 1, "fixed-wrinkles", "initial-stress", "clamped"),  # sec. 5.1
        ("stack4", 4, "fixed-wrinkles", "initial-stress", "clamped"),  # sec. 5.2
        ("stack5", 5, "imp", "load-path", "clamped"),  # sec. 6, stress as in sec. 4.1
        ("cylinder", 1, "fixed-wrinkles", "initial-stress", "fixed"),  # sec. 5, figs 8 to 10
        ("formed", 1, "fixed-wrinkles", "initial-stress", "clamped"),
    ],
)
def test_shipped_designs_are_those_of_the_sections_that_they_name(name, lobes, law, setup, support):
    design = Design.load(MESHES / f"{name}.toml")
    assert (design.shape.lobes, design.film.law, design.film.setup) == (lobes, law, setup)
    assert (design.pressure.load, design.plates.support, design.plates.bar) == ("film", support, True)
    assert design.hoops.enabled == (name != "cylinder")
    assert design.film.prestress == (name != "cylinder")


def test_the_law_decides_prestress_and_slack_unless_they_are_given():
    design = Design()
    assert (design.film.prestress, design.film.slack_stiffness) == (True, 0.0)
    other = design.with_overrides({"film.law": "tension-field"})
    assert (other.film.prestress, other.film.slack_stiffness) == (False, 1e-6)
    again = other.with_overrides({"film.law": "fixed-wrinkles"})
    assert again == design
    kept = parse("[film]\nprestress = true\nslack_stiffness = 1e-3")
    kept = kept.with_overrides({"film.law": "tension-field"})
    assert (kept.film.prestress, kept.film.slack_stiffness) == (True, 1e-3)


def test_a_film_shared_by_two_designs_is_not_changed_by_either():
    film = Design().film.model_copy(update={"prestress": None})
    Design(film=film)
    assert film.prestress is None


def test_an_overridden_size_replaces_the_equator_radius():
    design = parse("[shape]\nR0 = 3.8182")
    assert design.shape.edge_radius is None
    changed = design.with_overrides({"shape.edge_radius": "2 m"})
    assert (changed.shape.R0, changed.shape.edge_radius) == (None, 2.0)
    flat = parse("[shape]\nkind = 'cylinder'").with_overrides({"shape.edge_radius": 3.0})
    assert flat.shape.radius == 3.0
    formed = parse("[shape]\nkind = 'formed'").with_overrides({"shape.edge_radius": 3.0})
    assert formed.shape.radius == 3.0
    assert formed.shape.length == pytest.approx(Isotensoid.from_edge_radius(3.0).height, rel=1e-14)


def test_overriding_divisions_makes_an_unstructured_mesh_structured():
    design = parse("[mesh]\nlayout = 'unstructured'\nsize = '25 cm'")
    assert (design.mesh.size, design.mesh.divisions) == (0.25, None)
    changed = design.with_overrides({"mesh.divisions": "8x12"})
    assert (changed.mesh.layout, changed.mesh.divisions) == ("structured", (8, 12))


def test_overrides_that_are_none_change_nothing():
    design = Design.load(MESHES / "stack4.toml")
    assert design.with_overrides({"film.law": None, "shape.lobes": None}) == design


def test_overrides_as_text_from_the_command_line():
    design = Design().with_overrides(
        {
            "plates.support": "fixed",
            "plates.lift": "4 mm",
            "film.slack_stiffness": "1e-4",
            "shape.lobes": "4",
            "mesh.order": "2",
            "pressure.value": ["5", "1 kPa"],
        }
    )
    assert design.plates.lift == 0.004
    assert design.film.slack_stiffness == 1e-4
    assert (design.shape.lobes, design.mesh.order) == (4, 2)
    assert design.pressure.value == (5.0, 1000.0)


# --- any mutation either makes a sound design or one sentence -------------------------------------

KEYS = [
    (section, key)
    for section, field in Design.model_fields.items()
    for key in getattr(field.annotation, "model_fields", ())  # not those of lists of tables
]
VALUES = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=12),
    st.sampled_from(
        ["1 m", "5 kPa", "2 N", "24x32", "cylinder", "isotensoid", "formed", "unstructured", "fixed", "film"]
    ),
    st.lists(st.one_of(st.integers(), st.floats(), st.text(max_size=5)), max_size=3),
    st.dictionaries(st.text(max_size=3), st.integers(), max_size=2),
)


@pytest.mark.serial
@settings(max_examples=150, deadline=None)
@given(st.lists(st.tuples(st.sampled_from([*KEYS, ("film", "x\ny"), ("z", "y")]), VALUES), max_size=4))
def test_any_tables_make_a_design_or_one_sentence(entries):
    tables = {}
    for (section, key), value in entries:
        tables.setdefault(section, {})[key] = value
    try:
        design = Design.parse(tables)
    except InputError as error:
        sentence = str(error)
    else:
        assert parse(design.to_toml()) == design
        assert design.with_overrides({}) == design
        return
    assert "\n" not in sentence
    assert any(section in sentence for section in tables)
    # all sections were tables, though what film.caps lists need not be
    assert not any(f"{section}: " in sentence and "is not a table" in sentence for section in tables)
    assert len(sentence) < 400


# --- building -----------------------------------------------------------------------------------


def test_a_design_builds_what_it_says(comm):
    design = Design().with_overrides(
        {
            "shape.lobes": 2,
            "mesh.divisions": "4x6",
            "film.law": "tension-field",
            "plates.bar": "2 GN",
            "hoops.EA": 1e9,
            "pressure.load": "closed",
        }
    )
    surface = design.surface(comm)
    assert surface.divisions == (4, 6)
    assert surface.num_lobes == 2
    assert surface.shape.edge_radius == pytest.approx(2.0, rel=1e-14)
    balloon = design.balloon(surface)
    assert not balloon.prestressed
    assert balloon.film.slack_stiffness == 1e-6
    assert balloon.plates.bar == 2e9
    assert balloon.load.convention == "closed"
    assert [cable.EA for cable in balloon.cables] == [1e9]
    assert design.balloon(surface, prestressed=True).prestressed


@pytest.mark.parametrize("law", ["tension-field", "imp", "isotropic", "fixed-wrinkles"])
def test_a_load_path_sets_up_the_stress_that_a_law_takes_over(comm, law):
    tables = {"shape": {"lobes": 2}, "mesh": {"divisions": [4, 8]}, "hoops": {}, "pressure": {"value": 5}}
    design = Design.parse(tables | {"film": {"law": law, "setup": "load-path"}})
    assert design.film.prestress
    surface = design.surface(comm)
    balloon = design.balloon(surface)
    path = balloon.load_path
    assert isinstance(path.balloon.film, PrescribedPath)
    assert (path.converged, path.pressure, path.prestress) == (True, 5.0, 0.0)
    state = inflate(balloon, 5.0)  # from the path's shape, for nothing else is given
    assert state.steps == (5.0,)
    # not to the last digit: triangles are sheared, and shear beside no hoop stress means compression
    assert state.volume == pytest.approx(path.volume, rel=1e-4 if law == "fixed-wrinkles" else 1e-5)
    bare = design.balloon(surface, prestressed=False)
    assert bare.load_path is None
    assert not bare.prestressed


def test_the_laws_of_section_4_are_built_with_their_tangent(comm):
    tables = {"mesh": {"divisions": [2, 4]}, "film": {"law": "imp", "tangent": "secant", "E": 2e9}}
    design = Design.parse(tables)
    surface = design.surface(comm)
    assert design.balloon(surface).film == IMP(E=2e9, tangent="secant")
    path = design.with_overrides({"film.law": "load-path", "film.slack_stiffness": 1e-4})
    assert path.balloon(surface).film == PrescribedPath(E=2e9, tangent="secant", slack_stiffness=1e-4)


def test_r0_and_cylinder_reach_the_surface(comm):
    tables = {"shape": {"R0": 4.2 / 1.1}, "mesh": {"divisions": [2, 3]}}
    surface = Design.parse(tables).surface(comm)
    assert surface.shape.R0 == 4.2 / 1.1
    tables = {"shape": {"kind": "cylinder", "length": 3}, "mesh": {"divisions": [1, 3]}}
    flat = Design.parse(tables)
    assert flat.surface(comm).shape.height == 3.0
    assert not flat.has_ideal_state
    isotropic = flat.with_overrides({"film.law": "isotropic"})
    assert not isotropic.balloon(isotropic.surface(comm)).cables


def test_a_formed_lobe_is_formed_then_stacked_and_prestressed(comm):
    tables = {
        "shape": {"kind": "formed", "forming_pressure": "10 Pa", "lobes": 2},
        "mesh": {"divisions": [6, 8]},
    }
    design = Design.parse(tables)
    assert design.has_ideal_state
    assert design.film.prestress
    surface = design.surface(comm)
    assert (surface.num_lobes, surface.divisions) == (2, (6, 8))
    # the closed form at 10 Pa is 3.061 m wide; 8 facets around hold 10 % less gas
    widest = surface.shape.R0
    assert widest == pytest.approx(3.061, rel=0.02)
    assert surface.shape.edge_radius == pytest.approx(2.0)
    assert surface.shape.height == pytest.approx(Isotensoid.from_edge_radius(2.0).height)
    assert design.balloon(surface).prestressed
    stiff = design.with_overrides({"shape.forming_stiffness": "1 kN/m", "shape.lobes": 1})
    assert widest > 1.05 * stiff.surface(comm).shape.R0
    free = design.with_overrides({"mesh.size": 0.8})
    assert free.surface(comm).divisions is None


def test_a_formed_lobe_becomes_the_isotensoid_by_default(comm):
    shape = Design.load(MESHES / "formed.toml", comm).surface(comm).shape
    assert shape.meridional_tension == pytest.approx(
        Isotensoid.from_edge_radius(2.0).meridional_tension, rel=5e-3
    )
    assert shape.m == pytest.approx(0.5, abs=2e-3)


def test_too_much_forming_pressure_is_refused(comm):
    design = Design.parse({"shape": {"kind": "formed", "forming_pressure": 100}})
    with pytest.raises(InputError, match=r"at 100 Pa a film of E t = 187\.487 N/m bulges over its rims"):
        design.surface(comm)


# --- materials ----------------------------------------------------------------------------------
def test_a_material_has_what_is_not_given():
    film = parse('[film]\nmaterial = "mylar-a"\nnu = 0.3').film
    assert (film.E, film.nu, film.strength) == (
        pytest.approx(4.805e9, rel=1e-3),
        0.3,
        pytest.approx(196.1e6, rel=1e-3),
    )
    hoops = parse('[hoops]\nmaterial = "aluminium-6061-t6"\narea = "400 mm^2"').hoops
    assert pytest.approx(68.9e9 * 4e-4) == hoops.EA
    assert pytest.approx(7e6) == parse('[hoops]\nE = "70 GPa"\narea = "1 cm2"').hoops.EA


def test_changes_of_material_replace_what_it_had():
    """Of a run's complete design too, in which every number is given."""
    design = parse(parse('[film]\nmaterial = "mylar-a"\n[hoops]\nE = "70 GPa"\narea = "1 cm2"').to_toml())
    assert pytest.approx(7e6) == design.hoops.EA
    other = design.with_overrides({"film.material": "aluminium-6061-t6", "film.nu": 0.28, "hoops.EA": 5e6})
    assert (other.film.E, other.film.nu, other.film.strength) == (68.9e9, 0.28, 276e6)
    assert (other.hoops.EA, other.hoops.E, other.hoops.area) == (5e6, None, None)
    assert pytest.approx(14e6) == design.with_overrides({"hoops.area": "2 cm2"}).hoops.EA
    assert pytest.approx(6.89e6) == design.with_overrides({"hoops.material": "aluminium-6061-t6"}).hoops.EA


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[film]\nmaterial = "mylar"', "film.material: 'mylar' is unknown; use mylar-a"),
        ('[film]\nmaterial = "kevlar-49"', "film.material: 'kevlar-49' is unknown; use mylar-a or alu"),
        ('[hoops]\nE = "70 GPa"', "hoops.E = 70000000000.0 lacks the area of the hoops' cross-section; give"),
        ('[hoops]\nmaterial = "aluminium-6061-t6"', "hoops.material = 'aluminium-6061-t6' lacks the area"),
        (
            '[hoops]\nmaterial = "mylar-a"\narea = 1',
            "hoops.material: 'mylar-a' is unknown; use aluminium-6061-t6",
        ),
        ('[hoops]\narea = "1 cm2"', "hoops.area = 0.0001 lacks E or a material; give one"),
        ("[hoops]\nEA = 1\nE = 2e9\narea = 1e-4", "hoops.EA = 1 is not E times area, 200000 N; leave one"),
    ],
)
def test_materials_that_say_too_little_or_too_much(text, message):
    with pytest.raises(InputError, match=re.escape(message)):
        parse(text)
