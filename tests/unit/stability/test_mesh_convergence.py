"""Critical pressures on a sequence of meshes, and what a study says of them."""

import re

import numpy as np
import pytest
from builders import stack

from lobefem import (
    FixedWrinkles,
    Isotropic,
    TensionField,
)
from lobefem.errors import InputError
from lobefem.stability.mesh_convergence import mesh_study
from lobefem.viz.study_figures import refinement

pytestmark = pytest.mark.serial

MESHES = ((18, 24), (24, 32), (30, 40), (36, 48))


def maker(film, lobes=1, **mesh):
    given = {"lobes": lobes, "support": "fixed", "prestressed": True, "sector": True, **mesh}
    return lambda divisions: stack(film=film, load="film", divisions=divisions, **given)


@pytest.fixture(scope="module")
def wrinkled():
    return mesh_study(maker(FixedWrinkles()), MESHES)


# --- studies ------------------------------------------------------------------------------------


@pytest.mark.slow
def test_fixed_wrinkles_do_not_converge_and_the_study_says_so(wrinkled):
    assert wrinkled.lowest.behaviour == "falls"
    assert wrinkled.around == (24, 32, 40, 48)
    # the crossings of another code, by divisions around
    others = {32: 5700, 40: 3190, 48: 553}
    for chart in wrinkled.charts[1:]:
        assert chart.pressure == pytest.approx(others[chart.divisions[1]], rel=0.02)
    text = " ".join(wrinkled.verdict)
    assert "does NOT converge: it falls from 11.88 kPa (n = 5) on 18 x 24 divisions" in text
    assert "tends to 0: in the continuum this film has no critical pressure, since from n = 7 on" in text


@pytest.mark.slow
def test_the_papers_pressure_is_placed_on_the_curve(wrinkled):
    assert wrinkled.published == 4600
    assert wrinkled.published_around == pytest.approx(35, abs=0.5)
    assert "The published 4600 Pa is the value at 35 divisions around" in " ".join(wrinkled.verdict)


@pytest.mark.slow
def test_low_harmonics_converge_to_the_continuum(wrinkled):
    for n in (2, 3, 4):
        one, exact = wrinkled.low[n], wrinkled.continuum[0].pressures[n]
        assert one.behaviour == "converges"
        assert one.limit == pytest.approx(exact, rel=0.04)
        assert abs(one.limit - exact) < 2 * one.uncertainty
    said = r"These do not depend on the mesh: .*n = 2: 3\d\.\d \+- 0\.\d kPa \(without a mesh 33\.82 kPa\)"
    assert re.search(said, " ".join(wrinkled.verdict))


@pytest.mark.slow
def test_bounds_of_other_films_are_named(wrinkled):
    own, kink, mean, isotropic = wrinkled.continuum
    assert (own.unstable_from, kink.unstable_from, mean.unstable_from) == (7, 13, None)
    assert own.lowest == kink.lowest == 0 < mean.lowest < isotropic.lowest == pytest.approx(226998, abs=1)
    text = wrinkled.verdict[-1]
    assert "isotropic film 227 kPa" in text
    assert "between 0 Pa (wrinkled side) and 126.1 kPa (mean of both sides)" in text


@pytest.mark.slow
def test_isotropic_film_converges():
    study = mesh_study(maker(Isotropic()), ((24, 32), (36, 48), (48, 64)), harmonics=(2, 3))
    assert study.lowest.behaviour == "converges"
    assert study.lowest.limit == pytest.approx(226998, rel=0.02)
    assert (study.published, study.published_around) == (None, None)
    assert study.verdict[0].startswith("The lowest critical pressure converges: from 290.6 kPa (n = 4)")
    assert not any("tends to 0" in sentence for sentence in study.verdict)


@pytest.mark.slow
def test_other_film_has_no_published_pressure():
    meshes = ((6, 8), (9, 12), (12, 16))
    assert mesh_study(maker(FixedWrinkles(thickness=8e-5)), meshes, harmonics=()).published is None
    assert mesh_study(maker(FixedWrinkles()), meshes, harmonics=()).published == 4600


@pytest.mark.slow
def test_a_stack_has_its_own_published_pressure():
    study = mesh_study(maker(FixedWrinkles(), lobes=4), ((18, 24), (24, 32), (30, 40)), harmonics=(2,))
    assert study.published == 3000
    assert study.published_around == pytest.approx(37, abs=0.6)
    assert "a stack is no stiffer" in " ".join(study.verdict)
    elsewhere = mesh_study(maker(FixedWrinkles()), ((6, 8), (9, 12), (12, 16)), harmonics=(), published=1.0)
    assert elsewhere.published_around is None
    assert "The published 1 Pa lies outside the pressures of these meshes." in elsewhere.verdict


@pytest.mark.slow
def test_the_figure_shows_every_curve(wrinkled, shared_path):
    figure = refinement(wrinkled)
    (axes,) = figure.axes
    curves = [line for line in axes.lines if len(line.get_xdata()) == len(MESHES)]
    assert len(curves) == 6
    assert np.allclose(curves[-1].get_ydata(), wrinkled.lowest.values)
    words = [text.get_text() for text in axes.texts]
    assert "lowest of all harmonics: no limit" in words
    assert "paper: 4600 Pa,\nreached at 35 divisions" in words
    assert {f"n = {n}" for n in (2, 3, 4, 5, 6)} <= set(words)


@pytest.mark.parametrize(
    ("make", "meshes", "message"),
    [
        (maker(FixedWrinkles()), ((6, 8), (9, 12)), "2 mesh.es. shows no trend"),
        (maker(FixedWrinkles()), ((6, 8), (12, 16), (9, 12)), "do not rise"),
        (maker(FixedWrinkles()), ((6, 8), (9, 12), (12, 16)), "harmonic 6 is more than half of 8"),
        (maker(FixedWrinkles(), order=2), MESHES, "linear cells"),
        (maker(TensionField()), MESHES, "border of taut and wrinkled"),
    ],
)
def test_what_cannot_be_studied_is_refused(make, meshes, message):
    with pytest.raises(InputError, match=message):
        mesh_study(make, meshes)
