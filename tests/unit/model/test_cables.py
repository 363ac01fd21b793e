"""Cables on tagged edges: their energy on a stretched circle, their groups, their errors."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from states import nodes, unknowns

from lobefem.errors import InputError
from lobefem.fem.balloon import Balloon
from lobefem.fem.functionals import cable_tensions
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.linalg import dolfinx_compat
from lobefem.model.cables import Cables, Hoops
from lobefem.model.end_plates import EndPlates
from lobefem.model.fixed_wrinkles import FixedWrinkles

from dolfinx.mesh import compute_midpoints, meshtags


def stretched(comm, *cables, factor=1.003, surface=None, **kw):
    """All nodes moved away from the axis; without plates, so that rims may move too."""
    surface = lobed_cylinder(3, (2, 12), comm=comm) if surface is None else surface
    balloon = Balloon(surface, FixedWrinkles(E=1e-6), cables, **kw)
    q = unknowns(balloon, (factor - 1) * nodes(balloon) * [1, 1, 0])
    balloon.set_unknowns(q)
    return balloon


PERIMETER = 2 * 12 * 2.0 * math.sin(math.pi / 12)  # of the inscribed polygon, edge radius 2 m


def test_energy_and_tension_of_hoops_on_all_seams(comm):
    balloon = stretched(comm, Hoops(EA=5e6))
    e = (1.003**2 - 1) / 2
    expected = 2 * PERIMETER * 5e6 / 2 * e**2
    assert balloon.strain_energy() == pytest.approx(expected, rel=1e-11)
    # the second Piola force times the stretch
    np.testing.assert_allclose(cable_tensions(balloon), [5e6 * e * 1.003] * 2, rtol=1e-11)


def test_a_cord_on_a_rim_and_one_on_a_single_seam(comm):
    balloon = stretched(comm, Cables(EA=5e6, on=("rim_top",)), Cables(EA=1e6, on=("seam_2",)))
    e = (1.003**2 - 1) / 2
    assert balloon.strain_energy() == pytest.approx(PERIMETER * 6e6 / 2 * e**2, rel=1e-11)
    np.testing.assert_allclose(cable_tensions(balloon), np.array([5e6, 1e6]) * e * 1.003, rtol=1e-11)


def named(surface, **names):
    """The surface with further names of its edge groups."""
    return replace(surface, groups=surface.groups | {new: surface.groups[old] for new, old in names.items()})


@pytest.mark.parametrize("old", ["rim_top", "rim_bottom", "seam_1"])
@pytest.mark.parametrize("new", ["tendon", "rim_of_my_own", "seam_of_my_own"])
def test_what_an_edge_is_called_does_not_matter(comm, old, new):
    # so slender that a rim is one rank's of two
    surface = named(lobed_cylinder(8, (2, 12), comm=comm), **{new: old})
    found = []
    for name in (old, new):
        balloon = stretched(comm, Cables(EA=5e6, on=(name,)), surface=surface)
        r = balloon.map.create_vector()
        balloon.residual(balloon.unknowns_of(balloon), r)
        found.append((balloon.strain_energy(), *cable_tensions(balloon), r.norm()))
    np.testing.assert_allclose(found[1], found[0], rtol=1e-13)
    assert found[0][0] == pytest.approx(PERIMETER * 5e6 / 2 * ((1.003**2 - 1) / 2) ** 2, rel=1e-11)


def tagged(surface, on):
    """The surface with the facets whose midpoints x (n, 3) lie on an edge tagged as "tendon"."""
    mesh = surface.mesh
    facets = np.arange(mesh.topology.index_map(1).size_local + mesh.topology.index_map(1).num_ghosts)
    facets = facets[on(compute_midpoints(mesh, 1, facets.astype(np.int32)))].astype(np.int32)
    edges = meshtags(mesh, 1, facets, np.full(facets.size, 7, dtype=np.int32))
    return replace(surface, edges=edges, groups={"tendon": (1, 7)})


def on_meridian(x):
    return (np.abs(x[:, 1]) < 1e-9) & (x[:, 0] > 0)


def test_a_tendon_along_a_meridian(comm):
    """Of a surface that has grown by a share in all directions."""
    surface = tagged(lobed_cylinder(2, (4, 12), comm=comm), on_meridian)
    balloon = Balloon(surface, FixedWrinkles(E=1e-6), [Cables(EA=5e6, on=("tendon",))])
    balloon.set_unknowns(unknowns(balloon, 0.003 * nodes(balloon)))
    shape, e = surface.shape, (1.003**2 - 1) / 2
    s = shape.stations(4)
    length = 2 * np.hypot(np.diff(shape.radius(s)), np.diff(shape.z(s))).sum()
    assert balloon.strain_energy() == pytest.approx(length * 5e6 / 2 * e**2, rel=1e-9)
    np.testing.assert_allclose(cable_tensions(balloon), [5e6 * e * 1.003], rtol=1e-11)


def test_a_group_without_an_edge_or_on_two_kinds_of_edges_is_refused(comm):
    surface = lobed_cylinder(2, (2, 12), comm=comm)
    top = 2 * surface.shape.height
    for on, text in (
        (lambda x: x[:, 2] > 2 * top, "^edge group 'tendon' is empty: there is no edge for a cable"),
        (
            lambda x: on_meridian(x) | (x[:, 2] > top - 1e-9),
            "^edge group 'tendon' has 12 facets on a free edge and 4 within the film; give each a group",
        ),
    ):
        with pytest.raises(InputError, match=text):
            Balloon(tagged(surface, on), FixedWrinkles(), [Cables(on=("tendon",))])


def test_built_in_tension_is_the_seams_or_the_one_given(comm):
    for given, expected in ((None, None), (7.0, 7.0)):
        balloon = stretched(comm, Hoops(EA=5e6, tension_per_pressure=given), factor=1.0, prestressed=True)
        balloon.set_loads(0.0, 20.0)
        shape = balloon.surface.shape
        if expected is None:
            expected = shape.R0**2 * math.cos(shape.edge_angle)
        np.testing.assert_allclose(cable_tensions(balloon), [20 * expected] * 2, rtol=1e-13)


def fan(x, top):
    """Edges of all kinds at one node: 1 the top rim, 2 and 3 meridians to it, 4 the seam, 0 all others."""
    theta = np.arctan2(x[:, 1], x[:, 0])
    rim = x[:, 2] > top - 1e-9
    first, second = np.abs(theta) < 1e-9, np.abs(theta - np.pi / 6) < 1e-9
    seam = np.abs(x[:, 2] - top / 2) < 1e-9
    return np.select([rim, first, second, seam], [1, 2, 3, 4], 0)


def test_groups_that_share_nodes_and_cells_keep_their_own_numbers(comm):
    """Neighbouring meridians, of one cell between them, a seam across them and the rim that they end on."""
    surface = lobed_cylinder(2, (4, 12), comm=comm)
    mesh = surface.mesh
    facets = np.arange(sum(getattr(mesh.topology.index_map(1), n) for n in ("size_local", "num_ghosts")))
    x = compute_midpoints(mesh, 1, facets.astype(np.int32))
    values = fan(x, 2 * surface.shape.height)
    some = values > 0
    edges = meshtags(mesh, 1, facets[some].astype(np.int32), values[some].astype(np.int32))
    names = ("rim", "first", "second", "seam")
    surface = replace(surface, edges=edges, groups={name: (1, k + 1) for k, name in enumerate(names)})
    EA = np.array([4e6, 1e6, 3e6, 2e3])
    cables = [Cables(EA=value, on=(name,)) for name, value in zip(names, EA, strict=True)]
    # the seam carries two cables, of which the other lies on a meridian too
    cables.append(Cables(EA=7e6, on=("seam", "first")))
    EA = np.append(EA, [7e6, 7e6])
    balloon = Balloon(surface, FixedWrinkles(E=1e-6), cables)
    q = unknowns(balloon, 0.003 * nodes(balloon))
    balloon.set_unknowns(q)
    e = (1.003**2 - 1) / 2
    np.testing.assert_allclose(cable_tensions(balloon), EA * e * 1.003, rtol=1e-11)
    s = surface.shape.stations(4)
    meridian = 2 * np.hypot(np.diff(surface.shape.radius(s)), np.diff(surface.shape.z(s))).sum()
    lengths = np.array([PERIMETER, meridian, meridian, PERIMETER, PERIMETER, meridian])
    assert balloon.strain_energy() == pytest.approx(float(lengths @ EA) / 2 * e**2, rel=1e-9)
    # the tangent is the residual's derivative, edge by edge
    step = unknowns(balloon, np.random.default_rng(0).normal(size=(1, 3)) * np.sin(7 * nodes(balloon)))
    ahead, behind, product = (balloon.map.create_vector() for _ in range(3))
    balloon.tangent(q).mult(step, product)
    for sign, out in ((1, ahead), (-1, behind)):
        moved = q.copy()
        moved.axpy(sign * 1e-6, step)
        balloon.residual(moved, out)
    np.testing.assert_allclose(
        (ahead.array_r - behind.array_r) / 2e-6,
        product.array_r,
        rtol=0,
        atol=1e-7 * np.abs(product.array_r).max(initial=1.0),
    )


def test_what_is_compiled_does_not_depend_on_the_number_of_seams(comm, monkeypatch):
    """Nor on the numbers of the cables, or on the tags of rims and seams."""
    real, made = dolfinx_compat.form, []

    def form(expression, *args):
        made.append(expression.signature())
        return real(expression, *args)

    monkeypatch.setattr(dolfinx_compat, "form", form)
    compiled = []
    for lobes in (2, 5, 120):
        made.clear()
        surface = lobed_cylinder(lobes, (2, 4), comm=comm)
        cables = [Hoops(EA=1e6)] if lobes == 2 else [Cables(EA=k * 1e6, on=(f"seam_{k}",)) for k in (1, 2, 3)]
        balloon = Balloon(surface, FixedWrinkles(), [*cables, EndPlates("fixed")], prestressed=True)
        forms = balloon.forms
        for name in ("elastic", "residual", "tangent", "predicted", "second_variation"):
            assert getattr(forms, name) is not None
        assert len(cable_tensions(balloon)) == (1 if lobes == 2 else 3)
        compiled.append(list(made))
    assert len(compiled[0]) == len(set(compiled[0]))
    assert compiled[0] == compiled[1] == compiled[2]


def test_one_lobe_has_no_seam_and_needs_no_hoop(comm):
    surface = lobed_cylinder(1, (2, 4), comm=comm)
    assert Hoops().groups(surface) == ()
    assert cable_tensions(Balloon(surface, FixedWrinkles(), [Hoops()])) == ()


def test_groups_are_edges_only_and_each_once(comm):
    surface = lobed_cylinder(3, (2, 4), comm=comm)
    assert Cables(on=("seam_*", "seam_1", "rim_top")).groups(surface) == ("seam_1", "seam_2", "rim_top")


def test_a_name_that_fits_no_edge_is_refused(comm):
    one, two = (lobed_cylinder(lobes, (2, 4), comm=comm) for lobes in (1, 2))
    names = r"\['seam_1', 'rim_bottom', 'rim_top'\]"
    for surface, name, known in (
        (two, "seam_7", names),
        (two, "seams_*", names),
        (two, "lobe_*", names),
        (one, "seam_1", r"\['rim_bottom', 'rim_top'\]"),
        (replace(two, groups={"rim_top": two.groups["rim_top"]}), "seam_*", r"\['rim_top'\]"),
    ):
        text = rf"^no edge group '{re.escape(name)}' on this surface; it has {known}$"
        with pytest.raises(InputError, match=text):
            Balloon(surface, FixedWrinkles(), [Cables(on=("rim_top", name))])


def test_errors():
    for bad in (0.0, -5.0, math.inf, math.nan, "2e9", None, True):
        with pytest.raises(InputError, match=r"^cable EA is .*; give a .*number \[N\]$"):
            Cables(EA=bad)
    with pytest.raises(InputError, match=r"^a cable's tension_per_pressure is '7'; give a number \[N/Pa\]$"):
        Cables(tension_per_pressure="7")
    for bad in ("seam_*", 3, (1,)):
        with pytest.raises(InputError, match=r"^a cable is on .*; give names of edge groups, as \('seam_"):
            Cables(on=bad)
