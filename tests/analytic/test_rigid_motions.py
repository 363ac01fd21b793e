"""Rigid-body modes of the tangent at a pressurised equilibrium: the number of motions without resistance.

Residuals turn with the film, r(R x) = R r(x). Where r = 0 the derivative along a rotation is therefore
K (omega x x) = omega x r = 0, and along a translation K a = 0: a closed film without supports has
exactly six null vectors, whatever its law, although the pressure follows it. A pinned stack (bottom
centre and spin held) keeps two, the rotations about the two axes across, if the supports' reaction does no
work on them: it acts at the centre. That holds for `closed` and for `film` load.
"""

from dataclasses import replace

import numpy as np
import pytest
from flatfilm import nodal, sphere

from lobefem.equilibrium.inflation import inflate
from lobefem.equilibrium.solver_options import NewtonOptions
from lobefem.fem.balloon import Balloon
from lobefem.fem.rigid_plates import rotation
from lobefem.geometry.stacks import lobed_cylinder
from lobefem.model.cables import Hoops
from lobefem.model.end_plates import EndPlates
from lobefem.model.film import Isotropic
from lobefem.model.gas_pressure import GasPressure
from lobefem.model.kinematics import tangent_frame
from lobefem.model.supports import Fixed
from lobefem.model.tension_field import TensionField
from lobefem.stability.modes import find_modes

RADIUS, PRESSURE = 2.0, 500.0


def at_node(*point):
    return lambda x: np.linalg.norm(x - np.array(point)[:, None], axis=0) < 1e-9


# six components that hold a body and let it stretch as it likes: reactions are zero
SIX = (
    Fixed(at_node(RADIUS, 0, 0), (1, 2)),
    Fixed(at_node(-RADIUS, 0, 0), (1, 2)),
    Fixed(at_node(0, RADIUS, 0), (2,)),
    Fixed(at_node(0, 0, RADIUS), (0,)),
)


def ball(comm, film, parts):
    surface = sphere(comm, RADIUS, 3)
    frame = tangent_frame(surface.mesh, (0.3, 1.0, 0.2))
    return Balloon(surface, film, [GasPressure("closed"), *parts], frame=frame)


@pytest.mark.parametrize("film", [Isotropic(), TensionField()], ids=["isotropic", "tension-field"])
def test_a_closed_film_without_supports_has_six_zero_modes(comm, film):
    held = ball(comm, film, SIX)
    state = inflate(held, PRESSURE, options=NewtonOptions(rtol=1e-11))
    assert state.taut_area == pytest.approx(held.reference_area, rel=1e-12)
    free = ball(comm, film, ())
    q = free.map.create_vector()
    q.array[:] = state.displacement.ravel()[free.map.free]
    free.set_loads(PRESSURE)
    K = free.tangent(q)
    x = nodal(free) + state.displacement
    motions = [np.broadcast_to(e, x.shape) for e in np.eye(3)]
    motions += [np.cross(e, x) for e in np.eye(3)]
    scale = K.norm()
    for motion in motions:
        phi, force = q.duplicate(), q.duplicate()
        phi.array[:] = motion.ravel()[free.map.free]
        K.mult(phi, force)
        assert force.norm() < 1e-9 * scale * phi.norm()
    # and there is no seventh
    free_state = inflate(free, 0.0)
    modes = find_modes(with_unknowns(free_state, q, PRESSURE), count=8)
    assert modes.symmetric
    values = modes.values.real
    assert np.abs(values[:6]).max() < 1e-6 * values[6]
    subspace = np.stack([m.displacement for m in modes.modes[:6]])
    owned = free.V.dofmap.index_map.size_local
    found, exact = (np.stack(fields)[:, :owned].reshape(6, -1) for fields in (subspace, motions))
    # the computed six span the rigid motions, whatever their mixture
    gram = comm.allreduce(found @ found.T)
    mixed = comm.allreduce(found @ exact.T)
    left = comm.allreduce(np.einsum("ai,ai->a", exact, exact))
    projected = np.einsum("ab,ab->b", mixed, np.linalg.solve(gram, mixed))
    np.testing.assert_allclose(projected, left, rtol=1e-8)


def with_unknowns(state, q, pressure):
    return replace(state, unknowns=q.array_r.copy(), pressure=pressure)


def turning_rate(theta, axis):
    """The rate of the rotation vector theta of a plate that turns about `axis` at unit speed."""
    R, dR, _ = rotation(theta)
    spins = [dR[a] @ R.T for a in range(3)]
    return np.linalg.solve(np.array([[W[2, 1], W[0, 2], W[1, 0]] for W in spins]).T, axis)


@pytest.mark.parametrize("load", ["closed", "film"])
@pytest.mark.parametrize("bar", [True, False])
def test_a_pinned_stack_has_two_zero_modes(comm, load, bar):
    surface = lobed_cylinder(2, (6, 12), comm=comm)
    parts = [GasPressure(load), Hoops(EA=1e6), EndPlates("pinned", bar=bar)]
    balloon = Balloon(surface, Isotropic(), parts)
    # from the clamped state, which is the same by symmetry and is found from rest
    state = inflate(balloon, PRESSURE, options=NewtonOptions(rtol=1e-11))
    K = balloon.tangent(state.restore())
    x = nodal(balloon) + state.displacement
    for k, axis in enumerate(balloon.motion.across):
        phi, force = balloon.map.create_vector(), balloon.map.create_vector()
        free = balloon.map.free
        with phi as array:
            array[: free.size] = np.cross(axis, x).ravel()[free]
            if array.size > free.size:
                w = state.unknowns[free.size :]
                named = dict.fromkeys(balloon.motion.names, 0.0)
                named[f"bottom_tilt_{k + 1}"] = 1.0
                if bar:
                    named[f"bar_tilt_{k + 1}"] = 1.0
                else:
                    top = balloon.motion.length * balloon.motion.direction
                    top = top + w[list(balloon.motion.names).index("top_x") :][:3]
                    named |= dict(zip(("top_x", "top_y", "top_z"), np.cross(axis, top), strict=True))
                rate = turning_rate(w[-3:], axis)
                named |= dict(zip([f"top_rotation_{c}" for c in "xyz"], rate, strict=True))
                array[free.size :] = list(named.values())
        K.mult(phi, force)
        assert force.norm() < 1e-8 * K.norm() * phi.norm()
    values = find_modes(state, count=4).values
    assert np.abs(values[:2]).max() < 1e-6 * abs(values[2])
