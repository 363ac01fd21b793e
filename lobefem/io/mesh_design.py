"""Designs on a mesh of one's own: their defaults, what they cannot have, their surface and cables."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lobefem.errors import InputError
from lobefem.io.design_sections import Film, Mesh, Plates
from lobefem.io.design_tables import Tables
from lobefem.io.design_values import fill, listed
from lobefem.typing import Comm
from lobefem.units import shown

if TYPE_CHECKING:
    from lobefem.geometry.surface import Surface

__all__ = ["cables_of", "complete", "is_step", "read", "require_none"]

# laws without a direction of their own
_LAWS = ("tension-field", "isotropic")


def complete(design: Tables, film: Film) -> None:
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


def _check_free(design: Tables) -> None:
    """Refuse what would hold a body that is to be free."""
    if design.supports.free and (design.fixed or design.plates.bottom is not None):
        what = "fixed" if design.fixed else "plates.bottom"
        raise ValueError(f"{what} holds film that supports.free = true says is free; leave one of them out")


def _check_mesh(design: Tables) -> None:
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


def require_none(design: Tables) -> None:
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


def is_step(design: Tables) -> bool:
    """True if the shape is a STEP file, which is to be meshed."""
    return (design.shape.file or "").lower().endswith((".step", ".stp"))


def read(design: Tables, comm: Comm) -> Surface:
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


def cables_of(design: Tables, surface: Surface) -> list[Any]:
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
