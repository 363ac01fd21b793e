"""Keys of results.json of `perturb`: the ramp of a distortion, and the release."""

from __future__ import annotations

from lobefem.io.shared_keys import Entry
from lobefem.outcomes import UNKNOWN

__all__ = ["PERTURB"]

PERTURB: dict[str, Entry] = {
    "distortion": ("", "distortion that was imposed"),
    "parameter": ("unit", "size of the distortion"),
    "unit": ("", "unit of the parameter: m or degrees"),
    "reaction_unit": ("", "unit of the reaction: N or N m"),
    "pressure": ("Pa", "gas pressure"),
    "contact": ("", "true if film and plates may touch"),
    "release": ("", "true if the balloon was released"),
    "volume_original": ("m^3", "volume of the pressurised balloon"),
    "volume_imposed": ("m^3", "volume at the end of the ramp"),
    "volume_final": ("m^3", "volume at rest"),
    "imposed_ratio": ("", "volume_imposed over volume_original"),
    "reaction": ("reaction_unit", "reaction of the constraint at the end of the ramp"),
    "outcome": (
        "",
        f"returned, distorted and stable, {UNKNOWN}, not an equilibrium; or under the constraint",
    ),
    "min_eigenvalue": ("Pa/m", "lowest real part at the end, without rigid rotations; null if unknown"),
    "eigenvalues": ("Pa/m", "lowest real parts at the end; only after a release"),
    "gores": ("", "number of gores; this and the next two only of pumpkins"),
    "symmetric_eigenvalue": ("Pa/m", "lowest one of the pressurised balloon before, of all harmonics"),
    "symmetric_harmonic": ("", "its harmonic n"),
    "pressure_final": ("Pa", "gas pressure at rest; this and what follows only after a release"),
    "volume_deficit": ("", "share of the original volume that the balloon at rest lacks"),
    "energy_above": (
        "J",
        "potential energy at rest less that of the original balloon; null under film load",
    ),
    "contact_force": ("N", "total contact force at rest; null without contact"),
    "contact_area": ("m^2", "area of one side of the film in contact at rest; null without contact"),
    "residual": ("", "residual at the end over the norm of the nodal forces of the pressure"),
    "first_contact": (
        "unit",
        "parameter at which film first touches; null without contact",
    ),
    "smallest_gap": (
        "m",
        "smallest gap between parts of the film that share no node; null without contact",
    ),
    "distance": ("m", "largest distance of a node from the undistorted shape; null without a release"),
    "rotation": ("rad", "angle of the rigid motion that was removed before"),
    "energy.strain": ("J", "gain in strain energy of film, cables and bar"),
    "energy.contact": ("J", "gain in contact energy"),
    "energy.pressure": ("J", "work of the gas"),
    "energy.constraint": ("J", "work of the constraint"),
    "energy.damping": ("J", "energy taken by the damping of the release"),
    "energy.euler": ("J", "the same as implicit Euler counts it"),
    "energy.closure": ("J", "energy that the balance does not account for"),
    "energy.error": ("", "closure over the largest term"),
    "history[].parameter": ("unit", "size of the distortion; one record for each accepted step"),
    "history[].reaction": ("reaction_unit", "reaction of the constraint; 0 in the release"),
    "history[].volume": ("m^3", "enclosed by film and plates"),
    "history[].mid_hoop_displacement": ("m", "sideways displacement of the centre of the middle hoop"),
    "history[].contact_force": ("N", "total contact force"),
    "history[].time": ("s", "time in the release; null in the ramp"),
    "history[].residual": ("", "unbalanced forces over the norm of the nodal forces of the pressure"),
    "history[].ledger.strain": ("J", "gain in strain energy from the pressurised balloon on"),
    "history[].ledger.contact": ("J", "gain in contact energy"),
    "history[].ledger.pressure": ("J", "work of the gas"),
    "history[].ledger.constraint": ("J", "work of the constraint"),
    "history[].ledger.damping": ("J", "energy taken by damping"),
    "history[].ledger.euler": ("J", "the same as implicit Euler counts it"),
}
