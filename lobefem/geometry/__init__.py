"""Shapes and their meshes: meridians, natural shapes, structured grids, `Surface`.

What belongs here is geometry: where the film lies, and which of its nodes and edges carry a name. Material,
loads and unknowns do not: this room and `model` do not import each other.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from lobefem.faces import face

if TYPE_CHECKING:
    from lobefem.geometry.flat_cylinder import Cylinder
    from lobefem.geometry.gore import ConstantAngle, ConstantRadius, FlatLobe, Gore, TabulatedWidth
    from lobefem.geometry.isotensoid import Isotensoid
    from lobefem.geometry.meridian import Lobe
    from lobefem.geometry.natural_curve import NaturalCurve
    from lobefem.geometry.natural_shape import NaturalShape, isotensoid_stiffness
    from lobefem.geometry.pumpkin import PumpkinRecipe
    from lobefem.geometry.pumpkin_curve import PumpkinCurve
    from lobefem.geometry.stacks import StackRecipe, coarser, cylinder, lobed_cylinder, sector_of
    from lobefem.geometry.surface import Surface
    from lobefem.geometry.tendon_curve import TendonCurve

_HOME = {
    "ConstantAngle": "gore",
    "ConstantRadius": "gore",
    "Cylinder": "flat_cylinder",
    "FlatLobe": "gore",
    "Gore": "gore",
    "Isotensoid": "isotensoid",
    "Lobe": "meridian",
    "NaturalCurve": "natural_curve",
    "NaturalShape": "natural_shape",
    "PumpkinCurve": "pumpkin_curve",
    "PumpkinRecipe": "pumpkin",
    "StackRecipe": "stacks",
    "Surface": "surface",
    "TabulatedWidth": "gore",
    "TendonCurve": "tendon_curve",
    "coarser": "stacks",
    "cylinder": "stacks",
    "isotensoid_stiffness": "natural_shape",
    "lobed_cylinder": "stacks",
    "sector_of": "stacks",
}

__all__ = [
    "ConstantAngle",
    "ConstantRadius",
    "Cylinder",
    "FlatLobe",
    "Gore",
    "Isotensoid",
    "Lobe",
    "NaturalCurve",
    "NaturalShape",
    "PumpkinCurve",
    "PumpkinRecipe",
    "StackRecipe",
    "Surface",
    "TabulatedWidth",
    "TendonCurve",
    "coarser",
    "cylinder",
    "isotensoid_stiffness",
    "lobed_cylinder",
    "sector_of",
]

__getattr__, __dir__ = face(__name__, _HOME)
