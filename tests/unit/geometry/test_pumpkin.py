"""Meshes of pumpkins, all gores or one: cyclic, mirror-symmetric, named, turned outwards."""

import math

import numpy as np
import pytest
from builders import pumpkin

from lobefem.errors import InputError
from lobefem.geometry.gore import ConstantAngle, Gore
from lobefem.geometry.pumpkin import PumpkinRecipe
from lobefem.geometry.pumpkin_curve import PumpkinCurve
from lobefem.linalg import dolfinx_compat

import ufl
from dolfinx import fem
from mpi4py import MPI

GORES = 8
CURVE = PumpkinCurve(5.0, (0.2, 0.4))
GORE = Gore(CURVE, GORES, ConstantAngle(math.radians(50)))
KINDS = [(cell, order) for cell in ("triangle", "quadrilateral") for order in (1, 2)]


def recipe(cell="quadrilateral", order=1, **given):
    return PumpkinRecipe(GORE, (6, 4), cell, order, **given)


def rotation(angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


@pytest.mark.parametrize(("cell", "order"), KINDS)
@pytest.mark.parametrize("grading", [0.0, 0.8])
def test_a_gore_is_its_mirror_image_and_ends_at_its_own_next(cell, order, grading):
    grid = recipe(cell, order, grading=grading).grid
    x = GORE.position(grid.s, grid.xi).reshape(grid.rows, grid.columns, 3)
    near, far = x[:, 0], x[:, -1]
    np.testing.assert_allclose(far, near @ rotation(2 * math.pi / GORES).T, atol=1e-14 * 5)
    turned = x @ rotation(-math.pi / GORES).T  # the middle in the plane y = 0
    np.testing.assert_allclose(turned[:, ::-1] * [1, -1, 1], turned, atol=1e-14 * 5)
    mirrored = np.arange(grid.rows)[:, None] * grid.columns + np.arange(grid.columns)[::-1]
    cells = {frozenset(nodes) for nodes in grid.cells.tolist()}
    assert {frozenset(mirrored.ravel()[list(nodes)].tolist()) for nodes in cells} == cells
    assert len(cells) == 6 * 4 * (2 if cell == "triangle" else 1)
    assert sorted(set(grid.cells.ravel())) == list(range(grid.rows * grid.columns))


def test_rows_are_closer_at_the_fittings_of_a_graded_grid():
    even, graded = (np.unique(recipe(grading=g).grid.s) for g in (0.0, 0.8))
    np.testing.assert_allclose(np.diff(even), CURVE.arc_length / 6)
    steps = np.diff(graded)
    np.testing.assert_allclose(steps, steps[::-1])
    assert steps[0] < 0.5 * steps[2]
    assert (graded[0], graded[-1]) == pytest.approx((0, CURVE.arc_length))


def lengths(surface, name, whole):
    """Length of an edge group of a surface (its own if it is not the whole balloon's)."""
    tag = surface.groups[name][1]
    kinds = [ufl.Measure(k, domain=surface.mesh, subdomain_data=surface.edges)(tag) for k in ("ds", "dS")]
    one = fem.Constant(surface.mesh, 1.0)
    found = sum(fem.assemble_scalar(dolfinx_compat.form(f)) for f in (one * kinds[0], one("+") * kinds[1]))
    return surface.mesh.comm.allreduce(found, op=MPI.SUM) if whole else found


@pytest.mark.parametrize("full", [False, True])
@pytest.mark.parametrize(("cell", "order"), KINDS)
def test_names_of_gores_tendons_and_fittings(comm, cell, order, full):
    surface = recipe(cell, order, full=full).surface(comm)
    gores = GORES if full else 1
    assert (surface.copies, surface.cyclic_order) == ((1, 8) if full else (8, 8))
    names = {f"gore_{k + 1}" for k in range(gores)} | {f"tendon_{k + 1}" for k in range(8 if full else 2)}
    assert names | {"apex", "nadir", "rim_top", "rim_bottom"} == set(surface.groups)
    close = 3e-2 if order == 1 else 1e-3
    for k in range(1, (GORES if full else 2) + 1):
        assert lengths(surface, f"tendon_{k}", full) == pytest.approx(CURVE.arc_length, rel=close)
    # a fitting's edge is the gores' arcs over their chords
    chord = gores * 2 * np.sin(np.pi / 8) * np.array(CURVE.fitting_radii)
    arc = chord * math.radians(50) / math.sin(math.radians(50))
    found = [lengths(surface, name, full) for name in ("nadir", "apex")]
    np.testing.assert_allclose(found, arc, rtol=1e-2 if order == 1 else 1e-4)
    # cells of gore k lie between its tendons
    tags = surface.lobes
    midpoints = dolfinx_compat.geometry_dofmap(surface.mesh)[tags.indices]
    place = surface.mesh.geometry.x[midpoints].mean(axis=1)
    azimuth = np.arctan2(place[:, 1], place[:, 0]) % (2 * math.pi)
    np.testing.assert_array_equal(azimuth // (math.pi / 4) + 1, tags.values)


@pytest.mark.parametrize("full", [False, True])
@pytest.mark.parametrize(("cell", "order"), KINDS)
def test_normals_point_outwards(comm, cell, order, full):
    surface = recipe(cell, order, full=full).surface(comm)
    x, n = ufl.SpatialCoordinate(surface.mesh), ufl.CellNormal(surface.mesh)
    place = x - ufl.as_vector([0.0, 0.0, CURVE.height / 2])
    V = fem.functionspace(surface.mesh, ("DG", 0))
    outward = fem.Function(V)
    outward.interpolate(fem.Expression(ufl.dot(place, n), dolfinx_compat.interpolation_points(V.element)))
    assert outward.x.array.min() > 0


@pytest.mark.parametrize(("cell", "order"), KINDS)
def test_volume_is_that_of_the_drawn_balloon(comm, cell, order):
    """x . n da/3 over the exact surface of the gores and over the top fitting."""
    balloon = pumpkin(comm, gores=8, angle=50, divisions=(24, 8), cell=cell, order=order, full=True)
    gore = balloon.surface.recipe.gore
    s, xi = np.linspace(0, gore.curve.arc_length, 801), np.linspace(-1, 1, 401)
    x = gore.position(np.repeat(s, 401), np.tile(xi, 801)).reshape(801, 401, 3)
    a, b, c, d = x[:-1, :-1], x[:-1, 1:], x[1:, :-1], x[1:, 1:]
    film = 8 * np.abs((np.cross(d - a, c - b) * (a + b + c + d)).sum() / 24)
    ring = x[-1]  # the bottom one lies about z = 0
    flat = 8 * (ring[:-1, 0] * ring[1:, 1] - ring[1:, 0] * ring[:-1, 1]).sum() / 2
    volume = film + ring[:, 2].mean() * flat / 3
    assert balloon.reference_volume == pytest.approx(volume, rel=2e-2 if order == 1 else 1e-3)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"cell": "hexagon"}, "hexagon"),
        ({"order": 3}, "order is 3; give 1 or 2"),
        ({"divisions": (3, 4)}, "give 4 rows"),
        ({"divisions": (8, 3), "cell": "triangle"}, "even number of columns"),
        ({"grading": 1.0}, r"grading = 1.0 must lie in \[0, 0.95\]"),
    ],
)
def test_what_is_refused(given, words):
    with pytest.raises(InputError, match=words):
        PumpkinRecipe(GORE, **given)
