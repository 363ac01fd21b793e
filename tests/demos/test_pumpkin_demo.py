"""The pumpkin demo on a coarse mesh."""

import argparse
import json

import pytest
from loading import load

from mpi4py import MPI


def test_demo_writes_chart_table_and_picture(shared_path):
    demo = load("pumpkin")
    numbers = demo.run((24, 4), out=shared_path, gores=(96, 160), comm=MPI.COMM_WORLD)
    assert numbers["meshes"] == [[12, 2], [18, 3], [24, 4]]
    few, many = numbers["balloons"]
    # what other programs find in the limit; of so coarse meshes a tenth is asked
    assert few["limit"] == pytest.approx(804, rel=0.1)
    assert many["limit"] == pytest.approx(88, rel=0.1)
    assert few["harmonic"] == many["harmonic"] == 3
    for row in (few, many):
        coarse, middle, fine = row["pressures"]
        assert coarse > middle > fine > row["limit"]
    assert numbers["exponents"] == [pytest.approx(-4.33, abs=0.1)]
    assert json.loads((shared_path / "pumpkin.json").read_text()) == numbers
    assert (shared_path / "pumpkin.png").read_bytes().startswith(b"\x89PNG")
    assert (shared_path / "table.md").read_text().count("| 3 |") == 2
    assert demo.can_render() == (shared_path / "mode.png").exists()


def test_limit_has_an_order_and_meshes_nest():
    demo = load("pumpkin")
    sizes = demo.meshes((48, 8))
    assert sizes == [(24, 4), (36, 6), (48, 8)]
    found = demo.limit(sizes, [5 + 9000 / along**3 for along, _ in sizes])
    assert (found.limit, found.order) == (pytest.approx(5), pytest.approx(3))
    assert demo.limit(sizes, [5.0, None, None]).behaviour == "open"
    with pytest.raises(argparse.ArgumentTypeError, match="30x8: give multiples of four"):
        demo.meshes((30, 8))
