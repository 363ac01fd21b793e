"""What was found before a failure stays, in the results and as a state."""

from pathlib import Path

import pytest

from lobefem.app import critical_command, states_command
from lobefem.errors import EigenError
from lobefem.io.design import Design
from lobefem.stability import harmonic_buckling, modes, nonlinear_buckling

MESHES = Path(__file__).parents[3] / "meshes"


def design(**more):
    tables = {"mesh.divisions": [4, 8], "film.law": "isotropic", "pressure.value": [1000.0, 2000.0]}
    return Design.load(MESHES / "single.toml").with_overrides(tables | more)


def tired(*args, **options):
    raise EigenError("the eigensolver is tired; try coffee")


def test_an_equilibrium_whose_modes_fail(monkeypatch, comm):
    monkeypatch.setattr(modes, "find_modes", tired)
    outcome = states_command.modes(design(), state="inflated", count=2, comm=comm)
    assert isinstance(outcome.error, EigenError)
    (snapshot,) = outcome.snapshots
    assert snapshot.state.pressure == 1000.0
    assert snapshot.state.converged


def test_a_path_whose_modes_fail(monkeypatch, comm):
    monkeypatch.setattr(nonlinear_buckling, "without_turns", tired)
    outcome = critical_command.critical(design(), state="inflated", comm=comm)
    assert isinstance(outcome.error, EigenError)
    (snapshot,) = outcome.snapshots
    assert snapshot.state.converged


@pytest.fixture
def fails_from_two(monkeypatch):
    solve = harmonic_buckling.FixedShapePencil.solve

    def found(self, *args):
        return tired() if self._harmonic >= 2 else solve(self, *args)

    monkeypatch.setattr(harmonic_buckling.FixedShapePencil, "solve", found)


def test_harmonics_before_the_one_that_fails(fails_from_two, comm):
    outcome = critical_command.harmonics(design(), comm=comm)
    assert isinstance(outcome.error, EigenError)
    rows = outcome.results["chart"]
    assert [row["harmonic"] for row in rows] == [0, 1]
    assert all(row["critical_pressure"] > 0 for row in rows)


def test_meshes_before_the_one_that_fails(monkeypatch, comm):
    solve = harmonic_buckling.FixedShapePencil.solve

    def found(self, *args):
        fine = self._sector.order > 14
        return tired() if fine else solve(self, *args)

    monkeypatch.setattr(harmonic_buckling.FixedShapePencil, "solve", found)
    outcome = critical_command.mesh_study(design(), divisions=((4, 12), (5, 14), (6, 16)), comm=comm)
    assert isinstance(outcome.error, EigenError)
    assert [mesh["divisions"] for mesh in outcome.results["meshes"]] == [(4, 12), (5, 14)]
