"""A design on a mesh of one's own: what holds it, cables on its named edges, and what it cannot have."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BeforeValidator, model_validator

from lobefem.errors import InputError
from lobefem.io.design_sections import Film, Mesh, Plates, Section
from lobefem.io.design_values import fill, flag, group_name, listed, positive, quantity
from lobefem.units import FORCE, LENGTH, NUMBER, shown

if TYPE_CHECKING:
    from lobefem.geometry.surface import Surface
    from lobefem.io.design import Design

__all__ = [
    "CableTable", "FixedTable", "Supports", "cables_of", "complete", "is_step", "one_or_more", "read",
    "require_none",
]  # fmt: skip

# laws without a direction of their own
_LAWS = ("tension-field", "isotropic")


def _components(value: Any) -> str:
    if not isinstance(value, str) or not value or sorted(set(value) & set("xyz")) != sorted(value):
        raise ValueError(f'{shown(value)} are no components; give some of x, y and z, e.g. "xy"')
    return value


def one_or_more(value: Any) -> Any:
    """A list of tables; one alone, [fixed], is a list of one."""
    return [value] if isinstance(value, Mapping) else value


class FixedTable(Section):
    """[[fixed]]: an edge group whose displacement is zero in the components named."""

    on: Annotated[str, BeforeValidator(group_name)]
    components: Annotated[str, BeforeValidator(_components)] = "xyz"


class CableTable(Section):
    """[[cables]]: a cable on an edge group, by its length at rest or by the share that it is shorter."""

    on: Annotated[str, BeforeValidator(group_name)]
    EA: Annotated[float, positive(FORCE)]
    rest_length: Annotated[float | None, positive(LENGTH)] = None
    foreshortening: Annotated[float, quantity(NUMBER, "in (-0.5, 0.5)", lambda v: -0.5 < v < 0.5)] = 0.0
    tension_only: Annotated[bool, BeforeValidator(flag)] = True

    @model_validator(mode="after")
    def _one_length(self) -> CableTable:
        if self.rest_length is not None and self.foreshortening:
            raise ValueError(
                f"rest_length = {self.rest_length} and foreshortening = {self.foreshortening} both give the "
                "length; leave one out"
            )
        return self


class Supports(Section):
    """[supports]: `free = true` for a closed body that nothing holds."""

    free: Annotated[bool | None, BeforeValidator(flag)] = None


def complete(design: Design, film: Film) -> None:
    """Fill in the defaults of a mesh of one's own: its law, and that it has no divisions.

    Args:
        design: under construction.
        film: its film, which may be changed.

    Raises:
        ValueError: a key that does not go with a mesh; the text begins with it.
    """
    if "law" not in film.model_fields_set:
        fill(film, "law", _LAWS[0])
    elif film.law not in _LAWS:
        raise ValueError(
            f"film.law = {film.law!r} follows a lobe's own directions; on kind 'mesh' use {listed(_LAWS)}"
        )
    if design.hoops.enabled:
        raise ValueError("hoops are on seams, and kind 'mesh' has none; write [[cables]] on its edges")
    _check_mesh(design)
    _check_free(design)
    mesh = design.mesh.model_copy()
    if "divisions" not in mesh.model_fields_set:
        fill(mesh, "divisions", None)
    fill(design, "mesh", mesh)
    plates, plain = design.plates, Plates()
    if plates.bottom is None:
        for key in ("support", "bar", "lift"):
            if getattr(plates, key) != getattr(plain, key):
                raise ValueError(
                    f"plates.{key} = {shown(getattr(plates, key))} is of end plates; name the rims that they "
                    "close, bottom and top, or leave it out"
                )


def _check_free(design: Design) -> None:
    """Refuse what would hold a body that is to be free."""
    if design.supports.free and (design.fixed or design.plates.bottom is not None):
        what = "fixed" if design.fixed else "plates.bottom"
        raise ValueError(f"{what} holds film that supports.free = true says is free; leave one of them out")


def _check_mesh(design: Design) -> None:
    """Refuse keys of [mesh] that would make another mesh than the file's."""
    mesh, file = design.mesh, shown(design.shape.file)
    free = ("layout", "size", "order") if is_step(design) else ()
    plain = Mesh()
    for key in Mesh.model_fields:
        given = "divisions" in mesh.model_fields_set if key == "divisions" else True
        value = getattr(mesh, key)
        if (
            key not in free
            and given
            and value is not None
            and (key == "divisions" or value != getattr(plain, key))
        ):
            value = list(value) if isinstance(value, tuple) else value
            has = "is meshed in triangles" if free else "has cells of its own"
            raise ValueError(f"mesh.{key} = {shown(value)} does not fit {file}, which {has}; leave it out")
    if free and mesh.size is None:
        raise ValueError(
            f"mesh.size is missing, with which {file} is meshed; give metres and layout = 'unstructured'"
        )


def require_none(design: Design) -> None:
    """Refuse what belongs to a mesh of one's own beside another shape, with a ValueError."""
    given: dict[str, Any] = {
        "fixed": design.fixed,
        "cables": design.cables,
        "supports.free": design.supports.free,
        "plates.bottom": design.plates.bottom,
    }
    for key, value in given.items():
        if value:
            raise ValueError(f"{key} needs a mesh of your own, shape.kind = 'mesh'; leave it out")


def is_step(design: Design) -> bool:
    """True if the shape is a STEP file, which is to be meshed."""
    return (design.shape.file or "").lower().endswith((".step", ".stp"))


def read(design: Design, comm: Any) -> Surface:
    """The surface of a mesh of one's own. Collective."""
    from lobefem.geometry.surface import Surface

    shape, mesh, plates = design.shape, design.mesh, design.plates
    rims = None
    if plates.bottom is not None and plates.top is not None:
        rims = plates.bottom, plates.top
    if is_step(design):
        assert mesh.size is not None
        return Surface.from_step(shape.file, mesh.size, comm, order=mesh.order, plates=rims)
    return Surface.from_msh(shape.file, comm, plates=rims)


def cables_of(design: Design, surface: Surface) -> list[Any]:
    """The cables of a design on its surface. Collective.

    Raises:
        InputError: an edge group that the surface does not have, or a length far from that of its edges.
    """
    from lobefem.model.cables import Cables

    found = []
    for number, table in enumerate(design.cables):
        shorter = table.foreshortening
        if table.rest_length is not None:
            drawn = surface.length(table.on)
            shorter = 1 - table.rest_length / drawn
            if not -0.5 < shorter < 0.5:
                raise InputError(
                    f"cables[{number}].rest_length = {table.rest_length:g} m is far from the {drawn:.4g} m "
                    f"of the edges '{table.on}'; give the length of the whole cable without load"
                )
        found.append(Cables(table.EA, (table.on,), None, shorter, table.tension_only))
    return found
