"""Pictures of a pumpkin's modes: all gores with their bulges, coloured by the motion out and in."""

from __future__ import annotations

from typing import Any

import numpy as np

from lobefem.typing import Array
from lobefem.viz.film_mesh import FilmMesh, facing, normals
from lobefem.viz.mode_figures import drawn_amplitude
from lobefem.viz.views import Panel, Scale

__all__ = ["mode_panel"]


def mode_panel(
    caption: str, kind: str, film: FilmMesh, state: Array, field: Any, *, phase: float = 0.0
) -> Panel:
    """A mode of all gores, exaggerated, on the balloon under pressure.

    Args:
        caption: over it.
        kind: of the mode.
        film: of all gores.
        state: node positions under pressure (nodes, 3) [m].
        field: displacement of the mode (nodes, 3), complex for one that turns as it swings.
        phase: of the swing [rad]: the real part of field times e^(-i phase) is drawn.
    """
    factor = drawn_amplitude(kind, film, field, 0.06)
    moved = (field * np.exp(-1j * phase)).real
    outward = np.einsum("ij,ij->i", moved[film.faces].mean(axis=1), normals(state[film.faces]))
    # which way round the cells are is the mesh's
    out = np.einsum("ij,ij->i", state[film.faces].mean(axis=1), normals(state[film.faces]))
    outward *= np.sign(np.median(out))
    largest = float(
        np.abs(np.einsum("ij,ij->i", field[film.faces].mean(axis=1), normals(state[film.faces]))).max()
    )
    scale = Scale("inwards and outwards, relative", -1.0, 1.0, "PuOr_r")
    return Panel(caption, state + factor * moved, facing(film, field.real), outward / (largest or 1.0), scale)
