"""Bending moments of the beams' sections, recovered from joint moments and forces.

A joint of the ``thesis`` discretisation stands at the section it speaks for.  One of the others
stands within its GBE: the moment at the GBE's ends follows from it and the force
that the joint transmits, and converges at second order in the GBE's length.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hma_gripper_sim.mechanics.discretisations.by_name import DISCRETISATIONS
from hma_gripper_sim.mechanics.scene import Scene

Array = NDArray[np.float64]


def section_moments(scene: Scene, q: Array, v: Array, a: Array, wrench: Array) -> Array:
    """Bending moments along one half [N m], shape (r, n_sections).

    Parameters
    ----------
    q, v, a
        Joint angles [rad], rates and accelerations of that half, shape (r, n).
    wrench
        Contact wrench on the tip (fx, fz, moment), shape (r, 3).
    """
    half, chain = scene.half, scene.half.chain
    moment = -(chain.stiffness * q + chain.damping * v)
    if DISCRETISATIONS[scene.resolution.discretisation].joints_at_sections:
        return np.asarray(moment)
    # Vectors of the plane as complex numbers, x + i z.
    angle = np.cumsum(q + chain.rest, axis=1)
    turn = 1j * np.cumsum(a, axis=1) - np.cumsum(v, axis=1) ** 2
    direction = np.exp(1j * angle)
    link = direction * (chain.link[:, 0] + 1j * chain.link[:, 1])
    arm = direction * (chain.centre[:, 0] + 1j * chain.centre[:, 1])
    of_joint = np.cumsum(link * turn, axis=1) - link * turn
    load = -chain.mass * (of_joint + arm * turn + 1j * scene.gravity)
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


def _cross(a: Array, b: Array) -> Array:
    return np.asarray((np.conj(a) * b).imag)
