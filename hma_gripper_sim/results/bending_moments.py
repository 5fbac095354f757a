"""Bending moments of the beams' sections, recovered from joint moments and forces.

A joint of the ``thesis`` discretisation stands at the section it speaks for.  One of the others
stands within its GBE: the moment at the GBE's ends follows from it and the force
that the joint transmits, and converges at second order in the GBE's length.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.mechanics.body_motion import body_motion
from hma_gripper_sim.mechanics.discretisations.by_name import DISCRETISATIONS
from hma_gripper_sim.mechanics.scene import Scene

Array = NDArray[np.float64]


def joints_at_sections(scene: Scene) -> bool:
    """Whether the moments of the scene's joints are the bending moments of its sections."""
    return DISCRETISATIONS[scene.resolution.discretisation].joints_at_sections


def section_moments(
    scene: Scene, q: Array, v: Array, a: Array, wrench: Array, acceleration: Array
) -> Array:
    """Bending moments along one half [N m], shape (r, n_sections).

    Parameters
    ----------
    q, v, a
        Joint angles [rad], rates and accelerations of that half, shape (r, n).
    wrench
        Contact wrench on the tip (fx, fz, moment), shape (r, 3).
    acceleration
        Of the prismatic joint, positive towards the object [m/s^2], shape (r,).
    """
    half, chain = scene.half, scene.half.chain
    moment: Array = -(chain.stiffness * q + chain.damping * v)
    if joints_at_sections(scene):
        return moment
    motion = body_motion(chain, q, v, a)  # vectors of the plane as complex numbers, x + i z
    direction = motion.direction
    weight = chain.mass * (scene.gravity - acceleration)[:, None]  # as the moving base feels it
    load: NDArray[np.complex128] = -chain.mass * motion.centre_acceleration - 1j * weight
    load[:, -1] += wrench[:, 0] + 1j * wrench[:, 1]
    force = -np.cumsum(load[:, ::-1], axis=1)[:, ::-1]  # of the inner on the outer part

    outer = half.outer * direction
    first_beam = next(i for i, (part, _) in enumerate(half.joints) if part == "beam")
    corner = half.beam_start[1] @ (1.0, 1j)
    into_beam = complex(*chain.link[first_beam - 1]) - corner
    inner = np.stack(
        [
            np.full(len(q), -chain.root[0] + 0j),
            -direction[:, first_beam - 1] * into_beam,
        ],
        axis=1,
    )
    starts = [0, first_beam]
    at_ends = moment - _cross(outer, force)
    at_starts = moment[:, starts] - _cross(inner, force[:, starts])
    return np.asarray(np.concatenate([at_starts, at_ends], axis=1))


def _cross(a: NDArray[np.complex128], b: NDArray[np.complex128]) -> Array:
    return np.asarray((np.conj(a) * b).imag)
