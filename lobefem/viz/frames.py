"""Shapes on the way of a perturbation, a few dozen of them, for pictures of the motion.

    frames/mesh.npz      nodes from a point on the axis, cells, direction of the axis
    frames/000012.npz    displacement at point 12 of the history

All in single precision, in the order of the mesh's input. Which points are kept the number alone says, so
that a run that was stopped goes on with the same, on any number of ranks.
"""

from __future__ import annotations

import zipfile
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from lobefem.errors import InputError
from lobefem.files import on_root, replacing
from lobefem.frozen import Frozen
from lobefem.typing import Array
from lobefem.viz.film_mesh import FilmMesh, around, film_mesh

if TYPE_CHECKING:
    from lobefem.equilibrium.state import State

__all__ = ["FRAMES", "Frames", "keep_frame", "load_frames"]

FRAMES = 48  # at most


@dataclass(frozen=True)
class Frames(Frozen):
    """Shapes of a motion.

    Attributes:
        film_mesh: the film undeformed.
        points: of the history, at which the shapes are, ascending.
        displacements: of each (nodes, 3) [m].
    """

    film_mesh: FilmMesh = field(repr=False)
    points: tuple[int, ...]
    displacements: tuple[Array, ...] = field(repr=False)


def keep_frame(folder: Path, point: int, state: State, always: Collection[int] = ()) -> None:
    """Keep a shape, if it is one of those to keep: every 2^k-th, k as small as leaves 48. Collective.

    Args:
        folder: of the run.
        point: of the history, from 0.
        state: of the balloon in motion.
        always: points whose shapes stay in any case.

    Raises:
        InputError: the file system refuses.
    """
    from lobefem.geometry import gather  # frames are read without DOLFINx

    stride = 1
    while point >= FRAMES * stride:
        stride *= 2
    if point % stride and point not in always:
        return
    balloon = state.balloon
    moved = {"displacement": gather.at_nodes(balloon.V, state.displacement)}
    whole = gather.gather(balloon.mesh, moved, {})

    def write() -> None:
        assert whole is not None
        frames = folder / "frames"
        frames.mkdir(exist_ok=True)
        if not (frames / "mesh.npz").exists():
            axis = balloon.axis
            mesh = {"x": whole.x - axis.origin, "cells": whole.cells, "axis": axis.direction}
            _save(frames / "mesh.npz", mesh | {"around": np.array(around(balloon))})
        _save(frames / f"{point:06d}.npz", whole.nodal)
        for path in frames.glob("[0-9]*.npz"):
            if int(path.stem) % stride and int(path.stem) not in always:
                path.unlink()

    on_root(balloon.comm, folder, write)


def _save(path: Path, arrays: Mapping[str, Any]) -> None:
    with replacing(path) as stream:
        single = {k: a.astype(np.float32) if a.dtype == np.float64 else a for k, a in arrays.items()}
        np.savez(stream, **single)


def load_frames(folder: Path) -> Frames | None:
    """The shapes that a run has kept, None without any. Needs no communication.

    Raises:
        InputError: files that are no such shapes.
    """
    paths = sorted((folder / "frames").glob("[0-9]*.npz"))
    if not paths:
        return None
    mesh = _load(folder / "frames" / "mesh.npz", "x", "cells", "axis", "around")
    fields = [_load(path, "displacement")["displacement"].astype(float) for path in paths]
    x, cells = mesh["x"].astype(float), mesh["cells"]
    sound = cells.ndim == 2 and cells.shape[1] in (3, 4, 6, 9) and 0 <= cells.min() <= cells.max() < len(x)
    if not sound or x.shape[1:] != (3,) or any(field.shape != x.shape for field in fields):
        raise InputError(f"'{folder / 'frames'}' holds shapes of another mesh; run the perturbation again")
    points = tuple(int(path.stem) for path in paths)
    return Frames(film_mesh(x, cells, mesh["axis"], int(mesh["around"])), points, tuple(fields))


def _load(path: Path, *names: str) -> dict[str, npt.NDArray[Any]]:
    try:
        with np.load(path, allow_pickle=False) as file:
            return {name: file[name] for name in names}
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(f"'{path}' cannot be read ({error}); run the perturbation again") from None
