"""One number is written in one way: in the table, the verdict and the report's first screen."""

import re
from pathlib import Path

import pytest

from lobefem.app import cli
from lobefem.io.run_reader import load_run
from lobefem.units import pascals
from lobefem.viz.headline import headline
from lobefem.viz.verdict import verdict

pytestmark = pytest.mark.serial

STACK4 = str(Path(__file__).parents[3] / "meshes" / "stack4.toml")
REAL = ("--film", "tension-field", "--load", "closed", "--state", "inflated", "--divisions", "6x8")


def near(text, pressure):
    """The ways in which a text writes a pressure, or one that is within a thousandth of it."""
    found = re.findall(r"(?<![\d.])(\d+(?:\.\d+)?) ?(k?)Pa\b(?!/)", text)
    values = {f"{number} {kilo}Pa": float(number) * (1000 if kilo else 1) for number, kilo in found}
    return {words for words, value in values.items() if abs(value / pressure - 1) < 1e-3}


@pytest.mark.slow
def test_a_critical_pressure_has_four_digits_everywhere(capfd, tmp_path):
    folder = tmp_path / "run"
    assert cli.main(["critical", STACK4, *REAL, "--out", str(folder), "--report"]) == 0
    shown = capfd.readouterr().out
    results = load_run(folder).results
    pressure = results["critical_pressure"]
    written = pascals(pressure)
    assert len(re.sub(r"\D", "", written)) == 4
    assert near(shown, pressure) == {written}
    assert headline(results).number == written
    assert near(" ".join(verdict(results)), pressure) == {written}
    page = (folder / "report.html").read_text(encoding="utf-8")
    page = re.sub(r"(?s)<script.*?</script>|<pre.*?</pre>", "", page)  # the data of charts, and the log
    found = near(re.sub(r"<[^>]+>", " ", page), pressure)  # among them other pressures of the search
    assert written in found
    assert all(len(re.sub(r"\D", "", one).strip("0")) <= 4 for one in found)
