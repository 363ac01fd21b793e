"""The mesh-study demo on coarse meshes."""

import json

import pytest
from loading import load

from mpi4py import MPI


def test_demo_writes_figures_and_numbers(shared_path):
    demo = load("mesh_study")
    studies = demo.run(((9, 16), (12, 20), (15, 24)), shared_path, comm=MPI.COMM_WORLD)
    assert list(studies) == [
        "single_fixed-wrinkles",
        "stack_fixed-wrinkles",
        "single_isotropic",
        "stack_isotropic",
    ]
    for name, study in studies.items():
        kept = json.loads((shared_path / f"{name}.json").read_text(encoding="utf-8"))
        assert kept["verdict"] == list(study.verdict)
        pressures = [mesh["critical_pressure"] for mesh in kept["meshes"]]
        assert pressures == pytest.approx([chart.pressure for chart in study.charts])
        assert pressures[0] > pressures[1] > pressures[2]
        assert (shared_path / f"{name}.png").read_bytes().startswith(b"\x89PNG")
    # isotropic film is far the stiffer one, and a stack is softer than one lobe
    lowest = {name: study.charts[-1].pressure for name, study in studies.items()}
    assert (
        lowest["single_isotropic"]
        > 10 * lowest["single_fixed-wrinkles"]
        > 10 * lowest["stack_fixed-wrinkles"]
    )
