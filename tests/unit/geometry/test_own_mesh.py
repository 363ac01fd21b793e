"""Surfaces made of a mesh of one's own: any numbering, anywhere; what they claim is checked."""

from dataclasses import replace

import numpy as np
import pytest

from lobefem.equilibrium.form_finding import row_means
from lobefem.equilibrium.inflation import inflate
from lobefem.errors import InputError
from lobefem.fem.balloon import Balloon
from lobefem.geometry.flat_cylinder import Cylinder
from lobefem.geometry.isotensoid import Isotensoid
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.geometry.surface import Surface
from lobefem.linalg import dolfinx_compat
from lobefem.model.cables import Hoops
from lobefem.model.end_plates import EndPlates
from lobefem.model.film import Isotropic
from lobefem.model.fixed_wrinkles import FixedWrinkles
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.supports import Fixed
from lobefem.model.tension_field import TensionField
from lobefem.stability.linear_buckling import critical_pressure
from lobefem.stability.modes import find_modes

import basix.ufl
import dolfinx.mesh

ALONG, AROUND, LOBES = 6, 12, 2
SHAPE = Isotensoid.from_edge_radius()
RIM_BOTTOM, SEAM, RIM_TOP = 11, 12, 13
NAMES = {"rim_bottom": (1, RIM_BOTTOM), "seam_1": (1, SEAM), "rim_top": (1, RIM_TOP)}
# a right-handed frame and a place
BASIS = np.linalg.qr(np.array([[1.0, 2.0, 0.5], [-0.3, 1.0, 2.0], [1.0, -1.0, 0.7]]))[0]
BASIS *= np.sign(np.linalg.det(BASIS))
PLACE = np.array([12.0, -3.0, 5.0])


def arrays():
    """Nodes (n, 3) and triangles of a stack on the z axis, ring by ring from the bottom."""
    s = SHAPE.stations(ALONG)
    radius = np.concatenate([SHAPE.radius(s), SHAPE.radius(s[1:])])
    height = SHAPE.half_height + np.concatenate([SHAPE.z(s), SHAPE.height + SHAPE.z(s[1:])])
    angle = 2 * np.pi * np.arange(AROUND) / AROUND
    x = np.stack(
        [np.outer(radius, np.cos(angle)), np.outer(radius, np.sin(angle)), np.outer(height, np.ones(AROUND))],
        -1,
    )
    i, j = (index.ravel() for index in np.indices((LOBES * ALONG, AROUND)))
    a, b = i * AROUND + j, i * AROUND + (j + 1) % AROUND
    cells = np.concatenate(
        [np.column_stack([a, b, b + AROUND]), np.column_stack([a, b + AROUND, a + AROUND])]
    )
    return x.reshape(-1, 3), cells


def own_mesh(comm, x, cells, partitioner=None):
    element = basix.ufl.element("Lagrange", "triangle", 1, shape=(3,))
    if comm.rank:
        x, cells = x[:0], cells[:0]
    return dolfinx.mesh.create_mesh(comm, cells=cells, x=x, e=element, partitioner=partitioner)


def facets_where(mesh, marked):
    """Facets whose midpoints, on the z axis (n, 3), are marked."""
    mesh.topology.create_entities(1)
    mesh.topology.create_connectivity(1, 2)
    imap = mesh.topology.index_map(1)
    facets = np.arange(imap.size_local + imap.num_ghosts, dtype=np.int32)
    middles = dolfinx.mesh.compute_midpoints(mesh, 1, facets)
    return facets[marked((middles - PLACE) @ BASIS)]


def own(comm, change=lambda x, cells: (x, cells), ghosts=True, **fields):
    """A stack off the axis, its nodes, cells and their first corners in random order."""
    x, cells = change(*arrays())
    random = np.random.default_rng(7)
    number, order = random.permutation(len(x)), random.permutation(len(cells))
    places = np.empty_like(x)
    places[number] = x @ BASIS.T + PLACE
    turn = (np.arange(3) + random.integers(0, 3, len(cells))[:, None]) % 3
    cells = np.take_along_axis(number[cells], turn, axis=1)[order].astype(np.int64)
    partitioner = dolfinx_compat.shared_facet_partitioner() if ghosts and comm.size > 1 else None
    mesh = own_mesh(comm, places, cells, partitioner)
    tags = []
    for tag, height in ((RIM_BOTTOM, 0.0), (SEAM, SHAPE.height), (RIM_TOP, 2 * SHAPE.height)):
        facets = facets_where(mesh, lambda middles, z=height: np.abs(middles[:, 2] - z) < 1e-9)
        tags.append(np.column_stack([facets, np.full(len(facets), tag)]))
    tags = np.concatenate(tags)
    tags = tags[np.argsort(tags[:, 0])].astype(np.int32)
    edges = dolfinx.mesh.meshtags(mesh, 1, tags[:, 0].copy(), tags[:, 1].copy())
    count = mesh.topology.index_map(2).size_local + mesh.topology.index_map(2).num_ghosts
    cells = np.arange(count, dtype=np.int32)
    middles = (dolfinx.mesh.compute_midpoints(mesh, 2, cells) - PLACE) @ BASIS
    lobes = dolfinx.mesh.meshtags(mesh, 2, cells, 1 + (middles[:, 2] > SHAPE.height).astype(np.int32))
    return Surface(mesh, **({"lobes": lobes, "edges": edges, "groups": NAMES, "num_lobes": 2} | fields))


def ours(comm):
    return lobed_cylinder(LOBES, (ALONG, AROUND), comm=comm)


@pytest.mark.parametrize(
    "film", [Isotropic(), TensionField(), FixedWrinkles()], ids=lambda f: type(f).__name__
)
def test_a_mesh_of_ones_own_is_inflated_and_has_the_same_modes(comm, film):
    """Made by create_mesh from arrays, off-axis, numbered at random; no axis, no shape, no divisions."""
    found = []
    for surface in (ours(comm), own(comm)):
        state = inflate(Balloon(surface, film, [GasPressure("closed"), Hoops(), EndPlates()]), 5.0)
        modes = find_modes(state, 4)
        numbers = [
            state.volume,
            state.max_displacement,
            *state.hoop_tension,
            state.strain_energy,
            state.bar_force,
        ]
        found.append(
            ([*numbers, *modes.values.real], [(m.kind, m.harmonic, m.harmonics) for m in modes.modes])
        )
    np.testing.assert_allclose(found[1][0], found[0][0], rtol=1e-8)
    assert found[1][1] == found[0][1]


def test_a_mesh_of_ones_own_with_its_shape_has_the_same_critical_pressure(comm):
    pressures = []
    for surface in (ours(comm), own(comm, shape=SHAPE)):
        balloon = Balloon(
            surface, FixedWrinkles(), [GasPressure("closed"), Hoops(), EndPlates()], prestressed=True
        )
        found = critical_pressure(balloon, full=True)
        pressures.append((found.pressure, found.mode.harmonic, found.mode.kind))
    assert pressures[1] == (pytest.approx(pressures[0][0], rel=1e-8), *pressures[0][1:])


def test_a_mesh_and_names_are_enough(comm):
    surface = own(comm)
    bare = Surface(surface.mesh, edges=surface.edges, groups=NAMES)
    assert repr(bare).startswith("Surface(1 lobe; mesh unstructured; cells 288 triangles; nodes 156")
    assert "<table>" in bare._repr_html_()
    assert "edge radius" not in repr(bare)
    balloon = Balloon(bare, Isotropic(), [GasPressure("film"), EndPlates("fixed")])
    np.testing.assert_allclose(balloon.axis.direction, BASIS[:, 2], atol=1e-13)
    np.testing.assert_allclose(balloon.axis.origin, PLACE, atol=1e-12)
    assert (bare.lobe_numbers() == 1).all()
    assert "1 lobe" in repr(balloon)


def test_the_axis_is_kept_as_a_unit_vector(comm):
    surface = replace(ours(comm), axis=(0, 0, 2))
    np.testing.assert_array_equal(surface.axis, [0.0, 0.0, 1.0])
    with pytest.raises(ValueError, match="read-only"):
        surface.axis[0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        replace(surface, origin=(0, 0, 0)).origin[0] = 1.0


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"axis": (0, 0, 0)}, "the axis is a vector of length zero"),
        ({"axis": (0, 1)}, "the axis is .* give 3 numbers"),
        ({"axis": (0, 0, np.nan)}, "a part of the axis is nan"),
        ({"origin": "here"}, "the axis's origin is 'here'"),
        ({"shape": 2.0}, "shape is 2.0; give an Isotensoid"),
        ({"num_lobes": 0}, "num_lobes is 0; give 1 or more"),
        ({"divisions": (6,)}, "give two integers"),
        ({"divisions": (6, 12), "cyclic_order": 5}, "cyclic_order = 5 does not fit 12 divisions around"),
        ({"groups": {"rim_top": 3}}, "group 'rim_top' is 3; give"),
        ({"edges": None}, "edge group 'rim_bottom' needs the facet tags"),
    ],
)
def test_fields_that_cannot_be_are_refused(comm, fields, message):
    with pytest.raises(InputError, match=message):
        own(comm, **fields)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"axis": (0, 0, 1)}, r"the surface's axis is \(0, 0, 1\), but the centre of its top rim"),
        ({"axis": tuple(-BASIS[:, 2])}, "the surface's axis is"),
        ({"origin": (0, 0, 0)}, r"the axis through \(0, 0, 0\) passes the centre of rim_bottom at "),
        ({"shape": Isotensoid.from_edge_radius(3.0)}, "edge radius of 3 m, but rim_bottom has 2 m"),
        ({"shape": Isotensoid.from_edge_radius(2.0, 0.5)}, "its rims are 8.38 m apart"),
        ({"shape": Cylinder(2.0, SHAPE.height)}, "the nodes lie .* m off the surface's shape in the mean"),
        ({"num_lobes": 1}, "144 cells are tagged with none of the lobes 1 to 1"),
        ({"num_lobes": 3, "shape": SHAPE}, "makes 3 lobes of together 12.57 m"),
        ({"divisions": (6, 10)}, "the mesh is not the grid of 6 x 10 divisions"),
        ({"divisions": (5, 12)}, "the mesh is not the grid of 5 x 12 divisions"),
        ({"groups": {"rim_top": (1, RIM_TOP)}}, "end plates need the edge group 'rim_bottom'"),
    ],
)
def test_what_a_surface_claims_is_checked_against_its_mesh(comm, fields, message):
    with pytest.raises(InputError, match=message):
        Balloon(own(comm, **fields), Isotropic(), [EndPlates()])


def test_divisions_of_ones_own_mesh_make_it_a_grid(comm):
    """A sector is meshed anew and compared: where cells are cut otherwise it is none of the mesh's."""
    surface = own(comm, divisions=(ALONG, AROUND), cyclic_order=AROUND, shape=SHAPE)
    parts = [GasPressure("closed"), Hoops(), EndPlates()]
    state = inflate(Balloon(surface, Isotropic(), parts), 5.0)
    full = find_modes(state, 3)
    single = find_modes(state, 3, harmonics=range(AROUND // 2 + 1))
    np.testing.assert_allclose(single.values.real, full.values.real, rtol=1e-8)
    known = inflate(Balloon(ours(comm), Isotropic(), parts), 5.0)
    np.testing.assert_allclose(row_means(state), row_means(known), rtol=1e-6, atol=1e-6)

    def mirrored(x, cells):
        return x * [1, -1, 1], cells[:, ::-1]

    surface = own(comm, mirrored, divisions=(ALONG, AROUND), cyclic_order=AROUND, shape=SHAPE)
    state = inflate(Balloon(surface, Isotropic(), parts), 5.0)
    with pytest.raises(InputError, match="288 cells lie elsewhere"):
        find_modes(state, 3, harmonics=[1])


def test_a_node_at_no_place_is_refused(comm):
    surface = ours(comm)
    x = surface.mesh.geometry.x
    x[np.abs(x[:, 2] - 2 * SHAPE.height) < 1e-9, 0] = np.nan
    with pytest.raises(InputError, match="12 nodes of the mesh lie at no finite place; give all of them"):
        Balloon(surface, Isotropic(), [EndPlates()])


def test_a_mesh_without_ghost_cells_is_refused_on_several_ranks(comm):
    surface = own(comm, ghosts=False)
    if comm.size == 1:
        assert Balloon(surface, Isotropic(), [EndPlates()]).comm.size == 1
        return
    with pytest.raises(InputError, match="the mesh lacks ghost cells"):
        Balloon(surface, Isotropic(), [EndPlates()])


def inwards(x, cells):
    return x, cells[:, ::-1]


@pytest.mark.parametrize("film", [Isotropic(), TensionField()], ids=lambda f: type(f).__name__)
@pytest.mark.parametrize(
    "parts",
    [[Fixed("rim_bottom"), Fixed("rim_top")], [], [EndPlates()], [EndPlates("fixed")]],
    ids=["held", "free", "plates", "fixed"],
)
def test_cells_turned_inwards_are_told_whatever_the_supports(comm, film, parts):
    with pytest.raises(InputError, match="the surface's cells are turned inwards, so that gas would press"):
        Balloon(own(comm, inwards), film, [GasPressure("film"), *parts])


def test_a_mirrored_surface_of_ours_is_turned_inwards(comm):
    surface = lobed_cylinder(1, (4, 6), comm=comm)
    surface.mesh.geometry.x[:, 0] *= -1.0
    with pytest.raises(InputError, match="the surface's cells are turned inwards"):
        Balloon(surface, Isotropic(), [Fixed("rim_bottom"), Fixed("rim_top")])


def octahedron():
    x = np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=float)
    ring = [(k, (k + 1) % 4) for k in range(4)]
    cells = [(a, b, 4) for a, b in ring] + [(b, a, 5) for a, b in ring]
    return x + np.array([50.0, 0, 0]), np.array(cells, dtype=np.int64)


def test_film_without_a_free_edge_has_an_inside_and_an_open_sheet_has_none(comm):
    x, cells = octahedron()
    partitioner = dolfinx_compat.shared_facet_partitioner() if comm.size > 1 else None
    parts = [Fixed(lambda x: x[2] < 0)]
    good = Surface(own_mesh(comm, x, cells, partitioner), axis=(0, 0, 1), origin=(50, 0, 0))
    assert Balloon(good, Isotropic(), parts).reference_volume == pytest.approx(4 / 3)
    bad = Surface(own_mesh(comm, x, cells[:, ::-1].copy(), partitioner), axis=(0, 0, 1))
    with pytest.raises(InputError, match="the surface's cells are turned inwards"):
        Balloon(bad, Isotropic(), parts)
    with pytest.raises(InputError, match="the axis of a surface without two rims is not known"):
        Balloon(replace(good, axis=None), Isotropic(), parts)
    for sense in (1, -1):  # gas presses along the normals
        sheet = Surface(own_mesh(comm, x, cells[:4, ::sense].copy(), partitioner), axis=(0, 0, 1))
        Balloon(sheet, Isotropic(), parts)


def test_cells_of_another_kind_are_refused(comm):
    flat = dolfinx.mesh.create_unit_square(comm, 2, 2)
    with pytest.raises(InputError, match="triangles of 3 nodes in 2 dimensions; give triangles or quadri"):
        Surface(flat)
    box = dolfinx.mesh.create_unit_cube(comm, 1, 1, 1)
    with pytest.raises(InputError, match="tetrahedrons of 4 nodes"):
        Surface(box)
