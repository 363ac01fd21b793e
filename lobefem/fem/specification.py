"""`Specification`: what a balloon is made of, checked together before anything is assembled."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from lobefem import checks
from lobefem.display import Summarized, Summary, number
from lobefem.errors import InputError
from lobefem.frozen import OnMesh
from lobefem.geometry.meridian import Lobe
from lobefem.geometry.surface import Surface
from lobefem.model.components import Components, row
from lobefem.model.film import Film, require_film
from lobefem.model.kinematics import Frame
from lobefem.typing import Array, Expr, Unchecked

__all__ = ["LoadPath", "Specification"]


class _Filmed(Protocol):
    """A balloon, as far as a load path is asked for it."""

    @property
    def film(self) -> Film:
        """Law of its film."""

    @property
    def surface(self) -> Surface:
        """Surface of its film."""


class LoadPath(Protocol):
    """A state whose stress is built into another film."""

    @property
    def balloon(self) -> _Filmed:
        """Balloon of a film that leads to a stress."""

    @property
    def displacement(self) -> Array:
        """Nodal displacements of this rank, ghosts included (nodes, 3) [m]."""


@dataclass(frozen=True, eq=False, repr=False)
class Specification(OnMesh, Summarized):
    """The arguments of a `Balloon`, which describes them.

    `dataclasses.replace` makes that of the coarser, the sector's or the other film's balloon.

    Attributes:
        parts: the components, sorted by what they are.

    Raises:
        InputError: arguments of the wrong kind, or that do not go together.
    """

    surface: Surface
    film: Film
    components: Sequence[Any] = ()
    prestressed: bool = False
    hoop_slack: float = 0.0
    load_path: LoadPath | None = None
    frame: Frame | None = None
    quadrature_degree: int | None = None
    pattern: Expr | None = None
    layers: Expr | None = None
    extra_energy: Callable[[Any], Any] | None = None
    parts: Components = field(init=False)

    def __post_init__(self) -> None:
        checks.having("surface", self.surface, "mesh", "a Surface, such as lobed_cylinder makes")
        require_film(self.film)
        object.__setattr__(self, "components", row(self.components))
        object.__setattr__(self, "parts", Components.sort(self.components))
        _require_consistent(self)

    @property
    def bound_to_mesh(self) -> bool:
        """True if some argument is a function on the mesh of its own surface."""
        bound = (self.frame, self.load_path, self.pattern, self.layers)
        return bool(self.film.varying) or any(given is not None for given in bound)

    def _summary(self) -> Summary:
        return self.summary()

    def summary(self) -> Summary:
        """Film, gas, plates and cables in rows."""
        film, surface, plates = self.film, self.surface, self.parts.plates
        lobes = f"{surface.num_lobes} lobe{'s' if surface.num_lobes > 1 else ''}"
        mesh = "unstructured mesh" if surface.divisions is None else "{} x {}".format(*surface.divisions)
        bar: Any = plates.bar if plates is not None else False
        stiffness = number(bar, "N") if not isinstance(bar, bool) else "rigid" if bar else "none"
        varies = "varies"
        thickness = varies if film.thickness in film.varying else f"{1e3 * film.thickness:g} mm"
        modulus = varies if film.E in film.varying else f"{film.E:g} Pa"
        rows = [
            ("film", f"{type(film).__name__}, {thickness}, E = {modulus}, nu = {film.nu:g}"),
            ("gas", f"{self.parts.load.convention} load"),
            ("plates", "none" if plates is None else f"{plates.support}, bar {stiffness}"),
            *(("cables", f"{', '.join(cable.on)}, EA = {cable.EA:g} N") for cable in self.parts.cables),
            ("built-in stress", "the lobe's own" if self.prestressed else "none"),
        ]
        if self.parts.contact is not None:
            rows.append(("contact", "film and plates"))
        return Summary(f"{lobes}, {mesh}", tuple(rows))


def _require_consistent(given: Specification) -> None:
    """Refuse built-in stress, a film or a further energy that do not go with the rest."""
    surface, film, load_path = given.surface, given.film, given.load_path
    hoop_slack, prestressed = given.hoop_slack, given.prestressed
    extra_energy, frame = given.extra_energy, given.frame
    if extra_energy is not None and not callable(extra_energy):
        raise InputError(
            f"extra_energy is of type {type(extra_energy).__name__}; give a function of the balloon"
        )
    if not 0 <= checks.finite("hoop_slack", hoop_slack, "") < 1:
        raise InputError(f"hoop_slack = {hoop_slack} must be a strain in [0, 1), such as 1e-3")
    if hoop_slack and not prestressed and load_path is None:
        raise InputError(
            f"hoop_slack = {hoop_slack} is part of a built-in stress and there is none; pass "
            "prestressed=True or a load_path, or leave it out"
        )
    if prestressed and not isinstance(surface.shape, Lobe):
        raise InputError("prestress needs an isotensoid or a formed lobe; this surface is another shape")
    if film.directional and frame is None and not surface.of_revolution:
        raise InputError(
            f"{type(film).__name__} film has a direction, and this surface runs around no axis; give "
            "a frame, such as tangent_frame makes, or TensionField or Isotropic film"
        )
    if load_path is not None:
        if prestressed:
            raise InputError("the film gets its stress from the load path or by prestress, not from both")
        _check_load_path(load_path, surface, film)
    if film.leads_to_stress and (prestressed or load_path is not None):
        raise InputError(
            f"{type(film).__name__} film finds its stress from unstressed film; leave prestressed and "
            "load_path out, or give the law that takes over, such as TensionField"
        )


def _check_load_path(load_path: Unchecked, surface: Surface, to: Film) -> None:
    """Refuse a state whose stress cannot be built into a film, `to`, on a surface, with an InputError."""
    balloon = getattr(load_path, "balloon", None)
    if balloon is None:
        raise InputError(f"load_path is a {type(load_path).__name__}; give a state that `inflate` found")
    film = balloon.film
    if not film.leads_to_stress:
        raise InputError(
            f"load_path is a state of {type(film).__name__} film; give one that was inflated with "
            "PrescribedPath film"
        )
    for name in ("E", "nu", "thickness"):
        one, other = getattr(film, name), getattr(to, name)
        if one != other:
            raise InputError(
                f"load_path is of film with {name} = {one}, and this film has {other}; give both the same"
            )
    if balloon.surface.mesh is not surface.mesh:
        raise InputError("load_path is a state on another mesh; build both balloons on one surface")
