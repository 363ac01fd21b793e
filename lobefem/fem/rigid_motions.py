"""Rigid rotations that a support leaves free: their number, and displacements with the rotation taken out."""

from __future__ import annotations

import math

import numpy as np

from lobefem.fem.balloon import Balloon
from lobefem.fem.functionals import largest, owned_nodes
from lobefem.model.end_plates import PlateLoad
from lobefem.typing import Array

__all__ = ["distance_of", "free_to_rotate", "is_turn", "largest_of_state", "num_turns"]


# --- rigid motions that supports leave ----------------------------------------------------------
def free_to_rotate(balloon: Balloon) -> bool:
    """True if nothing resists a tilt about the bottom plate's centre.

    That is under a pinned support alone: a dead load on the top plate, held film or a guide has a say in it.
    """
    loads = [part for part in balloon.components if isinstance(part, PlateLoad)]
    return (
        balloon.plates is not None
        and balloon.plates.support == "pinned"
        and balloon.prescribed is None
        and not balloon.fixed
        and not any(any(load.force) or any(load.moment) for load in loads)
    )


def distance_of(balloon: Balloon, from_: Array, to: Array) -> tuple[float, float]:
    """Largest distance of a node between two shapes [m], and the turn taken out of it [rad].

    Where the bottom plate can tilt about its centre the one shape is turned about that into the best fit
    (Kabsch 1976); that of a free body is also shifted. Collective.

    Args:
        balloon: of both.
        from_: nodal displacements of the one shape (nodes, 3).
        to: those of the other.
    """
    x, areas = owned_nodes(balloon)
    a, b = x + from_[: len(x)], x + to[: len(x)]
    turn = np.eye(3)
    if num_turns(balloon):
        if balloon.motion is not None:
            middles = np.stack([balloon.motion.centres[0]] * 2)
        else:  # of a free body the centres of area
            sums = [(areas[:, None] * points).sum(axis=0) for points in (a, b)]
            middles = balloon.comm.allreduce(np.stack(sums)) / balloon.comm.allreduce(float(areas.sum()))
        a, b = a - middles[0], b - middles[1]
        U, _, Vt = np.linalg.svd(balloon.comm.allreduce((b * areas[:, None]).T @ a))
        turn = U @ np.diag([1, 1, np.sign(np.linalg.det(U @ Vt))]) @ Vt
    sine = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
    angle = math.atan2(float(np.linalg.norm(sine)), (np.trace(turn) - 1) / 2)
    return largest(balloon, b - a @ turn.T), angle


def largest_of_state(balloon: Balloon, displacement: Array) -> float:
    """Largest nodal displacement of a state [m], without the rigid motions that its supports leave free.

    No force sets these: it is what round-off over a stiffness of zero makes it. Collective.
    """
    if not num_turns(balloon):
        return largest(balloon, displacement)
    return distance_of(balloon, np.zeros_like(displacement), displacement)[0]


def num_turns(balloon: Balloon) -> int:
    """Rigid motions that the supports leave: a pinned bottom plate's two tilts, all six of a free body."""
    return 6 if balloon.floating else 2 if free_to_rotate(balloon) else 0


def is_turn(balloon: Balloon, displacement: Array, motion: Array) -> bool:
    """True if a motion of a displaced balloon is a turn that its supports leave, to a thousandth. Collective.

    Args:
        balloon: whose.
        displacement: of its nodes (nodes, 3).
        motion: the same of a small motion from there.
    """
    if not num_turns(balloon):
        return False
    x, areas = owned_nodes(balloon)
    centre = balloon.axis.origin if balloon.motion is None else balloon.motion.centres[0]
    arm = x + displacement[: len(x)] - centre
    turns = np.stack([np.cross(axis, arm) for axis in np.eye(3)]).reshape(3, -1)
    if balloon.floating:
        shifts = np.broadcast_to(np.eye(3)[:, None], (3, *arm.shape)).reshape(3, -1)
        turns = np.concatenate([turns, shifts])
    weights = np.repeat(areas, 3)
    v = motion[: len(x)].ravel()
    sums = balloon.comm.allreduce(np.vstack([turns, v]) * weights @ np.vstack([turns, v]).T)
    gram, part, whole = sums[:-1, :-1], sums[:-1, -1], sums[-1, -1]
    rest = whole - part @ np.linalg.solve(gram, part)
    return bool(rest <= 1e-6 * whole)
