"""Never a wrong number: what succeeds obeys the laws that need no reference.

Lengths times s leave a balloon's shape, and its stress where the pressure stays; stiffness and pressure
times k leave all of its displacements.
"""

import math

import pytest
from broken import cases
from hypothesis import strategies as st

from lobefem.app import critical_command, states_command
from lobefem.errors import InputError, SolveError
from lobefem.io.design import Design

from mpi4py import MPI

pytestmark = pytest.mark.serial

FINE = 1e-6


@st.composite
def designs(draw):
    """A sound design of a coarse mesh, with numbers far from the paper's."""
    law = draw(st.sampled_from(["isotropic", "fixed-wrinkles", "tension-field"]))
    kind = draw(st.sampled_from(["isotensoid", "isotensoid", "cylinder"]))
    support = draw(st.sampled_from(["clamped", "pinned", "fixed"]))
    size = 10 ** draw(st.floats(-2, 2))
    shape = {"kind": kind}
    if kind == "cylinder":
        shape |= {"radius": size, "length": size * draw(st.floats(0.5, 3))}
    else:
        shape |= {"edge_radius": size, "truncation": draw(st.floats(0.2, 0.59))}
        shape |= {"lobes": draw(st.integers(1, 2))}
    film = {
        "law": law,
        "E": 10 ** draw(st.floats(6, 11)),
        "nu": draw(st.floats(0, 0.49)),
        "thickness": size * 10 ** draw(st.floats(-5, -3)),
        "slack_stiffness": 0.0 if law == "isotropic" else 10 ** draw(st.floats(-5, -2)),
    }
    if kind != "cylinder":
        film["prestress"] = draw(st.booleans())
    # strains of a millionth to a hundredth
    pressure = film["E"] * film["thickness"] / size * 10 ** draw(st.floats(-6, -2))
    plates = {"support": support, "bar": draw(st.sampled_from([True, False]))}
    if support == "fixed":
        plates["lift"] = size * draw(st.sampled_from([0.0, 1e-3]))
    return {
        "shape": shape,
        "mesh": {"divisions": [4, 6], "cell": draw(st.sampled_from(["triangle", "quadrilateral"]))},
        "film": film,
        "hoops": {"EA": film["E"] * film["thickness"] * size * 10 ** draw(st.floats(-1, 3))},
        "plates": plates,
        "pressure": {"load": draw(st.sampled_from(["film", "closed"])), "value": pressure},
    }


POWERS = {  # of length and of stress
    ("shape", "radius"): (1, 0), ("shape", "length"): (1, 0), ("shape", "edge_radius"): (1, 0),
    ("film", "E"): (0, 1), ("film", "thickness"): (1, 0), ("hoops", "EA"): (2, 1), ("plates", "lift"): (1, 0),
    ("pressure", "value"): (0, 1),
}  # fmt: skip


def scaled(tables, s, k):
    """The same balloon of lengths times s and stresses times k."""
    return {
        section: {
            key: value * s ** POWERS[section, key][0] * k ** POWERS[section, key][1]
            if (section, key) in POWERS
            else value
            for key, value in keys.items()
        }
        for section, keys in tables.items()
    }


def outcome(task, tables, **options):
    """What a task finds, or the sentence in which it gives up."""
    try:
        found = task(Design.parse(tables), comm=MPI.COMM_WORLD, **options)
    except (InputError, SolveError) as error:
        return str(error)
    return found.results if found.error is None else str(found.error)


def alike(found, expected, size):
    assert found == pytest.approx(expected, rel=FINE, abs=FINE * size)


@cases(0.02, 3, tables=designs(), factors=st.sampled_from([(1e-3, 1.0), (1.0, 1e3), (70.0, 0.03)]))
def test_an_equilibrium_obeys_its_scales(tables, factors):
    s, k = factors
    one, other = (outcome(states_command.inflate, t) for t in (tables, scaled(tables, s, k)))
    if isinstance(one, str) or isinstance(other, str):  # near a limit round-off may decide
        return
    size = _size(tables)
    for found in (one, other):
        assert found["converged"]
        assert found["volume"] > 0
        assert found["relative_residual"] < 1e-6
    whole = one["taut_area"] + one["wrinkled_area"] + one["slack_area"]
    for key in ("taut_area", "wrinkled_area", "slack_area"):
        assert math.isfinite(one[key])
        # a cell whose strain is zero but for round-off may be counted here or there
        assert other[key] / s**2 == pytest.approx(one[key], abs=0.05 * whole)
    alike(other["volume"] / s**3, one["volume"], 0)
    alike(other["max_displacement"] / s, one["max_displacement"], 1e-8 / FINE * size)
    force = tables["pressure"]["value"] * size**2
    if one["bar_force"] is not None:
        alike(other["bar_force"] / (s**2 * k), one["bar_force"], force)
    for a, b in zip(one["hoop_tension"], other["hoop_tension"], strict=True):
        alike(b / (s**2 * k), a, force)
    if one["strain_energy"] is not None:
        alike(other["strain_energy"] / (s**3 * k), one["strain_energy"], abs(one["strain_energy"]))


@cases(0.01, 2, tables=designs(), factors=st.sampled_from([(1e-2, 1.0), (1.0, 1e3), (50.0, 0.2)]))
def test_eigenvalues_and_critical_pressures_obey_their_scales(tables, factors):
    s, k = factors
    if tables["shape"]["kind"] == "cylinder":
        return
    for task, read, unit in (
        (states_command.modes, lambda r: r["pressures"][0]["modes"][0]["real"], k / s),
        (critical_command.critical, lambda r: r["critical_pressure"], k),
    ):
        options = {"count": 2} if task is states_command.modes else {}
        one, other = (outcome(task, t, **options) for t in (tables, scaled(tables, s, k)))
        if isinstance(one, str) or isinstance(other, str):
            continue
        a, b = read(one), read(other)
        if a is None or b is None:
            assert a == b
            continue
        assert b / unit == pytest.approx(a, rel=1e-5, abs=1e-6 * tables["pressure"]["value"] / _size(tables))


def _size(tables):
    return tables["shape"].get("edge_radius") or tables["shape"]["radius"]
