"""The faces of the package and of its rooms: what a user can import without knowing the modules."""

import importlib
import inspect
import pkgutil
import re
from pathlib import Path

import pytest

import lobefem

ROOMS = ("linalg", "geometry", "model", "fem", "equilibrium", "stability", "io", "viz")
HOME = Path(__file__).parents[3]


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_shows_what_lives_in_it(room):
    face = importlib.import_module(f"lobefem.{room}")
    modules = {found.name for found in pkgutil.iter_modules(face.__path__)}
    for name in modules:
        importlib.import_module(f"lobefem.{room}.{name}")
    assert len(face.__all__) == len(set(face.__all__))
    assert face.__dir__() == sorted(face.__all__)
    assert not modules & set(face.__all__)  # the module would take the name's place
    for name in face.__all__:
        found = getattr(face, name)
        assert callable(found), name
        if inspect.isclass(found) or inspect.isfunction(found):
            assert found.__module__.startswith(f"lobefem.{room}."), name
            assert found.__module__.split(".")[-1] in modules
    with pytest.raises(AttributeError, match=f"module 'lobefem.{room}' has no attribute 'nothing'"):
        face.nothing  # noqa: B018


@pytest.mark.parametrize("room", [*ROOMS, "app"])
def test_a_room_says_what_lives_in_it(room):
    """In a first line and a paragraph."""
    first, blank, *paragraph = inspect.getdoc(importlib.import_module(f"lobefem.{room}")).splitlines()
    assert first.endswith(".")
    assert blank == ""
    assert paragraph


def test_the_package_shows_what_its_rooms_show():
    rooms = [importlib.import_module(f"lobefem.{room}") for room in ROOMS]
    for name in set(lobefem.__all__) - {"__version__"}:
        of_rooms = [getattr(room, name) for room in rooms if name in room.__all__]
        assert of_rooms == [getattr(lobefem, name)], name


def test_what_docs_and_demos_use_is_shown():
    """Classes and functions by the face of their room, or of the package."""
    pages = [HOME / "README.md", *HOME.glob("docs/**/*.md"), *HOME.glob("demos/*.py")]
    used = set()
    for page in pages:
        for module, names in re.findall(
            r"^ *from (lobefem\.\w+\.\w+) import (\([^)]*\)|[^#\n(]+)", page.read_text("utf-8"), re.M
        ):
            used |= {(module, one.split()[0]) for one in names.strip("()\n ,").split(",")}
    assert len(used) > 30
    for module, name in sorted(used):
        _, room, home = module.split(".")
        found = getattr(importlib.import_module(module), name)
        if room in ROOMS and name != home and (inspect.isclass(found) or inspect.isfunction(found)):
            assert name in importlib.import_module(f"lobefem.{room}").__all__, f"{module}.{name}"
