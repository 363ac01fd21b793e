"""What a design file refuses, and in which words."""

import tomllib
from pathlib import Path

import pytest

from lobefem.errors import InputError
from lobefem.io.design import Design

MESHES = Path(__file__).parents[3] / "meshes"
SHIPPED = ("single", "stack4", "stack5", "cylinder", "formed")


def parse(text):
    return Design.parse(tomllib.loads(text))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[fim]", "'fim' is no section; use shape, mesh, film, hoops, plates, pressure, tendons, fittings, "
         "cleft, supports, fixed or cables (did you mean film?)"),
        ("[film]\nthicknes = 1", "'film.thicknes' is no key of [film]; use law, E, nu, thickness, "
         "slack_stiffness, prestress, hoop_slack, setup, tangent, E1, E2, nu12, G12, density, caps, strength "
         "or material (did you mean thickness?)"),
        ("[cleft]\nturn = '9000 deg'", "cleft.turn: '9000 deg' must be from -360 to 360 degrees; give"),
        ("film = 3", "film: 3 is not a table; write [film] and its keys below"),
        ("[film]\nthickness = '5 kPa'",
         "film.thickness: '5 kPa' is not a length; give metres, e.g. 5e-5 or \"0.05 mm\""),
        ("[film]\nthickness = 0", "film.thickness: 0 must be positive (1e-15 to 1e15 in SI); "
         "give metres"),
        ("[film]\nthickness = 0.05", "film.thickness = 0.05 m is no thin film on a radius of "
         "2.0 m (shape); give metres"),
        ("[film]\nE = nan", "film.E: nan is not a finite number; give pascals"),
        ("[film]\nnu = 0.6", "film.nu: 0.6 must be in (-1, 0.5]; give a number, e.g. 0.3"),
        ("[film]\nlaw = 'tension'", "film.law: 'tension' is unknown; use isotropic, "
         "orthotropic, fixed-wrinkles, tension-field, imp or load-path"),
        ("[film]\nlaw = 'tension_field'", "(did you mean tension-field?)"),
        ("[film]\nsetup = 'path'", "film.setup: 'path' is unknown; use initial-stress or load-path"),
        ("[film]\ntangent = 'exact'", "film.tangent: 'exact' is unknown; use consistent or secant"),
        ("[film]\ntangent = 'secant'", "film.tangent = 'secant' needs a law written as a stress, imp or "
         "load-path, not 'fixed-wrinkles'; leave it out"),
        ("[film]\nlaw = 'load-path'\nprestress = true", "film.prestress = true does not fit law = "
         "'load-path', which finds the stress of unstressed film; leave it out, or give the law that takes"),
        ("[film]\nlaw = 'load-path'\nsetup = 'load-path'", "film.setup = 'load-path' does not fit law"),
        ("[film]\nsetup = 'load-path'\nprestress = false", "film.setup = 'load-path' is a way to built-in "
         "stress; leave out prestress = false"),
        ("[film]\nsetup = 'load-path'\n[shape]\nkind = 'cylinder'", "film.setup = 'load-path' needs an "
         "isotensoid; leave it out for a cylinder"),
        ("[film]\nsetup = 'load-path'\n[pressure]\nvalue = [5, 10]", "film.setup = 'load-path' sets up the "
         "stress of one pressure, not of 2; give one in [pressure]"),
        ("[film]\nsetup = 'load-path'\n[pressure]\nvalue = 0", "film.setup = 'load-path' needs a pressure"),
        ("[film]\nprestress = 'yes'", "film.prestress: 'yes' is neither true nor false"),
        ("[film]\nslack_stiffness = 1.0", "film.slack_stiffness: 1.0 must be in [0, 1)"),
        ("[film]\nhoop_slack = -1e-3", "film.hoop_slack: -0.001 must be in [0, 1)"),
        ("[shape]\nlobes = 0", "shape.lobes: 0 is impossible; give an integer, 1 or more"),
        ("[shape]\nlobes = " + "0x" + "f" * 5000, "shape.lobes: int of that size is impossible"),
        ("[film]\nE" + ".a" * 1500 + " = 1", "is not a stress; give pascals"),
        ("[shape]\nlobes = 2.5", "shape.lobes: 2.5 is impossible; give an integer, 1 or more"),
        ("[shape]\ntruncation = 0.7", "shape.truncation: 0.7 must be in (0, 0.599]"),
        ("[shape]\nR0 = 3.8\nedge_radius = 2",
         "shape.edge_radius = 2.0 and R0 = 3.8 both give the size; leave one out"),
        ("[shape]\nradius = 2", "shape.radius = 2.0 does not fit the kind 'isotensoid'; use "
         "edge_radius, R0 or truncation"),
        ("[shape]\nkind = 'cylinder'\nR0 = 2", "shape.R0 = 2.0 does not fit the kind 'cylinder'; "
         "use radius or length"),
        ("[shape]\nkind = 'cylinder'\nlobes = 2",
         "shape.lobes = 2 does not fit the kind 'cylinder'; leave it out"),
        ("[shape]\nkind = 'formed'\ntruncation = 0.5",
         "shape.truncation = 0.5 does not fit the kind 'formed'; use radius, length, forming_pressure or "
         "forming_stiffness"),
        ("[shape]\nforming_pressure = 10",
         "shape.forming_pressure = 10.0 does not fit the kind 'isotensoid'; use edge_radius"),
        ("[shape]\nkind = 'formed'\nforming_pressure = 0", "shape.forming_pressure: 0 must be positive"),
        ("[shape]\nkind = 'formed'\nforming_stiffness = '188 N'",
         "shape.forming_stiffness: '188 N' is not a membrane stiffness; give newtons per metre, e.g. 188"),
        ("[shape]\nkind = 'cylinder'\n[film]\nprestress = true",
         "film.prestress = true needs an isotensoid; leave it out for a cylinder"),
        ("[mesh]\ndivisions = 24", "mesh.divisions: 24 is no mesh division; give cells"),
        ("[mesh]\ndivisions = '24x'", "mesh.divisions: '24x' is no mesh division"),
        ("[mesh]\ndivisions = [24, 32, 2]", "mesh.divisions: [24, 32, 2] is no mesh division"),
        ("[mesh]\ndivisions = [24, true]", "mesh.divisions: [24, True] is no mesh division"),
        ("[mesh]\norder = 3", "mesh.order: 3 is impossible; give 1 or 2"),
        ("[mesh]\nsize = 0.2", "mesh.size = 0.2 needs layout = 'unstructured'"),
        ("[mesh]\nlayout = 'unstructured'", "mesh.layout = 'unstructured' lacks a size"),
        ("[mesh]\nlayout = 'unstructured'\ndivisions = [4, 6]",
         "mesh.divisions = [4, 6] do not fit layout = 'unstructured'; give a size in metres"),
        ("[hoops]\nEA = '215 GPa'", "hoops.EA: '215 GPa' is not a force; give newtons"),
        ("[plates]\nbar = -1", "plates.bar: -1 is no bar; give true (rigid), false (none)"),
        ("[plates]\nlift = '4 mm'",
         "plates.lift = 0.004 needs support = 'fixed', not 'clamped'; change one of them"),
        ("[pressure]\nvalue = -5", "pressure.value: -5 is below 0, and a film carries no suction"),
        ("[pressure]\nvalue = []", "pressure.value: [] holds no pressure; give pascals"),
        ("[pressure]\nvalue = [5, '5 m']", "pressure.value: '5 m' is not a pressure"),
    ],
)  # fmt: skip
def test_refusals_name_key_value_and_remedy(text, message):
    with pytest.raises(InputError) as caught:
        parse(text)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"plates.lift": "4 kg"}, "--lift: '4 kg' is not a length; give metres"),
        ({"plates.lift": "4 mm"}, "plates.lift = 0.004 needs support = 'fixed'"),
        ({"film.law": "rubber"}, "--film: 'rubber' is unknown; use isotropic"),
    ],
)
def test_refused_overrides_are_called_by_their_options(changes, message):
    names = {"plates.lift": "--lift", "film.law": "--film"}
    with pytest.raises(InputError) as caught:
        Design().with_overrides(changes, names)
    assert message in str(caught.value)


def test_files_that_cannot_be_read(shared_path, comm):
    wrong = shared_path / "wrong.toml"
    binary = shared_path / "binary.toml"
    huge = shared_path / "huge.toml"
    if comm.rank == 0:
        wrong.write_text("[film\n")
        huge.write_text(f"shape.lobes = {'9' * 5000}\n")  # more digits than Python reads
        binary.write_bytes(b"\xff\xfe\x00")
    for path, message in (
        (shared_path / "none.toml", "there is no design file '.*none.toml'; see lobefem new --list"),
        (shared_path, "cannot read '.*' \\(Is a directory\\); give a TOML design file"),
        (huge, "huge.toml is no TOML \\(not such a text\\)"),
        (wrong, "wrong.toml is no TOML \\(.*line 1.*\\); see lobefem new --list"),
        (binary, "binary.toml is no text in UTF-8 but maybe in UTF-16; save it as UTF-8"),
    ):
        with pytest.raises(InputError, match=message):
            Design.load(path, comm)


@pytest.mark.parametrize(
    ("line", "why", "instead"),
    [
        ("thickness = 0.08 mm", "0.08 mm is a number with a unit", 'thickness = "0.08 mm"'),
        ("E=3.5GPa  # film", "3.5GPa is a number with a unit", 'E = "3.5GPa"'),
        ("lift = -4 mm", "-4 mm is a number with a unit", 'lift = "-4 mm"'),
        ("law = isotropic", "isotropic is a word, which needs quotes", 'law = "isotropic"'),
        ("enabled = True", "True is no value of TOML", "enabled = true"),
        ("divisions = 24x32", "24x32 is no value of TOML", "divisions = [24, 32]"),
        ("nu = .3", ".3 needs digits on both sides of its point", "nu = 0.3"),
        ("nu = 0,3", "0,3 has a comma where a decimal point belongs", "nu = 0.3"),
        ("lift = 0,4 mm", "a comma where a decimal point belongs", 'lift = "0.4 mm"'),
        ("value = [1 kPa, 2000]", "holds what is a number with a unit", 'value = ["1 kPa", 2000]'),
        ("law = 'iso", "", ""),
        ("E = [,]", "", ""),
        ("= 3", "", ""),
        ("a = b = c", "", ""),
        ("a = 08", "", ""),
    ],
)
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_values_that_toml_lacks_are_said_with_what_to_write(shared_path, comm, line, why, instead, end):
    path = shared_path / "mine.toml"
    if comm.rank == 0:
        path.write_bytes(f"[film]{end}{line}{end}".encode())
    with pytest.raises(InputError) as caught:
        Design.load(path, comm)
    assert "mine.toml" in str(caught.value)
    if not instead:
        assert "is no TOML (" in str(caught.value)
        return
    assert "line 2: " in str(caught.value)
    assert why in str(caught.value)
    assert str(caught.value).endswith(f"; write {instead}")


# mended by hand, each of these is the design file in which it stands
_LAW, _QUOTED = "[film]\n{}\nnu = 0.2\n", 'law = "isotropic"'


@pytest.mark.parametrize(
    "content",
    [
        _LAW.format(_QUOTED).encode("utf-8-sig"),
        _LAW.format(_QUOTED).replace("\n", "\r\n").encode("utf-8-sig"),
        _LAW.format(f"{_QUOTED} # \u201cnever\u201d\u00a0wrinkles, 5 \u00b5m").encode(),
    ],
)
def test_marks_of_an_editor_that_change_nothing_are_read(tmp_path, content):
    path = tmp_path / "mine.toml"
    path.write_bytes(content)
    film = Design.load(path).film
    assert (film.law, film.nu) == ("isotropic", 0.2)


@pytest.mark.parametrize(
    ("content", "what"),
    [
        (_LAW.format(_QUOTED).encode("utf-16"), " is no text in UTF-8 but maybe in UTF-16; save it as UTF-8"),
        (
            _LAW.format(_QUOTED).encode("utf-16-le"),
            " is no text in UTF-8 but maybe in UTF-16; save it as UTF-8",
        ),
        (
            _LAW.format(f"{_QUOTED} # 5 \u00b5m").encode("latin-1"),
            ", line 2: byte 0xb5 is no UTF-8 but maybe Latin-1; save it as UTF-8",
        ),
        (
            "\u00b5 = 1\n".encode("latin-1"),
            ", line 1: byte 0xb5 is no UTF-8 but maybe Latin-1; save it as UTF-8",
        ),
        (
            _LAW.format(_QUOTED).replace("\n", "\r").encode(),
            ", line 1 ends in a carriage return alone; save it with the line ends of Unix or Windows",
        ),
        (
            f"[film]\r\n{_QUOTED}\rnu = 0.2\r\n".encode(),
            ", line 2 ends in a carriage return alone; save it with the line ends of Unix or Windows",
        ),
        (
            _LAW.format("law = \u201cisotropic\u201d").encode(),
            ', line 2: \u201c is a curly quote; write the straight one, "',
        ),
        (
            _LAW.format('law = "isotropic\u201d').encode(),
            ', line 2: \u201d is a curly quote; write the straight one, "',
        ),
        (
            _LAW.format("law = \u2018isotropic\u2019").encode(),
            ', line 2: \u2018 is a curly quote; write the straight one, "',
        ),
        (
            _LAW.format('law\u00a0= "isotropic"').encode(),
            ", line 2: there is a no-break or other special blank (U+00A0) after law; write a plain one",
        ),
        (
            "\u00a0[film]\n".encode(),
            ", line 1: there is a no-break or other special blank (U+00A0); write a plain one",
        ),
        (
            "[film]\nnu = 0.2\u200b\n".encode(),
            ", line 2: there is a no-break or other special blank (U+200B) after nu = 0.2; write a plain one",
        ),
        # neither is at fault within a string
        (
            'law = "\u201ciso\u201d\u00a0film" 5\n'.encode(),
            " is no TOML (Expected newline or end of document after",
        ),
    ],
)
def test_what_an_editor_has_done_is_named(tmp_path, content, what):
    path = tmp_path / "mine.toml"
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        Design.load(path)
    assert str(caught.value).startswith(f"{path}{what}")


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("[film]\nE = 1\n\n[film]  # again\nnu = 0", "line 4: [film]"),
        ("[film]\nE = 1\nnu = 0\nE = 2\nthickness = 1", "line 4: E"),
        ("[film]\nE = 1\nE = []\n", "line 3: E"),
        ("[film]\nE = 1\nnu = 0\nE = 2", "line 4: E"),
        ("film = 1\n[film]\n", "line 2: [film]"),
    ],
)
def test_a_table_or_key_given_twice_is_named_with_its_line(tmp_path, text, what):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        Design.load(path)
    assert str(caught.value) == f"{path}, {what} is there a second time; keep one of the two"


def test_what_toml_says_of_an_endless_key_is_cut_short(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(f"film.E = []\nfilm.E{'.a' * 1500} = 0\n")
    with pytest.raises(
        InputError, match=r"mine\.toml is no TOML \(Cannot mutate .*\.\.\..*\); see"
    ) as caught:
        Design.load(path)
    assert len(str(caught.value)) < 400 + len(str(path))


def test_a_faulty_file_is_named(shared_path, comm):
    path = shared_path / "mine.toml"
    if comm.rank == 0:
        path.write_text("[film]\nnu = 7\n")
    with pytest.raises(InputError, match=r"mine\.toml: film\.nu: 7 must be in"):
        Design.load(path, comm)
