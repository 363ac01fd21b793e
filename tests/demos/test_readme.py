"""The README: its example prints what is printed there, its lines fit a terminal."""

import re

import pytest
from loading import ROOT

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
    linked = re.findall(r"\]\(([^)#:]+)\)", README)
    assert "docs/start.md" in linked
    assert [path for path in linked if not (ROOT / path).exists()] == []
