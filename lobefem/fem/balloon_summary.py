"""Summary of a `Balloon` in a few lines."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lobefem.display import Summary, number

if TYPE_CHECKING:
    from lobefem.fem.balloon import Balloon

__all__ = ["summary"]


def summary(balloon: Balloon) -> Summary:
    """Its film, gas, plates and cables in rows."""
    film, plates, surface = balloon.film, balloon.plates, balloon.surface
    lobes = f"{surface.num_lobes} lobe{'s' if surface.num_lobes > 1 else ''}"
    mesh = "unstructured mesh" if surface.divisions is None else "{} x {}".format(*surface.divisions)
    bar: Any = plates.bar if plates is not None else False
    stiffness = number(bar, "N") if not isinstance(bar, bool) else "rigid" if bar else "none"
    varies = "varies"
    thickness = varies if film.thickness in film.varying else f"{1e3 * film.thickness:g} mm"
    modulus = varies if film.E in film.varying else f"{film.E:g} Pa"
    rows = [
        ("film", f"{type(film).__name__}, {thickness}, E = {modulus}, nu = {film.nu:g}"),
        ("gas", f"{balloon.load.convention} load"),
        ("plates", "none" if plates is None else f"{plates.support}, bar {stiffness}"),
        *(("cables", f"{', '.join(cable.on)}, EA = {cable.EA:g} N") for cable in balloon.cables),
        ("built-in stress", "the lobe's own" if balloon.prestressed else "none"),
    ]
    if balloon.contact is not None:
        rows.append(("contact", "film and plates"))
    return Summary(f"{lobes}, {mesh}", tuple(rows))
