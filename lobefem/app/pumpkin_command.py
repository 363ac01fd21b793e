"""Pumpkins on the command line: their measures in the results of `inflate`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lobefem.equilibrium.pumpkin_measures import measure
from lobefem.io.design_tables import GRAVITY
from lobefem.io.pumpkin_design import masses

if TYPE_CHECKING:
    from lobefem.equilibrium.state import Equilibrium
    from lobefem.io.design import Design

__all__ = ["results", "warnings"]


def results(design: Design, state: Equilibrium) -> dict[str, Any]:
    """The entries of a pumpkin in the results of `inflate`. Collective."""
    found = measure(state)
    gradient = design.pressure.gradient
    return {
        "gores": design.shape.gores,
        "diameter": found.diameter,
        "tendon_diameter": found.tendon_diameter,
        "height": found.height,
        "stations": found.stations.tolist(),
        "tendon_tension": found.tendon_tension.tolist(),
        "bulge_half_angle": found.bulge_half_angle.tolist(),
        "bulge_radius": found.bulge_radius.tolist(),
        "meridional_resultant": found.resultants[:, 0].tolist(),
        "hoop_resultant": found.resultants[:, 1].tolist(),
        "meridional_strain": found.strains[:, 0].tolist(),
        "hoop_strain": found.strains[:, 1].tolist(),
        "mass": masses(design, state.balloon),
        "lift": gradient * state.volume if gradient else None,
    }


def warnings(results: dict[str, Any]) -> list[str]:
    """Sentences on tendons without use and balloons that do not rise."""
    said = []
    if not any(results["tendon_tension"]):
        said.append(
            "the tendons are slack everywhere, so the film alone bears the load; give shorter ones, "
            "tendons.foreshortening = 0.01 say"
        )
    weight = GRAVITY * results["mass"]
    if results["lift"] is not None and results["lift"] < weight:
        said.append(
            f"the lift of {results['lift']:.4g} N is less than the weight of {weight:.4g} N: the balloon "
            "stands on its bottom fitting"
        )
    return said
