"""results.json holds what its documentation says, and nothing else."""

import json
from pathlib import Path

import pytest

from lobefem.app import cli, sweep_command
from lobefem.app.sweep_file import Point, Study
from lobefem.io import result_keys

pytestmark = pytest.mark.serial

ROOT = Path(__file__).parents[3]
SINGLE, STACK, CYLINDER, PUMPKIN = (
    f"{ROOT}/meshes/{name}.toml" for name in ("single", "stack4", "cylinder", "pumpkin")
)
TENSION = ("--film", "tension-field", "--support", "fixed")
MANY = (
    PUMPKIN, "--divisions", "8x2", "--set", "shape.gores=160", "--set", "film.density=1", "--up-to", "300",
    "--set", "tendons.mass_per_length=0", "--set", 'shape.reference="lobe"',
)  # fmt: skip
RUNS = [
    ("inflate", SINGLE, "--divisions", "4x8", "--profile"),
    ("inflate", PUMPKIN, "--divisions", "8x4"),
    ("modes", PUMPKIN, "--divisions", "8x4", "--harmonics", "0:2", "--count", "1"),
    ("critical", *MANY, "--harmonic", "4", "--set", "film.strength=1e8"),
    ("harmonics", *MANY, "--harmonics", "3:4", "--set", "film.strength=1e8"),
    ("inflate", CYLINDER, "--divisions", "4x8", "--slack-stiffness", "0"),  # fails
    ("modes", SINGLE, "--divisions", "4x8", "--count", "1", "--pressure", "5", "--pressure", "6", *TENSION),
    ("critical", SINGLE, "--divisions", "4x8", *TENSION, "--set", "film.strength=1e8"),
    ("critical", SINGLE, "--divisions", "4x8", "--state", "inflated", "--limit", "10", "--what-if"),
    ("critical", SINGLE, "--mesh-study", "--meshes", "4x12,4x14,4x16"),
    ("critical", SINGLE, "--mesh-study", "--meshes", "4x8,6x12,8x16", "--state", "inflated", "--limit", "10"),
    ("modes", SINGLE, "--mesh-study", "--meshes", "4x8,6x12,8x16", "--count", "1", "--pressure", "5"),
    ("harmonics", SINGLE, "--divisions", "4x8", *TENSION),
    ("sensitivities", PUMPKIN, "--divisions", "8x2", "--set", "shape.gores=96", "--harmonic", "4"),
    ("perturb", STACK, "--divisions", "4x6", "--lobes", "2", "--film", "tension-field", "--load", "closed",
     "--pressure", "5", "--tip-displacement", "0.01", "--steps", "1", "--no-contact"),
    ("perturb", PUMPKIN, "--divisions", "4x2", "--order", "1", "--set", "shape.gores=8", "--cleft", "--set",
     "cleft.gores=2", "--release", "--steps", "1"),
]  # fmt: skip


@pytest.mark.slow
def test_every_key_is_described_and_every_description_has_its_key(comm, shared_path):
    file = shared_path / "results.json"
    used = set()
    found = [_sweep()]
    for arguments in RUNS:
        cli.main([*arguments, "--quiet", "--json", str(file)])
        comm.Barrier()
        found.append(json.loads(file.read_text()))
        comm.Barrier()
    for results in found:
        command = results["command"]
        for key in result_keys.flat(results):
            name = result_keys.described(command, key)
            assert name is not None, f"{key} of {command} is not described in lobefem/io/*_keys.py"
            used.add(name if name in result_keys.COMMON else (command, name))
    known = {*result_keys.COMMON, *((c, name) for c, keys in result_keys.COMMANDS.items() for name in keys)}
    assert known == used


def _sweep():
    point = Point({"film.law": "isotropic"}, "inflate", (), "")
    study = Study("inflate", ("film.law",), (point,), "")
    row = sweep_command.Row(point.values, "points/one", 0, "", 1.0, {"volume": 1.0})
    meshes = [{"divisions": f"{n}x{n}"} for n in (4, 6, 9)]
    points = tuple(Point(values, "critical", (), "") for values in meshes)
    rows = [
        sweep_command.Row(values, "points/one", 0, "", 1.0, {"critical_pressure": 5.0}) for values in meshes
    ]
    of_meshes = sweep_command.results(Study("critical", ("divisions",), points, ""), rows)
    return of_meshes | sweep_command.results(study, [row])


def test_the_documentation_has_the_tables():
    page = (ROOT / "docs" / "howto" / "keys.md").read_text(encoding="utf-8")
    assert result_keys.markdown() in page, (
        "put the text of lobefem.io.result_keys.markdown() into docs/howto/keys.md"
    )
