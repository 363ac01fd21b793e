"""Every code block of the pages runs as printed; python blocks of a page share their names."""

import importlib
import importlib.util
import os
import re
import shlex
import shutil
from pathlib import Path

import pytest

from lobefem.app import cli
from lobefem.app.sweep_file import load
from lobefem.io.design import Design

from mpi4py import MPI

pytestmark = pytest.mark.serial

ROOT = Path(__file__).parents[1]
PAGES = sorted(p for p in (ROOT / "docs").rglob("*.md") if not p.parts[-2].startswith("_"))
COARSE = "6x9"


def blocks(page, language):
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text(encoding="utf-8"), flags=re.M | re.S)


def named(pages):
    return [pytest.param(page, id=str(page.relative_to(ROOT / "docs"))) for page in pages]


@pytest.fixture
def workplace(shared_path, monkeypatch):
    """A folder with the example designs and those that the pages write."""
    if MPI.COMM_WORLD.rank == 0:
        shutil.copytree(ROOT / "meshes", shared_path / "meshes")
        for page in PAGES:
            for text in blocks(page, "toml"):
                name = re.match(r"# (\S+\.toml)\n", text)
                (shared_path / name[1]).write_text(text, encoding="utf-8")
    MPI.COMM_WORLD.Barrier()
    monkeypatch.chdir(shared_path)
    yield shared_path
    MPI.COMM_WORLD.Barrier()


@pytest.mark.parametrize("page", named(p for p in PAGES if blocks(p, "python")))
def test_python_blocks_run(page, workplace):
    names = {"__name__": page.stem}
    for text in blocks(page, "python"):
        exec(compile(text, page.name, "exec"), names)


@pytest.mark.parametrize("page", named(p for p in PAGES if blocks(p, "sh")))
def test_commands_run(page, workplace, capfd):
    """On a coarse mesh, which an option at the end says, unless it is the file's; the rest is as printed."""
    for line in "".join(blocks(page, "sh")).splitlines():
        command, *arguments = shlex.split(line)
        assert command == "lobefem"
        # three of them solve nothing, the others have meshes of their own
        fixed = arguments[0] in ("export", "gores", "optimise", "report") or arguments[1] == "beam.toml"
        coarse = [] if fixed else ["--divisions", COARSE]
        code = cli.main([*arguments, *coarse])
        assert code == 0, f"{line}\n{capfd.readouterr().err}"


def test_design_files_of_the_pages_are_sound(workplace):
    files = [name for name in os.listdir() if name.endswith(".toml")]
    own = [
        "beam.toml",
        "clefted.toml",
        "lobes.toml",
        "my-balloon.toml",
        "my-pumpkin.toml",
        "mylar-balloon.toml",
        "pumpkins.toml",
        "search.toml",
    ]
    assert sorted(files) == own
    assert Design.load("my-balloon.toml").shape.lobes == 3
    assert Design.load("my-pumpkin.toml").shape.gores == 48
    assert Design.load("beam.toml").cables[0].rest_length == 0.61
    assert pytest.approx(68.9e9 * 4e-4) == Design.load("mylar-balloon.toml").hoops.EA
    assert [point.fault for point in load("lobes.toml", {"critical": ["divisions"]}).points] == [""] * 12


def test_validation_is_generated(tmp_path):
    spec = importlib.util.spec_from_file_location("generate", ROOT / "docs" / "generate.py")
    generate = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(generate)
    generate.generate(tmp_path, quick=True)
    pages = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    wanted = {Path(name).name for name in re.findall(r"_generated/\S+?\.(?:md|png)", pages)}
    assert wanted == {path.name for path in tmp_path.iterdir()}
    assert "| 24 x 32, linear | 590.7424 | 8.21e-03 | 1.99 |" in (tmp_path / "volumes.md").read_text()
    assert "from n = 7 on every harmonic is unstable" in (tmp_path / "verdicts.md").read_text()


def test_kept_results_are_shown_with_their_age(tmp_path):
    """Without a computation; when a source has changed since, the page says so."""
    spec = importlib.util.spec_from_file_location("generate", ROOT / "docs" / "generate.py")
    generate = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(generate)
    pages = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    wanted = {Path(name).name for name in re.findall(r"_generated/\S+?\.(?:md|png)", pages)}
    for stamp, said in ((generate.key(quick=False), generate.FRESH), ("another", generate.OLD)):
        kept = tmp_path / stamp[:7]
        shutil.copytree(ROOT / "docs" / "_computed", kept)
        (kept / generate.STAMP).write_text(stamp)
        out = tmp_path / f"out-{stamp[:7]}"
        generate.use_kept(out, kept)
        assert (out / generate.STATE).read_text() == said
        assert wanted <= {path.name for path in out.iterdir()}


def test_every_page_is_in_the_contents():
    contents = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    listed = {line.strip() for block in re.findall(r"```{toctree}(.*?)```", contents, flags=re.S)
              for line in block.splitlines()}  # fmt: skip
    pages = {str(p.relative_to(ROOT / "docs").with_suffix("")) for p in PAGES} - {"index"}
    assert pages <= listed


def test_the_api_page_names_what_exists():
    page = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    named = re.findall(r"^\.\. auto(\w+):: (\S+)\n(?:   :members: (.+)\n)?", page, flags=re.M)
    assert len(named) > 60
    twice = [name for _, name, _ in named if sum(name == other for _, other, _ in named) > 1]
    missing = []
    for kind, name, members in named:
        module, _, attribute = (name, "", "") if kind == "module" else name.rpartition(".")
        found = importlib.import_module(module)
        if attribute:
            found = getattr(found, attribute, None)
        wanted = [member.strip() for member in members.split(",") if member.strip()]
        missing += [name] if found is None else [f"{name}.{one}" for one in wanted if not hasattr(found, one)]
    assert (missing, twice) == ([], [])


def test_modules_that_pages_name_are_there():
    """Dotted names in prose, such as `lobefem.stability.one_sided`."""
    pages = [*PAGES, ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
    named = {
        name
        for page in pages
        for name in re.findall(r"`(lobefem(?:\.\w+)+)`", page.read_text(encoding="utf-8"))
    }
    assert "lobefem.stability.one_sided" in named
    paths = {Path(*name.split(".")) for name in named}
    found = [any((ROOT / one / "__init__.py").exists() or (ROOT / one).with_suffix(".py").exists()
                 for one in (path, path.parent)) for path in sorted(paths)]  # fmt: skip
    assert [path for path, there in zip(sorted(paths), found, strict=True) if not there] == []


def test_files_that_contributing_names_are_there():
    """What is written in capitals stands for a name."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`((?:lobefem|tests|docs|demos)/[\w./]+)`", text))
    assert {"lobefem/model/laws.py", "lobefem/app/cli.py"} <= named
    assert [
        path for path in sorted(named) if not (re.search("[A-Z]{2}", path) or (ROOT / path).exists())
    ] == []
