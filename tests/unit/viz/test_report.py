"""The report: what it says, that it runs nothing of what it prints, and that a browser draws it."""

import json
import os
import re
import shutil
import signal
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path

import h5py
import numpy as np
import pytest
from matplotlib.image import imread

from lobefem.app import cli, states_command
from lobefem.errors import InputError
from lobefem.io import run_reader
from lobefem.io.run_reader import Step
from lobefem.viz import report
from lobefem.viz.report_charts import eigenvalues
from lobefem.viz.report_maps import regions, stress_maps

from mpi4py import MPI

ROOT = Path(__file__).parents[3]
SINGLE, CYLINDER = (str(ROOT / "meshes" / name) for name in ("single.toml", "cylinder.toml"))
EVIL = "<script>alert(1)</script>"

alone = pytest.mark.serial  # rank 0 writes a report, and it alone
_XDMF = """<?xml version="1.0"?><Xdmf><Domain><Grid GridType="Collection"><Grid GridType="Uniform">
<Topology TopologyType="Triangle"><DataItem>fields.h5:/t</DataItem></Topology>
<Geometry><DataItem>{x}</DataItem></Geometry><Time Value="5.0"/>
<Attribute Name="mode_1" Center="Node"><DataItem>fields.h5:/mode</DataItem></Attribute>
<Attribute Name="stress_resultants" Center="Cell"><DataItem>fields.h5:/stress</DataItem></Attribute>
</Grid></Grid></Domain></Xdmf>"""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run folder of a real sweep of modes with its report, on all ranks."""
    folder = MPI.COMM_WORLD.bcast(tmp_path_factory.mktemp("report") / "run", root=0)
    given = ["--divisions", "12x16", "--pressure", "2000", "--pressure", "4000", "--count", "3"]
    assert cli.main(["modes", SINGLE, *given, "--out", str(folder), "--report"]) == 0
    return folder


def made_up(folder, results, x=None):
    """A run folder without a solve: a dozen triangles around the axis, if nodes are named."""
    folder.mkdir()
    (folder / "design.toml").write_text(f'[shape]\nkind = "{EVIL}"\nlobes = 1\n# {EVIL}\n')
    text = results if isinstance(results, str) else json.dumps({"schema": 1, "command": "modes"} | results)
    (folder / "results.json").write_text(text)
    if x is None:
        return folder
    angle = np.arange(6) * np.pi / 3
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    below, j = np.arange(6), (np.arange(6) + 1) % 6
    triangles = np.concatenate([np.stack([below, j, j + 6], 1), np.stack([below, j + 6, below + 6], 1)])
    with h5py.File(folder / "fields.h5", "w") as file:
        file["x"] = np.concatenate([np.insert(circle, 2, z, axis=1) for z in (0.0, 1.0)])
        file["t"], file["mode"] = triangles, np.ones((12, 3))
        file["stress"] = np.ones((12, 3))
    (folder / "fields.xdmf").write_text(_XDMF.format(x=x))
    return folder


class Outline(HTMLParser):
    """Landmarks, headings, images, tables and scripts of a page, in order."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.ids, self.links, self.plain_images, self.scripts = [], [], [], 0, []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.tags.append(tag)
        if "id" in given:
            self.ids.append(given["id"])
        if tag == "script":
            self.scripts.append(given)
        if tag == "a":
            self.links.append(given["href"])
        if tag == "img":
            self.plain_images += not given.get("alt")
            assert given["src"].startswith("data:")
        assert not any(name.startswith("on") for name in given)


@pytest.mark.slow
def test_the_command_and_its_refusals(run, capfd):
    """On any number of ranks; --report has been given to the run itself."""
    assert (run / report.FILE).is_file()
    capfd.readouterr()
    assert cli.main(["report", str(run)]) == 0
    assert cli.main(["inflate", SINGLE, "--report"]) == 2
    out, err = MPI.COMM_WORLD.bcast(tuple(capfd.readouterr()), root=0)
    assert out == f"The report is {run / report.FILE}\n"
    assert err == "lobefem: --report is written into the folder of --out; give one\n"


@pytest.mark.slow
@alone
def test_the_page_is_whole_and_sane(run):
    """Nothing from outside, one h1, no heading level left out, captions and alts, warnings first."""
    text = (run / report.FILE).read_text(encoding="utf-8")
    page = Outline(text)
    for landmark in ("header", "nav", "main", "h1"):
        assert page.tags.count(landmark) == 1
    levels = [int(tag[1]) for tag in page.tags if re.fullmatch(r"h[1-6]", tag)]
    assert all(after <= before + 1 for before, after in pairwise(levels))
    assert page.tags.count("table") == page.tags.count("caption") > 4
    assert page.plain_images == 4  # those on buttons, which have words beside them
    assert page.tags.count("img") == 6  # beside the answer, four buttons, one map
    assert len(set(page.ids)) == len(page.ids)
    assert {link[1:] for link in page.links} <= set(page.ids)
    assert all("src" not in script for script in page.scripts)
    assert [script.get("type") for script in page.scripts] == ["application/json", None]
    assert "link" not in page.tags
    assert re.findall(r'<h2 id="([\w-]+)"', text) == [
        "answer", "shapes", "run-0-numbers", "run-0-stress", "run-0-details",
    ]  # fmt: skip
    answer = text.index('id="answer"'), text.index('id="shapes"')
    for words in (
        "Stable at",
        "2000 Pa to 4000 Pa",
        "falls with refinement",
        "goes to zero as it is refined",
    ):
        assert answer[0] < text.index(words) < answer[1]
    told = json.loads((run / "results.json").read_text())["pressures"][1]["modes"][0]
    for words in (f"{told['real']:.4g}", "Pa/m", "m³", "<td>1, 2</td>"):
        assert words in text
    assert text.index("What differs from the defaults") < text.index("The whole design")
    assert len(text.encode()) < 2e6


@pytest.mark.slow
@alone
def test_what_is_printed_is_not_run(tmp_path):
    """Markup in a folder's name, a design or results stays text, and a policy forbids other scripts."""
    modes = [{"kind": EVIL, "harmonic": 1, "real": 1.0}]
    harmful = {
        "warnings": [EVIL], "outcome": EVIL, EVIL: EVIL, "verdict": [EVIL], "versions": {EVIL: EVIL},
        "pressures": [{"pressure": 5.0, "stable": True, "modes": modes}],
    }  # fmt: skip
    folder = made_up(tmp_path / EVIL.replace("/", "_"), harmful, "fields.h5:/x")
    (folder / "log.txt").write_text(f"</pre>{EVIL}\n")
    text = report.write_report(folder).read_text(encoding="utf-8")
    assert "<script>alert" not in text
    assert "&lt;script&gt;alert(1)" in text
    assert Outline(text).tags.count("script") == 2  # data and ours
    policy = re.search(r'http-equiv="Content-Security-Policy" content="([^"]*)"', text)
    assert policy is not None
    assert "default-src &#39;none&#39;" in policy[1]
    assert "unsafe" not in policy[1].split("style-src")[0]


@alone
@pytest.mark.parametrize(
    ("results", "words"),
    [
        ("{", "results.json is damaged"),
        ("[]", "results.json is damaged"),
        ({"branches": [{"kind": 1, "harmonic": "a", "rank": 0, "pressures": [1, 2], "values": [None, ""]}]},
         "part of &#39;Eigenvalues&#39; is missing"),
        ({"chart": [{"harmonic": [], "critical_pressure": {}, "kind": 3}, 5]}, "design.toml"),
        ({"lowest": {"behaviour": "falls"}, "meshes": []}, "depends on the mesh"),
        ({"command": "perturb", "history": [{"parameter": 1, "reaction": "", "volume": {}, "time": None}]},
         "Force against distortion"),
        ({"error": "line search failed"}, "The run failed: line search failed."),
    ],
)  # fmt: skip
def test_damaged_results_are_told(tmp_path, results, words):
    """What can be shown is shown, and what cannot is said."""
    assert words in report.write_report(made_up(tmp_path / "run", results)).read_text(encoding="utf-8")


@alone
def test_tables_beside_runs(tmp_path):
    """As the demo leaves them; a damaged file is told, and markup in it stays text."""
    for name in ("one", "two"):
        made_up(
            tmp_path / name, {"command": "critical", "critical_pressure": 3.0, "kind": "sway", "harmonic": 1}
        )
    table = {"caption": "Words", "head": ["paper", EVIL], "rows": [["stable", 1.5], ["soft", None]]}
    told = {"title": "Beside the paper", "note": "Coarse.", "tables": [table]}
    (tmp_path / report.TABLES).write_text(json.dumps(told))
    text = report.write_report(tmp_path).read_text(encoding="utf-8")
    headings = re.findall(r'<h2 id="([\w-]+)"', text)
    assert headings[:3] == ["answer", "compare", "compared"]
    assert '<a href="#run-0">one</a>' in text
    assert text.count("Stable up to") == 4  # a card and a row for each
    assert text.count("not checked on a finer one") == 1  # of both
    assert "Mesh, all" in text
    assert '<tr><th scope="row">stable</th><td class="n">1.5</td></tr>' in text
    assert "<script>alert" not in text
    for damaged in ("[", "[]", "{}", '{"title": "a", "tables": [{"rows": 3}]}', "[" * 9000):
        (tmp_path / report.TABLES).write_text(damaged)
        text = report.write_report(tmp_path).read_text(encoding="utf-8")
        assert "tables.json cannot be read or is damaged" in text
        assert "compared" not in re.findall(r'<h2 id="([\w-]+)"', text)


@alone
@pytest.mark.parametrize(("critical", "marked"), [(120.0, True), (3e5, False)])
def test_a_critical_pressure_far_off_leaves_the_curves_their_room(tmp_path, critical, marked):
    branch = {"kind": "sway", "harmonic": 1, "rank": 0, "pressures": [1.0, 100.0], "values": [1.0, 2.0]}
    folder = made_up(tmp_path / "run", {"branches": [branch], "critical_pressure": critical})
    chart = eigenvalues(run_reader.load_run(folder), lambda step, mode: "")
    assert (chart.mark is not None) == marked
    assert ("The critical pressure, 300 kPa, is far to the right." in chart.description) == (not marked)


@alone
def test_curves_name_the_interval_in_which_the_balloon_becomes_unstable(tmp_path):
    entries = [
        {"pressure": p, "stable": value > 0, "modes": [{"kind": "sway", "harmonic": 1, "real": value}] * 2}
        for p, value in ((100.0, 2.0), (300.0, -1.0), (200.0, 1.0))
    ]
    chart = eigenvalues(
        run_reader.load_run(made_up(tmp_path / "run", {"pressures": entries})),
        lambda step, mode: f"{step}:{mode}",
    )
    assert chart.band[:2] == (200.0, 300.0)
    (curve,) = chart.series
    assert curve.y == [2.0, 1.0, -1.0]  # of a pair one
    assert curve.views == ["0:0", "2:0", "1:0"]  # of the steps as they were given


@alone
def test_round_off_has_no_map(tmp_path):
    """Beside a stress of 1e4 N/m one of 1e-9 is none."""
    folder = made_up(tmp_path / "run", {}, "fields.h5:/x")
    with h5py.File(folder / "fields.h5", "a") as file:
        noise = 1e-9 * np.random.default_rng(1).standard_normal(12)
        file["stress"][...] = np.stack([np.full(12, 1e4), noise, 0 * noise], axis=1)
    (first, *_) = stress_maps(run_reader.load_run(folder))
    assert first.title == "Stress resultants, at 5 Pa (hoop and shear stress is zero)"
    assert "hoop N_h from 0 to 0 N/m" in first.alt


@pytest.mark.slow
@alone
def test_a_modes_number_is_the_tables(tmp_path):
    """Also where not all modes of the table are stored."""
    modes = [{"kind": kind, "harmonic": 1, "real": 2.0, "number": number} for kind, number in [("twist", 9)]]
    results = {"command": "stability", "stored_modes": modes, "shown": {"pressure": 5.0, "modes": []}}
    text = report.write_report(made_up(tmp_path / "run", results, "fields.h5:/x")).read_text(encoding="utf-8")
    assert "Mode 9 at 5 Pa: twist" in text
    assert "Mode 9: twist" in text
    assert "Mode 1" not in text


@alone
def test_folders_that_hold_no_run(tmp_path):
    with pytest.raises(InputError, match="there is no folder"):
        report.write_report(tmp_path / "none")
    with pytest.raises(InputError, match="holds no run"):
        report.write_report(tmp_path)
    newer = made_up(tmp_path / "newer", {"schema": run_reader.SCHEMA + 1})
    with pytest.raises(InputError, match="newer lobefem"):
        report.write_report(newer)
    assert not (newer / report.FILE).exists()
    assert run_reader.SCHEMA == states_command.SCHEMA
    other = made_up(tmp_path / "other", {}, x="fields.h5:/x")
    assert len(run_reader.load_run(other).triangles) == 12
    elsewhere = made_up(tmp_path / "elsewhere", {}, x="/etc/passwd:/x")
    assert "cannot be read" in run_reader.load_run(elsewhere).faults[0]
    with h5py.File(elsewhere / "fields.h5", "a") as file:
        file["x2"] = h5py.ExternalLink(str(other / "fields.h5"), "/x")
    (elsewhere / "fields.xdmf").write_text(_XDMF.format(x="fields.h5:/x2"))
    assert "no data" in run_reader.load_run(elsewhere).faults[0]


@pytest.mark.serial
def test_taut_wrinkled_and_slack():
    """By the number of tensile principal stresses; where a folder holds the film's own shares, by them."""
    stress = np.array([[2.0, 1.0, 0.0], [2.0, 0.0, 0.0], [1.0, 1.0, 1.0], [-1.0, -2.0, 0.0], [1.0, 1.0, 2.0]])
    assert regions(Step(5.0, {}, {"stress_resultants": stress})).tolist() == [2, 1, 1, 0, 1]
    shares = np.array([[0.2, 0.7, 0.1], [0.0, 0.0, 1.0]])
    assert regions(Step(5.0, {}, {"regions": shares})).tolist() == [1, 0]


def test_the_map_has_the_areas_that_the_film_says(shared_path):
    """Told by the stored stresses and by the stored shares; in results.json by the law's test of strains."""
    given = ["--divisions", "6x10", "--film", "tension-field", "--pressure", "5", "--out", str(shared_path)]
    assert cli.main(["inflate", CYLINDER, *given]) == 0
    MPI.COMM_WORLD.Barrier()
    run = run_reader.load_run(shared_path)
    x = run.x[run.triangles]
    area = np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1) / 2
    told = [run.results[f"{name}_area"] for name in ("slack", "wrinkled", "taut")]
    assert min(told[1:]) > 5
    for field in ("stress_resultants", "regions"):
        kinds = regions(Step(5.0, {}, {field: run.steps[0].cells[field]}))
        assert np.bincount(kinds[run.owners], area, minlength=3) == pytest.approx(told, rel=1e-12)


# --- in a browser -------------------------------------------------------------------------------

# Puts the report into a narrow frame and does what a reader does; the harness may look into the frame, the
# report itself needs no such leave. What it finds goes to the console.
_HARNESS = """<!DOCTYPE html><body style="margin:0"><iframe id="f" src="report.html" width="{width}"
height="{height}" style="border:0"></iframe><script>
const frame = document.getElementById("f");
const begin = () => {{
  if (!frame.contentDocument.documentElement.dataset.drawn) return setTimeout(begin, 50);
  const page = frame.contentDocument, at = (id) => page.getElementById(id), canvas = at("view");
  const press = (element, key) =>
    element.dispatchEvent(new frame.contentWindow.KeyboardEvent("keydown", {{ key }}));
  const shown = () => canvas.dataset.shown, look = () => canvas.toDataURL();
  const found = {{ problem: at("problem").textContent, looks: [look()], shown: [shown()] }};
  press(canvas, "ArrowLeft");
  found.looks.push(look());
  page.querySelector("[data-turn=nearer]").click();
  found.looks.push(look());
  found.options = [...at("option").options].map((option) => option.textContent);
  at("option").value = String(found.options.length - 2);
  at("option").dispatchEvent(new frame.contentWindow.Event("change"));
  found.looks.push(look());
  found.shown.push(shown());
  at("state").value = "0";
  at("state").dispatchEvent(new frame.contentWindow.Event("input"));
  found.shown.push(shown());
  const chart = page.querySelector("#main-chart svg");
  found.points = Number(at("main-chart").dataset.points);
  press(chart, "ArrowRight");
  press(chart, "Enter");
  found.shown.push(shown());
  found.tip = page.querySelector(".tip").textContent;
  found.pressed = page.querySelectorAll(".thumb[aria-pressed=true]").length;
  const tables = [...page.querySelectorAll("table")];
  const table = tables.find((one) => one.caption.textContent.startsWith("Eigenvalues:"));
  const details = tables.find((one) => one.caption.textContent.startsWith("Design, all defaults"));
  details.closest("details").open = true;
  const visible = () => [...details.tBodies[0].rows].filter((row) => row.offsetHeight).length;
  found.rows = [visible()];
  details.closest(".table").querySelector(".fold").click();
  found.rows.push(visible());
  const head = [...table.tHead.rows[0].cells].find((cell) => cell.textContent.startsWith("real part"));
  const column = () => [...table.tBodies[0].rows].map((row) => Number(row.cells[head.cellIndex].textContent));
  head.querySelector("button").click();
  found.sorted = column();
  head.querySelector("button").click();
  found.backwards = column();
  at("play").click();
  found.playing = at("play").getAttribute("aria-pressed");
  found.wide = page.documentElement.scrollWidth;
  found.current = page.querySelectorAll("nav a[aria-current]").length;
  const scrolls = [...page.querySelectorAll(".scroll")];
  found.stops = scrolls.filter((one) => one.tabIndex === 0).length;
  found.scrolled = scrolls.filter((one) => one.scrollWidth > one.clientWidth).length;
  setTimeout(() => {{
    found.swung = look();
    at("play").click();
    found.drawn = parseInt(page.documentElement.dataset.drawn);
    found.different = new Set([...found.looks, found.swung]).size;
    delete found.looks;
    delete found.swung;
    console.log("FOUND " + JSON.stringify(found) + " DNUOF");
  }}, 400);
}};
frame.onload = () => setTimeout(begin, 200);
</script>"""


CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


def photograph(url, picture, size, *options):
    """A screenshot by headless Chromium, and what the page's console said.

    On a busy machine Chromium now and then stops for good while it takes a picture: it is asked again.
    """
    for _ in range(3):
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
            command = [
                CHROMIUM, "--headless=new", "--no-sandbox", "--disable-gpu", "--use-angle=swiftshader",
                "--enable-unsafe-swiftshader", f"--user-data-dir={profile}",
                f"--window-size={size[0]},{size[1]}", "--hide-scrollbars", "--enable-logging=stderr",
                "--virtual-time-budget=4000", *options, f"--screenshot={picture}", url,
            ]  # fmt: skip
            started = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True)
            try:
                _, err = started.communicate(timeout=60)
            except subprocess.TimeoutExpired:
                os.killpg(started.pid, signal.SIGKILL)  # its children, too
                started.communicate()
                continue
        return [line for line in err.splitlines() if "CONSOLE" in line]
    pytest.fail("Chromium took no picture in a minute, three times")


@pytest.mark.slow
@alone
@pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium here")
def test_in_a_browser(run):
    """From file://: no script error, the film drawn in 3D, turned by key and button, in the dark too.

    The screenshots stay in build/report, to be looked at.
    """
    kept = ROOT / "build/report"
    kept.mkdir(parents=True, exist_ok=True)
    (run / "harness.html").write_text(_HARNESS.format(width=420, height=2600))
    with ThreadPoolExecutor(2) as pool:
        light = pool.submit(photograph, (run / report.FILE).as_uri(), kept / "light.png", (1000, 3600))
        dark = pool.submit(
            photograph, (run / "harness.html").as_uri(), kept / "dark-narrow.png", (420, 2600),
            "--allow-file-access-from-files", "--blink-settings=preferredColorScheme=0",
        )  # fmt: skip
        said = [*light.result(), *dark.result()]
    for line in said:
        assert not re.search("Uncaught|Error|Refused|violates|Failed", line), line
    told = re.search(r"FOUND (.*) DNUOF", "\n".join(said))
    assert told is not None, said
    found = json.loads(told[1])
    assert found["problem"] == ""
    # the key, the button, another field and the swing have each changed the picture
    assert found["different"] == 5
    assert found["shown"][0].startswith("at 4000 Pa: Modes 1 and 2: sway")
    assert found["shown"][1] == "at 4000 Pa: Taut, wrinkled or slack."
    assert found["shown"][2].startswith("at 2000 Pa: ")
    assert found["options"][0].startswith("Modes 1 and 2: sway, λ = ")
    assert found["options"][-1] == "Shape alone"
    # a point of the chart shows its mode
    assert found["points"] == 4
    assert found["shown"][3] != found["shown"][2]
    assert found["tip"].endswith("click to see it")
    assert found["pressed"] == 1
    assert found["rows"][0] == 5 < found["rows"][1]  # folded at first
    assert found["sorted"] == sorted(found["sorted"])
    assert found["backwards"] == found["sorted"][::-1]
    assert found["playing"] == "true"
    assert found["current"] == 1
    assert found["stops"] == found["scrolled"] < 8  # the tab key stops at tables that do not fit
    assert found["wide"] <= 420  # nothing sticks out of a narrow window
    # the mode is drawn from purple to orange over a page of grey
    pixels = imread(kept / "light.png")[:, 500:, :3]
    orange = (pixels[..., 0] > pixels[..., 2] + 0.2) & (pixels[..., 0] > pixels[..., 1] + 0.05)
    assert orange.sum() > 2000
    assert len(np.unique(np.round(40 * pixels[orange]), axis=0)) > 50
    background = [imread(kept / name)[-1, 1, :3].mean() for name in ("light.png", "dark-narrow.png")]
    assert background[0] > 0.9 > 0.2 > background[1]
