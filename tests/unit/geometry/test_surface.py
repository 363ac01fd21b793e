"""Meshes of the film: exact nodes, outward cells, named parts, the same on any number of ranks."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import KDTree

from lobefem.errors import InputError
from lobefem.geometry.flat_cylinder import Cylinder
from lobefem.geometry.isotensoid import Isotensoid
from lobefem.geometry.stacks import StackRecipe, coarser, cylinder, lobed_cylinder, sector_of
from lobefem.linalg.dolfinx_compat import entity_nodes, geometry_dofmap

import ufl
from dolfinx import fem
from mpi4py import MPI

KINDS = [
    pytest.param(dict(cell=cell, order=order, **layout), id=f"{name}-{cell}-{order}")
    for name, layout in (
        ("structured", {"layout": "structured", "divisions": (8, 14)}),
        ("unstructured", {"layout": "unstructured", "size": 0.7}),
    )
    for cell in ("triangle", "quadrilateral")
    for order in (1, 2)
]


def integrate(surface, integrand):
    comm = surface.mesh.comm
    return comm.allreduce(fem.assemble_scalar(fem.form(integrand)), op=MPI.SUM)


def volume(surface):
    """Enclosed by the film and a flat plate on each rim: div (x, y, 0) / 2 = 1, plates add none."""
    x, n = ufl.SpatialCoordinate(surface.mesh), ufl.CellNormal(surface.mesh)
    return integrate(surface, (x[0] * n[0] + x[1] * n[1]) / 2 * ufl.dx)


def degree(surface):
    return surface.mesh.ufl_domain().ufl_coordinate_element().basix_element.degree


def area(surface):
    return integrate(surface, fem.Constant(surface.mesh, 1.0) * ufl.dx)


def edge_length(surface, name):
    dim, value = surface.groups[name]
    assert dim == 1
    measure = ufl.Measure(
        "dS" if name.startswith("seam") else "ds", surface.mesh, subdomain_data=surface.edges
    )
    return integrate(surface, fem.Constant(surface.mesh, 1.0) * measure(value))


def count(surface, name):
    """Cells or facets of a group, each counted on its owner."""
    dim, value = surface.groups[name]
    tags = surface.lobes if dim == 2 else surface.edges
    owned = surface.mesh.topology.index_map(dim).size_local
    return surface.mesh.comm.allreduce(int(np.sum(tags.find(value) < owned)), op=MPI.SUM)


def gathered_nodes(surface):
    """Every node's position by the number it was handed over with, on every rank."""
    geometry = surface.mesh.geometry
    pieces = surface.mesh.comm.allgather((np.asarray(geometry.input_global_indices), geometry.x))
    x = np.full((1 + max(int(number.max()) for number, _ in pieces), 3), np.nan)
    for number, part in pieces:
        x[number] = part
    assert not np.isnan(x).any()
    return x


def gathered_cells(surface):
    """Owned cells as tuples of the numbers their nodes were handed over with, on every rank."""
    mesh = surface.mesh
    owned = mesh.topology.index_map(2).size_local
    cells = np.asarray(mesh.geometry.input_global_indices)[geometry_dofmap(mesh)[:owned]]
    return np.concatenate(mesh.comm.allgather(cells))


def rotation(angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def arc_from_height(shape, z):
    """Arc length from mid-height by Newton's method."""
    table = shape.stations(64)
    s = np.interp(z, shape.z(table), table)
    for _ in range(8):
        s = np.clip(s - (shape.z(s) - z) / shape.slope(s)[1], table[0], table[-1])
    return s


# --- what every kind of mesh must satisfy ------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_nodes_lie_on_the_exact_surface(comm, kind):
    surface = lobed_cylinder(2, comm=comm, **kind)
    shape, x = surface.shape, surface.mesh.geometry.x
    assert degree(surface) == kind["order"]
    local = np.where(x[:, 2] < shape.height, x[:, 2], x[:, 2] - shape.height) - shape.half_height
    R = shape.radius(arc_from_height(shape, local))
    np.testing.assert_allclose(np.hypot(x[:, 0], x[:, 1]), R, rtol=1e-12)


def nodes_of(surface, name):
    """Nodes of this rank that belong to the facets of a group."""
    facets = surface.edges.find(surface.groups[name][1])
    return np.unique(entity_nodes(surface.mesh, 1, facets))


@pytest.mark.parametrize("kind", KINDS)
def test_rims_and_seams_are_named_circles(comm, kind):
    surface = lobed_cylinder(3, comm=comm, **kind)
    rings = ["rim_bottom", "seam_1", "seam_2", "rim_top"]
    assert sorted(surface.groups) == sorted([*rings, "lobe_1", "lobe_2", "lobe_3"])
    for k, name in enumerate(rings):
        N = count(surface, name)
        if kind["layout"] == "structured":
            assert N == 14
        nodes = surface.mesh.geometry.x[nodes_of(surface, name)]
        np.testing.assert_allclose(nodes[:, 2], k * surface.shape.height, atol=1e-14)
        np.testing.assert_allclose(np.hypot(*nodes.T[:2]), surface.shape.edge_radius, rtol=1e-14)
        # `dS` and `ds` see all of the edge, each facet once: the perimeter of an inscribed polygon
        length = edge_length(surface, name)
        if kind["order"] == 1 and kind["layout"] == "structured":
            assert length == pytest.approx(2 * N * 2.0 * math.sin(math.pi / N), rel=1e-12)
        else:
            tolerance = (math.pi / N) ** 2 / 5 if kind["order"] == 1 else 0.2 * (math.pi / N) ** 4
            assert length == pytest.approx(4 * math.pi, rel=tolerance)
            assert length < 4 * math.pi


@pytest.mark.parametrize("kind", KINDS)
def test_every_cell_looks_outwards_and_belongs_to_its_lobe(comm, kind):
    surface = lobed_cylinder(2, comm=comm, **kind)
    mesh = surface.mesh
    space = fem.functionspace(mesh, ("DG", 0))
    x, n, test = ufl.SpatialCoordinate(mesh), ufl.CellNormal(mesh), ufl.TestFunction(space)
    radius = ufl.sqrt(x[0] ** 2 + x[1] ** 2)
    size = fem.assemble_vector(fem.form(test * ufl.dx)).array
    outwards = fem.assemble_vector(fem.form(test * (x[0] * n[0] + x[1] * n[1]) / radius * ufl.dx))
    owned = mesh.topology.index_map(2).size_local
    # the exact normal has sin(phi) = 0.2757 of itself along the radius at an edge, more elsewhere
    assert np.all(outwards.array[:owned] > 0.2 * size[:owned])
    assert volume(surface) > 0

    middle = mesh.geometry.x[geometry_dofmap(mesh)].mean(axis=1)[:, 2]
    cells = np.arange(len(middle))  # ghosts too
    np.testing.assert_array_equal(surface.lobes.indices, cells)
    np.testing.assert_array_equal(surface.lobes.values, 1 + (middle > surface.shape.height))
    total = mesh.topology.index_map(2).size_global
    assert count(surface, "lobe_1") + count(surface, "lobe_2") == total
    if kind["layout"] == "structured":
        assert total == 2 * 8 * 14 * (2 if kind["cell"] == "triangle" else 1)


@pytest.mark.parametrize("kind", KINDS)
def test_a_mesh_is_the_same_on_any_number_of_ranks(comm, kind):
    shared = lobed_cylinder(2, comm=comm, **kind)
    alone = lobed_cylinder(2, comm=MPI.COMM_SELF, **kind)
    # one rank's mesh of its own comes from its own run of Gmsh
    np.testing.assert_allclose(gathered_nodes(shared), gathered_nodes(alone), rtol=0, atol=1e-14)
    np.testing.assert_array_equal(
        np.unique(gathered_cells(shared), axis=0), np.unique(gathered_cells(alone), axis=0)
    )
    assert volume(shared) == pytest.approx(volume(alone), rel=1e-13)
    assert area(shared) == pytest.approx(area(alone), rel=1e-13)
    assert edge_length(shared, "seam_1") == pytest.approx(edge_length(alone, "seam_1"), rel=1e-13)
    for name in alone.groups:
        assert count(shared, name) == count(alone, name)


@pytest.mark.parametrize("cell", ["triangle", "quadrilateral"])
@pytest.mark.parametrize(("order", "expected"), [(1, 2.0), (2, 4.0)])
def test_structured_volume_and_area_converge(comm, cell, order, expected):
    errors = []
    for along in (6, 12, 24):
        divisions = (along, 4 * along // 3)
        s = lobed_cylinder(1, divisions, cell=cell, order=order, comm=comm)
        errors.append([abs(volume(s) - s.shape.volume), abs(area(s) - s.shape.area)])
    rates = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    np.testing.assert_allclose(rates[-1], expected, atol=0.1)


@pytest.mark.slow
@pytest.mark.serial
@pytest.mark.parametrize("cell", ["triangle", "quadrilateral"])
@pytest.mark.parametrize(("order", "expected"), [(1, 2.0), (2, 4.0)])
def test_unstructured_volume_and_area_converge(comm, cell, order, expected):
    errors = []
    for size in (0.8, 0.2):
        s = lobed_cylinder(1, layout="unstructured", size=size, cell=cell, order=order, comm=comm)
        errors.append([abs(volume(s) - s.shape.volume), abs(area(s) - s.shape.area)])
    rates = np.log(np.array(errors[0]) / np.array(errors[1])) / math.log(4.0)
    np.testing.assert_allclose(rates, expected, atol=0.4)


# --- structured --------------------------------------------------------------------------------


def test_the_papers_stack_has_the_published_volumes(comm):
    surface = lobed_cylinder(comm=comm)
    assert 4 * surface.shape.volume == pytest.approx(595.64, abs=5e-3)
    assert volume(surface) == pytest.approx(590.74, abs=5e-3)  # that of the facets (docs/validation.md)
    # the flat facets of a row are the sides of a frustum of a 32-sided pyramid
    R = surface.shape.radius(surface.shape.stations(24))
    dz = np.diff(surface.shape.z(surface.shape.stations(24)))
    polygon = 16 * math.sin(2 * math.pi / 32)
    frusta = polygon * dz / 3 * (R[1:] ** 2 + R[1:] * R[:-1] + R[:-1] ** 2)
    assert volume(surface) == pytest.approx(4 * frusta.sum(), rel=1e-12)
    assert surface.divisions == (24, 32)
    assert surface.cyclic_order == 32
    assert surface.num_lobes == 4
    assert surface.groups["rim_bottom"] == (1, 201)
    assert surface.groups["seam_3"] == (1, 103)
    np.testing.assert_array_equal(surface.axis, [0, 0, 1])


@pytest.mark.parametrize(("cell", "order"), [("triangle", 1), ("triangle", 2), ("quadrilateral", 2)])
@pytest.mark.parametrize("around", [3, 8, 37])
def test_structured_nodes_lie_on_exact_stations(comm, cell, order, around):
    along, lobes = 5, 2
    surface = lobed_cylinder(lobes, (along, around), cell=cell, order=order, comm=comm)
    rows, columns = np.indices((order * along * lobes + 1, order * around)).reshape(2, -1)
    stations = surface.shape.stations(order * along)
    lobe = np.minimum(rows // (order * along), lobes - 1)
    s = stations[rows - lobe * order * along]
    theta = 2 * math.pi * columns / (order * around)
    R = surface.shape.radius(s)
    z = surface.shape.z(s) + (lobe + 0.5) * surface.shape.height
    expected = np.column_stack((R * np.cos(theta), R * np.sin(theta), z))
    nodes = gathered_nodes(surface)
    assert len(nodes) == len(expected)  # neither missing nor orphan nodes
    distance, nearest = KDTree(expected).query(nodes)
    assert distance.max() < 1e-13
    assert len(np.unique(nearest)) == len(nodes)
    if order == 1:  # numbered row by row
        np.testing.assert_array_equal(nearest, np.arange(len(nodes)))


@pytest.mark.parametrize(
    ("options", "sectors"),
    [
        ({}, 12),
        ({"diagonals": "alternating"}, 6),
        ({"cell": "quadrilateral"}, 12),
        ({"order": 2}, 12),
        ({"cell": "quadrilateral", "order": 2}, 12),
    ],
)
def test_structured_mesh_is_cyclic(comm, options, sectors):
    """Turned by one sector, nodes fall on nodes and cells on cells, corner on corner."""
    surface = lobed_cylinder(2, (4, 12), comm=comm, **options)
    assert surface.cyclic_order == sectors
    x, cells = gathered_nodes(surface), gathered_cells(surface)
    turn = 2 * math.pi / sectors
    distance, image = KDTree(x).query(x @ rotation(turn).T)
    assert distance.max() < 1e-14
    np.testing.assert_array_equal(np.unique(image[cells], axis=0), np.unique(cells, axis=0))
    # and no smaller turn will do
    half = KDTree(x).query(x @ rotation(turn / 2).T)[1]
    assert not np.array_equal(np.unique(half[cells], axis=0), np.unique(cells, axis=0))


def diagonals_of(surface, N):
    """(row, column, rising) of every cell's edge between unlike rows and columns."""
    found = set()
    for cell in gathered_cells(surface):
        rows, columns = np.divmod(cell, N)
        for a in range(3):
            for b in range(3):
                step = (columns[b] - columns[a]) % N
                if rows[b] == rows[a] + 1 and step in (1, N - 1):
                    rising = step == 1
                    left = columns[a] if rising else columns[b]
                    found.add((int(rows[a]), int(left), bool(rising)))
    return found


def test_same_diagonals_run_from_a_to_c(comm):
    surface = lobed_cylinder(2, (3, 8), comm=comm)
    assert diagonals_of(surface, 8) == {(i, j, True) for i in range(6) for j in range(8)}
    cells = {tuple(map(int, c)) for c in gathered_cells(surface)}
    assert cells == {
        triangle
        for i in range(6)
        for j in range(8)
        for A, B, C, D in [(i * 8 + j, i * 8 + (j + 1) % 8, (i + 1) * 8 + (j + 1) % 8, (i + 1) * 8 + j)]
        for triangle in [(A, B, C), (A, C, D)]
    }


def test_alternating_diagonals_change_from_cell_to_cell(comm):
    surface = lobed_cylinder(2, (3, 8), diagonals="alternating", comm=comm)
    expected = {(i, j, (i + j) % 2 == 0) for i in range(6) for j in range(8)}
    assert diagonals_of(surface, 8) == expected


@pytest.mark.slow
@pytest.mark.serial
@pytest.mark.parametrize("truncation", [0.05, 0.3, 0.599])
@pytest.mark.parametrize("layout", [{"divisions": (6, 10)}, {"layout": "unstructured", "size": 0.3}])
def test_any_truncation_can_be_meshed(comm, truncation, layout):
    shape = Isotensoid.from_edge_radius(1.0, truncation)
    if "size" in layout:
        layout = {**layout, "size": 0.05 * shape.R0 if truncation > 0.1 else 0.2}
    surface = lobed_cylinder(2, shape=shape, order=2, comm=comm, **layout)
    assert volume(surface) == pytest.approx(2 * shape.volume, rel=2e-3)
    assert area(surface) == pytest.approx(2 * shape.area, rel=2e-3)


@pytest.mark.slow
def test_more_than_a_hundred_lobes_keep_their_groups_apart(comm):
    surface = lobed_cylinder(103, (2, 4), comm=comm)
    assert len(set(surface.groups.values())) == len(surface.groups) == 103 + 102 + 2
    assert count(surface, "seam_101") == count(surface, "rim_bottom") == 4
    assert edge_length(surface, "seam_102") == pytest.approx(8 * math.sqrt(2.0), rel=1e-12)


# --- the flat cylinder -------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_flat_cylinder(comm, kind):
    surface = cylinder(comm=comm, **kind)
    assert surface.shape == Cylinder(2.0, 4.2)
    assert sorted(surface.groups) == ["lobe_1", "rim_bottom", "rim_top"]
    x = surface.mesh.geometry.x
    np.testing.assert_allclose(np.hypot(x[:, 0], x[:, 1]), 2.0, rtol=1e-14)
    N = count(surface, "rim_top")
    assert count(surface, "rim_bottom") == N
    if kind["order"] == 1 and kind["layout"] == "structured":  # a prism on a regular polygon
        assert area(surface) == pytest.approx(4.2 * 4 * N * math.sin(math.pi / N), rel=1e-12)
        assert volume(surface) == pytest.approx(4.2 * 2 * N * math.sin(2 * math.pi / N), rel=1e-12)
    else:
        # an inscribed polygon's area falls short by (2 pi / N)^2 / 6
        rel = 1.3 * (2 * math.pi / N) ** 2 / 6 if kind["order"] == 1 else 1e-3
        assert volume(surface) == pytest.approx(surface.shape.volume, rel=rel)
        assert area(surface) == pytest.approx(surface.shape.area, rel=rel)


def test_one_row_is_enough_for_a_cylinder(comm):
    surface = cylinder(1.0, 3.0, (1, 6), comm=comm)
    assert area(surface) == pytest.approx(18.0, rel=1e-13)


def test_ranks_without_cells_are_no_obstacle(comm):
    # three cells: on four and more ranks somebody goes without
    surface = cylinder(1.0, 3.0, (1, 3), cell="quadrilateral", comm=comm)
    assert count(surface, "lobe_1") == count(surface, "rim_top") == 3
    assert edge_length(surface, "rim_top") == pytest.approx(3 * math.sqrt(3.0), rel=1e-13)


def test_cylinder_answers_as_a_shape():
    shape = Cylinder(2.0, 4.2)
    assert shape.volume == pytest.approx(math.pi * 4 * 4.2)
    assert shape.area == pytest.approx(math.pi * 4 * 4.2)
    s = shape.stations(4)
    np.testing.assert_allclose(shape.z(s), [-2.1, -1.05, 0, 1.05, 2.1])
    np.testing.assert_array_equal(shape.radius(s), 2.0)
    np.testing.assert_array_equal(shape.slope(s)[1], 1.0)
    assert shape.arc_length == shape.height == 2 * shape.half_height == 4.2


def test_a_surface_cannot_be_changed(comm):
    surface = cylinder(1.0, 1.0, (1, 4), comm=comm)
    with pytest.raises(AttributeError):
        surface.num_lobes = 2
    with pytest.raises(TypeError):
        surface.groups["lobe_1"] = (2, 7)
    with pytest.raises(ValueError, match="read-only"):
        surface.axis[0] = 1.0


def test_graded_rows_lie_on_the_lobes_and_are_flat_at_their_rims():
    shape, g, M = Isotensoid.from_edge_radius(), 0.9, 6
    surface = lobed_cylinder(2, (M, 5), shape=shape, grading=g, comm=MPI.COMM_SELF)
    x = np.linspace(-1, 1, M + 1)
    s = shape.arc_length / 2 * ((1 - g) * x + g * np.sin(np.pi / 2 * x))
    z = np.concatenate([shape.z(s), shape.z(s[1:]) + shape.height])
    nodes = surface.mesh.geometry.x
    found = np.unique(nodes[:, 2].round(9))
    np.testing.assert_allclose(found - found[0], z - z[0], atol=1e-8)
    for height, radius in zip(found, [*shape.radius(s), *shape.radius(s[1:])], strict=True):
        ring = nodes[np.abs(nodes[:, 2] - height) < 1e-8]
        np.testing.assert_allclose(np.hypot(ring[:, 0], ring[:, 1]), radius, rtol=1e-12)
    # a sector is graded alike
    sector = sector_of(surface)
    assert sector.grading == g
    np.testing.assert_array_equal(np.unique(sector.mesh.geometry.x[:, 2].round(9)), found)
    with pytest.raises(InputError, match=r"grading = 1.5 must lie"):
        lobed_cylinder(1, (4, 5), grading=1.5)
    with pytest.raises(InputError, match="structured"):
        lobed_cylinder(1, layout="unstructured", size=0.7, grading=0.5)


def test_a_mesh_is_distributed_the_same_way_every_time(comm):
    first, *others = (lobed_cylinder(4, (12, 16), comm=comm).mesh.geometry.x for _ in range(8))
    for x in others:
        np.testing.assert_array_equal(x, first)


@pytest.mark.parametrize(
    "changes",
    [
        {"diagonals": "alternating"},
        {"cell": "quadrilateral", "order": 2},
        {"layout": "unstructured", "divisions": (24, 32), "size": 0.9},
    ],
    ids=str,
)
def test_a_surface_keeps_its_recipe(comm, changes):
    recipe = lobed_cylinder(2, **{"divisions": (8, 16)} | changes, comm=comm).recipe
    assert recipe == StackRecipe(Isotensoid.from_edge_radius(), 2, **{"divisions": (8, 16)} | changes)
    again = recipe.surface(comm)
    assert again.recipe == recipe
    if recipe.layout == "unstructured":
        with pytest.raises(InputError, match="needs a cyclic mesh"):
            sector_of(again)
        assert coarser(again) is None
        return
    sector, half = sector_of(again), coarser(again)
    assert sector.recipe == replace(recipe, sector=True)
    assert sector.copies == recipe.sectors
    assert half.recipe == replace(recipe, divisions=(4, 8))
    # by the recipe and not by what the surface looks like
    other = replace(again, recipe=replace(recipe, lobes=3))
    assert sector_of(other).num_lobes == coarser(other).num_lobes == 3


def test_a_cylinder_keeps_its_recipe(comm):
    surface = cylinder(1.5, 3.0, (1, 8), comm=comm)
    assert surface.recipe == StackRecipe(Cylinder(1.5, 3.0), 1, (1, 8))
    assert sector_of(surface).recipe.sector
