"""Shapes and their meshes: meridians, natural shapes, structured grids, `Surface`.

What belongs here is geometry: where the film lies, and which of its nodes and edges carry a name. Material,
loads and unknowns do not: this room and `model` do not import each other.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lobefem.faces import face

if TYPE_CHECKING:
    from lobefem.geometry.cylinder import Cylinder
    from lobefem.geometry.isotensoid import Isotensoid
    from lobefem.geometry.meridian import Lobe
    from lobefem.geometry.natural_shape import NaturalShape, isotensoid_stiffness
    from lobefem.geometry.stacks import coarser, cylinder, lobed_cylinder, sector_of
    from lobefem.geometry.surface import Surface

__all__ = [
    "Cylinder",
    "Isotensoid",
    "Lobe",
    "NaturalShape",
    "Surface",
    "coarser",
    "cylinder",
    "isotensoid_stiffness",
    "lobed_cylinder",
    "sector_of",
]

_HOME = {
    "Cylinder": "cylinder",
    "NaturalShape": "natural_shape",
    "Isotensoid": "isotensoid",
    "Lobe": "meridian",
    "Surface": "surface",
    "coarser": "stacks",
    "cylinder": "stacks",
    "isotensoid_stiffness": "natural_shape",
    "lobed_cylinder": "stacks",
    "sector_of": "stacks",
}

__getattr__ = face(__name__, _HOME)
