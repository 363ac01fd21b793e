"""The README: its example prints what is printed there, its lines fit a terminal."""

import re
import shlex

import pytest
import typer
from loading import ROOT

from lobefem.app import cli

pytestmark = pytest.mark.serial

README = (ROOT / "README.md").read_text(encoding="utf-8")

NUMBER = r"\d+(?:\.\d+)?"


def test_readme_example_prints_what_the_readme_says(capsys):
    """Words as they are; numbers within 0.2 %, by which software stacks and rounding differ."""
    (example,) = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)
    (wanted,) = re.findall(r"```text\n(.*?)```", README, flags=re.DOTALL)
    namespace = {}
    exec(compile(example, "README.md", "exec"), namespace)
    found = capsys.readouterr().out
    assert re.sub(NUMBER, "#", found) == re.sub(NUMBER, "#", wanted)
    numbers = [[float(number) for number in re.findall(NUMBER, text)] for text in (found, wanted)]
    assert numbers[0] == pytest.approx(numbers[1], rel=2e-3)


def test_lines_of_the_readme_fit():
    assert max(map(len, README.splitlines())) <= 100


def test_files_that_the_readme_links_to_are_there():
    """Links lead to files of this repository; in a package they begin with its home page."""
    targets = dict(re.findall(r"^\[(\w+)\]: (\S+)$", README, flags=re.MULTILINE))
    assert set(re.findall(r"\]\[(\w+)\]", README)) == set(targets)
    assert re.findall(r"\]\(", README) == []  # none but those, which packaging finds
    files = [re.sub(r"^https://.*?/(?:blob|raw)/main/", "", target) for target in targets.values()]
    assert [file for file in files if not (ROOT / file).exists()] == []


def test_commands_of_the_readme_are_sound():
    """Their options are there; `sh` blocks are not run here, for they compute for minutes."""
    commands = typer.main.get_command(cli.app).commands
    lines = "".join(re.findall(r"```sh\n(.*?)```", README, flags=re.DOTALL)).replace("\\\n", " ").splitlines()
    ours = [line for line in lines if line.startswith("lobefem ")]
    assert len(ours) >= 5
    for line in ours:
        words = shlex.split(line, comments=True)
        words = words[: words.index(">")] if ">" in words else words
        commands[words[1]].make_context(words[1], words[2:])  # raises what is wrong
