"""Every film law through every question that takes one: a right number, or one sentence."""

import pytest

from lobefem.equilibrium.distortions import Tip
from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.solver_options import FlowOptions
from lobefem.equilibrium.state import ideal_state
from lobefem.errors import InputError
from lobefem.fem.balloon import Balloon
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.model.end_plates import EndPlates
from lobefem.model.film import Film, Isotropic
from lobefem.model.fixed_wrinkles import FixedWrinkles
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.imp import IMP, PrescribedPath
from lobefem.model.tension_field import TensionField, WrinkledField
from lobefem.stability.continuum import continuum_pressure, unstable_from
from lobefem.stability.harmonic_buckling import harmonic_pressures
from lobefem.stability.linear_buckling import critical_pressure
from lobefem.stability.mesh_convergence import mesh_study
from lobefem.stability.modes import find_modes
from lobefem.stability.one_sided import (
    has_kink,
    one_sided_charts,
    one_sided_modes,
    one_sided_pressures,
    slack_critical_pressure,
)
from lobefem.stability.perturbation import perturb
from lobefem.stability.relaxation import release
from lobefem.stability.tracing import branches, trace

LAWS = (Isotropic(), FixedWrinkles(), TensionField(), IMP(), WrinkledField(), PrescribedPath())
P = 1000.0

KINK = "lies on the border of taut and wrinkled, where its tangent jumps; use one_sided_modes"
ONE = "film has one tangent; use critical_pressure or find_modes"
SLACK = "not linear in the pressure; use slack_critical_pressure"
PATH = "PrescribedPath film finds its stress from unstressed film; leave prestressed and load_path out"
SHARES = r"PrescribedPath film tells no hoop and shear stiffness of its own \(shares\); give Isotropic"
LEDGER = "PrescribedPath film has no energy to balance in a perturbation or a release; use TensionField"


def lobe(law, divisions=(8, 16), hoop_slack=0.0):
    """A lobe between held rims, its own stress built in."""
    surface = lobed_cylinder(1, divisions)
    parts = [GasPressure("film"), EndPlates("fixed")]
    return Balloon(surface, law, parts, prestressed=True, hoop_slack=hoop_slack)


def inflated(law):
    """A lobe whose top plate moves, its own stress built in where the law can take it."""
    return inflate(movable(law), P)


def movable(law):
    parts = [GasPressure("closed"), EndPlates()]
    return Balloon(lobed_cylinder(1, (8, 16)), law, parts, prestressed=not law.leads_to_stress)


def of_meshes(law):
    return mesh_study(lambda divisions: lobe(law, divisions), [(4, 8), (6, 12), (8, 16)], harmonics=[2])


def lowest(modes):
    return modes.values[0].real


# by question: how it is asked of a law, and for each of LAWS the number or what the sentence says
QUESTIONS = {
    "continuum": (
        lambda law: continuum_pressure(3, law),
        (259189.285, 12934.6022, 19269.2999, 19269.2999, 19269.2999, SHARES),
    ),
    "unstable from": (lambda law: unstable_from(law, highest=10), (None, 7, None, None, None, SHARES)),
    "critical pressure of a harmonic": (
        lambda law: critical_pressure(lobe(law), harmonic=2).pressure,
        (690508.200, 84825.9460, KINK, KINK, 112803.936, PATH),
    ),
    "critical pressure of the full model": (
        lambda law: critical_pressure(lobe(law), full=True).pressure,
        (608536.137, 45086.2640, KINK, KINK, 69939.1098, PATH),
    ),
    "critical pressure with hoop slack": (
        lambda law: critical_pressure(lobe(law, hoop_slack=1e-3), harmonic=2).pressure,
        (689456.045, 84825.9460, SLACK, SLACK, SLACK, PATH),
    ),
    "the same, of one smooth tangent": (
        lambda law: slack_critical_pressure(lobe(law, hoop_slack=1e-6), harmonic=2).pressure,
        (ONE, ONE, 112803.925, 112803.925, 112803.925, PATH),
    ),
    "chart": (
        lambda law: harmonic_pressures(lobe(law), [2])[2],
        (690508.200, 84825.9460, KINK, KINK, 112803.936, PATH),
    ),
    "mesh study": (
        lambda law: of_meshes(law).low[2].values[-1],
        (690508.200, 84825.9460, *2 * ("study isotropic film or fixed wrinkles",), 112803.936, PATH),
    ),
    "modes of the ideal state": (
        lambda law: lowest(find_modes(ideal_state(lobe(law), P), 1)),
        (3128.33149, 721.583896, KINK, KINK, 1709.08301, PATH),
    ),
    "modes of a harmonic": (
        lambda law: lowest(find_modes(ideal_state(lobe(law), P), 1, harmonics=2)),
        (13619.5396, 832.296615, KINK, KINK, 6298.80755, PATH),
    ),
    "trace": (
        lambda law: lowest(trace(lobe(law), [P], count=1).modes[0]),
        (3128.33149, 721.583896, KINK, KINK, 1709.08301, PATH),
    ),
    "branches": (
        lambda law: branches(lobe(law), [P], count=1, harmonics=2)[0].values[0],
        (13619.5396, 832.296615, KINK, KINK, 6298.80755, PATH),
    ),
    "kink": (lambda law: has_kink(lobe(law)), (False, False, True, True, False, PATH)),
    "one-sided modes": (
        lambda law: one_sided_modes(lobe(law), P, 1, harmonics=2).bounds[0],
        (ONE, ONE, 6298.80755, 6298.80755, ONE, PATH),
    ),
    "one-sided pressures": (
        lambda law: one_sided_pressures(lobe(law), harmonic=2).bounds[0],
        (ONE, ONE, 112803.936, 112803.936, ONE, PATH),
    ),
    "one-sided charts": (
        lambda law: one_sided_charts(lobe(law), [2])[0][2],
        (ONE, ONE, 112803.936, 112803.936, ONE, PATH),
    ),
    "ideal state": (lambda law: ideal_state(lobe(law), P).volume, (*5 * (142.761152,), PATH)),
    "inflate": (
        lambda law: inflated(law).volume,
        (142.694941, 142.659109, 142.647460, 142.647460, 142.647460, 145.367321),
    ),
    "modes of an inflated state": (
        lambda law: lowest(find_modes(inflated(law), 1)),
        (280.415923, 72.2659782, 156.652006, 156.652006, 156.652006, 147.072777),
    ),
    "strain energy": (
        lambda law: inflated(law).strain_energy,
        (1803.49247, 1759.66867, 1755.17077, 1755.17077, 1755.17077, None),
    ),
    "perturb": (
        lambda law: perturb(movable(law), P, Tip(1e-3), steps=1).history[-1].reaction,
        (18.5209523, 4.04475678, 11.4152009, 11.4152009, 11.4152009, LEDGER),
    ),
    "release": (
        lambda law: release(inflated(law), options=FlowOptions(max_steps=1)).outcome,
        (*5 * ("returned",), LEDGER),
    ),
}


@pytest.mark.parametrize("question", QUESTIONS)
def test_every_law_answers_with_the_right_number_or_one_sentence(question):
    ask, answers = QUESTIONS[question]
    for law, right in zip(LAWS, answers, strict=True):
        if isinstance(right, str) and right != "returned":
            with pytest.raises(InputError, match=right):
                ask(law)
        else:
            assert ask(law) == (pytest.approx(right, rel=1e-6) if isinstance(right, float) else right), law


def test_a_law_of_ones_own_is_asked_what_it_declares():
    """One with the isotropic law's energy and none of its declarations; one that declares all of them."""

    class Bare(Film):
        energy = Isotropic.energy

    class Own(Bare):
        shares = (1.0, 1.0)

    with pytest.raises(InputError, match="Bare film tells no hoop and shear stiffness"):
        continuum_pressure(3, Bare())
    with pytest.raises(InputError, match="of isotropic film or fixed wrinkles, not of Bare"):
        of_meshes(Bare())
    assert continuum_pressure(3, Own()) == continuum_pressure(3, Isotropic())
    for law in (Bare(), Own()):
        assert not has_kink(lobe(law))
        assert critical_pressure(lobe(law), harmonic=2).pressure == pytest.approx(690508.200, rel=1e-6)


@pytest.mark.parametrize(
    ("film", "text"),
    [
        (TensionField, r"^film is the class TensionField; make one of it, TensionField\(\)$"),
        ("mylar", "^film is 'mylar', which is no film law; give one, such as TensionField"),
        (None, "^film is None, which is no film law"),
    ],
)
def test_what_is_no_law_is_refused(film, text):
    for ask in (lambda: continuum_pressure(3, film), lambda: lobe(film)):
        with pytest.raises(InputError, match=text):
            ask()
