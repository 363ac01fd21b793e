"""The README's example as it is printed there."""

import re

import pytest
from loading import ROOT

pytestmark = pytest.mark.serial


def test_readme_example_runs_as_printed(capsys):
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL)
    namespace = {}
    exec(compile(block, "README.md", "exec"), namespace)
    modes = namespace["modes"]
    assert [m.kind for m in modes.modes[:3]] == ["sway", "sway", "twist"]
    # the figures in the README's comments
    assert modes[0].value.real == pytest.approx(2.01, abs=0.01)
    assert modes[2].value.real == pytest.approx(11.4, abs=0.1)
    assert namespace["critical"].pressure == pytest.approx(4420, abs=1)
    assert namespace["critical"].mode.harmonic == 7
