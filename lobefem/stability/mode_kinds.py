"""The kind of a mode: sway, twist, global or local."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from lobefem.fem.balloon import Balloon
from lobefem.fem.cylindrical import cylindrical
from lobefem.fem.functionals import straining_share

__all__ = ["kind_of"]


def kind_of(balloon: Balloon, displacement: npt.NDArray[np.complex128], harmonic: int) -> str:
    """The kind of a mode, after the paper's sec. 5: "sway", "twist", "global" or "local".

    n = 1 moves the axis sideways (sway); n = 0 turns about it (twist) or stretches and breathes
    (global). With n >= 2 plates and axis stay. Such a mode is local where it strains the film rather
    than turning it, the coupled hoopwise and radial distortion of the paper: strain makes up 0.5 to
    0.9 of the displacement gradient of wrinkled film, which has no stiffness against it, and less than
    0.2 of that of isotropic film, which has no local modes.

    Args:
        balloon: whose mode it is, or one sector of it.
        displacement: nodal displacements (nodes, 3).
        harmonic: the dominant n.

    Collective.
    """
    if harmonic == 1:
        return "sway"
    if harmonic == 0:
        _, _, frame = cylindrical(balloon)
        field = np.einsum("nij,nj->ni", frame, displacement[: len(frame)])
        components = balloon.comm.allreduce((np.abs(field) ** 2).sum(axis=0))
        return "twist" if components[1] > components.sum() / 2 else "global"
    return "local" if straining_share(balloon, displacement.real, displacement.imag) > 0.3 else "global"
