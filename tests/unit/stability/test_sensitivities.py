"""Sensitivities of one gore by the adjoint, against central differences of solved states."""

from dataclasses import replace

import numpy as np
import pytest
from builders import isotensoid_pumpkin as pumpkin

from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.sealed_gas import seal
from lobefem.equilibrium.solver_options import NewtonOptions
from lobefem.errors import InputError
from lobefem.geometry.gore import ConstantAngle, Gore
from lobefem.geometry.pumpkin import PumpkinRecipe
from lobefem.geometry.pumpkin_curve import PumpkinCurve
from lobefem.model.cables import Tendons
from lobefem.model.dead_weight import DeadWeight
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.orthotropic import OrthotropicTensionField
from lobefem.stability.cell_stresses import stress_norm
from lobefem.stability.gore_buckling import critical_pressures
from lobefem.stability.modes import find_modes
from lobefem.stability.sensitivities import Adjoint, critical_sensitivity
from lobefem.stability.sensitivity_record import PARAMETERS

import dolfinx
from dolfinx import fem

WEIGHT = DeadWeight(film=0.34, cables=0.1)

FILMS = {
    "isotropic": None,
    "orthotropic": OrthotropicTensionField(
        E1=200e6, E2=250e6, nu12=0.5, G12=60e6, thickness=38e-6, slack_stiffness=1e-5
    ),
}

STEP = {"foreshortening": 1e-6}  # of others 1e-5


def balloon(film="isotropic", divisions=(10, 4), **given):
    options = {"gores": 48, "flat": True, "parts": [WEIGHT], "gas": GasPressure(gradient=2.0)}
    return pumpkin(divisions=divisions, film=FILMS[film], **(options | given))


def with_part(one, part):
    """The balloon with one of its parts in place of another one of its kind."""
    parts = [part if type(part) is type(old) else old for old in one.components]
    return one.with_changes(components=parts)


def changed(one, name, by):
    """The balloon with a parameter changed by a share, the foreshortening by a number."""
    film, scale = one.film, 1 + by
    if name == "E":
        moduli = {key: getattr(film, key) * scale for key in ("E1", "E2", "G12") if hasattr(film, key)}
        return one.with_changes(film=replace(film, **(moduli or {"E": film.E * scale})))
    if name == "thickness":
        thicker = with_part(one, replace(WEIGHT, film=WEIGHT.film * scale))
        return thicker.with_changes(film=replace(film, thickness=film.thickness * scale))
    if name == "EA":
        return with_part(one, Tendons(EA=1e5 * scale))
    if name == "foreshortening":
        return with_part(one, Tendons(EA=1e5, foreshortening=by))
    return one


def wider(one, by):
    """The balloon cut from gores that are wider by a multiple of `direction`."""
    pattern = fem.Function(one.pattern.function_space)
    pattern.x.array[:] = one.pattern.x.array + by * direction(one).x.array
    return one.with_changes(pattern=pattern)


def direction(one):
    return one.surface.recipe.widening(one.surface, lambda share: 0.1 * np.sin(np.pi * share) ** 2)


def norm(state):
    state.restore()
    return stress_norm(state.balloon)


def values(state, harmonics):
    """The quantities by other ways than an adjoint's."""
    found = {
        "volume": state.volume,
        "tendon_tension": state.hoop_tension[0],
        "max_stress": state.max_stress().value,
        "stress_norm": norm(state),
    }
    return found | {n: find_modes(state, 1, harmonics=[n]).lowest for n in harmonics}


def differences(low, high, pressures, harmonics, step):
    first, second = (
        values(inflate(one, p, options=NewtonOptions(rtol=1e-12)), harmonics)
        for one, p in zip((low, high), pressures, strict=True)
    )
    return {key: (second[key] - first[key]) / (2 * step) for key in first}


# FFCx 0.9 takes a quarter of an hour for the third derivative of the orthotropic law
LENGTHY = pytest.mark.skipif(
    dolfinx.__version__.startswith("0.9"), reason="FFCx 0.9 compiles this form for a quarter of an hour"
)


@pytest.mark.slow
@pytest.mark.parametrize("film", ["isotropic", pytest.param("orthotropic", marks=LENGTHY)])
def test_derivatives_are_those_of_central_differences(film):
    """In taut, wrinkled and slack film, under gas of a gradient, with weight, of n = 0, 1 and others."""
    pressure, harmonics = 200.0, (0, 1, 4)
    one = balloon(film)
    state = inflate(one, pressure, options=NewtonOptions(rtol=1e-12))
    areas = np.array([state.taut_area, state.wrinkled_area, state.slack_area])
    assert (areas > 0.01 * areas.sum()).all()
    adjoint = Adjoint(state)
    found = adjoint.volume(), adjoint.tendon_tension(), adjoint.max_stress(), adjoint.stress_norm()
    sensitivities = {s.quantity: s for s in found}
    sensitivities |= {n: adjoint.eigenvalue(n) for n in harmonics}
    assert 1 <= adjoint.stress_norm().value / adjoint.max_stress().value < 1.1
    for key, value in values(state, harmonics).items():
        assert sensitivities[key].value == pytest.approx(value, rel=1e-9)
    for name in PARAMETERS:
        h = STEP.get(name, 1e-5)
        pair = [pressure * (1 + sign * h * (name == "pressure")) for sign in (-1, 1)]
        expected = differences(changed(one, name, -h), changed(one, name, h), pair, harmonics, h)
        found = {key: s.by[name] for key, s in sensitivities.items()}
        assert found == pytest.approx(expected, rel=1e-6)
    h = 1e-5
    expected = differences(wider(one, -h), wider(one, h), [pressure] * 2, harmonics, h)
    found = {key: s.along(direction(one)) for key, s in sensitivities.items()}
    assert found == pytest.approx(expected, rel=1e-6)
    area = adjoint.film_area()
    assert area.along(direction(one)) == pytest.approx(
        (Adjoint(inflate(wider(one, 1.0), pressure)).film_area().value - area.value), rel=1e-3
    )


@pytest.mark.slow
def test_a_parameter_without_a_form_takes_two_balloons():
    """Of a fitting's radius: nodes, pattern, tendons and discs all move with it."""

    def made(radius):
        recipe = PumpkinRecipe(Gore(PumpkinCurve(5.0, (0.25, radius)), 48, ConstantAngle(1.0)), (8, 2))
        surface = recipe.surface()
        return one.with_changes(surface=surface, pattern=recipe.pattern(surface))

    one = balloon(divisions=(8, 2))
    state = inflate(made(0.25), 200.0, options=NewtonOptions(rtol=1e-12))
    adjoint, h = Adjoint(state), 1e-4
    low, high = made(0.25 - h), made(0.25 + h)
    expected = differences(low, high, [200.0] * 2, (1, 4), h)
    found = {
        s.quantity if s.harmonic is None else s.harmonic: s.between(low, high) / (2 * h)
        for s in (
            adjoint.volume(),
            adjoint.tendon_tension(),
            adjoint.max_stress(),
            adjoint.stress_norm(),
            adjoint.eigenvalue(1),
            adjoint.eigenvalue(4),
        )
    }
    assert found == pytest.approx(expected, rel=1e-4)


@pytest.mark.slow
def test_critical_pressures_by_parameters():
    one = balloon(gores=160, divisions=(8, 2), parts=(), gas=None)
    near = critical_pressures(one, [3], up_to=600.0, start=60.0)
    found = critical_sensitivity(near.state, 3, rtol=1e-11)
    assert found.quantity == "critical_pressure"
    assert found.value == pytest.approx(near.pressure, rel=1e-3)
    assert abs(find_modes(found.state, 1, harmonics=[3]).lowest) < 1e-8 * found.value
    h = 1e-5
    low, high = (
        critical_sensitivity(inflate(changed(one, "E", s), near.pressure), 3, rtol=1e-11).value
        for s in (-h, h)
    )
    assert found.by["E"] == pytest.approx((high - low) / (2 * h), rel=1e-6)
    low, high = (
        critical_sensitivity(inflate(wider(one, s), near.pressure), 3, rtol=1e-11).value for s in (-h, h)
    )
    assert found.along(direction(one)) == pytest.approx((high - low) / (2 * h), rel=1e-6)
    assert "pressure" not in found.by
    assert repr(found).startswith(f"Sensitivity(critical pressure of n = 3: {found.value:.6g} Pa")


def test_misuse():
    one = pumpkin(divisions=(4, 2))
    state = inflate(one, 100.0)
    with pytest.raises(InputError, match="this is a whole balloon; mesh one sector"):
        Adjoint(inflate(pumpkin(divisions=(4, 2), full=True), 100.0))
    volume = Adjoint(state).volume()
    with pytest.raises(InputError, match="free of stress as drawn and has no pattern"):
        volume.along(np.zeros(3))
    with pytest.raises(InputError, match=r"has \d+ unknowns, not \d+; mesh all alike"):
        volume.between(pumpkin(divisions=(6, 2)), one)
    with pytest.raises(InputError, match="leave the sealed gas out"):
        Adjoint(seal(state, 1e5))
    flat = pumpkin(divisions=(4, 2), flat=True)
    with pytest.raises(InputError, match="the direction has 3 numbers and the pattern"):
        Adjoint(inflate(flat, 100.0)).volume().along(np.zeros(3))
    with pytest.raises(InputError, match=r"growth returns \(\) for"):
        flat.surface.recipe.widening(flat.surface, lambda share: 1.0)
