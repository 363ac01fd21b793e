"""The mesh-study demo on coarse meshes."""

import importlib.util
import json
import sys
from pathlib import Path

import pytest
from mpi4py import MPI

DEMO = Path(__file__).parents[1] / "demos" / "mesh_study.py"


def test_demo_writes_figures_and_numbers(shared_path):
    spec = importlib.util.spec_from_file_location("demo_mesh_study", DEMO)
    demo = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = demo
    spec.loader.exec_module(demo)
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
